//! Encoded nodes: eight boxes in 128 bytes.
//!
//! Method: Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed
//! Wide BVHs", HPG 2017. Planes have eleven bits instead of eight and are stored as 16-bit floats.
//! The paper's 80 bytes save bandwidth, but traversal on the measured GPUs is bound by arithmetic,
//! half of it for unpacking bytes. A pair of 16-bit floats is converted in one instruction.

use crate::aabb::Aabb;
use crate::layout::{EMPTY, LEAF, Node, WIDTH, leaf_index};
use bytemuck::{Pod, Zeroable};

/// Most primitives of a leaf: the node has three bits to count them.
pub(crate) const MAX_LEAF: usize = 3;

/// A node as shaders read it: up to eight children in numbered slots, with boxes on a grid of 2049³
/// points.
///
/// The slot of a child encodes its position: bit 0 of the slot is set on the side of larger x, bit
/// 1 for y, bit 2 for z, as far as possible. The signs of a ray's direction then give a good visit
/// order.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct EncodedNode {
    /// The grid's lowest corner, in the space of the structure.
    pub origin: [f32; 3],
    /// The grid's spacing along x, y and z, a power of two, as the exponent bits of an `f32`.
    pub exponents: [u8; 3],
    /// Bit `s` is set if slot `s` holds a node.
    pub inner: u8,
    /// Index of the first child that is a node; the others follow in slot order.
    pub first_child: u32,
    /// Index of the first primitive below, or of the first instance in the top level.
    pub first_primitive: u32,
    /// By slot. Zero: empty. A node: `0b001_11000 | slot`. A leaf: in the upper three bits, one set
    /// bit for each primitive; in the lower five, its first primitive relative to
    /// `first_primitive`.
    ///
    /// The upper bits, shifted left by the lower five, are what a ray visits if it hits the box:
    /// bits 0 to 23 for primitives, bits 24 to 31 for nodes.
    pub meta: [u8; WIDTH],
    /// Planes of the boxes by axis, then low and high, then slot, in grid steps from `origin`:
    /// integers from 0 to `STEPS`, which 16-bit floats represent exactly.
    pub planes: [[[u16; WIDTH]; 2]; 3],
}

/// Grid steps along each axis: 16-bit floats represent all integers up to this one.
const STEPS: u16 = 2048;

/// An integer up to [`STEPS`] as the bits of a 16-bit float.
fn half_float(step: u16) -> u16 {
    if step == 0 {
        return 0;
    }
    let exponent = step.ilog2() as u16;
    (exponent + 15) << 10 | (step << (11 - exponent) >> 1 & 0x3FF)
}

/// The integer that the bits of a 16-bit float represent.
pub(super) fn whole_number(half: u16) -> u16 {
    let exponent = (half >> 10).saturating_sub(15);
    let with_leading_bit = u32::from(half & 0x3FF | 0x400);
    if half == 0 { 0 } else { (with_leading_bit << exponent >> 10) as u16 }
}

/// The child in each slot, or [`EMPTY_SLOT`].
pub(super) type Slots = [u8; WIDTH];

/// Marks an empty slot.
pub(super) const EMPTY_SLOT: u8 = WIDTH as u8;

/// Assigns slots by position, greedily: the best pair of child and slot first.
pub(super) fn assign_slots(node: &Node) -> Slots {
    let count = node.children.iter().take_while(|&&c| c != EMPTY).count();
    let mut slots = [EMPTY_SLOT; WIDTH];
    let mut fit = [[0.0f32; WIDTH]; WIDTH];
    for child in 0..count {
        let b = node.bounds(child);
        let center = [0, 1, 2].map(|a: usize| 0.5 * b.min[a] + 0.5 * b.max[a]);
        for (slot, fit) in fit[child].iter_mut().enumerate() {
            let sign = |a: usize| if slot >> a & 1 == 1 { center[a] } else { -center[a] };
            *fit = sign(0) + sign(1) + sign(2);
        }
    }
    let (mut children_left, mut slots_left) = ((1u32 << count) - 1, 0xFFu32);
    while children_left != 0 {
        // Coordinates near the limits of floats may give NaN. Then any free slot is correct.
        let mut best = (f32::NEG_INFINITY, children_left.trailing_zeros(), slots_left.trailing_zeros());
        for child in (0..count as u32).filter(|c| children_left >> c & 1 == 1) {
            for slot in (0..8).filter(|s| slots_left >> s & 1 == 1) {
                let f = fit[child as usize][slot as usize];
                if f > best.0 {
                    best = (f, child, slot);
                }
            }
        }
        slots[best.2 as usize] = best.1 as u8;
        children_left &= !(1 << best.1);
        slots_left &= !(1 << best.2);
    }
    slots
}

