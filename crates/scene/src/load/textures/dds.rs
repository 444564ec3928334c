//! DirectDraw surfaces: the first picture of a file, from blocks of 4×4 pixels or from bits.

use super::error::TextureError;
use super::size_limits::check_size;
use super::storage::{Compression, Number, PackedFloats, Storage};
use crate::load::LoadOptions;
use crate::{Image, LoadReport};
use ddsfile::{Caps2, Dds, DxgiFormat, FourCC, MiscFlag, PixelFormatFlags};

/// Whether the bytes start as a DirectDraw surface does.
pub(super) fn is_dds(bytes: &[u8]) -> bool {
    bytes.starts_with(b"DDS ")
}

/// Decodes the largest level of the first picture in the file.
///
/// Blocks BC1 to BC5 and BC7 and bits that are no floats become [`Pixels::Rgba8`], the stored numbers as they are; BC6H and
/// floating-point channels stay floats.
pub(super) fn decode_dds(
    name: &str,
    bytes: &[u8],
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    let dds = Dds::read(bytes).map_err(|e| TextureError::Decode(e.to_string()))?;
    let (width, height) = (dds.header.width, dds.header.height);
    let storage = storage(&dds)?;
    check_size(width.into(), height.into(), bytes.len(), storage.pixel_bytes(), options)?;
    if has_several_pictures(&dds) {
        report.approximated("only the first picture of a cube, an array or a volume is used");
    }
    let pixels = storage.pixels(&dds.data, (width as usize, height as usize), report)?;
    Ok(Image { name: name.into(), width, height, pixels })
}

fn has_several_pictures(dds: &Dds) -> bool {
    let many = |h: &ddsfile::Header10| h.array_size > 1 || h.misc_flag.contains(MiscFlag::TEXTURECUBE);
    dds.header.caps2.intersects(Caps2::CUBEMAP | Caps2::VOLUME) || dds.header10.as_ref().is_some_and(many)
}

