//! Settings that change the noise or the method, but not the expected picture.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{
    Control, DirectSettings, Environment, Integrator, Job, Light, LightKind, Limits, Mis, PathSettings,
    Renderer, SamplerKind, Scene,
};
use common::{SHINES, assert_same, assert_same_coarse, estimate, job, path};
use glam::{Affine3A, Vec3, Vec4};
use scene::tables::SceneTables;
use scene::{Material, Model, Shape};
use testkit::scenes::{self, Build, camera, cuboid, emitter, lambert, metallic_roughness, quads, sphere};
use testkit::{Comparison, WHOLE_IMAGE};

const SIZE: u32 = 48;

/// Roulette, splitting, sampler, seed and range of samples: the picture of [`scenes::cornell`] and of `glass` stays.
#[test]
fn what_only_changes_noise_does_not_change_the_picture() {
    for scene in [scenes::cornell(), scenes::glass()] {
        let base = job(&scene, SIZE, SIZE, 12);
        let expected = estimate(&scene, &base, 256);
        let path = |roulette_start, roulette_min_survival, splitting| {
            Integrator::Path(PathSettings {
                max_depth: 12,
                roulette_start,
                roulette_min_survival,
                splitting,
                ..PathSettings::default()
            })
        };
        let variants = [
            ("roulette", Job { seed: 1, integrator: path(2, 0.05, 1), ..base.clone() }),
            ("hard-roulette", Job { seed: 2, integrator: path(1, 0.001, 1), ..base.clone() }),
            ("splitting", Job { seed: 3, integrator: path(u32::MAX, 0.05, 4), ..base.clone() }),
            ("sobol", Job { seed: 4, sampler: SamplerKind::Sobol, ..base.clone() }),
            ("seed", Job { seed: 5, ..base.clone() }),
        ];
        for (what, variant) in variants {
            assert_same_coarse(
                &format!("{}-{what}", scene.name),
                &estimate(&scene, &variant, 128),
                &expected,
            );
        }
    }
}

/// Light samples, BSDF samples and both heuristics find the same light, of a lamp and of a sky.
#[test]
fn how_light_is_found_does_not_change_the_picture() {
    let mut sky = scenes::spheres();
    sky.environment = Environment::Constant(Vec3::new(0.5, 0.7, 1.0));
    for scene in [scenes::cornell(), sky] {
        let base = job(&scene, SIZE, SIZE, 6);
        let expected = estimate(&scene, &base, 256);
        for (seed, mis) in (1..).zip(Mis::ALL) {
            let settings = PathSettings { mis, max_depth: 6, ..PathSettings::default() };
            let job = Job { seed, integrator: Integrator::Path(settings), ..base.clone() };
            assert_same_coarse(&format!("{}-{mis}", scene.name), &estimate(&scene, &job, 256), &expected);
        }
    }
}

/// Last segments that become shadow rays to the sky, or are left out, find what they would if all asked what they hit; and a scene
/// that is said to have no lamps loses light.
#[test]
fn last_segments_lose_no_light() {
    let mut sky = scenes::spheres();
    sky.environment = Environment::Constant(Vec3::new(0.5, 0.7, 1.0));
    for scene in [scenes::cornell(), scenes::glass(), scenes::assortment(), sky] {
        let mut renderer = Renderer::cpu(None).expect("a renderer");
        let [made, expected, dark] = SHINES.map(|shines| {
            renderer.load_tables(shines(SceneTables::build(&scene))).expect("load");
            let limits = Limits { spp: 16, ..Limits::default() };
            let rays =
                renderer.render(&job(&scene, SIZE, SIZE, 3), &limits, &Control::new()).expect("render").rays;
            let film = renderer.film().expect("film").expect("rendered");
            (film.pixels().iter().flat_map(|p| p.mean()).collect::<Vec<f64>>(), rays)
        });
        let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-5 * (a + b);
        assert!(made.0.iter().zip(&expected.0).all(close), "{}", scene.name);
        if scene.environment == Environment::Black {
            assert!(made.1 < expected.1, "{}: {} rays of {}", scene.name, made.1, expected.1);
            assert!(!dark.0.iter().zip(&expected.0).all(close), "{}: light that is not there", scene.name);
        }
    }
}

