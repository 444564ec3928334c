//! Pixels as files for GPUs keep them: blocks of 4×4, bits of one number, or several numbers.

use super::error::TextureError;
use super::float::{float_pixels, mend};
use crate::load::session::{FLOAT_PIXEL, PIXEL};
use crate::{LoadReport, Pixels};
use exr::prelude::f16;

/// How a file stores its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Storage {
    /// Blocks of 4×4 pixels.
    Blocks(Compression),
    /// A number of `bits` (8, 16, 24 or 32) for each pixel, the bits of whose channels are set in the masks; no bits: zero,
    /// of alpha one.
    Masks { bits: u32, rgba: [u32; 4] },
    /// One to four numbers for each pixel. One is grey; what is absent is zero, alpha one.
    Numbers { kind: Number, channels: usize },
    /// A number of 32 bits for each pixel.
    Packed(PackedFloats),
}

/// A channel of more than eight bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    /// 16 bits from zero to one, which become eight.
    Fraction,
    /// A floating-point number of 16 bits.
    Half,
    /// A floating-point number of 32 bits.
    Float,
}

/// Three floating-point numbers without sign in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PackedFloats {
    /// 11 bits of red, 11 of green and 10 of blue, from the lowest on, each with 5 bits of exponent.
    Rg11B10,
    /// 9 bits each from the lowest on, then 5 bits of exponent that they share.
    Rgb9E5,
}

/// Formats of blocks, as Direct3D counts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compression {
    Bc1,
    Bc2,
    Bc3,
    Bc4,
    Bc5,
    Bc6h { signed: bool },
    Bc7,
}

impl Storage {
    /// Bytes that a picture of `size` (width, height) takes.
    pub fn length(self, (width, height): (usize, usize)) -> usize {
        match self {
            Self::Blocks(compression) => width.div_ceil(4) * height.div_ceil(4) * compression.block_bytes(),
            Self::Masks { bits, .. } => width * height * bits as usize / 8,
            Self::Numbers { kind, channels } => width * height * channels * kind.bytes(),
            Self::Packed(_) => width * height * 4,
        }
    }

    /// What a pixel takes of the scene's memory, in bytes.
    pub fn pixel_bytes(self) -> u64 {
        match self {
            Self::Blocks(Compression::Bc6h { .. }) | Self::Packed(_) => FLOAT_PIXEL,
            Self::Numbers { kind: Number::Half | Number::Float, .. } => FLOAT_PIXEL,
            Self::Blocks(_) | Self::Masks { .. } | Self::Numbers { kind: Number::Fraction, .. } => PIXEL,
        }
    }

    /// The picture of `size` (width, height) at the start of `data`, row by row.
    ///
    /// Floating-point numbers and BC6H stay floats and are mended, all else becomes [`Pixels::Rgba8`], the stored numbers as
    /// they are.
    ///
    /// # Errors
    /// Too few bytes.
    pub fn pixels(
        self,
        data: &[u8],
        size: (usize, usize),
        report: &mut LoadReport,
    ) -> Result<Pixels, TextureError> {
        let data = first_picture(data, self.length(size))?;
        Ok(match self {
            Self::Blocks(Compression::Bc6h { signed }) => {
                let radiance = |block: &[u8; 16]| {
                    let mut rgb = [0.0; 48];
                    bcdec_rs::bc6h_float(block, &mut rgb, 12, signed);
                    std::array::from_fn(|i| [rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], 1.0])
                };
                mended(from_blocks(data, size, radiance), report)
            }
            Self::Blocks(compression) => {
                if compression == Compression::Bc5 {
                    report.info("two channels are taken for those of a normal map");
                }
                Pixels::Rgba8(match compression.block_bytes() {
                    8 => from_blocks(data, size, |block: &[u8; 8]| compression.rgba8(block)),
                    _ => from_blocks(data, size, |block: &[u8; 16]| compression.rgba8(block)),
                })
            }
            Self::Masks { bits, rgba } => {
                let pixels = data.chunks_exact(bits as usize / 8);
                Pixels::Rgba8(pixels.map(|pixel| from_bits(pixel, rgba)).collect())
            }
            Self::Numbers { kind: Number::Fraction, channels } => {
                report.info("sixteen-bit channels were rounded to eight bits");
                let rounded = |bytes: &[u8; 2]| ((u32::from(u16::from_le_bytes(*bytes)) + 128) / 257) as u8;
                let numbers: Vec<u8> = data.as_chunks().0.iter().map(rounded).collect();
                Pixels::Rgba8(numbers.chunks_exact(channels).map(|n| spread(n, 255)).collect())
            }
            Self::Numbers { kind: Number::Half, channels } => {
                let half = |bytes: &[u8; 2]| f16::from_le_bytes(*bytes).to_f32();
                colors(&data.as_chunks().0.iter().map(half).collect::<Vec<_>>(), channels, report)
            }
            Self::Numbers { kind: Number::Float, channels } => {
                let float = |bytes: &[u8; 4]| f32::from_le_bytes(*bytes);
                colors(&data.as_chunks().0.iter().map(float).collect::<Vec<_>>(), channels, report)
            }
            Self::Packed(packing) => {
                let pixel = |bytes: &[u8; 4]| packing.unpacked(u32::from_le_bytes(*bytes));
                mended(data.as_chunks().0.iter().map(pixel).collect(), report)
            }
        })
    }
}

impl Number {
    fn bytes(self) -> usize {
        match self {
            Self::Fraction | Self::Half => 2,
            Self::Float => 4,
        }
    }
}

