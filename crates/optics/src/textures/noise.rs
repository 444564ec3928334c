//! Noise over three-dimensional space.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod noise {
    use crate::random::*;
    use wgsl_rs::std::*;

    /// A kind of noise: random values of the lattice, interpolated.
    pub const NOISE_VALUE: u32 = 0u32;
    /// A kind of noise: random gradients of the lattice (Perlin 2002).
    pub const NOISE_PERLIN: u32 = 1u32;
    /// A kind of noise: random gradients at the corners of tetrahedra (Perlin 2001).
    pub const NOISE_SIMPLEX: u32 = 2u32;

    /// The most octaves that are summed.
    pub const MOST_OCTAVES: u32 = 16u32;

    /// How octaves are summed; see [`fractal_noise`].
    #[derive(Clone, Copy, Debug)]
    pub struct Fractal {
        /// `NOISE_…`.
        pub kind: u32,
        /// Number of octaves, in `[1, MOST_OCTAVES]`; the last one may count in part.
        pub octaves: f32,
        /// Frequency of an octave over that of the one before.
        pub lacunarity: f32,
        /// Amplitude of an octave over that of the one before.
        pub gain: f32,
        /// Whether magnitudes are summed (Perlin's turbulence).
        pub turbulent: bool,
        /// Changes the noise.
        pub seed: u32,
    }

    /// The integer below `x`, for all that floats can be.
    pub fn lattice_floor(x: f32) -> i32 {
        i32(clamp(floor(x), -1e9, 1e9))
    }

    /// Hash of a point of the integer lattice.
    pub fn lattice_hash(x: i32, y: i32, z: i32, seed: u32) -> u32 {
        hash_combine(hash_combine(hash_combine(seed, bitcast_u32(x)), bitcast_u32(y)), bitcast_u32(z))
    }

    /// Perlin's fade: 0 at 0, 1 at 1, first and second derivative zero at both.
    pub fn perlin_fade(t: f32) -> f32 {
        t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
    }

    /// One of twelve gradients, towards the edges of a cube, times `p`. `hash`: chooses it.
    /// Source: Perlin, "Improving Noise", SIGGRAPH 2002.
    pub fn gradient_dot(hash: u32, p: Vec3f) -> f32 {
        let h = hash >> 28u32;
        let u = select(p.y, p.x, h < 8u32);
        let v = select(select(p.z, p.x, h == 12u32 || h == 14u32), p.y, h < 4u32);
        select(u, 0.0 - u, (h & 1u32) != 0u32) + select(v, 0.0 - v, (h & 2u32) != 0u32)
    }

    /// A corner's part of the noise at `p`, which is relative to the corner.
    pub fn lattice_corner(hash: u32, p: Vec3f, kind: u32) -> f32 {
        if kind == NOISE_VALUE {
            return 2.0 * unit_float(hash) - 1.0;
        }
        gradient_dot(hash, p)
    }

    /// Noise of the integer lattice, in `[-1, 1]`. `kind`: [`NOISE_VALUE`] or [`NOISE_PERLIN`].
    pub fn lattice_noise(p: Vec3f, kind: u32, seed: u32) -> f32 {
        let x = lattice_floor(p.x);
        let y = lattice_floor(p.y);
        let z = lattice_floor(p.z);
        let f = vec3f(p.x - floor(p.x), p.y - floor(p.y), p.z - floor(p.z));
        let w = vec3f(perlin_fade(f.x), perlin_fade(f.y), perlin_fade(f.z));
        let mut planes = vec2f(0.0, 0.0);
        let mut i = 0;
        while i < 2 {
            let d = f.z - f32(i);
            let c00 = lattice_corner(lattice_hash(x, y, z + i, seed), vec3f(f.x, f.y, d), kind);
            let c10 = lattice_corner(lattice_hash(x + 1, y, z + i, seed), vec3f(f.x - 1.0, f.y, d), kind);
            let c01 = lattice_corner(lattice_hash(x, y + 1, z + i, seed), vec3f(f.x, f.y - 1.0, d), kind);
            let c11 =
                lattice_corner(lattice_hash(x + 1, y + 1, z + i, seed), vec3f(f.x - 1.0, f.y - 1.0, d), kind);
            let near = c00 + (c10 - c00) * w.x;
            let far = c01 + (c11 - c01) * w.x;
            planes = vec2f(planes.y, near + (far - near) * w.y);
            i += 1;
        }
        planes.x + (planes.y - planes.x) * w.z
    }

    /// A corner's part of simplex noise. `offset`: of the corner in its cube, zeros and ones; `cell`: the cube; `p`:
    /// relative to the corner.
    pub fn simplex_corner(cell: Vec3f, offset: Vec3f, p: Vec3f, seed: u32) -> f32 {
        let t = 0.6 - dot(p, p);
        if t <= 0.0 {
            return 0.0;
        }
        let c = cell + offset;
        let hash = lattice_hash(lattice_floor(c.x), lattice_floor(c.y), lattice_floor(c.z), seed);
        t * t * t * t * gradient_dot(hash, p)
    }

    /// Simplex noise in `[-1, 1]`.
    /// Source: Perlin, "Noise hardware", 2001; Gustavson, "Simplex noise demystified", 2005.
    pub fn simplex_noise(p: Vec3f, seed: u32) -> f32 {
        let skew = (p.x + p.y + p.z) * (1.0 / 3.0);
        let cell = vec3f(floor(p.x + skew), floor(p.y + skew), floor(p.z + skew));
        let unskew = (cell.x + cell.y + cell.z) * (1.0 / 6.0);
        let p0 = vec3f(p.x - cell.x + unskew, p.y - cell.y + unskew, p.z - cell.z + unskew);
        // The order of the coordinates says in which of six tetrahedra of the cube the point is.
        let xy = select(0.0, 1.0, p0.x >= p0.y);
        let yz = select(0.0, 1.0, p0.y >= p0.z);
        let xz = select(0.0, 1.0, p0.x >= p0.z);
        let o1 = vec3f(xy * xz, (1.0 - xy) * yz, (1.0 - xz) * (1.0 - yz));
        let o2 = vec3f(max(xy, xz), max(1.0 - xy, yz), max(1.0 - xz, 1.0 - yz));
        let p1 = p0 - o1 + vec3f(1.0, 1.0, 1.0) * (1.0 / 6.0);
        let p2 = p0 - o2 + vec3f(1.0, 1.0, 1.0) * (1.0 / 3.0);
        let p3 = p0 - vec3f(0.5, 0.5, 0.5);
        let sum = simplex_corner(cell, vec3f(0.0, 0.0, 0.0), p0, seed)
            + simplex_corner(cell, o1, p1, seed)
            + simplex_corner(cell, o2, p2, seed)
            + simplex_corner(cell, vec3f(1.0, 1.0, 1.0), p3, seed);
        clamp(32.0 * sum, -1.0, 1.0)
    }

    /// One octave of noise, in `[-1, 1]`, with mean 0.
    pub fn single_noise(p: Vec3f, kind: u32, seed: u32) -> f32 {
        if kind == NOISE_SIMPLEX {
            return simplex_noise(p, seed);
        }
        lattice_noise(p, kind, seed)
    }

    /// How much of an octave is left after filtering: all where its waves are wide, nothing where several fall within the
    /// footprint. `width`: of the footprint in waves.
    pub fn octave_share(width: f32) -> f32 {
        let t = saturate((width - 0.25) * 2.0);
        1.0 - t * t * (3.0 - 2.0 * t)
    }

    /// Mean magnitude of an octave: what is left of turbulence where it is too fine to be seen.
    pub fn mean_magnitude(kind: u32) -> f32 {
        if kind == NOISE_PERLIN {
            return 0.2;
        }
        select(0.33, 0.35, kind == NOISE_SIMPLEX)
    }

    /// Octaves of noise over the sum of their amplitudes: in `[-1, 1]`, of turbulence in `[0, 1]`.
    ///
    /// Octaves that are too fine for the footprint give way to their mean (Musgrave, in Ebert et al., "Texturing and
    /// Modeling", chapter 2). `width`: of the footprint, in the units of `p`.
    pub fn fractal_noise(f: Fractal, p: Vec3f, width: f32) -> f32 {
        let octaves = clamp(f.octaves, 1.0, f32(MOST_OCTAVES));
        let mut sum = 0.0;
        let mut total = 0.0;
        let mut amplitude = 1.0;
        let mut frequency = 1.0;
        let mut i = 0u32;
        while f32(i) < octaves {
            let weight = amplitude * min(octaves - f32(i), 1.0);
            let share = octave_share(width * frequency);
            let mean = select(0.0, mean_magnitude(f.kind), f.turbulent);
            let mut value = mean;
            if share > 0.0 {
                // Another seed for each octave: their lattices have the origin in common.
                let n = single_noise(p * frequency, f.kind, f.seed + i * 0x9e3779b9u32);
                value = mean + (select(n, abs(n), f.turbulent) - mean) * share;
            }
            sum += weight * value;
            total += weight;
            amplitude *= f.gain;
            frequency *= f.lacunarity;
            i += 1u32;
        }
        sum / max(total, 1e-20)
    }
}

