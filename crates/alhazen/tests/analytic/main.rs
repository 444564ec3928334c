//! Scenes whose picture is known in closed form, or from one integral.
//!
//! Tolerances: noise is judged by its own standard error; what is stated beside it is for single precision (1e-3, of
//! which offsets of ray origins and the finite spot that is looked at are the larger part) unless a test says more.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod ambient_occlusion;
#[path = "../common/mod.rs"]
mod common;
mod coverage;
mod lights;
mod rough_diffuse;

use alhazen::{
    Environment, Integrator, Job, Light, LightKind, Mis, PathSettings, Pixels, Scene, SceneImage, Shape,
    Switch, picture_ray,
};
use common::{assert_mean, estimate, from_above, job};
use coverage::camera_above;
use glam::{Affine3A, Quat, Vec3};
use scene::{Material, Model, Sky};
use std::f64::consts::PI;
use testkit::scenes::{
    Build, camera, covering, cuboid, dielectric, emitter, flipped, ground, lambert, metallic_roughness,
    quads, sphere, uv_sphere,
};

const ROUNDING: f64 = 1e-3;

fn under_white_sky() -> Scene {
    Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() }
}

fn add_light(scene: &mut Scene, kind: LightKind) {
    scene.lights.push(Light::new("light", kind));
}

/// A floor of reflectance 0.5 and a camera that looks straight down on a spot of 1 cm at its origin.
fn floor_spot() -> Scene {
    let mut scene = Scene::default();
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", ground(0.0, 10.0), floor);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.01));
    scene
}

/// Radiance that the floor of [`floor_spot`] reflects from irradiance `e`.
fn reflected(e: f64) -> [f64; 3] {
    [0.5 * e / PI; 3]
}

// ---------------------------------------------------------------------------------------------------- furnaces

/// Inside a closed surface that emits E and reflects ρ: L = E (1 + ρ + ρ² + …), cut off at the depth.
#[test]
fn inside_a_closed_furnace_radiance_is_a_geometric_series() {
    let rho = 0.6f64;
    for (what, inside_of_sphere) in [("box", false), ("sphere", true)] {
        let mut scene = Scene::default();
        let mut wall = lambert("wall", [rho as f32; 3]);
        wall.emission = Vec3::new(1.0, 0.5, 2.0);
        wall.emission_two_sided = inside_of_sphere;
        let wall = scene.add_material(wall);
        if inside_of_sphere {
            scene.add_shape("wall", sphere([0.3, 0.1, 0.2], 2.0), wall, Affine3A::IDENTITY);
        } else {
            scene.add_mesh("wall", flipped(cuboid([-1.0, -2.0, -1.0], [1.5, 1.0, 1.0])), wall);
        }
        scene.cameras.push(camera([0.2, 0.1, 0.0], [1.0, 0.3, -0.4], 70.0));
        for depth in [1u32, 2, 3, 24] {
            let series = (1.0 - rho.powi(depth as i32)) / (1.0 - rho);
            let e = estimate(&scene, &job(&scene, 24, 24, depth), 128);
            let what = format!("furnace in a {what}, depth {depth}");
            assert_mean(&what, &e, [series, 0.5 * series, 2.0 * series], ROUNDING);
        }
    }
}

/// An analytic sphere whose material does not emit on both sides is dark inside.
#[test]
fn a_sphere_light_does_not_shine_inwards_unless_it_says_so() {
    let mut scene = Scene::default();
    let mut shell = emitter("shell", [1.0; 3]);
    let inner = scene.add_material(lambert("inner", [0.5; 3]));
    scene.add_mesh("inner", cuboid([-0.2, -0.2, -1.2], [0.2, 0.2, -0.8]), inner);
    shell.base_color = lambert("", [0.5; 3]).base_color;
    let shell = scene.add_material(shell);
    scene.add_shape("shell", sphere([0.0; 3], 2.0), shell, Affine3A::IDENTITY);
    scene.cameras.push(camera([0.0; 3], [0.0, 0.0, -1.0], 60.0));
    let dark = estimate(&scene, &job(&scene, 16, 16, 6), 32);
    // Rounding puts some points of the shell outside of it, from where its edge is seen: next to nothing.
    let mean = dark.mean_colour();
    assert!(mean[0] < 1e-4, "light inside a sphere that emits outwards only: {mean:?}");
}

