//! Rays, hits and hit filters: the input and output of queries.

use bytemuck::{Pod, Zeroable};

/// A ray with an interval: hits are at `origin + t direction` with `t_min < t < t_max`.
///
/// The direction may have any length except zero; `t` is in units of that length. A negative
/// `t_min` counts as zero, and `t_max` may be infinite. A ray with a NaN, or with an infinite
/// origin or direction, misses everything.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// The start of the ray.
    pub origin: [f32; 3],
    /// Hits must be farther than this.
    pub t_min: f32,
    /// The direction of the ray.
    pub direction: [f32; 3],
    /// Hits must be nearer than this.
    pub t_max: f32,
}

impl Ray {
    /// The whole half-line from `origin` along `direction`.
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Ray { origin, t_min: 0.0, direction, t_max: f32::INFINITY }
    }

    /// Whether the ray can hit anything: all values except `t_max` are finite, and neither
    /// direction nor interval is empty.
    #[inline]
    pub(crate) fn is_valid(&self) -> bool {
        let [x, y, z] = self.direction;
        let size = x.abs().max(y.abs()).max(z.abs());
        let sum = x + y + z + self.origin[0] + self.origin[1] + self.origin[2];
        // The sum detects NaN and infinities. It may overflow itself; then every value is checked.
        size > 0.0
            && self.t_min.max(0.0) < self.t_max
            && !self.t_min.is_nan()
            && (sum.is_finite() || self.origin.iter().chain(&self.direction).all(|c| c.is_finite()))
    }
}

/// The closest hit of a ray, or [`MISS`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Hit {
    /// Ray parameter in units of the ray's direction, infinite for a miss.
    pub t: f32,
    /// Barycentric weight of the triangle's second vertex: the point is `(1-u-v) p0 + u p1 + v p2`.
    /// Zero for spheres.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex. Zero for spheres.
    pub v: f32,
    /// Id of the primitive in its [`Blas`](crate::Blas), `u32::MAX` for a miss.
    pub primitive: u32,
    /// Index of the instance in its [`Tlas`](crate::Tlas).
    pub instance: u32,
}

/// The result of a closest-hit query without a hit.
pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: u32::MAX, instance: u32::MAX };

impl Hit {
    /// Whether this is a miss.
    #[inline]
    pub fn is_miss(&self) -> bool {
        self.primitive == u32::MAX
    }
}

/// A hit that may count: what a [`HitFilter`] decides about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Index of the instance in its [`Tlas`](crate::Tlas).
    pub instance: u32,
    /// Id of the primitive in its [`Blas`](crate::Blas).
    pub primitive: u32,
    /// Of triangles: see [`Hit::u`]. Zero for spheres.
    pub u: f32,
    /// Of triangles: see [`Hit::v`]. Zero for spheres.
    pub v: f32,
    /// The ray's direction in the space of the object, of any length.
    pub direction: [f32; 3],
    /// Of spheres: from the centre to the hit in the space of the object, in units of the radius.
    /// Zero for triangles.
    pub outward: [f32; 3],
}

/// Accepts or rejects candidate hits, for surfaces with holes, and selects the instances that a ray
/// can see. Embree calls this an intersection filter.
///
/// A query passes candidates in any order, some of them never and some several times. The result
/// must only depend on the arguments.
pub trait HitFilter: Sync {
    /// Whether `accept` is always true. Then queries do not call it.
    const OPAQUE: bool;

    /// Whether a hit counts.
    fn accept(&self, candidate: &Candidate) -> bool;

    /// The query sees instances whose mask has a bit in common with this mask.
    #[inline]
    fn ray_mask(&self) -> u32 {
        u32::MAX
    }
}

/// Accepts every hit.
#[derive(Clone, Copy, Debug, Default)]
pub struct Opaque;

impl HitFilter for Opaque {
    const OPAQUE: bool = true;

    #[inline]
    fn accept(&self, _: &Candidate) -> bool {
        true
    }
}

/// Accepts every hit on instances whose mask has a bit in common with this mask.
#[derive(Clone, Copy, Debug)]
pub struct Masked(pub u32);

impl HitFilter for Masked {
    const OPAQUE: bool = true;

    #[inline]
    fn accept(&self, _: &Candidate) -> bool {
        true
    }

    #[inline]
    fn ray_mask(&self) -> u32 {
        self.0
    }
}
