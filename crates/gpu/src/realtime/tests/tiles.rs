//! Lights that the pixels of a tile choose together.

use super::samples::{block_means, paths};
use super::*;

/// The same under a sky, with lamps of all kinds on both sides of the wall, so that there is a tree
/// of lights: some of the pixels of a tile see what others cannot.
fn scene_of_many_lamps() -> scene::Scene {
    use scene::{Light, LightKind};
    use testkit::scenes::{Build, emitter, quads, sphere};
    let mut scene = scene();
    scene.environment = scene::Environment::Constant(Vec3::new(0.2, 0.3, 0.4));
    let bulb = scene.add_material(emitter("bulb", [6.0, 4.0, 2.0]));
    for i in 0..6u8 {
        let x = f32::from(i) - 2.5;
        scene.add_shape("bulb", sphere([x, 0.15, 0.8], 0.08), bulb, glam::Affine3A::IDENTITY);
        // Sheets that shine away from each other.
        let (x, w) = (f64::from(x), 0.2);
        let sheet = [[x, 0.3, -1.0], [x, 0.3, -1.0 + w], [x, 0.3 + w, -1.0 + w], [x, 0.3 + w, -1.0]];
        let turned = [sheet[3], sheet[2], sheet[1], sheet[0]];
        scene.add_mesh("sheet", quads(&[if i % 2 == 0 { sheet } else { turned }]), bulb);
    }
    let direction = Vec3::new(0.0, -1.0, -0.2).normalize();
    let (inner_angle, outer_angle, intensity) = (0.3, 0.6, Vec3::new(0.5, 1.0, 2.0));
    for x in [-1.5, 0.0, 1.5] {
        let position = Vec3::new(x, 1.8, 0.6);
        let kind = LightKind::Spot { position, direction, intensity, inner_angle, outer_angle };
        scene.lights.push(Light::new("spot", kind));
    }
    scene
}

/// The brightness of blocks of 8 × 8 pixels in pictures that are independent of each other: mean
/// and variance of the mean.
fn block_statistics(films: &[Film]) -> Vec<(f64, f64)> {
    let means: Vec<Vec<f64>> = films.iter().map(block_means).collect();
    let n = films.len() as f64;
    let of_block = |block: usize| {
        let mean = means.iter().map(|m| m[block]).sum::<f64>() / n;
        let squares = means.iter().map(|m| (m[block] - mean).powi(2)).sum::<f64>();
        (mean, squares / (n - 1.0) / n)
    };
    (0..means[0].len()).map(of_block).collect()
}

/// What is expected is the picture of `path`, whatever tiles have chosen; the error is less than
/// that of lights that are chosen one by one. Pixels of a tile share their lights, so blocks are
/// compared by what they differ by from film to film.
#[test]
fn tiles_of_lights_show_what_paths_show() {
    let scene = scene_of_many_lamps();
    let Some(mut stage) = Stage::new("tiles_of_lights_show_what_paths_show", &scene) else { return };
    let films = 24;
    let mut render = |light_candidates| -> Vec<Film> {
        stage.begin();
        let settings = RealtimeSettings { filter: false, light_candidates, ..settings() };
        let film = |_| {
            stage.frames(&view(0.0, settings), 12);
            stage.film()
        };
        (0..films).map(film).collect()
    };
    let [one, tiles, single] = [0, 16, 1].map(&mut render);
    let reference = block_means(&paths(&scene, 2048));
    let error = |films: &[Film]| {
        let blocks = block_statistics(films);
        for (block, ((mean, variance), expected)) in blocks.iter().zip(&reference).enumerate() {
            // The reference has 2048 samples a pixel, the films have 288 together.
            let z = (mean - expected) / (1.15 * variance).sqrt();
            assert!(z.abs() < 4.5, "block {block} is {mean}, not {expected}: {z:.1} standard errors");
        }
        // Relative to the picture, as the eye has it.
        let relative = |p: &film::PixelStats| p.variance().map(|v| v[1] / (p.mean()[1].powi(2) + 0.01));
        films.iter().flat_map(|f| f.pixels()).filter_map(relative).sum::<f64>()
    };
    // A single candidate leaves much to what paths find by chance, which many do not.
    let (one, tiles, _) = (error(&one), error(&tiles), error(&single));
    println!("a sample's variance is {:.2} of that of lights chosen one by one", tiles / one);
    assert!(tiles < 0.9 * one, "{tiles} against {one}");
}
