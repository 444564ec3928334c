//! Splits the boxes of large, slanted triangles before the build, so that the tree has fewer boxes
//! that are mostly empty. A split triangle is in several leaves.
//!
//! Source: Karras and Aila, "Fast Parallel Construction of High-Quality Bounding Volume
//! Hierarchies", HPG 2013, section 4.

use super::primitive_ref::PrimitiveRef;
use crate::aabb::Aabb;
use elementary::{cbrt, exp2};
use rayon::prelude::*;

/// Which empty area of a triangle's box splits should remove.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EmptyArea {
    /// All area that boxes of ever smaller parts would not have.
    Whole,
    /// Only what exceeds the empty area of a right triangle along two axes. A floor is not split:
    /// the visits to its parts would cost more than its empty half.
    BeyondHalf,
}

/// How many splits to make, and where.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PresplitSettings {
    /// Most additional references, as a share of the triangles.
    pub budget: f64,
    pub empty: EmptyArea,
}

/// Splits are made at the planes of a grid with 2 to this power cells along each axis of the
/// scene's box. All triangles share the planes, and the coarsest plane comes first, because the
/// builder is likely to split there, too.
const GRID_BITS: u32 = 20;

/// Rounding error of positions on the grid, in cells.
const ROUNDING: f64 = 1.0 / 64.0;

/// The number of splits of each reference.
pub(crate) struct Presplits<F> {
    grid: Grid,
    /// Corners of a reference's triangle, finite. `None` for other primitives, which are not split.
    corners: F,
    empty: EmptyArea,
    priorities: Vec<f32>,
    /// Splits of a triangle of priority one.
    scale: f64,
}

impl<F: Fn(&PrimitiveRef) -> Option<[[f32; 3]; 3]> + Sync> Presplits<F> {
    /// Distributes the splits. `corners`: those of a reference's triangle, finite; `None` for other
    /// primitives.
    pub fn new(references: &[PrimitiveRef], corners: F, settings: PresplitSettings) -> Self {
        let bounds = references.par_iter().map(PrimitiveRef::bounds).reduce(|| Aabb::EMPTY, Aabb::union);
        let grid = Grid::new(&bounds);
        let empty = settings.empty;
        let of_triangle =
            |bounds: &Aabb, c: [[f32; 3]; 3]| priority(&grid, bounds, empty_area(bounds, &c, empty));
        let priority = |r: &PrimitiveRef| corners(r).map_or(0.0, |c| of_triangle(&r.bounds(), c));
        let priorities: Vec<f32> = references.par_iter().map(priority).collect();
        let scale = scale_for(&priorities, (references.len() as f64 * settings.budget) as u64);
        Presplits { grid, corners, empty, priorities, scale }
    }

    /// The share of the area of all boxes that splits can remove: an upper bound that needs no
    /// tree.
    pub fn removable_share(&self, references: &[PrimitiveRef]) -> f64 {
        let of_one = |(r, &p): (&PrimitiveRef, &f32)| {
            let (bounds, splits) = (r.bounds(), f64::from(splits(p, self.scale)));
            let empty_area = (self.corners)(r).map_or(0.0, |c| empty_area(&bounds, &c, self.empty));
            (empty_area * splits / (splits + 1.0), area(&bounds))
        };
        let sum = |a: (f64, f64), b: (f64, f64)| (a.0 + b.0, a.1 + b.1);
        let (saved, all) = references.par_iter().zip(&self.priorities).map(of_one).reduce(|| (0.0, 0.0), sum);
        if all > 0.0 && saved.is_finite() { saved / all } else { 0.0 }
    }

    /// All references, with those that are split replaced by references to their parts.
    pub fn apply(&self, references: &[PrimitiveRef]) -> Vec<PrimitiveRef> {
        references
            .par_iter()
            .zip(&self.priorities)
            .with_min_len(1024)
            .fold(Vec::new, |mut out, (r, p)| {
                match (splits(*p, self.scale), (self.corners)(r)) {
                    (0, _) | (_, None) => out.push(*r),
                    (splits, Some(corners)) => split(&self.grid, r, &corners, splits, &mut out),
                }
                out
            })
            .flatten()
            .collect()
    }
}