/// One axis of a node's grid.
#[derive(Clone, Copy)]
struct Grid {
    origin: f64,
    spacing: f64,
    exponent: u8,
}

impl Grid {
    /// The finest grid from `low` that reaches `high`.
    fn new(low: f32, high: f32) -> Grid {
        let size = f64::from(high) - f64::from(low);
        let mut exponent = 1u8;
        if size > 0.0 {
            // The exponent bits of the spacing that would do, and one more if that was no power of
            // two.
            let steps = f64::from(STEPS);
            let estimate = ((size / steps).to_bits() >> 52) as i64 - 1023 + 127;
            exponent = estimate.clamp(1, 253) as u8;
            if size > steps * spacing(exponent) {
                exponent += 1;
            }
        }
        Grid { origin: f64::from(low), spacing: spacing(exponent), exponent }
    }

    fn at(&self, step: u16) -> f64 {
        self.origin + f64::from(step) * self.spacing
    }

    /// The last step that is not above `x`.
    fn below(&self, x: f32) -> u16 {
        let mut step = ((f64::from(x) - self.origin) / self.spacing) as u16; // casts saturate
        while step > 0 && self.at(step) > f64::from(x) {
            step -= 1;
        }
        step
    }

    /// The first step that is not below `x`.
    fn above(&self, x: f32) -> u16 {
        let mut step = ((f64::from(x) - self.origin) / self.spacing).ceil() as u16;
        while step < STEPS && self.at(step) < f64::from(x) {
            step += 1;
        }
        step
    }
}

/// The power of two with these exponent bits of an `f32`.
fn spacing(exponent: u8) -> f64 {
    f64::from(f32::from_bits(u32::from(exponent) << 23))
}

/// Encodes a node whose children are in `slots`. `leaf_count` returns the number of primitives of a
/// leaf.
pub(super) fn encode(
    node: &Node,
    slots: &Slots,
    first_child: u32,
    first_primitive: u32,
    leaf_count: impl Fn(usize) -> u32,
) -> EncodedNode {
    let bounds = node.union();
    let mut encoded = EncodedNode { first_child, first_primitive, ..EncodedNode::zeroed() };
    let grids = [0, 1, 2].map(|a: usize| Grid::new(bounds.min[a], bounds.max[a]));
    encoded.origin = bounds.min;
    encoded.exponents = grids.map(|g| g.exponent);
    let mut primitives = 0;
    for (slot, &lane) in slots.iter().enumerate().filter(|(_, lane)| **lane != EMPTY_SLOT) {
        let child = node.children[lane as usize];
        let b = node.bounds(lane as usize);
        for a in 0..3 {
            encoded.planes[a][0][slot] = half_float(grids[a].below(b.min[a]).min(STEPS));
            encoded.planes[a][1][slot] = half_float(grids[a].above(b.max[a]).min(STEPS));
        }
        encoded.meta[slot] = if child & LEAF == 0 {
            encoded.inner |= 1 << slot;
            0b001_11000 | slot as u8
        } else {
            let count = leaf_count(leaf_index(child));
            let meta = ((1u8 << count) - 1) << 5 | primitives;
            primitives += count as u8;
            meta
        };
    }
    encoded
}

impl EncodedNode {
    /// The box of a slot on the grid, in double precision: low and high corner.
    pub fn bounds(&self, slot: usize) -> [[f64; 3]; 2] {
        let at = |a: usize, half: u16| {
            f64::from(self.origin[a]) + f64::from(whole_number(half)) * spacing(self.exponents[a])
        };
        [
            [0, 1, 2].map(|a: usize| at(a, self.planes[a][0][slot])),
            [0, 1, 2].map(|a: usize| at(a, self.planes[a][1][slot])),
        ]
    }

