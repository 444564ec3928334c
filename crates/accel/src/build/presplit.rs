//! Cutting the boxes of large, slanted triangles into several before a tree is built over them, so that the tree is not
//! full of boxes that are mostly empty. A triangle is then in several leaves.
//!
//! Source: Karras and Aila, "Fast Parallel Construction of High-Quality Bounding Volume Hierarchies", HPG 2013, section 4.

use super::PrimitiveRef;
use crate::aabb::Aabb;
use rayon::prelude::*;

/// What of a triangle's box is worth cutting away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Waste {
    /// All that boxes around ever smaller parts would not have.
    Whole,
    /// No more than that of a right triangle along two axes: a floor is not cut, whose parts cost a ray more visits than its
    /// empty half does.
    BeyondHalf,
}

/// How many cuts to make, and which.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutting {
    /// How many boxes are added at most, as a share of the triangles.
    pub budget: f64,
    pub waste: Waste,
}

/// Cuts are made at the planes of a grid of 2 to this power cells along each axis of the scene's box: the same planes for
/// all triangles, and the coarsest first, because that is where trees are likely to be cut, too.
const GRID_BITS: u32 = 20;

/// Cells by which places on the grid may be off.
const ROUNDING: f64 = 1.0 / 64.0;

/// The cuts of all triangles that some references stand for.
pub(crate) struct Cuts<F> {
    grid: Grid,
    /// Corners of a reference's triangle, finite; `None`: it is no triangle, and not cut.
    corners: F,
    waste: Waste,
    priorities: Vec<f32>,
    /// Cuts of a triangle of priority one.
    scale: f64,
}

impl<F: Fn(&PrimitiveRef) -> Option<[[f32; 3]; 3]> + Sync> Cuts<F> {
    /// Shares out the cuts. `corners`: those of a reference's triangle, finite; `None` if it is no triangle.
    pub fn new(references: &[PrimitiveRef], corners: F, cutting: Cutting) -> Self {
        let bounds = references.par_iter().map(PrimitiveRef::bounds).reduce(|| Aabb::EMPTY, Aabb::union);
        let grid = Grid::new(&bounds);
        let waste = cutting.waste;
        let of_triangle =
            |bounds: &Aabb, c: [[f32; 3]; 3]| priority(&grid, bounds, wasted(bounds, &c, waste));
        let priority = |r: &PrimitiveRef| corners(r).map_or(0.0, |c| of_triangle(&r.bounds(), c));
        let priorities: Vec<f32> = references.par_iter().map(priority).collect();
        let scale = scale_for(&priorities, (references.len() as f64 * cutting.budget) as u64);
        Cuts { grid, corners, waste, priorities, scale }
    }

    /// Which share of the area of all boxes goes, if cuts do what they can: a bound that takes no tree to find.
    pub fn promise(&self, references: &[PrimitiveRef]) -> f64 {
        let of_one = |(r, &p): (&PrimitiveRef, &f32)| {
            let (bounds, cuts) = (r.bounds(), f64::from(cuts(p, self.scale)));
            let wasted = (self.corners)(r).map_or(0.0, |c| wasted(&bounds, &c, self.waste));
            (wasted * cuts / (cuts + 1.0), area(&bounds))
        };
        let sum = |a: (f64, f64), b: (f64, f64)| (a.0 + b.0, a.1 + b.1);
        let (saved, all) = references.par_iter().zip(&self.priorities).map(of_one).reduce(|| (0.0, 0.0), sum);
        if all > 0.0 && saved.is_finite() { saved / all } else { 0.0 }
    }

    /// References to the parts of the triangles that are cut, and to all others as they were.
    pub fn make(&self, references: &[PrimitiveRef]) -> Vec<PrimitiveRef> {
        references
            .par_iter()
            .zip(&self.priorities)
            .with_min_len(1024)
            .fold(Vec::new, |mut out, (r, p)| {
                match (cuts(*p, self.scale), (self.corners)(r)) {
                    (0, _) | (_, None) => out.push(*r),
                    (cuts, Some(corners)) => split(&self.grid, r, &corners, cuts, &mut out),
                }
                out
            })
            .flatten()
            .collect()
    }
}

/// Cuts of a triangle of priority `p`.
fn cuts(p: f32, scale: f64) -> u32 {
    (f64::from(p) * scale) as u32
}

