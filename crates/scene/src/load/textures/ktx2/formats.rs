//! Formats of Vulkan that files may hold.

use crate::load::textures::storage::{Compression, Number, PackedFloats, Storage};
use ::ktx2::Format;

/// How a format stores its pixels; `None` if it is not supported. Formats with sRGB transfer function are stored as those
/// without.
pub(super) fn storage(format: Format) -> Option<Storage> {
    use Format as F;
    let blocks = |compression| Some(Storage::Blocks(compression));
    let masks = |bits, rgba| Some(Storage::Masks { bits, rgba });
    let numbers = |kind, channels| Some(Storage::Numbers { kind, channels });
    match format {
        F::R8_UNORM | F::R8_SRGB => masks(8, [0xff, 0xff, 0xff, 0]),
        F::R8G8_UNORM | F::R8G8_SRGB => masks(16, [0xff, 0xff00, 0, 0]),
        F::R8G8B8_UNORM | F::R8G8B8_SRGB => masks(24, [0xff, 0xff00, 0xff_0000, 0]),
        F::B8G8R8_UNORM | F::B8G8R8_SRGB => masks(24, [0xff_0000, 0xff00, 0xff, 0]),
        F::R8G8B8A8_UNORM | F::R8G8B8A8_SRGB | F::A8B8G8R8_UNORM_PACK32 | F::A8B8G8R8_SRGB_PACK32 => {
            masks(32, [0xff, 0xff00, 0xff_0000, 0xff00_0000])
        }
        F::B8G8R8A8_UNORM | F::B8G8R8A8_SRGB => masks(32, [0xff_0000, 0xff00, 0xff, 0xff00_0000]),
        F::R5G6B5_UNORM_PACK16 => masks(16, [0xf800, 0x7e0, 0x1f, 0]),
        F::R4G4B4A4_UNORM_PACK16 => masks(16, [0xf000, 0xf00, 0xf0, 0xf]),
        F::R5G5B5A1_UNORM_PACK16 => masks(16, [0xf800, 0x7c0, 0x3e, 1]),
        F::A1R5G5B5_UNORM_PACK16 => masks(16, [0x7c00, 0x3e0, 0x1f, 0x8000]),
        F::A2R10G10B10_UNORM_PACK32 => masks(32, [0x3ff0_0000, 0xf_fc00, 0x3ff, 0xc000_0000]),
        F::A2B10G10R10_UNORM_PACK32 => masks(32, [0x3ff, 0xf_fc00, 0x3ff0_0000, 0xc000_0000]),
        F::R16_UNORM => numbers(Number::Fraction, 1),
        F::R16G16_UNORM => numbers(Number::Fraction, 2),
        F::R16G16B16_UNORM => numbers(Number::Fraction, 3),
        F::R16G16B16A16_UNORM => numbers(Number::Fraction, 4),
        F::R16_SFLOAT => numbers(Number::Half, 1),
        F::R16G16_SFLOAT => numbers(Number::Half, 2),
        F::R16G16B16_SFLOAT => numbers(Number::Half, 3),
        F::R16G16B16A16_SFLOAT => numbers(Number::Half, 4),
        F::B10G11R11_UFLOAT_PACK32 => Some(Storage::Packed(PackedFloats::Rg11B10)),
        F::E5B9G9R9_UFLOAT_PACK32 => Some(Storage::Packed(PackedFloats::Rgb9E5)),
        F::R32_SFLOAT => numbers(Number::Float, 1),
        F::R32G32_SFLOAT => numbers(Number::Float, 2),
        F::R32G32B32_SFLOAT => numbers(Number::Float, 3),
        F::R32G32B32A32_SFLOAT => numbers(Number::Float, 4),
        F::BC1_RGB_UNORM_BLOCK | F::BC1_RGB_SRGB_BLOCK | F::BC1_RGBA_UNORM_BLOCK | F::BC1_RGBA_SRGB_BLOCK => {
            blocks(Compression::Bc1)
        }
        F::BC2_UNORM_BLOCK | F::BC2_SRGB_BLOCK => blocks(Compression::Bc2),
        F::BC3_UNORM_BLOCK | F::BC3_SRGB_BLOCK => blocks(Compression::Bc3),
        F::BC4_UNORM_BLOCK => blocks(Compression::Bc4),
        F::BC5_UNORM_BLOCK => blocks(Compression::Bc5),
        F::BC6H_UFLOAT_BLOCK => blocks(Compression::Bc6h { signed: false }),
        F::BC6H_SFLOAT_BLOCK => blocks(Compression::Bc6h { signed: true }),
        F::BC7_UNORM_BLOCK | F::BC7_SRGB_BLOCK => blocks(Compression::Bc7),
        _ => None,
    }
}
