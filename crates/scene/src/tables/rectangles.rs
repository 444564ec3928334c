//! Which triangles that shine are halves of a rectangle, and so one lamp.
//!
//! Both halves are right-angled, and share their longest edge. So a triangle can be the half of one rectangle only, and is found by
//! that edge.

use super::light::Rectangle;
use super::{GeometryRecord, SceneTables};
use glam::{Affine3A, Vec3, Vec3A};
use std::collections::HashMap;

/// How much rectangles may differ from right angles and planes, as a share of their edges: more than rounding makes of
/// coordinates, and so little that neither a picture nor the end of a shadow ray shows it.
const TOLERANCE: f32 = 1e-5;

/// What a triangle of a geometry is for light samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pairing {
    /// A lamp of its own.
    Alone,
    /// The first half of a rectangle.
    Rectangle(Rectangle),
    /// The second half of the rectangle whose first half is triangle so and so.
    HalfOf(u32),
}

/// A vertex of the tables by its bits: halves may have vertices of their own at the same places.
type Place = [u32; 3];

/// A triangle with a right angle.
struct Half {
    triangle: u32,
    /// Where the right angle is, and the edges from there to the next vertex and to the last, in world space.
    corner: Vec3,
    to_next: Vec3A,
    to_last: Vec3A,
    /// The longest edge, in the direction in which it runs around the front.
    edge: (Place, Place),
}

/// Pairs the triangles of a geometry that stands at `to_world`. In time that grows with their number.
pub(super) fn pair(tables: &SceneTables, geometry: &GeometryRecord, to_world: &Affine3A) -> Vec<Pairing> {
    let mut parts = vec![Pairing::Alone; geometry.primitive_count as usize];
    let mut waiting: HashMap<(Place, Place), Half> = HashMap::new();
    let halves = (0..geometry.primitive_count).filter_map(|i| Half::new(tables, geometry, i, to_world));
    for half in halves {
        // The other half has the same front, so their common edge runs the other way.
        let (begin, end) = half.edge;
        match waiting.get(&(end, begin)).and_then(|first| Some((first.triangle, first.with(&half)?))) {
            Some((first, rectangle)) => {
                parts[first as usize] = Pairing::Rectangle(rectangle);
                parts[half.triangle as usize] = Pairing::HalfOf(first);
                waiting.remove(&(end, begin));
            }
            None => {
                waiting.insert(half.edge, half);
            }
        }
    }
    parts
}

impl Half {
    /// Triangle `i` of a geometry, if it has a right angle in world space.
    fn new(tables: &SceneTables, geometry: &GeometryRecord, i: u32, to_world: &Affine3A) -> Option<Self> {
        let indices = tables.indices[(geometry.first_primitive + i) as usize];
        let mirrors = to_world.matrix3.determinant() < 0.0;
        let order = if mirrors { [0, 2, 1] } else { [0, 1, 2] };
        let vertices =
            order.map(|k| Vec3::from(tables.positions[(geometry.first_vertex + indices[k]) as usize]));
        // Edges first: far from the origin, positions in world space have fewer digits.
        let edge =
            |from: usize, to: usize| to_world.transform_vector3a(Vec3A::from(vertices[to] - vertices[from]));
        let lengths = [edge(1, 2), edge(2, 0), edge(0, 1)].map(Vec3A::length_squared);
        let corner = (0..3).max_by(|&a, &b| lengths[a].total_cmp(&lengths[b]))?;
        let (next, last) = ((corner + 1) % 3, (corner + 2) % 3);
        let (to_next, to_last) = (edge(corner, next), edge(corner, last));
        let legs = to_next.length() * to_last.length();
        let right = to_next.dot(to_last).abs() <= TOLERANCE * legs;
        // `+ 0.0`: zero may have a sign.
        let place = |k: usize| vertices[k].to_array().map(|c| (c + 0.0).to_bits());
        (right && legs > 0.0 && legs.is_finite()).then(|| Self {
            triangle: i,
            corner: to_world.transform_point3(vertices[corner]),
            to_next,
            to_last,
            edge: (place(next), place(last)),
        })
    }

