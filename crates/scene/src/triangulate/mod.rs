//! Polygons to triangles.
//!
//! Polygons that do not cross themselves are filled exactly, by a sweep (`sweep`, `piece`); those that do are filled in
//! some way by cutting off ears (`ears`). The code is our own because a mesh needs what the crates for maps and pictures
//! do not give: every corner is kept, those on straight edges too (leaving them out opens cracks to the neighbouring
//! polygon), none is added, none is moved, triangles keep the polygon's winding in space, and the time is bounded for any
//! input.

mod ears;
mod piece;
mod sweep;

use glam::{DVec2, DVec3, Vec3};
use sweep::orientation;

/// Triangulates polygons, keeping its buffers between them.
#[derive(Default)]
pub struct Triangulator {
    /// The corners in the plane, turning left.
    points: Vec<DVec2>,
    ears: ears::Ears,
}

impl Triangulator {
    /// Appends the triangles of the polygon `corners` to `triangles`, as indices into `corners`, in the polygon's
    /// winding order. Takes O(n log n).
    ///
    /// The polygon may be concave, have corners on its straight edges, touch itself and have holes that slits join to the
    /// outline; it should be about planar and must not cross itself. A polygon of `n ≥ 3` corners in different places
    /// becomes `n − 2` triangles; fewer corners become none. Returns whether all went well: `false` means that the
    /// outline crosses itself or has no area, and that the triangles fill it in some way only.
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
        if count == 4 {
            return self.quadrilateral(triangles);
        }
        let turn = |i: u32| self.turn([(i + count - 1) % count, i, (i + 1) % count]);
        if (0..count).all(|i| turn(i) > 0.0) && self.winds_once() {
            fan(triangles);
            return true;
        }
        let first = triangles.len();
        match sweep::polygon(&self.points, triangles) {
            // Outlines that pass through themselves in a corner have more pieces than the sweep expects.
            Ok(clean) if triangles.len() - first <= corners.len() - 2 => clean,
            Ok(_) | Err(sweep::Crossing) => {
                triangles.truncate(first);
                self.ears.clip(&self.points, triangles);
                false
            }
        }
    }

    /// Two triangles. The diagonal must start at the reflex corner, if there is one.
    fn quadrilateral(&self, triangles: &mut Vec<[u32; 3]>) -> bool {
        let is_reflex = |i: u32| self.turn([(i + 3) % 4, i, (i + 1) % 4]) < 0.0;
        let split =
            if is_reflex(1) || is_reflex(3) { [[1, 2, 3], [1, 3, 0]] } else { [[0, 1, 2], [0, 2, 3]] };
        triangles.extend(split);
        split.iter().all(|triangle| self.turn(*triangle) >= 0.0)
    }

    /// Drops the axis along which the polygon is thinnest, so that it turns left in the plane. Returns `false` if it
    /// has no area or is not finite.
    fn project(&mut self, corners: &[Vec3]) -> bool {
        let mut normal = DVec3::ZERO; // Newell's method; twice the area
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
    fn turn(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|i| self.points[i as usize]);
        orientation(a, b, c)
    }

    /// Whether an outline that only turns left goes round once and not several times, as a pentagram does.
    fn winds_once(&self) -> bool {
        let count = self.points.len();
        let up = |i: usize| self.points[(i + 1) % count].y > self.points[i].y;
        (0..count).filter(|i| up(*i) != up((i + 1) % count)).count() <= 2
    }
}

#[cfg(test)]
mod tests;
