//! What moves while the shutter is open.

use super::*;
use optics::motion::{AffineRows, MotionSegment, motion_at};
use optics::moving_camera::CameraSegment;
use optics::shutter::Shutter;
use optics::vec4f;

/// A segment that goes some metres, turns by up to half a turn and stretches by up to two.
pub fn motion_segment(i: &mut Inputs) -> MotionSegment {
    let angle = i.edge(&[0.0, 1.0]).unwrap_or_else(|| i.between(0.0, 1.5));
    let axis = direction(i);
    MotionSegment {
        translation: vec4f(i.between(-5.0, 5.0), i.between(-5.0, 5.0), i.between(-5.0, 5.0), angle),
        translation_step: vec4f(i.between(-2.0, 2.0), i.between(-2.0, 2.0), i.between(-2.0, 2.0), 0.0),
        // At right angles to each other: from rest, about an axis.
        rotation: vec4f(0.0, 0.0, 0.0, 1.0),
        rotation_step: vec4f(axis.x, axis.y, axis.z, 0.0),
        stretch: vec4f(i.between(0.7, 1.4), i.between(0.7, 1.4), i.between(0.7, 1.4), 0.0),
        stretch_step: vec4f(i.between(0.0, 0.5), i.between(0.0, 0.5), i.between(0.0, 0.5), 0.0),
        shear: vec4f(i.between(-0.1, 0.1), i.between(-0.1, 0.1), i.between(-0.1, 0.1), 0.0),
        shear_step: vec4f(i.between(-0.1, 0.1), i.between(-0.1, 0.1), i.between(-0.1, 0.1), 0.0),
    }
}

/// A transform that has an inverse.
pub fn affine(i: &mut Inputs) -> AffineRows {
    motion_at(motion_segment(i), share(i))
}

pub fn camera_segment(i: &mut Inputs) -> CameraSegment {
    CameraSegment {
        place: motion_segment(i),
        film: vec4f(i.between(0.2, 2.0), i.between(0.2, 2.0), i.between(-0.2, 0.2), i.between(-0.2, 0.2)),
        film_step: vec4f(i.between(0.0, 0.5), i.between(0.0, 0.5), i.between(-0.1, 0.1), 0.0),
        lens: vec4f(i.between(0.0, 0.2), i.between(0.5, 9.0), 0.0, 0.0),
        lens_step: vec4f(i.between(0.0, 0.1), i.between(0.0, 1.0), 0.0, 0.0),
    }
}

/// The share of the time in which a shutter opens, or closes.
pub fn edge_of_shutter(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 0.5]).unwrap_or_else(|| i.between(0.0, 0.5))
}

pub fn shutter(i: &mut Inputs) -> Shutter {
    Shutter {
        open: i.between(-1.0, 1.0),
        duration: i.between(0.0, 1.0),
        rise: edge_of_shutter(i),
        fall: edge_of_shutter(i),
        row_delay: i.between(0.0, 0.5),
        column_delay: i.between(0.0, 0.5),
    }
}

/// Columns and rows.
pub fn film_size(i: &mut Inputs) -> Vec2f {
    vec2f(1.0 + i.below(2000) as f32, 1.0 + i.below(2000) as f32)
}
