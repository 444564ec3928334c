//! Layered surfaces: energy, densities, limits, extreme parameters.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use optics::albedo::{DielectricAlbedo, GgxAlbedo, SheenAlbedo};
use optics::constants::ONE_MINUS_EPSILON;
use optics::glossy::{MetallicRoughness, glossy_eval, metallic_roughness_bsdf};
use optics::layered::*;
use optics::lobes::*;
use optics::oren_nayar::rough_diffuse_factor;
use optics::scatter::BsdfSample;
use optics::{Vec3f, vec2f, vec3f};
use testkit::{Random, assert_chi2};

const WHITE: Vec3f = Vec3f::vec3(1.0, 1.0, 1.0);
const BLACK: Vec3f = Vec3f::vec3(0.0, 0.0, 0.0);

/// A white dielectric without layers.
fn plain() -> LayeredParameters {
    LayeredParameters {
        base_color: WHITE,
        metallic: 0.0,
        roughness: 0.5,
        diffuse_roughness: 0.0,
        specular: 1.0,
        specular_color: WHITE,
        ior: 1.5,
        anisotropy: 0.0,
        transmission: 0.0,
        diffuse_transmission: 0.0,
        diffuse_transmission_color: WHITE,
        sheen_color: BLACK,
        sheen_roughness: 0.5,
        coat: 0.0,
        coat_roughness: 0.0,
        coat_normal: vec3f(0.0, 0.0, 1.0),
        iridescence: 0.0,
        film_ior: 1.3,
        film_thickness: 400.0,
        eta: 1.5,
        thin: false,
        inside: false,
    }
}

/// What back ends look up.
fn albedos(m: &LayeredParameters, wo: Vec3f) -> LayeredAlbedos {
    let cos_coat = optics::vector::dot(m.coat_normal, wo).clamp(0.0, 1.0);
    LayeredAlbedos {
        base: GgxAlbedo::shared().lookup(wo.z, m.roughness),
        coat: GgxAlbedo::shared().lookup(cos_coat, m.coat_roughness),
        sheen: SheenAlbedo::shared().lookup(wo.z, m.sheen_roughness),
        whole_interface: DielectricAlbedo::shared().lookup(wo.z, m.roughness * m.roughness, m.eta),
    }
}

fn prepare(m: LayeredParameters, wo: Vec3f) -> Layered {
    layered_bsdf(m, albedos(&m, wo), wo, WHITE, false)
}

