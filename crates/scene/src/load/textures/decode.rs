//! One image file's bytes to pixels, within limits.

use super::error::TextureError;
use super::meaning::Meaning;
use super::size_limits::{MAX_PIXELS, check_size};
use super::{dds, float, ktx2};
use crate::load::LoadOptions;
use crate::load::session::PIXEL;
use crate::{Image, LoadReport, Pixels};
use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Decodes PNG, JPEG, WebP, TGA, BMP (to [`Pixels::Rgba8`]), Radiance HDR and OpenEXR (to floats), DDS and KTX2 (to either).
///
/// The format is recognised by the first bytes, TGA by the ending of `name`. Sixteen-bit channels are rounded to eight
/// bits. Images larger than [`LoadOptions::max_texture_size`] are halved, averaging the stored numbers, until they
/// fit. Float pixels that are not finite or negative are mended. All of this is noted in `report`.
///
/// # Errors
/// See [`TextureError`]. Nothing large is allocated before the declared size was found plausible.
pub fn decode(
    name: &str,
    bytes: &[u8],
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    decode_as(Meaning::Color, name, bytes, options, report)
}

/// As [`decode`], of colours or data.
pub(super) fn decode_as(
    meaning: Meaning,
    name: &str,
    bytes: &[u8],
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    let image = if float::is_exr(bytes) {
        float::decode_exr(name, bytes, meaning, options, report)?
    } else if dds::is_dds(bytes) {
        dds::decode_dds(name, bytes, options, report)?
    } else if ktx2::is_ktx2(bytes) {
        ktx2::decode_ktx2(name, bytes, options, report)?
    } else if float::is_hdr(bytes) {
        float::decode_hdr(name, bytes, options, report)?
    } else {
        decode_rgba8(name, bytes, format(name, bytes)?, options, report)?
    };
    Ok(shrink(image, options.max_texture_size, report))
}

fn format(name: &str, bytes: &[u8]) -> Result<ImageFormat, TextureError> {
    let known = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP, ImageFormat::Bmp, ImageFormat::Tga];
    match ::image::guess_format(bytes) {
        Ok(format) if known.contains(&format) => Ok(format),
        _ if is_avif(bytes) => Err(TextureError::Avif),
        Err(_) if name.to_ascii_lowercase().ends_with("tga") => Ok(ImageFormat::Tga),
        _ => Err(TextureError::UnknownFormat),
    }
}

/// Whether the bytes start as an AVIF file does: with a box of the file's type that names it.
fn is_avif(bytes: &[u8]) -> bool {
    let brand = bytes.get(4..12);
    brand.is_some_and(|brand| brand == b"ftypavif" || brand == b"ftypavis")
}

fn decode_rgba8(
    name: &str,
    bytes: &[u8],
    format: ImageFormat,
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 16);
    reader.limits(limits);
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    check_size(width.into(), height.into(), bytes.len(), PIXEL, options)?;
    let deep = decoder.color_type().bytes_per_pixel() > decoder.color_type().channel_count();
    let decoded = DynamicImage::from_decoder(decoder)?;
    if deep {
        report.info("sixteen-bit channels were rounded to eight bits");
    }
    let pixels = decoded.into_rgba8().into_raw();
    let pixels = Pixels::Rgba8(pixels.as_chunks::<4>().0.to_vec());
    Ok(Image { name: name.into(), width, height, pixels })
}

/// Halves an image until its longer side is at most `limit` (at least 1).
fn shrink(mut image: Image, limit: u32, report: &mut LoadReport) -> Image {
    let original = (image.width, image.height);
    while image.width.max(image.height) > limit.max(1) {
        let (width, height) = (image.width, image.height);
        let size = (width.div_ceil(2), height.div_ceil(2));
        image.pixels = match &image.pixels {
            Pixels::Rgba8(pixels) => Pixels::Rgba8(halve(pixels, width, height, |quad| {
                std::array::from_fn(|c| {
                    let sum: u32 = quad.iter().map(|p| u32::from(p[c])).sum();
                    ((sum + 2) / 4) as u8
                })
            })),
            Pixels::Rgb32F(pixels) => Pixels::Rgb32F(halve(pixels, width, height, mean)),
            Pixels::Rgba32F(pixels) => Pixels::Rgba32F(halve(pixels, width, height, mean)),
        };
        (image.width, image.height) = size;
    }
    if original != (image.width, image.height) {
        let (width, height) = original;
        report.approximated(format!("shrunk from {width} × {height} to {} × {}", image.width, image.height));
    }
    image
}

fn mean<const N: usize>(quad: [[f32; N]; 4]) -> [f32; N] {
    std::array::from_fn(|c| quad.iter().map(|p| p[c] * 0.25).sum())
}

