//! Texture graphs: filtering, light, heights.

mod common;

use alhazen::{Aov, Environment, Film, Integrator, Job, Material, Model, Scene};
use common::{job, path, render};
use film::AovData;
use glam::{Affine3A, Vec3};
use scene::texture_graph::{Placement, Space, kind_named};
use scene::{Camera, GraphInput, Texture, TextureGraph, TextureGraphNode, TextureRef};
use testkit::scenes::{Build, emitter, ground, lambert, quads};

fn node(name: &str) -> TextureGraphNode {
    TextureGraphNode::new(kind_named(name).expect("a kind"))
}

/// A node in object space with so many cells a metre.
fn placed(name: &str, scale: f32) -> TextureGraphNode {
    let map = Affine3A::from_scale(Vec3::splat(scale));
    TextureGraphNode { placement: Placement { space: Space::Object, map }, ..node(name) }
}

fn add_graph(scene: &mut Scene, nodes: Vec<TextureGraphNode>) -> Option<TextureRef> {
    scene.textures.push(Texture::Graph(TextureGraph { nodes }));
    Some(TextureRef::new(scene.textures.len() as u32 - 1))
}

/// Mean of a film's red over rows.
fn mean(film: &Film, width: u32, rows: std::ops::Range<u32>) -> f64 {
    let pixels = &film.pixels()[(rows.start * width) as usize..(rows.end * width) as usize];
    pixels.iter().map(|p| p.mean()[0]).sum::<f64>() / pixels.len() as f64
}

/// A floor to the horizon, whose colour is a graph, with one sample in the middle of each pixel's lower half.
fn floor(nodes: Vec<TextureGraphNode>) -> Film {
    let mut scene = Scene::default();
    let texture = add_graph(&mut scene, nodes);
    let material =
        Material { model: Model::Unlit, base_color_texture: texture, ..lambert("floor", [1.0; 3]) };
    let material = scene.add_material(material);
    scene.add_mesh("floor", ground(0.0, 4000.0), material);
    scene.cameras.push(Camera::perspective("low", Vec3::new(0.3, 1.0, 0.2), Vec3::new(10.0, 0.9, 0.7), 0.5));
    render(&scene, &job(&scene, 256, 128, 1), 1)
}

/// Whatever the pattern, what is far away has the mean of what is near, and is not noisy.
#[test]
fn patterns_have_their_mean_at_the_horizon() {
    let turned = |mut n: TextureGraphNode| {
        n.placement.map = Affine3A::from_rotation_x(std::f32::consts::FRAC_PI_2) * n.placement.map;
        n
    };
    let checkers =
        turned(placed("checkerboard", 3.0)).taking([GraphInput::number(0.9), GraphInput::number(0.1)]);
    let cases: [(&str, TextureGraphNode, f64, f64); 6] = [
        ("checkerboard", checkers, 0.5, 0.02),
        ("cubes", placed("checkerboard", 3.0).with("cells", 1.0), 0.5, 0.02),
        ("wave", placed("wave", 4.0), 0.5, 0.02),
        ("saw", placed("wave", 4.0).with("profile", 1.0), 0.5, 0.02),
        ("noise", placed("noise", 6.0).with("octaves", 5.0), 0.5, 0.02),
        ("dots", turned(placed("dots", 4.0)), 0.5 * std::f64::consts::PI * 0.35 * 0.35, 0.02),
    ];
    for (name, node, expected, tolerance) in cases {
        let film = floor(vec![node]);
        // The horizon is in the middle; rows just below it see hundreds of metres.
        let horizon = (0..128).find(|row| mean(&film, 256, *row..row + 1) > 0.0).expect("a floor");
        let far = mean(&film, 256, horizon + 1..horizon + 5);
        assert!((far - expected).abs() < tolerance, "{name}: {far} instead of {expected}");
        let row = (horizon + 2) * 256;
        let values = film.pixels()[row as usize..(row + 256) as usize].iter().map(|p| p.mean()[0]);
        let spread = values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
        assert!(spread.1 - spread.0 < 0.12, "{name}: from {} to {} along a row", spread.0, spread.1);
    }
}

