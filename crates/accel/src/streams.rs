//! Many rays and many hits, in the two ways in which they may lie in memory: one after the other, or in columns.

use crate::behind::Side;
use crate::layout::WIDTH;
use crate::ray::{Hit, MISS, Ray};
use crate::simd;

/// Rays that are asked about together.
pub trait RayStream: Sync {
    /// How many.
    fn len(&self) -> usize;

    /// One of them. May panic if there is no such ray.
    fn ray(&self, index: usize) -> Ray;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Which side of which triangle each of eight in a row leaves, see [`RayColumns::leaving`]. None, where there is no such ray.
    #[inline(always)]
    fn leaving(&self, first: usize) -> [Side; 8] {
        let _ = first;
        [Side::NONE; WIDTH]
    }

    /// Asks for the memory of rays from `first` on, which need not be there.
    #[inline(always)]
    fn prefetch(&self, first: usize) {
        let _ = first;
    }

    /// Eight in a row as they lie in memory, if they do so one after the other.
    #[inline(always)]
    fn rows(&self, first: usize) -> Option<&[Ray; 8]> {
        let _ = first;
        None
    }

    /// Eight in a row; those beyond the end have no interval in which a hit counts. Into `lanes`, because what is returned would be copied.
    #[inline(always)]
    fn load(&self, first: usize, lanes: &mut RayLanes) {
        *lanes = RayLanes::NOTHING;
        for lane in 0..WIDTH.min(self.len().saturating_sub(first)) {
            lanes.set(lane, &self.ray(first + lane));
        }
    }
}

/// Eight rays, by axis and then by ray.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct RayLanes {
    /// Where the rays start.
    pub origin: [[f32; 8]; 3],
    /// Where they go.
    pub direction: [[f32; 8]; 3],
    /// See [`Ray::t_min`].
    pub t_min: [f32; 8],
    /// See [`Ray::t_max`].
    pub t_max: [f32; 8],
}

impl RayLanes {
    /// Rays that hit nothing.
    pub const NOTHING: RayLanes = RayLanes {
        origin: [[0.0; 8]; 3],
        direction: [[0.0; 8], [0.0; 8], [1.0; 8]],
        t_min: [0.0; 8],
        t_max: [-1.0; 8],
    };

    /// Puts a ray into a lane.
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

/// Rays whose numbers of one kind lie beside each other, all with a `t_min` of zero.
#[derive(Clone, Copy, Debug)]
pub struct RayColumns<'a> {
    origin: [&'a [f32]; 3],
    direction: [&'a [f32]; 3],
    t_max: Option<&'a [f32]>,
    leaving: Option<&'a [Side]>,
}

impl<'a> RayColumns<'a> {
    /// From coordinates by axis. Without `t_max`, rays have no end.
    ///
    /// # Panics
    ///
    /// If lengths differ.
    pub fn new(origin: [&'a [f32]; 3], direction: [&'a [f32]; 3], t_max: Option<&'a [f32]>) -> Self {
        let length = origin[0].len();
        let all = origin.iter().chain(&direction).chain(&t_max);
        assert!(all.into_iter().all(|column| column.len() == length), "columns of one length");
        RayColumns { origin, direction, t_max, leaving: None }
    }

    /// The same, saying which triangle's side each ray leaves. In a structure that knows what lies behind
    /// ([`Blas::find_behind`](crate::Blas::find_behind)) such rays find the same faster.
    ///
    /// A ray that leaves a side must start above it, by at least a 2²²th of the largest magnitude of a coordinate of the triangle's
    /// corners, and must not come nearer to its plane. Rays that do not keep to that may miss something.
    ///
    /// # Panics
    ///
    /// If the lengths differ.
    pub fn leaving(self, sides: &'a [Side]) -> Self {
        assert_eq!(sides.len(), self.origin[0].len(), "columns of one length");
        RayColumns { leaving: Some(sides), ..self }
    }
}

impl RayStream for RayColumns<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.origin[0].len()
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
    fn leaving(&self, first: usize) -> [Side; 8] {
        let sides = self.leaving.unwrap_or(&[]);
        let rest = sides.get(first..).unwrap_or(&[]);
        if let Some(eight) = rest.first_chunk() {
            return *eight;
        }
        let mut eight = [Side::NONE; WIDTH];
        eight[..rest.len()].copy_from_slice(rest);
        eight
    }

    #[inline(always)]
    fn prefetch(&self, first: usize) {
        let all = self.origin.iter().chain(&self.direction).chain(&self.t_max);
        all.for_each(|column| simd::prefetch(column.as_ptr().wrapping_add(first)));
    }

    #[inline(always)]
    fn load(&self, first: usize, lanes: &mut RayLanes) {
        let rest = self.len().saturating_sub(first);
        if rest < WIDTH {
            *lanes = RayLanes::NOTHING;
            for lane in 0..rest {
                lanes.set(lane, &self.ray(first + lane));
            }
            return;
        }
        // SAFETY: there are eight rays from `first` on, and all columns have the same length, see `RayColumns::new`.
        let at = |column: &[f32]| unsafe { *column.as_ptr().add(first).cast::<[f32; WIDTH]>() };
        for axis in 0..3 {
            lanes.origin[axis] = at(self.origin[axis]);
            lanes.direction[axis] = at(self.direction[axis]);
        }
        lanes.t_min = [0.0; WIDTH];
        lanes.t_max = self.t_max.map_or([f32::INFINITY; WIDTH], at);
    }
}

/// Sixteen hits, each number of all beside each other; see [`Hit`].
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct HitRow {
    /// See [`Hit::t`].
    pub t: [f32; 16],
    /// See [`Hit::u`].
    pub u: [f32; 16],
    /// See [`Hit::v`].
    pub v: [f32; 16],
    /// See [`Hit::primitive`].
    pub primitive: [u32; 16],
    /// See [`Hit::instance`].
    pub instance: [u32; 16],
}

impl HitRow {
    /// Sixteen times [`MISS`].
    pub const MISSES: HitRow = HitRow {
        t: [MISS.t; 16],
        u: [MISS.u; 16],
        v: [MISS.v; 16],
        primitive: [MISS.primitive; 16],
        instance: [MISS.instance; 16],
    };

