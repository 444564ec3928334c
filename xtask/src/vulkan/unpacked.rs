//! Mesa's software driver unpacked into a folder, for those who cannot or do not want to install it.

use super::{Variables, apt};
use anyhow::Context;
use std::path::{Path, PathBuf};

/// Where the unpacked driver's description for the Vulkan loader is written, relative to the folder.
const DESCRIPTION: &str = "lavapipe.json";

/// Downloads the driver and unpacks it into `folder`; returns the variables that make programs use it.
pub fn unpack(folder: &Path) -> anyhow::Result<Variables> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    // Programs find the driver from any working directory.
    let folder = folder.canonicalize().with_context(|| format!("cannot find {}", folder.display()))?;
    eprintln!("unpacking Mesa's software Vulkan driver into {}", folder.display());
    let root = folder.join("root");
    apt::unpack(&apt::download(&apt::PACKAGES, apt::newer_suite(), &folder.join("apt"))?, &root)?;
    let driver = find(&root.join("usr/lib"), "libvulkan_lvp.so")
        .with_context(|| format!("the packages have no lavapipe: {}", root.display()))?;
    let description = serde_json::json!({
        "file_format_version": "1.0.0",
        "ICD": { "library_path": driver, "api_version": "1.4.0" },
    });
    let file = folder.join(DESCRIPTION);
    std::fs::write(&file, description.to_string())
        .with_context(|| format!("cannot write {}", file.display()))?;
    variables(&folder).with_context(|| format!("{} is not usable after unpacking", folder.display()))
}

/// The variables that make programs use the driver unpacked in `folder`, if there is one.
pub fn variables(folder: &Path) -> Option<Variables> {
    let description = folder.join(DESCRIPTION);
    let text = std::fs::read_to_string(&description).ok()?;
    let value: serde_json::Value = serde_json::from_str(&text).ok()?;
    let libraries = Path::new(value["ICD"]["library_path"].as_str()?).parent()?;
    // `usr/lib/x86_64-linux-gnu`, say; some packages have their libraries in `lib/x86_64-linux-gnu`.
    let old_libraries = folder.join("root/lib").join(libraries.file_name()?);
    let mut search = format!("{}:{}", libraries.display(), old_libraries.display());
    if let Ok(before) = std::env::var("LD_LIBRARY_PATH") {
        search += &format!(":{before}");
    }
    Some(vec![
        ("VK_DRIVER_FILES".into(), description.to_string_lossy().into_owned()),
        ("LD_LIBRARY_PATH".into(), search),
    ])
}

/// The file called `name` somewhere below `folder`.
fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    let entries: Vec<_> = std::fs::read_dir(folder).ok()?.filter_map(|e| Some(e.ok()?.path())).collect();
    let here = entries.iter().find(|p| p.file_name().is_some_and(|n| n == name)).cloned();
    here.or_else(|| entries.iter().filter(|p| p.is_dir() && !p.is_symlink()).find_map(|p| find(p, name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_folder_has_no_driver() {
        assert_eq!(variables(Path::new("/nowhere")), None);
        assert_eq!(find(Path::new("/nowhere"), "libvulkan_lvp.so"), None);
    }
}
