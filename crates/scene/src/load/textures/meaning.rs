//! What an image stands for.

/// What an image stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Colours, in the colour space that the file names.
    Color,
    /// Numbers such as normals, as they are stored.
    Data,
}