    /// One of them.
    ///
    /// # Panics
    ///
    /// If `lane` is not below 16.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, lane: usize) -> Hit {
        Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            primitive: self.primitive[lane],
            instance: self.instance[lane],
        }
    }
}

/// Where the answers to a stream's queries go.
pub trait HitStream {
    /// How many there is room for.
    fn len(&self) -> usize;

    /// Puts an answer in its place. May panic if there is no such place.
    fn set(&mut self, index: usize, hit: &Hit);

    /// Puts sixteen answers in their places from `first` on, or as many of them as there is room for.
    #[inline(always)]
    fn set_row(&mut self, first: usize, row: &HitRow) {
        for lane in 0..self.len().saturating_sub(first).min(16) {
            self.set(first + lane, &row.get(lane));
        }
    }

    /// Whether there is no room at all.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Puts [`MISS`] everywhere.
    fn clear(&mut self) {
        (0..self.len()).for_each(|index| self.set(index, &MISS));
    }
}

impl HitStream for [Hit] {
    #[inline(always)]
    fn len(&self) -> usize {
        <[Hit]>::len(self)
    }

    #[inline(always)]
    fn set(&mut self, index: usize, hit: &Hit) {
        self[index] = *hit;
    }
}

/// Hits whose numbers of one kind lie beside each other; see [`Hit`].
#[derive(Debug)]
pub struct HitColumns<'a> {
    t: &'a mut [f32],
    uv: [&'a mut [f32]; 2],
    primitive: &'a mut [u32],
    instance: &'a mut [u32],
}

impl<'a> HitColumns<'a> {
    /// Room for as many hits as the columns are long.
    ///
    /// # Panics
    ///
    /// If lengths differ.
    pub fn new(
        t: &'a mut [f32],
        uv: [&'a mut [f32]; 2],
        primitive: &'a mut [u32],
        instance: &'a mut [u32],
    ) -> Self {
        let lengths = [uv[0].len(), uv[1].len(), primitive.len(), instance.len()];
        assert_eq!(lengths, [t.len(); 4], "columns of one length");
        HitColumns { t, uv, primitive, instance }
    }
}

impl HitStream for HitColumns<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.t.len()
    }

    #[inline(always)]
    fn set(&mut self, index: usize, hit: &Hit) {
        assert!(index < self.t.len());
        // SAFETY: all columns have the length of the first, see `HitColumns::new`.
        unsafe {
            *self.t.get_unchecked_mut(index) = hit.t;
            *self.uv[0].get_unchecked_mut(index) = hit.u;
            *self.uv[1].get_unchecked_mut(index) = hit.v;
            *self.primitive.get_unchecked_mut(index) = hit.primitive;
            *self.instance.get_unchecked_mut(index) = hit.instance;
        }
    }

    #[inline(always)]
    fn set_row(&mut self, first: usize, row: &HitRow) {
        put(self.t, first, &row.t);
        put(self.uv[0], first, &row.u);
        put(self.uv[1], first, &row.v);
        put(self.primitive, first, &row.primitive);
        put(self.instance, first, &row.instance);
    }

    fn clear(&mut self) {
        self.t.fill(MISS.t);
        self.uv.iter_mut().for_each(|column| column.fill(0.0));
        self.primitive.fill(MISS.primitive);
        self.instance.fill(MISS.instance);
    }
}

/// Puts sixteen numbers into a column, as far as there is room.
#[inline(always)]
fn put<T: Copy>(column: &mut [T], first: usize, numbers: &[T; 16]) {
    let rest = column.get_mut(first..).unwrap_or_default();
    match rest.first_chunk_mut() {
        Some(all) => *all = *numbers,
        None => rest.copy_from_slice(&numbers[..rest.len()]),
    }
}
