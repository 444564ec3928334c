//! Cameras as computer vision describes them: a matrix of intrinsics and a pose.

use crate::{Camera, Distortion, Projection};
use glam::{DVec3, Vec2};

/// Why a matrix or a pose is not that of a camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// Not a matrix of intrinsics.
    #[error("matrix: expected [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with positive focal lengths, got {0:?}")]
    Matrix([[f64; 3]; 3]),
    /// Not as many coefficients as a model has, or one that is not finite.
    #[error(
        "distortion: expected k1, k2, p1, p2[, k3[, k4, k5, k6]], or k1, k2, k3, k4 of a fisheye, got {0:?}"
    )]
    Distortion(Vec<f64>),
    /// Scaled, sheared, mirrored or not finite.
    #[error("pose: the left 3×3 part of {0:?} is not a rotation")]
    Pose([[f64; 4]; 3]),
    /// A picture without pixels.
    #[error("a picture of {width}×{height} pixels has no pixels")]
    Size {
        /// Width that was given.
        width: u32,
        /// Height that was given.
        height: u32,
    },
}

impl Camera {
    /// A pinhole camera as OpenCV describes it. For a lens see [`Camera::with_opencv_distortion`].
    ///
    /// Camera axes are x right, y down, z into the picture. Pixel centres are at whole numbers: (0, 0) is the centre of the
    /// upper left pixel.
    ///
    /// - `matrix`: `[[fx, s, cx], [0, fy, cy], [0, 0, 1]]`, in pixels of a picture of `width` × `height`.
    /// - `pose`: camera to world, rows of a rotation and a translation in metres.
    ///
    /// # Errors
    /// See [`CalibrationError`].
    pub fn from_opencv(
        matrix: [[f64; 3]; 3],
        pose: [[f64; 4]; 3],
        width: u32,
        height: u32,
    ) -> Result<Self, CalibrationError> {
        let [[fx, skew, cx], [zero, fy, cy], last] = matrix;
        let finite = matrix.as_flattened().iter().all(|x| x.is_finite());
        if zero != 0.0 || last != [0.0, 0.0, 1.0] || !(finite && fx > 0.0 && fy > 0.0) {
            return Err(CalibrationError::Matrix(matrix));
        }
        if width == 0 || height == 0 {
            return Err(CalibrationError::Size { width, height });
        }
        let column = |i: usize| DVec3::new(pose[0][i], pose[1][i], pose[2][i]);
        let (right, down, axis, eye) = (column(0), column(1), column(2), column(3));
        let angles = [right.dot(down), right.dot(axis), down.dot(axis)];
        let lengths = [right, down, axis].map(|v| v.length() - 1.0);
        let is_rotation =
            angles.iter().chain(&lengths).all(|e| e.abs() < 1e-4) && right.cross(down).dot(axis) > 0.0;
        if !is_rotation || !eye.is_finite() {
            return Err(CalibrationError::Pose(pose));
        }
        // A far target keeps the direction exact where the eye's coordinates are large.
        let target = eye + axis * (8.0 * eye.length()).max(1.0);
        let mut camera = Self::perspective("calibrated", eye.as_vec3(), target.as_vec3(), 1.0);
        camera.up = -down.as_vec3();
        camera.aspect = Some(width as f32 / height as f32);
        camera.skew = (skew / fx) as f32;
        let (w, h) = (f64::from(width), f64::from(height));
        camera.projection = Projection::Intrinsics {
            focal: Vec2::new((fx / w) as f32, (fy / h) as f32),
            center: Vec2::new(((cx + 0.5) / w) as f32, ((cy + 0.5) / h) as f32),
        };
        Ok(camera)
    }

    /// The camera with a lens by OpenCV's coefficients: `k1, k2, p1, p2[, k3[, k4, k5, k6]]` of `calibrateCamera`, or
    /// `k1, k2, k3, k4` of `fisheye::calibrate`; none are a pinhole.
    ///
    /// # Errors
    /// [`CalibrationError::Distortion`].
    pub fn with_opencv_distortion(
        mut self,
        coefficients: &[f64],
        fisheye: bool,
    ) -> Result<Self, CalibrationError> {
        if !coefficients.is_empty() {
            let distortion = Distortion::from_opencv(coefficients, fisheye);
            let wrong = || CalibrationError::Distortion(coefficients.to_vec());
            self.distortion = Some(distortion.ok_or_else(wrong)?);
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MATRIX: [[f64; 3]; 3] = [[500.0, 0.0, 319.5], [0.0, 510.0, 239.5], [0.0, 0.0, 1.0]];
    const POSE: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 4.0], [0.0, -1.0, 0.0, 5.0], [0.0, 0.0, -1.0, 6.0]];

    #[test]
    fn axes_and_centre_are_those_of_opencv() {
        let camera = Camera::from_opencv(MATRIX, POSE, 640, 480).expect("a camera");
        assert_eq!((camera.eye.to_array(), camera.up.to_array()), ([4.0, 5.0, 6.0], [0.0, 1.0, 0.0]));
        assert!((camera.target - camera.eye).normalize().distance(glam::Vec3::NEG_Z) < 1e-6);
        let Projection::Intrinsics { focal, center } = camera.projection else { panic!("{camera:?}") };
        assert_eq!(
            center,
            Vec2::splat(0.5),
            "the middle between the pixels 319 and 320 is the picture's centre"
        );
        assert!((focal.x * 640.0 - 500.0).abs() < 1e-4 && (focal.y * 480.0 - 510.0).abs() < 1e-4);
    }

    #[test]
    fn coefficients_are_in_the_order_of_opencv() {
        let mut skewed = MATRIX;
        skewed[0][1] = 5.0;
        let camera = Camera::from_opencv(skewed, POSE, 640, 480).expect("a camera");
        assert!((camera.skew - 0.01).abs() < 1e-7);
        let with =
            |c: &[f64], fisheye| camera.clone().with_opencv_distortion(c, fisheye).map(|c| c.distortion);
        let all = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let brown = Distortion::BrownConrady { k: [1.0, 2.0, 5.0, 6.0, 7.0, 8.0], p: [3.0, 4.0] };
        assert_eq!(with(&all, false), Ok(Some(brown)));
        assert_eq!(with(&all[..4], true), Ok(Some(Distortion::Fisheye { k: [1.0, 2.0, 3.0, 4.0] })));
        assert_eq!(with(&[], true), Ok(None));
        for (wrong, fisheye) in
            [(&all[..3], false), (&all[..6], false), (&all[..5], true), (&[f64::NAN; 4], false)]
        {
            assert!(matches!(with(wrong, fisheye), Err(CalibrationError::Distortion(_))), "{wrong:?}");
        }
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        let mut leaning = MATRIX;
        leaning[1][0] = 0.1;
        assert!(matches!(Camera::from_opencv(leaning, POSE, 640, 480), Err(CalibrationError::Matrix(_))));
        for (row, column, value) in [(0, 0, -1.0), (0, 0, 2.0), (1, 2, 0.5), (2, 3, f64::NAN)] {
            let mut pose = POSE;
            pose[row][column] = value;
            assert!(matches!(Camera::from_opencv(MATRIX, pose, 640, 480), Err(CalibrationError::Pose(_))));
        }
        assert!(matches!(Camera::from_opencv(MATRIX, POSE, 0, 480), Err(CalibrationError::Size { .. })));
    }
}