/// The CPU scatters glossy and smooth vertices of one colour sixteen at a time, others one by one. White vertex colours change nothing but
/// that, so both make the same samples; only rounding may differ, and then a path now and then.
#[test]
fn vertices_in_lanes_do_what_single_ones_do() {
    let mut sky = scenes::spheres();
    sky.lights.push(Light::new(
        "sun",
        LightKind::Point { position: Vec3::new(3.0, 6.0, 4.0), intensity: Vec3::splat(40.0) },
    ));
    let mut by_place = scenes::cornell();
    for i in 0..12 {
        let position = Vec3::new(0.4 * i as f32 + 0.5, 3.0, 2.0);
        let lamp = LightKind::Point { position, intensity: Vec3::splat(0.2) };
        by_place.lights.push(Light::new(format!("lamp {i}"), lamp));
    }
    for scene in [scenes::cornell(), scenes::glass(), scenes::spheres(), sky, by_place] {
        let mut coloured = scene.clone();
        for shape in coloured.meshes.iter_mut().flat_map(|mesh| &mut mesh.parts).map(|part| &mut part.shape) {
            if let Shape::Triangles(triangles) = shape {
                triangles.colors = vec![Vec4::ONE; triangles.positions.len()];
            }
        }
        let [in_lanes, one_by_one] = [&scene, &coloured].map(|scene| {
            let film = common::render(scene, &job(scene, SIZE, SIZE, 6), 16);
            film.pixels().iter().flat_map(|p| p.mean()).collect::<Vec<f64>>()
        });
        let pairs = || in_lanes.iter().zip(&one_by_one);
        let others = pairs().filter(|(a, b)| (*a - *b).abs() > 1e-5 * (*a + *b)).count();
        assert!(others * 1000 <= in_lanes.len(), "{}: {others} of {} differ", scene.name, in_lanes.len());
        let [a, b] = [&in_lanes, &one_by_one].map(|mean| mean.iter().sum::<f64>());
        assert!((a - b).abs() < 1e-5 * a, "{}: {a} in lanes, {b} one by one", scene.name);
    }
}

/// A floor with diffuse boxes under each kind of light: `direct` and two segments of `path` are the same.
#[test]
fn direct_is_path_with_two_segments_for_diffuse_scenes() {
    let mut scene = scenes::cornell();
    let ball = scene.add_material(lambert("ball", [0.7; 3]));
    scene.add_shape("ball", sphere([1.8, 2.2, 1.6], 0.5), ball, Affine3A::IDENTITY);
    let lamp = scene.add_material(emitter("lamp", [5.0, 6.0, 7.0]));
    scene.add_shape("lamp", sphere([4.6, 1.0, 1.0], 0.3), lamp, Affine3A::IDENTITY);
    let down = Vec3::new(0.3, -0.5, 0.8).normalize();
    for kind in [
        LightKind::Point { position: Vec3::new(1.0, 4.0, 1.0), intensity: Vec3::splat(3.0) },
        LightKind::Spot {
            position: Vec3::new(4.0, 5.0, 0.5),
            direction: Vec3::new(0.0, -1.0, 0.3).normalize(),
            intensity: Vec3::new(8.0, 4.0, 2.0),
            inner_angle: 0.3,
            outer_angle: 0.5,
        },
        LightKind::Directional { direction: down, irradiance: Vec3::splat(0.5), angular_diameter: 0.1 },
    ] {
        scene.lights.push(Light::new("", kind));
    }
    let settings = DirectSettings { shadow_samples: 2, ..DirectSettings::default() };
    let direct = Job { seed: 1, integrator: Integrator::Direct(settings), ..job(&scene, SIZE, SIZE, 2) };
    let (a, b) = (estimate(&scene, &direct, 128), estimate(&scene, &job(&scene, SIZE, SIZE, 2), 512));
    assert_same("direct-and-path", &a, &b);
}