    /// The rectangle of this half and another one at the same edge, if they are one.
    fn with(&self, other: &Self) -> Option<Rectangle> {
        let diagonal = (self.to_last - self.to_next).length();
        // Around the other half runs the other way: opposite edges of a rectangle are alike.
        let (along, across) = (self.to_next + other.to_next, self.to_last + other.to_last);
        let alike = along.length().max(across.length()) <= TOLERANCE * diagonal;
        alike.then(|| {
            let (first, next, last) = (self.corner, Vec3::from(self.to_next), Vec3::from(self.to_last));
            if next.length_squared() >= last.length_squared() {
                Rectangle { first, edge1: next, edge2: last }
            } else {
                // A quarter turn on, the edges change places and the front stays.
                Rectangle { first: first + next, edge1: last, edge2: -next }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{GeometryKind, NONE};

    const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    /// What triangles of vertices `positions` are at `to_world`.
    fn parts(positions: &[[f32; 3]], triangles: &[[u32; 3]], to_world: Affine3A) -> Vec<Pairing> {
        let tables = SceneTables {
            positions: positions.to_vec(),
            indices: triangles.to_vec(),
            ..SceneTables::default()
        };
        let geometry = GeometryRecord {
            kind: GeometryKind::Triangles,
            first_primitive: 0,
            primitive_count: triangles.len() as u32,
            first_in_blas: 0,
            first_vertex: 0,
            vertex_count: positions.len() as u32,
            first_normal: NONE,
            first_tangent: NONE,
            first_uv0: NONE,
            first_uv1: NONE,
            first_color: NONE,
        };
        pair(&tables, &geometry, &to_world)
    }

    /// The rectangle of two triangles, whose corners must be `corners` and whose front must be theirs.
    fn expect_rectangle(positions: &[[f32; 3]], triangles: [[u32; 3]; 2], to_world: Affine3A) {
        let found = parts(positions, &triangles, to_world);
        let [Pairing::Rectangle(r), Pairing::HalfOf(0)] = found[..] else {
            panic!("{triangles:?} are {found:?}");
        };
        assert!(r.edge1.length() >= r.edge2.length() && r.edge1.dot(r.edge2).abs() < 1e-4, "{r:?}");
        let corners = [r.first, r.first + r.edge1, r.first + r.edge1 + r.edge2, r.first + r.edge2];
        let world = |p: &[f32; 3]| to_world.transform_point3(Vec3::from(*p));
        for p in positions.iter().map(world) {
            assert!(corners.iter().any(|c| c.distance(p) < 1e-4), "{p} is no corner of {r:?}");
        }
        let [a, b, c] = triangles[0].map(|i| world(&positions[i as usize]));
        let side = to_world.matrix3.determinant().signum();
        let front = (b - a).cross(c - a) * side;
        assert!(r.edge1.cross(r.edge2).dot(front) > 0.0, "{r:?} shines to the back");
        let area = (b - a).cross(c - a).length();
        assert!((r.edge1.cross(r.edge2).length() / area - 1.0).abs() < 1e-4, "{r:?}");
    }

    /// Every diagonal, every first vertex of both triangles, either half first.
    #[test]
    fn two_triangles_in_any_order_are_a_rectangle() {
        let rotated = |t: [u32; 3], by: usize| [t[by % 3], t[(by + 1) % 3], t[(by + 2) % 3]];
        for [a, b] in [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]] {
            for turn in 0..9 {
                let (a, b) = (rotated(a, turn % 3), rotated(b, turn / 3));
                expect_rectangle(&SQUARE, [a, b], Affine3A::IDENTITY);
                expect_rectangle(&SQUARE, [b, a], Affine3A::IDENTITY);
            }
        }
    }

    #[test]
    fn rectangles_are_found_wherever_they_stand() {
        let halves = [[0, 1, 2], [0, 2, 3]];
        let turned = Affine3A::from_rotation_translation(
            glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -2.0),
            Vec3::new(5.0, -3.0, 100.0),
        );
        expect_rectangle(&SQUARE, halves, turned);
        // A mirrored instance has its front on the other side of its vertices' order.
        expect_rectangle(&SQUARE, halves, turned * Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
        expect_rectangle(&SQUARE, halves, Affine3A::from_scale(Vec3::new(1.0, 7.0, 3.0)));
        // Far away, where coordinates have few digits.
        expect_rectangle(&SQUARE, halves, Affine3A::from_translation(Vec3::splat(3.0)) * turned);
    }

    #[test]
    fn halves_with_vertices_of_their_own_are_a_rectangle() {
        let [a, b, c, d] = SQUARE;
        let minus_zero = [-0.0, -0.0, 0.0];
        expect_rectangle(&[a, b, c, minus_zero, c, d], [[0, 1, 2], [3, 4, 5]], Affine3A::IDENTITY);
    }

    #[test]
    fn what_is_no_rectangle_stays_triangles() {
        let halves = [[0, 1, 2], [0, 2, 3]];
        let alone = [Pairing::Alone; 2];
        let square = |change: fn(&mut [[f32; 3]; 4])| {
            let mut corners = SQUARE;
            change(&mut corners);
            parts(&corners, &halves, Affine3A::IDENTITY)
        };
        assert_eq!(square(|c| (c[2][0], c[3][0]) = (3.0, 1.0)), alone, "a parallelogram");
        assert_eq!(square(|c| c[2][0] = 2.5), alone, "a trapezium");
        assert_eq!(square(|c| c[3][2] = 0.01), alone, "a fold");
        assert_eq!(square(|c| c[2][1] = 1.001), alone, "three corners");
        assert_eq!(square(|c| (c[2], c[3]) = (c[1], c[0])), alone, "no area");
        assert_eq!(square(|c| c[1][0] = f32::NAN), alone, "no number");
        assert_eq!(parts(&SQUARE, &[[0, 1, 2], [0, 3, 2]], Affine3A::IDENTITY), alone, "two fronts");
        // A kite of right angles has the edge in common, too.
        let kite = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.6, 0.8, 0.0], [1.6, -0.8, 0.0]];
        assert_eq!(parts(&kite, &[[0, 1, 2], [0, 3, 1]], Affine3A::IDENTITY), alone, "a kite");
        // Scaled along an axis that is not one of its own, a square turned by an eighth is a rhombus.
        let turned = Affine3A::from_scale(Vec3::new(1.0, 2.0, 1.0)) * Affine3A::from_rotation_z(0.7);
        assert_eq!(parts(&SQUARE, &halves, turned), alone, "a skewed instance");
        let flat = Affine3A::from_scale(Vec3::new(0.0, 1.0, 1.0));
        assert_eq!(parts(&SQUARE, &halves, flat), alone, "an instance without extent");
    }

    /// Two quads side by side, one above the other at the same place, and a triangle that is left over.
    #[test]
    fn quads_that_share_vertices_are_rectangles_each() {
        let mut corners = SQUARE.to_vec();
        corners.extend([[4.0, 0.0, 0.0], [4.0, 1.0, 0.0], [4.0, 3.0, 0.0]]);
        let triangles = [[0, 1, 2], [1, 4, 5], [0, 2, 3], [5, 2, 1], [2, 5, 6]];
        let found = parts(&corners, &triangles, Affine3A::IDENTITY);
        assert!(matches!(found[0], Pairing::Rectangle(r) if r.edge1.length() == 2.0), "{found:?}");
        assert!(matches!(found[1], Pairing::Rectangle(_)), "{found:?}");
        assert_eq!(found[2..], [Pairing::HalfOf(0), Pairing::HalfOf(1), Pairing::Alone]);
        // Front and back of a sheet: four triangles at one edge.
        let sheet = [[0, 1, 2], [0, 2, 1], [0, 2, 3], [0, 3, 2]];
        let found = parts(&SQUARE, &sheet, Affine3A::IDENTITY);
        let [Pairing::Rectangle(front), Pairing::Rectangle(back), Pairing::HalfOf(0), Pairing::HalfOf(1)] =
            found[..]
        else {
            panic!("{found:?}");
        };
        assert!(front.edge1.cross(front.edge2).dot(back.edge1.cross(back.edge2)) < 0.0);
    }

    /// As many triangles as there are at one edge: time must not grow with their square.
    #[test]
    fn many_triangles_at_one_edge_take_no_time() {
        let triangles = vec![[0, 1, 2]; 200_000];
        let begin = std::time::Instant::now();
        assert_eq!(parts(&SQUARE, &triangles, Affine3A::IDENTITY), vec![Pairing::Alone; 200_000]);
        assert!(begin.elapsed().as_secs() < 10, "{:?}", begin.elapsed());
    }
}
