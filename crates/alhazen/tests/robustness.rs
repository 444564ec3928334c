//! Scenes that are empty, broken, huge, tiny, mirrored or crowded.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{DirectSettings, Environment, Integrator, Job, Light, LightKind, Scene, Shape};
use common::{assert_same_coarse, estimate, from_above, job, render, render_with};
use glam::{Affine3A, Mat3, Vec2, Vec3, Vec4};
use scene::{Instance, Material, TextureRef, TriangleMesh};
use testkit::scenes::{self, Build, camera, dielectric, emitter, ground, lambert};
use testkit::{Estimate, Random};

fn all_integrators() -> [Integrator; 3] {
    [common::path(6), Integrator::Direct(DirectSettings::default()), Integrator::Aov]
}

#[test]
fn nothing_at_all_is_black_and_a_sky_alone_is_the_sky() {
    for integrator in all_integrators() {
        let mut scene = Scene::default();
        let job = Job { integrator, ..job(&scene, 9, 7, 4) };
        assert_eq!(render(&scene, &job, 3).mean(), [0.0; 3]);
        scene.environment = Environment::Constant(Vec3::new(0.5, 1.0, 2.0));
        assert_eq!(render(&scene, &job, 3).mean(), [0.5, 1.0, 2.0]);
    }
}

#[test]
fn geometry_without_light_is_black() {
    let mut scene = scenes::cornell();
    scene.materials.iter_mut().for_each(|m| m.emission = Vec3::ZERO);
    for integrator in [common::path(6), Integrator::Direct(DirectSettings::default())] {
        let job = Job { integrator, ..job(&scene, 16, 16, 6) };
        assert_eq!(render(&scene, &job, 2).mean(), [0.0; 3]);
    }
}

#[test]
fn meshes_without_triangles_and_materials_that_are_missing() {
    let mut scene = scenes::cornell();
    let whole = render(&scene, &job(&scene, 24, 24, 4), 4);
    scene.add_mesh("empty", TriangleMesh::default(), 0);
    scene.add_shape("no spheres", Shape::Spheres(Vec::new()), 0, Affine3A::IDENTITY);
    scene.instances.push(Instance::new("of nothing", 12_345, Affine3A::IDENTITY));
    scene.instances.push(Instance::new("flat", 0, Affine3A::from_mat3(Mat3::ZERO)));
    scene.instances.push(Instance::new("nowhere", 0, Affine3A::from_translation(Vec3::NAN)));
    let crowded = render(&scene, &job(&scene, 24, 24, 4), 4);
    assert!(whole == crowded, "what is not there changes the picture");
    scene.meshes[0].parts[0].material = 999;
    let _ = render(&scene, &job(&scene, 24, 24, 4), 1);
}

/// Triangles without area, vertices that are no numbers or infinite: they are not there, and break nothing.
#[test]
fn degenerate_triangles_do_not_show() {
    let scene = scenes::cornell();
    let clean = estimate(&scene, &job(&scene, 48, 48, 5), 64);
    let mut dirty = scene;
    let mut random = Random::new(3);
    let mut mesh = TriangleMesh::default();
    let mut push = |corners: [Vec3; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.indices.push([first, first + 1, first + 2]);
    };
    for i in 0..400 {
        let mut point = || Vec3::from([(); 3].map(|()| 5.0 * random.uniform_f32()));
        let (a, b) = (point(), point());
        push(match i % 4 {
            0 => [a, a, a],
            1 => [a, b, a],
            2 => [a, (a + b) * 0.5, b],
            _ => [a, Vec3::NAN, b],
        });
    }
    mesh.indices.push([0, 1, 7_000_000]);
    let material = dirty.add_material(emitter("degenerate light", [100.0; 3]));
    dirty.add_mesh("degenerate", mesh, material);
    let (film, summary) = render_with(&dirty, &Job { seed: 1, ..job(&dirty, 48, 48, 5) }, 64, None);
    assert_eq!(summary.invalid_samples, 0, "degenerate triangles bring samples that are no numbers");
    // A needle whose middle is rounded has an area of its own, far below a pixel.
    assert_same_coarse("degenerate", &Estimate::from_film(&film), &clean);
}