/// The largest factor of priorities with which no more than `budget` cuts are made, or nearly so.
fn scale_for(priorities: &[f32], budget: u64) -> f64 {
    let total: f64 = priorities.par_iter().map(|&p| f64::from(p)).sum();
    if total <= 0.0 || !total.is_finite() {
        return 0.0;
    }
    let made = |scale: f64| priorities.par_iter().map(|&p| u64::from(cuts(p, scale))).sum::<u64>();
    // Without rounding down, `budget / total` would be exact; with it, more than that is needed.
    let (mut low, mut high) = (0.0, 64.0 * budget as f64 / total);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if made(middle) <= budget { low = middle } else { high = middle }
    }
    low
}

fn area(bounds: &Aabb) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|i: usize| f64::from(bounds.max[i]) - f64::from(bounds.min[i]));
    2.0 * (x * y + y * z + z * x)
}

/// The area of a triangle's box that is there in vain.
fn wasted(bounds: &Aabb, [a, b, c]: &[[f32; 3]; 3], waste: Waste) -> f64 {
    let edge = |to: &[f32; 3]| [0, 1, 2].map(|i: usize| f64::from(to[i]) - f64::from(a[i]));
    let (u, v) = (edge(b), edge(c));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    // What boxes around ever smaller parts add up to.
    let ideal: f64 = normal.iter().map(|n| n.abs()).sum();
    let needed = match waste {
        Waste::Whole => ideal,
        Waste::BeyondHalf => 2.0 * ideal,
    };
    (area(bounds) - needed).max(0.0)
}

/// What cutting a triangle promises: the area that is `wasted`, and more if an important plane goes through its box. The cube
/// root is the paper's: with it, the cuts of one triangle do not eat up the budget.
fn priority(grid: &Grid, bounds: &Aabb, wasted: f64) -> f32 {
    let Some(plane) = grid.coarsest_plane(bounds) else { return 0.0 };
    let importance = f64::from(plane.level + 1).exp2() / f64::from(GRID_BITS).exp2();
    let p = (importance * wasted).cbrt() as f32;
    if p.is_finite() { p } else { 0.0 }
}

/// A plane at right angles to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    axis: usize,
    at: f32,
    /// How coarse the coarsest grid is that has it: cells of 2^level.
    level: u32,
}

/// The box of everything, divided evenly.
struct Grid {
    low: [f64; 3],
    cell: [f64; 3],
}

impl Grid {
    fn new(bounds: &Aabb) -> Grid {
        let low = bounds.min.map(f64::from);
        let cells = f64::from(1u32 << GRID_BITS);
        Grid { low, cell: [0, 1, 2].map(|a: usize| (f64::from(bounds.max[a]) - low[a]) / cells) }
    }

    /// The coarsest plane that goes through a box; among equals, that across its longest axis.
    fn coarsest_plane(&self, bounds: &Aabb) -> Option<Plane> {
        let mut best: Option<(u32, f64, Plane)> = None;
        for axis in 0..3 {
            let place = |x: f32| (f64::from(x) - self.low[axis]) / self.cell[axis];
            // Faces of a box that was cut lie on planes, up to rounding: the cells inside of them count.
            let low = (place(bounds.min[axis]) + ROUNDING) as u32;
            let high = ((place(bounds.max[axis]) - ROUNDING).max(0.0) as u32).min((1 << GRID_BITS) - 1);
            if low >= high || self.cell[axis] <= 0.0 {
                continue;
            }
            // The highest bit in which the cells differ; the plane is where it becomes one.
            let level = (low ^ high).ilog2();
            let at = (self.low[axis] + f64::from(high >> level << level) * self.cell[axis]) as f32;
            if !(bounds.min[axis] < at && at < bounds.max[axis]) {
                continue;
            }
            let length = f64::from(bounds.max[axis]) - f64::from(bounds.min[axis]);
            if best.is_none_or(|(l, longest, _)| (level, length) > (l, longest)) {
                best = Some((level, length, Plane { axis, at, level }));
            }
        }
        best.map(|(_, _, plane)| plane)
    }
}

