//! Partitions: which of a block's pixels share end points.
//!
//! ASTC computes them from a number; UASTC lists the numbers whose partitions BC7 knows, too.

use std::sync::LazyLock;

/// Which subset each of a block's 4×4 pixels belongs to, row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Partition {
    pub subset: [u8; 16],
    /// The first pixel of each subset, as bits.
    anchors: u16,
}

/// Two subsets, as BC7 has them.
const TWO: [u32; 30] = [
    28, 20, 16, 29, 91, 9, 107, 72, 149, 204, 50, 114, 496, 17, 78, 39, 252, 828, 43, 156, 116, 210, 476,
    273, 684, 359, 246, 195, 694, 524,
];
/// Three subsets, as BC7 has them.
const THREE: [u32; 11] = [260, 74, 32, 156, 183, 15, 745, 0, 335, 902, 254];
/// Two subsets that become BC7's three if one is divided.
const TWO_OF_THREE: [u32; 19] =
    [36, 48, 61, 137, 161, 183, 226, 281, 302, 307, 479, 495, 593, 594, 605, 799, 812, 988, 993];

impl Partition {
    /// All pixels share their end points.
    pub fn whole() -> &'static Self {
        static WHOLE: Partition = Partition { subset: [0; 16], anchors: 1 };
        &WHOLE
    }

    /// The partition of most modes with two subsets.
    pub fn two(index: u32) -> Option<&'static Self> {
        static ALL: LazyLock<Vec<Partition>> = LazyLock::new(|| all(&TWO, 2));
        ALL.get(index as usize)
    }

    /// The partition of mode 7.
    pub fn two_of_three(index: u32) -> Option<&'static Self> {
        static ALL: LazyLock<Vec<Partition>> = LazyLock::new(|| all(&TWO_OF_THREE, 2));
        ALL.get(index as usize)
    }

    /// The partition of the mode with three subsets.
    pub fn three(index: u32) -> Option<&'static Self> {
        static ALL: LazyLock<Vec<Partition>> = LazyLock::new(|| all(&THREE, 3));
        ALL.get(index as usize)
    }

    /// Whether pixel `i` is the first of its subset.
    pub fn is_anchor(&self, i: usize) -> bool {
        self.anchors >> i & 1 == 1
    }
}

fn all(seeds: &[u32], subsets: u32) -> Vec<Partition> {
    seeds.iter().map(|seed| generated(*seed, subsets)).collect()
}

/// ASTC's partition of blocks of fewer than 31 pixels: section "Partition pattern generation" of the Khronos Data Format
/// Specification.
///
/// Each subset has a plane over the block, whose slopes and height are parts of a hash of the seed; a pixel belongs to the
/// subset whose plane is highest there.
fn generated(seed: u32, subsets: u32) -> Partition {
    let hash = hashed(seed + (subsets - 1) * 1024);
    let (parity, coarse) = (if seed & 2 != 0 { 4 } else { 5 }, if subsets == 3 { 6 } else { 5 });
    let [shift_x, shift_y] = if seed & 1 != 0 { [parity, coarse] } else { [coarse, parity] };
    let slope = |nibble: u32, shift: u32| {
        let value = hash >> (4 * nibble) & 0xf;
        (value * value) >> shift
    };
    let height = |subset: u32, x: u32, y: u32| {
        let [along_x, along_y] = [slope(2 * subset, shift_x), slope(2 * subset + 1, shift_y)];
        // Pixels of small blocks are two apart.
        (along_x * 2 * x + along_y * 2 * y + (hash >> (14 - 4 * subset))) & 0x3f
    };
    let highest = |i: u32| {
        let heights = (0..subsets).map(|subset| height(subset, i % 4, i / 4));
        // The first of those that are equal.
        heights.enumerate().fold((0, 0), |best, (s, h)| if s == 0 || h > best.1 { (s, h) } else { best }).0
            as u8
    };
    let subset: [u8; 16] = std::array::from_fn(|i| highest(i as u32));
    let first = |s: u32| subset.iter().position(|x| u32::from(*x) == s);
    let anchors = (0..subsets).filter_map(first).fold(0, |bits, i| bits | 1 << i);
    Partition { subset, anchors }
}

/// The hash of ASTC's partitions.
fn hashed(seed: u32) -> u32 {
    let mut p = seed;
    p ^= p >> 15;
    p = p.wrapping_mul(0xeede_0891);
    p ^= p >> 5;
    p = p.wrapping_add(p << 16);
    p ^= p >> 7;
    p ^= p >> 3;
    p ^= p << 6;
    p ^ p >> 17
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first partitions of BC7 are halves, then a corner; of these one is counted the other way round.
    #[test]
    fn partitions_are_those_that_bc7_has() {
        let two = |i| Partition::two(i).expect("a partition");
        assert_eq!(two(0).subset, [0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1]);
        assert_eq!(two(1).subset, [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
        assert_eq!(two(2).subset, [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
        assert!(two(2).is_anchor(0) && two(2).is_anchor(1) && !two(2).is_anchor(2));
        assert_eq!(Partition::two(30), None);
    }

    #[test]
    fn each_partition_has_all_its_subsets_and_no_two_are_equal() {
        for (seeds, subsets) in [(&TWO[..], 2), (&THREE, 3), (&TWO_OF_THREE, 2)] {
            let all = all(seeds, subsets);
            for (i, partition) in all.iter().enumerate() {
                assert_eq!(partition.anchors.count_ones(), subsets, "{i} of {subsets}");
                assert!(!all[..i].contains(partition), "{i} of {subsets} is twice there");
            }
        }
    }
}
