use super::*;
use crate::srgb::linear_to_srgb;
use crate::{ExrCompression, Precision};
use proptest::prelude::*;

fn picture() -> Image {
    Image::from_fn(19, 7, |x, y| [x as f32 / 18.0, y as f32 / 6.0, 0.25])
}

fn close(a: &Image, b: &Image, tolerance: f32) -> bool {
    (a.width(), a.height(), a.channels()) == (b.width(), b.height(), b.channels())
        && a.data().iter().zip(b.data()).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn png_keeps_display_values() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    picture().map(linear_to_srgb).write_png_encoded(&path).unwrap();
    assert!(close(&Image::open(&path).unwrap(), &picture(), 0.005));

    let rgba = Image::from_data(1, 2, 4, vec![1.0, 0.5, 0.0, 0.2, 2.0, -1.0, f32::NAN, 1.0]).unwrap();
    rgba.write_png_encoded(&path).unwrap();
    let back = Image::open(&path).unwrap();
    let expected = [1.0, srgb_to_linear(128.0 / 255.0), 0.0, 0.2, 1.0, 0.0, 0.0, 1.0];
    assert!(close(&back, &Image::from_data(1, 2, 4, expected.to_vec()).unwrap(), 1e-6), "{back:?}");
}

#[test]
fn jpeg_is_nearly_what_was_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.jpg");
    let smooth = Image::from_fn(64, 48, |x, y| [x as f32 / 63.0, y as f32 / 47.0, 0.5]);
    smooth.map(linear_to_srgb).write_jpeg_encoded(&path).unwrap();
    assert!(close(&Image::open(&path).unwrap(), &smooth, 0.08));
    let grey = Image::from_data(2, 1, 1, vec![0.25, f32::NAN]).unwrap();
    grey.write_jpeg_encoded(&path).unwrap();
    assert_eq!(Image::open(&path).unwrap().channels(), 3);
    let error = Image::black(0, 4, 3).write_jpeg_encoded(&path).unwrap_err();
    assert!(matches!(error, ImageError::Encode { .. }), "{error}");
}

#[test]
fn sixteen_bit_png_keeps_what_eight_bits_lose() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    let encoded = picture().map(linear_to_srgb);
    encoded.write_png16_encoded(&path).unwrap();
    let back = Image::open(&path).unwrap();
    assert!(close(&back, &picture(), 3e-5));
    encoded.write_png_encoded(&path).unwrap();
    assert!(!close(&Image::open(&path).unwrap(), &picture(), 3e-5), "eight bits are coarser");
    let grey = Image::from_data(2, 1, 1, vec![0.25, f32::NAN]).unwrap();
    grey.write_png16_encoded(&path).unwrap();
    assert_eq!(image::open(&path).unwrap().into_luma16().into_raw(), [16384, 0]);
    assert!(Image::black(0, 3, 3).write_png16_encoded(&path).is_err());
}

#[test]
fn sixteen_bit_png_and_jpeg_open() {
    let dir = tempfile::tempdir().unwrap();
    let encoded = picture().map(linear_to_srgb);
    let path = dir.path().join("a.png");
    let codes: Vec<u16> = encoded.data().iter().map(|v| (v * 65535.0).round() as u16).collect();
    image::ImageBuffer::<image::Rgb<u16>, _>::from_raw(19, 7, codes).unwrap().save(&path).unwrap();
    assert!(close(&Image::open(&path).unwrap(), &picture(), 3e-5));

    let path = dir.path().join("misnamed.png");
    let grey = image::GrayImage::from_pixel(16, 16, image::Luma([128]));
    grey.save_with_format(&path, ImageFormat::Jpeg).unwrap();
    let expected = Image::from_fn(16, 16, |_, _| [srgb_to_linear(128.0 / 255.0); 3]);
    assert!(close(&Image::open(&path).unwrap(), &expected, 0.01));
}

