//! A parsed file with everything that its parts need to be read: errors that name it, limits, options.

use super::buffers::Buffers;
use super::json::Gltf;
use crate::{LoadError, LoadOptions, LoadReport};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// A parsed file. Reading from it needs no exclusive access, so that meshes can be built in parallel.
pub(super) struct Document<'a> {
    pub path: &'a Path,
    pub options: &'a LoadOptions,
    pub json: Gltf<'a>,
    pub buffers: Buffers<'a>,
    file_size: u64,
    used: AtomicU64,
}

/// Memory that any file may fill, in bytes, however small it is.
const FREE_MEMORY: u64 = 256 << 20;
/// Beyond that a file may fill this many times its size. Quantized data grows up to fourfold, and several primitives
/// may share data.
const MEMORY_PER_BYTE: u64 = 16;

impl<'a> Document<'a> {
    /// A document of parsed JSON.
    pub fn new(
        path: &'a Path,
        options: &'a LoadOptions,
        json: Gltf<'a>,
        binary: Option<&'a [u8]>,
        file_size: u64,
    ) -> Self {
        let compressed = json.buffer_views.iter().any(|v| v.extensions.compressed().is_some());
        let views = if compressed { json.buffer_views.len() } else { 0 };
        let buffers = Buffers::new(binary, json.buffers.len(), views);
        Self { path, options, json, buffers, file_size, used: AtomicU64::new(0) }
    }

    /// Looks at the version that the file is written in.
    ///
    /// # Errors
    /// [`LoadError::Malformed`] for what is not glTF 2.
    pub fn check_version(&self, report: &mut LoadReport) -> Result<(), LoadError> {
        let asset = self.json.asset.as_ref();
        let version = asset.and_then(|a| a.version.as_deref());
        let Some(version) = version else {
            return Err(self.malformed("asset", "has no version: this is not a glTF 2.0 file"));
        };
        if !version.starts_with("2.") && version != "2" {
            return Err(self.malformed("asset", format!("version `{version}` is not supported, only 2.x")));
        }
        match asset.and_then(|a| a.min_version.as_deref()) {
            None | Some("2.0") => {}
            // Versions of the same first number only add to what there was.
            Some(min) if min.starts_with("2.") || self.options.lenient => report.ignored(format!(
                "the file asks for readers of glTF {min}; this one knows 2.0, what is newer is left out"
            )),
            Some(min) => {
                return Err(self.malformed("asset", format!("requires version `{min}`, supported is 2.0")));
            }
        }
        Ok(())
    }

    /// A [`LoadError::Malformed`] in this file.
    pub fn malformed(&self, object: impl Into<String>, message: impl Into<String>) -> LoadError {
        LoadError::malformed(self.path, object, message)
    }

    /// A [`LoadError::UnsupportedExtension`] in this file.
    pub fn unsupported(&self, object: impl Into<String>, extension: &str) -> LoadError {
        let (object, extension) = (object.into(), extension.into());
        LoadError::UnsupportedExtension { path: self.path.to_owned(), object, extension }
    }

    /// The element `index` of one of the file's arrays; `what` is what the array holds.
    ///
    /// # Errors
    /// There is no such element.
    pub fn get<'t, T>(&self, list: &'t [T], index: u32, what: &str) -> Result<&'t T, LoadError> {
        list.get(index as usize).ok_or_else(|| {
            let message = format!("is referred to, but there are only {}", list.len());
            self.malformed(format!("{what} {index}"), message)
        })
    }

    /// Announces `count` objects of `T` that will be allocated.
    ///
    /// # Errors
    /// [`LoadError::TooLarge`] when a file asks for far more memory than it could fill with data.
    pub fn reserve<T>(&self, count: u64) -> Result<(), LoadError> {
        let bytes = count.saturating_mul(size_of::<T>() as u64);
        let input = self.file_size + self.buffers.extra_bytes.load(Ordering::Relaxed);
        let limit = FREE_MEMORY + MEMORY_PER_BYTE * input;
        let size = self.used.fetch_add(bytes.min(1 << 60), Ordering::Relaxed).saturating_add(bytes);
        if size > limit {
            let what = "the geometry it describes".into();
            return Err(LoadError::TooLarge { path: self.path.to_owned(), what, size, limit });
        }
        // Twice: what is read is stored again in the tables.
        self.options.budget().take(bytes.saturating_mul(2), "geometry")
    }
}
