//! The handles of a gizmo: what each does, its shape in the window, and which one the pointer is on.

use super::{Lens, Tool};
use egui::{Pos2, Vec2};
use glam::Vec3;

/// How long the axes are, points.
pub const LENGTH: f32 = 88.0;
/// The square that moves in two directions, in shares of the axes.
const PLANE: [f32; 2] = [0.34, 0.56];
/// The radius of the ring that turns about the line of sight, in shares of the axes.
const VIEW_RING: f32 = 1.2;
/// How near (points) the pointer has to be.
const REACH: f32 = 8.0;
/// Axes that are seen shorter than this (points) have no handle: nobody could tell where they point.
const SHORTEST: f32 = 16.0;
/// Pieces of a ring.
const PIECES: usize = 64;

/// Something that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Handle {
    /// Along axis 0, 1 or 2.
    Axis(usize),
    /// Across axis 0, 1 or 2: in the directions of the other two.
    Plane(usize),
    /// Around axis 0, 1 or 2.
    Ring(usize),
    /// Around the line of sight.
    ViewRing,
    /// In all directions at once: across the line of sight, or larger and smaller.
    Center,
}

/// Where a gizmo stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Its centre in the world, metres.
    pub pivot: Vec3,
    /// Its axes, of unit length and at right angles.
    pub axes: [Vec3; 3],
}

/// A handle as it is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Which handle.
    pub handle: Handle,
    /// Its lines in the window. The area of a plane is what they surround.
    pub points: Vec<Pos2>,
    /// Where to take hold of it.
    pub grip: Pos2,
}

impl Frame {
    /// Unit axis that a handle is about or along; that of the view ring points to the camera.
    pub fn axis(&self, handle: Handle, lens: &Lens) -> Vec3 {
        match handle {
            Handle::Axis(i) | Handle::Plane(i) | Handle::Ring(i) => self.axes[i],
            Handle::ViewRing | Handle::Center => lens.towards_camera(self.pivot),
        }
    }

    /// The handles of a tool as they are seen; none where the gizmo is out of sight.
    pub fn shapes(&self, tool: Tool, lens: &Lens) -> Vec<Shape> {
        let Some(length) = lens.metres_per_point(self.pivot).map(|metres| metres * LENGTH) else {
            return Vec::new();
        };
        let handles: &[Handle] = match tool {
            Tool::Select => &[],
            Tool::Move | Tool::Scale => &[
                Handle::Center,
                Handle::Plane(0),
                Handle::Plane(1),
                Handle::Plane(2),
                Handle::Axis(0),
                Handle::Axis(1),
                Handle::Axis(2),
            ],
            Tool::Rotate => &[Handle::Ring(0), Handle::Ring(1), Handle::Ring(2), Handle::ViewRing],
        };
        handles.iter().filter_map(|handle| self.shape(*handle, length, lens)).collect()
    }

    fn shape(&self, handle: Handle, length: f32, lens: &Lens) -> Option<Shape> {
        let at = |offset: Vec3| lens.project(self.pivot + offset * length);
        let center = at(Vec3::ZERO)?;
        let (points, grip) = match handle {
            Handle::Center => (vec![center], center),
            Handle::Axis(i) => {
                let end = at(self.axes[i])?;
                let is_seen = (end - center).length() >= SHORTEST;
                is_seen.then_some((vec![center + (end - center) * 0.14, end], end))?
            }
            Handle::Plane(i) => {
                let (a, b) = (self.axes[(i + 1) % 3], self.axes[(i + 2) % 3]);
                let [near, far] = PLANE;
                let corners = [(near, near), (far, near), (far, far), (near, far)];
                let points: Option<Vec<_>> = corners.into_iter().map(|(u, v)| at(a * u + b * v)).collect();
                let points = points?;
                // Seen edge-on, a square is a line.
                let is_seen = area(&points) > 30.0;
                let middle = points[0] + (points[2] - points[0]) * 0.5;
                is_seen.then_some((points, middle))?
            }
            Handle::Ring(_) | Handle::ViewRing => {
                let axis = self.axis(handle, lens);
                let radius = if handle == Handle::ViewRing { VIEW_RING } else { 1.0 };
                let points = ring(axis, self.front(axis, handle, lens)).map(|offset| at(offset * radius));
                let points: Vec<_> = points.collect::<Option<_>>()?;
                // Not where rings meet.
                let grip = points[PIECES / 2 + PIECES / 8];
                (points, grip)
            }
        };
        Some(Shape { handle, points, grip })
    }

