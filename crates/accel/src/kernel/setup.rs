//! What traversals need of rays, found out for eight rays at a time.
//!
//! The numbers of a kind are computed side by side, and then turned around so that those of a ray lie together. They are the same
//! bits as those of [`Slabs::new`] and [`Shear::new`], which take a ray as long as two nodes.

use super::leaves::Shear;
use super::{Best, Slabs};
use crate::layout::{Plane, WIDTH};
use crate::ray::{MISS, Ray};
use crate::simd::Simd;
use crate::streams::{RayLanes, RayStream};

/// What the traversal of a tree needs of one ray.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Setup {
    /// For the boxes of the tree's nodes.
    pub slabs: Slabs,
    /// For triangles in its leaves.
    pub shear: Shear,
    /// See [`Ray::t_max`].
    pub t_max: f32,
}

/// The numbers of a [`Setup`], in whole vectors.
type Words = [[f32; WIDTH]; 3];

const _: () = assert!(size_of::<Setup>() == size_of::<Words>() && align_of::<Setup>() >= align_of::<Words>());

impl Setup {
    /// Of a ray in a tree whose coordinates have at most the magnitude `extent`, by axis.
    #[inline(always)]
    pub fn new(ray: &Ray, extent: &[f32; 3]) -> Self {
        Setup { slabs: Slabs::new(ray, extent), shear: Shear::new(ray), t_max: ray.t_max }
    }

    /// Of a ray that may hit nothing.
    pub fn nothing() -> Self {
        Setup::new(&Ray { t_max: -1.0, ..Ray::new([0.0; 3], [0.0, 0.0, 1.0]) }, &[0.0; 3])
    }

    /// Where the search begins.
    #[inline(always)]
    pub fn best(&self) -> Best {
        Best { hit: MISS, t_max: self.t_max }
    }
}

#[inline(always)]
pub(super) fn abs<S: Simd>(s: S, x: S::F) -> S::F {
    s.max(x, s.sub(s.splat(0.0), x))
}

/// The coordinates of eight vectors.
#[inline(always)]
pub(super) fn vectors<S: Simd>(s: S, [x, y, z]: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
    [s.load(x), s.load(y), s.load(z)]
}

/// All that a ray is made of, in the order of its fields.
#[inline(always)]
fn row<S: Simd>(s: S, ray: &Ray) -> S::F {
    s.load(bytemuck::cast_ref(ray))
}

/// Eight rays, each number of all beside each other.
pub(super) struct EightRays<S: Simd> {
    /// See [`Slabs`].
    pub inverse: [S::F; 3],
    pub near_offset: [S::F; 3],
    pub far_offset: [S::F; 3],
    /// Along which axes the rays go down.
    pub down: [S::M; 3],
    pub t_min: S::F,
    pub t_max: S::F,
    pub shears: Shears<S>,
    /// Which of them may hit anything, as bits; see [`Ray::is_valid`].
    pub valid: u32,
}

impl<S: Simd> EightRays<S> {
    /// Those from `first` on; what is beyond the end is not valid. `lanes` is memory to be used. `extent`: as of [`Slabs::new`].
    #[inline(always)]
    pub fn load(
        s: S,
        rays: &(impl RayStream + ?Sized),
        first: usize,
        lanes: &mut RayLanes,
        extent: &[f32; 3],
    ) -> Self {
        if let Some([a, b, c, d, e, f, g, h]) = rays.rows(first) {
            let rows = s.transposed([
                row(s, a),
                row(s, b),
                row(s, c),
                row(s, d),
                row(s, e),
                row(s, f),
                row(s, g),
                row(s, h),
            ]);
            let [ox, oy, oz, t_min, dx, dy, dz, t_max] = rows;
            return Self::from_vectors(s, [ox, oy, oz], [dx, dy, dz], t_min, t_max, extent);
        }
        rays.load(first, lanes);
        Self::new(s, lanes, extent)
    }

    /// `extent`: as of [`Slabs::new`].
    #[inline(always)]
    pub fn new(s: S, rays: &RayLanes, extent: &[f32; 3]) -> Self {
        let (origin, direction) = (vectors(s, &rays.origin), vectors(s, &rays.direction));
        let (t_min, t_max) = (s.load(&rays.t_min), s.load(&rays.t_max));
        Self::from_vectors(s, origin, direction, t_min, t_max, extent)
    }

