//! Tight bounds of transformed objects.
//!
//! The box around a rotated box is up to three times as long as the object inside. For a rotated
//! ball it has more than twice the necessary area, and every ray that hits it has to enter the
//! object. A few dozen boxes of the object's nodes, transformed one by one, give tighter bounds.

use crate::aabb::Aabb;
use crate::layout::{ChildRef, EMPTY, LEAF, Node, WIDTH};

/// Most boxes of an object.
const MAX_BOXES: usize = 128;

/// Eight boxes as centres and half sizes, by axis and lane.
#[derive(Clone, Copy, Debug)]
struct BoxLanes {
    centers: [[f32; WIDTH]; 3],
    halves: [[f32; WIDTH]; 3],
}

/// The bounds of an object, and boxes that contain all of it.
#[derive(Clone, Debug)]
pub(crate) struct TightBounds {
    bounds: Aabb,
    /// Empty if the object has no tree.
    boxes: Vec<BoxLanes>,
}

impl TightBounds {
    /// Of the subtree at `root`, whose bounds are `bounds`. Opens the largest node until there are
    /// enough boxes.
    pub fn new(nodes: &[Node], root: ChildRef, bounds: Aabb) -> TightBounds {
        let mut boxes = vec![(bounds, root)];
        while boxes.len() + WIDTH - 1 <= MAX_BOXES {
            let area = |at: &usize| boxes[*at].0.half_area();
            let inner = (0..boxes.len()).filter(|&at| boxes[at].1 & LEAF == 0);
            let Some(largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
            let node = &nodes[boxes.swap_remove(largest).1 as usize];
            let children = (0..WIDTH).filter(|&slot| node.children[slot] != EMPTY);
            boxes.extend(children.map(|slot| (node.bounds(slot), node.children[slot])));
        }
        // Boxes of primitives that cannot be hit at present are empty.
        let boxes: Vec<Aabb> = boxes.into_iter().map(|c| c.0).filter(|b| !b.is_empty()).collect();
        let boxes =
            if boxes.len() > 1 { boxes.chunks(WIDTH).map(BoxLanes::new).collect() } else { Vec::new() };
        TightBounds { bounds, boxes }
    }

    /// Bounds of the object under a transform, with room for the rounding of transformed rays.
    pub fn transformed(&self, m: &[[f32; 4]; 3]) -> Aabb {
        let outer = transformed_box(&self.bounds, m);
        let rotates = m.iter().any(|row| row[..3].iter().filter(|&&x| x != 0.0).count() > 1);
        if !rotates || self.boxes.is_empty() {
            return outer;
        }
        let (mut low, mut high) = ([[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]);
        for boxes in &self.boxes {
            for a in 0..3 {
                boxes.grow_along(&m[a], &mut low[a], &mut high[a]);
            }
        }
        let mut bounds = outer;
        for a in 0..3 {
            let room = 2e-6 * size(&self.bounds, &m[a]) as f32;
            let least = low[a].into_iter().fold(f32::INFINITY, f32::min) + m[a][3];
            let most = high[a].into_iter().fold(f32::NEG_INFINITY, f32::max) + m[a][3];
            // No sum is larger than `size`. If a sum overflows, so does `room`, and the outer box
            // remains.
            bounds.min[a] = outer.min[a].max(least - room);
            bounds.max[a] = outer.max[a].min(most + room);
        }
        bounds
    }

    /// Memory on the heap, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.boxes.capacity() * size_of::<BoxLanes>()
    }
}

impl BoxLanes {
    /// One to eight boxes. Unused lanes repeat the first.
    fn new(boxes: &[Aabb]) -> BoxLanes {
        let mut all = BoxLanes { centers: [[0.0; WIDTH]; 3], halves: [[0.0; WIDTH]; 3] };
        for lane in 0..WIDTH {
            let b = boxes.get(lane).unwrap_or(&boxes[0]);
            for a in 0..3 {
                let center = 0.5 * b.min[a] + 0.5 * b.max[a];
                all.centers[a][lane] = center;
                all.halves[a][lane] = (b.max[a] - center).max(center - b.min[a]);
            }
        }
        all
    }

    /// Extends intervals by the boxes along one axis of a transform, without its translation.
    #[inline(always)]
    fn grow_along(&self, row: &[f32; 4], low: &mut [f32; WIDTH], high: &mut [f32; WIDTH]) {
        let [x, y, z, _] = *row;
        let (c, h) = (&self.centers, &self.halves);
        for lane in 0..WIDTH {
            let center = x * c[0][lane] + y * c[1][lane] + z * c[2][lane];
            let half = x.abs() * h[0][lane] + y.abs() * h[1][lane] + z.abs() * h[2][lane];
            low[lane] = low[lane].min(center - half);
            high[lane] = high[lane].max(center + half);
        }
    }
}

/// The largest sum of magnitudes when a row of a transform is applied to points of a box. Rounding
/// errors are relative to it.
fn size(b: &Aabb, row: &[f32; 4]) -> f64 {
    let along = |c: usize| f64::from(row[c].abs()) * f64::from(b.min[c].abs().max(b.max[c].abs()));
    along(0) + along(1) + along(2) + f64::from(row[3].abs())
}

/// Bounds of a transformed box, with room for the rounding of transformed rays.
fn transformed_box(b: &Aabb, m: &[[f32; 4]; 3]) -> Aabb {
    let mut r = Aabb { min: [0.0; 3], max: [0.0; 3] };
    for a in 0..3 {
        let row = m[a].map(f64::from);
        let (mut low, mut high) = (row[3], row[3]);
        for c in 0..3 {
            let (x, y) = (row[c] * f64::from(b.min[c]), row[c] * f64::from(b.max[c]));
            low += x.min(y);
            high += x.max(y);
        }
        let room = size(b, &m[a]) * 1e-6;
        r.min[a] = (low - room) as f32;
        r.max[a] = (high + room) as f32;
    }
    r
}