/// Splits of a triangle of priority `p`.
fn splits(p: f32, scale: f64) -> u32 {
    (f64::from(p) * scale) as u32
}

/// The largest factor of priorities with which at most `budget` splits are made, approximately.
fn scale_for(priorities: &[f32], budget: u64) -> f64 {
    let total: f64 = priorities.par_iter().map(|&p| f64::from(p)).sum();
    if total <= 0.0 || !total.is_finite() {
        return 0.0;
    }
    let made = |scale: f64| priorities.par_iter().map(|&p| u64::from(splits(p, scale))).sum::<u64>();
    // Splits are rounded down, so the factor is larger than `budget / total`.
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

/// The empty area of a triangle's box that splits should remove.
fn empty_area(bounds: &Aabb, [a, b, c]: &[[f32; 3]; 3], empty: EmptyArea) -> f64 {
    let edge = |to: &[f32; 3]| [0, 1, 2].map(|i: usize| f64::from(to[i]) - f64::from(a[i]));
    let (u, v) = (edge(b), edge(c));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    // The total area of boxes around ever smaller parts.
    let ideal: f64 = normal.iter().map(|n| n.abs()).sum();
    let needed = match empty {
        EmptyArea::Whole => ideal,
        EmptyArea::BeyondHalf => 2.0 * ideal,
    };
    (area(bounds) - needed).max(0.0)
}

/// The priority of splitting a triangle: higher for more empty area and for a coarser plane through
/// its box. The cube root is the paper's: it keeps one triangle from using up the budget.
fn priority(grid: &Grid, bounds: &Aabb, empty_area: f64) -> f32 {
    let Some(plane) = grid.coarsest_plane(bounds) else { return 0.0 };
    let importance = exp2(f64::from(plane.level + 1)) / exp2(f64::from(GRID_BITS));
    let p = cbrt(importance * empty_area) as f32;
    if p.is_finite() { p } else { 0.0 }
}

/// An axis-aligned plane.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SplitPlane {
    axis: usize,
    at: f32,
    /// The plane belongs to a grid with cells of 2^level fine cells.
    level: u32,
}

/// A regular grid over the bounds of all references.
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

    /// The coarsest plane through a box; among equals, the one across its longest axis.
    fn coarsest_plane(&self, bounds: &Aabb) -> Option<SplitPlane> {
        let mut best: Option<(u32, f64, SplitPlane)> = None;
        for axis in 0..3 {
            let place = |x: f32| (f64::from(x) - self.low[axis]) / self.cell[axis];
            // Sides of a box that was split lie on planes, up to rounding: only cells inside count.
            let low = (place(bounds.min[axis]) + ROUNDING) as u32;
            let high = ((place(bounds.max[axis]) - ROUNDING).max(0.0) as u32).min((1 << GRID_BITS) - 1);
            if low >= high || self.cell[axis] <= 0.0 {
                continue;
            }
            // The highest bit in which the cells differ; the plane is where that bit becomes one.
            let level = (low ^ high).ilog2();
            let at = (self.low[axis] + f64::from(high >> level << level) * self.cell[axis]) as f32;
            if !(bounds.min[axis] < at && at < bounds.max[axis]) {
                continue;
            }
            let length = f64::from(bounds.max[axis]) - f64::from(bounds.min[axis]);
            if best.is_none_or(|(l, longest, _)| (level, length) > (l, longest)) {
                best = Some((level, length, SplitPlane { axis, at, level }));
            }
        }
        best.map(|(_, _, plane)| plane)
    }
}

/// Appends references to the parts of a triangle's box after `splits` splits.
fn split(
    grid: &Grid,
    whole: &PrimitiveRef,
    corners: &[[f32; 3]; 3],
    splits: u32,
    out: &mut Vec<PrimitiveRef>,
) {
    let mut open = vec![(whole.bounds(), splits)];
    while let Some((bounds, splits)) = open.pop() {
        let plane = if splits > 0 { grid.coarsest_plane(&bounds) } else { None };
        let Some(plane) = plane else {
            out.push(PrimitiveRef::new(&bounds, whole.index(), whole.geometry()));
            continue;
        };
        let (left, right) = halves(corners, &bounds, plane);
        // Longer parts get more of the remaining splits.
        let length = |b: &Aabb| (0..3).map(|a| b.max[a] - b.min[a]).fold(0.0, f32::max);
        let share = length(&left) / (length(&left) + length(&right));
        let left_splits = ((splits - 1) as f32 * share + 0.5) as u32;
        for (part, splits) in
            [(left, left_splits.min(splits - 1)), (right, (splits - 1).saturating_sub(left_splits))]
        {
            if !part.is_empty() {
                open.push((part, splits));
            }
        }
    }
}

