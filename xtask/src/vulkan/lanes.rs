//! How wide the vectors are for which Mesa's software driver compiles shaders.
//!
//! Tests trace some thousand rays with each of some hundred kernels, so its compiler works most of the time. It takes half
//! the time for vectors of four lanes, and what it makes is no slower than with eight.

use super::Variables;
use crate::shell::target_dir;
use anyhow::Context;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The bits of a vector of four lanes, by the variable that says so. Other drivers do not know it.
const FOUR_LANES: (&str, &str) = ("LP_NATIVE_VECTOR_WIDTH", "128");

/// Where Mesa keeps compiled shaders.
const CACHE: &str = "MESA_SHADER_CACHE_DIR";

/// The variables that make the driver take four lanes; none where the environment says how many already.
///
/// The names under which Mesa keeps compiled shaders do not tell how wide their vectors are (seen with 25.0.7). A program
/// that takes four lanes would find those that another program left for eight, and they write past the ends of what the
/// driver allocates for four: "malloc(): invalid next size". So shaders for four lanes have a folder of their own.
///
/// # Errors
/// The folder for them cannot be made.
pub fn four_lanes() -> anyhow::Result<Variables> {
    let (name, bits) = FOUR_LANES;
    if std::env::var_os(name).is_some() {
        return Ok(Variables::new());
    }
    let folder = cache_folder(std::env::var_os(CACHE).as_deref(), &target_dir()?);
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let path = folder.to_str().with_context(|| format!("not in UTF-8: {}", folder.display()))?;
    Ok(vec![(name.to_owned(), bits.to_owned()), (CACHE.to_owned(), path.to_owned())])
}

/// A folder below the one that is `said`, if any, and below that of builds otherwise.
fn cache_folder(said: Option<&OsStr>, target: &Path) -> PathBuf {
    match said {
        Some(said) => Path::new(said).join("four-lanes"),
        None => target.join("software-vulkan-shaders"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_for_four_lanes_have_a_folder_of_their_own() {
        let variables = four_lanes().expect("the folder of builds can be written");
        let value = |name: &str| variables.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str());
        if std::env::var_os(FOUR_LANES.0).is_some() {
            assert_eq!(variables, Variables::new(), "what the environment says stands");
        } else {
            assert_eq!(value(FOUR_LANES.0), Some(FOUR_LANES.1));
            let folder = value(CACHE).expect("never one without the other");
            assert!(Path::new(folder).is_dir(), "Mesa makes one level of folders, not several: {folder}");
        }
    }

    #[test]
    fn the_folder_is_not_the_one_that_others_use() {
        let target = Path::new("/build");
        assert_eq!(cache_folder(None, target), Path::new("/build/software-vulkan-shaders"));
        let said = cache_folder(Some(OsStr::new("/shaders")), target);
        assert_eq!(said, Path::new("/shaders/four-lanes"));
    }
}
