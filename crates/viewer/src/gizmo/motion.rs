//! From the pointer's way to the motion of what is dragged.

use super::{Frame, Handle, Lens, Tool};
use egui::Pos2;
use glam::{Affine3A, Mat3, Quat, Vec3};
use std::f32::consts::{PI, TAU};

/// Angles snap to multiples of this, degrees.
pub const ANGLE_STEP: f32 = 15.0;
/// Factors snap to multiples of this.
pub const SCALE_STEP: f32 = 0.1;
/// Nothing is made smaller than this in one drag: a size of zero has no inverse.
const SMALLEST: f32 = 1e-3;
/// Dragging the centre so far (points) doubles the size.
const DOUBLES: f32 = 100.0;

/// What a drag has come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Metres, world space.
    Move(Vec3),
    /// Radians about a unit axis, counter-clockwise as seen from its tip.
    Rotate(Vec3, f32),
    /// Factors along the gizmo's axes.
    Scale(Vec3),
}

/// A drag of a handle.
#[derive(Clone, Debug)]
pub struct Drag {
    /// What is dragged.
    pub handle: Handle,
    tool: Tool,
    frame: Frame,
    /// As it was when the drag began: what is dragged does not change how it is dragged.
    lens: Lens,
    start: Pos2,
    /// The angle of the last frame, and all that was turned, radians.
    angle: Option<f32>,
    turned: f32,
    /// What the pointer has come to.
    value: Motion,
}

/// What changes a drag.
#[derive(Clone, Copy, Debug, Default)]
pub struct Constraint {
    /// Snap, to multiples of this length (metres), [`ANGLE_STEP`] and [`SCALE_STEP`].
    pub snap: Option<f32>,
    /// The number that was typed: metres, degrees or a factor.
    pub typed: Option<f32>,
}

impl Drag {
    /// Begins at a point of the window.
    pub fn new(tool: Tool, handle: Handle, frame: Frame, lens: Lens, start: Pos2) -> Self {
        let value = match tool {
            Tool::Rotate => Motion::Rotate(frame.axis(handle, &lens), 0.0),
            Tool::Scale => Motion::Scale(Vec3::ONE),
            Tool::Select | Tool::Move => Motion::Move(Vec3::ZERO),
        };
        let mut drag = Self { handle, tool, frame, lens, start, angle: None, turned: 0.0, value };
        drag.angle = drag.angle_at(start);
        drag
    }

    /// Where it is now.
    pub fn follow(&mut self, pointer: Pos2) {
        self.value = match self.tool {
            Tool::Rotate => self.turn(pointer),
            Tool::Scale => Motion::Scale(self.factors(pointer)),
            Tool::Select | Tool::Move => self.moved(pointer).map_or(self.value, Motion::Move),
        };
    }

    /// What it has come to.
    pub fn motion(&self, constraint: &Constraint) -> Motion {
        let snapped =
            |v: f32, step: f32| if constraint.snap.is_some() { (v / step).round() * step } else { v };
        match self.value {
            Motion::Move(offset) => Motion::Move(match (constraint.typed, constraint.snap) {
                (Some(metres), _) => self.direction(offset) * metres,
                (None, Some(step)) => {
                    let along = |axis: Vec3| axis * snapped(offset.dot(axis), step);
                    self.frame.axes.into_iter().map(along).sum()
                }
                (None, None) => offset,
            }),
            Motion::Rotate(axis, angle) => {
                let degrees = snapped(angle.to_degrees(), ANGLE_STEP);
                Motion::Rotate(axis, constraint.typed.unwrap_or(degrees).to_radians())
            }
            Motion::Scale(factors) => {
                let used = self.scaled_axes();
                Motion::Scale(Vec3::from_array(std::array::from_fn(|i| match constraint.typed {
                    _ if !used[i] => 1.0,
                    Some(factor) if factor.abs() >= SMALLEST => factor,
                    Some(_) => SMALLEST,
                    None => snapped(factors[i], SCALE_STEP).max(SMALLEST),
                })))
            }
        }
    }