/// Bounds of the parts of a triangle on either side of a plane, clipped to `bounds`.
fn halves(corners: &[[f32; 3]; 3], bounds: &Aabb, SplitPlane { axis, at, .. }: SplitPlane) -> (Aabb, Aabb) {
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

/// Bounds of the intersection of an edge and a plane, rounded outwards.
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

    const SETTINGS: PresplitSettings = PresplitSettings { budget: 0.3, empty: EmptyArea::Whole };

    fn cut(
        references: &[PrimitiveRef],
        corners: impl Fn(&PrimitiveRef) -> [[f32; 3]; 3] + Sync,
    ) -> Vec<PrimitiveRef> {
        Presplits::new(references, |r: &PrimitiveRef| Some(corners(r)), SETTINGS).apply(references)
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

    /// 99 small triangles in the plane of two axes, which fill half of their boxes, and no cut
    /// changes that much; and one that is large and slanted.
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
        let splits = Presplits::new(&whole, |r| Some(triangles[r.index() as usize]), SETTINGS);
        let sum = |refs: &[PrimitiveRef]| refs.iter().map(|r| area(&r.bounds())).sum::<f64>();
        let saved = 1.0 - sum(&splits.apply(&whole)) / sum(&whole);
        let removable_share = splits.removable_share(&whole);
        assert!(saved > 0.5 && (removable_share - saved).abs() < 0.2, "{removable_share} {saved}");
        // Where all triangles are alike, there is little to gain.
        let alike = references(&triangles[..99]);
        let removable_share =
            Presplits::new(&alike, |r| Some(triangles[r.index() as usize]), SETTINGS).removable_share(&alike);
        assert!(removable_share < 0.2, "{removable_share}");
    }

    #[test]
    fn a_floor_is_cut_only_if_its_empty_half_counts() {
        let floor = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 0.0, 9.0]];
        let triangles: Vec<_> = mixed().into_iter().take(99).chain([floor]).collect();
        let whole = references(&triangles);
        let parts = |empty| {
            let settings = PresplitSettings { budget: 0.3, empty };
            Presplits::new(&whole, |r| Some(triangles[r.index() as usize]), settings).apply(&whole).len()
        };
        assert!(parts(EmptyArea::Whole) > 105);
        assert_eq!(parts(EmptyArea::BeyondHalf), 100);
    }

    #[test]
    fn what_is_no_triangle_is_never_cut() {
        let triangles = mixed();
        let whole = references(&triangles);
        let even = |r: &PrimitiveRef| r.index().is_multiple_of(2).then(|| triangles[r.index() as usize]);
        let parts = Presplits::new(&whole, even, PresplitSettings { budget: 1.0, empty: EmptyArea::Whole })
            .apply(&whole);
        let count = |index: u32| parts.iter().filter(|r| r.index() == index).count();
        let indices = 0..triangles.len() as u32;
        assert!(indices.clone().any(|i| count(i) > 1), "nothing is cut");
        assert!(indices.filter(|i| i % 2 == 1).all(|i| count(i) == 1));
        assert_eq!(Presplits::new(&whole, |_| None, SETTINGS).removable_share(&whole), 0.0);
    }

    #[test]
    fn nothing_to_gain_is_no_error() {
        for points in [[[0.0; 3]; 3], [[-3.0e38, 0.0, 0.0], [3.0e38, 1.0, 0.0], [0.0, 3.0e38, 3.0e38]]] {
            let whole = vec![reference(&points, 0); 5];
            assert!(cut(&whole, |_| points).len() >= 5);
            assert!(
                (0.0..=1.0)
                    .contains(&Presplits::new(&whole, |_| Some(points), SETTINGS).removable_share(&whole))
            );
        }
        assert!(cut(&[], |_| SLANTED).is_empty());
    }
}
