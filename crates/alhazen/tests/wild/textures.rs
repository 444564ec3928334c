//! Textures mean what their files say: floats stay floats, alpha too, and normal maps are turned with their coordinates.

use super::common::{assert_mean, estimate, from_above, job};
use super::parts::{add_floor, data, leaning, light, masked, mesh_sphere, unlit};
use alhazen::{AlphaMode, Environment, Material, Model, Pixels, Scene, SceneImage, Shape};
use glam::{Affine3A, Quat, Vec2, Vec3};
use scene::{ColorSpace, Sampler, Texture, TextureRef, UvTransform};
use testkit::Estimate;
use testkit::scenes::{Build, camera, dielectric, emitter, ground, lambert, metallic_roughness, sphere};

/// One pixel of floats as a texture, which says of itself that it is sRGB: floats are linear whatever it says.
fn float(scene: &mut Scene, pixel: [f32; 4]) -> TextureRef {
    let pixels = if pixel[3] == 1.0 {
        Pixels::Rgb32F(vec![[pixel[0], pixel[1], pixel[2]]])
    } else {
        Pixels::Rgba32F(vec![pixel])
    };
    let image = scene.images.len() as u32;
    scene.images.push(SceneImage { name: "float".into(), width: 1, height: 1, pixels });
    scene.textures.push(Texture::image(image, Sampler::default(), ColorSpace::Srgb));
    TextureRef::new(scene.textures.len() as u32 - 1)
}

/// A floor of a material under a white sky, seen from above.
fn from_above_white(material: impl FnOnce(&mut Scene) -> Material, depth: u32, spp: u32) -> Estimate {
    let mut scene = Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() };
    let material = material(&mut scene);
    let material = scene.add_material(material);
    scene.add_mesh("floor", ground(0.0, 50.0), material);
    scene.cameras.push(from_above(0.0, 0.0, 3.0, 0.01));
    estimate(&scene, &job(&scene, 16, 16, depth), spp)
}

#[test]
fn floats_are_neither_cut_off_nor_rounded_to_bytes() {
    let pixel = [8.0, 0.0078125, 300.0, 1.0];
    let e = from_above_white(
        |scene| Material { base_color_texture: Some(float(scene, pixel)), ..unlit([1.0; 3]) },
        1,
        4,
    );
    assert_mean("unlit", &e, [8.0, 0.0078125, 300.0], 1e-6);
    let shining = |scene: &mut Scene| Material {
        emission_texture: Some(float(scene, pixel)),
        emission_two_sided: true,
        ..emitter("lamp", [2.0, 2.0, 0.5])
    };
    let e = from_above_white(shining, 1, 4);
    assert_mean("emission", &e, [16.0, 0.015625, 150.0], 1e-6);
    // What is behind shines through three quarters of it.
    let blend = |scene: &mut Scene| Material {
        base_color_texture: Some(float(scene, [8.0, 4.0, 2.0, 0.25])),
        alpha_mode: AlphaMode::Blend,
        ..unlit([1.0; 3])
    };
    let e = from_above_white(blend, 1, 4096);
    assert_mean("blend", &e, [2.75, 1.75, 1.25], 2e-3);
    let hole = |scene: &mut Scene| {
        masked(Material { base_color_texture: Some(float(scene, [8.0, 4.0, 2.0, 0.25])), ..unlit([1.0; 3]) })
    };
    assert_mean("mask", &from_above_white(hole, 1, 4), [1.0; 3], 1e-6);
}

/// No surface reflects more than it gets: shares above 1 count as 1.
#[test]
fn shares_above_one_count_as_one() {
    let bright = [8.0, 1.5, 0.5, 1.0];
    let white = |scene: &mut Scene| Material {
        base_color_texture: Some(float(scene, bright)),
        ..lambert("white", [1.0; 3])
    };
    assert_mean("lambert", &from_above_white(white, 2, 64), [1.0, 1.0, 0.5], 1e-3);
    // A roughness of eight is one of 1, and a metal of eight times is all metal: the same furnace.
    let of = |pixel: [f32; 4]| {
        let metal = move |scene: &mut Scene| Material {
            metallic_roughness_texture: Some(float(scene, pixel)),
            ..metallic_roughness("metal", [0.9, 0.5, 0.2], 1.0, 1.0)
        };
        from_above_white(metal, 2, 256).mean_colour()
    };
    let (beyond, one) = (of([1.0, 8.0, 8.0, 1.0]), of([1.0; 4]));
    assert!(beyond.iter().zip(one).all(|(a, b)| (a - b).abs() < 1e-6), "{beyond:?} {one:?}");
}

