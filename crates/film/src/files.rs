//! Image files of all formats: opening by content, writing HDR and PNG.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageEncoder, ImageFormat, ImageReader, Limits};

use crate::atomic::write_atomically;
use crate::srgb::{srgb_to_linear, to_u8, to_u16};
use crate::{ExrFile, ExrPicture, Image, ImageError, MAX_SIDE, limits};

const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// What a Radiance header begins with; the name of the writing program follows, mostly `RADIANCE`, also `RGBE`.
const HDR_MAGIC: &[u8] = b"#?";

impl Image {
    /// Opens an image file as linear RGB, or RGBA if it has an alpha channel.
    ///
    /// The format is recognised by the contents: OpenEXR (see [`ExrFile::picture`]) and Radiance HDR
    /// are taken as linear; PNG, JPEG, WebP, BMP and TGA (the last by its name) are decoded from sRGB to linear, alpha
    /// untouched. Values may be anything the file holds, NaN included. Memory is limited by the length of the file.
    ///
    /// # Errors
    /// [`ImageError::Read`], [`ImageError::UnknownFormat`], [`ImageError::TooLarge`], [`ImageError::NoColour`] or
    /// [`ImageError::Decode`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, ImageError> {
        Self::open_noting(path).map(|(image, _)| image)
    }

    /// As [`Image::open`], with what people should know of how it was read: see [`ExrPicture::notes`].
    ///
    /// # Errors
    /// As [`Image::open`].
    pub fn open_noting(path: impl AsRef<Path>) -> Result<(Self, Vec<String>), ImageError> {
        let path = path.as_ref();
        let read_error = |source| ImageError::Read { path: path.to_owned(), source };
        let mut file = File::open(path).map_err(read_error)?;
        let length = file.metadata().map_err(read_error)?.len();
        let mut magic = Vec::new();
        file.by_ref().take(4).read_to_end(&mut magic).map_err(read_error)?;
        if magic == EXR_MAGIC {
            let ExrPicture { image, notes, .. } = ExrFile::read(path)?.picture(path)?;
            return Ok((image, notes));
        }
        file.rewind().map_err(read_error)?;
        if magic.starts_with(HDR_MAGIC) {
            return Ok((decode_hdr(path, file, length)?, Vec::new()));
        }
        Ok((decode(path, file, length)?, Vec::new()))
    }

    /// Writes the first three channels as Radiance HDR (RGBE: 8 bits of mantissa, a common exponent, nothing
    /// negative). Complete, or not at all.
    ///
    /// # Errors
    /// [`ImageError::Write`], or [`ImageError::Encode`] for a picture without pixels.
    pub fn write_hdr(&self, path: &Path) -> Result<(), ImageError> {
        self.check_pixels(path)?;
        let rgb: Vec<image::Rgb<f32>> =
            self.to_rgb().data().chunks_exact(3).map(|c| image::Rgb([c[0], c[1], c[2]])).collect();
        write_atomically(path, |writer| {
            let encoder = image::codecs::hdr::HdrEncoder::new(writer);
            encoder
                .encode(&rgb, self.width() as usize, self.height() as usize)
                .map_err(|e| write_error(path, e))
        })
    }

    /// Writes an 8-bit PNG from display-encoded values: tone mapping and the transfer function are already applied;
    /// here values are only rounded, and cut off outside `[0, 1]`. One channel gives a grey picture, two and three give
    /// RGB, four RGBA. Complete, or not at all.
    ///
    /// # Errors
    /// [`ImageError::Write`], or [`ImageError::Encode`] for a picture without pixels.
    pub fn write_png_encoded(&self, path: &Path) -> Result<(), ImageError> {
        let (channels, bytes) = self.display_bytes();
        write_png(path, self.width(), self.height(), channels, &bytes)
    }

    /// As [`Image::write_png_encoded`], with 16 bits a channel: gradients do not band, and there is room for grading.
    ///
    /// # Errors
    /// [`ImageError::Write`], or [`ImageError::Encode`] for a picture without pixels.
    pub fn write_png16_encoded(&self, path: &Path) -> Result<(), ImageError> {
        self.check_pixels(path)?;
        let (image, colour) = match self.channels() {
            1 => (self.clone(), image::ExtendedColorType::L16),
            4 => (self.clone(), image::ExtendedColorType::Rgba16),
            _ => (self.to_rgb(), image::ExtendedColorType::Rgb16),
        };
        // The encoder takes the machine's byte order and writes the format's.
        let bytes: Vec<u8> = image.data().iter().flat_map(|&v| to_u16(v).to_ne_bytes()).collect();
        let encoded = compress_png(path, self.width(), self.height(), colour, &bytes)?;
        write_whole(path, &encoded)
    }

    /// As [`Image::write_png_encoded`], as a JPEG of quality 92: small, with losses, and without alpha.
    ///
    /// # Errors
    /// [`ImageError::Write`], or [`ImageError::Encode`] for a picture without pixels or with a side beyond 65535.
    pub fn write_jpeg_encoded(&self, path: &Path) -> Result<(), ImageError> {
        const QUALITY: u8 = 92;
        self.check_pixels(path)?;
        let bytes: Vec<u8> = self.to_rgb().data().iter().map(|&v| to_u8(v)).collect();
        let mut encoded = Vec::new();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut encoded, QUALITY)
            .write_image(&bytes, self.width(), self.height(), image::ExtendedColorType::Rgb8)
            .map_err(|e| write_error(path, e))?;
        write_whole(path, &encoded)
    }

    /// As [`Image::write_png_encoded`], to memory.
    ///
    /// # Errors
    /// [`ImageError::Encode`] for a picture without pixels.
    pub fn encode_png(&self) -> Result<Vec<u8>, ImageError> {
        let (channels, bytes) = self.display_bytes();
        encode_png(Path::new("PNG"), self.width(), self.height(), channels, &bytes)
    }

    /// Channels that a PNG can have, rounded to bytes.
    fn display_bytes(&self) -> (usize, Vec<u8>) {
        let rgb;
        let image = if matches!(self.channels(), 1 | 3 | 4) {
            self
        } else {
            rgb = self.to_rgb();
            &rgb
        };
        (image.channels(), image.data().iter().map(|&v| to_u8(v)).collect())
    }

    fn check_pixels(&self, path: &Path) -> Result<(), ImageError> {
        if self.width() == 0 || self.height() == 0 {
            return Err(ImageError::Encode { path: path.to_owned(), reason: "there are no pixels".into() });
        }
        Ok(())
    }
}

