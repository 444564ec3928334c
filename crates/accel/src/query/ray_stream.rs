//! Streams of rays as input of queries: arrays of rays, or structures of arrays.

use crate::layout::WIDTH;
use crate::ray::Ray;
use crate::simd;
use optics::motion::MOTION_MIDDLE;

/// The rays of one stream query.
pub trait RayStream: Sync {
    /// Number of rays.
    fn len(&self) -> usize;

    /// One ray. May panic if `index` is out of range.
    fn ray(&self, index: usize) -> Ray;

    /// When a ray leaves, in the time of [`InstanceMotions`](crate::InstanceMotions). Asked only
    /// where a ray may hit what moves.
    #[inline(always)]
    fn time(&self, index: usize) -> f32 {
        let _ = index;
        MOTION_MIDDLE
    }

    /// Whether there are no rays.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Prefetches rays from `first` on, which may be out of range.
    #[inline(always)]
    fn prefetch(&self, first: usize) {
        let _ = first;
    }

    /// Eight consecutive rays, if they are stored as an array of rays.
    #[inline(always)]
    fn rows(&self, first: usize) -> Option<&[Ray; 8]> {
        let _ = first;
        None
    }

    /// Loads eight consecutive rays. Rays beyond the end have an empty interval and hit nothing.
    /// The result is written to `lanes`, which saves a copy.
    #[inline(always)]
    fn load(&self, first: usize, lanes: &mut Ray8) {
        *lanes = Ray8::INACTIVE;
        for lane in 0..WIDTH.min(self.len().saturating_sub(first)) {
            lanes.set(lane, &self.ray(first + lane));
        }
    }
}

/// Eight rays as a structure of arrays, as Embree's `RTCRay8`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Ray8 {
    /// Origins by axis, then by ray.
    pub origin: [[f32; 8]; 3],
    /// Directions by axis, then by ray.
    pub direction: [[f32; 8]; 3],
    /// See [`Ray::t_min`].
    pub t_min: [f32; 8],
    /// See [`Ray::t_max`].
    pub t_max: [f32; 8],
}

impl Ray8 {
    /// Rays with an empty interval, which hit nothing.
    pub const INACTIVE: Ray8 = Ray8 {
        origin: [[0.0; 8]; 3],
        direction: [[0.0; 8], [0.0; 8], [1.0; 8]],
        t_min: [0.0; 8],
        t_max: [-1.0; 8],
    };

    /// Writes a ray to a lane.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
        }
        (self.t_min[lane], self.t_max[lane]) = (ray.t_min, ray.t_max);
    }
}

impl RayStream for [Ray] {
    #[inline(always)]
    fn len(&self) -> usize {
        <[Ray]>::len(self)
    }

    #[inline(always)]
    fn ray(&self, index: usize) -> Ray {
        self[index]
    }

    #[inline(always)]
    fn prefetch(&self, first: usize) {
        let place = self.as_ptr().wrapping_add(first);
        (0..WIDTH).step_by(64 / size_of::<Ray>()).for_each(|ray| simd::prefetch(place.wrapping_add(ray)));
    }

    #[inline(always)]
    fn rows(&self, first: usize) -> Option<&[Ray; 8]> {
        self.get(first..)?.first_chunk()
    }
}

/// Rays as a structure of arrays, all with a `t_min` of zero.
#[derive(Clone, Copy, Debug)]
pub struct RayColumns<'a> {
    origin: [&'a [f32]; 3],
    direction: [&'a [f32]; 3],
    t_max: Option<&'a [f32]>,
    times: Option<RayTimes<'a>>,
}

/// When rays leave: ray `i` at `times[places[i]]`.
#[derive(Clone, Copy, Debug)]
pub struct RayTimes<'a> {
    /// For each ray the place of its time.
    pub places: &'a [u32],
    /// Times, see [`RayStream::time`].
    pub times: &'a [f32],
}

impl<'a> RayColumns<'a> {
    /// Origins and directions by axis. Without `t_max`, rays are infinite.
    ///
    /// # Panics
    ///
    /// If lengths differ.
    pub fn new(origin: [&'a [f32]; 3], direction: [&'a [f32]; 3], t_max: Option<&'a [f32]>) -> Self {
        let length = origin[0].len();
        let all = origin.iter().chain(&direction).chain(&t_max);
        assert!(all.into_iter().all(|column| column.len() == length), "columns of one length");
        RayColumns { origin, direction, t_max, times: None }
    }

    /// The same rays, which leave at these times.
    ///
    /// # Panics
    ///
    /// If there are not as many places as rays.
    #[must_use]
    pub fn at(mut self, times: Option<RayTimes<'a>>) -> Self {
        assert!(times.is_none_or(|t| t.places.len() == self.origin[0].len()), "a place for each ray");
        self.times = times;
        self
    }
}

impl RayStream for RayColumns<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.origin[0].len()
    }

    #[inline(always)]
    fn time(&self, index: usize) -> f32 {
        self.times.map_or(MOTION_MIDDLE, |t| t.times[t.places[index] as usize])
    }

    #[inline(always)]
    fn ray(&self, index: usize) -> Ray {
        assert!(index < self.len());
        // SAFETY: all columns have the length of the first, see `RayColumns::new`.
        let at = |column: &[f32]| unsafe { *column.get_unchecked(index) };
        Ray {
            origin: self.origin.map(at),
            t_min: 0.0,
            direction: self.direction.map(at),
            t_max: self.t_max.map_or(f32::INFINITY, at),
        }
    }

    #[inline(always)]
    fn prefetch(&self, first: usize) {
        let all = self.origin.iter().chain(&self.direction).chain(&self.t_max);
        all.for_each(|column| simd::prefetch(column.as_ptr().wrapping_add(first)));
    }

    #[inline(always)]
    fn load(&self, first: usize, lanes: &mut Ray8) {
        let rest = self.len().saturating_sub(first);
        if rest < WIDTH {
            *lanes = Ray8::INACTIVE;
            for lane in 0..rest {
                lanes.set(lane, &self.ray(first + lane));
            }
            return;
        }
        // SAFETY: there are eight rays from `first` on, and all columns have the same length, see
        // `RayColumns::new`.
        let at = |column: &[f32]| unsafe { *column.as_ptr().add(first).cast::<[f32; WIDTH]>() };
        for axis in 0..3 {
            lanes.origin[axis] = at(self.origin[axis]);
            lanes.direction[axis] = at(self.direction[axis]);
        }
        lanes.t_min = [0.0; WIDTH];
        lanes.t_max = self.t_max.map_or([f32::INFINITY; WIDTH], at);
    }
}