/// Appends references to the parts of a triangle's box after `cuts` cuts.
fn split(grid: &Grid, whole: &PrimitiveRef, corners: &[[f32; 3]; 3], cuts: u32, out: &mut Vec<PrimitiveRef>) {
    let mut open = vec![(whole.bounds(), cuts)];
    while let Some((bounds, cuts)) = open.pop() {
        let plane = if cuts > 0 { grid.coarsest_plane(&bounds) } else { None };
        let Some(plane) = plane else {
            out.push(PrimitiveRef::new(&bounds, whole.index(), whole.geometry()));
            continue;
        };
        let (left, right) = halves(corners, &bounds, plane);
        // Longer parts get more of the cuts that are left.
        let length = |b: &Aabb| (0..3).map(|a| b.max[a] - b.min[a]).fold(0.0, f32::max);
        let share = length(&left) / (length(&left) + length(&right));
        let left_cuts = ((cuts - 1) as f32 * share + 0.5) as u32;
        for (part, cuts) in [(left, left_cuts.min(cuts - 1)), (right, (cuts - 1).saturating_sub(left_cuts))] {
            if !part.is_empty() {
                open.push((part, cuts));
            }
        }
    }
}

/// Boxes around what of a triangle is on either side of a plane, inside of `bounds`.
fn halves(corners: &[[f32; 3]; 3], bounds: &Aabb, Plane { axis, at, .. }: Plane) -> (Aabb, Aabb) {
    let (mut left, mut right) = (Aabb::EMPTY, Aabb::EMPTY);
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        let (a, b) = (corners[from], corners[to]);
        if a[axis] <= at {
            left = left.with_point(a);
        }
        if a[axis] >= at {
            right = right.with_point(a);
        }
        if (a[axis] < at) != (b[axis] < at) && a[axis] != at && b[axis] != at {
            let crossing = crossing(a, b, axis, at);
            (left, right) = (left.union(crossing), right.union(crossing));
        }
    }
    left.max[axis] = left.max[axis].min(at);
    right.min[axis] = right.min[axis].max(at);
    (intersection(&left, bounds), intersection(&right, bounds))
}

/// A box around the point where an edge goes through a plane, rounded outwards.
fn crossing(a: [f32; 3], b: [f32; 3], axis: usize, at: f32) -> Aabb {
    let (from, to) = (a.map(f64::from), b.map(f64::from));
    let t = (f64::from(at) - from[axis]) / (to[axis] - from[axis]);
    let point =
        [0, 1, 2].map(|i: usize| if i == axis { at } else { (from[i] + (to[i] - from[i]) * t) as f32 });
    Aabb { min: point.map(f32::next_down), max: point.map(f32::next_up) }
}