fn direction(cos: f32, turns: f32) -> Vec3f {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let phi = turns * std::f32::consts::TAU;
    vec3f(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Any material, with one number in four at an end of its range; and whether it refracts.
fn random_material(random: &mut Random) -> LayeredParameters {
    let mut share = || match random.bits() % 8 {
        0 => 0.0,
        1 => 1.0,
        _ => random.uniform_f32(),
    };
    let present = |x: f32, chance: f32| if x < chance { 1.0 } else { 0.0 };
    let mut color =
        |whiteness: f32| vec3f(share().max(whiteness), share().max(whiteness), share().max(whiteness));
    let (base_color, specular_color) = (color(0.0), color(0.0));
    let (through_color, sheen_color) = (color(0.0), color(0.0));
    let ior = if share() < 0.1 { 0.0 } else { 1.0 + 2.0 * share() };
    let (thin, inside) = (share() < 0.3, share() < 0.3);
    let transmission = share() * present(share(), 0.5);
    let bend = ior.max(1.0);
    let coat_tilt = 0.3 * share();
    LayeredParameters {
        base_color,
        metallic: share() * present(share(), 0.5),
        roughness: share(),
        diffuse_roughness: share(),
        specular: share(),
        specular_color,
        ior,
        anisotropy: share() * present(share(), 0.5),
        transmission,
        diffuse_transmission: share() * present(share(), 0.5),
        diffuse_transmission_color: through_color,
        sheen_color: sheen_color * present(share(), 0.5),
        sheen_roughness: share(),
        coat: share() * present(share(), 0.5),
        coat_roughness: share(),
        coat_normal: direction((1.0 - coat_tilt * coat_tilt).sqrt(), share()),
        iridescence: share() * present(share(), 0.5),
        film_ior: 1.0 + share(),
        film_thickness: 1000.0 * share(),
        eta: if inside && !thin { 1.0 / bend } else { bend },
        thin,
        inside: inside && !thin && transmission > 0.0,
    }
}

/// Mean weight of samples that are spread evenly, largest channel; transmitted light without radiance compression.
fn furnace(b: Layered, wo: Vec3f, samples: u32) -> f64 {
    let mut sum = [0.0f64; 3];
    for i in 0..samples {
        // The R3 sequence.
        let at = |step: f64| ((0.5 + step * f64::from(i)) % 1.0) as f32;
        let u = vec2f(at(0.671_043_606_703_789), at(0.549_700_477_901_97));
        let s = layered_sample(b, wo, at(0.819_172_513_396_164_4), u.min_one());
        for (sum, weight) in sum.iter_mut().zip(uncompressed(b, wo, s).to_array()) {
            *sum += f64::from(weight);
        }
    }
    sum.into_iter().fold(0.0, f64::max) / f64::from(samples)
}

/// The weight of a sample, its refracted part without radiance compression.
fn uncompressed(b: Layered, wo: Vec3f, s: BsdfSample) -> Vec3f {
    if !s.transmitted || b.p_refracted <= 0.0 {
        return s.weight;
    }
    let refracted = b.refracted * refracted_lobe(b, wo, s.wi).value_cos;
    s.weight + refracted * ((b.eta * b.eta - 1.0) / s.pdf)
}

/// Numbers in `[0, 1)` stay there when they become `f32`.
trait MinOne {
    fn min_one(self) -> Self;
}

impl MinOne for optics::Vec2f {
    fn min_one(self) -> Self {
        vec2f(self.x.min(ONE_MINUS_EPSILON), self.y.min(ONE_MINUS_EPSILON))
    }
}

/// The bar: no combination of layers reflects more than it gets.
#[test]
fn no_combination_gains_energy() {
    let mut random = Random::new(8);
    let mut most = 0.0f64;
    for k in 0..600 {
        let m = random_material(&mut random);
        let wo = direction(random.uniform_f32().max(1e-3), random.uniform_f32());
        let albedo = furnace(prepare(m, wo), wo, 2048);
        // Tables are within 0.5 %, of dielectrics within 3 %; the rest is what 2048 samples leave.
        assert!(albedo < 1.035, "material {k} from {:?}: {albedo}\n{m:?}", wo.to_array());
        most = most.max(albedo);
    }
    assert!(most > 0.9, "nothing bright was tested: {most}");
}

/// White surfaces stay white: what the layers take, they give, but for the coat's grazing light on a tilted normal.
#[test]
fn white_combinations_stay_white() {
    let coated = LayeredParameters { coat: 1.0, coat_roughness: 0.3, ..plain() };
    let fibres = LayeredParameters { sheen_color: WHITE, ..plain() };
    let metal = LayeredParameters { metallic: 1.0, coat: 0.5, ..plain() };
    let paper = LayeredParameters { diffuse_transmission: 0.6, ..plain() };
    let film = LayeredParameters { iridescence: 1.0, metallic: 0.0, ..plain() };
    let clay = |diffuse_roughness| LayeredParameters { diffuse_roughness, ..plain() };
    let glass = LayeredParameters { transmission: 1.0, roughness: 0.4, ..plain() };
    let inside = LayeredParameters { eta: 1.0 / 1.5, inside: true, ..glass };
    let sheet = LayeredParameters { thin: true, ..glass };
    let air = LayeredParameters { ior: 1.0, eta: 1.0, ..glass };
    let materials = [
        plain(),
        coated,
        fibres,
        metal,
        paper,
        film,
        clay(0.5),
        clay(1.0),
        LayeredParameters { diffuse_roughness: 1.0, ..coated },
        LayeredParameters { diffuse_roughness: 1.0, ..paper },
        glass,
        inside,
        sheet,
        air,
        LayeredParameters { coat: 1.0, ..glass },
        LayeredParameters { specular: 0.5, ..glass },
        LayeredParameters { specular: 0.0, ..glass },
        LayeredParameters { specular: 0.0, ..inside },
        LayeredParameters { specular: 0.0, ..sheet },
    ];
    for (k, m) in materials.into_iter().enumerate() {
        for cos in [1.0, 0.7, 0.3, 0.1] {
            let wo = direction(cos, 0.1);
            let albedo = furnace(prepare(m, wo), wo, 16_384);
            // A film's colours are no white; its dielectric gets what is left, judged by the largest channel.
            let least = if m.iridescence > 0.0 { 0.9 } else { 0.965 };
            assert!((least..1.03).contains(&albedo), "material {k} from cosine {cos}: {albedo}\n{m:?}");
        }
    }
}

/// The lobes but the diffuse ones: the rest is two cosine lobes, and samples have the density that they say.
#[test]
fn lobes_are_told_apart() {
    let mut random = Random::new(12);
    let mut compared = 0;
    for k in 0..300 {
        let m = random_material(&mut random);
        let wo = direction(random.uniform_f32().max(0.05), random.uniform_f32());
        let whole = prepare(m, wo);
        let others = layered_without_diffuse(whole);
        for _ in 0..8 {
            let wi = direction(2.0 * random.uniform_f32() - 1.0, random.uniform_f32());
            let above = || rough_diffuse_factor(whole.diffuse_lobe, wo, wi);
            let albedo = if wi.z > 0.0 { above() } else { whole.diffuse_below };
            let diffuse = albedo * (wi.z.abs() / std::f32::consts::PI);
            let (a, b) = (layered_eval(whole, wo, wi).value_cos, layered_eval(others, wo, wi).value_cos);
            for (a, b) in a.to_array().into_iter().zip((b + diffuse).to_array()) {
                assert!((a - b).abs() <= 1e-5 + 1e-4 * a.abs(), "material {k}: {a} {b}");
            }
        }
        if !layered_reflects(whole) {
            continue;
        }
        let sum = others.p_specular + others.p_refracted + others.p_sheen + others.p_coat;
        assert!((sum - 1.0).abs() < 1e-5, "material {k}: {sum}");
        // The same integral by samples of all lobes and by those of the others alone, where neither has noise to speak of.
        if whole.widths.x.min(whole.widths.y).min(whole.coat_alpha) < 0.2 || whole.p_refracted > 0.0 {
            continue;
        }
        let n = 8192;
        let (mut all, mut alone) = (0.0f64, 0.0f64);
        for _ in 0..n {
            let (u_lobe, u) = (random.uniform_f32(), vec2f(random.uniform_f32(), random.uniform_f32()));
            let s = layered_sample(whole, wo, u_lobe, u);
            if s.pdf > 0.0 {
                all += f64::from(layered_eval(others, wo, s.wi).value_cos.x / s.pdf);
            }
            alone += f64::from(layered_sample(others, wo, u_lobe, u).weight.x);
        }
        let (all, alone) = (all / f64::from(n), alone / f64::from(n));
        assert!((all - alone).abs() < 0.02 + 0.05 * alone, "material {k}: {all} {alone}");
        compared += 1;
    }
    assert!(compared > 20, "{compared}");
}

/// Base colour is what layers leave alone; paper and velvet have colours of their own.
#[test]
fn layers_have_a_colour() {
    let near = |a: Vec3f, b: Vec3f| {
        let close = |(a, b): (f32, f32)| (a - b).abs() < 1e-6;
        assert!(a.to_array().into_iter().zip(b.to_array()).all(close), "{a:?} {b:?}");
    };
    let (red, green) = (vec3f(0.8, 0.1, 0.1), vec3f(0.0, 1.0, 0.0));
    let coated = LayeredParameters { base_color: red, coat: 1.0, iridescence: 1.0, ..plain() };
    near(layered_color(coated, 0.0), red);
    let paper = LayeredParameters { diffuse_transmission: 0.5, diffuse_transmission_color: green, ..coated };
    near(layered_color(paper, 0.0), (red + green) * 0.5);
    let metal = LayeredParameters { metallic: 1.0, ..paper };
    near(layered_color(metal, 0.0), red);
    let velvet = LayeredParameters { sheen_color: green * 0.5, ..coated };
    near(layered_color(velvet, 0.4), red * 0.8 + green * 0.2);
    near(layered_color(LayeredParameters { inside: true, ..velvet }, 0.4), red);
}

/// Without layers the model is metallic-roughness, value by value.
#[test]
fn no_layers_are_metallic_roughness() {
    let mut random = Random::new(4);
    for _ in 0..2000 {
        let color = vec3f(random.uniform_f32(), random.uniform_f32(), random.uniform_f32());
        let (metallic, roughness) = (random.uniform_f32(), 0.1 + 0.9 * random.uniform_f32());
        let m = LayeredParameters { base_color: color, metallic, roughness, ..plain() };
        let wo = direction(random.uniform_f32().max(0.01), random.uniform_f32());
        let wi = direction(random.uniform_f32().max(0.01), random.uniform_f32());
        let a = layered_eval(prepare(m, wo), wo, wi).value_cos.to_array();
        let other = MetallicRoughness { base_color: color, metallic, roughness, specular: 1.0, ior: 1.5 };
        let albedo = GgxAlbedo::shared().lookup(wo.z, roughness);
        let b = glossy_eval(metallic_roughness_bsdf(other, albedo, false), wo, wi).value_cos.to_array();
        for (a, b) in a.into_iter().zip(b) {
            assert!((a - b).abs() <= 1e-3 * b.max(1e-2), "{a} and {b}: {m:?}, {wo:?}, {wi:?}");
        }
    }
}

/// Without a reflection above it, the rough diffuse base is reciprocal, and brighter than Lambert's towards the light.
#[test]
fn rough_diffuse_bases_are_reciprocal() {
    let mut random = Random::new(17);
    let none = LayeredParameters { specular: 0.0, base_color: vec3f(0.7, 0.4, 0.1), ..plain() };
    for _ in 0..2000 {
        let m = LayeredParameters { diffuse_roughness: random.uniform_f32(), ..none };
        let wo = direction(random.uniform_f32().max(0.02), random.uniform_f32());
        let wi = direction(random.uniform_f32().max(0.02), random.uniform_f32());
        let value = |wo: Vec3f, wi: Vec3f| layered_eval(prepare(m, wo), wo, wi).value_cos * (1.0 / wi.z);
        for (there, back) in value(wo, wi).to_array().into_iter().zip(value(wi, wo).to_array()) {
            assert!((there - back).abs() <= 1e-3 * there.max(back) + 1e-6, "{there} and {back}: {m:?}");
        }
        let towards = |m: LayeredParameters| layered_eval(prepare(m, wo), wo, wo).value_cos.x;
        let rough = LayeredParameters { diffuse_roughness: 1.0, ..none };
        assert!(wo.z > 0.7 || towards(rough) > 1.1 * towards(none), "{wo:?}");
    }
}

/// A metal without energy compensation has nothing that looks at one direction alone.
#[test]
fn anisotropic_metals_are_reciprocal() {
    let mut random = Random::new(6);
    let mut bright = 0;
    for _ in 0..2000 {
        let (roughness, anisotropy) = (0.2 + 0.8 * random.uniform_f32(), random.uniform_f32());
        let m = LayeredParameters { metallic: 1.0, roughness, anisotropy, ..plain() };
        let wo = direction(random.uniform_f32().max(0.02), random.uniform_f32());
        let wi = direction(random.uniform_f32().max(0.02), random.uniform_f32());
        let value = |wo: Vec3f, wi: Vec3f| {
            let b = layered_bsdf(m, albedos(&m, wo), wo, WHITE, true);
            layered_eval(b, wo, wi).value_cos.x / wi.z
        };
        let (there, back) = (value(wo, wi), value(wi, wo));
        assert!((there - back).abs() <= 2e-3 * there.max(back) + 1e-6, "{there} and {back}: {m:?}");
        bright += usize::from(there > 1e-2);
    }
    assert!(bright > 500, "only {bright} values are not dark");
}

const COLUMNS: usize = 24;
const ROWS: usize = 24;

/// The cell of a direction: rows of equal height on the sphere, columns of azimuth.
fn cell(d: Vec3f) -> usize {
    let row = ((d.z + 1.0) * 0.5 * ROWS as f32) as usize;
    let column = ((d.y.atan2(d.x) / std::f32::consts::TAU).rem_euclid(1.0) * COLUMNS as f32) as usize;
    row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
}

/// ∫ pdf dω over every cell, by midpoints.
fn expected_shares(b: Layered, wo: Vec3f) -> Vec<f64> {
    const FINE: usize = 14;
    let mut shares = vec![0.0; ROWS * COLUMNS];
    let (rows, columns) = (ROWS * FINE, COLUMNS * FINE);
    let area = 4.0 * std::f64::consts::PI / (rows * columns) as f64;
    for i in 0..rows {
        let z = -1.0 + 2.0 * (i as f32 + 0.5) / rows as f32;
        for j in 0..columns {
            let wi = direction(z, (j as f32 + 0.5) / columns as f32);
            shares[i / FINE * COLUMNS + j / FINE] += f64::from(layered_eval(b, wo, wi).pdf) * area;
        }
    }
    shares
}

/// Materials whose lobes are wide enough for a grid.
fn wide_materials() -> Vec<LayeredParameters> {
    let wide = LayeredParameters { roughness: 0.6, ..plain() };
    let tilted = direction(0.96, 0.3);
    vec![
        wide,
        LayeredParameters { diffuse_roughness: 0.5, ..wide },
        LayeredParameters { diffuse_roughness: 1.0, specular: 0.0, ..wide },
        LayeredParameters { anisotropy: 0.8, metallic: 1.0, ..wide },
        LayeredParameters { coat: 1.0, coat_roughness: 0.6, coat_normal: tilted, ..wide },
        LayeredParameters { sheen_color: WHITE, sheen_roughness: 0.6, ..wide },
        LayeredParameters { transmission: 1.0, anisotropy: 0.5, ..wide },
        LayeredParameters { transmission: 1.0, eta: 1.0 / 1.5, inside: true, ..wide },
        LayeredParameters { transmission: 0.7, thin: true, ..wide },
        LayeredParameters {
            diffuse_transmission: 0.5,
            sheen_color: WHITE,
            sheen_roughness: 0.7,
            coat: 0.6,
            coat_roughness: 0.6,
            iridescence: 1.0,
            transmission: 0.4,
            metallic: 0.2,
            ..wide
        },
    ]
}

/// The density integrates to the share of samples that are not rejected, and samples follow it.
#[test]
fn samples_follow_the_density() {
    const N: usize = 40_000;
    let materials = wide_materials();
    let views = [direction(0.95, 0.1), direction(0.5, 0.7), direction(0.15, 0.4)];
    let tests = materials.len() * views.len();
    for (k, m) in materials.into_iter().enumerate() {
        for (v, wo) in views.into_iter().enumerate() {
            let b = prepare(m, wo);
            let mut expected: Vec<f64> = expected_shares(b, wo).iter().map(|s| s * N as f64).collect();
            let total: f64 = expected.iter().sum();
            assert!(
                total < 1.004 * N as f64,
                "{m:?} from {wo:?}: the density integrates to {}",
                total / N as f64
            );
            let mut observed = vec![0; expected.len()];
            let mut rejected = 0;
            let mut random = Random::new((k * 10 + v) as u64);
            for _ in 0..N {
                let u = vec2f(random.uniform_f32(), random.uniform_f32());
                let s = layered_sample(b, wo, random.uniform_f32(), u);
                if s.pdf > 0.0 {
                    observed[cell(s.wi)] += 1;
                } else {
                    rejected += 1;
                }
            }
            expected.iter_mut().for_each(|e| *e = e.max(1e-3));
            if N as f64 - total > 0.004 * N as f64 {
                observed.push(rejected);
                expected.push(N as f64 - total);
            } else {
                // Less than quadrature can tell from nothing.
                assert!(rejected < N as u64 / 120, "{m:?} from {wo:?}: {rejected} rejected");
            }
            assert_chi2(&format!("{m:?} from {wo:?}"), &observed, &expected, tests);
        }
    }
}

#[test]
#[should_panic(expected = "do not follow the density")]
fn a_wrong_density_is_noticed() {
    const N: usize = 40_000;
    let wo = direction(0.8, 0.1);
    let metal = LayeredParameters { metallic: 1.0, roughness: 0.6, anisotropy: 0.8, ..plain() };
    let b = prepare(metal, wo);
    let other = prepare(LayeredParameters { anisotropy: 0.7, ..metal }, wo);
    let expected: Vec<f64> = expected_shares(other, wo).iter().map(|s| (s * N as f64).max(1e-3)).collect();
    let mut observed = vec![0; expected.len()];
    let mut random = Random::new(3);
    for _ in 0..N {
        let s = layered_sample(b, wo, 0.5, vec2f(random.uniform_f32(), random.uniform_f32()));
        observed[cell(s.wi)] += u64::from(s.pdf > 0.0);
    }
    assert_chi2("another anisotropy", &observed, &expected, 1);
}

#[test]
fn extreme_parameters_give_finite_numbers() {
    let denormal = f32::MIN_POSITIVE / 16.0;
    let edges = [0.0, denormal, 1e-3, 0.5, 1.0];
    let unit = [0.0, 1e-7, 0.5, ONE_MINUS_EPSILON];
    let views = [1.0, 0.5, 1e-4, 1e-7, 1e-20, denormal].map(|cos| direction(cos, 0.3));
    let mut random = Random::new(21);
    let mut sampled = 0;
    for _ in 0..1500 {
        let mut edge = || edges[(random.bits() % edges.len() as u64) as usize];
        let color = |x: f32| vec3f(x, 1.0 - x, x);
        let (thin, inside) = (edge() < 0.1, edge() < 0.1);
        let ior: f32 = [0.0, 1.0, 1.0001, 1.5, 3.0][(edge() * 4.0) as usize];
        let bend = ior.max(1.0);
        let m = LayeredParameters {
            base_color: color(edge()),
            metallic: edge(),
            roughness: edge(),
            diffuse_roughness: edge(),
            specular: edge(),
            specular_color: color(edge()),
            ior,
            anisotropy: edge(),
            transmission: edge(),
            diffuse_transmission: edge(),
            diffuse_transmission_color: color(edge()),
            sheen_color: color(edge()),
            sheen_roughness: edge(),
            coat: edge(),
            coat_roughness: edge(),
            coat_normal: vec3f(0.0, 0.0, 1.0),
            iridescence: edge(),
            film_ior: 1.0 + 2.0 * edge(),
            film_thickness: 2000.0 * edge(),
            eta: if inside { 1.0 / bend } else { bend },
            thin,
            inside: inside && !thin,
        };
        for wo in views {
            let b = prepare(m, wo);
            for x in unit {
                for u_lobe in [0.0, 0.3, 0.7, ONE_MINUS_EPSILON] {
                    let s = layered_sample(b, wo, u_lobe, vec2f(x, 1.0 - x.max(1e-7)));
                    assert!(s.pdf >= 0.0 && s.pdf.is_finite(), "{s:?} {m:?} {wo:?}");
                    for w in s.weight.to_array() {
                        assert!((0.0..=300.0).contains(&w), "{s:?} {m:?} from {wo:?}\n{b:?}");
                    }
                    sampled += usize::from(s.pdf > 0.0);
                }
            }
            for wi in
                [wo, wo * -1.0, vec3f(-wo.x, -wo.y, wo.z), direction(1e-20, 0.4), direction(-1e-20, 0.4)]
            {
                let v = layered_eval(b, wo, wi);
                assert!(v.pdf >= 0.0 && v.pdf.is_finite(), "{v:?} {m:?} {wo:?} {wi:?}");
                let sound = |x: f32| x >= 0.0 && x.is_finite();
                assert!(v.value_cos.to_array().into_iter().all(sound), "{v:?} {m:?} {wo:?} {wi:?}");
            }
        }
    }
    assert!(sampled > 50_000, "{sampled}");
}

/// Layers do what they are for: a coat makes a highlight, a film colours it, grain stretches it, glass lets light
/// through, dispersion bends blue more than red.
#[test]
fn layers_have_their_effects() {
    let wo = direction(0.8, 0.0);
    let mirrored = vec3f(-wo.x, -wo.y, wo.z);
    let value = |m: LayeredParameters, wi: Vec3f| layered_eval(prepare(m, wo), wo, wi).value_cos;
    let coated = LayeredParameters { coat: 1.0, coat_roughness: 0.1, ..plain() };
    assert!(value(coated, mirrored).x > 10.0 * value(plain(), mirrored).x);
    let film = value(LayeredParameters { iridescence: 1.0, base_color: BLACK, ..plain() }, mirrored);
    assert!(film.x.max(film.y).max(film.z) > 1.3 * film.x.min(film.y).min(film.z), "{film:?}");
    let above = vec3f(0.0, 0.0, 1.0);
    let grained = LayeredParameters { metallic: 1.0, roughness: 0.3, anisotropy: 1.0, ..plain() };
    let across = layered_eval(prepare(grained, above), above, direction(0.8, 0.25)).value_cos.x;
    let along = layered_eval(prepare(grained, above), above, direction(0.8, 0.0)).value_cos.x;
    assert!(along > 5.0 * across, "{along} along, {across} across");
    let glass = LayeredParameters { transmission: 1.0, roughness: 0.2, ..plain() };
    let refracted = vec3f(-wo.x / 1.5, 0.0, -(1.0 - wo.x * wo.x / 2.25).sqrt());
    assert!(value(glass, refracted).x > 1.0);
    let red = choose_dispersed(1.0, 1.5, WHITE, 0.1);
    let blue = choose_dispersed(1.0, 1.5, WHITE, 0.9);
    assert!(red.ior < 1.5 && blue.ior > 1.5 && red.tint.y == 0.0 && (blue.tint.z - 3.0).abs() < 1e-4);
}

/// Whatever colours a path has left, dispersion keeps their mean.
#[test]
fn dispersion_keeps_the_mean() {
    for throughput in [WHITE, vec3f(0.2, 0.7, 0.1), vec3f(0.0, 0.5, 0.5), vec3f(3.0, 0.0, 0.0)] {
        let mut sum = BLACK;
        let n = 10_000;
        for i in 0..n {
            sum += choose_dispersed(0.5, 1.5, throughput, (i as f32 + 0.5) / n as f32).tint * throughput;
        }
        let mean = sum * (1.0 / n as f32);
        for (a, b) in mean.to_array().into_iter().zip(throughput.to_array()) {
            assert!((a - b).abs() < 2e-3 * b.max(1.0), "{mean:?} of {throughput:?}");
        }
    }
}

/// Fibres scatter next to nothing towards a viewer above them, and much at grazing angles; never much more than arrives.
#[test]
fn sheen_is_a_grazing_lobe() {
    let table = SheenAlbedo::shared();
    for roughness in [0.1, 0.3, 0.5, 0.8, 1.0] {
        let (above, grazing) = (table.lookup(1.0, roughness), table.lookup(0.15, roughness));
        assert!(above < grazing, "roughness {roughness}: {above} above, {grazing} at a grazing angle");
        assert!(grazing > 0.1 && grazing < 1.3, "roughness {roughness}: {grazing}");
    }
}
