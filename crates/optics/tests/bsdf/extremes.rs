//! Extreme and random parameters.

use super::energy::furnace;
use super::*;

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
