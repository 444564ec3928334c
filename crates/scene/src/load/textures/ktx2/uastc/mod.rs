//! UASTC: blocks of 4×4 pixels in 16 bytes, of 19 modes that are a part of ASTC's with bits laid out in an order of their own.
//!
//! Source: "UASTC LDR 4×4 Texture Specification" (Basis Universal, 2020) and the sections on ASTC of the Khronos Data
//! Format Specification 1.3, whose words are used here.

mod endpoints;
mod modes;
mod partitions;

use crate::load::textures::error::TextureError;
use crate::load::textures::storage::place;
use modes::{Mode, SOLID};
use partitions::Partition;

/// Bytes of a block.
pub(super) const BLOCK_BYTES: usize = 16;

/// The pixels of a picture of `size` (width, height), row by row. `data` has a block for each 4×4 pixels.
///
/// # Errors
/// A block that no encoder can have written; its number is named.
pub(super) fn decode(data: &[u8], size: (usize, usize)) -> Result<Vec<[u8; 4]>, TextureError> {
    let columns = size.0.div_ceil(4);
    let mut pixels = vec![[0; 4]; size.0 * size.1];
    for (i, bytes) in data.as_chunks::<BLOCK_BYTES>().0.iter().enumerate() {
        let block = block(bytes)
            .ok_or_else(|| TextureError::Decode(format!("block {i} of UASTC has an impossible content")))?;
        place(&mut pixels, size, (i % columns, i / columns), &block);
    }
    Ok(pixels)
}

/// The bits of a block, from the lowest of the first byte on.
struct Bits(u128);

impl Bits {
    /// The next `count` bits, at most 8, the first one lowest.
    fn take(&mut self, count: u32) -> u32 {
        let value = self.0 & ((1 << count) - 1);
        self.0 >>= count;
        value as u32
    }
}

/// The 16 pixels of a block, row by row. `None` if its mode or partition does not exist or an end point is out of range.
fn block(bytes: &[u8; BLOCK_BYTES]) -> Option<[[u8; 4]; 16]> {
    let mut bits = Bits(u128::from_le_bytes(*bytes));
    let (number, mode) = Mode::of(bytes[0])?;
    bits.take(mode.code_bits);
    if number == SOLID {
        let color = std::array::from_fn(|_| bits.take(8) as u8);
        return Some([color; 16]);
    }
    // What helps to turn the block into formats for GPUs says nothing about the picture.
    bits.0 >>= mode.hint_bits;
    let partition = match (mode.subsets, number) {
        (1, _) => Partition::whole(),
        (2, 7) => Partition::two_of_three(bits.take(5))?,
        (2, _) => Partition::two(bits.take(5))?,
        _ => Partition::three(bits.take(4))?,
    };
    // The channel that has weights of its own, if there are two planes of them.
    let second_plane = match (mode.planes, mode.channels) {
        (1, _) => None,
        (_, 2) => Some(3),
        _ => Some(bits.take(2) as usize),
    };
    let ends = endpoints::read(&mut bits, mode)?;
    let weights = weights(&mut bits, mode, partition);
    Some(std::array::from_fn(|i| {
        let [low, high] = ends[usize::from(partition.subset[i])];
        std::array::from_fn(|c| {
            let plane = usize::from(second_plane == Some(c));
            interpolate(low[c], high[c], weights[i][plane])
        })
    }))
}

/// Weights of all pixels, from 0 to 64, for each plane.
///
/// The first pixel of each subset has a bit less: end points are in an order that makes its highest one zero.
fn weights(bits: &mut Bits, mode: &Mode, partition: &Partition) -> [[u32; 2]; 16] {
    std::array::from_fn(|i| {
        let stored = mode.weight_bits - u32::from(partition.is_anchor(i));
        let mut weights = [0; 2];
        for weight in weights.iter_mut().take(mode.planes) {
            *weight = unquantized_weight(bits.take(stored), mode.weight_bits);
        }
        weights
    })
}

/// A weight from 0 to 64, from one of `bits` bits (1 to 5): they are repeated to fill six bits, and the upper half gains one.
fn unquantized_weight(weight: u32, bits: u32) -> u32 {
    let repeated = match bits {
        1 => weight * 0b11_1111,
        2 => weight * 0b01_0101,
        3 => weight * 0b00_1001,
        4 => weight << 2 | weight >> 2,
        _ => weight << 1 | weight >> 4,
    };
    repeated + u32::from(repeated > 32)
}

/// A colour between two, in 16 bits, of which the upper eight remain.
fn interpolate(low: u8, high: u8, weight: u32) -> u8 {
    let [low, high] = [low, high].map(|end| u32::from(end) * 257);
    ((low * (64 - weight) + high * weight + 32) >> 14) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_specification() {
        let all = |bits: u32| (0..1 << bits).map(|w| unquantized_weight(w, bits)).collect::<Vec<_>>();
        assert_eq!(all(1), [0, 64]);
        assert_eq!(all(2), [0, 21, 43, 64]);
        assert_eq!(all(3), [0, 9, 18, 27, 37, 46, 55, 64]);
        assert_eq!(all(4), [0, 4, 8, 12, 17, 21, 25, 29, 35, 39, 43, 47, 52, 56, 60, 64]);
        assert_eq!(all(5)[14..18], [28, 30, 34, 36]);
    }

    #[test]
    fn a_block_of_one_colour_is_that_colour() {
        // Mode 8 has the code 10111 and then 32 bits.
        let bits = 0b10111 | u128::from(u32::from_le_bytes([10, 200, 30, 128])) << 5;
        assert_eq!(block(&bits.to_le_bytes()), Some([[10, 200, 30, 128]; 16]));
        // A reserved code.
        assert_eq!(block(&[0x45; 16]), None);
    }
}
