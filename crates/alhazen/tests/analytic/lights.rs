//! Simple lights over a floor.

use super::*;
use scene::{ColorSpace, Filter, Image, Pixels, Sampler, Texture, TextureRef};

// ------------------------------------------------------------------------------------------------ simple lights

/// E = I cos θ / d², over a whole picture: also where the orthographic camera puts what.
#[test]
fn a_point_light_over_a_floor() {
    let mut scene = floor_spot();
    let light = Vec3::new(0.7, 1.0, -0.4);
    add_light(&mut scene, LightKind::Point { position: light, intensity: Vec3::new(3.0, 2.0, 1.0) });
    scene.cameras = vec![from_above(0.0, 0.0, 5.0, 4.0)];
    let e = estimate(&scene, &job(&scene, 32, 32, 3), 256);
    for (i, mean) in e.mean.iter().enumerate() {
        // The mean over the pixel by 8×8 points.
        let offset = |k: usize| (k as f64 + 0.5) / 8.0;
        let sum: f64 = (0..64)
            .map(|k| {
                let x = ((i % 32) as f64 + offset(k % 8)) / 8.0 - 2.0 - f64::from(light.x);
                let z = ((i / 32) as f64 + offset(k / 8)) / 8.0 - 2.0 - f64::from(light.z);
                (1.0 + x * x + z * z).powf(-1.5) / 64.0
            })
            .sum();
        for (c, intensity) in [3.0, 2.0, 1.0].into_iter().enumerate() {
            let expected = reflected(sum * intensity)[c];
            let error = 5.5 * e.variance[i][c].sqrt() + 2e-3 * expected;
            let (x, y) = (i % 32, i / 32);
            assert!(
                (mean[c] - expected).abs() < error,
                "pixel ({x}, {y}): {} instead of {expected}",
                mean[c]
            );
        }
    }
}

/// A spot is a point within its inner angle, dark outside the outer one, and has glTF's falloff between.
#[test]
fn a_spot_light_over_a_floor() {
    let (inner, outer) = (0.3f32, 0.6f32);
    let falloff = |angle: f64| {
        let (i, o) = (f64::from(inner).cos(), f64::from(outer).cos());
        ((angle.cos() - o) / (i - o)).clamp(0.0, 1.0).powi(2)
    };
    for angle in [0.0f64, 0.25, 0.4, 0.5, 0.59] {
        let mut scene = floor_spot();
        add_light(
            &mut scene,
            LightKind::Spot {
                position: Vec3::new(0.0, 2.0, 0.0),
                direction: Vec3::NEG_Y,
                intensity: Vec3::ONE,
                inner_angle: inner,
                outer_angle: outer,
            },
        );
        scene.cameras = vec![from_above((2.0 * angle.tan()) as f32, 0.0, 0.5, 0.002)];
        let e = estimate(&scene, &job(&scene, 8, 8, 3), 16);
        let distance2 = 4.0 / angle.cos().powi(2);
        let expected = reflected(falloff(angle) * angle.cos() / distance2);
        assert_mean(&format!("spot at {angle} rad"), &e, expected, 5.0 * ROUNDING);
    }
}

/// E = I cos³ θ / h² times the picture, whose rows lie as a camera at the projector's place would see them.
#[test]
fn a_projector_over_a_floor() {
    let mut scene = floor_spot();
    // Red at the top left, then green, blue and white.
    let pixels = vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]];
    let image = Image { name: "four".into(), width: 2, height: 2, pixels: Pixels::Rgba8(pixels) };
    scene.images.push(image);
    let nearest = Sampler { filter: Filter::Nearest, ..Sampler::default() };
    scene.textures.push(Texture::image(0, nearest, ColorSpace::Srgb));
    let kind = LightKind::Projector {
        position: Vec3::new(0.0, 2.0, 0.0),
        direction: Vec3::NEG_Y,
        up: Vec3::NEG_Z,
        intensity: Vec3::splat(3.0),
        field_of_view: std::f32::consts::FRAC_PI_2,
        picture: TextureRef::new(0),
    };
    add_light(&mut scene, kind);
    let places = [
        ([-0.8, -0.8], [1.0, 0.0, 0.0]),
        ([0.8, -0.8], [0.0, 1.0, 0.0]),
        ([-0.8, 0.8], [0.0, 0.0, 1.0]),
        ([0.8, 0.8], [1.0, 1.0, 1.0]),
        ([2.1, 0.5], [0.0, 0.0, 0.0]),
    ];
    for ([x, z], color) in places {
        scene.cameras = vec![from_above(x, z, 0.5, 0.002)];
        let e = estimate(&scene, &job(&scene, 8, 8, 3), 16);
        let distance2 = 4.0 + f64::from(x * x + z * z);
        let irradiance = 3.0 * (2.0 / distance2.sqrt()) / distance2;
        let expected = color.map(|c| c * reflected(irradiance)[0]);
        assert_mean(&format!("projector at ({x}, {z})"), &e, expected, 5.0 * ROUNDING);
    }
}

