//! Transforms that change while the shutter is open.
//!
//! A motion is a row of segments of equal duration. In each, a transform is decomposed into a
//! translation, a rotation and a stretch, M = T R S, and these are interpolated apart: the rotation
//! along its arc at constant speed, the others along straight lines. Time runs from 0, where the
//! motion begins, to 1, where it ends.
//!
//! Method: Shoemake and Duff, "Matrix Animation and Polar Decomposition", Graphics Interface 1992;
//! pbrt-v4, `AnimatedTransform`.

use crate::materials::record::wgsl_records;
use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod motion {
    use wgsl_rs::std::*;

    /// The middle of a motion: what is shown where nothing is blurred.
    pub const MOTION_MIDDLE: f32 = 0.5;

    /// Rows of a 3×4 matrix, which maps column vectors.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct AffineRows {
        /// First row.
        pub x: Vec4f,
        /// Second row.
        pub y: Vec4f,
        /// Third row.
        pub z: Vec4f,
    }

    /// A transform between two keys.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct MotionSegment {
        /// xyz: translation at the beginning, metres. w: half of the angle that the rotation turns
        /// by, radians.
        pub translation: Vec4f,
        /// xyz: how far the translation goes. w: 0.
        pub translation_step: Vec4f,
        /// Unit quaternion (x, y, z, w) at the beginning.
        pub rotation: Vec4f,
        /// Unit quaternion at right angles to it: where the rotation is after half a turn.
        pub rotation_step: Vec4f,
        /// xyz: diagonal of the symmetric stretch at the beginning. w: 0.
        pub stretch: Vec4f,
        /// xyz: how far the diagonal goes. w: 0.
        pub stretch_step: Vec4f,
        /// Elements xy, xz and yz of the stretch at the beginning. w: 0.
        pub shear: Vec4f,
        /// How far these go. w: 0.
        pub shear_step: Vec4f,
    }

    /// A moment as a segment, and how far it has gone there.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MotionPlace {
        /// Number of the segment.
        pub segment: u32,
        /// In `[0, 1]`.
        pub fraction: f32,
    }

    /// The segment at `time` in `[0, 1]`; `segments`: how many there are, at least 1.
    pub fn motion_place(time: f32, segments: u32) -> MotionPlace {
        let at = clamp(time, 0.0, 1.0) * f32(segments);
        let segment = min(u32(at), segments - 1u32);
        MotionPlace { segment: segment, fraction: at - f32(segment) }
    }

    /// The transform at `fraction` of a segment.
    pub fn motion_at(s: MotionSegment, fraction: f32) -> AffineRows {
        let angle = s.translation.w * fraction;
        let q = s.rotation * cos(angle) + s.rotation_step * sin(angle);
        let t = s.translation + s.translation_step * fraction;
        let d = s.stretch + s.stretch_step * fraction;
        let o = s.shear + s.shear_step * fraction;
        let first = vec3f(
            1.0 - 2.0 * (q.y * q.y + q.z * q.z),
            2.0 * (q.x * q.y - q.z * q.w),
            2.0 * (q.x * q.z + q.y * q.w),
        );
        let second = vec3f(
            2.0 * (q.x * q.y + q.z * q.w),
            1.0 - 2.0 * (q.x * q.x + q.z * q.z),
            2.0 * (q.y * q.z - q.x * q.w),
        );
        let third = vec3f(
            2.0 * (q.x * q.z - q.y * q.w),
            2.0 * (q.y * q.z + q.x * q.w),
            1.0 - 2.0 * (q.x * q.x + q.y * q.y),
        );
        // Rows and columns of a symmetric matrix are the same.
        let sx = vec3f(d.x, o.x, o.y);
        let sy = vec3f(o.x, d.y, o.z);
        let sz = vec3f(o.y, o.z, d.z);
        AffineRows {
            x: vec4f(dot(first, sx), dot(first, sy), dot(first, sz), t.x),
            y: vec4f(dot(second, sx), dot(second, sy), dot(second, sz), t.y),
            z: vec4f(dot(third, sx), dot(third, sy), dot(third, sz), t.z),
        }
    }

    /// A point through a transform.
    pub fn affine_point(m: AffineRows, p: Vec3f) -> Vec3f {
        let v = affine_vector(m, p);
        vec3f(v.x + m.x.w, v.y + m.y.w, v.z + m.z.w)
    }

    /// A vector through a transform, without its translation.
    pub fn affine_vector(m: AffineRows, v: Vec3f) -> Vec3f {
        vec3f(
            m.x.x * v.x + m.x.y * v.y + m.x.z * v.z,
            m.y.x * v.x + m.y.y * v.y + m.y.z * v.z,
            m.z.x * v.x + m.z.y * v.y + m.z.z * v.z,
        )
    }

    /// The transform that does `b`, then `a`.
    pub fn affine_product(a: AffineRows, b: AffineRows) -> AffineRows {
        let x = affine_vector(a, vec3f(b.x.x, b.y.x, b.z.x));
        let y = affine_vector(a, vec3f(b.x.y, b.y.y, b.z.y));
        let z = affine_vector(a, vec3f(b.x.z, b.y.z, b.z.z));
        let t = affine_point(a, vec3f(b.x.w, b.y.w, b.z.w));
        AffineRows {
            x: vec4f(x.x, y.x, z.x, t.x),
            y: vec4f(x.y, y.y, z.y, t.y),
            z: vec4f(x.z, y.z, z.z, t.z),
        }
    }

    /// The inverse of a transform; not numbers if it has none.
    pub fn affine_inverse(m: AffineRows) -> AffineRows {
        let a = vec3f(m.x.x, m.y.x, m.z.x);
        let b = vec3f(m.x.y, m.y.y, m.z.y);
        let c = vec3f(m.x.z, m.y.z, m.z.z);
        let t = vec3f(m.x.w, m.y.w, m.z.w);
        let first = cross(b, c);
        let over_determinant = 1.0 / dot(a, first);
        let x = first * over_determinant;
        let y = cross(c, a) * over_determinant;
        let z = cross(a, b) * over_determinant;
        AffineRows {
            x: vec4f(x.x, x.y, x.z, -dot(x, t)),
            y: vec4f(y.x, y.y, y.z, -dot(y, t)),
            z: vec4f(z.x, z.y, z.z, -dot(z, t)),
        }
    }
}

