//! Cameras that move, turn and zoom while the shutter is open.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod moving_camera {
    use crate::camera::*;
    use crate::motion::*;
    use wgsl_rs::std::*;

    /// A camera between two keys.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct CameraSegment {
        /// From the camera's space (x to the right, y up, looking along −z) to the world.
        pub place: MotionSegment,
        /// At the beginning: half of the film's width and height, and the film's shift to the right
        /// and up, as [`CameraFrame`] has them.
        pub film: Vec4f,
        /// How far these go.
        pub film_step: Vec4f,
        /// At the beginning: the lens' radius and the distance in focus. zw: 0.
        pub lens: Vec4f,
        /// How far these go.
        pub lens_step: Vec4f,
    }

    /// The camera at `fraction` of a segment. `middle`: what does not change.
    pub fn camera_in_motion(middle: CameraFrame, s: CameraSegment, fraction: f32) -> CameraFrame {
        let m = motion_at(s.place, fraction);
        let film = s.film + s.film_step * fraction;
        let lens = s.lens + s.lens_step * fraction;
        let right = vec3f(m.x.x, m.y.x, m.z.x);
        let up = vec3f(m.x.y, m.y.y, m.z.y);
        let axis = vec3f(-m.x.z, -m.y.z, -m.z.z);
        CameraFrame {
            kind: middle.kind,
            origin: vec3f(m.x.w, m.y.w, m.z.w),
            right: right,
            up: up,
            forward: axis + right * film.z + up * film.w,
            half_size: vec2f(film.x, film.y),
            lens_radius: lens.x,
            focus_distance: lens.y,
            distortion: middle.distortion,
        }
    }
}

use crate::materials::record::wgsl_records;
use moving_camera::CameraSegment;

wgsl_records!(CameraSegment);
