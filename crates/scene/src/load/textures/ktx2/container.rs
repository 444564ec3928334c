//! The container: where a file keeps what.
//!
//! Headers and metadata are taken apart by the crate `ktx2`; its reader of whole files is not used because it panics on some
//! damaged data format descriptors.

use crate::load::textures::error::TextureError;
use ::ktx2::{Header, KeyValueDataIterator, LevelIndex};

/// The parts of a file that its first picture needs.
pub(super) struct Container<'f> {
    pub header: Header,
    /// Number of the color model in the data format descriptor.
    pub color_model: u8,
    /// Whether colours were multiplied by alpha.
    pub premultiplied: bool,
    /// Data of the largest level, still compressed if the header says so.
    pub level: &'f [u8],
    /// What a compression keeps for all levels.
    pub global: &'f [u8],
    metadata: &'f [u8],
}

/// Where the color model and the flags stand in the descriptor: behind its length and the first block's header of 8 bytes.
const COLOR_MODEL: usize = 12;
const FLAGS: usize = 15;

impl<'f> Container<'f> {
    /// Reads the header, and finds the parts.
    ///
    /// # Errors
    /// A header that is none, and parts that reach beyond the file, by their name.
    pub fn read(file: &'f [u8]) -> Result<Self, TextureError> {
        let failed = |what: String| TextureError::Decode(format!("the container: {what}"));
        let part = |name: &str, offset: u64, length: u64| {
            let end = offset.checked_add(length).and_then(|end| usize::try_from(end).ok());
            let found = end.and_then(|end| file.get(usize::try_from(offset).ok()?..end));
            found.ok_or_else(|| failed(format!("{name} reaches beyond the file")))
        };
        let Some(start) = file.first_chunk::<{ Header::LENGTH }>() else {
            return Err(failed("the header is not complete".into()));
        };
        let header = Header::from_bytes(start).map_err(|e| failed(e.to_string()))?;
        let levels = file[Header::LENGTH..].first_chunk::<{ LevelIndex::LENGTH }>();
        let level = LevelIndex::from_bytes(levels.ok_or_else(|| failed("there is no level".into()))?);
        let index = &header.index;
        let descriptor =
            part("the data format descriptor", index.dfd_byte_offset.into(), index.dfd_byte_length.into())?;
        Ok(Self {
            color_model: descriptor.get(COLOR_MODEL).copied().unwrap_or(0),
            premultiplied: descriptor.get(FLAGS).is_some_and(|flags| flags & 1 == 1),
            level: part("the first level", level.byte_offset, level.byte_length)?,
            global: part("the global data", index.sgd_byte_offset, index.sgd_byte_length)?,
            metadata: part("the metadata", index.kvd_byte_offset.into(), index.kvd_byte_length.into())?,
            header,
        })
    }

    /// How many pictures the file has: all levels, layers, faces and slices of volumes.
    pub fn pictures(&self) -> u64 {
        let header = &self.header;
        let counts = [header.level_count, header.layer_count, header.face_count, header.pixel_depth];
        counts.iter().fold(1, |product: u64, count| product.saturating_mul((*count).max(1).into()))
    }

    /// A value of the metadata, without the zero byte at its end.
    pub fn text(&self, key: &str) -> Option<&'f [u8]> {
        let (_, value) = KeyValueDataIterator::new(self.metadata).find(|(k, _)| *k == key)?;
        Some(value.strip_suffix(b"\0").unwrap_or(value))
    }
}