fn storage(dds: &Dds) -> Result<Storage, TextureError> {
    use Compression::{Bc1, Bc2, Bc3, Bc4, Bc5, Bc6h, Bc7};
    use DxgiFormat as F;
    let unknown = |what: String| TextureError::Decode(format!("the pixel format {what} is not supported"));
    let masks = |bits, rgba| Ok(Storage::Masks { bits, rgba });
    let numbers = |kind, channels| Ok(Storage::Numbers { kind, channels });
    if let Some(header) = &dds.header10 {
        return match header.dxgi_format {
            F::BC1_Typeless | F::BC1_UNorm | F::BC1_UNorm_sRGB => Ok(Storage::Blocks(Bc1)),
            F::BC2_Typeless | F::BC2_UNorm | F::BC2_UNorm_sRGB => Ok(Storage::Blocks(Bc2)),
            F::BC3_Typeless | F::BC3_UNorm | F::BC3_UNorm_sRGB => Ok(Storage::Blocks(Bc3)),
            F::BC4_Typeless | F::BC4_UNorm => Ok(Storage::Blocks(Bc4)),
            F::BC5_Typeless | F::BC5_UNorm => Ok(Storage::Blocks(Bc5)),
            F::BC6H_Typeless | F::BC6H_UF16 => Ok(Storage::Blocks(Bc6h { signed: false })),
            F::BC6H_SF16 => Ok(Storage::Blocks(Bc6h { signed: true })),
            F::BC7_Typeless | F::BC7_UNorm | F::BC7_UNorm_sRGB => Ok(Storage::Blocks(Bc7)),
            F::R8G8B8A8_Typeless | F::R8G8B8A8_UNorm | F::R8G8B8A8_UNorm_sRGB => {
                masks(32, [0xff, 0xff00, 0xff_0000, 0xff00_0000])
            }
            F::B8G8R8A8_Typeless | F::B8G8R8A8_UNorm | F::B8G8R8A8_UNorm_sRGB => {
                masks(32, [0xff_0000, 0xff00, 0xff, 0xff00_0000])
            }
            F::B8G8R8X8_Typeless | F::B8G8R8X8_UNorm | F::B8G8R8X8_UNorm_sRGB => {
                masks(32, [0xff_0000, 0xff00, 0xff, 0])
            }
            F::R10G10B10A2_UNorm => masks(32, [0x3ff, 0xf_fc00, 0x3ff0_0000, 0xc000_0000]),
            F::B5G6R5_UNorm => masks(16, [0xf800, 0x7e0, 0x1f, 0]),
            F::B5G5R5A1_UNorm => masks(16, [0x7c00, 0x3e0, 0x1f, 0x8000]),
            F::R8_UNorm | F::R8_Typeless => masks(8, [0xff, 0xff, 0xff, 0]),
            F::R16_Float => numbers(Number::Half, 1),
            F::R16G16_Float => numbers(Number::Half, 2),
            F::R16G16B16A16_Float => numbers(Number::Half, 4),
            F::R32_Float => numbers(Number::Float, 1),
            F::R32G32_Float => numbers(Number::Float, 2),
            F::R32G32B32_Float => numbers(Number::Float, 3),
            F::R32G32B32A32_Float => numbers(Number::Float, 4),
            F::R11G11B10_Float => Ok(Storage::Packed(PackedFloats::Rg11B10)),
            F::R9G9B9E5_SharedExp => Ok(Storage::Packed(PackedFloats::Rgb9E5)),
            other => Err(unknown(format!("{other:?}"))),
        };
    }
    let format = &dds.header.spf;
    if let Some(FourCC(code)) = format.fourcc {
        return match code {
            FourCC::DXT1 => Ok(Storage::Blocks(Bc1)),
            FourCC::DXT3 => Ok(Storage::Blocks(Bc2)),
            FourCC::DXT5 => Ok(Storage::Blocks(Bc3)),
            FourCC::ATI1 | FourCC::BC4_UNORM => Ok(Storage::Blocks(Bc4)),
            FourCC::ATI2 | BC5U => Ok(Storage::Blocks(Bc5)),
            FourCC::R16F => numbers(Number::Half, 1),
            FourCC::G16R16F => numbers(Number::Half, 2),
            FourCC::A16B16G16R16F => numbers(Number::Half, 4),
            FourCC::R32F => numbers(Number::Float, 1),
            FourCC::G32R32F => numbers(Number::Float, 2),
            FourCC::A32B32G32R32F => numbers(Number::Float, 4),
            other => Err(unknown(String::from_utf8_lossy(&other.to_le_bytes()).escape_default().to_string())),
        };
    }
    let [r, g, b, a] = [format.r_bit_mask, format.g_bit_mask, format.b_bit_mask, format.a_bit_mask]
        .map(Option::unwrap_or_default);
    match format.rgb_bit_count {
        Some(bits @ (8 | 16 | 24 | 32)) if format.flags.contains(PixelFormatFlags::LUMINANCE) => {
            // The bits that are not alpha: the parser keeps no other mask of grey.
            let grey = u32::MAX >> (32 - bits) & !a;
            masks(bits, [grey, grey, grey, a])
        }
        // One channel is grey, as elsewhere.
        Some(bits @ (8 | 16 | 24 | 32)) if r != 0 && g == 0 && b == 0 => masks(bits, [r, r, r, a]),
        Some(bits @ (8 | 16 | 24 | 32)) if r != 0 => masks(bits, [r, g, b, a]),
        bits => Err(unknown(format!("of {} bits", bits.unwrap_or(0)))),
    }
}

