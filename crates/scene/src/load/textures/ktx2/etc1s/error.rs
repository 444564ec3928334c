//! Why ETC1S data cannot be decoded.

use crate::load::textures::error::TextureError;

/// Why ETC1S data cannot be decoded.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub(super) enum Etc1sError {
    /// A section reaches beyond the data.
    #[error("{0} reaches beyond the data")]
    Short(&'static str),
    /// The bits of a section end before its content does.
    #[error("the bits of {0} end too early")]
    End(&'static str),
    /// A prefix code that is not one.
    #[error("a Huffman table is damaged")]
    Table,
    /// A symbol that the prefix code does not have.
    #[error("a symbol has no meaning")]
    Symbol,
    /// A block that names what is not in the codebooks or not in the picture.
    #[error("block {0} refers to what is not there")]
    Block(usize),
    /// Codebooks of a kind that KTX2 does not have.
    #[error("codebooks of an old kind")]
    OldCodebook,
}

impl From<Etc1sError> for TextureError {
    fn from(error: Etc1sError) -> Self {
        Self::Decode(format!("ETC1S: {error}"))
    }
}