/// A sphere above the horizon: E = π L (R/d)² cos θ. As a sphere, scaled by an instance, and as triangles.
#[test]
fn a_sphere_light_over_a_floor() {
    let center = Vec3::new(2.0, 2.0, 0.0);
    let expected = reflected(PI * 3.0 * 0.25 / 8.0 * (2.0 / 8f64.sqrt()));
    let unit = || sphere([0.0; 3], 1.0);
    let placed =
        Affine3A::from_scale_rotation_translation(Vec3::splat(0.5), Quat::from_rotation_z(1.0), center);
    for (what, dynamic, shape, tolerance) in [
        ("sphere light", false, unit(), ROUNDING),
        ("instanced sphere light", true, unit(), ROUNDING),
        // Inscribed triangles have less area by about (π / 64)² / 2.
        ("sphere light of triangles", false, Shape::Triangles(uv_sphere(128, 64)), 3e-3),
    ] {
        let mut scene = floor_spot();
        let light = scene.add_material(emitter("light", [3.0; 3]));
        scene.add_shape("light", shape, light, placed);
        scene.instances.last_mut().unwrap().dynamic = dynamic;
        assert_mean(what, &estimate(&scene, &job(&scene, 32, 32, 2), 512), expected, tolerance);
    }
}

/// A square straight above: E = π L F with the form factor of a small patch to a square over it.
#[test]
fn a_square_light_over_a_floor() {
    // Form factor to a corner of an a × b rectangle at height c (Siegel and Howell, configuration 4), four times.
    let quarter = |a: f64, c: f64| {
        let x = a / c;
        let s = (1.0 + x * x).sqrt();
        (2.0 * x / s * (x / s).atan()) / (2.0 * PI)
    };
    for (half, height) in [(0.5, 1.0), (2.0, 0.7), (0.01, 1.5)] {
        let mut scene = floor_spot();
        let light = scene.add_material(emitter("light", [2.0; 3]));
        let h = half;
        scene.add_mesh(
            "light",
            quads(&[[[h, height, -h], [h, height, h], [-h, height, h], [-h, height, -h]]]),
            light,
        );
        let e = estimate(&scene, &job(&scene, 16, 16, 2), 256);
        let expected = reflected(PI * 2.0 * 4.0 * quarter(half, height));
        assert_mean(&format!("square light {half} at {height}"), &e, expected, ROUNDING);
        // From behind it is black, and lights nothing.
        scene.meshes.pop();
        let up = quads(&[[[-h, height, -h], [-h, height, h], [h, height, h], [h, height, -h]]]);
        let mesh = scene::Mesh::single("light", Shape::Triangles(up), 1);
        scene.meshes.push(mesh);
        assert_eq!(
            estimate(&scene, &job(&scene, 8, 8, 3), 16).mean_colour(),
            [0.0; 3],
            "light behind a light"
        );
    }
}

/// E = E₀ cos θ, whether the sun is a direction or a disc: it stays above the horizon.
#[test]
fn a_sun_over_a_floor() {
    for tilt in [0.0f32, 1.0] {
        for angular_diameter in [0.0, 0.0093, 0.2, 0.9] {
            let mut scene = floor_spot();
            let direction = Vec3::new(-tilt.sin(), -tilt.cos(), 0.0);
            let irradiance = Vec3::new(4.0, 3.0, 2.0);
            add_light(&mut scene, LightKind::Directional { direction, irradiance, angular_diameter });
            let e = estimate(&scene, &job(&scene, 16, 16, 2), 256);
            let expected = [4.0, 3.0, 2.0].map(|e0| reflected(e0 * f64::from(tilt.cos()))[0]);
            assert_mean(&format!("sun of {angular_diameter} rad at {tilt}"), &e, expected, ROUNDING);
        }
    }
}

/// A glossy surface reflects the disc of a sun that only lights as it does one that is also seen.
#[test]
fn a_wide_sun_on_metal_is_the_same_as_light_and_in_the_sky() {
    let mut scene = floor_spot();
    scene.materials[0] = metallic_roughness("metal", [0.9; 3], 1.0, 0.4);
    scene.cameras = vec![camera([0.0, 1.0, 1.5], [0.0, 0.0, 0.0], 40.0)];
    let direction = Vec3::new(0.0, 0.6, -0.8);
    let (irradiance, angular_radius) = (Vec3::splat(2.0), 0.3);
    let mut sky = scene.clone();
    let (zero, sun) = (Vec3::ZERO, Some(scene::Sun { direction, irradiance, angular_radius }));
    sky.environment = Environment::Sky(Sky { horizon: zero, zenith: zero, ground: zero, sun });
    let angular_diameter = 2.0 * angular_radius;
    add_light(&mut scene, LightKind::Directional { direction: -direction, irradiance, angular_diameter });
    let (a, b) = (estimate(&scene, &job(&scene, 32, 32, 2), 256), estimate(&sky, &job(&sky, 32, 32, 2), 256));
    common::assert_same_coarse("sun-as-light-and-in-sky", &a, &b);
}