    #[inline(always)]
    fn from_vectors(
        s: S,
        origin: [S::F; 3],
        direction: [S::F; 3],
        t_min: S::F,
        t_max: S::F,
        extent: &[f32; 3],
    ) -> Self {
        let zero = s.splat(0.0);
        let (x, y, z) = (abs(s, direction[0]), abs(s, direction[1]), abs(s, direction[2]));
        let longest = s.max(s.max(x, y), z);
        let tiny = s.max(s.mul(longest, s.splat(1e-24)), s.splat(1e-37));
        let t_begin = s.max(t_min, zero);
        // Comparisons with NaN are false.
        let mut valid = s.and(s.and(s.lt(zero, longest), s.lt(t_begin, t_max)), s.le(t_min, t_min));
        let largest = s.splat(f32::MAX);
        let [mut inverse, mut near_offset, mut far_offset] = [[zero; 3]; 3];
        let mut down = [s.lt(zero, zero); 3];
        for axis in 0..3 {
            // As in `Slabs::new`.
            let (o, d) = (origin[axis], direction[axis]);
            valid = s.and(valid, s.and(s.le(abs(s, o), largest), s.le(abs(s, d), largest)));
            let d = s.select(s.lt(abs(s, d), tiny), d, s.flip_sign(tiny, d));
            inverse[axis] = s.div(s.splat(1.0), d);
            let offset = s.mul(o, inverse[axis]);
            let size = s.add(abs(s, o), s.splat(extent[axis]));
            let error = s.mul(s.mul(size, abs(s, inverse[axis])), s.splat(4.0 * f32::EPSILON));
            near_offset[axis] = s.sub(s.sub(zero, offset), error);
            far_offset[axis] = s.sub(error, offset);
            down[axis] = s.lt(inverse[axis], zero);
        }
        let shears = Shears::new(s, origin, direction);
        EightRays {
            inverse,
            near_offset,
            far_offset,
            down,
            t_min: t_begin,
            t_max,
            shears,
            valid: s.bits(valid),
        }
    }

    /// Writes down what each ray needs.
    #[inline(always)]
    pub fn write(&self, s: S, to: &mut [Setup; WIDTH]) {
        let [[ix, iy, iz], [nx, ny, nz], [fx, fy, fz]] = [self.inverse, self.near_offset, self.far_offset];
        let [px, py, pz] = [self.near_plane(s, 0), self.near_plane(s, 1), self.near_plane(s, 2)];
        let [au, av, aw] = self.shears.axes.numbers(s);
        let ([ou, ov, ow], [su, sv, sw]) = (self.shears.origin, self.shears.shear);
        // In the order of the numbers of a `Setup`.
        let rows = [
            s.transposed([ix, iy, iz, nx, ny, nz, fx, fy]),
            s.transposed([fz, px, py, pz, self.t_min, au, av, aw]),
            s.transposed([ou, ov, ow, su, sv, sw, self.t_min, self.t_max]),
        ];
        for (ray, setup) in to.iter_mut().enumerate() {
            // SAFETY: a `Setup` is twenty-four numbers of four bytes and has the alignment, see the assertion above. Its planes and axes
            // are written as such numbers, too: rows of what `Plane::new` and `Axes::numbers` give.
            let words = unsafe { &mut *std::ptr::from_mut(setup).cast::<Words>() };
            for (row, word) in rows.iter().zip(words) {
                s.store(row[ray], word);
            }
        }
    }

    /// See [`Slabs`]: the number of each ray's plane.
    #[inline(always)]
    fn near_plane(&self, s: S, axis: usize) -> S::F {
        let [low, high] = [Plane::new(axis, 0).number(), Plane::new(axis, 1).number()];
        s.bits_as_f(s.select_u(self.down[axis], s.splat_u(low), s.splat_u(high)))
    }
}

/// What moves points into the space in which eight rays run along the third axis: [`Shear`] in lanes.
pub(super) struct Shears<S: Simd> {
    pub axes: Axes<S>,
    /// The origin's coordinates in the order of the axes.
    pub origin: [S::F; 3],
    pub shear: [S::F; 3],
}