/// Averages blocks of 2×2 pixels; the last column and row count twice where a side is odd.
fn halve<T: Copy>(pixels: &[T], width: u32, height: u32, average: impl Fn([T; 4]) -> T) -> Vec<T> {
    let (width, height) = (width as usize, height as usize);
    let mut result = Vec::with_capacity(width.div_ceil(2) * height.div_ceil(2));
    for y in (0..height).step_by(2) {
        let rows = [y * width, (y + 1).min(height - 1) * width];
        for x in (0..width).step_by(2) {
            let right = (x + 1).min(width - 1);
            result.push(average([
                pixels[rows[0] + x],
                pixels[rows[0] + right],
                pixels[rows[1] + x],
                pixels[rows[1] + right],
            ]));
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn encode(image: DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), format).unwrap();
        bytes
    }

    fn decode_ok(name: &str, bytes: &[u8]) -> (Image, LoadReport) {
        let mut report = LoadReport::default();
        let image = decode(name, bytes, &LoadOptions::default(), &mut report).unwrap();
        (image, report)
    }

    fn rgba8(image: &Image) -> &[[u8; 4]] {
        match &image.pixels {
            Pixels::Rgba8(pixels) => pixels,
            _ => panic!("{} is a float image", image.name),
        }
    }

    #[test]
    fn eight_bit_formats_keep_their_values() {
        let source = ::image::RgbImage::from_fn(3, 2, |x, y| ::image::Rgb([x as u8 * 40, y as u8 * 90, 7]));
        for (name, format) in [
            ("a.png", ImageFormat::Png),
            ("a.bmp", ImageFormat::Bmp),
            ("a.tga", ImageFormat::Tga),
            ("a.webp", ImageFormat::WebP),
        ] {
            let (image, report) = decode_ok(name, &encode(source.clone().into(), format));
            assert_eq!((image.width, image.height), (3, 2), "{name}");
            assert_eq!(rgba8(&image)[5], [80, 90, 7, 255], "{name}");
            assert!(report.notes.is_empty(), "{name}");
        }
    }

    #[test]
    fn sixteen_bits_are_rounded_and_reported() {
        let source = ::image::ImageBuffer::from_pixel(2, 1, ::image::Luma([0x80ffu16]));
        let (image, report) =
            decode_ok("a.png", &encode(DynamicImage::ImageLuma16(source), ImageFormat::Png));
        assert_eq!(rgba8(&image)[0], [0x80, 0x80, 0x80, 255]);
        assert_eq!(report.notes.len(), 1);
    }

    #[test]
    fn large_images_are_halved_until_they_fit() {
        let source =
            ::image::GrayImage::from_fn(9, 4, |x, _| ::image::Luma([if x % 2 == 0 { 0 } else { 200 }]));
        let bytes = encode(source.into(), ImageFormat::Png);
        let options = LoadOptions { max_texture_size: 5, ..Default::default() };
        let mut report = LoadReport::default();
        let image = decode("a.png", &bytes, &options, &mut report).unwrap();
        assert_eq!((image.width, image.height), (5, 2));
        assert_eq!(rgba8(&image)[0], [100, 100, 100, 255]);
        assert_eq!(report.notes[0].message, "shrunk from 9 × 4 to 5 × 2");
    }

    #[test]
    fn a_header_that_lies_about_its_size_is_refused_before_allocation() {
        let mut bytes = encode(::image::GrayImage::new(4, 4).into(), ImageFormat::Bmp);
        bytes[18..22].copy_from_slice(&60_000u32.to_le_bytes());
        bytes[22..26].copy_from_slice(&60_000u32.to_le_bytes());
        let error = decode("a.bmp", &bytes, &LoadOptions::default(), &mut LoadReport::default()).unwrap_err();
        assert!(matches!(error, TextureError::TooLarge { width: 60_000, .. }), "{error}");
    }

    #[test]
    fn avif_is_named() {
        let bytes = b"\0\0\0\x20ftypavif\0\0\0\0avifmif1";
        let error = decode("x", bytes, &LoadOptions::default(), &mut LoadReport::default()).unwrap_err();
        assert!(matches!(error, TextureError::Avif) && error.to_string().contains("AVIF"), "{error}");
    }

    #[test]
    fn unknown_and_empty_data_are_refused() {
        for bytes in [&b""[..], b"hello", b"GIF89a\x01\x00\x01\x00"] {
            let error = decode("x", bytes, &LoadOptions::default(), &mut LoadReport::default()).unwrap_err();
            assert!(matches!(error, TextureError::UnknownFormat), "{error}");
        }
    }

    proptest! {
        #[test]
        fn damaged_files_never_panic(format in 0usize..5, at in 0usize..400, value: u8, cut in 0usize..400) {
            let (name, format) = [("a.png", ImageFormat::Png), ("a.bmp", ImageFormat::Bmp), ("a.tga", ImageFormat::Tga),
                ("a.webp", ImageFormat::WebP), ("a.jpg", ImageFormat::Jpeg)][format];
            let mut bytes = encode(::image::RgbImage::from_fn(7, 5, |x, y| ::image::Rgb([x as u8, y as u8, 3])).into(), format);
            let length = bytes.len();
            bytes[at % length] = value;
            bytes.truncate(length - cut % length);
            let _ = decode(name, &bytes, &LoadOptions::default(), &mut LoadReport::default());
        }
    }
}