/// `direct` asks every light, `path` chooses one, by where the lights are if they are many: the picture is the same. Once with
/// triangles and rectangles alone, which are sampled many at a time, once with lights of all kinds and a sun.
#[test]
fn lights_chosen_by_place_add_up_to_all_lights() {
    for all_kinds in [false, true] {
        let mut scene = scenes::cornell();
        // Every third one is a parallelogram, and so two lights.
        let pane = |[x, y, z]: [f64; 3], skew: f64| {
            [[x, y, z], [x, y, z + 0.2], [x + 0.2, y + 0.1, z + 0.2 + skew], [x + 0.2, y + 0.1, z + skew]]
        };
        for i in 0..24 {
            let t = f64::from(i);
            let at = [2.5 + 2.0 * (1.9 * t).sin(), 2.5 + 2.0 * (0.7 * t).cos(), 2.5 + 2.0 * (1.3 * t).sin()];
            let emission = [2.0 + (t as f32).sin(), 2.0, 1.0 + (i % 3) as f32];
            let both = i % 2 == 0;
            let material =
                Material { double_sided: both, emission_two_sided: both, ..emitter("pane", emission) };
            let material = scene.add_material(material);
            scene.add_mesh("pane", quads(&[pane(at, if i % 3 == 0 { 0.05 } else { 0.0 })]), material);
            let position = Vec3::new(at[2] as f32, at[0] as f32, at[1] as f32);
            let kind = match i % 3 {
                _ if !all_kinds => continue,
                0 => LightKind::Point { position, intensity: Vec3::splat(0.4) },
                1 => LightKind::Spot {
                    position,
                    direction: Vec3::new((t as f32).cos(), -1.0, (t as f32).sin()).normalize(),
                    intensity: Vec3::new(2.0, 1.0, 0.5),
                    inner_angle: 0.3,
                    outer_angle: 0.6,
                },
                _ => {
                    let material = scene.add_material(emitter("ball", [3.0, 6.0, 5.0]));
                    scene.add_shape("ball", sphere(position.to_array(), 0.07), material, Affine3A::IDENTITY);
                    continue;
                }
            };
            scene.lights.push(Light::new("", kind));
        }
        if all_kinds {
            let direction = Vec3::new(0.3, -0.5, 0.8).normalize();
            let kind =
                LightKind::Directional { direction, irradiance: Vec3::splat(0.5), angular_diameter: 0.0 };
            scene.lights.push(Light::new("", kind));
        }
        assert!(!SceneTables::build(&scene).light_tree.is_empty());
        let direct = Integrator::Direct(DirectSettings { shadow_samples: 1, ..DirectSettings::default() });
        let all = Job { seed: 1, integrator: direct, ..job(&scene, SIZE, SIZE, 2) };
        let (all, chosen) = (estimate(&scene, &all, 64), estimate(&scene, &job(&scene, SIZE, SIZE, 2), 1024));
        assert_same(&format!("many-lights-{all_kinds}"), &all, &chosen);
    }
}

/// A glossy and a diffuse floor, lit by what `light` adds; seen at a low angle.
fn lit_floor(roughness: f32, light: impl Fn(&mut Scene)) -> testkit::Estimate {
    let scene = lit_floor_scene(roughness, light);
    estimate(&scene, &job(&scene, SIZE, SIZE, 3), 512)
}

fn lit_floor_scene(roughness: f32, light: impl Fn(&mut Scene)) -> Scene {
    let mut scene = Scene::default();
    let floor = scene.add_material(metallic_roughness("floor", [0.8; 3], 0.5, roughness));
    scene.add_mesh("floor", scenes::ground(0.0, 4.0), floor);
    light(&mut scene);
    scene.cameras.push(camera([0.0, 1.2, 3.5], [0.0, 0.3, 0.0], 45.0));
    scene
}

