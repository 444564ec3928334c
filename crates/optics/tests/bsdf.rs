//! Scattering models: energy, densities, reciprocity, extreme parameters. A new model gets an entry in [`models`].

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

/// Mean weight over all samples, by midpoints in u and exactly over the two lobes; transmitted light counts without
/// radiance compression. Channel 0.
fn furnace(b: Bsdf, wo: Vec3f, n: usize) -> f64 {
    let mut sum = 0.0;
    for i in 0..n * n {
        let u = vec2f(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
        let energy = |s: BsdfSample| {
            let compression =
                if s.transmitted && b.kind != BSDF_THIN_DIELECTRIC { f64::from(b.eta * b.eta) } else { 1.0 };
            f64::from(s.weight.x) * compression
        };
        if b.kind == BSDF_GLOSSY {
            let p = f64::from(b.specular_probability);
            sum += p * energy(bsdf_sample(b, wo, 0.0, u));
            sum += (1.0 - p) * energy(bsdf_sample(b, wo, ONE_MINUS_EPSILON, u));
        } else {
            // The lobe's probability depends on the microfacet: midpoints over it, too, in a different order each.
            let shift = (i * 7 % 16) as f32 / 16.0;
            let lobes = 16;
            for k in 0..lobes {
                let u_lobe = (k as f32 + shift) / lobes as f32;
                sum += energy(bsdf_sample(b, wo, u_lobe, u)) / f64::from(lobes);
            }
        }
    }
    sum / (n * n) as f64
}

fn furnace_cosines() -> Vec<f32> {
    vec![1.0, 0.97, 0.9, 0.8, 0.7, 0.55, 0.4, 0.3, 0.2, 0.13, 0.08, 0.04, 0.02, 0.01, 3e-3, 1e-3, 1e-4]
}

/// The bar: within 0.5 % of 1 for every roughness, metals and dielectrics.
#[test]
fn compensated_metallic_roughness_is_a_white_furnace() {
    for r in 0..=40 {
        let roughness = r as f32 / 40.0;
        for metallic in METALLICS {
            for cos in furnace_cosines() {
                let model = metallic_roughness(WHITE, metallic, roughness, false);
                let wo = direction(cos, 0.0);
                let albedo = furnace(model.at(wo), wo, 64);
                assert!((albedo - 1.0).abs() < 5e-3, "{} from cosine {cos}: {albedo}", model.name);
            }
        }
    }
}

/// Metals lose light between microfacets and never gain any.
#[test]
fn single_scattering_loses_energy() {
    let mut least = 1.0f64;
    for roughness in ROUGHNESSES {
        for cos in furnace_cosines() {
            let model = metallic_roughness(WHITE, 1.0, roughness, true);
            let wo = direction(cos, 0.0);
            let albedo = furnace(model.at(wo), wo, 48);
            assert!(albedo < 1.002, "{} from cosine {cos}: {albedo}", model.name);
            least = least.min(albedo);
        }
    }
    assert!(least < 0.5, "a rough metal keeps {least}");
}

/// Appendix B of glTF 2.0 to the letter is no model of energy conservation: the diffuse lobe is dimmed by the Fresnel
/// term of the half vector, which is small where the specular lobe is brightest. Polished white plastic reflects up to
/// 1.9 times the light at grazing angles. This is why energy compensation is the default; here only the size is bounded.
#[test]
fn the_letter_of_gltf_gains_energy_at_grazing_angles_only() {
    let mut most = 0.0f64;
    for roughness in ROUGHNESSES {
        for cos in furnace_cosines() {
            let model = metallic_roughness(WHITE, 0.0, roughness, true);
            let wo = direction(cos, 0.0);
            let albedo = furnace(model.at(wo), wo, 48);
            // 4 % is the reflectance at normal incidence: the gain begins where Fresnel's does.
            assert!(cos < 0.6 || albedo < 1.025, "{} from cosine {cos}: {albedo}", model.name);
            most = most.max(albedo);
        }
    }
    assert!(most > 1.5 && most < 2.0, "{most}");
}

#[test]
fn smooth_surfaces_lose_nothing() {
    for eta in ETAS {
        for thin in [false, true] {
            for cos in furnace_cosines() {
                let wo = direction(cos, 0.0);
                let b = dielectric(WHITE, 0.0, eta, thin, true).at(wo);
                let albedo = furnace(b, wo, 4);
                assert!((albedo - 1.0).abs() < 1e-5, "eta {eta}, thin {thin}, cosine {cos}: {albedo}");
            }
        }
    }
    let wo = direction(0.3, 0.2);
    assert!((furnace(mirror_bsdf(WHITE), wo, 4) - 1.0).abs() < 1e-6);
    assert!((furnace(lambert_bsdf(WHITE), wo, 4) - 1.0).abs() < 1e-6);
}

/// Within 1 % with compensation, 2 % at the critical angle's crease of the table; not above 1 without.
#[test]
fn rough_dielectrics_are_white_furnaces() {
    let mut errors = Vec::new();
    for eta in [1.5, 1.0 / 1.5, 2.4, 1.0 / 2.4, 1.33, 1.0 / 1.33] {
        for alpha in [MIN_ALPHA, 0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0] {
            for cos in furnace_cosines() {
                let wo = direction(cos, 0.0);
                let model = dielectric(WHITE, alpha, eta, false, true);
                let b = model.at(wo);
                let albedo = furnace(b, wo, 32);
                let single = albedo / f64::from(b.compensation);
                assert!(single < 1.003, "{} from cosine {cos}: single scattering gives {single}", model.name);
                assert!((albedo - 1.0).abs() < 0.04, "{} from cosine {cos}: {albedo}", model.name);
                errors.push((albedo - 1.0).abs());
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    let quantile = |q: f64| errors[(q * (errors.len() - 1) as f64) as usize];
    assert!(quantile(0.5) < 0.004, "median error {}", quantile(0.5));
    assert!(quantile(0.95) < 0.012, "error of the worst twentieth {}", quantile(0.95));
}

#[test]
fn rough_sheets_are_white_furnaces() {
    for alpha in [0.01, 0.05, 0.2, 0.5, 1.0] {
        for cos in furnace_cosines() {
            let wo = direction(cos, 0.0);
            let albedo = furnace(dielectric(WHITE, alpha, 1.5, true, true).at(wo), wo, 48);
            assert!((albedo - 1.0).abs() < 5e-3, "alpha {alpha} from cosine {cos}: {albedo}");
        }
    }
}

fn assert_sane(what: &str, b: Bsdf, wo: Vec3f, u_lobe: f32, u: Vec2f) {
    let s = bsdf_sample(b, wo, u_lobe, u);
    assert!(s.pdf >= 0.0 && s.pdf.is_finite(), "{what}: {s:?}");
    let length2 = s.wi.to_array().iter().map(|c| c * c).sum::<f32>();
    assert!((length2 - 1.0).abs() < 1e-3, "{what}: {s:?}");
    for w in s.weight.to_array() {
        // Radiance compression by up to 3², compensation by up to 1 / 0.35, lobes chosen with 5 % or more.
        assert!((0.0..=200.0).contains(&w), "{what}: {s:?}");
    }
    let v = bsdf_eval(b, wo, s.wi);
    assert!(v.pdf >= 0.0 && v.pdf.is_finite(), "{what}: {s:?} {v:?}");
    for x in v.value_cos.to_array() {
        assert!(x >= 0.0 && x.is_finite(), "{what}: {s:?} {v:?}");
    }
}

#[test]
fn extreme_parameters_give_finite_numbers() {
    let unit = [0.0, 1e-7, 0.25, 0.5, 0.99999, ONE_MINUS_EPSILON];
    let denormal = f32::MIN_POSITIVE / 16.0;
    let wos = [
        direction(1.0, 0.0),
        direction(0.5, 0.3),
        direction(1e-4, 0.6),
        direction(1e-7, 0.6),
        direction(1e-20, 0.6),
        direction(denormal, 0.1),
        direction(0.0, 0.1),
    ];
    type Prepared = Box<dyn Fn(f32) -> Bsdf>;
    let mut bsdfs: Vec<(String, Prepared)> = Vec::new();
    for color in [WHITE, vec3f(0.0, 0.0, 0.0), vec3f(denormal, 1.0, 0.0)] {
        for roughness in [0.0, denormal, 1e-3, 1.0] {
            for metallic in [0.0, denormal, 1.0] {
                for (ior, specular) in [(1.0, 1.0), (1.5, 0.0), (3.0, 1.0)] {
                    for single in [true, false] {
                        let m = MetallicRoughness { base_color: color, metallic, roughness, specular, ior };
                        let make = move |cos: f32| {
                            metallic_roughness_bsdf(m, GgxAlbedo::shared().lookup(cos, roughness), single)
                        };
                        bsdfs.push((format!("{m:?} {single}"), Box::new(make)));
                    }
                }
            }
        }
        for alpha in [0.0, denormal, MIN_ALPHA, 0.3, 1.0] {
            for eta in [1.0, 1.0001, 1.0003, 0.9995, 1.01, 0.99, 3.0, 1.0 / 3.0] {
                for thin in [true, false] {
                    let model = dielectric(color, alpha, eta, thin, false);
                    bsdfs.push((model.name, Box::new(move |cos| (model.prepare)(cos, eta))));
                }
            }
        }
        bsdfs.push(("lambert".into(), Box::new(move |_| lambert_bsdf(color))));
        bsdfs.push(("mirror".into(), Box::new(move |_| mirror_bsdf(color))));
    }
    for (name, make) in &bsdfs {
        for wo in wos {
            let b = make(wo.z);
            let what = format!("{name} from {:?}", wo.to_array());
            for x in unit {
                for y in unit {
                    for u_lobe in [0.0, 0.3, ONE_MINUS_EPSILON] {
                        assert_sane(&what, b, wo, u_lobe, vec2f(x, y));
                    }
                }
            }
            for wi in
                [wo, wo * -1.0, vec3f(-wo.x, -wo.y, wo.z), direction(1e-20, 0.4), direction(-1e-20, 0.4)]
            {
                let v = bsdf_eval(b, wo, wi);
                assert!(v.pdf >= 0.0 && v.pdf.is_finite(), "{what}, {wi:?}: {v:?}");
                assert!(
                    v.value_cos.to_array().iter().all(|x| *x >= 0.0 && x.is_finite()),
                    "{what}, {wi:?}: {v:?}"
                );
            }
        }
    }
}

/// Nothing scatters into or out of the surface where it should not.
#[test]
fn opaque_models_are_black_from_below() {
    for model in models(COLOR) {
        let wo = direction(0.5, 0.1);
        let b = model.at(wo);
        if !bsdf_transmits(b) {
            let v = bsdf_eval(b, wo, direction(-0.5, 0.6));
            assert_eq!((v.pdf, v.value_cos.x), (0.0, 0.0), "{}", model.name);
        }
        let v = bsdf_eval(b, direction(-0.3, 0.2), direction(0.5, 0.6));
        assert_eq!((v.pdf, v.value_cos.x), (0.0, 0.0), "{} seen from below", model.name);
    }
}

#[test]
fn lookups_stand_any_number() {
    for x in [f32::NAN, f32::INFINITY, -1.0, 0.0, 2.0, f32::MIN_POSITIVE] {
        for y in [f32::NAN, f32::INFINITY, -1.0, 0.0, 0.5, 2.0] {
            let e = GgxAlbedo::shared().lookup(x, y);
            assert!(e.x + e.y > 0.0 && e.x + e.y < 1.01, "({x}, {y}) → {e:?}");
            for eta in [f32::NAN, 0.0, 1.0, 100.0] {
                let e = DielectricAlbedo::shared().lookup(x, y, eta);
                assert!(e > 0.0 && e < 1.01, "({x}, {y}, {eta}) → {e}");
            }
        }
    }
}

proptest! {
    // A fixed seed: the test gives the same verdict every time.
    #![proptest_config(ProptestConfig {
        cases: 300,
        rng_seed: prop::test_runner::RngSeed::Fixed(17),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_metallic_roughness_neither_breaks_nor_gains_energy(
        color in prop::array::uniform3(0.0f32..=1.0),
        metallic in 0.0f32..=1.0,
        roughness in 0.0f32..=1.0,
        specular in 0.0f32..=1.0,
        ior in 1.0f32..=3.0,
        cos in 1e-4f32..=1.0,
    ) {
        let base_color = vec3f(color[0], color[1], color[2]);
        let m = MetallicRoughness { base_color, metallic, roughness, specular, ior };
        let wo = direction(cos, 0.3);
        let b = metallic_roughness_bsdf(m, GgxAlbedo::shared().lookup(cos, roughness), false);
        check_energy(&format!("{m:?} from {cos}"), b, wo)?;
    }

    #[test]
    fn random_dielectrics_neither_break_nor_gain_energy(
        tint in prop::array::uniform3(0.0f32..=1.0),
        alpha in 0.0f32..=1.0,
        eta in 0.33f32..=3.0,
        thin: bool,
        cos in 1e-4f32..=1.0,
    ) {
        let model = dielectric(vec3f(tint[0], tint[1], tint[2]), alpha, eta, thin, false);
        let wo = direction(cos, 0.3);
        check_energy(&format!("{} from {cos}", model.name), model.at(wo), wo)?;
    }
}

fn check_energy(what: &str, b: Bsdf, wo: Vec3f) -> Result<(), TestCaseError> {
    let albedo = furnace(b, wo, 40);
    prop_assert!((0.0..=1.01).contains(&albedo), "{}: albedo {}", what, albedo);
    let mut random = Random::new(3);
    for _ in 0..200 {
        let u = vec2f(random.uniform_f32(), random.uniform_f32());
        assert_sane(what, b, wo, random.uniform_f32(), u);
    }
    Ok(())
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