#[test]
fn a_camera_inside_of_things() {
    let mut scene = scenes::cornell();
    let glass = scene.add_material(dielectric("glass", 1.5, 0.0));
    scene.add_shape("around", scenes::sphere([2.78, 2.73, -8.0], 0.5), glass, Affine3A::IDENTITY);
    let inside_glass = render(&scene, &job(&scene, 24, 24, 8), 32);
    assert!(inside_glass.mean().iter().all(|m| *m > 0.005), "{:?}", inside_glass.mean());
    // In a block: all that is seen is its dark inside.
    scene.instances.pop();
    scene.cameras = vec![camera([1.8, 0.8, 1.7], [2.0, 0.9, 9.0], 60.0)];
    assert_eq!(
        render(&scene, &job(&scene, 24, 24, 8), 8).mean(),
        [0.0; 3],
        "light leaks into a closed block"
    );
    // On a surface, looking along it and away from it.
    scene.cameras = vec![camera([2.78, 0.0, 0.1], [2.78, 0.0, 5.0], 60.0)];
    let _ = render(&scene, &job(&scene, 24, 24, 8), 8);
}

/// The scene as a whole `factor` times as large. Radiance does not know the size.
fn scaled(mut scene: Scene, factor: f32) -> Scene {
    for mesh in &mut scene.meshes {
        for part in &mut mesh.parts {
            match &mut part.shape {
                Shape::Triangles(t) => t.positions.iter_mut().for_each(|p| *p *= factor),
                Shape::Spheres(s) => s.iter_mut().for_each(|s| {
                    s.center *= factor;
                    s.radius *= factor;
                }),
            }
        }
    }
    for instance in &mut scene.instances {
        instance.transform.translation *= factor;
    }
    for camera in &mut scene.cameras {
        camera.eye *= factor;
        camera.target *= factor;
    }
    scene
}

/// Offsets of ray origins, epsilons and thresholds: none may have a size of its own.
fn assert_size_does_not_matter(factor: f32) {
    for scene in [scenes::cornell(), scenes::glass()] {
        let picture = |scene: &Scene, seed: u32| estimate(scene, &Job { seed, ..job(scene, 48, 48, 6) }, 128);
        let (one, other) = (picture(&scene, 1), picture(&scaled(scene.clone(), factor), 2));
        assert_same_coarse(&format!("{}-times-{factor:e}", scene.name), &other, &one);
    }
}

#[test]
fn a_huge_scene_looks_like_a_small_one() {
    assert_size_does_not_matter(1e8);
}

#[test]
fn a_scene_of_centimetres_looks_like_one_of_metres() {
    assert_size_does_not_matter(1e-2);
}

#[test]
fn a_tiny_scene_looks_like_a_large_one() {
    assert_size_does_not_matter(1e-6);
}

/// Half of the scene's spheres by instances that scale their mesh by a million: object space has no size either.
#[test]
fn instances_that_scale_much_look_like_their_mesh() {
    let scene = scenes::cornell();
    let mut other = scaled(scene.clone(), 1e-4);
    other.cameras = scene.cameras.clone();
    for instance in &mut other.instances {
        instance.transform = Affine3A::from_scale(Vec3::splat(1e4));
        instance.dynamic = true;
    }
    let one = estimate(&scene, &job(&scene, 48, 48, 6), 64);
    let two = estimate(&other, &Job { seed: 1, ..job(&other, 48, 48, 6) }, 64);
    assert_same_coarse("scaling instances", &two, &one);
}

