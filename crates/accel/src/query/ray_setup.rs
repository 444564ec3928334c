//! Per-ray constants of traversal, computed for many rays in SIMD lanes.
//!
//! Constants are computed as structures of arrays and then transposed, so that those of one ray are
//! contiguous. The results are bit for bit those of [`Slabs::new`] and [`Shear::new`], mask take as
//! long for one ray as two node visits.

use super::lane_vectors::abs;
use super::ray_stream::{Ray8, RayStream};
use super::slabs::Slabs;
use super::triangle_intersector::Shear;
use crate::layout::{NodePlane, WIDTH};
use crate::ray::Ray;
use crate::simd::{Arithmetic, Simd, Sixteen};

/// A ray's constants for traversal, as Embree's `TravRay`.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct TraversalRay {
    /// For the boxes of nodes.
    pub slabs: Slabs,
    /// For the triangles of leaves.
    pub shear: Shear,
    /// See [`Ray::t_max`].
    pub t_max: f32,
}

/// The memory of a [`TraversalRay`] as vectors.
type Words = [[f32; WIDTH]; 3];

const _: () = assert!(
    size_of::<TraversalRay>() == size_of::<Words>() && align_of::<TraversalRay>() >= align_of::<Words>()
);

impl TraversalRay {
    /// `extent`: the largest magnitude of a coordinate of the tree, by axis.
    #[inline(always)]
    pub fn new(ray: &Ray, extent: &[f32; 3]) -> Self {
        TraversalRay { slabs: Slabs::new(ray, extent), shear: Shear::new(ray), t_max: ray.t_max }
    }

    /// A ray that hits nothing.
    pub fn inactive() -> Self {
        TraversalRay::new(&Ray { t_max: -1.0, ..Ray::new([0.0; 3], [0.0, 0.0, 1.0]) }, &[0.0; 3])
    }
}

/// The coordinates of eight vectors.
#[inline(always)]
fn vectors<S: Simd>(s: S, [x, y, z]: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
    [s.load(x), s.load(y), s.load(z)]
}

/// The eight floats of a ray.
#[inline(always)]
fn row<S: Simd>(s: S, ray: &Ray) -> S::F {
    s.load(bytemuck::cast_ref(ray))
}

/// Rays in SIMD lanes.
pub(super) struct LaneRays<A: Arithmetic> {
    pub origin: [A::F; 3],
    pub direction: [A::F; 3],
    /// Not negative.
    pub t_min: A::F,
    /// Negative for invalid rays.
    pub t_max: A::F,
    /// Mask of the valid rays, see [`Ray::is_valid`].
    pub valid: A::M,
}

impl<A: Arithmetic> LaneRays<A> {
    #[inline(always)]
    fn new(a: A, origin: [A::F; 3], direction: [A::F; 3], t_min: A::F, t_max: A::F) -> Self {
        let (zero, largest) = (a.splat(0.0), a.splat(f32::MAX));
        let begin = a.max(t_min, zero);
        // Comparisons with NaN are false.
        let mut valid = a.and(a.lt(zero, longest(a, direction)), a.lt(begin, t_max));
        valid = a.and(valid, a.le(t_min, t_min));
        for axis in 0..3 {
            let (o, d) = (abs(a, origin[axis]), abs(a, direction[axis]));
            valid = a.and(valid, a.and(a.le(o, largest), a.le(d, largest)));
        }
        let t_max = a.select(valid, a.splat(-1.0), t_max);
        LaneRays { origin, direction, t_min: begin, t_max, valid }
    }
}

impl<S: Simd> LaneRays<S> {
    /// Eight rays.
    #[inline(always)]
    pub fn eight(s: S, lanes: &Ray8) -> Self {
        let (origin, direction) = (vectors(s, &lanes.origin), vectors(s, &lanes.direction));
        Self::new(s, origin, direction, s.load(&lanes.t_min), s.load(&lanes.t_max))
    }
}

/// Eight rays of a stream as vectors: origin, `t_min`, direction, `t_max`. `lanes` is scratch
/// memory.
#[inline(always)]
fn load_eight<S: Simd>(
    s: S,
    rays: &(impl RayStream + ?Sized),
    first: usize,
    lanes: &mut Ray8,
) -> [S::F; WIDTH] {
    if let Some([a, b, c, d, e, f, g, h]) = rays.rows(first) {
        let rows = [row(s, a), row(s, b), row(s, c), row(s, d), row(s, e), row(s, f), row(s, g), row(s, h)];
        return s.transposed(rows);
    }
    rays.load(first, lanes);
    let ([ox, oy, oz], [dx, dy, dz]) = (vectors(s, &lanes.origin), vectors(s, &lanes.direction));
    [ox, oy, oz, s.load(&lanes.t_min), dx, dy, dz, s.load(&lanes.t_max)]
}

