//! Mode `ATTRIBUTES`: elements as differences from the element before, byte by byte.
//!
//! Blocks of up to 256 elements; in a block, one byte of the element after the other; of each, groups of 16 differences of few
//! bits. Where the bits do not suffice, their largest value says that a whole byte follows.
//!
//! Version 1 (`KHR_meshopt_compression`) chooses for each byte how its groups are stored, and for each four bytes what the
//! differences are between: bytes, numbers of 16 bits, or the bits of numbers of 32.

use super::{Bytes, MeshoptError, version};

const GROUP: usize = 16;
/// Bytes of a block, and elements, that are not exceeded.
const BLOCK_BYTES: usize = 8192;
const BLOCK_ELEMENTS: usize = 256;
/// What stands at the end, by version: padded to this.
const MIN_TAIL: [usize; 2] = [32, 24];
/// Bits of a difference by the mode of a group.
const BITS: [usize; 4] = [0, 2, 4, 8];
/// The same in version 1, by how the byte is stored.
const BITS_1: [[usize; 4]; 2] = [[0, 1, 2, 4], [1, 2, 4, 8]];

/// Decodes `count` elements of `size` bytes.
///
/// # Errors
/// See [`MeshoptError`]; a `size` that is not a multiple of 4 in 4..=256 is one.
pub fn decode_vertices(data: &[u8], count: usize, size: usize) -> Result<Vec<u8>, MeshoptError> {
    if size == 0 || !size.is_multiple_of(4) || size > 256 {
        return Err(MeshoptError::ElementSize(size));
    }
    let mut data = Bytes(data);
    let version = version(&mut data, 0xa0, 1)?;
    // The element before the first, and in version 1 a byte for each channel.
    let tail = size + if version == 1 { size / 4 } else { 0 };
    let end = data.0.len().checked_sub(tail.max(MIN_TAIL[usize::from(version)]));
    let end = end.ok_or(MeshoptError::Truncated)?;
    let (baseline, modes) = data.0[data.0.len() - tail..].split_at(size);
    let mut last = baseline.to_vec();
    let channels = (0..size / 4).map(|k| Channel::from_mode(modes.get(k).copied().unwrap_or(0)));
    let channels: Vec<Channel> = channels.collect::<Result<_, _>>()?;
    let mut data = Bytes(&data.0[..end]);
    let block = ((BLOCK_BYTES / size) & !(GROUP - 1)).min(BLOCK_ELEMENTS);
    let mut out = vec![0; count * size];
    for elements in out.chunks_mut(block * size) {
        let control = if version == 1 { Some(data.take(size / 4)?) } else { None };
        decode_block(&mut data, control, &channels, elements, &mut last)?;
    }
    if data.0.is_empty() { Ok(out) } else { Err(MeshoptError::TooLong) }
}

/// What the differences of four bytes of an element are between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Channel {
    /// Bytes, each by itself; the sign is in the lowest bit.
    Bytes,
    /// Numbers of 16 bits, the sign in the lowest bit.
    Shorts,
    /// The bits that differ of a number of 32, turned left by so many places.
    Bits(u32),
}

impl Channel {
    fn from_mode(mode: u8) -> Result<Self, MeshoptError> {
        match (mode & 15, mode >> 4) {
            (0, 0) => Ok(Self::Bytes),
            (1, 0) => Ok(Self::Shorts),
            (2, turn) => Ok(Self::Bits(turn.into())),
            _ => Err(MeshoptError::Channel(mode)),
        }
    }

    /// The four bytes that follow `last`.
    fn next(self, last: [u8; 4], difference: [u8; 4]) -> [u8; 4] {
        match self {
            Self::Bytes => std::array::from_fn(|i| {
                let d = difference[i];
                last[i].wrapping_add((d >> 1) ^ (d & 1).wrapping_neg())
            }),
            Self::Shorts => {
                let next = |i: usize| {
                    let d = u16::from_le_bytes([difference[i], difference[i + 1]]);
                    let last = u16::from_le_bytes([last[i], last[i + 1]]);
                    last.wrapping_add((d >> 1) ^ (d & 1).wrapping_neg()).to_le_bytes()
                };
                let ([a, b], [c, d]) = (next(0), next(2));
                [a, b, c, d]
            }
            Self::Bits(turn) => {
                let bits = u32::from_le_bytes(difference).rotate_right(turn);
                (bits ^ u32::from_le_bytes(last)).to_le_bytes()
            }
        }
    }
}