#[test]
fn hdr_keeps_a_wide_range() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.hdr");
    let image = Image::from_fn(40, 3, |x, _| [2f32.powi(x as i32 - 20), 0.0, 2f32.powi(x as i32 - 20)]);
    image.write_hdr(&path).unwrap();
    let back = Image::open(&path).unwrap();
    for (a, b) in image.data().iter().zip(back.data()) {
        assert!((a - b).abs() <= 0.01 * a, "{a} became {b}");
    }
}

#[test]
fn what_is_no_image_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.txt");
    assert!(matches!(Image::open(&path), Err(ImageError::Read { .. })));
    std::fs::write(&path, "hello").unwrap();
    assert!(matches!(Image::open(&path), Err(ImageError::UnknownFormat { .. })));
    std::fs::write(&path, "").unwrap();
    assert!(matches!(Image::open(&path), Err(ImageError::UnknownFormat { .. })));
    assert!(matches!(Image::open(dir.path()), Err(ImageError::Read { .. })));
    let nothing = Image::black(0, 3, 3);
    assert!(matches!(nothing.write_png_encoded(&path), Err(ImageError::Encode { .. })));
    assert!(matches!(nothing.write_hdr(&path), Err(ImageError::Encode { .. })));
    assert!(matches!(write_png(&path, 2, 2, 3, &[0; 5]), Err(ImageError::Shape { .. })));
}

#[test]
fn headers_that_promise_too_much_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.hdr");
    std::fs::write(&path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n").unwrap();
    let error = Image::open(&path).unwrap_err();
    assert!(matches!(error, ImageError::TooLarge { width: 60000, .. }), "{error}");
}

#[test]
fn radiance_files_may_name_any_program() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.hdr");
    picture().write_hdr(&path).unwrap();
    let written = std::fs::read(&path).unwrap();
    let after_name = written.iter().position(|&b| b == b'\n').unwrap();
    let expected = Image::open(&path).unwrap();
    for name in ["#?RGBE", "#?RADIANCE", "#?AUTOPANO"] {
        std::fs::write(&path, [name.as_bytes(), &written[after_name..]].concat()).unwrap();
        assert_eq!(Image::open(&path).unwrap().data(), expected.data(), "{name}");
    }
}

/// One small file of each format, as bytes.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    picture().write_png_encoded(&at("png")).unwrap();
    picture().write_hdr(&at("hdr")).unwrap();
    let jpeg = image::GrayImage::from_fn(19, 7, |x, y| image::Luma([(x * y) as u8]));
    jpeg.save_with_format(at("jpeg"), ImageFormat::Jpeg).unwrap();
    let exr = ExrFile::from_image(&picture(), Precision::Half).with_metadata("spp", "4");
    exr.write(&at("piz"), ExrCompression::Piz).unwrap();
    exr.write(&at("zip"), ExrCompression::Zip).unwrap();
    exr.write(&at("rle"), ExrCompression::Rle).unwrap();
    exr.write(&at("raw"), ExrCompression::None).unwrap();
    let names = ["png", "hdr", "jpeg", "piz", "zip", "rle", "raw"];
    names.map(|n| (n, std::fs::read(at(n)).unwrap())).to_vec()
}

#[test]
fn damaged_files_are_errors_or_images_but_never_panics() {
    let files = samples();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("damaged");
    let mut runner =
        proptest::test_runner::TestRunner::new(ProptestConfig { cases: 1500, ..Default::default() });
    let damage = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6);
    let strategy = (0..files.len(), damage, prop::option::of(any::<prop::sample::Index>()));
    runner
        .run(&strategy, |(which, damage, cut)| {
            let mut bytes = files[which].1.clone();
            damage.iter().for_each(|(at, value)| {
                let at = at.index(bytes.len());
                bytes[at] = *value;
            });
            if let Some(cut) = cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            std::fs::write(&path, bytes).unwrap();
            if let Ok(image) = Image::open(&path) {
                prop_assert!(image.data().len() < 64 << 20);
            }
            Ok(())
        })
        .unwrap();
}
