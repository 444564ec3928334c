//! The bytes behind buffers and buffer views, read and decompressed on first use.

use super::document::Document;
use super::json::{BufferView, Meshopt};
use super::uri::{self, Target};
use crate::LoadError;
use crate::load::meshopt::{self, Filter, MeshoptError};
use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The contents of all buffers. A buffer that nothing refers to is never opened.
pub(super) struct Buffers<'a> {
    binary: Option<&'a [u8]>,
    contents: Vec<OnceLock<Result<Cow<'a, [u8]>, Unreadable>>>,
    /// What compressed buffer views hold, or why they could not be decoded.
    decoded: Vec<OnceLock<Result<Vec<u8>, String>>>,
    /// Bytes that came from other files or from data URIs.
    pub extra_bytes: AtomicU64,
}

/// Why a buffer has no content; kept because several accessors may ask for the same buffer.
enum Unreadable {
    /// The file is missing, too large or unreadable.
    File(LoadError),
    /// The file does not say where the data are.
    Nowhere,
    /// A sentence.
    Other(String),
    /// A fallback buffer without data of this compression.
    Compressed(&'static str),
}

impl<'a> Buffers<'a> {
    /// `count` buffers, of which the first may be the binary chunk of the container, and `views` buffer views.
    pub fn new(binary: Option<&'a [u8]>, count: usize, views: usize) -> Self {
        let contents = std::iter::repeat_with(OnceLock::new).take(count).collect();
        let decoded = std::iter::repeat_with(OnceLock::new).take(views).collect();
        Self { binary, contents, decoded, extra_bytes: AtomicU64::new(0) }
    }
}

impl<'a> Document<'a> {
    /// The bytes of a buffer view.
    ///
    /// # Errors
    /// The view or its buffer does not exist, cannot be read or decoded, or the view reaches beyond its buffer.
    pub fn view(&self, index: u32) -> Result<(&[u8], &BufferView), LoadError> {
        let view = self.get(&self.json.buffer_views, index, "buffer view")?;
        let object = || format!("buffer view {index}");
        let Some(compressed) = view.extensions.compressed() else {
            return Ok((self.range(view.buffer, view.byte_offset, view.byte_length, &object)?, view));
        };
        match self.buffers.decoded[index as usize].get_or_init(|| self.decode(compressed, &object)) {
            Ok(bytes) => Ok((bytes, view)),
            // A file may bring an uncompressed copy for readers that do not know the encoding.
            Err(reason) => match self.range(view.buffer, view.byte_offset, view.byte_length, &object) {
                Ok(bytes) => Ok((bytes, view)),
                Err(_) => Err(self.malformed(object(), reason)),
            },
        }
    }

    /// Some bytes of a buffer.
    fn range(
        &self,
        buffer: u32,
        offset: u64,
        length: u64,
        object: &dyn Fn() -> String,
    ) -> Result<&[u8], LoadError> {
        let buffer = self.buffer(buffer, object)?;
        let end = offset.checked_add(length);
        let range = usize::try_from(offset).ok().zip(end.and_then(|e| usize::try_from(e).ok()));
        range.and_then(|(start, end)| buffer.get(start..end)).ok_or_else(|| {
            let message =
                format!("{length} bytes at {offset} reach beyond the {} of its buffer", buffer.len());
            self.malformed(object(), message)
        })
    }

    /// The elements that `KHR_meshopt_compression` or `EXT_meshopt_compression` made smaller.
    fn decode(&self, source: &Meshopt, object: &dyn Fn() -> String) -> Result<Vec<u8>, String> {
        let bytes = self.range(source.buffer, source.byte_offset, source.byte_length, object);
        let bytes = bytes.map_err(|e| e.to_string())?;
        self.reserve::<u8>(source.count.saturating_mul(source.byte_stride)).map_err(|e| e.to_string())?;
        let (count, size) = (source.count as usize, source.byte_stride as usize);
        let indices = |indices: Vec<u32>| match size {
            2 => Ok(indices.iter().flat_map(|i| (*i as u16).to_le_bytes()).collect()),
            4 => Ok(indices.iter().flat_map(|i| i.to_le_bytes()).collect()),
            _ => Err(MeshoptError::ElementSize(size)),
        };
        let decoded = match source.mode.as_str() {
            "ATTRIBUTES" => meshopt::decode_vertices(bytes, count, size),
            "TRIANGLES" => meshopt::decode_triangles(bytes, count).and_then(indices),
            "INDICES" => meshopt::decode_sequence(bytes, count).and_then(indices),
            other => return Err(format!("the compression mode {other} does not exist")),
        };
        let mut decoded = decoded.map_err(|e| e.to_string())?;
        let filter = match source.filter.as_deref() {
            None | Some("NONE") => None,
            Some("OCTAHEDRAL") => Some(Filter::Octahedral),
            Some("QUATERNION") => Some(Filter::Quaternion),
            Some("EXPONENTIAL") => Some(Filter::Exponential),
            Some("COLOR") => Some(Filter::Color),
            Some(other) => return Err(format!("the compression filter {other} is not supported")),
        };
        filter.map_or(Ok(()), |filter| filter.undo(&mut decoded, size)).map_err(|e| e.to_string())?;
        Ok(decoded)
    }

    /// The bytes of a buffer: never more than it declares, possibly fewer.
    fn buffer(&self, index: u32, user: impl Fn() -> String) -> Result<&[u8], LoadError> {
        let missing = || self.malformed(user(), format!("refers to buffer {index}, which does not exist"));
        let content = self.buffers.contents.get(index as usize).ok_or_else(missing)?;
        match content.get_or_init(|| self.read_buffer(index as usize)) {
            Ok(bytes) => {
                let declared = usize::try_from(self.json.buffers[index as usize].byte_length);
                Ok(&bytes[..bytes.len().min(declared.unwrap_or(usize::MAX))])
            }
            Err(Unreadable::Nowhere) => {
                Err(LoadError::NoData { path: self.path.to_owned(), object: format!("buffer {index}") })
            }
            Err(Unreadable::Other(message)) => Err(self.malformed(format!("buffer {index}"), message)),
            Err(Unreadable::Compressed(extension)) => Err(self.unsupported(user(), extension)),
            Err(Unreadable::File(error)) => Err(copy(error)),
        }
    }

    fn read_buffer(&self, index: usize) -> Result<Cow<'a, [u8]>, Unreadable> {
        let buffer = &self.json.buffers[index];
        let Some(uri) = &buffer.uri else {
            if let Some(extension) = buffer.extensions.name() {
                return Err(Unreadable::Compressed(extension));
            }
            let binary = self.buffers.binary.filter(|_| index == 0);
            return binary.map(Cow::Borrowed).ok_or(Unreadable::Nowhere);
        };
        let bytes = match uri::resolve(self.path, &uri.0, self.options).map_err(Unreadable::Other)? {
            Target::Data(bytes) => bytes,
            Target::File(path) => self.options.read(&path).map_err(Unreadable::File)?,
        };
        self.buffers.extra_bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(Cow::Owned(bytes))
    }
}

/// A copy of an error of `LoadOptions::read`: `std::io::Error` cannot be cloned.
fn copy(error: &LoadError) -> LoadError {
    match error {
        LoadError::Read { path, source } => {
            let source = std::io::Error::new(source.kind(), source.to_string());
            LoadError::Read { path: path.clone(), source }
        }
        LoadError::TooLarge { path, what, size, limit } => {
            LoadError::TooLarge { path: path.clone(), what: what.clone(), size: *size, limit: *limit }
        }
        other => LoadError::malformed(std::path::Path::new(""), "buffer", other.to_string()),
    }
}
