//! Polygons to triangles.
//!
//! Ear clipping of our own, because a mesh needs what the crates for maps do not give: every vertex is kept, collinear
//! ones too (leaving them out opens cracks to the neighbouring polygon), triangles keep the polygon's winding in
//! space, and the time is bounded for any input.

use glam::{DVec2, Vec3};

/// Triangulates polygons, keeping its buffers between them.
#[derive(Default)]
pub struct Triangulator {
    points: Vec<DVec2>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Intersection tests of all polygons so far.
    spent: u64,
}

/// Intersection tests that a polygon may cost before ear clipping is given up: about those that an honest one of
/// twenty thousand corners needs.
const MAX_TESTS: u64 = 1 << 28;
/// Tests that all polygons of one triangulator may cost together, beside a few for each corner.
const MAX_TESTS_IN_ALL: u64 = 1 << 29;
const TESTS_PER_CORNER: u64 = 64;

impl Triangulator {
    /// Appends the triangles of the polygon `corners` to `triangles`, as indices into `corners`.
    ///
    /// The polygon may be concave; it should be planar and must not cross itself. A polygon of `n ≥ 3` corners always
    /// becomes `n − 2` triangles in the polygon's winding order; fewer corners become none. Returns whether all went
    /// well: `false` means that the outline crosses itself or has no area, and that the triangles fill it in some way only.
    pub fn polygon(&mut self, corners: &[Vec3], triangles: &mut Vec<[u32; 3]>) -> bool {
        match corners.len() {
            0..=2 => return true,
            3 => {
                triangles.push([0, 1, 2]);
                return true;
            }
            _ => {}
        }
        let count = corners.len() as u32;
        let fan = |triangles: &mut Vec<[u32; 3]>| triangles.extend((2..count).map(|i| [0, i - 1, i]));
        if !self.project(corners) {
            fan(triangles);
            return false;
        }
        let turns = |i: u32| self.turn((i + count - 1) % count, i, (i + 1) % count);
        if count == 4 {
            // The diagonal must start at the reflex corner, if there is one.
            let split_at_odd = turns(1) < 0.0 || turns(3) < 0.0;
            triangles.extend(if split_at_odd { [[1, 2, 3], [1, 3, 0]] } else { [[0, 1, 2], [0, 2, 3]] });
            return true;
        }
        if (0..count).all(|i| turns(i) > 0.0) && self.winds_once() {
            fan(triangles);
            return true;
        }
        self.clip_ears(count, triangles)
    }

    /// Drops the axis along which the polygon is thinnest, so that it turns left in the plane. Returns `false` if it
    /// has no area or is not finite.
    fn project(&mut self, corners: &[Vec3]) -> bool {
        let mut normal = glam::DVec3::ZERO; // Newell's method; twice the area
        let origin = corners[0].as_dvec3();
        let mut last = corners[corners.len() - 1].as_dvec3() - origin;
        for corner in corners {
            let corner = corner.as_dvec3() - origin;
            normal += last.cross(corner);
            last = corner;
        }
        let size = normal.abs();
        if !(size.is_finite() && size.max_element() > 0.0) {
            return false;
        }
        let axis = size.max_position();
        let (u, v) = if normal[axis] > 0.0 {
            ((axis + 1) % 3, (axis + 2) % 3)
        } else {
            ((axis + 2) % 3, (axis + 1) % 3)
        };
        self.points.clear();
        self.points.extend(corners.iter().map(|c| DVec2::new(f64::from(c[u]), f64::from(c[v]))));
        true
    }

    /// Twice the signed area of a triangle; positive when it turns left.
    fn turn(&self, a: u32, b: u32, c: u32) -> f64 {
        let [a, b, c] = [a, b, c].map(|i| self.points[i as usize]);
        (b - a).perp_dot(c - b)
    }

    /// Whether an outline that only turns left goes round once and not several times, as a pentagram does.
    fn winds_once(&self) -> bool {
        let count = self.points.len();
        let up = |i: usize| self.points[(i + 1) % count].y > self.points[i].y;
        (0..count).filter(|i| up(*i) != up((i + 1) % count)).count() <= 2
    }

    fn clip_ears(&mut self, count: u32, triangles: &mut Vec<[u32; 3]>) -> bool {
        self.next.clear();
        self.next.extend((1..count).chain([0]));
        self.previous.clear();
        self.previous.extend([count - 1].into_iter().chain(0..count - 1));
        let left = MAX_TESTS_IN_ALL.saturating_sub(self.spent).max(TESTS_PER_CORNER * u64::from(count));
        let granted = (u64::from(count) * u64::from(count)).min(MAX_TESTS).min(left);
        let mut budget = granted;
        let (mut remaining, mut corner, mut tried) = (count, 0, 0);
        let mut clean = true;
        while remaining > 3 {
            // After a whole round without an ear the outline is broken: go on with anything.
            let stuck = tried > remaining || budget == 0;
            clean &= !stuck;
            let (before, after) = (self.previous[corner as usize], self.next[corner as usize]);
            if stuck || self.is_ear(before, corner, after, &mut budget) {
                triangles.push([before, corner, after]);
                self.next[before as usize] = after;
                self.previous[after as usize] = before;
                remaining -= 1;
                tried = 0;
                corner = self.next[after as usize]; // skipping one avoids long thin fans
            } else {
                tried += 1;
                corner = after;
            }
        }
        triangles.push([self.previous[corner as usize], corner, self.next[corner as usize]]);
        self.spent += granted - budget;
        clean
    }

