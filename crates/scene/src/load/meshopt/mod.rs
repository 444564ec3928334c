//! Decoders of `KHR_meshopt_compression` and of `EXT_meshopt_compression`, which is its older version: vertex attributes,
//! triangles and index sequences, and filters over attributes.
//!
//! Source: the extensions' specifications, appendix A (bitstreams) and B (filters).

mod filter;
mod indices;
mod vertices;

pub use filter::Filter;
pub use indices::{decode_sequence, decode_triangles};
pub use vertices::decode_vertices;

/// Why data could not be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshoptError {
    /// The first byte is not that of a known version.
    #[error("the first byte {found:#04x} is not that of a known version")]
    Header {
        /// The first byte; 0 for empty data.
        found: u8,
    },
    /// The data ends too early.
    #[error("the compressed data ends too early")]
    Truncated,
    /// There is data beyond the last element.
    #[error("the compressed data is longer than its elements")]
    TooLong,
    /// Elements of a size that the encoding or the filter does not have.
    #[error("elements of {0} bytes cannot be decoded in this mode")]
    ElementSize(usize),
    /// A channel of vertices that is stored in no known way.
    #[error("a channel is stored in the mode {0:#04x}, which does not exist")]
    Channel(u8),
    /// Triangles of less or more than three indices.
    #[error("{0} indices are no triangles")]
    IndexCount(usize),
}

/// Bytes that are read from front to back.
struct Bytes<'d>(&'d [u8]);

impl<'d> Bytes<'d> {
    fn take(&mut self, count: usize) -> Result<&'d [u8], MeshoptError> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(MeshoptError::Truncated)?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, MeshoptError> {
        Ok(self.take(1)?[0])
    }

    /// An integer of seven bits a byte, the lowest first, at most five bytes.
    fn variable(&mut self) -> Result<u32, MeshoptError> {
        let mut value = 0u32;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 127).checked_shl(shift).unwrap_or(0);
            if byte < 128 {
                break;
            }
        }
        Ok(value)
    }
}

/// The header, checked: high bits that say what follows, and a version of at most `newest`.
fn version(data: &mut Bytes<'_>, kind: u8, newest: u8) -> Result<u8, MeshoptError> {
    let found = data.byte().map_err(|_| MeshoptError::Header { found: 0 })?;
    let version = found & 0x0f;
    if found & 0xf0 == kind && version <= newest { Ok(version) } else { Err(MeshoptError::Header { found }) }
}

/// Signed differences with the sign in the lowest bit.
fn unzigzag(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}