/// Decodes a block into `out`; `last` is the element before it, and then its last element. `control`: for each channel, how
/// its four bytes are stored; none in version 0.
fn decode_block(
    data: &mut Bytes<'_>,
    control: Option<&[u8]>,
    channels: &[Channel],
    out: &mut [u8],
    last: &mut [u8],
) -> Result<(), MeshoptError> {
    let size = last.len();
    let count = out.len() / size;
    for (k, channel) in channels.iter().enumerate() {
        let mut planes = [[0; BLOCK_ELEMENTS]; 4];
        for (j, plane) in planes.iter_mut().enumerate() {
            match control.map(|control| control[k] >> (2 * j) & 3) {
                None => decode_groups(data, &BITS, count, plane)?,
                Some(3) => plane[..count].copy_from_slice(data.take(count)?),
                Some(2) => {}
                Some(mode) => decode_groups(data, &BITS_1[usize::from(mode)], count, plane)?,
            }
        }
        let mut before: [u8; 4] = std::array::from_fn(|j| last[4 * k + j]);
        for (i, element) in out.chunks_exact_mut(size).enumerate() {
            before = channel.next(before, planes.map(|plane| plane[i]));
            element[4 * k..4 * k + 4].copy_from_slice(&before);
        }
        last[4 * k..4 * k + 4].copy_from_slice(&before);
    }
    Ok(())
}

/// The differences of one byte of `count` elements. `bits`: of a difference, by the mode of its group.
fn decode_groups(
    data: &mut Bytes<'_>,
    bits: &[usize; 4],
    count: usize,
    out: &mut [u8; BLOCK_ELEMENTS],
) -> Result<(), MeshoptError> {
    let groups = count.div_ceil(GROUP);
    let header = data.take(groups.div_ceil(4))?;
    for (group, out) in out.as_chunks_mut::<GROUP>().0.iter_mut().enumerate().take(groups) {
        let mode = header[group / 4] >> (group % 4 * 2) & 3;
        *out = decode_group(data, bits[usize::from(mode)])?;
    }
    Ok(())
}

