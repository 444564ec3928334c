//! Files of the reference encoder, whose pixels the reference transcoder has decoded; files that are made here; damage.
//!
//! `tests/data/ktx2/README.md` says where the files are from.

use crate::load::{LoadOptions, textures::decode};
use crate::{Image, LoadReport, Pixels, Severity};
use ::ktx2::{Format, Header, Index, LevelIndex};
use std::io::Write;

/// A file of the reference encoder and its pixels as PNG.
type Sample = (&'static str, &'static [u8], &'static [u8]);

macro_rules! sample {
    ($name:literal) => {
        (
            $name,
            include_bytes!(concat!("../../../../tests/data/ktx2/", $name, ".ktx2")),
            include_bytes!(concat!("../../../../tests/data/ktx2/", $name, ".png")),
        )
    };
}

/// ETC1S without alpha and with smaller levels, and with alpha; UASTC with Zstandard and as it is; blocks of each of its modes
/// with random bits.
const SAMPLES: [Sample; 5] = [
    sample!("etc1s_opaque"),
    sample!("etc1s_alpha"),
    sample!("uastc_zstd"),
    sample!("uastc_plain"),
    sample!("uastc_modes"),
];

fn decoded(bytes: &[u8]) -> (Image, LoadReport) {
    let mut report = LoadReport::default();
    let image =
        decode("a.ktx2", bytes, &LoadOptions::default(), &mut report).unwrap_or_else(|e| panic!("{e}"));
    (image, report)
}

fn rgba8(bytes: &[u8]) -> Vec<[u8; 4]> {
    match decoded(bytes).0.pixels {
        Pixels::Rgba8(pixels) => pixels,
        _ => panic!("a float image"),
    }
}

fn refused(bytes: &[u8]) -> String {
    let result = decode("a.ktx2", bytes, &LoadOptions::default(), &mut LoadReport::default());
    result.map(|_| "an image").expect_err("an error").to_string()
}

/// What is in a file that a test makes.
#[derive(Clone, Copy)]
struct Content<'d> {
    format: Option<Format>,
    size: (u32, u32),
    /// The number of the general compression; 0: none.
    scheme: u32,
    /// The color model of the data format descriptor.
    model: u8,
    metadata: &'d [(&'d str, &'d str)],
    level: &'d [u8],
}

impl Content<'_> {
    fn file(self) -> Vec<u8> {
        let dfd_offset = (Header::LENGTH + LevelIndex::LENGTH) as u32;
        // One descriptor block of version 2 without samples: 4 bytes of length, 24 of block.
        let dfd: [u8; 28] = {
            let mut dfd = [0; 28];
            (dfd[0], dfd[8], dfd[10], dfd[12], dfd[13], dfd[14]) = (28, 2, 24, self.model, 1, 1);
            dfd
        };
        let mut metadata = Vec::new();
        for (key, value) in self.metadata {
            let length = key.len() + value.len() + 2;
            metadata.extend((length as u32).to_le_bytes());
            metadata.extend([key.as_bytes(), b"\0", value.as_bytes(), b"\0"].concat());
            metadata.resize(metadata.len().next_multiple_of(4), 0);
        }
        let level_offset = dfd_offset as usize + dfd.len() + metadata.len();
        let header = Header {
            format: self.format,
            type_size: 1,
            pixel_width: self.size.0,
            pixel_height: self.size.1,
            pixel_depth: 0,
            layer_count: 0,
            face_count: 1,
            level_count: 1,
            supercompression_scheme: ::ktx2::SupercompressionScheme::new(self.scheme),
            index: Index {
                dfd_byte_offset: dfd_offset,
                dfd_byte_length: dfd.len() as u32,
                kvd_byte_offset: if metadata.is_empty() { 0 } else { dfd_offset + dfd.len() as u32 },
                kvd_byte_length: metadata.len() as u32,
                sgd_byte_offset: 0,
                sgd_byte_length: 0,
            },
        };
        let level = LevelIndex {
            byte_offset: level_offset as u64,
            byte_length: self.level.len() as u64,
            uncompressed_byte_length: 0,
        };
        [&header.as_bytes()[..], &level.as_bytes(), &dfd, &metadata, self.level].concat()
    }
}

