//! Instances of objects and their transforms.

use crate::ray::Ray;

/// An instance of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the object.
    pub blas: u32,
    /// Rows of the 3×4 matrix that maps object space to world space (column vectors).
    pub object_to_world: [[f32; 4]; 3],
    /// A query sees the instance if its mask has a bit in common with this mask.
    pub mask: u32,
}

impl Instance {
    /// The identity transform.
    pub const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

    /// Object `blas` without a transform, visible to all queries.
    pub fn identity(blas: u32) -> Instance {
        Instance { blas, object_to_world: Instance::IDENTITY, mask: u32::MAX }
    }
}

/// The inverse of a 3×4 transform, if it has one that is finite.
pub(crate) fn inverse(m: &[[f32; 4]; 3]) -> Option<[[f32; 4]; 3]> {
    let m = m.map(|row| row.map(f64::from));
    let cofactor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    let mut inverse = [[0.0f64; 4]; 3];
    for r in 0..3 {
        for c in 0..3 {
            inverse[r][c] = cofactor(c, r) / det;
        }
        inverse[r][3] = -(inverse[r][0] * m[0][3] + inverse[r][1] * m[1][3] + inverse[r][2] * m[2][3]);
    }
    let inverse = inverse.map(|row| row.map(|x| x as f32));
    inverse.as_flattened().iter().all(|x| x.is_finite()).then_some(inverse)
}

/// The product of a row of a transform and a vector, without the translation.
#[inline(always)]
fn dot(row: &[f32; 4], v: &[f32; 3]) -> f32 {
    row[0] * v[0] + row[1] * v[1] + row[2] * v[2]
}

/// The ray in object space. Its parameter `t` stays the same.
#[inline(always)]
pub(super) fn to_object_space(world_to_object: &[[f32; 4]; 3], ray: &Ray) -> Ray {
    let ([x, y, z], [o, d]) = (world_to_object, [&ray.origin, &ray.direction]);
    let mut r = *ray;
    r.origin = [dot(x, o) + x[3], dot(y, o) + y[3], dot(z, o) + z[3]];
    r.direction = [dot(x, d), dot(y, d), dot(z, d)];
    r
}
