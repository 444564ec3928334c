//! Tables of directional albedo: what share of the light a microfacet lobe scatters, seen from one direction.
//!
//! Energy compensation divides by these numbers. They are integrals of the very functions that are rendered with, made
//! once at start; the CPU looks them up here, a GPU back end uploads `texels` as a texture.

use crate::dielectric::rough_dielectric_albedo_sample;
use crate::ggx::{albedo_coordinates, albedo_eta_coordinate, albedo_parameters, dielectric_compensation};
use crate::glossy::ggx_albedo_sample;
use crate::math::nearest_integer;
use crate::sheen::{sheen_albedo_coordinates, sheen_albedo_sample};
use crate::{Vec2f, vec2f};
use elementary::cos;
use std::sync::OnceLock;

/// Directional albedo of the GGX reflection lobe, over cosine and width.
#[derive(Debug)]
pub struct GgxAlbedo {
    texels: Vec<[f32; 2]>,
}

impl GgxAlbedo {
    /// Texels in x (cosine) and y (GGX width). With these, white furnaces are within 0.5 % of 1.
    pub const SIZE: [usize; 2] = [41, 51];

    /// The table that everybody shares; built on first use, which takes some milliseconds.
    pub fn shared() -> &'static Self {
        static TABLE: OnceLock<GgxAlbedo> = OnceLock::new();
        TABLE.get_or_init(Self::build)
    }

    /// Integrates every texel.
    pub fn build() -> Self {
        let rule = Quadrature::product(12, 16);
        let [width, height] = Self::SIZE;
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let p = albedo_parameters(vec2f(texel_center(x, width), texel_center(y, height)));
                texels.push(rule.mean(|u| {
                    let v = ggx_albedo_sample(p.x, p.y.sqrt(), u);
                    [v.x, v.y]
                }));
            }
        }
        Self { texels }
    }

    /// The pair that `metallic_roughness_bsdf` takes as `albedo`.
    ///
    /// - `cos_theta`: cosine of `wo` with the normal, in `[0, 1]`. `roughness`: perceptual, in `[0, 1]`.
    pub fn lookup(&self, cos_theta: f32, roughness: f32) -> Vec2f {
        let cell = Self::cell(cos_theta, roughness);
        cell.mix(self.corners(cell.first))
    }

    /// Where in the table a pair lies: what [`GgxAlbedo::lookup`] does before it looks.
    #[inline(always)]
    pub fn cell(cos_theta: f32, roughness: f32) -> GgxAlbedoCell {
        let [width, height] = Self::SIZE;
        let at = albedo_coordinates(cos_theta, roughness * roughness);
        let (x, right) = texel_below(at.x, width);
        let (y, up) = texel_below(at.y, height);
        GgxAlbedoCell { first: (y * width + x) as u32, right, up }
    }

    /// The texels around a cell whose first is `first`: two and, above them, two more.
    ///
    /// # Panics
    ///
    /// If there is no such cell.
    #[inline(always)]
    pub fn corners(&self, first: u32) -> [[f32; 2]; 4] {
        let (first, width) = (first as usize, Self::SIZE[0]);
        let [a, b, .., c, d] = &self.texels[first..first + width + 2] else { unreachable!("width is not 0") };
        [*a, *b, *c, *d]
    }

    /// All texels, `SIZE[0] × SIZE[1]`, x fastest. Texel centres span the whole range of
    /// [`albedo_coordinates`]: coordinate c is at texture coordinate `(c · (size − 1) + ½) / size`.
    pub fn texels(&self) -> &[[f32; 2]] {
        &self.texels
    }
}

/// A place between four texels of [`GgxAlbedo`].
#[derive(Clone, Copy, Debug)]
pub struct GgxAlbedoCell {
    /// Index of the texel that is lowest in both coordinates.
    pub first: u32,
    /// How far it is from there towards the next texel in x, in `[0, 1]`.
    pub right: f32,
    /// The same in y.
    pub up: f32,
}

impl GgxAlbedoCell {
    /// Interpolates between [`GgxAlbedo::corners`].
    #[inline(always)]
    pub fn mix(self, [a, b, c, d]: [[f32; 2]; 4]) -> Vec2f {
        let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let channel = |i: usize| lerp(lerp(a[i], b[i], self.right), lerp(c[i], d[i], self.right), self.up);
        vec2f(channel(0), channel(1))
    }
}

