//! Compiled pipelines, kept from one run of the program to the next: drivers that keep none themselves compile for seconds.
//!
//! The file is the driver's own (`VkPipelineCache`), behind a hash of it: what is damaged is not given to the driver. It
//! is a convenience. Whatever goes wrong with it, pipelines are compiled as if there were none.

use film::{ImageError, write_atomically};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use wgpu::{AdapterInfo, DeviceType, Features};

/// What such a file begins with; its hash follows.
const MAGIC: &[u8; 8] = b"ALHPIPE1";
/// Bytes of a hash.
const HASH: usize = 32;
/// A file that is larger is begun anew: pipelines of earlier versions are never taken out of it.
const LARGEST: usize = 256 << 20;

/// The variable that names the folder of what may be deleted at any time; `off` keeps nothing.
pub const FOLDER: &str = "ALHAZEN_CACHE";

/// The pipelines of a device.
pub(crate) struct PipelineStore {
    cache: wgpu::PipelineCache,
    file: PathBuf,
    /// Whether a pipeline was made since the file was read.
    grown: AtomicBool,
}

impl PipelineStore {
    /// The store of a device, with what earlier runs have left. `None` where the driver has no such thing, keeps
    /// pipelines itself (Mesa's software driver does), or where there is no folder for it.
    pub fn open(device: &wgpu::Device, features: Features, info: &AdapterInfo) -> Option<Self> {
        if !features.contains(Features::PIPELINE_CACHE) || info.device_type == DeviceType::Cpu {
            return None;
        }
        let file = folder()?.join(file_name(info)?);
        let data = read(&file);
        let descriptor = wgpu::PipelineCacheDescriptor {
            label: Some("alhazen"),
            data: data.as_deref(),
            // Data of another version of the driver are as good as none.
            fallback: true,
        };
        // SAFETY: the data were returned by `get_data`, as their hash says, or there are none.
        let cache = unsafe { device.create_pipeline_cache(&descriptor) };
        Some(Self { cache, file, grown: AtomicBool::new(false) })
    }

    /// For the descriptors of pipelines.
    pub fn cache(&self) -> &wgpu::PipelineCache {
        // Who asks makes a pipeline.
        self.grown.store(true, Ordering::Relaxed);
        &self.cache
    }

    /// Writes what has come to it.
    fn keep(&self) {
        let Some(data) = self.cache.get_data().filter(|_| self.grown.swap(false, Ordering::Relaxed)) else {
            return;
        };
        // Pipelines that were there already change nothing.
        if read(&self.file).is_none_or(|known| known != data) {
            // A folder that cannot be written is no reason to trouble anybody.
            let _ = write(&self.file, &data);
        }
    }
}

impl Drop for PipelineStore {
    fn drop(&mut self) {
        self.keep();
    }
}

/// The file of a device and its driver; `None` for interfaces of drivers that have none.
fn file_name(info: &AdapterInfo) -> Option<String> {
    let key = wgpu::util::pipeline_cache_key(info)?;
    let driver = blake3::hash(format!("{} {}", info.driver, info.driver_info).as_bytes());
    Some(format!("{key}_{}", &driver.to_hex()[..16]))
}

/// The folder `alhazen/pipelines` among what the user's programs may find again or not.
fn folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    if let Some(said) = variable(FOLDER) {
        return (said != Path::new("off")).then(|| said.join("pipelines"));
    }
    let folder = variable("XDG_CACHE_HOME").or_else(|| {
        if cfg!(windows) { variable("LOCALAPPDATA") } else { Some(variable("HOME")?.join(".cache")) }
    });
    Some(folder?.join("alhazen/pipelines"))
}

/// What a file holds; `None` if it is not there, damaged, or too large.
fn read(file: &Path) -> Option<Vec<u8>> {
    let size = std::fs::metadata(file).ok()?.len();
    if size > LARGEST as u64 {
        return None;
    }
    let bytes = std::fs::read(file).ok()?;
    let (hash, data) = bytes.strip_prefix(MAGIC)?.split_at_checked(HASH)?;
    (blake3::hash(data).as_bytes() == hash).then(|| data.to_vec())
}

fn write(file: &Path, data: &[u8]) -> Result<(), ImageError> {
    let failed = |source| ImageError::Write { path: file.to_owned(), source };
    std::fs::create_dir_all(file.parent().unwrap_or(file)).map_err(failed)?;
    write_atomically(file, |out| {
        [&MAGIC[..], blake3::hash(data).as_bytes(), data]
            .iter()
            .try_for_each(|part| out.write_all(part))
            .map_err(failed)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_damaged_is_as_good_as_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a/b/pipelines");
        assert_eq!(read(&file), None);
        write(&file, b"compiled").expect("written");
        assert_eq!(read(&file).as_deref(), Some(&b"compiled"[..]));
        let whole = std::fs::read(&file).expect("read");
        for broken in [&whole[..20], &whole[..whole.len() - 1], b"", &[&whole[..], b"x"].concat()] {
            std::fs::write(&file, broken).expect("written");
            assert_eq!(read(&file), None);
        }
    }

    #[test]
    fn other_drivers_have_other_files() {
        let info = |driver: &str| {
            let mut info = AdapterInfo::new(DeviceType::DiscreteGpu, wgpu::Backend::Vulkan);
            info.driver_info = driver.into();
            info
        };
        assert_ne!(file_name(&info("1.0")), file_name(&info("1.1")));
        assert!(file_name(&AdapterInfo::new(DeviceType::DiscreteGpu, wgpu::Backend::Metal)).is_none());
    }
}
