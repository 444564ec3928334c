//! Scattering models: energy, densities, reciprocity, extreme parameters. A new model gets an entry in [`models`].

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod energy;
mod extremes;

use optics::albedo::{DielectricAlbedo, GgxAlbedo};
use optics::bsdf::*;
use optics::constants::ONE_MINUS_EPSILON;
use optics::dielectric::*;
use optics::ggx::MIN_ALPHA;
use optics::glossy::*;
use optics::scatter::*;
use optics::{Vec2f, Vec3f, vec2f, vec3f};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};
use testkit::{Random, assert_chi2};

/// A model whose parameters are set, and which is prepared for a direction.
struct Model {
    name: String,
    /// GGX width; 1 where there is none, 0 where the model is a delta.
    alpha: f32,
    /// Relative index of refraction where light is bent, else 1.
    eta: f32,
    /// Reciprocal: neither energy compensation nor anything else that looks at `wo` alone.
    reciprocal: bool,
    /// Prepares it for a cosine and a relative index of refraction.
    prepare: Box<dyn Fn(f32, f32) -> Bsdf>,
}

impl Model {
    fn at(&self, wo: Vec3f) -> Bsdf {
        (self.prepare)(wo.z, self.eta)
    }
}

fn metallic_roughness(color: Vec3f, metallic: f32, roughness: f32, single: bool) -> Model {
    let m = MetallicRoughness { base_color: color, metallic, roughness, specular: 1.0, ior: 1.5 };
    Model {
        name: format!("metallic {metallic}, roughness {roughness}{}", if single { ", single" } else { "" }),
        alpha: (roughness * roughness).max(MIN_ALPHA),
        eta: 1.0,
        reciprocal: single,
        prepare: Box::new(move |cos, _| {
            metallic_roughness_bsdf(m, GgxAlbedo::shared().lookup(cos, roughness), single)
        }),
    }
}

fn dielectric(tint: Vec3f, alpha: f32, eta: f32, thin: bool, compensated: bool) -> Model {
    let kind = if thin { "thin" } else { "dielectric" };
    Model {
        name: format!("{kind}, alpha {alpha}, eta {eta}{}", if compensated { ", compensated" } else { "" }),
        alpha,
        eta,
        reciprocal: !compensated,
        prepare: Box::new(move |cos, eta| {
            let compensation = match (compensated && alpha > 0.0, thin) {
                (false, _) => 1.0,
                // Both lobes of a sheet have the shape of the reflection lobe.
                (true, true) => {
                    let e = GgxAlbedo::shared().lookup(cos, alpha.sqrt());
                    1.0 / (e.x + e.y)
                }
                (true, false) => DielectricAlbedo::shared().compensation(cos, alpha, eta),
            };
            dielectric_bsdf(tint, alpha, eta, thin, compensation)
        }),
    }
}

const WHITE: Vec3f = Vec3f::vec3(1.0, 1.0, 1.0);
const COLOR: Vec3f = Vec3f::vec3(0.9, 0.5, 0.2);
const ROUGHNESSES: [f32; 7] = [0.0, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0];
const ETAS: [f32; 5] = [1.5, 1.0 / 1.5, 1.0, 2.4, 1.0 / 2.4];
const ALPHAS: [f32; 4] = [0.05, 0.2, 0.5, 1.0];
const METALLICS: [f32; 3] = [0.0, 0.5, 1.0];

/// Every model, with colour `c`.
fn models(c: Vec3f) -> Vec<Model> {
    let mut all = vec![
        Model {
            name: "lambert".into(),
            alpha: 1.0,
            eta: 1.0,
            reciprocal: true,
            prepare: Box::new(move |_, _| lambert_bsdf(c)),
        },
        Model {
            name: "mirror".into(),
            alpha: 0.0,
            eta: 1.0,
            reciprocal: true,
            prepare: Box::new(move |_, _| mirror_bsdf(c)),
        },
    ];
    for roughness in ROUGHNESSES {
        for metallic in METALLICS {
            for single in [true, false] {
                all.push(metallic_roughness(c, metallic, roughness, single));
            }
        }
    }
    for eta in ETAS {
        all.push(dielectric(c, 0.0, eta, false, true));
        for alpha in ALPHAS {
            for compensated in [true, false] {
                all.push(dielectric(c, alpha, eta, false, compensated));
            }
        }
    }
    for alpha in [0.0, 0.05, 0.3, 1.0] {
        for compensated in [true, false] {
            all.push(dielectric(c, alpha, 1.5, true, compensated));
        }
    }
    all
}