/// A lamp whose left half is bright and whose right half is dim lights a floor as two lamps do.
#[test]
fn emission_by_a_graph_is_sampled_as_it_shines() {
    let quad =
        |x0: f64, x1: f64| quads(&[[[x0, 1.0, -0.5], [x1, 1.0, -0.5], [x1, 1.0, 0.5], [x0, 1.0, 0.5]]]);
    // The lamp with a graph may be moved into the world or stay an instance, turned by half a turn.
    let lit = |graph: bool, turned: bool, dynamic: bool| {
        let mut scene = Scene { environment: Environment::Black, ..Scene::default() };
        if graph {
            let step = TextureGraphNode::new(kind_named("range").expect("a kind"));
            let step = step.with("from-low", -1e-4).with("from-high", 1e-4).with("to-low", 1.0);
            let step = step.with("to-high", 0.125).with("interpolation", 2.0);
            let at = placed("coordinates", 1.0);
            let red = node("channel").taking([GraphInput::Node(0)]);
            let nodes = vec![at, red, step.taking([GraphInput::Node(1)])];
            let texture = add_graph(&mut scene, nodes);
            let lamp = Material { emission_texture: texture, ..emitter("lamp", [8.0; 3]) };
            let lamp = scene.add_material(lamp);
            scene.add_mesh("lamp", quad(-0.8, 0.8), lamp);
            let instance = &mut scene.instances[0];
            instance.dynamic = dynamic;
            instance.transform = Affine3A::from_rotation_y(if turned { std::f32::consts::PI } else { 0.0 });
        } else {
            for (x0, x1, radiance) in [(-0.8, 0.0, 8.0), (0.0, 0.8, 1.0)] {
                let lamp = scene.add_material(emitter("lamp", [radiance; 3]));
                scene.add_mesh("lamp", quad(x0, x1), lamp);
            }
        }
        let floor = scene.add_material(lambert("floor", [0.5; 3]));
        scene.add_mesh("floor", ground(0.0, 3.0), floor);
        scene.cameras.push(Camera::perspective("c", Vec3::new(0.0, 1.6, 2.8), Vec3::ZERO, 0.7));
        let job = Job { integrator: path(3), ..job(&scene, 32, 24, 5) };
        render(&scene, &job, 512)
    };
    let half = |film: &Film, right: bool| {
        let own = film.pixels().iter().enumerate().filter(|(i, _)| (i % 32 >= 16) == right);
        own.map(|(_, p)| p.mean()[0]).sum::<f64>()
    };
    let two = lit(false, false, false);
    for (turned, dynamic) in [(false, false), (true, false), (true, true)] {
        let one = lit(true, turned, dynamic);
        for right in [false, true] {
            let ratio = half(&one, right != turned) / half(&two, right);
            assert!((ratio - 1.0).abs() < 0.02, "turned {turned}, dynamic {dynamic}, right {right}: {ratio}");
        }
    }
}

/// A slope of heights turns normals as far as a plane with that slope, on meshes and spheres, seen from either side.
#[test]
fn heights_tilt_normals() {
    // Rows that rise by 0.5 m a metre along x.
    let slope = |scene: &mut Scene| {
        let at = placed("coordinates", 0.5);
        add_graph(
            scene,
            vec![at, node("channel").taking([GraphInput::Node(0)]), {
                node("add").taking([GraphInput::Node(1), GraphInput::number(10.0)])
            }],
        )
    };
    let shaded = |bumped: bool, from: f32| {
        let mut scene = Scene::default();
        let texture = if bumped { slope(&mut scene) } else { None };
        let material = scene.add_material(Material { normal_texture: texture, ..lambert("floor", [0.5; 3]) });
        scene.add_mesh("floor", ground(0.0, 5.0), material);
        scene.cameras.push(Camera {
            up: Vec3::Z,
            ..Camera::perspective("c", Vec3::new(0.0, from, 0.0), Vec3::ZERO, 0.3)
        });
        let (integrator, aovs) = (Integrator::Aov, vec![Aov::Normal]);
        let film = render(&scene, &Job { integrator, aovs, ..job(&scene, 8, 8, 1) }, 4);
        let AovData::Float(image) = film.aov(Aov::Normal).expect("asked for") else { panic!("no normals") };
        let normals = image.data().chunks_exact(3).map(Vec3::from_slice);
        normals.sum::<Vec3>() / 64.0
    };
    let expected = Vec3::new(-0.5, 1.0, 0.0).normalize();
    for (from, side) in [(4.0, 1.0), (-4.0, -1.0)] {
        let (flat, tilted) = (shaded(false, from), shaded(true, from));
        assert!((flat - Vec3::Y * side).length() < 0.02, "{flat}");
        assert!((tilted - expected * side).length() < 0.02, "{from}: {tilted} instead of {expected}");
    }
}
