//! Random numbers as pure functions of (pixel, sample index, dimension, seed).

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod random {
    use wgsl_rs::std::*;

    /// How a [`PixelSampler`] draws: independent uniform numbers.
    pub const SAMPLER_INDEPENDENT: u32 = 0u32;
    /// How a [`PixelSampler`] draws: Owen-scrambled Sobol points.
    pub const SAMPLER_SOBOL: u32 = 1u32;

    /// Draws the random numbers of one sample of one pixel. Immutable: a number depends on this and on the dimension
    /// asked for, on nothing else, so samples are the same however a picture is split into work.
    #[derive(Clone, Copy, Debug)]
    pub struct PixelSampler {
        /// [`SAMPLER_INDEPENDENT`] or [`SAMPLER_SOBOL`].
        pub kind: u32,
        /// Hash of pixel and seed.
        pub scramble: u32,
        /// Sample index, with its bits reversed for Sobol points.
        pub index: u32,
    }

    /// PCG output permutation used as an integer hash.
    /// Source: Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
    pub fn pcg_hash(x: u32) -> u32 {
        let state = x * 747796405u32 + 2891336453u32;
        let word = ((state >> ((state >> 28u32) + 4u32)) ^ state) * 277803737u32;
        (word >> 22u32) ^ word
    }

    /// Mixes a value into a hash; not commutative.
    pub fn hash_combine(hash: u32, value: u32) -> u32 {
        pcg_hash(hash ^ (value * 0x9e3779b9u32 + 0x7f4a7c15u32))
    }

    /// Uniform number in `[0, 1)` from the upper 24 bits.
    pub fn unit_float(bits: u32) -> f32 {
        f32(bits >> 8u32) * 5.9604644775390625e-8
    }

    /// A number in `[0, 1)` from the last bits of two others: what to go on with where they have been used up.
    pub fn dither(a: f32, b: f32) -> f32 {
        unit_float(hash_combine(bitcast_u32(a), bitcast_u32(b)))
    }

    /// A sampler for one sample.
    ///
    /// - `pixel`: pixel index (any numbering that is unique in the picture).
    /// - `sample_index`: which sample of the pixel, from 0.
    /// - `seed`: changes the whole picture's noise.
    pub fn sampler_new(kind: u32, pixel: u32, sample_index: u32, seed: u32) -> PixelSampler {
        let scramble = hash_combine(hash_combine(seed, 0x51633e2du32), pixel);
        PixelSampler {
            kind: kind,
            scramble: scramble,
            index: select(sample_index, reverse_bits(sample_index), kind == SAMPLER_SOBOL),
        }
    }

    /// The Laine–Karras permutation: a hash in which each bit depends only on itself and lower ones, which is Owen
    /// scrambling in bit-reversed order.
    /// Source: Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, with the constants of N. Vegdahl,
    /// "Building a Better LK Hash", 2021.
    pub fn laine_karras(x: u32, seed: u32) -> u32 {
        let a = x ^ (x * 0x3d20adeau32);
        let b = a + seed;
        let c = b * ((seed >> 16u32) | 1u32);
        let d = c ^ (c * 0x05526c56u32);
        d ^ (d * 0x53a22864u32)
    }

    /// The second dimension of the Sobol sequence with its bits reversed, for a point whose index is `index`.
    ///
    /// The generator matrix is Pascal's triangle modulo 2, which factors into five shift-and-xor steps.
    /// Source: Ahmed, "An Implementation Algorithm of 2D Sobol Sequence Fast, Elegant, and Compact", EGSR 2024.
    pub fn sobol_second_reversed(index: u32) -> u32 {
        let a = index ^ ((index & 0xaaaaaaaau32) >> 1u32);
        let b = a ^ ((a & 0xccccccccu32) >> 2u32);
        let c = b ^ ((b & 0xf0f0f0f0u32) >> 4u32);
        let d = c ^ ((c & 0xff00ff00u32) >> 8u32);
        d ^ (d >> 16u32)
    }

    /// Two uniform numbers in `[0, 1)`² for dimension pair `pair` of a sample.
    ///
    /// With [`SAMPLER_SOBOL`] the points of a pixel for one pair are a (0, 2)-sequence: shuffled and scrambled anew for
    /// each pair and pixel ("padding", Burley 2020, section 4), so that pairs are independent of each other.
    pub fn sample_2d(s: PixelSampler, pair: u32) -> Vec2f {
        let seed = hash_combine(s.scramble, pair);
        let seed_y = seed * 0x2c1b3c6du32 + 0x297a2d39u32;
        if s.kind == SAMPLER_SOBOL {
            let index = reverse_bits(laine_karras(s.index, seed ^ 0xa511e9b3u32));
            let x = reverse_bits(laine_karras(index, seed));
            let y = reverse_bits(laine_karras(sobol_second_reversed(index), seed_y));
            return vec2f(unit_float(x), unit_float(y));
        }
        let x = hash_combine(seed, s.index);
        let y = pcg_hash(x ^ seed_y);
        vec2f(unit_float(x), unit_float(y))
    }
}

