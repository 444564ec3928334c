//! End points: the two colours of a subset that its pixels lie between.

use super::Bits;
use super::modes::{Mode, Range};

/// Most values that a mode has: three subsets with two colours of three channels.
const MAX_VALUES: usize = 18;

/// Both end points, red to alpha, of up to three subsets. `None` if a value is out of its range.
pub(super) fn read(bits: &mut Bits, mode: &Mode) -> Option<[[[u8; 4]; 2]; 3]> {
    let count = mode.channels * 2 * mode.subsets;
    let values = values(bits, mode.range, count)?;
    let mut ends = [[[0, 0, 0, 255]; 2]; 3];
    for (subset, values) in values[..count].chunks_exact(mode.channels * 2).enumerate() {
        for (c, pair) in values.as_chunks::<2>().0.iter().enumerate() {
            for (end, value) in ends[subset].iter_mut().zip(pair) {
                match (mode.channels, c) {
                    (2, 0) => end[..3].fill(*value),
                    (2, _) => end[3] = *value,
                    _ => end[c] = *value,
                }
            }
        }
    }
    Some(ends)
}

/// `count` values from 0 to 255. Digits to the base of three or five come first, several in one number, then the bits of
/// each value.
fn values(bits: &mut Bits, range: Range, count: usize) -> Option<[u8; MAX_VALUES]> {
    let digits = match range {
        Range::Bits(_) => [0; MAX_VALUES],
        // Five digits fit in 8 bits, three in 7; what is left over at the end takes the fewest bits.
        Range::Trit(_) => digits(bits, 3, &[2, 4, 5, 7, 8], count)?,
        Range::Quint(_) => digits(bits, 5, &[3, 5, 7], count)?,
    };
    let mut values = [0; MAX_VALUES];
    for (value, digit) in values[..count].iter_mut().zip(digits) {
        *value = match range {
            Range::Bits(width) => repeated(bits.take(width), width),
            Range::Trit(width) | Range::Quint(width) => unquantized(bits.take(width), width, digit, range),
        };
    }
    Some(values)
}

/// `count` digits to a base. Groups of as many as `widths` has are one number each; `widths[n - 1]` are the bits of one that
/// has `n` digits.
fn digits(bits: &mut Bits, base: u32, widths: &[u32], count: usize) -> Option<[u32; MAX_VALUES]> {
    let mut digits = [0; MAX_VALUES];
    for group in digits[..count].chunks_mut(widths.len()) {
        let mut number = bits.take(widths[group.len() - 1]);
        for digit in group.iter_mut() {
            *digit = number % base;
            number /= base;
        }
        if number != 0 {
            return None;
        }
    }
    Some(digits)
}

/// Bits, at least four, repeated to fill eight.
fn repeated(value: u32, width: u32) -> u8 {
    (value << (8 - width) | value >> (2 * width - 8)) as u8
}

/// A value with a digit above its bits, as ASTC spreads it over 0 to 255: section "Endpoint unquantization" of the Khronos
/// Data Format Specification. The lowest bit says from which end the others count.
fn unquantized(value: u32, width: u32, digit: u32, range: Range) -> u8 {
    let mirrored = if value & 1 == 1 { 0x1ff } else { 0 };
    let rest = value >> 1;
    let (spread, step) = match (range, width) {
        (Range::Trit(_), 2) => (rest * 0b1_0001_0110, 93),
        (Range::Trit(_), 4) => (rest << 6 | rest, 22),
        (Range::Trit(_), _) => (rest << 4 | rest >> 4, 5),
        (_, 3) => (rest << 7 | rest << 1 | rest >> 1, 26),
        _ => (rest << 5 | rest >> 3, 6),
    };
    let value = (digit * step + spread) ^ mirrored;
    (mirrored & 0x80 | value >> 2) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_range_is_spread_evenly_over_all_values() {
        for (range, base, width) in [
            (Range::Trit(2), 3, 2),
            (Range::Trit(4), 3, 4),
            (Range::Trit(6), 3, 6),
            (Range::Quint(3), 5, 3),
            (Range::Quint(5), 5, 5),
        ] {
            let digits = (0..base).flat_map(|digit| (0..1 << width).map(move |value| (digit, value)));
            let mut all: Vec<u8> =
                digits.map(|(digit, value)| unquantized(value, width, digit, range)).collect();
            all.sort_unstable();
            let steps = (all.len() - 1) as f32;
            for (i, value) in all.iter().enumerate() {
                let even = i as f32 * 255.0 / steps;
                assert!((f32::from(*value) - even).abs() <= 1.5, "{range:?}: {i} of {steps} is {value}");
            }
        }
        assert_eq!([repeated(5, 4), repeated(0b10110, 5), repeated(201, 8)], [0x55, 0b1011_0101, 201]);
    }

    #[test]
    fn digits_are_taken_from_the_lowest() {
        let number = |digits: [u32; 5]| digits.iter().rev().fold(0, |n, d| n * 3 + d);
        let mut bits = Bits(u128::from(number([2, 0, 1, 1, 2]) | number([1, 2, 0, 0, 0]) << 8));
        assert_eq!(
            digits(&mut bits, 3, &[2, 4, 5, 7, 8], 7).map(|d| d[..7].to_vec()),
            Some(vec![2, 0, 1, 1, 2, 1, 2])
        );
        // 3⁵ = 243 and more are no five digits.
        assert_eq!(digits(&mut Bits(243), 3, &[2, 4, 5, 7, 8], 5), None);
        assert_eq!(digits(&mut Bits(125), 5, &[3, 5, 7], 3), None);
    }
}