/// Light that is sampled and light that is only met by chance are the same light: multiple importance sampling weighs
/// them to one. Unlit surfaces show their colour like light, but are never sampled.
#[test]
fn sampled_light_is_light_met_by_chance() {
    for roughness in [0.1, 0.3, 0.8] {
        for half in [0.1, 0.8] {
            let shape = || cuboid([-half, 0.5, -0.5], [half, 0.5 + 2.0 * half, -0.5 + half]);
            let sampled = lit_floor(roughness, |scene| {
                let material = scene.add_material(emitter("light", [1.0, 0.5, 0.8]));
                scene.add_mesh("light", shape(), material);
            });
            let chance = lit_floor(roughness, |scene| {
                let material = Material { model: Model::Unlit, ..lambert("unlit", [1.0, 0.5, 0.8]) };
                let material = scene.add_material(material);
                scene.add_mesh("light", shape(), material);
            });
            let what = format!("mis-box-{half}-roughness-{roughness}");
            // By chance, a pixel of a diffuse floor finds the small light in one of a hundred samples.
            assert_same_coarse(&what, &sampled, &chance);
        }
    }
}

/// A rectangle is one light, by solid angle where it is near; its halves, each a mesh of its own, are two. On floors from mirrors
/// to dust, with the lamp near and far, upright and lying, among lights of other kinds, in `path` and `direct`.
#[test]
fn a_rectangle_is_what_its_halves_are() {
    let lamps: [[[f64; 3]; 4]; 3] = [
        [[-0.8, 0.25, -0.5], [0.8, 0.25, -0.5], [0.8, 0.25, 0.5], [-0.8, 0.25, 0.5]],
        [[-0.5, 0.02, -0.6], [-0.5, 1.0, -0.6], [0.9, 1.0, -0.6], [0.9, 0.02, -0.6]],
        [[-0.1, 2.5, -0.1], [0.1, 2.5, -0.1], [0.1, 2.5, 0.1], [-0.1, 2.5, 0.1]],
    ];
    for (i, lamp) in lamps.into_iter().enumerate() {
        for (roughness, among_others) in [(0.1, false), (0.6, false), (0.6, true)] {
            let scene = |halves: bool| {
                let mut scene = lit_floor_scene(roughness, |scene| {
                    let light = Material {
                        double_sided: true,
                        emission_two_sided: true,
                        ..emitter("lamp", [1.0, 2.0, 0.5])
                    };
                    let light = scene.add_material(light);
                    let whole = quads(&[lamp]);
                    for triangle in whole.indices.chunks(if halves { 1 } else { 2 }) {
                        let mesh = scene::TriangleMesh { indices: triangle.to_vec(), ..whole.clone() };
                        scene.add_mesh("lamp", mesh, light);
                    }
                });
                if among_others {
                    let kind = LightKind::Point { position: Vec3::new(1.0, 1.0, 1.0), intensity: Vec3::ONE };
                    scene.lights.push(Light::new("", kind));
                }
                scene
            };
            let (whole, halves) = (scene(false), scene(true));
            let count = |scene: &Scene| SceneTables::build(scene).lights.len();
            assert_eq!((count(&whole) + 1, count(&halves)), (count(&halves), 2 + usize::from(among_others)));
            let what = format!("rectangle-{i}-roughness-{roughness}-{among_others}");
            let path = |scene: &Scene, seed| estimate(scene, &Job { seed, ..job(scene, SIZE, SIZE, 3) }, 512);
            assert_same(&what, &path(&whole, 0), &path(&halves, 1));
            let settings = DirectSettings { shadow_samples: 2, ..DirectSettings::default() };
            let direct = |scene: &Scene, seed| {
                let integrator = Integrator::Direct(settings);
                estimate(scene, &Job { seed, integrator, ..job(scene, SIZE, SIZE, 2) }, 128)
            };
            assert_same_coarse(&format!("{what}-direct"), &direct(&whole, 0), &direct(&halves, 1));
        }
    }
}

