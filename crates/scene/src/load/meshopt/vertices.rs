//! Mode `ATTRIBUTES`: bytes of elements, each as the difference from the same byte of the element before.
//!
//! Blocks of up to 256 elements; in a block, one byte of the element after the other; of each, groups of 16 differences
//! with 0, 2, 4 or 8 bits each. Where 2 or 4 bits do not suffice, their largest value says that a whole byte follows.

use super::{Bytes, MeshoptError, version};

const GROUP: usize = 16;
/// Bytes of a block, and elements, that are not exceeded.
const BLOCK_BYTES: usize = 8192;
const BLOCK_ELEMENTS: usize = 256;
/// The first element stands at the end, padded to this.
const MIN_TAIL: usize = 32;

/// Decodes `count` elements of `size` bytes.
///
/// # Errors
/// See [`MeshoptError`]; a `size` that is not a multiple of 4 in 4..=256 is one.
pub fn decode_vertices(data: &[u8], count: usize, size: usize) -> Result<Vec<u8>, MeshoptError> {
    if size == 0 || !size.is_multiple_of(4) || size > 256 {
        return Err(MeshoptError::ElementSize(size));
    }
    let mut data = Bytes(data);
    version(&mut data, 0xa0, 0)?;
    let tail = size.max(MIN_TAIL);
    let end = data.0.len().checked_sub(tail).ok_or(MeshoptError::Truncated)?;
    let mut last = data.0[data.0.len() - size..].to_vec();
    let mut data = Bytes(&data.0[..end]);
    let block = ((BLOCK_BYTES / size) & !(GROUP - 1)).min(BLOCK_ELEMENTS);
    let mut out = vec![0; count * size];
    for elements in out.chunks_mut(block * size) {
        decode_block(&mut data, elements, size, &mut last)?;
    }
    if data.0.is_empty() { Ok(out) } else { Err(MeshoptError::TooLong) }
}

/// Decodes a block into `out`; `last` is the element before it, and then its last element.
fn decode_block(
    data: &mut Bytes<'_>,
    out: &mut [u8],
    size: usize,
    last: &mut [u8],
) -> Result<(), MeshoptError> {
    let count = out.len() / size;
    let groups = count.div_ceil(GROUP);
    for (k, last) in last.iter_mut().enumerate() {
        let header = data.take(groups.div_ceil(4))?;
        for group in 0..groups {
            let mode = header[group / 4] >> (group % 4 * 2) & 3;
            let differences = decode_group(data, mode)?;
            let elements = out[group * GROUP * size..].chunks_mut(size).take(GROUP);
            for (element, difference) in elements.zip(differences) {
                *last = last.wrapping_add((difference >> 1) ^ (difference & 1).wrapping_neg());
                element[k] = *last;
            }
        }
    }
    Ok(())
}

/// Sixteen differences, the sign in the lowest bit. `mode` says how many bits they have: 0, 2, 4 or 8.
fn decode_group(data: &mut Bytes<'_>, mode: u8) -> Result<[u8; GROUP], MeshoptError> {
    let mut out = [0; GROUP];
    let bits = match mode {
        0 => return Ok(out),
        1 => 2,
        2 => 4,
        _ => {
            out.copy_from_slice(data.take(GROUP)?);
            return Ok(out);
        }
    };
    let packed = data.take(GROUP * bits / 8)?;
    let per_byte = 8 / bits;
    let sentinel = (1u8 << bits) - 1;
    for (i, out) in out.iter_mut().enumerate() {
        // The first is in the highest bits.
        let value = packed[i / per_byte] >> (8 - bits - i % per_byte * bits) & sentinel;
        *out = if value == sentinel { data.byte()? } else { value };
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An encoder that always uses the same number of bits.
    fn encode(elements: &[u8], size: usize, mode: u8) -> Vec<u8> {
        let mut out = vec![0xa0];
        let mut last = elements[..size].to_vec();
        let block = ((BLOCK_BYTES / size) & !(GROUP - 1)).min(BLOCK_ELEMENTS);
        for elements in elements.chunks(block * size) {
            let count = elements.len() / size;
            let groups = count.div_ceil(GROUP);
            for k in 0..size {
                let header: u8 = (0..4).map(|i| mode << (2 * i)).sum();
                out.extend(std::iter::repeat_n(header, groups.div_ceil(4)));
                for group in 0..groups {
                    let differences: Vec<u8> = (0..GROUP)
                        .map(|i| {
                            let at = (group * GROUP + i).min(count - 1);
                            let difference = elements[at * size + k].wrapping_sub(last[k]) as i8;
                            last[k] = elements[at * size + k];
                            ((difference << 1) ^ (difference >> 7)) as u8
                        })
                        .collect();
                    let bits = [0, 2, 4, 8][mode as usize];
                    if mode == 3 {
                        out.extend(&differences);
                        continue;
                    }
                    let sentinel = (1u8 << bits) - 1;
                    for pack in differences.chunks(8 / bits) {
                        out.push(pack.iter().fold(0, |byte, d| byte << bits | (*d).min(sentinel)));
                    }
                    out.extend(differences.iter().filter(|d| **d >= sentinel));
                }
            }
        }
        out.extend(std::iter::repeat_n(0, MIN_TAIL.saturating_sub(size)));
        out.extend(&elements[..size]);
        out
    }

    #[test]
    fn all_widths_of_differences_are_decoded() {
        for size in [4, 12, 64] {
            let elements: Vec<u8> = (0..size * 700).map(|i| ((i * i / 7) % 251) as u8).collect();
            for mode in 1..=3 {
                let data = encode(&elements, size, mode);
                assert!(
                    decode_vertices(&data, 700, size) == Ok(elements.clone()),
                    "{size} bytes, mode {mode}"
                );
            }
        }
    }

    #[test]
    fn cut_or_foreign_data_is_refused() {
        let data = encode(&[7; 64], 4, 2);
        for length in 0..data.len() {
            assert!(decode_vertices(&data[..length], 16, 4).is_err(), "{length} of {} bytes", data.len());
        }
        let mut newer = data.clone();
        newer[0] = 0xa1;
        assert_eq!(decode_vertices(&newer, 16, 4), Err(MeshoptError::Header { found: 0xa1 }));
        assert_eq!(decode_vertices(&data, 16, 6), Err(MeshoptError::ElementSize(6)));
    }
}