#[cfg(test)]
mod tests {
    use super::noise::*;
    use wgsl_rs::std::*;

    const KINDS: [u32; 3] = [NOISE_VALUE, NOISE_PERLIN, NOISE_SIMPLEX];

    fn point(i: u32) -> Vec3f {
        let at = |k: f32| (i as f32 * k).fract() * 200.0 - 100.0;
        vec3f(at(0.618_034), at(0.754_877_7), at(0.569_840_3))
    }

    #[test]
    fn noise_has_its_range_and_mean() {
        for kind in KINDS {
            let values: Vec<f32> = (0..40_000).map(|i| single_noise(point(i), kind, 7)).collect();
            assert!(values.iter().all(|v| v.abs() <= 1.0), "{kind}");
            let mean = values.iter().sum::<f32>() / values.len() as f32;
            let magnitude = values.iter().map(|v| v.abs()).sum::<f32>() / values.len() as f32;
            assert!(mean.abs() < 0.02, "{kind}: {mean}");
            assert!((magnitude - mean_magnitude(kind)).abs() < 0.03, "{kind}: {magnitude}");
            let largest = values.iter().fold(0.0f32, |a, v| a.max(v.abs()));
            assert!(largest > 0.7, "{kind}: {largest}");
        }
    }

    /// Small steps change little, also across the faces of cells.
    #[test]
    fn noise_is_continuous() {
        for kind in KINDS {
            for i in 0..20_000 {
                let p = point(i);
                let p = if i % 3 == 0 { vec3f(p.x.round(), p.y, p.z) } else { p };
                let step = vec3f(1e-3, 1e-3, -1e-3);
                let change = single_noise(p + step, kind, 1) - single_noise(p - step, kind, 1);
                assert!(change.abs() < 0.03, "{kind} at {p:?}: {change}");
            }
        }
    }

    #[test]
    fn seeds_differ_and_huge_coordinates_are_no_fault() {
        for kind in KINDS {
            let p = vec3f(0.3, 0.6, 0.2);
            assert_ne!(single_noise(p, kind, 1), single_noise(p, kind, 2));
            for x in [1e30, -1e30, f32::MAX] {
                assert!(!single_noise(vec3f(x, 0.5, 0.5), kind, 1).is_infinite());
            }
        }
    }

    /// Seen from afar, a fractal is its mean.
    #[test]
    fn octaves_that_are_too_fine_give_way_to_their_mean() {
        for kind in KINDS {
            for turbulent in [false, true] {
                let f = Fractal { kind, octaves: 5.5, lacunarity: 2.0, gain: 0.5, turbulent, seed: 3 };
                let n = 20_000;
                let mean = (0..n).map(|i| fractal_noise(f, point(i), 0.0)).sum::<f32>() / n as f32;
                let far = fractal_noise(f, point(1), 100.0);
                assert!((mean - far).abs() < 0.03, "{kind} {turbulent}: {mean} {far}");
            }
        }
    }
}