use motion::{AffineRows, MotionSegment};

wgsl_records!(AffineRows, MotionSegment);

/// The most pieces that a segment is cut into to be bounded.
const MOST_PIECES: u32 = 256;

/// How far a piece turns at most, radians: by more, the arc leaves the boxes at its ends too far.
const TURN_OF_A_PIECE: f32 = 0.1;

impl MotionSegment {
    /// Into how many pieces the segment is to be cut so that what moves is bounded by where it is
    /// at their ends, and how far it may be outside of those bounds nonetheless, metres.
    ///
    /// - `far`: the largest magnitude of a coordinate of what moves, in its own space, by axis.
    ///
    /// Between the ends of a piece, a point strays from the chord by at most h² / 8 times its
    /// acceleration, h the share of the segment that the piece takes. With a turn by ω in the
    /// segment, and S the stretch, the acceleration is at most ω² |S p| + 2 ω |ΔS p|.
    pub fn pieces(&self, far: [f32; 3]) -> (u32, f32) {
        let stretched = |d: [f32; 4], o: [f32; 4]| {
            let row = |a: f32, b: f32, c: f32| a.abs() * far[0] + b.abs() * far[1] + c.abs() * far[2];
            let [x, y, z] = [row(d[0], o[0], o[1]), row(o[0], d[1], o[2]), row(o[1], o[2], d[2])];
            (x * x + y * y + z * z).sqrt()
        };
        let growth = stretched(self.stretch_step.to_array(), self.shear_step.to_array());
        let reach = stretched(self.stretch.to_array(), self.shear.to_array()) + growth;
        let turn = 2.0 * self.translation.w.abs();
        let pieces = ((turn / TURN_OF_A_PIECE).ceil() as u32).clamp(1, MOST_PIECES);
        let share = 1.0 / pieces as f32;
        let stray = share * share / 8.0 * (turn * turn * reach + 2.0 * turn * growth);
        // Rounding of the transforms comes on top.
        (pieces, stray * 1.001 + 1e-6 * reach)
    }