/// A convex object that absorbs nothing cannot be seen in a uniform environment.
#[test]
fn white_objects_vanish_in_a_uniform_environment() {
    let white = |name: &str| lambert(name, [1.0; 3]);
    let mirror = Material { model: Model::Mirror, ..white("mirror") };
    let thin = Material { thin_walled: true, ..dielectric("thin", 1.5, 0.0) };
    // Energy compensation is tabulated: half a per cent for each scattering; a path through glass has two and more.
    let mut materials = vec![
        (white("Lambert"), ROUNDING),
        (mirror, ROUNDING),
        (dielectric("clear glass", 1.5, 0.0), ROUNDING),
        (dielectric("diamond", 2.4, 0.0), ROUNDING),
        (thin, ROUNDING),
        (dielectric("frosted glass", 1.5, 0.4), 0.015),
        (dielectric("very frosted glass", 1.5, 0.8), 0.015),
    ];
    for roughness in [0.0, 0.05, 0.2, 0.5, 1.0] {
        materials.push((metallic_roughness(&format!("metal {roughness}"), [1.0; 3], 1.0, roughness), 0.005));
        materials
            .push((metallic_roughness(&format!("plastic {roughness}"), [1.0; 3], 0.0, roughness), 0.005));
    }
    for (material, tolerance) in materials {
        for shape in [sphere([0.0; 3], 1.0), Shape::Triangles(cuboid([-0.6; 3], [0.6; 3]))] {
            let mut scene = under_white_sky();
            let what = format!(
                "{} {}",
                material.name,
                if matches!(shape, Shape::Spheres(_)) { "sphere" } else { "box" }
            );
            // A box of glass traps light by total reflection between its parallel sides: it needs very long paths.
            let depth = if material.model == Model::Dielectric { 512 } else { 8 };
            let material = scene.add_material(material.clone());
            scene.add_shape(&what, shape, material, Affine3A::from_rotation_y(0.5));
            scene.cameras.push(camera([0.0, 0.7, 2.6], [0.0; 3], 40.0));
            let spp = if depth > 8 { 256 } else { 64 };
            let e = estimate(&scene, &job(&scene, 24, 24, depth), spp);
            assert_mean(&what, &e, [1.0; 3], tolerance);
        }
    }
}

/// Through a body that bends nothing light goes straight on, and becomes less by the law of Beer and Lambert.
#[test]
fn bodies_absorb_by_their_thickness() {
    let color = Vec3::new(0.8, 0.5, 0.1);
    let interior = scene::Interior { attenuation_color: color, attenuation_distance: 0.5 };
    for (layered, thickness) in [(false, 0.25f32), (false, 1.5), (true, 0.5)] {
        let mut scene = under_white_sky();
        let mut air = Material { interior, ..dielectric("coloured air", 1.0, 0.0) };
        // Of nothing, but asked for: the layered model, whose refraction has a width.
        air.layers.dispersion = if layered { 1.0 } else { 0.0 };
        let air = scene.add_material(air);
        let half = f64::from(thickness) / 2.0;
        scene.add_mesh("slab", cuboid([-20.0, -half, -20.0], [20.0, half, 20.0]), air);
        scene.cameras.push(from_above(0.0, 0.0, 3.0, 0.5));
        let e = estimate(&scene, &job(&scene, 16, 16, 16), 1024);
        let left = (-interior.absorption() * thickness).exp().as_dvec3().to_array();
        // Dispersed light is one channel at a time; the lobe is a thousandth of a radian wide.
        assert_mean(&format!("{thickness} m, layered {layered}"), &e, left, 5e-3);
    }
}