/// A lamp whose texture says 8 lights as one of eight times the emission does.
#[test]
fn float_lamps_light_as_they_look() {
    let lit = |material: &dyn Fn(&mut Scene) -> Material| {
        let mut scene = Scene::default();
        add_floor(&mut scene, -2.0);
        let material = material(&mut scene);
        let material = scene.add_material(material);
        scene.add_shape("lamp", sphere([0.0; 3], 0.5), material, Affine3A::IDENTITY);
        scene.cameras.push(from_above(0.9, 0.0, -1.6, 0.01));
        estimate(&scene, &job(&scene, 16, 16, 2), 256).mean_colour()
    };
    let textured = lit(&|scene| Material {
        emission_texture: Some(float(scene, [8.0, 8.0, 8.0, 1.0])),
        ..emitter("lamp", [1.0; 3])
    });
    let plain = lit(&|_| emitter("lamp", [8.0; 3]));
    assert!((textured[0] / plain[0] - 1.0).abs() < 5e-3, "{textured:?} {plain:?}");
}

/// `KHR_materials_specular` scales what glass reflects, and what it does not reflect goes through.
#[test]
fn specular_factors_scale_what_glass_reflects() {
    let thin = |specular: f32, tint: f32| {
        move |_: &mut Scene| {
            let glass = Material { thin_walled: true, double_sided: true, ..dielectric("pane", 1.5, 0.0) };
            Material { specular, base_color: Vec3::splat(tint).extend(1.0), ..glass }
        }
    };
    // Two faces of R each: 2 R / (1 + R).
    for (specular, expected) in [(1.0, 0.08 / 1.04), (0.5, 0.04 / 1.02), (0.0, 0.0)] {
        let e = from_above_white(thin(specular, 0.0), 2, 4096).mean_colour();
        assert!(
            (e[0] - expected).abs() < 0.015 * expected + 1e-6,
            "specular {specular}: {e:?} for {expected}"
        );
        let white = from_above_white(thin(specular, 1.0), 3, 256);
        assert_mean(&format!("a white pane of specular {specular}"), &white, [1.0; 3], 5e-3);
    }
    // The same as a share of a metallic-roughness material, and with a colour.
    let mixed = |_: &mut Scene| Material {
        transmission: 1.0,
        thin_walled: true,
        specular: 0.5,
        ..metallic_roughness("mixed", [0.0; 3], 0.0, 0.0)
    };
    let e = from_above_white(mixed, 2, 256).mean_colour();
    assert!((e[1] - 0.04 / 1.02).abs() < 4e-4, "{e:?}");
    let colored = |scene: &mut Scene| {
        let mut material = mixed(scene);
        material.layers.specular_color = Vec3::new(1.0, 0.5, 0.0);
        material
    };
    let e = from_above_white(colored, 2, 256).mean_colour();
    assert!((e[0] - 0.04 / 1.02).abs() < 4e-4 && (e[1] - 0.02 / 1.01).abs() < 2e-4 && e[2] < 1e-6, "{e:?}");
}

/// Bodies of glass that reflect little or nothing outside are white in a white room, and bend light as others do.
#[test]
fn glass_bodies_keep_energy_whatever_they_reflect() {
    for specular in [0.0, 0.5, 1.0] {
        let mut scene = Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() };
        let glass = scene.add_material(Material { specular, ..dielectric("glass", 1.5, 0.0) });
        scene.add_shape("ball", sphere([0.0; 3], 1.0), glass, Affine3A::IDENTITY);
        scene.cameras.push(from_above(0.0, 0.0, 3.0, 1.6));
        let e = estimate(&scene, &job(&scene, 32, 32, 24), 64);
        assert_mean(&format!("a ball of specular {specular}"), &e, [1.0; 3], 0.01);
    }
}