/// Another name of two-channel blocks, which some tools write.
const BC5U: u32 = u32::from_le_bytes(*b"BC5U");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pixels;
    use crate::load::{LoadOptions, textures::decode};
    use ddsfile::{AlphaMode, D3D10ResourceDimension, D3DFormat, NewD3dParams, NewDxgiParams};
    use exr::prelude::f16;
    use proptest::prelude::*;

    fn file(format: DxgiFormat, width: u32, height: u32, data: &[u8]) -> Vec<u8> {
        let mut dds = Dds::new_dxgi(NewDxgiParams {
            width,
            height,
            depth: None,
            format,
            mipmap_levels: None,
            array_layers: None,
            caps2: None,
            is_cubemap: false,
            resource_dimension: D3D10ResourceDimension::Texture2D,
            alpha_mode: AlphaMode::Unknown,
        })
        .unwrap();
        dds.data = data.to_vec();
        bytes(&dds)
    }

    fn legacy(format: D3DFormat, width: u32, height: u32, data: &[u8]) -> Vec<u8> {
        let (depth, mipmap_levels, caps2) = (None, None, None);
        let mut dds =
            Dds::new_d3d(NewD3dParams { width, height, depth, format, mipmap_levels, caps2 }).unwrap();
        dds.data = data.to_vec();
        bytes(&dds)
    }

    fn bytes(dds: &Dds) -> Vec<u8> {
        let mut bytes = Vec::new();
        dds.write(&mut bytes).unwrap();
        bytes
    }

    fn decoded(bytes: &[u8]) -> Image {
        decode("a.dds", bytes, &LoadOptions::default(), &mut LoadReport::default()).unwrap()
    }

    fn rgba8(bytes: &[u8]) -> Vec<[u8; 4]> {
        match decoded(bytes).pixels {
            Pixels::Rgba8(pixels) => pixels,
            _ => panic!("a float image"),
        }
    }

    fn rgb32f(bytes: &[u8]) -> Vec<[f32; 3]> {
        match decoded(bytes).pixels {
            Pixels::Rgb32F(pixels) => pixels,
            _ => panic!("not RGB of floats"),
        }
    }

    /// Red and blue as end points; rows of 0, 1, 2 and 3 of them.
    const RED_TO_BLUE: [u8; 8] = [0x00, 0xf8, 0x1f, 0x00, 0b0000_0000, 0b0101_0101, 0b1010_1010, 0b1111_1111];

    #[test]
    fn blocks_are_placed_and_cut_at_the_edges() {
        let white = [0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0];
        let data = [RED_TO_BLUE, white, white, RED_TO_BLUE].concat();
        for bytes in [file(DxgiFormat::BC1_UNorm, 6, 5, &data), legacy(D3DFormat::DXT1, 6, 5, &data)] {
            let pixels = rgba8(&bytes);
            assert_eq!(pixels.len(), 30);
            let at = |x: usize, y: usize| pixels[y * 6 + x];
            assert_eq!((at(0, 0), at(3, 1)), ([255, 0, 0, 255], [0, 0, 255, 255]));
            assert_eq!((at(1, 2), at(2, 3)), ([170, 0, 85, 255], [85, 0, 170, 255]));
            assert_eq!((at(4, 0), at(0, 4), at(5, 4)), ([255; 4], [255; 4], [255, 0, 0, 255]));
        }
    }

    #[test]
    fn every_compression_gives_the_values_of_its_definition() {
        let alpha = [[0x21; 8], RED_TO_BLUE].concat();
        assert_eq!(rgba8(&legacy(D3DFormat::DXT3, 4, 4, &alpha))[..2], [[255, 0, 0, 17], [255, 0, 0, 34]]);
        let ramp = [200, 100, 0, 0, 0, 0, 0, 0];
        let alpha = [ramp, RED_TO_BLUE].concat();
        assert_eq!(rgba8(&legacy(D3DFormat::DXT5, 4, 4, &alpha))[0], [255, 0, 0, 200]);
        assert_eq!(rgba8(&file(DxgiFormat::BC4_UNorm, 4, 4, &ramp))[5], [200, 200, 200, 255]);
        // A normal that leans by 30° along x.
        let (x, y) = ([191, 0, 0, 0, 0, 0, 0, 0], [128, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(rgba8(&file(DxgiFormat::BC5_UNorm, 4, 4, &[x, y].concat()))[0], [191, 128, 238, 255]);
        // Mode 6: end points of 7 bits and one that they share; all indices are zero.
        let ends = (0..8).fold(1_u128 << 6, |block, i| block | 0x40 << (7 + 7 * i));
        let block = (ends | 0b11 << 63).to_le_bytes();
        assert_eq!(rgba8(&file(DxgiFormat::BC7_UNorm_sRGB, 4, 4, &block))[15], [129; 4]);
        // Mode 11: end points of 10 bits.
        let block = (0..6).fold(0b00011_u128, |block, i| block | 512 << (5 + 10 * i)).to_le_bytes();
        let value = f16::from_bits(0x3e0f).to_f32();
        assert_eq!(rgb32f(&file(DxgiFormat::BC6H_UF16, 4, 4, &block))[7], [value; 3]);
    }

    #[test]
    fn bits_are_spread_over_bytes() {
        let one = |bytes: Vec<u8>| rgba8(&bytes)[1];
        let second = |pixel: &[u8]| [&vec![0; pixel.len()], pixel].concat();
        let bgra = second(&[1, 2, 3, 4]);
        assert_eq!(one(legacy(D3DFormat::A8R8G8B8, 2, 1, &bgra)), [3, 2, 1, 4]);
        assert_eq!(one(legacy(D3DFormat::X8R8G8B8, 2, 1, &bgra)), [3, 2, 1, 255]);
        assert_eq!(one(legacy(D3DFormat::R8G8B8, 2, 1, &second(&[1, 2, 3]))), [3, 2, 1, 255]);
        assert_eq!(one(legacy(D3DFormat::R5G6B5, 2, 1, &second(&[0xe0, 0xff]))), [255, 255, 0, 255]);
        // As red only, and as Direct3D itself writes it, as luminance.
        let mut grey = legacy(D3DFormat::L8, 2, 1, &second(&[77]));
        assert_eq!(one(grey.clone()), [77, 77, 77, 255]);
        grey[80..84].copy_from_slice(&PixelFormatFlags::LUMINANCE.bits().to_le_bytes());
        assert_eq!(one(grey), [77, 77, 77, 255]);
        assert_eq!(one(file(DxgiFormat::R8G8B8A8_UNorm, 2, 1, &bgra)), [1, 2, 3, 4]);
        let floats: Vec<u8> =
            [0.0_f32; 4].iter().chain(&[1.5, -2.0, 7.25, 1.0]).flat_map(|v| v.to_le_bytes()).collect();
        let pixels = decoded(&file(DxgiFormat::R32G32B32A32_Float, 2, 1, &floats)).pixels;
        assert_eq!([0, 1].map(|i| pixels.stored(i)), [[0.0; 4], [1.5, 0.0, 7.25, 1.0]]);
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let refused = |bytes: &[u8]| {
            decode("a.dds", bytes, &LoadOptions::default(), &mut LoadReport::default())
                .unwrap_err()
                .to_string()
        };
        let short = refused(&file(DxgiFormat::BC1_UNorm, 8, 8, &RED_TO_BLUE));
        assert!(short.contains("8 bytes of 32"), "{short}");
        let unknown = refused(&file(DxgiFormat::R16_UNorm, 1, 1, &[0; 2]));
        assert!(unknown.contains("R16_UNorm"), "{unknown}");
        let huge = refused(&file(DxgiFormat::BC1_UNorm, 60_000, 60_000, &RED_TO_BLUE));
        assert!(huge.contains("60000"), "{huge}");
        assert!(!refused(&RED_TO_BLUE).is_empty() && !refused(b"DDS \x7c").is_empty());
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_refused(
            format in 0u32..134, data in prop::collection::vec(any::<u8>(), 128), at in 0usize..148, value: u8,
        ) {
            let mut bytes = file(DxgiFormat::BC1_UNorm, 7, 9, &data);
            bytes[128..132].copy_from_slice(&format.to_le_bytes());
            let _ = decode("a.dds", &bytes, &LoadOptions::default(), &mut LoadReport::default());
            bytes[at] = value;
            let _ = decode("a.dds", &bytes, &LoadOptions::default(), &mut LoadReport::default());
        }
    }
}