impl PackedFloats {
    fn unpacked(self, bits: u32) -> [f32; 4] {
        match self {
            Self::Rg11B10 => {
                // As half floats, which have a sign before and more digits behind.
                let half = |bits: u32| f16::from_bits(bits as u16).to_f32();
                [half((bits & 0x7ff) << 4), half((bits >> 11 & 0x7ff) << 4), half((bits >> 22) << 5), 1.0]
            }
            Self::Rgb9E5 => {
                let scale = elementary::exp2((bits >> 27) as f32 - 24.0);
                let channel = |shift: u32| (bits >> shift & 0x1ff) as f32 * scale;
                [channel(0), channel(9), channel(18), 1.0]
            }
        }
    }
}

impl Compression {
    /// Bytes that a block takes.
    fn block_bytes(self) -> usize {
        match self {
            Self::Bc1 | Self::Bc4 => 8,
            Self::Bc2 | Self::Bc3 | Self::Bc5 | Self::Bc6h { .. } | Self::Bc7 => 16,
        }
    }

    /// The 16 pixels of a block, row by row. Two channels are taken for those of a normal map, whose third follows from
    /// them; one is grey.
    fn rgba8(self, block: &[u8]) -> [[u8; 4]; 16] {
        let mut rgba = [0; 64];
        match self {
            Self::Bc1 => bcdec_rs::bc1(block, &mut rgba, 16),
            Self::Bc2 => bcdec_rs::bc2(block, &mut rgba, 16),
            Self::Bc3 => bcdec_rs::bc3(block, &mut rgba, 16),
            Self::Bc7 => bcdec_rs::bc7(block, &mut rgba, 16),
            Self::Bc4 => {
                let mut grey = [0; 16];
                bcdec_rs::bc4(block, &mut grey, 4, false);
                return grey.map(|v| [v, v, v, 255]);
            }
            Self::Bc5 => {
                let mut xy = [0; 32];
                bcdec_rs::bc5(block, &mut xy, 8, false);
                return std::array::from_fn(|i| with_unit_length(xy[2 * i], xy[2 * i + 1]));
            }
            // Decoded to floats, by `Storage::pixels`.
            Self::Bc6h { .. } => {}
        }
        std::array::from_fn(|i| std::array::from_fn(|c| rgba[4 * i + c]))
    }
}

/// The first `length` bytes: the largest level of the first picture.
pub(super) fn first_picture(data: &[u8], length: usize) -> Result<&[u8], TextureError> {
    let short = || TextureError::Decode(format!("has {} bytes of {length} for its pixels", data.len()));
    data.get(..length).ok_or_else(short)
}

/// Pixels row by row, from blocks of 4×4 of `N` bytes that `decoded` knows how to read. Blocks at the right and lower edge
/// may reach beyond.
pub(super) fn from_blocks<T: Copy + Default, const N: usize>(
    data: &[u8],
    (width, height): (usize, usize),
    mut decoded: impl FnMut(&[u8; N]) -> [T; 16],
) -> Vec<T> {
    let columns = width.div_ceil(4);
    let mut pixels = vec![T::default(); width * height];
    for (i, block) in data.as_chunks::<N>().0.iter().enumerate() {
        place(&mut pixels, (width, height), (i % columns, i / columns), &decoded(block));
    }
    pixels
}

/// Writes a block of 4×4 pixels into a picture; `at` counts blocks. What reaches beyond the picture is cut off.
pub(super) fn place<T: Copy>(
    pixels: &mut [T],
    (width, height): (usize, usize),
    at: (usize, usize),
    block: &[T; 16],
) {
    let (x, y) = (at.0 * 4, at.1 * 4);
    let count = width.saturating_sub(x).min(4);
    for (row, values) in block.as_chunks::<4>().0.iter().enumerate().take(height.saturating_sub(y)) {
        let start = (y + row) * width + x;
        pixels[start..start + count].copy_from_slice(&values[..count]);
    }
}

/// The colour of a unit normal of which x and y are known.
fn with_unit_length(x: u8, y: u8) -> [u8; 4] {
    let [fx, fy] = [x, y].map(|v| f32::from(v) / 127.5 - 1.0);
    let z = (1.0 - fx * fx - fy * fy).max(0.0).sqrt();
    [x, y, (127.5 + 127.5 * z).round() as u8, 255]
}

/// A pixel of one to four bytes, channels as the masks say, spread over eight bits.
fn from_bits(pixel: &[u8], rgba: [u32; 4]) -> [u8; 4] {
    let value = pixel.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
    let channel = |mask: u32, absent: u8| {
        let most = u64::from(mask.checked_shr(mask.trailing_zeros()).unwrap_or(0));
        if most == 0 {
            return absent;
        }
        let stored = u64::from((value & mask) >> mask.trailing_zeros());
        ((stored * 255 + most / 2) / most).min(255) as u8
    };
    let [r, g, b, a] = rgba;
    [channel(r, 0), channel(g, 0), channel(b, 0), channel(a, 255)]
}

/// Four channels from one to four numbers.
fn spread<T: Copy + Default>(numbers: &[T], one: T) -> [T; 4] {
    match *numbers {
        [grey] => [grey, grey, grey, one],
        [r, g] => [r, g, T::default(), one],
        [r, g, b] => [r, g, b, one],
        [r, g, b, a, ..] => [r, g, b, a],
        [] => [T::default(); 4],
    }
}

fn colors(numbers: &[f32], channels: usize, report: &mut LoadReport) -> Pixels {
    mended(numbers.chunks_exact(channels).map(|n| spread(n, 1.0)).collect(), report)
}

fn mended(mut pixels: Vec<[f32; 4]>, report: &mut LoadReport) -> Pixels {
    mend(pixels.as_flattened_mut(), report);
    float_pixels(pixels)
}