/// Ten thousand lights of very different power add up to their sum.
#[test]
fn ten_thousand_lights_add_up() {
    let mut scene = Scene::default();
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", ground(0.0, 10.0), floor);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.01));
    let mut random = Random::new(1);
    let mut irradiance = 0.0;
    for i in 0..10_000 {
        let position = Vec3::new(random.normal() as f32, 1.0 + random.uniform_f32(), random.normal() as f32);
        // One in a hundred has most of the power.
        let strength = if i % 100 == 0 { 1.0 } else { 0.003 };
        irradiance += f64::from(strength * position.y / position.length().powi(3));
        let intensity = Vec3::splat(strength);
        scene.lights.push(Light::new("", LightKind::Point { position, intensity }));
    }
    let e = estimate(&scene, &job(&scene, 32, 32, 2), 1024);
    common::assert_mean("10,000 lights", &e, [0.5 * irradiance / std::f64::consts::PI; 3], 2e-3);
}

/// As above with emissive triangles, which a faster kernel samples.
#[test]
fn ten_thousand_emissive_triangles_add_up() {
    let mut scene = Scene::default();
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", ground(0.0, 10.0), floor);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.01));
    let materials = [0.3, 1000.0].map(|e| scene.add_material(emitter("light", [e; 3])));
    let mut random = Random::new(1);
    let mut irradiance = 0.0;
    let mut meshes = [TriangleMesh::default(), TriangleMesh::default()];
    let (side, area) = (0.01f32, 0.5e-4);
    for i in 0..10_000 {
        let bright = usize::from(i % 1000 == 0);
        let at = Vec3::new(2.0 + random.uniform_f32(), 1.5, random.normal() as f32);
        let mesh = &mut meshes[bright];
        let first = mesh.positions.len() as u32;
        // Facing down.
        mesh.positions.extend([at, at + Vec3::X * side, at + Vec3::Z * side]);
        mesh.indices.push([first, first + 1, first + 2]);
        let middle = at + (Vec3::X + Vec3::Z) * (side / 3.0);
        let cos = f64::from(middle.y / middle.length());
        irradiance += [0.3, 1000.0][bright] * area * cos * cos / f64::from(middle.length_squared());
    }
    for (mesh, material) in meshes.into_iter().zip(materials) {
        scene.add_mesh("lights", mesh, material);
    }
    let e = estimate(&scene, &job(&scene, 32, 32, 2), 1024);
    common::assert_mean("10,000 triangles", &e, [0.5 * irradiance / std::f64::consts::PI; 3], 4e-3);
}

/// A floor whose normals lean, by a normal map, towards its local +u and a little to +v.
fn leaning(scene: &mut Scene) -> Material {
    let pixels = alhazen::Pixels::Rgba8(vec![[210, 160, 220, 255]; 4]);
    scene.images.push(alhazen::SceneImage { name: "normals".into(), width: 2, height: 2, pixels });
    let (sampler, color_space) = (scene::Sampler::default(), scene::ColorSpace::Linear);
    scene.textures.push(scene::Texture::image(0, sampler, color_space));
    Material { normal_texture: Some(TextureRef::new(0)), ..lambert("leaning", [0.8; 3]) }
}