    /// The motion as a matrix, world to world.
    pub fn matrix(&self, motion: Motion) -> Affine3A {
        let about = |linear: Mat3| {
            let pivot = self.frame.pivot;
            Affine3A::from_translation(pivot)
                * Affine3A::from_mat3(linear)
                * Affine3A::from_translation(-pivot)
        };
        match motion {
            Motion::Move(offset) => Affine3A::from_translation(offset),
            Motion::Rotate(axis, angle) => about(Mat3::from_quat(Quat::from_axis_angle(axis, angle))),
            Motion::Scale(factors) => {
                let [x, y, z] = self.frame.axes;
                let axes = Mat3::from_cols(x, y, z);
                about(axes * Mat3::from_diagonal(factors) * axes.transpose())
            }
        }
    }

    /// The direction that a typed length goes in.
    fn direction(&self, offset: Vec3) -> Vec3 {
        match self.handle {
            Handle::Axis(i) => self.frame.axes[i],
            _ => offset.try_normalize().unwrap_or(self.frame.axes[0]),
        }
    }

    /// Which axes a handle scales.
    fn scaled_axes(&self) -> [bool; 3] {
        std::array::from_fn(|i| match self.handle {
            Handle::Axis(own) => own == i,
            Handle::Plane(across) => across != i,
            _ => true,
        })
    }

    /// Metres from where the drag began; `None` where the pointer is beyond the horizon.
    fn moved(&self, pointer: Pos2) -> Option<Vec3> {
        let pivot = self.frame.pivot;
        let [before, now] = [self.lens.ray(self.start)?, self.lens.ray(pointer)?];
        let axis = self.frame.axis(self.handle, &self.lens);
        if let Handle::Axis(_) = self.handle {
            return Some(axis * (now.nearest_on(pivot, axis)? - before.nearest_on(pivot, axis)?));
        }
        Some(now.meets_plane(pivot, axis)? - before.meets_plane(pivot, axis)?)
    }

    /// Adds what was turned since the last frame, so that a drag may go around several times.
    fn turn(&mut self, pointer: Pos2) -> Motion {
        if let (Some(before), Some(now)) = (self.angle, self.angle_at(pointer)) {
            self.turned += (now - before + PI).rem_euclid(TAU) - PI;
            self.angle = Some(now);
        }
        Motion::Rotate(self.frame.axis(self.handle, &self.lens), self.turned)
    }

    /// The angle at which a ring is held, radians.
    fn angle_at(&self, pointer: Pos2) -> Option<f32> {
        let pivot = self.frame.pivot;
        let axis = self.frame.axis(self.handle, &self.lens);
        let to_camera = self.lens.towards_camera(pivot);
        let facing = axis.dot(to_camera);
        if facing.abs() > 0.25 {
            let arm = self.lens.ray(pointer)?.meets_plane(pivot, axis)? - pivot;
            let side = axis.any_orthonormal_vector();
            return Some(arm.dot(axis.cross(side)).atan2(arm.dot(side)));
        }
        // Seen from the side, a ring is a line: it is pulled along that.
        let tangent = axis.cross(to_camera).try_normalize()?;
        let along = self.lens.ray(pointer)?.meets_plane(pivot, to_camera)? - pivot;
        let radius = self.lens.metres_per_point(pivot)? * super::handle::LENGTH;
        Some(along.dot(tangent) / radius)
    }

    fn factors(&self, pointer: Pos2) -> Vec3 {
        let factor = match self.handle {
            Handle::Axis(_) | Handle::Plane(_) => {
                let center = self.lens.project(self.frame.pivot).unwrap_or(self.start);
                let arm = self.start - center;
                (pointer - center).dot(arm) / arm.length_sq().max(1.0)
            }
            _ => {
                let way = pointer - self.start;
                ((way.x - way.y) / DOUBLES).exp2()
            }
        };
        let used = self.scaled_axes();
        Vec3::from_array(std::array::from_fn(|i| if used[i] { factor.max(SMALLEST) } else { 1.0 }))
    }
}

impl Motion {
    /// Whether nothing has moved.
    pub fn is_none(&self) -> bool {
        match self {
            Self::Move(offset) => *offset == Vec3::ZERO,
            Self::Rotate(_, angle) => *angle == 0.0,
            Self::Scale(factors) => *factors == Vec3::ONE,
        }
    }