/// A file of plain pixels.
fn plain(format: Format, size: (u32, u32), level: &[u8]) -> Vec<u8> {
    Content { format: Some(format), size, scheme: 0, model: 1, metadata: &[], level }.file()
}

#[test]
fn pixels_are_those_of_the_reference_transcoder() {
    for (name, file, png) in SAMPLES {
        let (image, report) = decoded(file);
        let expected = ::image::load_from_memory(png).unwrap().into_rgba8();
        assert_eq!((image.width, image.height), expected.dimensions(), "{name}");
        let pixels = rgba8(file);
        for (i, (ours, theirs)) in pixels.iter().zip(expected.pixels()).enumerate() {
            let at = (i % image.width as usize, i / image.width as usize);
            assert_eq!(*ours, theirs.0, "{name}: pixel {at:?}");
        }
        assert!(report.notes.iter().all(|n| n.severity == Severity::Info), "{name}: {report:?}");
    }
}

#[test]
fn the_comparison_would_notice_a_wrong_bit() {
    let (_, file, _) = SAMPLES[4];
    let mut damaged = file.to_vec();
    *damaged.last_mut().unwrap() ^= 0x80; // the last weight of the last block
    assert_ne!(rgba8(&damaged), rgba8(file));
}

#[test]
fn general_compression_changes_no_pixel() {
    let (_, file, _) = SAMPLES[3];
    let blocks = ::ktx2::Reader::new(file).unwrap().levels().next().unwrap().data.to_vec();
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    zlib.write_all(&blocks).unwrap();
    let zlib = zlib.finish().unwrap();
    let zstd = ruzstd::encoding::compress_to_vec(&blocks[..], ruzstd::encoding::CompressionLevel::Fastest);
    for (scheme, level) in [(0, &blocks), (2, &zstd), (3, &zlib)] {
        let content = Content { format: None, size: (46, 38), scheme, model: 166, metadata: &[], level };
        assert_eq!(rgba8(&content.file()), rgba8(file), "scheme {scheme}");
        let cut = Content { level: &level[..level.len() / 2], ..content };
        assert!(!refused(&cut.file()).is_empty(), "scheme {scheme}");
    }
}

#[test]
fn formats_of_vulkan_are_read() {
    let second = |pixel: &[u8]| [&vec![0; pixel.len()], pixel].concat();
    let one = |format, pixel: &[u8]| rgba8(&plain(format, (2, 1), &second(pixel)))[1];
    assert_eq!(one(Format::R8_UNORM, &[77]), [77, 77, 77, 255]);
    assert_eq!(one(Format::R8G8_UNORM, &[7, 8]), [7, 8, 0, 255]);
    assert_eq!(one(Format::R8G8B8_SRGB, &[1, 2, 3]), [1, 2, 3, 255]);
    assert_eq!(one(Format::R8G8B8A8_SRGB, &[1, 2, 3, 4]), [1, 2, 3, 4]);
    assert_eq!(one(Format::B8G8R8A8_UNORM, &[1, 2, 3, 4]), [3, 2, 1, 4]);
    assert_eq!(one(Format::R5G6B5_UNORM_PACK16, &[0xe0, 0xff]), [255, 255, 0, 255]);
    assert_eq!(one(Format::R5G5B5A1_UNORM_PACK16, &[0x01, 0xf8]), [255, 0, 0, 255]);
    assert_eq!(one(Format::R16G16B16A16_UNORM, &[0xff, 0xff, 0x80, 0x80, 0, 0, 0x7f, 0]), [255, 128, 0, 0]);
    let blocks = [0x00, 0xf8, 0x1f, 0x00, 0b0000_0000, 0b0101_0101, 0, 0];
    assert_eq!(
        rgba8(&plain(Format::BC1_RGB_SRGB_BLOCK, (2, 2), &blocks))[1..3],
        [[255, 0, 0, 255], [0, 0, 255, 255]]
    );
    let floats = |format, numbers: &[f32]| {
        let bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
        let pixels = decoded(&plain(format, (1, 1), &bytes)).0.pixels;
        assert!(pixels.is_float());
        pixels.stored(0)
    };
    assert_eq!(floats(Format::R32G32B32A32_SFLOAT, &[1.5, -2.0, 7.25, 0.25]), [1.5, 0.0, 7.25, 0.25]);
    assert_eq!(floats(Format::R32G32B32_SFLOAT, &[1.5, 2.0, 7.25]), [1.5, 2.0, 7.25, 1.0]);
    assert_eq!(floats(Format::R32_SFLOAT, &[40.0]), [40.0, 40.0, 40.0, 1.0]);
    let packed = |format, bits: u32| decoded(&plain(format, (1, 1), &bits.to_le_bytes())).0.pixels.stored(0);
    let shared = 128 | 16 << 9 | 8 << 18 | 20 << 27;
    assert_eq!(packed(Format::E5B9G9R9_UFLOAT_PACK32, shared), [8.0, 1.0, 0.5, 1.0]);
    let own = 0x480 | 0x3c0 << 11 | 0x1c0 << 22;
    assert_eq!(packed(Format::B10G11R11_UFLOAT_PACK32, own), [8.0, 1.0, 0.5, 1.0]);
}