/// Directional albedo of a rough dielectric interface, reflection and transmission together, over cosine, GGX width and
/// relative index of refraction. Lookups are within 1 % of the integral, at most 3 % at the edge of total reflection,
/// but for indices within 15 % of 1, where the albedo falls steeply towards grazing angles.
#[derive(Debug)]
pub struct DielectricAlbedo {
    texels: Vec<f32>,
}

impl DielectricAlbedo {
    /// Texels in x (cosine), y (GGX width) and z (index of refraction). The last is odd: one texel is at an index of 1,
    /// where the albedo has a crease.
    pub const SIZE: [usize; 3] = [31, 31, 17];

    /// The table that everybody shares; built on first use, which takes some tens of milliseconds.
    pub fn shared() -> &'static Self {
        static TABLE: OnceLock<DielectricAlbedo> = OnceLock::new();
        TABLE.get_or_init(Self::build)
    }

    /// Integrates every texel.
    pub fn build() -> Self {
        // Total reflection makes a crease in the integrand, across which a product rule converges slowly.
        let (entering, leaving) = (Quadrature::product(6, 10), Quadrature::lattice(144, 89));
        let [width, height, depth] = Self::SIZE;
        let mut texels = Vec::with_capacity(width * height * depth);
        for z in 0..depth {
            let eta = eta_at(texel_center(z, depth));
            let rule = if eta < 1.0 { &leaving } else { &entering };
            for y in 0..height {
                for x in 0..width {
                    let p = albedo_parameters(vec2f(texel_center(x, width), texel_center(y, height)));
                    let [mean, _] = rule.mean(|u| [rough_dielectric_albedo_sample(p.x, p.y, eta, u), 0.0]);
                    texels.push(mean);
                }
            }
        }
        Self { texels }
    }

    /// Share of light that a single scattering event keeps, in `(0, 1]`.
    ///
    /// - `cos_theta`: cosine of `wo` with the normal, in `[0, 1]`. `alpha`: GGX width.
    /// - `eta`: index of refraction of the far side over that of the side of `wo`; clamped to `[1/3, 3]`.
    pub fn lookup(&self, cos_theta: f32, alpha: f32, eta: f32) -> f32 {
        let [width, height, depth] = Self::SIZE;
        let at = albedo_coordinates(cos_theta, alpha);
        let (x, fx) = texel_below(at.x, width);
        let (y, fy) = texel_below(at.y, height);
        let (z, fz) = texel_below(albedo_eta_coordinate(eta), depth);
        let plane = |z: usize| {
            let corner = (z * height + y) * width + x;
            let t = &self.texels;
            let near = t[corner] + (t[corner + 1] - t[corner]) * fx;
            let far = t[corner + width] + (t[corner + width + 1] - t[corner + width]) * fx;
            near + (far - near) * fy
        };
        let (below, above) = (plane(z), plane(z + 1));
        below + (above - below) * fz
    }

    /// The factor that `dielectric_bsdf` takes as `compensation`, see [`dielectric_compensation`].
    pub fn compensation(&self, cos_theta: f32, alpha: f32, eta: f32) -> f32 {
        dielectric_compensation(self.lookup(cos_theta, alpha, eta))
    }

    /// All texels, `SIZE[0] × SIZE[1] × SIZE[2]`, x fastest.
    pub fn texels(&self) -> &[f32] {
        &self.texels
    }
}

/// Directional albedo of the sheen lobe of white fibres, over cosine and roughness.
#[derive(Debug)]
pub struct SheenAlbedo {
    texels: Vec<f32>,
}

impl SheenAlbedo {
    /// Texels in x (cosine) and y (roughness).
    pub const SIZE: [usize; 2] = [32, 32];

