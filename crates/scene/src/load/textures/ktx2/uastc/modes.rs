//! The 19 modes of blocks.

/// What a mode's blocks hold.
#[derive(Debug)]
pub(super) struct Mode {
    /// The prefix code at the start of the block, its first bit lowest.
    code: u8,
    /// Bits of the code.
    pub code_bits: u32,
    /// Bits of hints for encoders of other formats.
    pub hint_bits: u32,
    /// Bits of a weight.
    pub weight_bits: u32,
    /// Values that an end point's channel may have.
    pub range: Range,
    /// Channels that have end points: grey and alpha, red to blue, or red to alpha.
    pub channels: usize,
    /// Sets of pixels with end points of their own.
    pub subsets: usize,
    /// Weights of a pixel.
    pub planes: usize,
}

/// Values of so many bits, or a digit to the base of three or five above so many bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Range {
    Bits(u32),
    Trit(u32),
    Quint(u32),
}

/// The mode whose blocks have one colour.
pub(super) const SOLID: usize = 8;

impl Mode {
    /// The mode of a block and its number, from the block's first byte. `None` for the code that is reserved.
    pub fn of(first_byte: u8) -> Option<(usize, &'static Self)> {
        let has = |mode: &Mode| first_byte & ((1 << mode.code_bits) - 1) as u8 == mode.code;
        MODES.iter().enumerate().find(|(_, mode)| has(mode))
    }
}

const fn mode(
    (code, code_bits): (u8, u32),
    hint_bits: u32,
    weight_bits: u32,
    range: Range,
    [channels, subsets, planes]: [usize; 3],
) -> Mode {
    Mode { code, code_bits, hint_bits, weight_bits, range, channels, subsets, planes }
}

const MODES: [Mode; 19] = {
    use Range::{Bits, Quint, Trit};
    [
        mode((0x01, 4), 15, 4, Trit(6), [3, 1, 1]),
        mode((0x35, 6), 15, 2, Bits(8), [3, 1, 1]),
        mode((0x1d, 5), 15, 3, Bits(4), [3, 2, 1]),
        mode((0x03, 5), 15, 2, Trit(2), [3, 3, 1]),
        mode((0x13, 5), 15, 2, Quint(3), [3, 2, 1]),
        mode((0x0b, 5), 15, 3, Bits(8), [3, 1, 1]),
        mode((0x1b, 5), 15, 2, Quint(5), [3, 1, 2]),
        mode((0x07, 5), 15, 2, Quint(3), [3, 2, 1]),
        mode((0x17, 5), 0, 0, Bits(8), [4, 1, 1]),
        mode((0x0f, 5), 23, 2, Bits(4), [4, 2, 1]),
        mode((0x02, 3), 17, 4, Trit(4), [4, 1, 1]),
        mode((0x00, 2), 17, 2, Trit(4), [4, 1, 2]),
        mode((0x06, 3), 17, 3, Trit(6), [4, 1, 1]),
        mode((0x1f, 5), 23, 1, Bits(8), [4, 1, 2]),
        mode((0x0d, 5), 23, 2, Bits(8), [4, 1, 1]),
        mode((0x05, 7), 23, 4, Bits(8), [2, 1, 1]),
        mode((0x15, 6), 23, 2, Bits(8), [2, 2, 1]),
        mode((0x25, 6), 23, 2, Bits(8), [2, 1, 2]),
        mode((0x09, 4), 15, 5, Bits(5), [3, 1, 1]),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_a_complete_prefix_code_but_for_the_reserved_one() {
        let found = (0..=255).filter(|byte| Mode::of(*byte).is_some()).count();
        assert_eq!(found, 254, "seven bits, 1000101, are reserved");
        assert!(Mode::of(0x45).is_none() && Mode::of(0xc5).is_none());
        let share: u32 = MODES.iter().map(|m| 128 >> m.code_bits).sum();
        assert_eq!(share, 127);
    }

    #[test]
    fn blocks_have_room_for_what_their_mode_needs() {
        for (i, m) in MODES.iter().enumerate().filter(|(i, _)| *i != SOLID) {
            let values = m.channels * 2 * m.subsets;
            let ends = match m.range {
                Range::Bits(bits) => values as u32 * bits,
                Range::Trit(bits) => values as u32 * bits + (8 * values).div_ceil(5) as u32,
                Range::Quint(bits) => values as u32 * bits + (7 * values).div_ceil(3) as u32,
            };
            let pattern = [0, 0, 5, 4][m.subsets];
            let selector = if m.planes == 2 && m.channels > 2 { 2 } else { 0 };
            let weights = (16 * m.planes) as u32 * m.weight_bits - (m.subsets * m.planes) as u32;
            let total = m.code_bits + m.hint_bits + pattern + selector + ends + weights;
            assert!(total <= 128, "mode {i}: {total} bits");
        }
    }
}