fn intersection(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb {
        min: [0, 1, 2].map(|i: usize| a.min[i].max(b.min[i])),
        max: [0, 1, 2].map(|i: usize| a.max[i].min(b.max[i])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLANTED: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [8.0, 8.0, 1.0], [8.0, 7.5, 1.5]];

    fn reference(points: &[[f32; 3]; 3], index: u32) -> PrimitiveRef {
        let bounds = points.iter().fold(Aabb::EMPTY, |b, &p| b.with_point(p));
        PrimitiveRef::new(&bounds, index, 7)
    }

    const CUTTING: Cutting = Cutting { budget: 0.3, waste: Waste::Whole };

    fn cut(
        references: &[PrimitiveRef],
        corners: impl Fn(&PrimitiveRef) -> [[f32; 3]; 3] + Sync,
    ) -> Vec<PrimitiveRef> {
        Cuts::new(references, |r: &PrimitiveRef| Some(corners(r)), CUTTING).make(references)
    }

    #[test]
    fn parts_cover_the_triangle_and_are_smaller_than_its_box() {
        let whole = reference(&SLANTED, 3);
        let mut parts = Vec::new();
        split(&Grid::new(&whole.bounds()), &whole, &SLANTED, 15, &mut parts);
        assert_eq!(parts.len(), 16);
        assert!(parts.iter().all(|p| (p.index(), p.geometry()) == (3, 7)));
        assert!(parts.iter().map(|p| area(&p.bounds())).sum::<f64>() < 0.5 * area(&whole.bounds()));
        for (i, j) in (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (i, j))) {
            let (u, v) = (f64::from(i) / 40.0, f64::from(j) / 40.0);
            let at = |a: usize| {
                let [p, q, r] = SLANTED.map(|c| f64::from(c[a]));
                (p * (1.0 - u - v) + q * u + r * v) as f32
            };
            let point = [at(0), at(1), at(2)];
            // The point itself is rounded, too.
            let near = Aabb { min: point.map(f32::next_down), max: point.map(f32::next_up) };
            let touches = |b: &Aabb| (0..3).all(|a| near.min[a] <= b.max[a] && near.max[a] >= b.min[a]);
            assert!(parts.iter().any(|p| touches(&p.bounds())), "{point:?}");
        }
    }

    /// 99 small triangles in the plane of two axes, which fill half of their boxes, and no cut changes that much; and one that
    /// is large and slanted.
    fn mixed() -> Vec<[[f32; 3]; 3]> {
        let small = |i: u32| {
            let x = i as f32 * 0.01;
            [[x, 0.0, 0.0], [x + 0.01, 0.0, 0.0], [x, 0.01, 0.0]]
        };
        (0..99).map(small).chain([SLANTED]).collect()
    }

    fn references(triangles: &[[[f32; 3]; 3]]) -> Vec<PrimitiveRef> {
        (0..).zip(triangles).map(|(i, t)| reference(t, i)).collect()
    }

    #[test]
    fn the_budget_is_spent_on_those_that_gain() {
        let triangles = mixed();
        let parts = cut(&references(&triangles), |r| triangles[r.index() as usize]);
        let of_slanted = parts.iter().filter(|r| r.index() == 99).count();
        assert!((10..=31).contains(&of_slanted), "{of_slanted}");
        assert!(parts.len() <= 130, "{}", parts.len());
        assert!((0..100).all(|i| parts.iter().any(|r| r.index() == i)));
    }

    #[test]
    fn a_promise_is_nearly_kept() {
        let triangles = mixed();
        let whole = references(&triangles);
        let cuts = Cuts::new(&whole, |r| Some(triangles[r.index() as usize]), CUTTING);
        let sum = |refs: &[PrimitiveRef]| refs.iter().map(|r| area(&r.bounds())).sum::<f64>();
        let saved = 1.0 - sum(&cuts.make(&whole)) / sum(&whole);
        let promise = cuts.promise(&whole);
        assert!(saved > 0.5 && (promise - saved).abs() < 0.2, "{promise} {saved}");
        // Where all triangles are alike, there is little to gain.
        let alike = references(&triangles[..99]);
        let promise = Cuts::new(&alike, |r| Some(triangles[r.index() as usize]), CUTTING).promise(&alike);
        assert!(promise < 0.2, "{promise}");
    }

    #[test]
    fn a_floor_is_cut_only_if_its_empty_half_counts() {
        let floor = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 0.0, 9.0]];
        let triangles: Vec<_> = mixed().into_iter().take(99).chain([floor]).collect();
        let whole = references(&triangles);
        let parts = |waste| {
            let cutting = Cutting { budget: 0.3, waste };
            Cuts::new(&whole, |r| Some(triangles[r.index() as usize]), cutting).make(&whole).len()
        };
        assert!(parts(Waste::Whole) > 105);
        assert_eq!(parts(Waste::BeyondHalf), 100);
    }

    #[test]
    fn what_is_no_triangle_is_never_cut() {
        let triangles = mixed();
        let whole = references(&triangles);
        let even = |r: &PrimitiveRef| r.index().is_multiple_of(2).then(|| triangles[r.index() as usize]);
        let parts = Cuts::new(&whole, even, Cutting { budget: 1.0, waste: Waste::Whole }).make(&whole);
        let count = |index: u32| parts.iter().filter(|r| r.index() == index).count();
        let indices = 0..triangles.len() as u32;
        assert!(indices.clone().any(|i| count(i) > 1), "nothing is cut");
        assert!(indices.filter(|i| i % 2 == 1).all(|i| count(i) == 1));
        assert_eq!(Cuts::new(&whole, |_| None, CUTTING).promise(&whole), 0.0);
    }

    #[test]
    fn nothing_to_gain_is_no_error() {
        for points in [[[0.0; 3]; 3], [[-3.0e38, 0.0, 0.0], [3.0e38, 1.0, 0.0], [0.0, 3.0e38, 3.0e38]]] {
            let whole = vec![reference(&points, 0); 5];
            assert!(cut(&whole, |_| points).len() >= 5);
            assert!((0.0..=1.0).contains(&Cuts::new(&whole, |_| Some(points), CUTTING).promise(&whole)));
        }
        assert!(cut(&[], |_| SLANTED).is_empty());
    }
}
