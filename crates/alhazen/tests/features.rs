//! What guides denoisers: the first surface that is neither mirror nor clear glass, as it is seen in those.

mod common;

use alhazen::{Aov, Film, Integrator, Job, PathSettings, Renderer, Scene};
use common::on_gpus::render as render_on;
use common::{from_above, gpu_renderers, job, path, render};
use film::AovData;
use glam::{Affine3A, Vec3};
use scene::{Checkerboard, Environment, Material};
use testkit::scenes::{self, Build, cuboid, dielectric, flipped, ground, lambert, metallic_roughness};

const SIZE: u32 = 32;
const LAYERS: [Aov; 4] = [Aov::DenoisingAlbedo, Aov::DenoisingNormal, Aov::Albedo, Aov::Normal];
const FLOOR: [Vec3; 2] = [Vec3::new(0.8, 0.1, 0.1), Vec3::new(0.1, 0.1, 0.6)];
const CEILING: [Vec3; 2] = [Vec3::new(0.1, 0.7, 0.1), Vec3::new(0.6, 0.6, 0.6)];
const TINT: f32 = 0.9;

/// A chequered floor and a chequered ceiling. Between them, on the left, a pane of glass, if it is wanted, and on the
/// right a mirror, of which the half that is farther up in the picture is a little rough.
fn checkers(with_pane: bool) -> Scene {
    let mut scene = Scene { name: "checkers".into(), ..Scene::default() };
    scene.environment = Environment::Constant(Vec3::ONE);
    let chequered = |name, colors| Material {
        checkerboard: Some(Checkerboard { colors, size: 0.5, fade: None }),
        ..lambert(name, [1.0; 3])
    };
    let floor = scene.add_material(chequered("floor", FLOOR));
    let ceiling = scene.add_material(chequered("ceiling", CEILING));
    scene.add_mesh("floor", ground(0.0, 4.0), floor);
    scene.add_mesh("ceiling", flipped(ground(3.0, 4.0)), ceiling);
    if with_pane {
        let glass = scene.add_material(dielectric("glass", 1.5, 0.0));
        scene.add_mesh("pane", cuboid([-1.0, 0.5, -1.0], [0.0, 0.52, 1.0]), glass);
        for (name, roughness, z) in [("mirror", 0.0, 0.5), ("rough mirror", 0.05, -0.5)] {
            let material = scene.add_material(metallic_roughness(name, [TINT; 3], 1.0, roughness));
            let place = Affine3A::from_translation(Vec3::new(0.5, 0.5, z));
            scene.add_shape(name, scene::Shape::Triangles(ground(0.0, 0.5)), material, place);
        }
    }
    scene.cameras.push(from_above(0.0, 0.0, 1.0, 2.0));
    scene
}

fn layer(film: &Film, aov: Aov) -> Vec<Vec3> {
    let Some(AovData::Float(image)) = film.aov(aov) else { panic!("{aov} was not asked for") };
    image.to_rgb().data().chunks_exact(3).map(Vec3::from_slice).collect()
}

fn layers_of(scene: &Scene) -> Job {
    Job { aovs: LAYERS.to_vec(), ..job(scene, SIZE, SIZE, 6) }
}

