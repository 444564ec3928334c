//! Radiance HDR and OpenEXR pictures to linear RGB.

use super::error::TextureError;
use super::meaning::Meaning;
use super::size_limits::check_size;
use crate::load::LoadOptions;
use crate::load::session::FLOAT_PIXEL;
use crate::{Image, LoadReport, Pixels};
use ::image::ImageDecoder;
use ::image::codecs::hdr::HdrDecoder;
use exr::prelude::MetaData;
use film::{ExrFile, ExrPicture, ImageError};
use std::io::Cursor;
use std::path::Path;

/// Larger values are taken for damage: their sum over an image would overflow single precision.
const MAX_VALUE: f32 = 1e12;

/// Whether the bytes start as an OpenEXR file does.
pub(super) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Whether the bytes start as a Radiance picture does: `#?` and the name of the writing program, mostly `RADIANCE`,
/// also `RGBE`.
pub(super) fn is_hdr(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#?")
}

/// Decodes a Radiance picture.
pub(super) fn decode_hdr(
    name: &str,
    bytes: &[u8],
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    // The strict reader wants the name `RADIANCE`; the other one takes any line that begins with `#` as a comment.
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes))?;
    let (width, height) = decoder.dimensions();
    check_size(width.into(), height.into(), bytes.len(), FLOAT_PIXEL, options)?;
    let exposure = decoder.metadata().exposure.filter(|e| e.is_finite() && *e > 0.0 && *e != 1.0);
    let mut raw = vec![0u8; width as usize * height as usize * 12];
    decoder.read_image(&mut raw)?;
    let (floats, _) = raw.as_chunks::<4>();
    let mut pixels: Vec<[f32; 3]> =
        floats.as_chunks::<3>().0.iter().map(|p| p.map(f32::from_ne_bytes)).collect();
    if let Some(exposure) = exposure {
        // The header's EXPOSURE was multiplied into the pixels and must be taken out to recover radiance.
        pixels.iter_mut().flatten().for_each(|v| *v /= exposure);
        report.info(format!("the header's exposure of {exposure} was divided out"));
    }
    mend(pixels.as_flattened_mut(), report);
    Ok(Image { name: name.into(), width, height, pixels: Pixels::Rgb32F(pixels) })
}

/// Decodes the picture of an OpenEXR file: see [`film::ExrFile::picture`]. `meaning`: what is not colour is not converted to
/// other primaries.
pub(super) fn decode_exr(
    name: &str,
    bytes: &[u8],
    meaning: Meaning,
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    check_exr(bytes, options)?;
    let path = Path::new(name);
    let file = ExrFile::from_bytes(path, bytes).map_err(refused)?;
    let picture = match meaning {
        Meaning::Color => file.picture(path),
        Meaning::Data => file.without_primaries().picture(path),
    };
    let ExrPicture { image, notes, .. } = picture.map_err(refused)?;
    notes.into_iter().for_each(|note| report.info(note));
    let (width, height) = (image.width(), image.height());
    let mut pixels: Vec<[f32; 4]> = match image.channels() {
        4 => image.data().as_chunks().0.to_vec(),
        _ => image.data().as_chunks().0.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]).collect(),
    };
    mend(pixels.as_flattened_mut(), report);
    let pixels = float_pixels(pixels);
    if matches!(pixels, Pixels::Rgba32F(_)) {
        report.info("colours are taken as they are, not divided by alpha");
    }
    Ok(Image { name: name.into(), width, height, pixels })
}

/// Refuses files whose parts are not plausible before anything is allocated.
fn check_exr(bytes: &[u8], options: &LoadOptions) -> Result<(), TextureError> {
    let failed = |error: exr::error::Error| TextureError::Decode(error.to_string());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(failed)?;
    for header in &meta.headers {
        let channels = header.channels.list.len() as u64;
        let size = header.layer_size;
        let width = (size.width() as u64).saturating_mul(channels);
        check_size(width, size.height() as u64, bytes.len(), FLOAT_PIXEL, options)?;
        if header.deep {
            return Err(TextureError::Decode("deep images are not supported".into()));
        }
    }
    match meta.headers.first() {
        Some(header) => {
            let display = header.shared_attributes.display_window.size;
            check_size(display.width() as u64, display.height() as u64, bytes.len(), FLOAT_PIXEL, options)
        }
        None => Err(TextureError::Decode("it has no parts".into())),
    }
}

/// The reader's error, without the file's name, which the caller knows.
fn refused(error: ImageError) -> TextureError {
    TextureError::Decode(match error {
        ImageError::Decode { reason, .. } => reason,
        ImageError::NoColour { found, .. } => format!("it has no colour channels R, G, B or Y, but {found}"),
        other => other.to_string(),
    })
}

/// Floating-point pixels, with alpha only where it is not 1 everywhere.
pub(super) fn float_pixels(pixels: Vec<[f32; 4]>) -> Pixels {
    if pixels.iter().any(|p| p[3] != 1.0) {
        return Pixels::Rgba32F(pixels);
    }
    Pixels::Rgb32F(pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect())
}

