//! The codebooks of endpoints and selectors.

use super::bits::Bits;
use super::error::Etc1sError;
use super::huffman::Huffman;

/// The four colours that a block's pixels may have, from dark to bright.
pub(super) type Colors = [[u8; 3]; 4];
/// For each row of a block, two bits for each pixel, from the left: the number of its colour.
pub(super) type Selectors = [u8; 4];

/// What blocks refer to.
pub(super) struct Codebooks {
    pub endpoints: Vec<Colors>,
    pub selectors: Vec<Selectors>,
}

/// How far the four colours of a block are from its middle, by the endpoint's intensity: the table of ETC1.
const STEPS: [[i32; 4]; 8] = [
    [-8, -2, 2, 8],
    [-17, -5, 5, 17],
    [-29, -9, 9, 29],
    [-42, -13, 13, 42],
    [-60, -18, 18, 60],
    [-80, -24, 24, 80],
    [-106, -33, 33, 106],
    [-183, -47, 47, 183],
];

impl Codebooks {
    /// Reads both codebooks, each from its section and with its number of entries.
    ///
    /// # Errors
    /// See [`Etc1sError`].
    pub fn read(endpoints: (&[u8], usize), selectors: (&[u8], usize)) -> Result<Self, Etc1sError> {
        Ok(Self {
            endpoints: read_endpoints(&mut Bits::new(endpoints.0, "the codebook of endpoints"), endpoints.1)?,
            selectors: read_selectors(&mut Bits::new(selectors.0, "the codebook of selectors"), selectors.1)?,
        })
    }
}

/// Endpoints: each a difference to the one before, in a code that depends on where that one was.
fn read_endpoints(bits: &mut Bits, count: usize) -> Result<Vec<Colors>, Etc1sError> {
    let low = Huffman::read(bits)?;
    let middle = Huffman::read(bits)?;
    let high = Huffman::read(bits)?;
    let intensities = Huffman::read(bits)?;
    let channels = if bits.bit() == 1 { 1 } else { 3 };
    let (mut color, mut intensity) = ([16; 3], 0);
    let mut endpoints = Vec::new();
    for _ in 0..count {
        intensity = (intensity + intensities.symbol(bits)?) % 8;
        for channel in color.iter_mut().take(channels) {
            let code = match *channel {
                0..=9 => &low,
                10..=21 => &middle,
                _ => &high,
            };
            *channel = (*channel + code.symbol(bits)?) % 32;
        }
        bits.check()?;
        let color = if channels == 1 { [color[0]; 3] } else { color };
        endpoints.push(colors(color, intensity as usize));
    }
    Ok(endpoints)
}

/// The colours around one of five bits a channel.
fn colors(color: [u32; 3], intensity: usize) -> Colors {
    let eight_bits = color.map(|c| (c << 3 | c >> 2) as i32);
    STEPS[intensity].map(|step| eight_bits.map(|c| (c + step).clamp(0, 255) as u8))
}

/// Selectors: each as it is, or what differs from the one before.
fn read_selectors(bits: &mut Bits, count: usize) -> Result<Vec<Selectors>, Etc1sError> {
    let (global, hybrid, raw) = (bits.bit(), bits.bit(), bits.bit());
    if global == 1 || hybrid == 1 {
        return Err(Etc1sError::OldCodebook);
    }
    let differences = if raw == 1 { Huffman::default() } else { Huffman::read(bits)? };
    let mut selectors = Vec::new();
    let mut rows = [0; 4];
    for i in 0..count {
        for row in &mut rows {
            if raw == 1 || i == 0 {
                *row = bits.take(8) as u8;
            } else {
                // The code has symbols of a byte, if it is not damaged.
                *row ^= u8::try_from(differences.symbol(bits)?).map_err(|_| Etc1sError::Symbol)?;
            }
        }
        bits.check()?;
        selectors.push(rows);
    }
    Ok(selectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_those_of_etc1() {
        assert_eq!(colors([0, 16, 31], 0), [[0, 124, 247], [0, 130, 253], [2, 134, 255], [8, 140, 255]]);
        assert_eq!(colors([16; 3], 7).map(|c| c[0]), [0, 85, 179, 255]);
    }

    #[test]
    fn raw_selectors_are_read_and_old_kinds_refused() {
        // Not global, not hybrid, raw; then two entries.
        let bits = 0b100_u128 | 0xffee_ddcc_0403_0201 << 3;
        let read =
            |bits: u128, count| read_selectors(&mut Bits::new(&bits.to_le_bytes()[..9], "test"), count);
        assert_eq!(read(bits, 2), Ok(vec![[1, 2, 3, 4], [0xcc, 0xdd, 0xee, 0xff]]));
        assert_eq!(read(bits, 3), Err(Etc1sError::End("test")));
        assert_eq!(read(1, 1), Err(Etc1sError::OldCodebook));
        assert_eq!(read(2, 1), Err(Etc1sError::OldCodebook));
    }
}
