//! ETC1S with BasisLZ: blocks of 4×4 pixels that name entries of two codebooks, which all pictures of the file share.
//!
//! A block of an *endpoint* (a colour and how far to go from it) and *selectors* (how far each pixel goes) is one of ETC1 whose
//! halves are equal. Alpha is a picture of its own, in its green channel. Source: KTX File Format Specification 2.0, section
//! "BasisLZ Global Data", and ".basis File Format and ETC1S Texture Video Specification" (Basis Universal).

mod bits;
mod codebooks;
mod error;
mod huffman;
mod slice;

use crate::load::textures::error::TextureError;
use codebooks::Codebooks;
use error::Etc1sError;
use slice::Tables;

/// Bytes before the descriptions of pictures, and bytes of each of them.
const HEADER_BYTES: usize = 20;
const PICTURE_BYTES: usize = 20;

/// The pixels of the first picture of the first level, of `size` (width, height), row by row.
///
/// - `global`: the file's supercompression global data.
/// - `pictures`: how many it describes: those of all levels, layers and faces.
/// - `level`: the data of the first level.
///
/// # Errors
/// See [`Etc1sError`].
pub(super) fn decode(
    global: &[u8],
    pictures: u64,
    level: &[u8],
    size: (usize, usize),
) -> Result<Vec<[u8; 4]>, TextureError> {
    let sections = Sections::of(global, pictures)?;
    let codebooks = Codebooks::read(sections.endpoints, sections.selectors)?;
    let tables = Tables::read(sections.tables)?;
    let picture = |range: Range| slice::decode(range.of(level)?, &tables, &codebooks, size);
    let color = picture(sections.color)?;
    let opaque = |[r, g, b]: [u8; 3]| [r, g, b, 255];
    if sections.alpha.length == 0 {
        return Ok(color.into_iter().map(opaque).collect());
    }
    let alpha = picture(sections.alpha)?;
    Ok(color.into_iter().zip(alpha).map(|([r, g, b], [_, a, _])| [r, g, b, a]).collect())
}

/// A part of a level's data, in bytes.
#[derive(Clone, Copy)]
struct Range {
    offset: usize,
    length: usize,
}

impl Range {
    fn of(self, level: &[u8]) -> Result<&[u8], Etc1sError> {
        let rest = level.get(self.offset..).and_then(|rest| rest.get(..self.length));
        rest.ok_or(Etc1sError::Short("a picture"))
    }
}

/// What the global data consists of.
struct Sections<'d> {
    /// The codebook of endpoints, and how many there are.
    endpoints: (&'d [u8], usize),
    /// The codebook of selectors, and how many there are.
    selectors: (&'d [u8], usize),
    /// Prefix codes of pictures.
    tables: &'d [u8],
    /// Colours of the first picture.
    color: Range,
    /// Its alpha; no length if it is opaque.
    alpha: Range,
}

impl<'d> Sections<'d> {
    fn of(global: &'d [u8], pictures: u64) -> Result<Self, Etc1sError> {
        let header = global.get(..HEADER_BYTES + PICTURE_BYTES).ok_or(Etc1sError::Short("the header"))?;
        // The words are two counts of 16 bits, lengths of endpoints, selectors, tables and extensions, then the first picture's
        // flags, and its colours and alpha, offset and length each.
        let (words, _) = header.as_chunks::<4>();
        let word = |i: usize| u32::from_le_bytes(words[i]) as usize;
        let picture_bytes = pictures.saturating_mul(PICTURE_BYTES as u64).try_into().unwrap_or(usize::MAX);
        let mut rest = &global[HEADER_BYTES..];
        let mut section = |length: usize, name| {
            let (section, after) = rest.split_at_checked(length).ok_or(Etc1sError::Short(name))?;
            rest = after;
            Ok(section)
        };
        section(picture_bytes, "the list of pictures")?;
        Ok(Self {
            endpoints: (section(word(1), "the codebook of endpoints")?, word(0) & 0xffff),
            selectors: (section(word(2), "the codebook of selectors")?, word(0) >> 16),
            tables: section(word(3), "the prefix codes")?,
            color: Range { offset: word(6), length: word(7) },
            alpha: Range { offset: word(8), length: word(9) },
        })
    }
}
