//! Radiance HDR and OpenEXR pictures to linear RGB.

use super::decode::{TextureError, check_size};
use crate::load::LoadOptions;
use crate::{Image, LoadReport, Pixels};
use ::image::ImageDecoder;
use ::image::codecs::hdr::HdrDecoder;
use exr::prelude::{AnyChannel, FlatSamples, Layer, MetaData, ReadChannels, ReadLayers, read};
use std::io::Cursor;

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
    check_size(width.into(), height.into(), bytes.len(), options)?;
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
    mend(&mut pixels, report);
    Ok(Image { name: name.into(), width, height, pixels: Pixels::Rgb32F(pixels) })
}

/// Decodes the first layer of an OpenEXR file that has colour: channels `R`, `G`, `B`, or `Y`, at the largest
/// resolution level.
pub(super) fn decode_exr(
    name: &str,
    bytes: &[u8],
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    let refused = |error: exr::error::Error| TextureError::Decode(error.to_string());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(refused)?;
    for header in &meta.headers {
        let channels = header.channels.list.len() as u64;
        let size = header.layer_size;
        check_size(
            (size.width() as u64).saturating_mul(channels),
            size.height() as u64,
            bytes.len(),
            options,
        )?;
        if header.deep {
            return Err(TextureError::Decode("deep images are not supported".into()));
        }
    }
    let layers = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(refused)?
        .layer_data;
    let Some((layer, channels)) = layers.iter().find_map(|l| Some((l, color_channels(l)?))) else {
        return Err(TextureError::Decode("it has no colour channels R, G, B or Y".into()));
    };
    if layers.len() > 1 {
        report.info("only the first layer with colour is used");
    }
    let (width, height) = (layer.size.width(), layer.size.height());
    let at = |channel: &AnyChannel<FlatSamples>, i: usize| match &channel.sample_data {
        FlatSamples::F16(samples) => samples.get(i).map_or(0.0, |s| s.to_f32()),
        FlatSamples::F32(samples) => samples.get(i).copied().unwrap_or(0.0),
        FlatSamples::U32(samples) => samples.get(i).map_or(0.0, |s| *s as f32),
    };
    let mut pixels: Vec<[f32; 3]> = (0..width * height).map(|i| channels.map(|c| at(c, i))).collect();
    mend(&mut pixels, report);
    Ok(Image {
        name: name.into(),
        width: width as u32,
        height: height as u32,
        pixels: Pixels::Rgb32F(pixels),
    })
}

/// The layer's red, green and blue channels, whatever prefix their names have; a luminance channel stands for all.
fn color_channels(
    layer: &Layer<exr::prelude::AnyChannels<FlatSamples>>,
) -> Option<[&AnyChannel<FlatSamples>; 3]> {
    let find = |wanted: &str| {
        let mut channels = layer.channel_data.list.iter();
        let last_part = |c: &&AnyChannel<FlatSamples>| {
            let name = c.name.to_string();
            name.rsplit('.').next().is_some_and(|n| n.eq_ignore_ascii_case(wanted))
        };
        channels.find(last_part)
    };
    match (find("R"), find("G"), find("B"), find("Y")) {
        (Some(r), Some(g), Some(b), _) => Some([r, g, b]),
        (_, _, _, Some(y)) => Some([y, y, y]),
        _ => None,
    }
}

/// Radiance is finite and not negative: NaN and negative values become 0, infinite ones [`MAX_VALUE`] at most.
pub(super) fn mend(pixels: &mut [[f32; 3]], report: &mut LoadReport) {
    let (mut negative, mut not_finite) = (0usize, 0usize);
    for value in pixels.iter_mut().flatten() {
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
            Pixels::Rgba8(_) => panic!("not a float image"),
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