/// A ball whose normal map is placed by a transform, as a sphere and as a mesh, where it stands or turned and mirrored.
#[test]
fn normal_maps_are_turned_with_their_coordinates() {
    let picture = |exact: bool, transform: UvTransform, place: Affine3A| {
        let mut scene = Scene::default();
        light(&mut scene, 0.1, Vec3::new(0.6, 0.5, 0.9));
        let bumps = TextureRef { transform, ..data(&mut scene, [8, 4], leaning) };
        let material = Material { normal_texture: Some(bumps), ..lambert("bumpy", [0.8; 3]) };
        let material = scene.add_material(material);
        let shape = if exact { sphere([0.0; 3], 1.0) } else { Shape::Triangles(mesh_sphere(1.0, 96, false)) };
        scene.add_shape("ball", shape, material, place);
        scene.cameras.push(camera([0.0, 0.0, 5.0], [0.0; 3], 30.0));
        estimate(&scene, &job(&scene, 24, 24, 2), 64)
    };
    let turned = Affine3A::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.4, -0.2));
    let mirrored = turned * Affine3A::from_scale(Vec3::new(1.0, 1.0, -1.0));
    let upright = UvTransform::default();
    for (rotation, scale) in [
        (0.0, Vec2::ONE),
        (0.0, Vec2::new(1.0, -1.0)),
        (1.1, Vec2::new(2.0, 1.0)),
        (-2.0, Vec2::new(-1.0, 0.5)),
    ] {
        let transform = UvTransform::new(Vec2::new(0.2, 0.1), rotation, scale);
        for place in [Affine3A::IDENTITY, mirrored] {
            let (exact, mesh) = (picture(true, transform, place), picture(false, transform, place));
            let difference = mean_difference(&exact, &mesh);
            assert!(difference < 0.02, "{transform:?}: {difference}");
        }
    }
    // The transform matters.
    let mirroring = UvTransform::new(Vec2::ZERO, 0.0, Vec2::new(1.0, -1.0));
    let here = Affine3A::IDENTITY;
    let difference = mean_difference(&picture(true, upright, here), &picture(true, mirroring, here));
    assert!(difference > 0.02, "{difference}");
}

fn mean_difference(a: &Estimate, b: &Estimate) -> f64 {
    let of = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f64>() / 3.0;
    a.mean.iter().zip(&b.mean).map(of).sum::<f64>() / a.mean.len() as f64
}

/// The inputs of the reports: what a lamp of 8 and a normal map look like through each loader.
#[test]
fn files_of_the_reports_are_right() {
    let Some(shared) = testkit::require_shared("files_of_the_reports_are_right") else { return };
    let wild = shared.join("wild");
    if !wild.is_dir() {
        println!("files_of_the_reports_are_right: skipped, {} is not there", wild.display());
        return;
    }
    let load = |name: &str| {
        let loaded = scene::load::load(&wild.join(name), &scene::LoadOptions::default());
        loaded.unwrap_or_else(|error| panic!("{error}")).scene
    };
    for name in ["b.toml", "u.toml", "k.gltf"] {
        let mut scene = load(&format!("float-emission/{name}"));
        scene.lights.clear();
        let e = estimate(&scene, &job(&scene, 8, 8, 1), 4).mean_colour();
        assert!(e[0] > 1.5, "float-emission/{name}: {e:?}");
    }
    for (name, expected) in [("factor0", 0.0), ("factor05", 0.039)] {
        let mut scene = load(&format!("specular-transmission/{name}.gltf"));
        scene.environment = Environment::Constant(Vec3::ONE);
        let mut camera = camera([0.0, 0.0, 4.0], [0.0; 3], 10.0);
        camera.projection = alhazen::Projection::Orthographic { height: 0.5 };
        scene.cameras = vec![camera];
        let e = estimate(&scene, &job(&scene, 16, 16, 2), 64).mean_colour();
        assert!((e[0] - expected).abs() < 5e-4, "specular-transmission/{name}: {e:?}");
    }
    // All four have one picture, three of them among other layers.
    let beauty = |name: &str| {
        let (options, mut report) = (scene::LoadOptions::default(), scene::LoadReport::default());
        let image =
            scene::load::environment::load(&wild.join("exr-layers").join(name), &options, &mut report);
        let image = image.unwrap_or_else(|error| panic!("{error}"));
        let notes: Vec<_> = report.notes.into_iter().map(|n| n.message).collect();
        (image.pixels.into_linear(), notes)
    };
    let (plain, _) = beauty("plain.exr");
    for name in ["normal.exr", "emit.exr", "blender.exr"] {
        let (found, notes) = beauty(name);
        println!("{name}: {:?} for {:?}, {notes:?}", found[0], plain[0]);
        assert!(found == plain, "exr-layers/{name}: {:?} for {:?}", found[0], plain[0]);
        assert!(notes.iter().any(|n| n.contains("is the picture; there are also")), "{name}: {notes:?}");
    }
    assert_eq!(load("specular-transmission/factor0.gltf").materials[0].model, Model::Dielectric);
}
