//! Why an image could not be decoded.

/// Why an image could not be decoded. The caller knows the file's name.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TextureError {
    /// The bytes carry no known signature.
    #[error("unknown image format (known are PNG, JPEG, WebP, TGA, BMP, DDS, KTX2, HDR and EXR)")]
    UnknownFormat,
    /// An AVIF image, which is a frame of AV1 video.
    #[error("AVIF is not decoded: save it as PNG, JPEG, WebP or KTX2")]
    Avif,
    /// The header declares more pixels than are reasonable for the file's size.
    #[error("{width} × {height} pixels cannot come from {bytes} bytes")]
    TooLarge {
        /// Declared width in pixels.
        width: u64,
        /// Declared height in pixels.
        height: u64,
        /// Size of the file.
        bytes: usize,
    },
    /// The decoder refused the data.
    #[error("cannot be decoded ({0})")]
    Decode(String),
}

impl From<::image::ImageError> for TextureError {
    fn from(error: ::image::ImageError) -> Self {
        Self::Decode(error.to_string())
    }
}
