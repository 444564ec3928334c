//! Mesa's software driver by way of the crate `lavapipe`, so that its shaders compile in seconds.
//!
//! Programs find a driver by its manifest. One is written beside the build that names the crate's
//! library in the place of Mesa's, and a variable tells the library where that is.

use super::Variables;
use super::probe::Device;
use crate::shell::{cargo, output, target_dir};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What the names of the driver's devices begin with.
const DEVICE: &str = "llvmpipe";

/// The variables by which programs find drivers, and where they look without them.
const MANIFESTS: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
const FOLDERS: [&str; 3] = ["/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/usr/share/vulkan/icd.d"];

/// The variable by which the library finds the real driver.
const REAL: &str = "ALHAZEN_LAVAPIPE";

/// The variables that put the library between programs and the driver that they find with
/// `present`; none for other drivers than Mesa's and where there is no such library.
///
/// # Errors
/// The driver's library is not found, or the crate's cannot be built.
pub fn variables(device: &Device, present: &Variables) -> anyhow::Result<Variables> {
    if !cfg!(target_os = "linux") || !device.name.starts_with(DEVICE) || std::env::var_os(REAL).is_some() {
        return Ok(Variables::new());
    }
    let manifests = manifests(present);
    let real = manifests.iter().find_map(|file| library(file));
    let real = real.with_context(|| format!("no manifest of the driver among {manifests:?}"))?;
    output(&mut cargo(&["build", "--package", "lavapipe"]))?;
    let target = target_dir()?;
    let own = target.join("debug/liblavapipe.so");
    ensure!(own.is_file(), "there is no {}", own.display());
    let manifest = target.join("lavapipe.json");
    let text = serde_json::json!({
        "file_format_version": "1.0.0",
        "ICD": { "library_path": own, "api_version": "1.4.0" },
    });
    std::fs::write(&manifest, text.to_string())
        .with_context(|| format!("cannot write {}", manifest.display()))?;
    let manifest = manifest.to_string_lossy().into_owned();
    Ok(vec![(MANIFESTS[0].to_owned(), manifest), (REAL.to_owned(), real)])
}

/// The manifests that programs read: those that a variable names, or all of the system's.
fn manifests(present: &Variables) -> Vec<PathBuf> {
    let named = |name: &str| {
        let given = present.iter().find(|(n, _)| n == name).map(|(_, value)| value.into());
        given.or_else(|| std::env::var_os(name))
    };
    if let Some(list) = MANIFESTS.into_iter().find_map(named) {
        return std::env::split_paths(&list).collect();
    }
    let files = FOLDERS.iter().filter_map(|folder| std::fs::read_dir(folder).ok());
    files.flatten().flatten().map(|entry| entry.path()).collect()
}

/// The library of Mesa's software driver that a manifest names: a path, or a name that the linker
/// finds. `None` for others.
fn library(manifest: &Path) -> Option<String> {
    let text = std::fs::read_to_string(manifest).ok()?;
    let value: Value = serde_json::from_str(&text).ok()?;
    let library = value["ICD"]["library_path"].as_str().filter(|path| path.contains("libvulkan_lvp"))?;
    // Paths are those from the manifest's folder on.
    let path = if library.contains('/') { manifest.parent()?.join(library) } else { library.into() };
    Some(path.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn manifests_tell_where_mesas_driver_is() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("lvp_icd.json");
        let named = |path: &str| {
            let text = serde_json::json!({ "ICD": { "library_path": path } });
            std::fs::write(&file, text.to_string()).expect("written");
            library(&file)
        };
        assert_eq!(named("libvulkan_lvp.so").as_deref(), Some("libvulkan_lvp.so"));
        assert_eq!(named("/lib/libvulkan_lvp.so").as_deref(), Some("/lib/libvulkan_lvp.so"));
        let below = folder.path().join("../libvulkan_lvp.so");
        assert_eq!(named("../libvulkan_lvp.so"), Some(below.to_string_lossy().into_owned()));
        assert_eq!(named("libvulkan_radeon.so"), None);
        let present = vec![("VK_DRIVER_FILES".to_owned(), "/a.json:/b.json".to_owned())];
        assert_eq!(manifests(&present), [Path::new("/a.json"), Path::new("/b.json")]);
    }

    #[test]
    fn other_drivers_are_taken_as_they_are() {
        let device = Device { name: "Some GPU".into(), queries: true, pipelines: true };
        assert_eq!(variables(&device, &Variables::new()).expect("nothing to do"), Variables::new());
    }
}