/// Models with a density that quadrature and histograms can resolve.
fn wide_models() -> Vec<Model> {
    let is_wide = |m: &Model| m.alpha >= 0.05 && bsdf_has_smooth_part(m.at(vec3f(0.0, 0.0, 1.0)));
    models(COLOR).into_iter().filter(is_wide).collect()
}

fn direction(cos: f32, turns: f32) -> Vec3f {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let phi = turns * std::f32::consts::TAU;
    vec3f(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Directions to look from, from straight above to grazing.
fn views() -> [Vec3f; 4] {
    [direction(1.0, 0.0), direction(0.8, 0.1), direction(0.3, 0.7), direction(0.05, 0.45)]
}

/// Coordinates for one side of the surface in which a lobe about `pole` has about the same size everywhere: angle from
/// the pole, cubed, and azimuth about it.
#[derive(Clone, Copy)]
struct Around {
    pole: [f64; 3],
    x: [f64; 3],
    y: [f64; 3],
}

impl Around {
    fn new(pole: Vec3f) -> Self {
        let p = pole.to_array().map(f64::from);
        let f = optics::frame::frame_from_normal(pole);
        Self { pole: p, x: f.tangent.to_array().map(f64::from), y: f.bitangent.to_array().map(f64::from) }
    }

    /// The direction at `(s, t)` in the unit square, and dω / (ds dt).
    fn direction(&self, s: f64, t: f64) -> (Vec3f, f64) {
        let theta = PI * s * s * s;
        let (sin, cos) = theta.sin_cos();
        let (sin_phi, cos_phi) = (TAU * t).sin_cos();
        let c =
            |i: usize| (sin * cos_phi * self.x[i] + sin * sin_phi * self.y[i] + cos * self.pole[i]) as f32;
        (vec3f(c(0), c(1), c(2)), sin * 3.0 * PI * s * s * TAU)
    }

    fn coordinates(&self, d: Vec3f) -> (f64, f64) {
        let d = d.to_array().map(f64::from);
        let dot = |a: [f64; 3]| a[0] * d[0] + a[1] * d[1] + a[2] * d[2];
        let (x, y, z) = (dot(self.x), dot(self.y), dot(self.pole));
        let theta = x.hypot(y).atan2(z);
        ((theta / PI).cbrt(), (y.atan2(x) / TAU).rem_euclid(1.0))
    }
}

/// Where the lobes above and below the surface are, roughly.
fn lobes(model: &Model, wo: Vec3f) -> [Around; 2] {
    let mirrored = vec3f(-wo.x, -wo.y, wo.z);
    let bend = if model.name.starts_with("thin") { 1.0 } else { model.eta };
    let (x, y) = (-wo.x / bend, -wo.y / bend);
    let sin2 = (x * x + y * y).min(0.999);
    let scale = (sin2 / (x * x + y * y).max(1e-12)).sqrt();
    let below = vec3f(x * scale, y * scale, -(1.0 - sin2).sqrt());
    [Around::new(mirrored), Around::new(below)]
}

/// ∫ pdf dω over a cell in the coordinates of a lobe on one side (0 above, 1 below), by midpoints: `n²`, more where the
/// horizon cuts the cell.
fn density_in_cell(b: Bsdf, wo: Vec3f, side: usize, lobe: Around, s: [f64; 2], t: [f64; 2], n: usize) -> f64 {
    let mut sum = 0.0;
    let mut inside = 0;
    for i in 0..n {
        for j in 0..n {
            let at =
                |range: [f64; 2], k: usize| range[0] + (range[1] - range[0]) * (k as f64 + 0.5) / n as f64;
            let (wi, area) = lobe.direction(at(s, i), at(t, j));
            if (wi.z > 0.0) == (side == 0) {
                sum += f64::from(bsdf_eval(b, wo, wi).pdf) * area;
                inside += 1;
            }
        }
    }
    if inside != n * n && n < 50 {
        return density_in_cell(b, wo, side, lobe, s, t, 60);
    }
    sum / (n * n) as f64 * (s[1] - s[0]) * (t[1] - t[0])
}

const CELLS_S: usize = 20;
const CELLS_T: usize = 14;

/// Expected shares of all cells on both sides.
fn expected_shares(b: Bsdf, wo: Vec3f, lobes: [Around; 2]) -> Vec<f64> {
    let mut shares = Vec::new();
    for (side, lobe) in lobes.into_iter().enumerate() {
        for i in 0..CELLS_S * CELLS_T {
            let (s, t) = ((i / CELLS_T) as f64, (i % CELLS_T) as f64);
            let s = [s / CELLS_S as f64, (s + 1.0) / CELLS_S as f64];
            let t = [t / CELLS_T as f64, (t + 1.0) / CELLS_T as f64];
            let empty = side == 1 && !bsdf_transmits(b);
            shares.push(if empty { 0.0 } else { density_in_cell(b, wo, side, lobe, s, t, 12) });
        }
    }
    shares
}

/// The density integrates to the share of samples that are not rejected, samples follow it, and weights are value
/// over density.
#[test]
fn samples_follow_the_density_and_weights_are_value_over_density() {
    const N: usize = 30_000;
    let models = wide_models();
    let tests = models.len() * views().len();
    assert!(tests > 150, "{tests} pairs of model and view");
    for (k, model) in models.iter().enumerate() {
        for (v, wo) in views().into_iter().enumerate() {
            let what = format!("{} from {:?}", model.name, wo.to_array());
            let b = model.at(wo);
            let lobes = lobes(model, wo);
            let mut expected: Vec<f64> = expected_shares(b, wo, lobes).iter().map(|e| e * N as f64).collect();
            // Midpoints may miss a sliver of a cell that a sample then falls into: no cell is quite impossible.
            expected.iter_mut().for_each(|e| *e = e.max(1e-3));
            let total: f64 = expected.iter().sum();
            assert!(total <= 1.003 * N as f64, "{what}: the density integrates to {}", total / N as f64);

            let mut observed = vec![0; expected.len()];
            let mut rejected = 0;
            let mut random = Random::new((k * 100 + v) as u64);
            for _ in 0..N {
                let s = bsdf_sample(
                    b,
                    wo,
                    random.uniform_f32(),
                    vec2f(random.uniform_f32(), random.uniform_f32()),
                );
                if s.pdf <= 0.0 {
                    rejected += 1;
                    continue;
                }
                check_sample(&what, b, wo, s);
                let side = usize::from(s.wi.z < 0.0);
                let (x, y) = lobes[side].coordinates(s.wi);
                let cell = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                observed[(side * CELLS_S + cell(x, CELLS_S)) * CELLS_T + cell(y, CELLS_T)] += 1;
            }
            // What is not sampled is one more cell: the density must say how much that is.
            observed.push(rejected);
            expected.push((N as f64 - total).max(0.0));
            if expected.last() < Some(&(0.003 * N as f64)) {
                // Less than quadrature can tell from nothing.
                assert!(
                    rejected < N as u64 / 150,
                    "{what}: {rejected} rejected, expected {:?}",
                    expected.last()
                );
                observed.pop();
                expected.pop();
            }
            assert_chi2(&what, &observed, &expected, tests);
        }
    }
}

/// A sample says of itself what `bsdf_eval` says of its direction.
#[track_caller]
fn check_sample(what: &str, b: Bsdf, wo: Vec3f, s: BsdfSample) {
    let length2 = s.wi.to_array().iter().map(|c| c * c).sum::<f32>();
    assert!((length2 - 1.0).abs() < 1e-4, "{what}: {s:?}");
    assert_eq!(s.transmitted, s.wi.z < 0.0, "{what}: {s:?}");
    assert!(!s.delta, "{what}: {s:?}");
    let v = bsdf_eval(b, wo, s.wi);
    // Rounding of wi moves the half vector by some 10⁻⁷, and narrow lobes by that over alpha; more at grazing angles.
    let tolerance = 2e-3;
    assert!((v.pdf / s.pdf - 1.0).abs() < tolerance, "{what}: {s:?} but {v:?}");
    for (weight, value) in s.weight.to_array().into_iter().zip(v.value_cos.to_array()) {
        let from_value = value / v.pdf;
        assert!((weight - from_value).abs() <= tolerance * from_value.max(1e-2), "{what}: {s:?} but {v:?}");
    }
}

/// f(wo, wi) = f(wi, wo), and for transmission eta² f(wo, wi) = f(wi, wo): radiance is compressed in the denser medium.
/// Energy compensation is not reciprocal, by design (Turquin 2019): it scales by a function of `wo` alone.
#[test]
fn single_scattering_is_reciprocal() {
    let mut compared = 0;
    for model in wide_models().iter().filter(|m| m.reciprocal) {
        let refracts = bsdf_transmits(model.at(vec3f(0.0, 0.0, 1.0)));
        let bends = refracts && !model.name.starts_with("thin");
        for i in 0..400 {
            let mut random = Random::new(i);
            let wo = direction(random.uniform_f32().max(0.02), random.uniform_f32());
            let below = refracts && i % 2 == 1;
            let wi = direction(
                random.uniform_f32().max(0.02) * if below { -1.0 } else { 1.0 },
                random.uniform_f32(),
            );
            // Towards the lobe, so that most pairs scatter at all.
            let wi = if below && bends { bsdf_sample_below(model, wo, &mut random) } else { Some(wi) };
            let Some(wi) = wi else { continue };
            let flip = |v: Vec3f| if below { vec3f(v.x, v.y, -v.z) } else { v };
            let eta_back = if below && bends { 1.0 / model.eta } else { model.eta };
            let there = bsdf_eval(model.at(wo), wo, wi).value_cos.to_array();
            let back_bsdf = (model.prepare)(wi.z.abs(), eta_back);
            let back = bsdf_eval(back_bsdf, flip(wi), flip(wo)).value_cos.to_array();
            let compression = if below && bends { model.eta * model.eta } else { 1.0 };
            for c in 0..3 {
                let there = there[c] / wi.z.abs() * compression;
                let back = back[c] / wo.z;
                // f32, and cancellation in the half vector of transmission.
                let tolerance = 2e-3 * there.abs().max(back.abs()) + 1e-6;
                assert!(
                    (there - back).abs() <= tolerance,
                    "{}: {wo:?}, {wi:?}: {there} and {back}",
                    model.name
                );
                compared += usize::from(there > 1e-3);
            }
        }
    }
    assert!(compared > 5000, "only {compared} values are not zero");
}

/// A direction on the other side of the surface that the model can refract to.
fn bsdf_sample_below(model: &Model, wo: Vec3f, random: &mut Random) -> Option<Vec3f> {
    let u = vec2f(random.uniform_f32(), random.uniform_f32());
    let s = bsdf_sample(model.at(wo), wo, ONE_MINUS_EPSILON, u);
    // Steeper than the views: cosines of nearly 0 leave no digits in |cos|.
    (s.pdf > 0.0 && s.wi.z < -0.02).then_some(s.wi)
}

#[test]
#[should_panic(expected = "do not follow the density")]
fn a_wrong_density_is_noticed() {
    // Samples of one roughness against the density of another, 5 % wider.
    let wo = direction(0.8, 0.1);
    let model = metallic_roughness(WHITE, 1.0, 0.5, false);
    let other = metallic_roughness(WHITE, 1.0, 0.525, false).at(wo);
    let (b, lobes) = (model.at(wo), lobes(&model, wo));
    let n = 30_000;
    let expected: Vec<f64> = expected_shares(other, wo, lobes).iter().map(|e| e * n as f64).collect();
    let mut observed = vec![0; expected.len()];
    let mut random = Random::new(5);
    for _ in 0..n {
        let s = bsdf_sample(b, wo, 0.5, vec2f(random.uniform_f32(), random.uniform_f32()));
        let (x, y) = lobes[0].coordinates(s.wi);
        let cell = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        observed[cell(x, CELLS_S) * CELLS_T + cell(y, CELLS_T)] += 1;
    }
    assert_chi2("another roughness", &observed, &expected, 1);
}

#[test]
#[should_panic(expected = "but BsdfValue")]
fn a_wrong_weight_is_noticed() {
    let wo = direction(0.8, 0.1);
    let b = lambert_bsdf(WHITE);
    let mut s = bsdf_sample(b, wo, 0.5, vec2f(0.3, 0.6));
    s.weight *= 1.01;
    check_sample("a wrong weight", b, wo, s);
}
