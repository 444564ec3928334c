//! The bytes behind buffers and buffer views, read on first use.

use super::document::Document;
use super::json::BufferView;
use super::uri::{self, Target};
use crate::LoadError;
use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The contents of all buffers. A buffer that nothing refers to is never opened.
pub(super) struct Buffers<'a> {
    binary: Option<&'a [u8]>,
    contents: Vec<OnceLock<Result<Cow<'a, [u8]>, Unreadable>>>,
    /// Bytes that came from other files or from data URIs.
    pub extra_bytes: AtomicU64,
}

/// Why a buffer has no content; kept because several accessors may ask for the same buffer.
enum Unreadable {
    /// The file is missing, too large or unreadable.
    File(LoadError),
    /// A sentence.
    Other(String),
    /// A fallback buffer without data of this compression.
    Compressed(&'static str),
}

impl<'a> Buffers<'a> {
    /// `count` buffers; the first may be the binary chunk of the container.
    pub fn new(binary: Option<&'a [u8]>, count: usize) -> Self {
        let contents = std::iter::repeat_with(OnceLock::new).take(count).collect();
        Self { binary, contents, extra_bytes: AtomicU64::new(0) }
    }
}

impl<'a> Document<'a> {
    /// The bytes of a buffer view.
    ///
    /// # Errors
    /// The view or its buffer does not exist, cannot be read, is compressed, or the view reaches beyond its buffer.
    pub fn view(&self, index: u32) -> Result<(&[u8], &BufferView), LoadError> {
        let view = self.get(&self.json.buffer_views, index, "buffer view")?;
        let object = || format!("buffer view {index}");
        let compressed =
            |error| view.extensions.name().map_or(error, |name| self.unsupported(object(), name));
        let buffer = self.buffer(view.buffer, object).map_err(compressed)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let range = usize::try_from(view.byte_offset).ok().zip(end.and_then(|e| usize::try_from(e).ok()));
        let bytes = range.and_then(|(start, end)| buffer.get(start..end)).ok_or_else(|| {
            let (offset, length) = (view.byte_offset, view.byte_length);
            let message =
                format!("{length} bytes at {offset} reach beyond the {} of its buffer", buffer.len());
            self.malformed(object(), message)
        })?;
        Ok((bytes, view))
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
            return binary.map(Cow::Borrowed).ok_or(Unreadable::Other("has no data".into()));
        };
        let bytes = match uri::resolve(self.path, &uri.0).map_err(Unreadable::Other)? {
            Target::Data(bytes) => bytes,
            Target::File(path) => crate::load::read_file(&path, self.options).map_err(Unreadable::File)?,
        };
        self.buffers.extra_bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(Cow::Owned(bytes))
    }
}

/// A copy of an error of `read_file`: `std::io::Error` cannot be cloned.
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