    /// Whether the segment keeps shapes: sizes change alike in all directions, if at all.
    pub fn keeps_shapes(&self) -> bool {
        let alike = |d: [f32; 4], o: [f32; 4], scale: f32| {
            let same = |a: f32, b: f32| (a - b).abs() <= 1e-5 * scale;
            same(d[0], d[1]) && same(d[1], d[2]) && o.iter().all(|x| same(*x, 0.0))
        };
        let scale = self.stretch.x.abs();
        alike(self.stretch.to_array(), self.shear.to_array(), scale)
            && alike(self.stretch_step.to_array(), self.shear_step.to_array(), scale)
    }
}

impl AffineRows {
    /// The transform of a motion of at least one segment at `time` in `[0, 1]`.
    #[inline]
    pub fn of_motion(segments: &[MotionSegment], time: f32) -> Self {
        let place = motion::motion_place(time, segments.len() as u32);
        motion::motion_at(segments[place.segment as usize], place.fraction)
    }

    /// From rows as arrays.
    pub fn from_rows([x, y, z]: [[f32; 4]; 3]) -> Self {
        let row = |r: [f32; 4]| crate::vec4f(r[0], r[1], r[2], r[3]);
        Self { x: row(x), y: row(y), z: row(z) }
    }

    /// As rows as arrays.
    #[inline(always)]
    pub fn rows(&self) -> [[f32; 4]; 3] {
        [self.x.to_array(), self.y.to_array(), self.z.to_array()]
    }
}

#[cfg(test)]
mod tests {
    use super::motion::*;
    use crate::{vec3f, vec4f};

    fn segment() -> MotionSegment {
        let zero = vec4f(0.0, 0.0, 0.0, 0.0);
        MotionSegment {
            // A quarter turn about z, while x grows from 2 to 4.
            translation: vec4f(1.0, 2.0, 3.0, std::f32::consts::FRAC_PI_4),
            translation_step: vec4f(4.0, 0.0, 0.0, 0.0),
            rotation: vec4f(0.0, 0.0, 0.0, 1.0),
            rotation_step: vec4f(0.0, 0.0, 1.0, 0.0),
            stretch: vec4f(2.0, 1.0, 1.0, 0.0),
            stretch_step: vec4f(2.0, 0.0, 0.0, 0.0),
            shear: zero,
            shear_step: zero,
        }
    }

    #[test]
    fn parts_are_interpolated_apart() {
        let p = |fraction| affine_point(motion_at(segment(), fraction), vec3f(1.0, 0.0, 0.0)).to_array();
        let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(close(p(0.0), [3.0, 2.0, 3.0]), "{:?}", p(0.0));
        assert!(close(p(1.0), [5.0, 6.0, 3.0]), "{:?}", p(1.0));
        // An eighth of a turn at radius 3 about (3, 2, 3).
        let side = 3.0 * std::f32::consts::FRAC_1_SQRT_2;
        assert!(close(p(0.5), [3.0 + side, 2.0 + side, 3.0]), "{:?}", p(0.5));
    }

    #[test]
    fn inverses_undo() {
        for i in 0..=8 {
            let m = motion_at(segment(), i as f32 / 8.0);
            let rows = affine_product(affine_inverse(m), m).rows();
            for (r, row) in rows.iter().enumerate() {
                for (c, x) in row.iter().enumerate() {
                    assert!((x - f32::from(u8::from(r == c))).abs() < 1e-5, "{rows:?}");
                }
            }
        }
    }

    #[test]
    fn places_cover_all_of_the_motion() {
        let place = |time| {
            let p = motion_place(time, 4);
            (p.segment, p.fraction)
        };
        assert_eq!(place(0.0), (0, 0.0));
        assert_eq!(place(0.25), (1, 0.0));
        assert_eq!(place(0.375), (1, 0.5));
        assert_eq!(place(1.0), (3, 1.0));
        assert_eq!(place(7.0), (3, 1.0));
        assert_eq!(motion_place(0.75, 1), MotionPlace { segment: 0, fraction: 0.75 });
    }
}