/// Layers take from what is below what they give. Tolerances: tables, twice or more where there are several lobes.
#[test]
fn white_layered_objects_vanish_in_a_uniform_environment() {
    use scene::{Clearcoat, Iridescence, Layers, Sheen};
    let coat = Clearcoat { strength: 1.0, roughness: 0.2, ..Clearcoat::default() };
    let sheen = Sheen { color: Vec3::ONE, roughness: 0.5, ..Sheen::default() };
    let layered =
        |name: &str, layers: Layers| Material { layers, ..metallic_roughness(name, [1.0; 3], 0.0, 0.4) };
    let coated_metal = Material {
        layers: Layers { clearcoat: coat.clone(), ..Layers::default() },
        ..metallic_roughness("coated metal", [1.0; 3], 1.0, 0.3)
    };
    let coated_glass = Material {
        layers: Layers { clearcoat: coat.clone(), ..Layers::default() },
        ..dielectric("coated glass", 1.5, 0.4)
    };
    let grey_film = Iridescence { strength: 1.0, thickness: [0.0, 0.0], ..Iridescence::default() };
    let materials = [
        (layered("coat", Layers { clearcoat: coat.clone(), ..Layers::default() }), 0.01),
        (layered("sheen", Layers { sheen: sheen.clone(), ..Layers::default() }), 0.02),
        (layered("both", Layers { clearcoat: coat, sheen, ..Layers::default() }), 0.02),
        // Even without thickness, the fitted spectra of the film's reflection are not quite white, and what is below gets what
        // the strongest channel leaves: green loses 1.2 %.
        (layered("clay", Layers { diffuse_roughness: 1.0, ..Layers::default() }), 0.01),
        (layered("film", Layers { iridescence: grey_film, ..Layers::default() }), 0.02),
        (coated_metal, 0.01),
        (coated_glass, 0.03),
    ];
    for (material, tolerance) in materials {
        let mut scene = under_white_sky();
        let what = material.name.clone();
        let material = scene.add_material(material);
        scene.add_shape(&what, sphere([0.0; 3], 1.0), material, Affine3A::IDENTITY);
        scene.cameras.push(camera([0.0, 0.7, 2.6], [0.0; 3], 40.0));
        let e = estimate(&scene, &job(&scene, 24, 24, 64), 1024);
        assert_mean(&what, &e, [1.0; 3], tolerance);
    }
}

/// Interpolated normals do not gain energy; what they lose at the silhouette is little.
#[test]
fn smooth_normals_neither_gain_nor_lose_much() {
    for material in [lambert("Lambert", [1.0; 3]), metallic_roughness("metal", [1.0; 3], 1.0, 0.3)] {
        let mut scene = under_white_sky();
        let index = scene.add_material(material);
        scene.add_mesh("ball", uv_sphere(32, 16), index);
        scene.cameras.push(camera([0.0, 0.0, 3.0], [0.0; 3], 38.0));
        let (mean, _) = common::mean_and_error(&estimate(&scene, &job(&scene, 32, 32, 8), 64));
        assert!((0.98..1.003).contains(&mean[0]), "a white ball with smooth normals shows {mean:?}, not 1");
    }
}

// ------------------------------------------------------------------------------------------------ environments

