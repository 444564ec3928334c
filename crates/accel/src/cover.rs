//! Boxes that cover an object together, for the bounds of its instances.
//!
//! The box around a turned box is up to three times as long as the object in it: around a turned ball, the box around its box has
//! more than twice the area that it needs, and every ray that hits it for nothing has to enter the object. A few dozen of the
//! boxes inside lie closer.

use crate::aabb::Aabb;
use crate::layout::{ChildRef, EMPTY, LEAF, Node, WIDTH};

/// Most boxes of a cover.
const MOST_BOXES: usize = 128;

/// Eight boxes: centres and half sizes, by axis and lane.
#[derive(Clone, Copy, Debug)]
struct Boxes {
    centers: [[f32; WIDTH]; 3],
    halves: [[f32; WIDTH]; 3],
}

/// Boxes that cover an object.
#[derive(Clone, Debug)]
pub(crate) struct Cover {
    bounds: Aabb,
    /// None where the bounds themselves are all that is known.
    boxes: Vec<Boxes>,
}

impl Cover {
    /// Of what is below `root`, around which `bounds` is the box.
    pub fn new(nodes: &[Node], root: ChildRef, bounds: Aabb) -> Cover {
        let mut cover = vec![(bounds, root)];
        while cover.len() + WIDTH - 1 <= MOST_BOXES {
            let area = |at: &usize| cover[*at].0.half_area();
            let inner = (0..cover.len()).filter(|&at| cover[at].1 & LEAF == 0);
            let Some(largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
            let node = &nodes[cover.swap_remove(largest).1 as usize];
            let children = (0..WIDTH).filter(|&slot| node.children[slot] != EMPTY);
            cover.extend(children.map(|slot| (node.bounds(slot), node.children[slot])));
        }
        // Boxes of what cannot be hit at present are empty.
        let cover: Vec<Aabb> = cover.into_iter().map(|c| c.0).filter(|b| !b.is_empty()).collect();
        let boxes = if cover.len() > 1 { cover.chunks(WIDTH).map(Boxes::new).collect() } else { Vec::new() };
        Cover { bounds, boxes }
    }

    /// The box around the object under a transform, with room for the rounding of transformed rays.
    pub fn under(&self, m: &[[f32; 4]; 3]) -> Aabb {
        let outer = transformed(&self.bounds, m);
        let turns = m.iter().any(|row| row[..3].iter().filter(|&&x| x != 0.0).count() > 1);
        if !turns || self.boxes.is_empty() {
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
            // No sum is larger than the size. Where one overflows, the room does, too, and the outer box stays as it is.
            bounds.min[a] = outer.min[a].max(least - room);
            bounds.max[a] = outer.max[a].min(most + room);
        }
        bounds
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        self.boxes.capacity() * size_of::<Boxes>()
    }
}

impl Boxes {
    /// One to eight boxes; the first stands in the other lanes, too.
    fn new(boxes: &[Aabb]) -> Boxes {
        let mut all = Boxes { centers: [[0.0; WIDTH]; 3], halves: [[0.0; WIDTH]; 3] };
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

    /// Grows intervals by where the boxes are along an axis of a transform, but for its translation.
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

/// The largest sum of magnitudes that the row of a transform makes of points in a box: what rounding is relative to.
fn size(b: &Aabb, row: &[f32; 4]) -> f64 {
    let along = |c: usize| f64::from(row[c].abs()) * f64::from(b.min[c].abs().max(b.max[c].abs()));
    along(0) + along(1) + along(2) + f64::from(row[3].abs())
}

/// The box around a transformed box, with room for the rounding of transformed rays.
fn transformed(b: &Aabb, m: &[[f32; 4]; 3]) -> Aabb {
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