/// Radiance is finite and not negative: NaN and negative values become 0, infinite ones [`MAX_VALUE`] at most.
pub(super) fn mend(values: &mut [f32], report: &mut LoadReport) {
    let (mut negative, mut not_finite) = (0usize, 0usize);
    for value in values {
        if value.is_nan() {
            not_finite += 1;
            *value = 0.0;
        } else if *value < 0.0 {
            negative += 1;
            *value = 0.0;
        } else if *value > MAX_VALUE {
            not_finite += 1;
            *value = if value.is_infinite() { 65504.0 } else { MAX_VALUE };
        }
    }
    if negative > 0 {
        report.repaired(format!("{negative} negative values were set to 0"));
    }
    if not_finite > 0 {
        report.repaired(format!("{not_finite} values that are not finite were replaced"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::{LoadOptions, textures::decode};
    use exr::prelude::WritableImage;

    fn exr_bytes(pixel: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let channels =
            exr::prelude::SpecificChannels::rgb(|p: exr::prelude::Vec2<usize>| pixel(p.x(), p.y()));
        exr::prelude::Image::from_channels((3, 2), channels).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn pixels(image: &Image) -> &[[f32; 3]] {
        match &image.pixels {
            Pixels::Rgb32F(pixels) => pixels,
            other => panic!("not RGB of floats: {other:?}"),
        }
    }

    #[test]
    fn exr_values_are_kept_and_bad_ones_mended() {
        let bytes = exr_bytes(|x, y| match (x, y) {
            (0, 0) => (f32::NAN, f32::INFINITY, -1.0),
            _ => (x as f32, y as f32, 0.125),
        });
        let mut report = LoadReport::default();
        let image = decode("a.exr", &bytes, &LoadOptions::default(), &mut report).unwrap();
        assert_eq!((image.width, image.height), (3, 2));
        assert_eq!(pixels(&image)[0], [0.0, 65504.0, 0.0]);
        assert_eq!(pixels(&image)[5], [2.0, 1.0, 0.125]);
        let messages: Vec<_> = report.notes.iter().map(|n| n.message.as_str()).collect();
        assert_eq!(
            messages,
            ["1 negative values were set to 0", "2 values that are not finite were replaced"]
        );
    }

    /// Alpha stays, and so does a part of the picture in its place; colours of other primaries are converted, data is not.
    #[test]
    fn exr_files_mean_what_their_writers_meant() {
        use film::{Precision, Rect};
        let mut file = ExrFile::new(3, 1, Rect { x: 1, y: 0, width: 2, height: 1 });
        let picture = film::Image::from_data(2, 1, 4, vec![8.0, 4.0, 0.5, 0.25, 1.0, 1.0, 1.0, 1.0]).unwrap();
        file.push_layer("View.AO", &["R", "G", "B"], &film::Image::black(2, 1, 3), Precision::Half);
        file.push_layer("View.Combined", &["R", "G", "B", "A"], &picture, Precision::Half);
        let bytes = file.into_bytes(Path::new("a.exr"), film::ExrCompression::Zip).unwrap();
        let mut report = LoadReport::default();
        let image = decode("a.exr", &bytes, &LoadOptions::default(), &mut report).unwrap();
        let Pixels::Rgba32F(pixels) = &image.pixels else { panic!("no alpha") };
        assert_eq!(pixels[..], [[0.0; 4], [8.0, 4.0, 0.5, 0.25], [1.0; 4]]);
        assert!(
            report.notes.iter().any(|n| n.message.contains("`View.Combined` is the picture")),
            "{report:?}"
        );

        let wide = [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046], [0.3127, 0.329]];
        let mut file = ExrFile::from_image(
            &film::Image::from_data(1, 1, 3, vec![1.0, 0.0, 0.0]).unwrap(),
            Precision::Float,
        )
        .with_primaries(wide);
        file.attributes.clear();
        let bytes = file.into_bytes(Path::new("a.exr"), film::ExrCompression::Zip).unwrap();
        let red = |meaning| {
            let (options, mut report) = (LoadOptions::default(), LoadReport::default());
            decode_exr("a.exr", &bytes, meaning, &options, &mut report).unwrap().pixels.stored(0)
        };
        assert!((red(Meaning::Color)[0] - 1.6605).abs() < 1e-3, "{:?}", red(Meaning::Color));
        assert_eq!(red(Meaning::Data), [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn hdr_exposure_is_divided_out() {
        for program in ["RADIANCE", "RGBE"] {
            let header = format!("#?{program}\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2.0\n\n-Y 1 +X 2\n");
            // (1, 0.5, 0) and (0.5, 0.5, 0.5), then halved
            let bytes = [header.as_bytes(), &[128, 64, 0, 129, 128, 128, 128, 128]].concat();
            let mut report = LoadReport::default();
            let image = decode("a.hdr", &bytes, &LoadOptions::default(), &mut report).unwrap();
            assert_eq!(pixels(&image), [[0.5, 0.25, 0.0], [0.25, 0.25, 0.25]], "{program}");
            assert_eq!(report.notes.len(), 1);
        }
    }

    #[test]
    fn damaged_exr_files_are_errors_not_panics() {
        let whole = exr_bytes(|x, y| (x as f32, y as f32, 0.0));
        for cut in 0..whole.len() {
            let _ = decode("a.exr", &whole[..cut], &LoadOptions::default(), &mut LoadReport::default());
        }
        for at in 0..whole.len() {
            for value in [0, 0x7f, 0xff] {
                let mut damaged = whole.clone();
                damaged[at] = value;
                let _ = decode("a.exr", &damaged, &LoadOptions::default(), &mut LoadReport::default());
            }
        }
    }
}