    /// The middle of a ring's front half, and how much of the ring is seen: turns.
    fn front(&self, axis: Vec3, handle: Handle, lens: &Lens) -> (Vec3, f32) {
        let side = axis.any_orthonormal_vector();
        if handle == Handle::ViewRing {
            return (side, 1.0);
        }
        let to_camera = lens.towards_camera(self.pivot);
        let across = to_camera - axis * to_camera.dot(axis);
        // Seen from straight above, a ring has no back.
        let share = if across.length() < 0.2 { 1.0 } else { 0.5 };
        (across.try_normalize().unwrap_or(side), share)
    }
}

/// Points of a unit circle about `axis`, around the direction `middle`.
fn ring(axis: Vec3, (middle, turns): (Vec3, f32)) -> impl Iterator<Item = Vec3> {
    let side = axis.cross(middle);
    (0..=PIECES).map(move |i| {
        let angle = (i as f32 / PIECES as f32 - 0.5) * std::f32::consts::TAU * turns;
        middle * angle.cos() + side * angle.sin()
    })
}

/// The handle that the pointer is on.
pub fn nearest(shapes: &[Shape], pointer: Pos2) -> Option<Handle> {
    let near = shapes.iter().filter_map(|shape| {
        let distance = match shape.handle {
            Handle::Center => (pointer - shape.grip).length() - 3.0,
            Handle::Plane(_) if contains(&shape.points, pointer) => 0.0,
            Handle::Plane(_) => return None,
            _ => path_distance(&shape.points, pointer),
        };
        (distance <= REACH).then_some((shape.handle, distance))
    });
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(handle, _)| handle)
}

/// Distance from a path of lines.
fn path_distance(points: &[Pos2], at: Pos2) -> f32 {
    let distance = |pair: &[Pos2]| {
        let (along, offset) = (pair[1] - pair[0], at - pair[0]);
        let share = (offset.dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
        (offset - along * share).length()
    };
    points.windows(2).map(distance).fold(f32::INFINITY, f32::min)
}

fn cross(a: Vec2, b: Vec2) -> f32 {
    a.x * b.y - a.y * b.x
}

/// The area that corners surround, square points.
fn area(corners: &[Pos2]) -> f32 {
    let next = corners.iter().cycle().skip(1);
    let twice: f32 = corners.iter().zip(next).map(|(a, b)| cross(a.to_vec2(), b.to_vec2())).sum();
    twice.abs() * 0.5
}

/// Whether a point is within a convex polygon.
fn contains(corners: &[Pos2], at: Pos2) -> bool {
    let next = corners.iter().cycle().skip(1);
    let sides = corners.iter().zip(next).map(|(a, b)| cross(*b - *a, at - *a));
    let (mut left, mut right) = (false, false);
    sides.for_each(|side| (left, right) = (left || side > 0.0, right || side < 0.0));
    !(left && right)
}

#[cfg(test)]
mod tests {
    use super::super::lens::tests::lens;
    use super::*;

    const FRAME: Frame = Frame { pivot: Vec3::ZERO, axes: [Vec3::X, Vec3::Y, Vec3::Z] };

    #[test]
    fn what_points_to_the_camera_has_no_handle() {
        let handles = |tool| FRAME.shapes(tool, &lens()).iter().map(|s| s.handle).collect::<Vec<_>>();
        // Along the line of sight nobody can drag, and squares that are seen edge-on are lines.
        let moves = [Handle::Center, Handle::Plane(2), Handle::Axis(0), Handle::Axis(1)];
        assert_eq!(handles(Tool::Move), moves);
        assert_eq!(handles(Tool::Rotate).len(), 4);
        assert!(handles(Tool::Select).is_empty());
        let behind = Frame { pivot: Vec3::new(0.0, 0.0, 30.0), ..FRAME };
        assert!(behind.shapes(Tool::Move, &lens()).is_empty());
    }

    #[test]
    fn handles_are_found_where_they_are_seen() {
        for tool in [Tool::Move, Tool::Rotate, Tool::Scale] {
            let shapes = FRAME.shapes(tool, &lens());
            for shape in shapes.iter().filter(|s| !matches!(s.handle, Handle::Ring(0 | 1))) {
                assert_eq!(nearest(&shapes, shape.grip), Some(shape.handle), "{tool:?}");
            }
            let far = shapes[0].grip + Vec2::new(300.0, 300.0);
            assert_eq!(nearest(&shapes, far), None);
        }
    }

    #[test]
    fn axes_have_the_same_length_however_far_away_they_are() {
        for z in [8.0, 0.0, -100.0] {
            let frame = Frame { pivot: Vec3::new(0.0, 0.0, z), ..FRAME };
            let shapes = frame.shapes(Tool::Move, &lens());
            let (center, end) = (shapes[0].grip, shapes[2].grip);
            assert!(((end - center).length() / LENGTH - 1.0).abs() < 0.02, "{z}");
        }
    }
}