    /// Whether the box of a slot contains `b`.
    pub fn contains(&self, slot: usize, b: &Aabb) -> bool {
        let [low, high] = self.bounds(slot);
        (0..3).all(|a| low[a] <= f64::from(b.min[a]) && f64::from(b.max[a]) <= high[a])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn node_of(boxes: &[Aabb]) -> Node {
        let mut node = Node::EMPTY;
        for (i, b) in boxes.iter().enumerate() {
            node.set_bounds(i, b);
            node.children[i] = if i % 2 == 0 { LEAF | i as u32 } else { i as u32 };
        }
        node
    }

    /// Any finite float, of any magnitude.
    fn coordinate() -> impl Strategy<Value = f32> {
        prop_oneof![
            -1.0f32..1.0,
            any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |x| x.is_finite())
        ]
    }

    fn a_box() -> impl Strategy<Value = Aabb> {
        let point = || [coordinate(), coordinate(), coordinate()];
        (point(), point()).prop_map(|(p, q)| Aabb::EMPTY.with_point(p).with_point(q))
    }

    proptest! {
        #[test]
        fn boxes_contain_what_they_stand_for(boxes in prop::collection::vec(a_box(), 1..=8)) {
            let node = node_of(&boxes);
            let slots = assign_slots(&node);
            let encoded = encode(&node, &slots, 0, 0, |_| 3);
            let mut seen = 0u32;
            for (slot, &lane) in slots.iter().enumerate() {
                if lane == EMPTY_SLOT {
                    prop_assert_eq!(encoded.meta[slot], 0);
                    continue;
                }
                seen |= 1 << lane;
                prop_assert!(encoded.contains(slot, &boxes[lane as usize]), "{:?} {:?}", boxes[lane as usize], encoded);
            }
            prop_assert_eq!(seen, (1 << boxes.len()) - 1, "each child has one slot");
        }

        #[test]
        fn the_grid_is_not_too_coarse(low in -1e6f32..1e6, size in 1e-3f32..1e6) {
            let high = low + size;
            let grid = Grid::new(low, high);
            let (size, reach) = (f64::from(high) - f64::from(low), f64::from(STEPS) * grid.spacing);
            prop_assert!(size <= reach && reach < 2.0 * size);
        }
    }

    #[test]
    #[should_panic(expected = "sticks out")]
    fn a_box_that_sticks_out_is_noticed() {
        let b = Aabb { min: [0.0; 3], max: [1.0; 3] };
        let node = node_of(&[b]);
        let encoded = encode(&node, &assign_slots(&node), 0, 0, |_| 1);
        let slot = encoded.meta.iter().position(|&m| m != 0).unwrap();
        let larger = Aabb { min: [0.0; 3], max: [1.1; 3] };
        assert!(encoded.contains(slot, &larger), "sticks out");
    }

    #[test]
    fn whole_numbers_survive_as_halves() {
        for (step, bits) in [(0, 0), (1, 0x3C00), (2, 0x4000), (3, 0x4200), (2047, 0x67FF), (2048, 0x6800)] {
            assert_eq!(half_float(step), bits, "{step}");
        }
        (0..=STEPS).for_each(|step| assert_eq!(whole_number(half_float(step)), step));
        assert!((0..STEPS).all(|step| half_float(step) < half_float(step + 1)), "in order");
    }

    #[test]
    fn slots_tell_where_children_are() {
        let corner = |s: usize| {
            let p = [0, 1, 2].map(|a: usize| (s >> a & 1) as f32);
            Aabb { min: p, max: p.map(|x| x + 0.5) }
        };
        // In an order that is not that of the slots.
        let order = [3, 6, 0, 5, 7, 2, 4, 1];
        let slots = assign_slots(&node_of(&order.map(corner)));
        for (slot, &lane) in slots.iter().enumerate() {
            assert_eq!(order[lane as usize], slot);
        }
    }
}