    /// Whether the corner is convex and no other corner that is left lies in its triangle.
    fn is_ear(&self, before: u32, corner: u32, after: u32, budget: &mut u64) -> bool {
        if self.turn(before, corner, after) <= 0.0 {
            *budget = budget.saturating_sub(1);
            return false;
        }
        let [a, b, c] = [before, corner, after].map(|i| self.points[i as usize]);
        let mut other = self.next[after as usize];
        while other != before {
            *budget = budget.saturating_sub(1);
            let p = self.points[other as usize];
            let inside = (b - a).perp_dot(p - a) >= 0.0
                && (c - b).perp_dot(p - b) >= 0.0
                && (a - c).perp_dot(p - c) >= 0.0;
            // Corners in the same place belong to a slit, which joins a hole to the outline.
            if inside && p != a && p != b && p != c {
                return false;
            }
            other = self.next[other as usize];
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn triangulate(corners: &[Vec3]) -> (Vec<[u32; 3]>, bool) {
        let mut triangles = Vec::new();
        let clean = Triangulator::default().polygon(corners, &mut triangles);
        (triangles, clean)
    }

    fn area_vector(corners: &[Vec3], triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|i| corners[i as usize]);
        (b - a).cross(c - a) * 0.5
    }

    /// Every triangle faces as the polygon does, and together they have its area.
    fn assert_tiles(corners: &[Vec3], normal: Vec3, area: f32) {
        let (triangles, clean) = triangulate(corners);
        assert!(clean);
        assert_eq!(triangles.len(), corners.len() - 2);
        let areas: Vec<f32> = triangles.iter().map(|t| area_vector(corners, *t).dot(normal)).collect();
        assert!(areas.iter().all(|a| *a >= 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f32>() - area).abs() < 1e-5 * area, "{areas:?}");
    }

    #[test]
    fn concave_quads_are_split_at_the_reflex_corner() {
        let arrow = [vec3(0.0, 0.0, 0.0), vec3(2.0, -1.0, 0.0), vec3(0.5, 0.0, 0.0), vec3(2.0, 1.0, 0.0)];
        for shift in 0..4 {
            let mut corners = arrow;
            corners.rotate_left(shift);
            assert_tiles(&corners, Vec3::Z, 0.5);
            corners.reverse();
            assert_tiles(&corners, -Vec3::Z, 0.5);
        }
    }

    #[test]
    fn comb_and_collinear_corners_tile() {
        // A comb with ten teeth, with an extra vertex in the middle of its back.
        let mut comb = vec![vec3(20.0, 3.0, -1.0), vec3(10.0, 3.0, -1.0), vec3(0.0, 3.0, -1.0)];
        for tooth in 0..10 {
            let x = tooth as f32 * 2.0;
            comb.extend([vec3(x, 0.0, -1.0), vec3(x + 1.0, 0.0, -1.0)]);
            comb.extend([vec3(x + 1.0, 2.0, -1.0), vec3(x + 2.0, 2.0, -1.0)]);
        }
        assert_tiles(&comb, Vec3::Z, 20.0 + 10.0 * 2.0);
    }

    #[test]
    fn pentagram_is_reported_and_still_filled() {
        let star: Vec<Vec3> = (0..5)
            .map(|i| (i as f32 * 2.0 * std::f32::consts::TAU / 5.0).sin_cos())
            .map(|(s, c)| vec3(c, s, 0.0))
            .collect();
        let (triangles, _) = triangulate(&star);
        assert_eq!(triangles.len(), 3);
    }

    #[test]
    fn a_huge_spiky_polygon_takes_bounded_time() {
        let start = std::time::Instant::now();
        let spikes: Vec<Vec3> = (0..20_000)
            .map(|i| {
                let angle = i as f32 * std::f32::consts::TAU / 20_000.0;
                let radius = if i % 2 == 0 { 1.0 } else { 0.2 };
                vec3(angle.cos() * radius, angle.sin() * radius, 0.0)
            })
            .collect();
        let (triangles, clean) = triangulate(&spikes);
        assert_eq!((triangles.len(), clean), (spikes.len() - 2, true));
        assert!(start.elapsed().as_secs() < 10);
    }

    proptest! {
        #[test]
        fn star_shaped_polygons_tile(radii in prop::collection::vec(0.2f32..1.0, 5..40), axis in 0usize..3) {
            let count = radii.len() as f32;
            let corners: Vec<Vec3> = radii.iter().enumerate().map(|(i, r)| {
                let (s, c) = (i as f32 * std::f32::consts::TAU / count).sin_cos();
                let mut corner = [0.0; 3];
                corner[(axis + 1) % 3] = c * r;
                corner[(axis + 2) % 3] = s * r;
                Vec3::from(corner)
            }).collect();
            let mut normal = Vec3::ZERO;
            normal[axis] = 1.0;
            let area: f32 = (0..corners.len())
                .map(|i| corners[i].cross(corners[(i + 1) % corners.len()]).dot(normal) * 0.5).sum();
            assert_tiles(&corners, normal, area);
        }

        #[test]
        fn anything_gives_n_minus_two_triangles(values in prop::collection::vec(prop::num::f32::ANY, 0..90)) {
            let corners: Vec<Vec3> = values.as_chunks::<3>().0.iter().map(|v| Vec3::from(*v)).collect();
            let (triangles, _) = triangulate(&corners);
            prop_assert_eq!(triangles.len(), corners.len().saturating_sub(2));
            prop_assert!(triangles.iter().flatten().all(|i| (*i as usize) < corners.len()));
        }
    }
}