    /// The table that everybody shares; built on first use, which takes some tens of milliseconds.
    pub fn shared() -> &'static Self {
        static TABLE: OnceLock<SheenAlbedo> = OnceLock::new();
        TABLE.get_or_init(Self::build)
    }

    /// Integrates every texel.
    pub fn build() -> Self {
        // Sheen is brightest in a band near the horizon, narrow for small roughness: many points.
        let rule = Quadrature::lattice(377, 233);
        let [width, height] = Self::SIZE;
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let root = texel_center(x, width);
                let (cos_theta, roughness) = ((root * root).max(1e-4), texel_center(y, height));
                // The rule's symmetry is in x, the sampler's azimuth is its second number.
                let sample = |u: Vec2f| [sheen_albedo_sample(cos_theta, roughness, vec2f(u.y, u.x)), 0.0];
                texels.push(rule.mean(sample)[0]);
            }
        }
        Self { texels }
    }

    /// Share of light that white fibres scatter; above 1 where the model gains energy, which `layered_bsdf` undoes.
    ///
    /// - `cos_theta`: cosine of `wo` with the normal, in `[0, 1]`. `roughness`: perceptual, in `[0, 1]`.
    pub fn lookup(&self, cos_theta: f32, roughness: f32) -> f32 {
        let [width, height] = Self::SIZE;
        let at = sheen_albedo_coordinates(cos_theta, roughness);
        let (x, fx) = texel_below(at.x, width);
        let (y, fy) = texel_below(at.y, height);
        let corner = y * width + x;
        let t = &self.texels;
        let near = t[corner] + (t[corner + 1] - t[corner]) * fx;
        let far = t[corner + width] + (t[corner + width + 1] - t[corner + width]) * fx;
        near + (far - near) * fy
    }

    /// All texels, `SIZE[0] × SIZE[1]`, x fastest.
    pub fn texels(&self) -> &[f32] {
        &self.texels
    }
}

/// The inverse of [`albedo_eta_coordinate`].
fn eta_at(coordinate: f32) -> f32 {
    let s = coordinate - 0.5;
    let r = 2.0 * s * s.abs();
    (1.0 + r) / (1.0 - r)
}

/// The coordinate, in `[0, 1]`, of the centre of texel `i` of `size`.
fn texel_center(i: usize, size: usize) -> f32 {
    i as f32 / (size - 1) as f32
}

/// The texel at or below a coordinate, and how far the coordinate is from it towards the next one. NaN is like 0.
#[inline(always)]
fn texel_below(coordinate: f32, size: usize) -> (usize, f32) {
    let last = (size - 1) as f32;
    let x = (coordinate * last).max(0.0).min(last);
    // Below by rounding half a texel before. At a texel it may be the one before, and the distance one.
    let i = (nearest_integer(x - 0.5) as u32).min(size as u32 - 2);
    (i as usize, x - i as f32)
}

/// Points and weights over the unit square for integrands of the microfacet samplers, which are symmetric in azimuth
/// (x) about the plane of incidence: half a turn is enough.
struct Quadrature {
    points: Vec<(Vec2f, f64)>,
}

impl Quadrature {
    /// Fibonacci lattice: `n` and `step` are consecutive Fibonacci numbers.
    fn lattice(n: usize, step: usize) -> Self {
        let at = |i: usize| ((i as f32 + 0.5) / n as f32, 1.0 / n as f64);
        let points = (0..n).map(|i| (vec2f(0.5 * at(i * step % n).0, at(i).0), at(i).1)).collect();
        Self { points }
    }

    /// Midpoints in x, where the integrand is periodic; Gauss–Legendre in y. For smooth integrands.
    fn product(nx: usize, ny: usize) -> Self {
        let rows = gauss_legendre(ny);
        let column = |i: usize| (i as f64 + 0.5) / nx as f64 * 0.5;
        let points = rows
            .iter()
            .flat_map(|&(y, weight)| {
                (0..nx).map(move |i| (vec2f(column(i) as f32, y as f32), weight / nx as f64))
            })
            .collect();
        Self { points }
    }

    fn mean(&self, f: impl Fn(Vec2f) -> [f32; 2]) -> [f32; 2] {
        let mut sum = [0.0f64; 2];
        for &(u, weight) in &self.points {
            let [a, b] = f(u);
            sum[0] += f64::from(a) * weight;
            sum[1] += f64::from(b) * weight;
        }
        sum.map(|s| s as f32)
    }
}

/// Nodes and weights of Gauss–Legendre quadrature on `[0, 1]`: roots of the Legendre polynomial by Newton's method.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = cos(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5));
        let mut derivative = 0.0;
        for _ in 0..8 {
            let (mut previous, mut value) = (1.0, x);
            for k in 2..=n {
                let k = k as f64;
                (previous, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * previous) / k);
            }
            derivative = n as f64 * (x * value - previous) / (x * x - 1.0);
            x -= value / derivative;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * derivative * derivative))
    };
    (0..n).map(node).collect()
}
