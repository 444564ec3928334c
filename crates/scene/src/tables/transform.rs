//! Transforms as rows of matrices, and what they do to shapes and directions.

use glam::{Affine3A, Mat3, Vec3};

/// The rows of a 3×4 matrix.
pub(super) fn rows(m: &Affine3A) -> [[f32; 4]; 3] {
    let (a, t) = (Mat3::from(m.matrix3).transpose(), Vec3::from(m.translation));
    [a.x_axis.extend(t.x), a.y_axis.extend(t.y), a.z_axis.extend(t.z)].map(|r| r.to_array())
}

/// The transform whose matrix has these rows.
pub(super) fn affine(rows: &[[f32; 4]; 3]) -> Affine3A {
    let column = |i: usize| Vec3::new(rows[0][i], rows[1][i], rows[2][i]);
    Affine3A::from_mat3_translation(Mat3::from_cols(column(0), column(1), column(2)), column(3))
}

/// The matrix that keeps normals perpendicular and pointing out, up to scale, even under reflection.
pub(super) fn normal_matrix(m: &Affine3A) -> Mat3 {
    Mat3::from(m.matrix3.inverse()).transpose()
}

/// A normal or tangent in world space. Of unit length if the matrix keeps shapes; else lengths between vertices stay as the
/// matrix makes them, because only then interpolation gives what the transform makes of interpolated ones.
pub(super) fn placed_attribute(matrix: &Mat3, keeps_shapes: bool, v: Vec3) -> Vec3 {
    let Some(unit) = v.try_normalize() else { return Vec3::ZERO };
    let placed = *matrix * unit;
    if keeps_shapes {
        return placed.try_normalize().unwrap_or(Vec3::ZERO);
    }
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(Vec3::length);
    placed / columns.into_iter().fold(f32::MIN_POSITIVE, f32::max)
}

/// The factor by which a transform scales all lengths alike; `None` if it does not.
pub(super) fn uniform_scale(m: &Affine3A) -> Option<f32> {
    scales_alike(&Mat3::from(m.matrix3))
}

/// As [`uniform_scale`], of the linear part alone.
pub(super) fn scales_alike(a: &Mat3) -> Option<f32> {
    let lengths = [a.x_axis.length(), a.y_axis.length(), a.z_axis.length()];
    let scale = lengths[0];
    let same = lengths.iter().all(|l| (l - scale).abs() <= 1e-5 * scale);
    let skew = [a.x_axis.dot(a.y_axis), a.y_axis.dot(a.z_axis), a.z_axis.dot(a.x_axis)];
    (same && skew.iter().all(|s| s.abs() <= 1e-5 * scale * scale)).then_some(scale)
}

/// Whether a transform neither turns nor mirrors directions.
pub(super) fn is_upright(m: &Affine3A) -> bool {
    let a = Mat3::from(m.matrix3);
    let scale = a.x_axis.x;
    scale > 0.0 && (a - Mat3::from_diagonal(Vec3::splat(scale))).abs_diff_eq(Mat3::ZERO, 1e-6 * scale)
}