#[cfg(test)]
mod tests {
    use super::random::*;

    fn points(kind: u32, pixel: u32, pair: u32, n: u32) -> Vec<[f32; 2]> {
        (0..n).map(|i| sample_2d(sampler_new(kind, pixel, i, 7), pair)).map(|p| [p.x, p.y]).collect()
    }

    #[test]
    fn numbers_are_in_the_unit_interval() {
        for kind in [SAMPLER_INDEPENDENT, SAMPLER_SOBOL] {
            for p in points(kind, 3, 5, 10_000) {
                assert!(p.iter().all(|x| (0.0..1.0).contains(x)), "{p:?}");
            }
        }
    }

    /// Every elementary interval of volume 2⁻ᵐ of the first 2ᵐ points holds exactly one point: the defining property
    /// of a (0, m, 2)-net, which Owen scrambling and index shuffling keep.
    #[test]
    fn sobol_points_are_a_net() {
        for (pixel, pair) in [(0, 0), (1, 0), (77, 3), (1000, 12)] {
            for m in [4u32, 8] {
                let points = points(SAMPLER_SOBOL, pixel, pair, 1 << m);
                for split in 0..=m {
                    let (nx, ny) = (1u32 << split, 1u32 << (m - split));
                    let mut seen = vec![0; 1 << m];
                    for p in &points {
                        let cell = (p[0] * nx as f32) as u32 + nx * (p[1] * ny as f32) as u32;
                        seen[cell as usize] += 1;
                    }
                    assert!(seen.iter().all(|&n| n == 1), "pixel {pixel}, pair {pair}: {nx}×{ny} strata");
                }
            }
        }
    }

    #[test]
    fn means_and_correlations_are_those_of_uniform_numbers() {
        for kind in [SAMPLER_INDEPENDENT, SAMPLER_SOBOL] {
            // One sample from each of many pixels: independent whatever the sampler.
            let n = 200_000;
            let (mut sum, mut product, mut across) = (0.0f64, 0.0f64, 0.0f64);
            for pixel in 0..n {
                let s = sampler_new(kind, pixel, pixel % 13, 1);
                let (a, b) = (sample_2d(s, 0), sample_2d(s, 1));
                sum += f64::from(a.x);
                product += f64::from(a.x - 0.5) * f64::from(a.y - 0.5);
                across += f64::from(a.x - 0.5) * f64::from(b.x - 0.5);
            }
            let n = f64::from(n);
            // Standard errors: √(1/12/n) = 6.5e-4 for the mean, 1/12/√n = 1.9e-4 for the products; 4.5 of each.
            assert!((sum / n - 0.5).abs() < 2.9e-3, "kind {kind}: mean {}", sum / n);
            assert!((product / n).abs() < 8.4e-4, "kind {kind}: x–y correlation {}", product / n);
            assert!((across / n).abs() < 8.4e-4, "kind {kind}: correlation of pairs {}", across / n);
        }
    }

    #[test]
    fn pairs_of_one_pixel_are_uncorrelated() {
        for kind in [SAMPLER_INDEPENDENT, SAMPLER_SOBOL] {
            let mut worst = 0.0f64;
            for pair in 1..20 {
                let mut sum = 0.0f64;
                let mut n = 0.0f64;
                for pixel in 0..64 {
                    for i in 0..256 {
                        let s = sampler_new(kind, pixel, i, 0);
                        sum += f64::from(sample_2d(s, 0).x - 0.5) * f64::from(sample_2d(s, pair).x - 0.5);
                        n += 1.0;
                    }
                }
                worst = worst.max((sum / n).abs());
            }
            // Standard error 1/12/√16384 = 6.5e-4; the largest of 19 stays below 4.5 of them.
            assert!(worst < 2.9e-3, "kind {kind}: correlation {worst}");
        }
    }

    #[test]
    fn integration_error_falls_faster_than_with_independent_numbers() {
        let error = |kind| {
            let mut square_sum = 0.0f64;
            for pixel in 0..64 {
                let n = 256;
                let values = points(kind, pixel, 2, n);
                let mean: f64 =
                    values.iter().map(|p| f64::from(p[0] * p[0] * p[1])).sum::<f64>() / f64::from(n);
                square_sum += (mean - 1.0 / 6.0).powi(2);
            }
            (square_sum / 64.0).sqrt()
        };
        let (independent, sobol) = (error(SAMPLER_INDEPENDENT), error(SAMPLER_SOBOL));
        assert!(sobol < independent / 8.0, "sobol {sobol}, independent {independent}");
    }
}