/// Sixteen rays of a stream from `first` on. Rays beyond the end are invalid. `lanes` is scratch
/// memory.
#[inline(always)]
pub(super) fn sixteen_rays<S: Simd>(
    s: S,
    rays: &(impl RayStream + ?Sized),
    first: usize,
    lanes: &mut [Ray8; 2],
) -> LaneRays<S::Sixteen> {
    let w = s.sixteen();
    let low = load_eight(s, rays, first, &mut lanes[0]);
    let high = load_eight(s, rays, first + WIDTH, &mut lanes[1]);
    let mut all = [w.splat(0.0); WIDTH];
    for i in 0..WIDTH {
        all[i] = w.join([low[i], high[i]]);
    }
    let [ox, oy, oz, t_min, dx, dy, dz, t_max] = all;
    LaneRays::new(w, [ox, oy, oz], [dx, dy, dz], t_min, t_max)
}

/// The largest magnitude of a component of each vector.
#[inline(always)]
fn longest<A: Arithmetic>(a: A, [x, y, z]: [A::F; 3]) -> A::F {
    a.max(a.max(abs(a, x), abs(a, y)), abs(a, z))
}

/// [`Slabs`] of rays in SIMD lanes.
pub(super) struct LaneSlabs<A: Arithmetic> {
    pub inverse: [A::F; 3],
    pub near_offset: [A::F; 3],
    pub far_offset: [A::F; 3],
    /// Masks of rays with a negative direction, by axis.
    pub is_negative: [A::M; 3],
}

impl<A: Arithmetic> LaneSlabs<A> {
    /// `extent`: see [`Slabs::new`].
    #[inline(always)]
    pub fn new(a: A, rays: &LaneRays<A>, extent: &[f32; 3]) -> Self {
        let zero = a.splat(0.0);
        let tiny = a.max(a.mul(longest(a, rays.direction), a.splat(1e-24)), a.splat(1e-37));
        let [mut inverse, mut near_offset, mut far_offset] = [[zero; 3]; 3];
        let mut is_negative = [a.lt(zero, zero); 3];
        for axis in 0..3 {
            // As in `Slabs::new`.
            let (o, d) = (rays.origin[axis], rays.direction[axis]);
            let d = a.select(a.lt(abs(a, d), tiny), d, a.flip_sign(tiny, d));
            inverse[axis] = a.div(a.splat(1.0), d);
            let offset = a.mul(o, inverse[axis]);
            let size = a.add(abs(a, o), a.splat(extent[axis]));
            let error = a.mul(a.mul(size, abs(a, inverse[axis])), a.splat(4.0 * f32::EPSILON));
            near_offset[axis] = a.sub(a.sub(zero, offset), error);
            far_offset[axis] = a.sub(error, offset);
            is_negative[axis] = a.lt(inverse[axis], zero);
        }
        LaneSlabs { inverse, near_offset, far_offset, is_negative }
    }

    /// The distances at mask the rays enter a box, and the mask of rays that hit it before `t_max`.
    #[inline(always)]
    pub fn intersect(&self, a: A, low: [f32; 3], high: [f32; 3], t_min: A::F, t_max: A::F) -> (A::F, A::M) {
        let [mut near, mut far] = [[t_min; 3]; 2];
        for axis in 0..3 {
            let (low, high) = (a.splat(low[axis]), a.splat(high[axis]));
            let (enter, leave) =
                (a.select(self.is_negative[axis], low, high), a.select(self.is_negative[axis], high, low));
            near[axis] = a.mul_add(enter, self.inverse[axis], self.near_offset[axis]);
            far[axis] = a.mul_add(leave, self.inverse[axis], self.far_offset[axis]);
        }
        let near = a.max(a.max(near[0], near[1]), a.max(near[2], t_min));
        let far = a.min(a.min(far[0], far[1]), a.min(far[2], t_max));
        (near, a.le(near, far))
    }

    /// [`Slabs::near_plane`] as bits.
    #[inline(always)]
    fn near_plane(&self, a: A, axis: usize) -> A::F {
        let [low, high] = [NodePlane::new(axis, 0).to_bits(), NodePlane::new(axis, 1).to_bits()];
        a.bits_as_f(a.select_u(self.is_negative[axis], a.splat_u(low), a.splat_u(high)))
    }
}

