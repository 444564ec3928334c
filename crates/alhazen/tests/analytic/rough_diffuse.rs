//! Rough diffuse surfaces: the formula of the paper, in double precision.

use super::*;

/// Portsmouth, Kutz and Hill, "EON", JCGT 14(1), 2025, with FON's exact directional albedo: π times
/// the BRDF.
fn eon(rho: f64, r: f64, wo: [f64; 3], wi: [f64; 3]) -> f64 {
    let (mu_o, mu_i) = (wo[1], wi[1]);
    let s = wo.iter().zip(wi).map(|(a, b)| a * b).sum::<f64>() - mu_o * mu_i;
    let s_over_t = if s > 0.0 { s / mu_o.max(mu_i) } else { s };
    let a = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * r);
    let albedo = |mu: f64| {
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        let g = sin * (mu.acos() - sin * mu) + 2.0 / 3.0 * (sin / mu * (1.0 - sin.powi(3)) - sin);
        a * (1.0 + r * g / PI)
    };
    let mean = a * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * PI)) * r);
    let rho_multiple = rho * rho * mean / (1.0 - rho * (1.0 - mean));
    let multiple = rho_multiple * (1.0 - albedo(mu_o)) * (1.0 - albedo(mu_i)) / (1.0 - mean);
    rho * a * (1.0 + r * s_over_t) + multiple
}

/// A floor of rough clay, seen from the side that the sun shines from and from the other.
#[test]
fn clay_under_a_sun_is_the_formula() {
    let from_zenith = 1.0f64;
    for (roughness, view) in [(0.5f32, -1.1f64), (1.0, -1.1), (1.0, 0.4), (1.0, 1.2)] {
        let mut scene = Scene::default();
        let mut clay = Material { specular: 0.0, ..metallic_roughness("clay", [0.9, 0.5, 0.2], 0.0, 0.5) };
        clay.layers.diffuse_roughness = roughness;
        let clay = scene.add_material(clay);
        scene.add_mesh("floor", ground(0.0, 10.0), clay);
        let towards = |angle: f64| [angle.sin(), angle.cos(), 0.0];
        let sun = towards(from_zenith).map(|x| x as f32);
        let direction = -Vec3::from(sun);
        let kind = LightKind::Directional { direction, irradiance: Vec3::ONE, angular_diameter: 0.0 };
        add_light(&mut scene, kind);
        let eye = towards(view).map(|x| 3.0 * x as f32);
        scene.cameras.push(camera(eye.map(f64::from), [0.0; 3], 0.1));
        let e = estimate(&scene, &job(&scene, 8, 8, 2), 16);
        let expected = [0.9, 0.5, 0.2].map(|rho| {
            eon(rho, f64::from(roughness), towards(view), towards(from_zenith)) * from_zenith.cos() / PI
        });
        assert_mean(&format!("roughness {roughness}, from {view}"), &e, expected, 2e-3);
    }
}