/// Writes an 8-bit PNG from bytes as a display wants them: row by row from the top, `channels` (1 grey, 3 RGB, 4 RGBA)
/// bytes a pixel. Complete, or not at all.
///
/// # Errors
/// [`ImageError::Write`], [`ImageError::Shape`] if the number of bytes is wrong, or [`ImageError::Encode`] for
/// another number of channels or no pixels.
pub fn write_png(
    path: &Path,
    width: u32,
    height: u32,
    channels: usize,
    bytes: &[u8],
) -> Result<(), ImageError> {
    write_whole(path, &encode_png(path, width, height, channels, bytes)?)
}

fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    write_atomically(path, |writer| {
        std::io::Write::write_all(writer, bytes)
            .map_err(|source| ImageError::Write { path: path.to_owned(), source })
    })
}

/// The bytes of such a file; `path` is what errors name.
fn encode_png(
    path: &Path,
    width: u32,
    height: u32,
    channels: usize,
    bytes: &[u8],
) -> Result<Vec<u8>, ImageError> {
    let encode = |reason: String| ImageError::Encode { path: path.to_owned(), reason };
    let colour = match channels {
        1 => image::ExtendedColorType::L8,
        3 => image::ExtendedColorType::Rgb8,
        4 => image::ExtendedColorType::Rgba8,
        n => return Err(encode(format!("a PNG cannot have {n} channels"))),
    };
    if (width as usize * height as usize).checked_mul(channels) != Some(bytes.len()) {
        return Err(ImageError::Shape { width, height, channels, values: bytes.len() });
    }
    if bytes.is_empty() {
        return Err(encode("there are no pixels".into()));
    }
    compress_png(path, width, height, colour, bytes)
}

fn compress_png(
    path: &Path,
    width: u32,
    height: u32,
    colour: image::ExtendedColorType,
    bytes: &[u8],
) -> Result<Vec<u8>, ImageError> {
    let mut encoded = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new_with_quality(
        &mut encoded,
        image::codecs::png::CompressionType::Default,
        image::codecs::png::FilterType::Adaptive,
    );
    encoder.write_image(bytes, width, height, colour).map_err(|e| write_error(path, e))?;
    Ok(encoded)
}

