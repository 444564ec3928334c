//! The compass in a corner of the picture: where the axes of the world point, and views along them.

use alhazen::Camera;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, vec2};
use glam::Vec3;

/// From the middle to its balls, points.
const RADIUS: f32 = 34.0;
/// Of a ball, points.
const BALL: f32 = 9.0;
/// Views along the vertical axis keep so much of what is up, as a share.
const TILT: f32 = 0.012;
const NAMES: [&str; 3] = ["X", "Y", "Z"];

/// The end of an axis of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Whether it is the positive end.
    pub is_positive: bool,
    /// Where it is in the window.
    pub at: Pos2,
    /// How far behind the compass's middle it is, from -1 (in front) to 1.
    depth: f32,
}

impl End {
    /// Unit direction in the world.
    pub fn direction(&self) -> Vec3 {
        let axis = [Vec3::X, Vec3::Y, Vec3::Z][self.axis];
        if self.is_positive { axis } else { -axis }
    }
}

/// The middle of the compass in a part of the window.
fn middle(room: Rect) -> Pos2 {
    room.right_top() + vec2(-RADIUS - 18.0, RADIUS + 40.0)
}

/// The ends of all axes as a camera sees them, those in front last.
pub fn ends(camera: &Camera, room: Rect) -> Vec<End> {
    let forward = (camera.target - camera.eye).normalize_or(Vec3::NEG_Z);
    let right = forward.cross(camera.up).try_normalize().unwrap_or(forward.any_orthonormal_vector());
    let up = right.cross(forward);
    let mut ends: Vec<End> = (0..6)
        .map(|i| {
            let end = End { axis: i / 2, is_positive: i % 2 == 0, at: Pos2::ZERO, depth: 0.0 };
            let direction = end.direction();
            let offset = vec2(direction.dot(right), -direction.dot(up)) * RADIUS;
            End { at: middle(room) + offset, depth: direction.dot(forward), ..end }
        })
        .collect();
    ends.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    ends
}

/// The end at a point of the window.
pub fn end_at(ends: &[End], at: Pos2) -> Option<End> {
    ends.iter().rev().find(|end| end.at.distance(at) <= BALL + 2.0).copied()
}

/// Looks at the camera's target from the end of an axis, from where it looks at it now.
pub fn look_from(camera: &mut Camera, end: &End) {
    let offset = camera.eye - camera.target;
    let up = camera.up.normalize_or(Vec3::Y);
    let mut direction = end.direction();
    if direction.cross(up).length() < TILT {
        // There is no "up" straight above: a little of where the camera is stays.
        let level = (offset - up * offset.dot(up)).try_normalize().unwrap_or(up.any_orthonormal_vector());
        direction = (direction + level * TILT).normalize();
    }
    camera.eye = camera.target + direction * offset.length().max(1e-5);
    camera.path = None;
}

/// Draws it.
pub fn paint(painter: &Painter, ends: &[End], room: Rect, hovered: Option<Pos2>, colours: [Color32; 3]) {
    let middle = middle(room);
    let is_near = hovered.is_some_and(|at| at.distance(middle) < RADIUS + BALL);
    let shade = if is_near { 120 } else { 60 };
    painter.circle_filled(middle, RADIUS + BALL + 3.0, Color32::from_black_alpha(shade));
    let hot = hovered.and_then(|at| end_at(ends, at));
    for end in ends {
        let colour = if hot == Some(*end) { Color32::WHITE } else { colours[end.axis] };
        // What is behind is darker.
        let colour = colour.gamma_multiply(0.75 - 0.25 * end.depth);
        if end.is_positive {
            painter.line_segment([middle, end.at], Stroke::new(2.0, colour));
            painter.circle_filled(end.at, BALL, colour);
            let font = FontId::proportional(12.0);
            painter.text(end.at, Align2::CENTER_CENTER, NAMES[end.axis], font, Color32::BLACK);
        } else {
            painter.circle(end.at, BALL - 2.0, Color32::from_black_alpha(150), Stroke::new(1.5, colour));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    const ROOM: Rect = Rect { min: pos2(0.0, 0.0), max: pos2(800.0, 600.0) };

    #[test]
    fn axes_are_where_the_camera_sees_them() {
        let camera = Camera::perspective("c", Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 1.0);
        let ends = ends(&camera, ROOM);
        let find = |axis: usize, is_positive: bool| {
            *ends.iter().find(|e| e.axis == axis && e.is_positive == is_positive).expect("all are there")
        };
        let middle = middle(ROOM);
        assert!(find(0, true).at.distance(middle + vec2(RADIUS, 0.0)) < 1e-3);
        assert!(find(1, true).at.distance(middle - vec2(0.0, RADIUS)) < 1e-3);
        assert_eq!(ends.last(), Some(&find(2, true)), "what points to the camera is in front");
        assert_eq!(end_at(&ends, middle), Some(find(2, true)));
        assert_eq!(end_at(&ends, pos2(0.0, 0.0)), None);
    }

    #[test]
    fn views_along_axes_keep_target_distance_and_up() {
        let before = Camera::perspective("c", Vec3::new(3.0, 4.0, 12.0), Vec3::new(1.0, 0.0, 0.0), 1.0);
        for end in ends(&before, ROOM) {
            let mut camera = before.clone();
            look_from(&mut camera, &end);
            let offset = camera.eye - camera.target;
            assert_eq!((camera.target, camera.up), (before.target, before.up));
            assert!((offset.length() - (before.eye - before.target).length()).abs() < 1e-3);
            assert!(offset.normalize().distance(end.direction()) < 0.02, "{end:?}");
            assert!(offset.cross(camera.up).length() > 1e-3, "there is no up: {end:?}");
        }
    }
}