#[test]
fn features_are_those_behind_glass_and_in_mirrors() {
    let (bare, covered) = (checkers(false), checkers(true));
    let floor = layer(&render(&bare, &layers_of(&bare), 4), Aov::DenoisingAlbedo);
    let film = render(&covered, &layers_of(&covered), 256);
    let [albedo, normal, first_albedo, first_normal] = LAYERS.map(|aov| layer(&film, aov));
    let [mut in_pane, mut in_mirror] = [[0; 2]; 2];
    for i in 0..floor.len() {
        // Squares are eight pixels wide. At their edges pixels show two of them.
        let (x, y) = (i as u32 % SIZE, i as u32 / SIZE);
        if [x, y].iter().any(|p| [0, 7].contains(&(p % 8))) {
            continue;
        }
        assert!(first_normal[i].distance(Vec3::Y) < 1e-5, "the layer of first hits: {}", first_normal[i]);
        let is_near = |colors: [Vec3; 2], factor: f32, most: f32| {
            (0..2).find(|&k| (albedo[i] - factor * colors[k]).abs().max_element() < most)
        };
        if x < SIZE / 2 {
            // A pane lets 92 % through and reflects 8 %, of which there are 256 samples.
            let (through, most) = (0.92, 0.12);
            // Where a pixel's footprint touches another square, colours are mixed.
            let Some(k) = (0..2).find(|&k| floor[i].distance(FLOOR[k]) < 0.03) else { continue };
            assert_eq!(first_albedo[i], Vec3::ONE, "glass is clear");
            assert_eq!(is_near(FLOOR, through, most), Some(k), "({x}, {y}): {}, {}", albedo[i], floor[i]);
            // The mean of 256 signs: four and a half standard deviations.
            assert!((normal[i].y - 0.84).abs() < 0.15, "({x}, {y}): {}", normal[i]);
            in_pane[k] += 1;
        } else {
            // Of the rough half's samples a few go below the surface, and end there.
            assert!(normal[i].distance(Vec3::NEG_Y) < 0.02, "({x}, {y}): {}", normal[i]);
            // Blurred by the rough half over a tenth of a square.
            if let Some(k) = is_near(CEILING, TINT, 0.03) {
                in_mirror[k] += 1;
            }
        }
    }
    assert!(in_pane.iter().all(|&n| n > 60), "{in_pane:?}");
    assert!(in_mirror.iter().all(|&n| n > 50), "{in_mirror:?}");
}

/// What is neither mirror nor glass guides denoisers as it is; nor does what is sought change the picture.
#[test]
fn other_surfaces_are_first_hits_and_pictures_stay() {
    let mut scene = scenes::cornell();
    let shiny = scene.add_material(metallic_roughness("shiny", [0.9, 0.6, 0.3], 0.0, 0.05));
    scene.add_shape("ball", scenes::sphere([3.0, 1.0, 2.0], 0.8), shiny, Affine3A::IDENTITY);
    let film = render(&scene, &layers_of(&scene), 4);
    assert_eq!(layer(&film, Aov::DenoisingAlbedo), layer(&film, Aov::Albedo));
    assert_eq!(layer(&film, Aov::DenoisingNormal), layer(&film, Aov::Normal));
    for scene in [scenes::assortment(), checkers(true)] {
        for integrator in [path(6), splitting()] {
            let with = render(&scene, &Job { integrator, ..layers_of(&scene) }, 6);
            let without = render(&scene, &Job { aovs: Vec::new(), integrator, ..layers_of(&scene) }, 6);
            assert!(with.pixels() == without.pixels(), "{}: features change the picture", scene.name);
        }
    }
}

fn splitting() -> Integrator {
    let settings = PathSettings { max_depth: 6, roulette_start: 3, splitting: 3, ..PathSettings::default() };
    Integrator::Path(settings)
}

#[test]
fn gpus_find_the_same() {
    let scene = checkers(true);
    let mut cpu = Renderer::cpu(None).expect("threads");
    for integrator in [path(6), path(3), splitting()] {
        let job = Job { integrator, ..layers_of(&scene) };
        let expected = render_on(&mut cpu, &scene, &job, 4).0;
        for renderer in gpu_renderers("gpus_find_the_same").iter_mut() {
            let film = render_on(renderer, &scene, &job, 4).0;
            for aov in LAYERS {
                let pairs = layer(&film, aov).into_iter().zip(layer(&expected, aov));
                let differing = pairs.filter(|(a, b)| a.distance(*b) > 1e-3).count();
                let name = renderer.backend_name();
                assert!(
                    differing * 50 <= expected.pixels().len(),
                    "{name}: {differing} pixels of {aov} differ"
                );
            }
        }
    }
}