/// Sixteen differences of 0, 1, 2, 4 or 8 bits.
fn decode_group(data: &mut Bytes<'_>, bits: usize) -> Result<[u8; GROUP], MeshoptError> {
    let mut out = [0; GROUP];
    match bits {
        0 => return Ok(out),
        8 => {
            out.copy_from_slice(data.take(GROUP)?);
            return Ok(out);
        }
        _ => {}
    }
    let packed = data.take(GROUP * bits / 8)?;
    let per_byte = 8 / bits;
    let sentinel = (1u8 << bits) - 1;
    for (i, out) in out.iter_mut().enumerate() {
        // The first is in the highest bits, but of single bits in the lowest.
        let place = i % per_byte * bits;
        let shift = if bits == 1 { place } else { 8 - bits - place };
        let value = packed[i / per_byte] >> shift & sentinel;
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
        out.extend(std::iter::repeat_n(0, MIN_TAIL[0].saturating_sub(size)));
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

    /// An encoder of version 1 that stores each byte as `controls` says, and each channel in its mode.
    fn encode_1(elements: &[u8], size: usize, controls: &[u8], modes: &[u8]) -> Vec<u8> {
        let mut out = vec![0xa1];
        let mut last = elements[..size].to_vec();
        let block = ((BLOCK_BYTES / size) & !(GROUP - 1)).min(BLOCK_ELEMENTS);
        for elements in elements.chunks(block * size) {
            let pack = |four: &[u8]| four.iter().rev().fold(0, |byte, control| byte << 2 | control);
            out.extend(controls.chunks(4).map(pack));
            for (k, mode) in modes.iter().enumerate() {
                let mut planes = [const { Vec::new() }; 4];
                for element in elements.chunks(size) {
                    let now: [u8; 4] = element[4 * k..4 * k + 4].try_into().expect("four");
                    let before: [u8; 4] = last[4 * k..4 * k + 4].try_into().expect("four");
                    let zigzag = |d: i16, bits: u32| ((d << 1) ^ (d >> (bits - 1))) as u16;
                    let difference: [u8; 4] = match mode & 15 {
                        0 => std::array::from_fn(|i| {
                            zigzag(i16::from(now[i].wrapping_sub(before[i]) as i8), 16) as u8
                        }),
                        1 => {
                            let of = |b: [u8; 4], i: usize| i16::from_le_bytes([b[i], b[i + 1]]);
                            let d = |i| zigzag(of(now, i).wrapping_sub(of(before, i)), 16).to_le_bytes();
                            let ([a, b], [c, d]) = (d(0), d(2));
                            [a, b, c, d]
                        }
                        _ => (u32::from_le_bytes(now) ^ u32::from_le_bytes(before))
                            .rotate_left(u32::from(mode >> 4))
                            .to_le_bytes(),
                    };
                    (0..4).for_each(|j| planes[j].push(difference[j]));
                    last[4 * k..4 * k + 4].copy_from_slice(&now);
                }
                for (j, plane) in planes.iter().enumerate() {
                    store(&mut out, plane, controls[4 * k + j]);
                }
            }
        }
        out.extend(std::iter::repeat_n(0, MIN_TAIL[1].saturating_sub(size + size / 4)));
        out.extend(&elements[..size]);
        out.extend(modes);
        out
    }

    /// The differences of one byte, in groups of their highest mode but one, and every fifth group of the highest.
    fn store(out: &mut Vec<u8>, plane: &[u8], control: u8) {
        match control {
            2 => return assert!(plane.iter().all(|d| *d == 0), "the test's own mistake"),
            3 => return out.extend(plane),
            _ => {}
        }
        let groups: Vec<&[u8]> = plane.chunks(GROUP).collect();
        let mode = |group: usize| if group % 5 == 4 { 3 } else { 1 + group % 2 };
        let header = |four: usize| (0..4).map(|i| (mode(four * 4 + i) as u8) << (2 * i)).sum::<u8>();
        out.extend((0..groups.len().div_ceil(4)).map(header));
        for (group, differences) in groups.iter().enumerate() {
            let mut differences = differences.to_vec();
            differences.resize(GROUP, 0);
            let bits = BITS_1[usize::from(control)][mode(group)];
            if bits == 8 {
                out.extend(&differences);
                continue;
            }
            let sentinel = (1u8 << bits) - 1;
            for pack in differences.chunks(8 / bits) {
                let small = |d: &u8| (*d).min(sentinel);
                out.push(match bits {
                    1 => pack.iter().rev().fold(0, |byte, d| byte << 1 | small(d)),
                    _ => pack.iter().fold(0, |byte, d| byte << bits | small(d)),
                });
            }
            out.extend(differences.iter().filter(|d| **d >= sentinel));
        }
    }

    #[test]
    fn version_1_is_decoded_in_all_its_modes() {
        // The last channel does not change, so that nothing need be stored of it.
        let size = 16;
        let of = |i: usize, k: usize| if k < 12 { ((i * (k + 3)) as u32 / 5 % 253) as u8 } else { k as u8 };
        let elements: Vec<u8> = (0..700).flat_map(|i| (0..size).map(move |k| of(i, k))).collect();
        for controls in [[0, 1, 3, 0], [1, 1, 1, 1], [3, 0, 0, 1]] {
            let controls = [&controls[..], &controls, &controls, &[2, 2, 2, 2]].concat();
            for modes in [[0, 0, 0, 0], [0, 1, 2, 2], [1, 2 | 3 << 4, 2 | 15 << 4, 0]] {
                let data = encode_1(&elements, size, &controls, &modes);
                let decoded = decode_vertices(&data, 700, size);
                assert!(decoded == Ok(elements.clone()), "{controls:?} {modes:?}: {:?}", decoded.err());
                for cut in [1, 20, data.len() / 2] {
                    assert!(decode_vertices(&data[..data.len() - cut], 700, size).is_err(), "cut by {cut}");
                }
            }
        }
        for wrong in [3, 0x10, 0x21] {
            let data = encode_1(&elements, size, &[1; 16], &[0; 4]);
            let mut wrong_mode = data.clone();
            *wrong_mode.last_mut().expect("the last channel") = wrong;
            assert_eq!(decode_vertices(&wrong_mode, 700, size), Err(MeshoptError::Channel(wrong)));
        }
    }

    /// The example of the specification.
    #[test]
    fn deltas_are_those_of_the_specification() {
        let mut data = Bytes(&[0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5]);
        let decoded = decode_group(&mut data, 4).expect("complete");
        let signed = decoded.map(|d| ((d >> 1) ^ (d & 1).wrapping_neg()) as i8);
        assert_eq!(signed, [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]);
    }

    #[test]
    fn cut_or_foreign_data_is_refused() {
        let data = encode(&[7; 64], 4, 2);
        for length in 0..data.len() {
            assert!(decode_vertices(&data[..length], 16, 4).is_err(), "{length} of {} bytes", data.len());
        }
        let mut newer = data.clone();
        newer[0] = 0xa2;
        assert_eq!(decode_vertices(&newer, 16, 4), Err(MeshoptError::Header { found: 0xa2 }));
        assert_eq!(decode_vertices(&data, 16, 6), Err(MeshoptError::ElementSize(6)));
    }
}
