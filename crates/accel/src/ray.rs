//! What goes into a query and what comes out.

use bytemuck::{Pod, Zeroable};

/// The part of a line on which hits count: `origin + t direction` for `t_min < t < t_max`.
///
/// The direction may have any length but zero; `t` is in units of that length. A negative `t_min` counts as zero. A
/// ray with NaN anywhere, or with an infinite origin or direction, misses everything; `t_max` may be infinite.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Where the ray starts.
    pub origin: [f32; 3],
    /// Hits must be farther than this.
    pub t_min: f32,
    /// Where the ray goes.
    pub direction: [f32; 3],
    /// Hits must be nearer than this.
    pub t_max: f32,
}

impl Ray {
    /// The whole half-line from `origin` along `direction`.
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Ray { origin, t_min: 0.0, direction, t_max: f32::INFINITY }
    }

    /// Whether a query may start: all numbers finite (but `t_max`), a direction, an interval.
    #[inline]
    pub(crate) fn is_valid(&self) -> bool {
        let [x, y, z] = self.direction;
        let size = x.abs().max(y.abs()).max(z.abs());
        let sum = x + y + z + self.origin[0] + self.origin[1] + self.origin[2];
        // One sum finds NaN and infinities everywhere; if it overflows itself, look closer.
        size > 0.0
            && self.t_min.max(0.0) < self.t_max
            && !self.t_min.is_nan()
            && (sum.is_finite() || self.origin.iter().chain(&self.direction).all(|c| c.is_finite()))
    }
}

/// The nearest hit of a ray, or [`MISS`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Hit {
    /// Ray parameter in units of the ray's direction, infinite for a miss.
    pub t: f32,
    /// Barycentric weight of the triangle's second vertex: the point is `(1-u-v) p0 + u p1 + v p2`. Zero for spheres.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex. Zero for spheres.
    pub v: f32,
    /// Id of the primitive in its [`Blas`](crate::Blas), `u32::MAX` for a miss.
    pub primitive: u32,
    /// Index of the instance in its [`Tlas`](crate::Tlas).
    pub instance: u32,
}

/// What a query returns that finds nothing.
pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: u32::MAX, instance: u32::MAX };

impl Hit {
    /// Whether this is no hit at all.
    #[inline]
    pub fn is_miss(&self) -> bool {
        self.primitive == u32::MAX
    }
}

/// Decides which candidate hits count, for surfaces with holes, and which instances a ray can see.
///
/// A query asks about candidates in any order, about some of them never, about none more than a few times: the answer
/// must depend on the arguments alone.
pub trait HitFilter: Sync {
    /// Whether `accept` is always true, so that queries need not call it.
    const OPAQUE: bool;

    /// Whether the hit on `primitive` of `instance` at barycentric coordinates `u`, `v` counts.
    fn accept(&self, instance: u32, primitive: u32, u: f32, v: f32) -> bool;

    /// Which instances exist for this query: those whose mask shares a bit with this.
    #[inline]
    fn ray_mask(&self) -> u32 {
        u32::MAX
    }
}

/// Every hit counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Opaque;

impl HitFilter for Opaque {
    const OPAQUE: bool = true;

    #[inline]
    fn accept(&self, _: u32, _: u32, _: f32, _: f32) -> bool {
        true
    }
}

/// Every hit counts, on instances whose mask shares a bit with this one.
#[derive(Clone, Copy, Debug)]
pub struct Masked(pub u32);

impl HitFilter for Masked {
    const OPAQUE: bool = true;

    #[inline]
    fn accept(&self, _: u32, _: u32, _: f32, _: f32) -> bool {
        true
    }

    #[inline]
    fn ray_mask(&self) -> u32 {
        self.0
    }
}