/// A mirrored instance is what one gets by mirroring the vertices: shape, sides, normal map, emission.
#[test]
fn mirrored_instances_are_mirrored_meshes() {
    let mirrored_floor = |baked: bool, instanced: bool| {
        let mut scene = Scene::default();
        let material = leaning(&mut scene);
        let material = scene.add_material(material);
        let mut mesh = ground(0.0, 1.0);
        mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, -1.0); 4];
        let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        if baked {
            mesh.positions.iter_mut().for_each(|p| p.x = -p.x);
            mesh.tangents.iter_mut().for_each(|t| *t = Vec4::new(-t.x, t.y, t.z, -t.w));
            mesh.indices.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let index = scene.add_mesh("floor", mesh, material);
        if !baked {
            scene.instances[0].transform = mirror;
        }
        if instanced {
            let mut far = scene.instances[0].clone();
            far.transform.translation.x += 100.0;
            scene.instances.push(Instance { mesh: index, ..far });
        }
        let position = Vec3::new(1.5, 1.0, 0.7);
        scene.lights.push(Light::new("", LightKind::Point { position, intensity: Vec3::ONE }));
        scene.cameras.push(from_above(0.0, 0.0, 3.0, 1.5));
        estimate(&scene, &job(&scene, 24, 24, 2), 64)
    };
    let expected = mirrored_floor(true, false);
    assert!(expected.mean_colour()[0] > 1e-3, "{:?}", expected.mean_colour());
    for (what, baked, instanced) in
        [("baked and instanced", true, true), ("static", false, false), ("instanced", false, true)]
    {
        assert_same_coarse(&format!("mirrored floor, {what}"), &mirrored_floor(baked, instanced), &expected);
    }
}

#[test]
fn mirrored_lights_shine_to_their_front() {
    let mut scene = Scene::default();
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", ground(0.0, 3.0), floor);
    let light = scene.add_material(emitter("light", [1.0; 3]));
    let lamp = scenes::flipped(ground(0.0, 0.3));
    let lamp = scene.add_mesh("lamp", TriangleMesh { normals: Vec::new(), ..lamp }, light);
    scene.instances[1].transform = Affine3A::from_translation(Vec3::Y);
    scene.cameras.push(camera([0.0, 0.5, 2.5], [0.0, 0.0, 0.0], 50.0));
    let expected = estimate(&scene, &job(&scene, 24, 24, 3), 128);
    assert!(expected.mean_colour()[0] > 0.001);
    let mirror =
        Affine3A::from_scale_rotation_translation(Vec3::new(-1.0, 1.0, 1.0), glam::Quat::IDENTITY, Vec3::Y);
    for copies in 0..2 {
        let mut mirrored = scene.clone();
        mirrored.instances[1].transform = mirror;
        if copies > 0 {
            let far = Affine3A::from_translation(Vec3::new(0.0, 1000.0, 0.0));
            mirrored.instances.push(Instance::new("far", lamp, far));
        }
        let e = estimate(&mirrored, &Job { seed: 1, ..job(&scene, 24, 24, 3) }, 128);
        assert_same_coarse(&format!("mirrored lamp, {copies} copies"), &e, &expected);
    }
}

/// A mesh that stands in the world fifteen times is the same picture as fifteen meshes.
#[test]
fn instances_look_like_copies() {
    let scene = scenes::spheres();
    let mut shared = scene.clone();
    for instance in &mut shared.instances[1..15] {
        let own = shared.meshes[instance.mesh as usize].parts[0].material;
        instance.materials = Some(vec![own]);
        instance.mesh = 0;
    }
    let one = estimate(&scene, &job(&scene, 64, 36, 6), 64);
    let two = estimate(&shared, &Job { seed: 1, ..job(&scene, 64, 36, 6) }, 64);
    assert_same_coarse("instances and copies", &two, &one);
}

/// Texture coordinates far away, no numbers or missing do not crash.
#[test]
fn wild_texture_coordinates() {
    for uv in [Vec2::splat(1e30), Vec2::NAN, Vec2::splat(-1e9), Vec2::INFINITY] {
        let mut scene = Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() };
        let material = leaning(&mut scene);
        let material = Material { base_color_texture: Some(TextureRef::new(0)), ..material };
        let material = scene.add_material(material);
        let mesh = TriangleMesh { uv0: vec![uv; 4], ..ground(0.0, 1.0) };
        scene.add_mesh("floor", mesh, material);
        scene.cameras.push(from_above(0.0, 0.0, 1.0, 1.0));
        let (film, _) = render_with(&scene, &job(&scene, 8, 8, 3), 4, None);
        assert!(film.to_image().data().iter().all(|v| v.is_finite()), "{uv}");
    }
}