/// Spheres are sampled by solid angle; one that is a hair no sphere any more is not sampled at all.
#[test]
fn a_sampled_sphere_is_an_ellipsoid_met_by_chance() {
    for roughness in [0.1, 0.5] {
        let ball = |stretch: f32| {
            lit_floor(roughness, |scene| {
                let light = scene.add_material(emitter("light", [2.0, 1.0, 1.5]));
                let scale = Vec3::new(stretch, 1.0, 1.0);
                let place = Affine3A::from_scale_rotation_translation(scale, glam::Quat::IDENTITY, Vec3::Y);
                scene.add_shape("light", sphere([0.0; 3], 0.4), light, place);
            })
        };
        assert_same_coarse(&format!("mis-sphere-roughness-{roughness}"), &ball(1.0), &ball(1.0005));
    }
}

/// One light in sixty-four pieces is the same light, as is one with a thousand dim ones far away.
#[test]
fn pieces_of_a_light_add_up_to_it() {
    let tile = |x: f64, z: f64, s: f64| [[x, 1.5, z], [x + s, 1.5, z], [x + s, 1.5, z + s], [x, 1.5, z + s]];
    let whole = |scene: &mut Scene| {
        let light = scene.add_material(emitter("light", [1.0; 3]));
        scene.add_mesh("light", quads(&[tile(-0.8, -0.8, 1.6)]), light);
    };
    for roughness in [0.15, 0.6] {
        let one = lit_floor(roughness, whole);
        let pieces = lit_floor(roughness, |scene| {
            let light = scene.add_material(emitter("light", [1.0; 3]));
            for i in 0..64 {
                let (x, z) = (f64::from(i % 8) * 0.2 - 0.8, f64::from(i / 8) * 0.2 - 0.8);
                scene.add_mesh("light", quads(&[tile(x, z, 0.2)]), light);
            }
        });
        assert_same_coarse(&format!("light-in-pieces-{roughness}"), &pieces, &one);
        let crowd = lit_floor(roughness, |scene| {
            whole(scene);
            for i in 0..1000 {
                // Under the floor.
                let position = Vec3::new(0.0, -5.0 - i as f32, 0.0);
                let kind = LightKind::Point { position, intensity: Vec3::splat(3e-4) };
                scene.lights.push(Light::new("", kind));
            }
        });
        assert_same_coarse(&format!("light-among-many-{roughness}"), &crowd, &one);
    }
}

/// An environment image of one colour is sampled, a constant environment is met by chance.
#[test]
fn an_image_of_one_colour_is_a_constant_environment() {
    for (width, height) in [(1, 1), (8, 4), (512, 256)] {
        let mut scene = scenes::spheres();
        let expected = estimate(&scene, &job(&scene, 64, 36, 6), 64);
        let pixels = alhazen::Pixels::Rgb32F(vec![[0.5; 3]; (width * height) as usize]);
        scene.images.push(alhazen::SceneImage { name: "grey".into(), width, height, pixels });
        scene.environment = Environment::Image { image: 0, rotation: 1.0, intensity: 2.0 };
        let sampled = estimate(&scene, &Job { seed: 1, ..job(&scene, 64, 36, 6) }, 64);
        assert_same_coarse(&format!("constant-image-{width}"), &sampled, &expected);
    }
}

/// The harness must notice a picture that is 2 % off.
#[test]
#[should_panic(expected = "the expected images differ")]
fn a_light_that_is_brighter_is_noticed() {
    let mut scene = scenes::cornell();
    let expected = estimate(&scene, &job(&scene, 96, 96, 4), 512);
    scene.materials.iter_mut().for_each(|m| m.emission *= 1.02);
    let brighter = estimate(&scene, &Job { seed: 1, integrator: path(4), ..job(&scene, 96, 96, 4) }, 512);
    Comparison { pictures: false, ..Comparison::new("brighter", WHOLE_IMAGE) }.assert(&brighter, &expected);
}