/// Writes is_negative what each of sixteen rays needs, if any of its eight is in `mask`.
#[inline(always)]
pub(super) fn store_traversal_rays<S: Simd>(
    s: S,
    rays: &LaneRays<S::Sixteen>,
    slabs: &LaneSlabs<S::Sixteen>,
    shears: &Shears<S::Sixteen>,
    mask: u32,
    to: &mut [TraversalRay; 2 * WIDTH],
) {
    let w = s.sixteen();
    let [[ix, iy, iz], [nx, ny, nz], [fx, fy, fz]] = [slabs.inverse, slabs.near_offset, slabs.far_offset];
    let [px, py, pz] = [slabs.near_plane(w, 0), slabs.near_plane(w, 1), slabs.near_plane(w, 2)];
    let [au, av, aw] = shears.axes.to_bits(w);
    let ([ou, ov, ow], [su, sv, sw]) = (shears.origin, shears.shear);
    // In the order of the fields of a `TraversalRay`.
    let words = [
        [ix, iy, iz, nx, ny, nz, fx, fy],
        [fz, px, py, pz, rays.t_min, au, av, aw],
        [ou, ov, ow, su, sv, sw, rays.t_min, rays.t_max],
    ];
    for half in 0..2 {
        if mask >> (half * WIDTH) & 255 == 0 {
            continue;
        }
        let rows = [
            s.transposed(half_of(s, &words[0], half)),
            s.transposed(half_of(s, &words[1], half)),
            s.transposed(half_of(s, &words[2], half)),
        ];
        for ray in 0..WIDTH {
            // SAFETY: a `TraversalRay` is twenty-four values of four bytes with sufficient
            // alignment, see the assertion above. Its planes and axes are valid: they come from
            // `NodePlane::new` and `Axes::to_bits`.
            let words = unsafe { &mut *std::ptr::from_mut(&mut to[half * WIDTH + ray]).cast::<Words>() };
            for (row, word) in rows.iter().zip(words) {
                s.store(row[ray], word);
            }
        }
    }
}

/// Lanes 0 to 7 (`half` 0) or lanes 8 to 15 (`half` 1) of all vectors.
#[inline(always)]
pub(super) fn half_of<S: Simd>(
    s: S,
    all: &[<S::Sixteen as Arithmetic>::F; WIDTH],
    half: usize,
) -> [S::F; WIDTH] {
    let mut halves = [s.splat(0.0); WIDTH];
    for i in 0..WIDTH {
        halves[i] = s.sixteen().halves(all[i])[half];
    }
    halves
}

/// [`Shear`] of rays in SIMD lanes.
pub(super) struct Shears<A: Arithmetic> {
    pub axes: Axes<A>,
    /// Origins in the order of the axes.
    pub origin: [A::F; 3],
    pub shear: [A::F; 3],
}

impl<A: Arithmetic> Shears<A> {
    #[inline(always)]
    pub fn new(a: A, rays: &LaneRays<A>) -> Self {
        let [x, y, z] = rays.direction;
        let (x, y, z) = (abs(a, x), abs(a, y), abs(a, z));
        // The longest component, chosen as in `Shear::new`.
        let axes = Axes { along_y: a.and(a.lt(x, y), a.le(z, y)), along_z: a.and(a.lt(x, z), a.lt(y, z)) };
        let [u, v, w] = axes.ordered(a, rays.direction);
        let inverse = a.div(a.splat(1.0), w);
        let origin = axes.ordered(a, rays.origin);
        Shears { axes, origin, shear: [a.mul(u, inverse), a.mul(v, inverse), inverse] }
    }
}

/// The third axis of each ray: y or z where a mask is set, else x.
pub(super) struct Axes<A: Arithmetic> {
    along_y: A::M,
    along_z: A::M,
}

impl<A: Arithmetic> Axes<A> {
    /// Coordinates in the order of the axes.
    #[inline(always)]
    fn ordered(&self, a: A, [x, y, z]: [A::F; 3]) -> [A::F; 3] {
        let (along_y, along_z) = (self.along_y, self.along_z);
        [
            a.select(along_z, a.select(along_y, y, z), x),
            a.select(along_z, a.select(along_y, z, x), y),
            a.select(along_z, a.select(along_y, x, y), z),
        ]
    }

    /// Bits of the rays whose third axis is not `third`. `all`: the bits of all lanes.
    #[inline(always)]
    pub fn bits_other_than(&self, a: A, third: usize, all: u32) -> u32 {
        let (along_y, along_z) = (a.bits(self.along_y), a.bits(self.along_z));
        match third {
            0 => along_y | along_z,
            1 => along_y ^ all,
            _ => along_z ^ all,
        }
    }

