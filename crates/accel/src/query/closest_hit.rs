//! The state of a query for the closest hit.

use crate::layout::{ChildRef, EMPTY};
use crate::ray::{Hit, MISS, Ray};

/// The closest hit so far.
#[derive(Clone, Copy)]
pub(super) struct ClosestHit {
    pub hit: Hit,
    /// Its distance, or the end of the ray.
    pub t_max: f32,
}

impl ClosestHit {
    /// No hit yet.
    #[inline(always)]
    pub fn new(ray: &Ray) -> ClosestHit {
        ClosestHit { hit: MISS, t_max: ray.t_max }
    }
}

/// Whether a ray can hit anything below `root`.
#[inline(always)]
pub(super) fn can_hit(root: ChildRef, ray: &Ray) -> bool {
    root != EMPTY && ray.is_valid()
}