impl<S: Simd> Shears<S> {
    #[inline(always)]
    pub fn new(s: S, origin: [S::F; 3], direction: [S::F; 3]) -> Self {
        let (x, y, z) = (abs(s, direction[0]), abs(s, direction[1]), abs(s, direction[2]));
        // The longest component, as `Shear::new` chooses it.
        let axes = Axes { along_y: s.and(s.lt(x, y), s.le(z, y)), along_z: s.and(s.lt(x, z), s.lt(y, z)) };
        let [u, v, w] = axes.ordered(s, direction);
        let inverse = s.div(s.splat(1.0), w);
        let origin = axes.ordered(s, origin);
        Shears { axes, origin, shear: [s.mul(u, inverse), s.mul(v, inverse), inverse] }
    }

    /// A point relative to the rays' origins, sheared.
    #[inline(always)]
    pub fn apply(&self, s: S, point: [S::F; 3]) -> [S::F; 3] {
        let [x, y, z] = self.axes.ordered(s, point);
        let [x, y, z] = [s.sub(x, self.origin[0]), s.sub(y, self.origin[1]), s.sub(z, self.origin[2])];
        [s.neg_mul_add(self.shear[0], z, x), s.neg_mul_add(self.shear[1], z, y), z]
    }
}

/// Which axis is each ray's third: x where it is neither of these.
pub(super) struct Axes<S: Simd> {
    along_y: S::M,
    along_z: S::M,
}

impl<S: Simd> Axes<S> {
    /// Coordinates in the order of the axes.
    #[inline(always)]
    fn ordered(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        let (along_y, along_z) = (self.along_y, self.along_z);
        [
            s.select(along_z, s.select(along_y, y, z), x),
            s.select(along_z, s.select(along_y, z, x), y),
            s.select(along_z, s.select(along_y, x, y), z),
        ]
    }

    /// Which rays have another third axis than this one, as bits.
    #[inline(always)]
    pub fn bits_other_than(&self, s: S, third: usize) -> u32 {
        let (along_y, along_z) = (s.bits(self.along_y), s.bits(self.along_z));
        match third {
            0 => along_y | along_z,
            1 => along_y ^ 255,
            _ => along_z ^ 255,
        }
    }

    /// The axes in order: 0, 1 and 2 in bits.
    #[inline(always)]
    fn numbers(&self, s: S) -> [S::F; 3] {
        let [x, y, z] = [s.bits_as_f(s.splat_u(0)), s.bits_as_f(s.splat_u(1)), s.bits_as_f(s.splat_u(2))];
        self.ordered(s, [x, y, z])
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::Kernel;
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

    /// All numbers of a setup, as bits, but for the sign of zeros.
    fn numbers(setup: &Setup) -> Vec<u32> {
        let Setup { slabs, shear, t_max } = setup;
        let floats = [slabs.inverse, slabs.near_offset, slabs.far_offset];
        let mut all: Vec<f32> = floats.concat();
        all.extend(shear.numbers());
        all.extend([slabs.t_min, *t_max]);
        let planes = slabs.near_plane.map(Plane::number);
        all.iter().map(|x| (x + 0.0).to_bits()).chain(planes).chain(shear.axes()).collect()
    }

    fn check<S: Simd>(s: S) {
        let (rays, extent) = (rays(), [7.0, 0.5, 1000.0]);
        let mut valid = 0;
        for eight in rays.chunks(WIDTH) {
            let mut lanes = RayLanes::NOTHING;
            eight.load(0, &mut lanes);
            for all in [
                EightRays::new(s, &lanes, &extent),
                EightRays::load(s, eight, 0, &mut lanes.clone(), &extent),
            ] {
                let mut setups = [Setup::nothing(); WIDTH];
                all.write(s, &mut setups);
                for (lane, ray) in eight.iter().enumerate() {
                    assert_eq!(all.valid >> lane & 1 != 0, ray.is_valid(), "{ray:?}");
                    if ray.is_valid() {
                        assert_eq!(numbers(&setups[lane]), numbers(&Setup::new(ray, &extent)), "{ray:?}");
                        valid += 1;
                    }
                }
                assert_eq!(all.valid >> eight.len(), 0, "lanes without a ray");
            }
        }
        assert!(valid > 1600, "{valid} rays were compared");
    }

    #[test]
    fn eight_rays_are_set_up_as_each_is_alone() {
        if Kernel::Avx2.is_available() {
            // SAFETY: the processor has the instructions.
            check(unsafe { Avx2::new() });
        }
        if Kernel::Avx512.is_available() {
            // SAFETY: the processor has the instructions.
            check(unsafe { Avx512::new() });
        }
    }
}