fn decode(path: &Path, file: File, length: u64) -> Result<Image, ImageError> {
    let decode_error =
        |e: image::ImageError| ImageError::Decode { path: path.to_owned(), reason: e.to_string() };
    let read_error = |source| ImageError::Read { path: path.to_owned(), source };
    let mut reader = ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(read_error)?;
    let Some(format) = reader.format().or_else(|| ImageFormat::from_path(path).ok()) else {
        return Err(ImageError::UnknownFormat { path: path.to_owned() });
    };
    if !format.reading_enabled() {
        return Err(ImageError::UnknownFormat { path: path.to_owned() });
    }
    reader.set_format(format);
    reader.limits(allowed(length));
    decode_pixels(path, length, reader.into_decoder().map_err(decode_error)?)
}

fn decode_hdr(path: &Path, file: File, length: u64) -> Result<Image, ImageError> {
    let decode_error =
        |e: image::ImageError| ImageError::Decode { path: path.to_owned(), reason: e.to_string() };
    // The strict reader wants the name `RADIANCE`; the other one takes any line that begins with `#` as a comment.
    let mut decoder = HdrDecoder::new_nonstrict(BufReader::new(file)).map_err(decode_error)?;
    decoder.set_limits(allowed(length)).map_err(decode_error)?;
    decode_pixels(path, length, decoder)
}

/// Limits for a file of `length` bytes.
fn allowed(length: u64) -> Limits {
    let mut allowed = Limits::default();
    allowed.max_image_width = Some(MAX_SIDE);
    allowed.max_image_height = Some(MAX_SIDE);
    allowed.max_alloc = Some(limits::decoded_bytes(length));
    allowed
}

fn decode_pixels(path: &Path, length: u64, decoder: impl ImageDecoder) -> Result<Image, ImageError> {
    let decode_error =
        |e: image::ImageError| ImageError::Decode { path: path.to_owned(), reason: e.to_string() };
    let ((width, height), channels) = (decoder.dimensions(), u64::from(decoder.color_type().channel_count()));
    let (w, h) = (u64::from(width), u64::from(height));
    if limits::bytes(w, h, channels).is_none_or(|bytes| bytes > limits::decoded_bytes(length)) {
        return Err(ImageError::TooLarge { path: path.to_owned(), width: w, height: h, channels });
    }
    let decoded = DynamicImage::from_decoder(decoder).map_err(decode_error)?;
    let (n, data) = to_linear(decoded);
    Image::from_data(width, height, n, data)
}

/// The number of channels (3 or 4) and the linear values.
fn to_linear(image: DynamicImage) -> (usize, Vec<f32>) {
    let channels = if image.color().has_alpha() { 4 } else { 3 };
    let is_alpha = |i: usize| channels == 4 && i % 4 == 3;
    let data = match image {
        DynamicImage::ImageRgb32F(image) => image.into_raw(), // only HDR decodes to this, and it is linear
        DynamicImage::ImageRgba32F(image) => image.into_raw(),
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let codes =
                if channels == 4 { image.into_rgba16().into_raw() } else { image.into_rgb16().into_raw() };
            let value = |(i, v): (usize, u16)| {
                let v = f32::from(v) / 65535.0;
                if is_alpha(i) { v } else { srgb_to_linear(v) }
            };
            codes.into_iter().enumerate().map(value).collect()
        }
        other => {
            let codes =
                if channels == 4 { other.into_rgba8().into_raw() } else { other.into_rgb8().into_raw() };
            let table: [f32; 256] = std::array::from_fn(|code| srgb_to_linear(code as f32 / 255.0));
            let value = |(i, v): (usize, u8)| {
                if is_alpha(i) { f32::from(v) / 255.0 } else { table[usize::from(v)] }
            };
            codes.into_iter().enumerate().map(value).collect()
        }
    };
    (channels, data)
}

fn write_error(path: &Path, error: image::ImageError) -> ImageError {
    match error {
        image::ImageError::IoError(source) => ImageError::Write { path: path.to_owned(), source },
        other => ImageError::Encode { path: path.to_owned(), reason: other.to_string() },
    }
}

#[cfg(test)]
mod tests;