/// An environment image and the irradiance on a floor below it, by summing over a fine grid.
fn under_image(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> (Scene, f64) {
    let mut scene = floor_spot();
    let values: Vec<f32> = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    let at = |x: i64, y: i64| {
        let (w, h) = (i64::from(width), i64::from(height));
        f64::from(values[(y.clamp(0, h - 1) * w + x.rem_euclid(w)) as usize])
    };
    // Bilinear interpolation between pixel centres.
    let radiance = |u: f64, v: f64| {
        let (x, y) =
            (u * f64::from(width) - 0.5, (v * f64::from(height) - 0.5).clamp(0.0, f64::from(height - 1)));
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let (x0, y0) = (x0 as i64, y0 as i64);
        (at(x0, y0) * (1.0 - fx) + at(x0 + 1, y0) * fx) * (1.0 - fy)
            + (at(x0, y0 + 1) * (1.0 - fx) + at(x0 + 1, y0 + 1) * fx) * fy
    };
    let fine = (8 / (width / 256).max(1)).max(2);
    let (nu, nv) = (width * fine, height * fine / 2); // the upper hemisphere
    let mut irradiance = 0.0;
    for j in 0..nv {
        let v = (f64::from(j) + 0.5) / f64::from(height * fine);
        let theta = v * PI;
        let row: f64 = (0..nu).map(|i| radiance((f64::from(i) + 0.5) / f64::from(nu), v)).sum();
        irradiance +=
            row * theta.cos() * theta.sin() * (2.0 * PI / f64::from(nu)) * (PI / f64::from(height * fine));
    }
    let pixels = Pixels::Rgb32F(values.iter().map(|v| [*v; 3]).collect());
    scene.images.push(SceneImage { name: "sky".into(), width, height, pixels });
    scene.environment = Environment::Image { image: 0, rotation: 0.3, intensity: 1.0 };
    (scene, irradiance)
}

#[test]
fn one_bright_pixel_in_the_environment() {
    for (x, y) in [(5, 2), (0, 1), (15, 3), (7, 0)] {
        let (scene, e) = under_image(16, 8, |i, j| if (i, j) == (x, y) { 50.0 } else { 0.0 });
        let picture = estimate(&scene, &job(&scene, 16, 16, 2), 1024);
        assert_mean(&format!("bright pixel ({x}, {y})"), &picture, reflected(e), 2e-3);
    }
}

/// The sampling table of a large picture has a million entries: choosing one must not use up the random number.
#[test]
fn a_dim_sky_with_a_strong_sun_in_a_large_environment() {
    let is_sun = |i: u32, j: u32| (600..604).contains(&i) && (100..104).contains(&j);
    let (mut scene, e) =
        under_image(2048, 1024, |i, j| if is_sun(i, j) { 60_000.0 } else { 1.0 + (i % 7) as f32 * 0.1 });
    let picture = estimate(&scene, &job(&scene, 32, 32, 2), 512);
    assert_mean("large environment", &picture, reflected(e), 3e-3);
    // Other lights, even if they bring nothing, take their part of the random number.
    for i in 0..3000 {
        let position = Vec3::new(0.0, -2.0 - i as f32, 0.0);
        add_light(&mut scene, LightKind::Point { position, intensity: Vec3::splat(0.3) });
    }
    let picture = estimate(&scene, &job(&scene, 32, 32, 2), 1024);
    assert_mean("large environment with many lights", &picture, reflected(e), 3e-3);
}

/// The upper half of the picture is up, and +X is right of the centre column, which looks to −Z.
#[test]
fn the_panorama_of_an_environment_is_its_image() {
    let (mut scene, _) = under_image(16, 8, |i, j| (i + 16 * j) as f32);
    scene.environment = Environment::Image { image: 0, rotation: 0.0, intensity: 2.0 };
    scene.meshes.clear();
    scene.instances.clear();
    scene.cameras = vec![camera([0.0; 3], [0.0, 0.0, -1.0], 60.0)];
    scene.cameras[0].projection = scene::Projection::Panorama;
    let e = estimate(&scene, &job(&scene, 16, 8, 1), 256);
    for (i, mean) in e.mean.iter().enumerate() {
        let (x, y) = (i % 16, i / 16);
        if (1..15).contains(&x) && (1..7).contains(&y) {
            let expected = 2.0 * (x + 16 * y) as f64;
            let slack = 5.0 * e.variance[i][0].sqrt() + 0.01;
            assert!(
                (mean[0] - expected).abs() < slack,
                "panorama pixel ({x}, {y}): {} not {expected}",
                mean[0]
            );
        }
    }
}

/// Each pixel shows the mean of what the image has, interpolated, in the directions that it looks to.
#[test]
fn fisheyes_and_cube_maps_show_the_environment_in_its_directions() {
    let texel = |i: i64, j: i64| (i.rem_euclid(16) + 16 * j.clamp(0, 7)) as f64;
    let (mut scene, _) = under_image(16, 8, |i, j| texel(i as i64, j as i64) as f32);
    scene.environment = Environment::Image { image: 0, rotation: 0.0, intensity: 2.0 };
    scene.meshes.clear();
    scene.instances.clear();
    let radiance = |direction: [f32; 3]| {
        let [x, y, z] = direction.map(f64::from);
        let (u, v) = ((x.atan2(-z) / (2.0 * PI) + 0.5) * 16.0 - 0.5, (0.5 - y.asin() / PI) * 8.0 - 0.5);
        let (i, j) = (u.floor() as i64, v.floor() as i64);
        let (across, down) = (u - u.floor(), v - v.floor());
        let row = |j: i64| texel(i, j) * (1.0 - across) + texel(i + 1, j) * across;
        2.0 * (row(j) * (1.0 - down) + row(j + 1) * down)
    };
    for (projection, width, height) in
        [(scene::Projection::Fisheye { fov: 4.0 }, 32, 24), (scene::Projection::Cubemap, 96, 16)]
    {
        scene.cameras = vec![camera([0.0; 3], [0.0, 0.0, -1.0], 60.0)];
        scene.cameras[0].projection = projection;
        let e = estimate(&scene, &job(&scene, width, height, 1), 256);
        let frame = alhazen::camera_frame(&scene.cameras[0], width, height);
        let mut black = 0;
        for (i, mean) in e.mean.iter().enumerate() {
            let (x, y) = ((i as u32 % width) as f32, (i as u32 / width) as f32);
            let at = |k: usize| (k as f32 + 0.5) / 24.0;
            let rays =
                (0..24 * 24).map(|k| picture_ray(&frame, width, height, x + at(k % 24), y + at(k / 24)));
            let (mut sum, mut outside) = (0.0, 0);
            for ray in rays {
                outside += u32::from(ray.t_max == 0.0);
                sum += if ray.t_max > 0.0 { radiance(ray.direction) } else { 0.0 };
            }
            let expected = sum / (24.0 * 24.0);
            // How much of a pixel the circle cuts off is known to a part of the grid.
            let of_edge = if outside % (24 * 24) > 0 { 0.03 } else { 5e-3 };
            let slack = 5.0 * e.variance[i][0].sqrt() + of_edge * expected + 1e-6;
            assert!(
                (mean[0] - expected).abs() < slack,
                "{projection} ({x}, {y}): {} not {expected}",
                mean[0]
            );
            black += usize::from(expected == 0.0);
        }
        // A circle in a picture of 4:3 leaves 41 % black.
        let share = black as f64 / e.mean.len() as f64;
        let is_round = projection != scene::Projection::Cubemap;
        assert!(if is_round { (0.33..0.42).contains(&share) } else { black < 4 }, "{projection}: {share}");
    }
}

// --------------------------------------------------------------------------------------------------------- depth

/// Depth 1 is emission, depth 2 direct light, and every segment adds light.
#[test]
fn each_segment_of_depth_adds_its_light() {
    let scene = testkit::scenes::cornell();
    let mean = |depth| estimate(&scene, &job(&scene, 32, 32, depth), 256).mean_colour();
    let emission = estimate(&scene, &job(&scene, 64, 64, 1), 64);
    for m in &emission.mean {
        // Only the light: its own radiance times the share of the pixel that it fills.
        let share = m[0] / 17.0;
        assert!((m[1] - 12.0 * share).abs() < 1e-6 && (m[2] - 4.0 * share).abs() < 1e-6, "{m:?} at depth 1");
        assert!((0.0..=1.0 + 1e-9).contains(&share));
    }
    let means = [1, 2, 3, 4, 8].map(mean);
    for pair in means.windows(2) {
        assert!((0..3).all(|c| pair[1][c] > pair[0][c] * 1.005), "deeper paths must add light: {means:?}");
    }
}

/// A mirror and glass count as segments like everything else.
#[test]
fn mirrors_and_glass_use_up_depth() {
    let mut scene = under_white_sky();
    let mirror = scene.add_material(Material { model: Model::Mirror, ..lambert("mirror", [0.5; 3]) });
    // Between two parallel mirrors at 45°: up to the sky after two reflections.
    scene.add_mesh("mirror", ground(0.0, 1.0), mirror);
    scene.cameras.push(camera_above());
    for (depth, expected) in [(1u32, 0.0), (2, 0.5), (3, 0.5)] {
        let e = estimate(&scene, &job(&scene, 8, 8, depth), 4);
        let mean = e.mean_colour()[0];
        assert!((mean - expected).abs() < 1e-5, "a mirror at depth {depth} shows {mean}, not {expected}");
    }
}

/// Russian roulette from the first segment on, with any least survival, leaves the furnace what it is.
#[test]
fn roulette_does_not_change_a_furnace() {
    let mut scene = Scene::default();
    let mut wall = lambert("wall", [0.8, 0.5, 0.1]);
    wall.emission = Vec3::ONE;
    let wall = scene.add_material(wall);
    scene.add_mesh("wall", flipped(cuboid([-1.0; 3], [1.0; 3])), wall);
    scene.cameras.push(camera([0.2, 0.1, 0.0], [1.0, 0.3, -0.4], 70.0));
    for (roulette_start, roulette_min_survival, splitting) in [(1, 0.05, 1), (2, 0.5, 3), (3, 1.0, 1)] {
        let settings = PathSettings {
            max_depth: 200,
            roulette_start,
            roulette_min_survival,
            splitting,
            mis: Mis::Power,
            clamp_indirect: None,
            caustics: Switch::Off,
            guiding: Switch::Off,
        };
        let job = Job { integrator: Integrator::Path(settings), ..job(&scene, 32, 32, 200) };
        let e = estimate(&scene, &job, 256);
        assert_mean(&format!("roulette {settings:?}"), &e, [5.0, 2.0, 1.0 / 0.9], ROUNDING);
    }
}