    /// What people read.
    pub fn text(&self) -> String {
        let number = crate::numbers::fixed;
        match self {
            Self::Move(v) => format!("{}  {}  {} m", number(v.x, 3), number(v.y, 3), number(v.z, 3)),
            Self::Rotate(_, angle) => format!("{}°", number(angle.to_degrees(), 1)),
            Self::Scale(v) => format!("× {}  {}  {}", number(v.x, 3), number(v.y, 3), number(v.z, 3)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lens::tests::lens;
    use super::*;
    use egui::vec2;

    fn drag(tool: Tool, handle: Handle, way: egui::Vec2, grip: Option<Vec3>) -> Drag {
        let frame = Frame { pivot: Vec3::new(0.5, 0.0, 0.0), axes: [Vec3::X, Vec3::Y, Vec3::Z] };
        let start = lens().project(grip.unwrap_or(frame.pivot)).expect("seen");
        let mut drag = Drag::new(tool, handle, frame, lens(), start);
        // In pieces, as pointers move.
        (1..=20).for_each(|i| drag.follow(start + way * (i as f32 / 20.0)));
        drag
    }

    const FREE: Constraint = Constraint { snap: None, typed: None };

    #[test]
    fn what_is_moved_stays_under_the_pointer() {
        let way = vec2(37.0, -21.0);
        let Motion::Move(offset) = drag(Tool::Move, Handle::Center, way, None).motion(&FREE) else {
            panic!("a move")
        };
        let pivot = Vec3::new(0.5, 0.0, 0.0);
        let [before, after] = [pivot, pivot + offset].map(|p| lens().project(p).expect("seen"));
        assert!((after - before - way).length() < 0.1, "{offset}");
        let along = drag(Tool::Move, Handle::Axis(0), way, None);
        let Motion::Move(offset) = along.motion(&FREE) else { panic!("a move") };
        assert!(offset.x > 0.1 && offset.y == 0.0 && offset.z == 0.0, "{offset}");
        let snapped = along.motion(&Constraint { snap: Some(0.5), typed: None });
        assert_eq!(snapped, Motion::Move(Vec3::X * ((offset.x / 0.5).round() * 0.5)));
        let typed = along.motion(&Constraint { snap: None, typed: Some(-2.5) });
        assert_eq!(typed, Motion::Move(Vec3::X * -2.5));
    }

    #[test]
    fn rings_turn_about_the_pivot() {
        // From the right of the ring to its top: a quarter to the left.
        let frame_pivot = Vec3::new(0.5, 0.0, 0.0);
        let [right, top] = [Vec3::X, Vec3::Y].map(|side| lens().project(frame_pivot + side).expect("seen"));
        let drag = drag(Tool::Rotate, Handle::Ring(2), top - right, Some(frame_pivot + Vec3::X));
        let motion = drag.motion(&Constraint { snap: Some(1.0), typed: None });
        let Motion::Rotate(axis, angle) = motion else { panic!("a turn") };
        assert_eq!(axis, Vec3::Z);
        assert!((angle.to_degrees() - 90.0).abs() < 1e-3, "{angle}");
        let moved = drag.matrix(motion).transform_point3(frame_pivot + Vec3::X);
        assert!(moved.distance(frame_pivot + Vec3::Y) < 1e-4, "{moved}");
        let typed = drag.motion(&Constraint { snap: None, typed: Some(30.0) });
        assert_eq!(typed, Motion::Rotate(Vec3::Z, 30f32.to_radians()));
    }

    #[test]
    fn scales_keep_the_pivot_and_never_reach_zero() {
        let double = drag(Tool::Scale, Handle::Center, vec2(100.0, 0.0), None);
        let motion = double.motion(&FREE);
        let Motion::Scale(factors) = motion else { panic!("a scale") };
        assert!(factors.distance(Vec3::splat(2.0)) < 1e-4, "{factors}");
        let pivot = Vec3::new(0.5, 0.0, 0.0);
        assert!(double.matrix(motion).transform_point3(pivot).distance(pivot) < 1e-6);
        let moved = double.matrix(motion).transform_point3(pivot + Vec3::Y);
        assert!(moved.distance(pivot + Vec3::Y * 2.0) < 1e-4);
        let through = drag(Tool::Scale, Handle::Axis(0), vec2(-900.0, 0.0), Some(pivot + Vec3::X));
        let Motion::Scale(factors) = through.motion(&Constraint { snap: Some(1.0), typed: None }) else {
            panic!("a scale")
        };
        assert_eq!(factors, Vec3::new(SMALLEST, 1.0, 1.0));
    }
}