#[test]
fn orientation_and_swizzle_are_those_of_the_file() {
    let level: Vec<u8> = (0..6).flat_map(|i| [i, 10 + i, 20 + i]).collect();
    let content = Content {
        format: Some(Format::R8G8B8_UNORM),
        size: (3, 2),
        scheme: 0,
        model: 1,
        metadata: &[],
        level: &level,
    };
    let reds = |orientation| {
        let metadata = &[("KTXorientation", orientation)];
        rgba8(&Content { metadata, ..content }.file()).iter().map(|p| p[0]).collect::<Vec<_>>()
    };
    assert_eq!(reds("rd"), [0, 1, 2, 3, 4, 5]);
    assert_eq!(reds("ru"), [3, 4, 5, 0, 1, 2]);
    assert_eq!(reds("ld"), [2, 1, 0, 5, 4, 3]);
    assert_eq!(reds("lu"), [5, 4, 3, 2, 1, 0]);
    let swizzled = |swizzle| rgba8(&Content { metadata: &[("KTXswizzle", swizzle)], ..content }.file())[1];
    assert_eq!([swizzled("rgba"), swizzled("bg01")], [[1, 11, 21, 255], [21, 11, 0, 255]]);
}

#[test]
fn what_cannot_be_read_is_named() {
    let unknown = refused(&plain(Format::R8G8B8A8_SNORM, (1, 1), &[0; 4]));
    assert!(unknown.contains("R8G8B8A8_SNORM"), "{unknown}");
    let short = refused(&plain(Format::R8_UNORM, (4, 4), &[0; 15]));
    assert!(short.contains("15 bytes of 16"), "{short}");
    let huge = refused(&plain(Format::R8_UNORM, (60_000, 60_000), &[0; 15]));
    assert!(huge.contains("60000"), "{huge}");
    let (_, etc1s, _) = SAMPLES[0];
    assert!(refused(&etc1s[..60]).contains("container"));
    // The number of endpoints is one of the first words of the global data.
    let start = ::ktx2::Reader::new(etc1s).unwrap().header().index.sgd_byte_offset as usize;
    let mut more = etc1s.to_vec();
    more[start..start + 2].copy_from_slice(&u16::MAX.to_le_bytes());
    let message = refused(&more);
    assert!(message.contains("endpoints"), "{message}");
}

#[test]
fn damaged_files_never_panic() {
    for (_, file, _) in SAMPLES {
        let try_it = |bytes: &[u8]| {
            let _ = decode("a.ktx2", bytes, &LoadOptions::default(), &mut LoadReport::default());
        };
        (0..file.len()).for_each(|cut| try_it(&file[..cut]));
        for at in 0..file.len() {
            for change in [0x01, 0x10, 0x80, 0xff] {
                let mut damaged = file.to_vec();
                damaged[at] ^= change;
                // The size of a picture is not at stake, only the time to fill it.
                if !(20..28).contains(&at) || change == 0x01 {
                    try_it(&damaged);
                }
            }
        }
    }
}
