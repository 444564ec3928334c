//! Random numbers as pure functions of (pixel, sample index, dimension, seed).

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod random {
    use crate::constants::*;
    use wgsl_rs::std::*;

    /// How a [`PixelSampler`] draws: independent uniform numbers.
    pub const SAMPLER_INDEPENDENT: u32 = 0u32;
    /// How a [`PixelSampler`] draws: Owen-scrambled Sobol points.
    pub const SAMPLER_SOBOL: u32 = 1u32;
    /// How a [`PixelSampler`] draws: Sobol points for the samples of a pixel and for pixels that are neighbours.
    pub const SAMPLER_BLUE_NOISE: u32 = 2u32;

    /// Draws the random numbers of one sample of one pixel. Immutable: a number depends on this and on the dimension
    /// asked for, on nothing else, so samples are the same however a picture is split into work.
    #[derive(Clone, Copy, Debug)]
    pub struct PixelSampler {
        /// [`SAMPLER_INDEPENDENT`], [`SAMPLER_SOBOL`] or [`SAMPLER_BLUE_NOISE`].
        pub kind: u32,
        /// Hash of pixel and seed; for [`SAMPLER_BLUE_NOISE`] the pixel's place on the shuffled Z-order curve, with its
        /// bits reversed.
        pub scramble: u32,
        /// Sample index, with its bits reversed unless numbers are independent.
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

    /// A number in `[0, 1)` from the part `index` of `count` equal ones. `jitter`: where in it, in `[0, 1)`.
    pub fn stratified_number(index: u32, jitter: f32, count: u32) -> f32 {
        min((f32(index) + jitter) / f32(count), ONE_MINUS_EPSILON)
    }

    /// A number in `[0, 1)` from the last bits of two others: what to go on with where they have been used up.
    pub fn dither(a: f32, b: f32) -> f32 {
        unit_float(hash_combine(bitcast_u32(a), bitcast_u32(b)))
    }

    /// A sampler for one sample.
    ///
    /// - `x`, `y`: the pixel, `width`: pixels of a row of the picture. All below 65,536.
    /// - `sample_index`: which sample of the pixel, from 0.
    /// - `seed`: changes the whole picture's noise.
    pub fn sampler_new(kind: u32, x: u32, y: u32, width: u32, sample_index: u32, seed: u32) -> PixelSampler {
        let seed_of_all = hash_combine(seed, 0x51633e2du32);
        if kind == SAMPLER_BLUE_NOISE {
            let place = laine_karras(reverse_bits(z_order(x, y)), seed_of_all);
            return PixelSampler { kind: kind, scramble: place, index: reverse_bits(sample_index) };
        }
        PixelSampler {
            kind: kind,
            scramble: hash_combine(seed_of_all, y * width + x),
            index: select(sample_index, reverse_bits(sample_index), kind == SAMPLER_SOBOL),
        }
    }

    /// The place of pixel (`x`, `y`), both below 65,536, on the Z-order curve: their bits in turns. Aligned squares of 4ᵐ
    /// pixels are consecutive on it.
    /// Source: Morton 1966.
    pub fn z_order(x: u32, y: u32) -> u32 {
        spread_bits(x) | (spread_bits(y) << 1u32)
    }

    /// The lower 16 bits of `x` with a zero after each.
    pub fn spread_bits(x: u32) -> u32 {
        let a = x & 0xffffu32;
        let b = (a | (a << 8u32)) & 0x00ff00ffu32;
        let c = (b | (b << 4u32)) & 0x0f0f0f0fu32;
        let d = (c | (c << 2u32)) & 0x33333333u32;
        (d | (d << 1u32)) & 0x55555555u32
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

    /// An Owen-scrambled Sobol point, shuffled among the points of its sequence; both by `seed`. `index` and the point have
    /// their bits reversed.
    pub fn sobol_point(index: u32, seed: u32) -> Vec2u {
        let shuffled = reverse_bits(laine_karras(index, seed ^ 0xa511e9b3u32));
        let seed_y = seed * 0x2c1b3c6du32 + 0x297a2d39u32;
        vec2u(laine_karras(shuffled, seed), laine_karras(sobol_second_reversed(shuffled), seed_y))
    }

    /// Permutes the four quarters of each square on the Z-order curve, on each level in a way of its own, by `seed`.
    ///
    /// Shuffling in base 2, as [`laine_karras`] does, always makes the same quarters opposites. Were that so for all pairs of
    /// dimensions, an error in two of them at once would be the same for neighbours instead of another. These are the linear
    /// maps of a quarter's two bits; together with the shuffling they are all 24 permutations.
    pub fn permute_quarters(place: u32, seed: u32) -> u32 {
        let bits = pcg_hash(seed);
        let others = pcg_hash(bits);
        let a = place & 0x55555555u32;
        let b = (place >> 1u32) & 0x55555555u32;
        let c = b ^ (a & bits);
        let d = a ^ (c & (bits >> 1u32));
        let e = c ^ (d & others);
        d | (e << 1u32)
    }

    /// Two uniform numbers in `[0, 1)`² for dimension pair `pair` of a sample.
    ///
    /// With [`SAMPLER_SOBOL`] the points of a pixel for one pair are a (0, 2)-sequence: shuffled and scrambled anew for
    /// each pair and pixel ("padding", Burley 2020, section 4), so that pairs are independent of each other.
    ///
    /// With [`SAMPLER_BLUE_NOISE`] a point is the exclusive or of two such points: one by the pixel's place on the Z-order
    /// curve, one by the sample's index. So the points of a pixel are a net, and those that the pixels of an aligned square of up
    /// to 16×16 have for one index are a net, too: what pixels lack, their neighbours have, and the error of a picture is of
    /// high frequency, which eyes and filters take away.
    /// Source: Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of
    /// Pixels", SIGGRAPH Asia 2020, for the order; Kollig and Keller, "Efficient Multidimensional Sampling", 2002, for the
    /// exclusive or, which takes a net to a net.
    pub fn sample_2d(s: PixelSampler, pair: u32) -> Vec2f {
        if s.kind == SAMPLER_INDEPENDENT {
            let seed = hash_combine(s.scramble, pair);
            let x = hash_combine(seed, s.index);
            let y = pcg_hash(x ^ (seed * 0x2c1b3c6du32 + 0x297a2d39u32));
            return vec2f(unit_float(x), unit_float(y));
        }
        let is_blue = s.kind == SAMPLER_BLUE_NOISE;
        // The curve's last eight bits are the place within a square of 16×16 pixels, which share their scrambling.
        let seed = hash_combine(select(s.scramble, s.scramble & 0x00ffffffu32, is_blue), pair);
        let point = sobol_point(s.index, seed);
        if is_blue {
            let of_pixel = sobol_point(permute_quarters(s.scramble, seed), pcg_hash(seed));
            let x = reverse_bits(point.x ^ of_pixel.x);
            let y = reverse_bits(point.y ^ of_pixel.y);
            return vec2f(unit_float(x), unit_float(y));
        }
        vec2f(unit_float(reverse_bits(point.x)), unit_float(reverse_bits(point.y)))
    }
}

#[cfg(test)]
mod tests {
    use super::random::*;

    const ALL: [u32; 3] = [SAMPLER_INDEPENDENT, SAMPLER_SOBOL, SAMPLER_BLUE_NOISE];

    fn points(kind: u32, pixel: u32, pair: u32, n: u32) -> Vec<[f32; 2]> {
        (0..n)
            .map(|i| sample_2d(sampler_new(kind, pixel, 0, 1 << 16, i, 7), pair))
            .map(|p| [p.x, p.y])
            .collect()
    }

    #[test]
    fn numbers_are_in_the_unit_interval() {
        for kind in ALL {
            for p in points(kind, 3, 5, 10_000) {
                assert!(p.iter().all(|x| (0.0..1.0).contains(x)), "{p:?}");
            }
        }
    }

    /// Every elementary interval of volume 2⁻ᵐ holds exactly one of these 2ᵐ points: the defining property of a
    /// (0, m, 2)-net, which Owen scrambling, index shuffling and the exclusive or keep.
    fn assert_net(points: &[[f32; 2]], what: &str) {
        let m = points.len().trailing_zeros();
        for split in 0..=m {
            let (nx, ny) = (1u32 << split, 1u32 << (m - split));
            let mut seen = vec![0; 1 << m];
            for p in points {
                let cell = (p[0] * nx as f32) as u32 + nx * (p[1] * ny as f32) as u32;
                seen[cell as usize] += 1;
            }
            assert!(seen.iter().all(|&n| n == 1), "{what}: {nx}×{ny} strata");
        }
    }

    #[test]
    fn samples_of_a_pixel_are_a_net() {
        for kind in [SAMPLER_SOBOL, SAMPLER_BLUE_NOISE] {
            for (pixel, pair) in [(0, 0), (1, 0), (77, 3), (1000, 12)] {
                for m in [4u32, 8] {
                    let points = points(kind, pixel, pair, 1 << m);
                    assert_net(&points, &format!("kind {kind}, pixel {pixel}, pair {pair}"));
                }
            }
        }
    }

    /// The points of one sample index in the aligned square of `size`² pixels at (`x`, `y`).
    fn square(kind: u32, [x, y]: [u32; 2], size: u32, index: u32, pair: u32, seed: u32) -> Vec<[f32; 2]> {
        let pixels = (0..size * size).map(|i| [x + i % size, y + i / size]);
        let draw = |[x, y]: [u32; 2]| sample_2d(sampler_new(kind, x, y, 1920, index, seed), pair);
        pixels.map(draw).map(|p| [p.x, p.y]).collect()
    }

    #[test]
    fn neighbours_complete_each_other_in_blue_noise() {
        for (corner, size) in [([0, 0], 16), ([1904, 1056], 16), ([640, 72], 8), ([2, 6], 2)] {
            for (index, pair) in [(0, 0), (1, 2), (1000, 7)] {
                let points = square(SAMPLER_BLUE_NOISE, corner, size, index, pair, 3);
                assert_net(&points, &format!("{corner:?}, sample {index}, pair {pair}"));
            }
        }
    }

    /// The mean over a square of pixels errs much less than with points that know nothing of each other.
    #[test]
    fn blue_noise_has_little_error_of_low_frequency() {
        let error = |kind| {
            let squares = (0..256u32).map(|i| {
                let points = square(kind, [i % 16 * 8, i / 16 * 8], 8, 5, 4, i);
                let sum: f64 = points.iter().map(|p| f64::from(p[0] * p[0] * p[1])).sum();
                (sum / points.len() as f64 - 1.0 / 6.0).powi(2)
            });
            (squares.sum::<f64>() / 256.0).sqrt()
        };
        let (sobol, blue) = (error(SAMPLER_SOBOL), error(SAMPLER_BLUE_NOISE));
        assert!(blue < sobol / 4.0, "blue noise {blue}, pixels on their own {sobol}");
    }

    /// Over pictures with other seeds, each number is uniform and no two know of each other.
    #[test]
    fn seeds_of_blue_noise_are_independent_pictures() {
        let n = 100_000;
        let (mut sum, mut product, mut across) = (0.0f64, 0.0f64, 0.0f64);
        for seed in 0..n {
            let s = sampler_new(SAMPLER_BLUE_NOISE, 37, 11, 64, 9, seed);
            let (a, b) = (sample_2d(s, 0), sample_2d(s, 5));
            sum += f64::from(a.x);
            product += f64::from(a.x - 0.5) * f64::from(a.y - 0.5);
            across += f64::from(a.x - 0.5) * f64::from(b.x - 0.5);
        }
        let n = f64::from(n);
        // Standard errors: √(1/12/n) = 9.1e-4 for the mean, 1/12/√n = 2.6e-4 for the products; 4.5 of each.
        assert!((sum / n - 0.5).abs() < 4.1e-3, "mean {}", sum / n);
        assert!((product / n).abs() < 1.2e-3, "x–y correlation {}", product / n);
        assert!((across / n).abs() < 1.2e-3, "correlation of pairs {}", across / n);
    }

    #[test]
    fn means_and_correlations_are_those_of_uniform_numbers() {
        for kind in ALL {
            // One sample from each of many pixels: independent whatever the sampler.
            let n = 200_000;
            let (mut sum, mut product, mut across) = (0.0f64, 0.0f64, 0.0f64);
            for pixel in 0..n {
                let s = sampler_new(kind, pixel % 512, pixel / 512, 512, pixel % 13, 1);
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
        for kind in ALL {
            let mut worst = 0.0f64;
            for pair in 1..20 {
                let mut sum = 0.0f64;
                let mut n = 0.0f64;
                for pixel in 0..64 {
                    for i in 0..256 {
                        // Far enough from each other to share nothing.
                        let s = sampler_new(kind, 16 * pixel, 0, 1024, i, 0);
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
        let [independent, sobol, blue] = ALL.map(error);
        assert!(sobol < independent / 8.0, "sobol {sobol}, independent {independent}");
        assert!(blue < independent / 8.0, "blue noise {blue}, independent {independent}");
    }
}