    /// The order of axes as bits of 0, 1 and 2.
    #[inline(always)]
    fn to_bits(&self, a: A) -> [A::F; 3] {
        let [x, y, z] = [a.bits_as_f(a.splat_u(0)), a.bits_as_f(a.splat_u(1)), a.bits_as_f(a.splat_u(2))];
        self.ordered(a, [x, y, z])
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::simd::InstructionSet;
    use crate::simd::avx2::Avx2;
    use crate::simd::avx512::Avx512;

    fn rays() -> Vec<Ray> {
        let mut bits = 1u32;
        let mut number = || {
            bits = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (bits >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let mut rays: Vec<Ray> = (0..400)
            .map(|_| {
                let mut vector = || [number(), number(), number()];
                Ray::new(vector().map(|x| 10.0 * x), vector())
            })
            .collect();
        let odd = [0.0, -0.0, 1.0, -1.0, 1e-38, -1e-30, 3e38, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        for x in odd {
            for y in odd {
                for z in odd {
                    rays.push(Ray::new([1.0, -2.0, 3.0], [x, y, z]));
                    rays.push(Ray::new([x, y, z], [0.5, 0.5, -0.5]));
                }
                rays.push(Ray { t_min: x, t_max: y, ..Ray::new([0.0; 3], [1.0, 2.0, 3.0]) });
            }
        }
        rays
    }

    /// Rays as columns, in the order of the fields of a [`Ray`].
    struct Columns<'a>(&'a [Vec<f32>; 8]);

    impl RayStream for Columns<'_> {
        fn len(&self) -> usize {
            self.0[0].len()
        }

        fn ray(&self, index: usize) -> Ray {
            let [ox, oy, oz, t_min, dx, dy, dz, t_max] = self.0.each_ref().map(|column| column[index]);
            Ray { origin: [ox, oy, oz], t_min, direction: [dx, dy, dz], t_max }
        }
    }

    /// All values as bits, except for the sign of zeros.
    fn bits_of(ray_constants: &TraversalRay) -> Vec<u32> {
        let TraversalRay { slabs, shear, t_max } = ray_constants;
        let floats = [slabs.inverse, slabs.near_offset, slabs.far_offset];
        let mut all: Vec<f32> = floats.concat();
        all.extend(shear.numbers());
        all.extend([slabs.t_min, *t_max]);
        let planes = slabs.near_plane.map(NodePlane::to_bits);
        all.iter().map(|x| (x + 0.0).to_bits()).chain(planes).chain(shear.axes()).collect()
    }

    fn check<S: Simd>(s: S) {
        let (rays, extent) = (rays(), [7.0, 0.5, 1000.0]);
        let w = s.sixteen();
        let mut valid = 0;
        for sixteen in rays.chunks(2 * WIDTH) {
            let columns: [Vec<f32>; 8] = [0, 1, 2, 3, 4, 5, 6, 7].map(|i: usize| {
                sixteen.iter().map(|ray| bytemuck::cast_ref::<Ray, [f32; 8]>(ray)[i]).collect()
            });
            let in_columns = Columns(&columns);
            for all in [
                sixteen_rays(s, sixteen, 0, &mut [Ray8::INACTIVE; 2]),
                sixteen_rays(s, &in_columns, 0, &mut [Ray8::INACTIVE; 2]),
            ] {
                let mut constants = [TraversalRay::inactive(); 2 * WIDTH];
                let (slabs, shears) = (LaneSlabs::new(w, &all, &extent), Shears::new(w, &all));
                store_traversal_rays(s, &all, &slabs, &shears, 0xffff, &mut constants);
                let bits = w.bits(all.valid);
                for (lane, ray) in sixteen.iter().enumerate() {
                    assert_eq!(bits >> lane & 1 != 0, ray.is_valid(), "{ray:?}");
                    if ray.is_valid() {
                        assert_eq!(
                            bits_of(&constants[lane]),
                            bits_of(&TraversalRay::new(ray, &extent)),
                            "{ray:?}"
                        );
                        valid += 1;
                    }
                }
                assert_eq!(bits >> sixteen.len(), 0, "lanes without a ray");
            }
        }
        assert!(valid > 1600, "{valid} rays were compared");
    }

    #[test]
    fn constants_of_sixteen_rays_are_those_of_single_rays() {
        if InstructionSet::Avx2.is_available() {
            // SAFETY: the processor has the instructions.
            check(unsafe { Avx2::new() });
        }
        if InstructionSet::Avx512.is_available() {
            // SAFETY: the processor has the instructions.
            check(unsafe { Avx512::new() });
        }
    }
}
