//! Replayed samples are those of pictures, bit for bit, and their records say how they came about.

mod common;

use alhazen::{
    Fog, Integrator, Job, LightVisibility, LoadOptions, Medium, PathEnd, PathSettings, RayQueries,
    SampleRecord, SamplerKind, Scene, SceneTables, Source, VertexPlace, View,
};
use common::{job, render};

const SIDE: u32 = 20;

fn builtin(name: &str) -> Scene {
    Source::parse(name).load(&LoadOptions::default()).expect("built in").scene
}

fn with_settings(scene: &Scene, settings: PathSettings) -> Job {
    Job { integrator: Integrator::Path(settings), seed: 7, ..job(scene, SIDE, SIDE, 1) }
}

fn queries(scene: &Scene) -> RayQueries {
    RayQueries::new(SceneTables::build(scene), Some(1)).expect("threads")
}

/// The radiance of the first sample of each pixel is what the film has after one sample.
fn assert_replays(name: &str, scene: &Scene, job: &Job) -> Vec<SampleRecord> {
    let picture = render(scene, job, 1).to_image();
    let (queries, view) = (queries(scene), job.view(0.0));
    let mut records = Vec::new();
    for (y, x) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (y, x))) {
        let record = queries.replay(&view, [x, y], 0).expect("a sample");
        let [pixel, replayed] = [picture.rgb(x, y), record.radiance].map(|rgb| rgb.map(f32::to_bits));
        assert_eq!(pixel, replayed, "{name}, pixel {x},{y}: {:?} {record:#?}", picture.rgb(x, y));
        records.push(record);
    }
    records
}

#[test]
fn replayed_samples_are_the_films() {
    for name in
        ["cornell", "three-spheres", "glass", "material-grid", "layers", "lights", "textures", "atrium"]
    {
        let scene = builtin(name);
        let defaults = PathSettings { max_depth: 6, roulette_start: 3, ..PathSettings::default() };
        assert_replays(name, &scene, &with_settings(&scene, defaults));
    }
}

#[test]
fn splitting_limits_and_samplers_are_replayed() {
    let scene = builtin("three-spheres");
    let splitting = PathSettings { max_depth: 5, splitting: 3, ..PathSettings::default() };
    let limited = PathSettings { clamp_indirect: Some(0.05), ..splitting };
    for settings in [splitting, limited] {
        for sampler in SamplerKind::ALL {
            let job = Job { sampler, ..with_settings(&scene, settings) };
            let records = assert_replays("three-spheres", &scene, &job);
            assert!(records.iter().any(|record| record.paths.len() == 3));
        }
    }
}

/// What vertices say that they add is what the path has found.
#[test]
fn contributions_add_up() {
    for name in ["cornell", "glass", "lights"] {
        let scene = builtin(name);
        let records = assert_replays(name, &scene, &with_settings(&scene, PathSettings::default()));
        let mut ends = Vec::new();
        for path in records.iter().flat_map(|record| &record.paths) {
            let found = path.vertices.iter().flat_map(|v| v.found.iter().map(|found| found.contribution));
            let sampled = path.vertices.iter().filter_map(|v| v.light_sample).map(|light| light.contribution);
            let sum: f64 = found.chain(sampled).flatten().map(f64::from).sum();
            let whole: f64 = path.radiance.iter().map(|c| f64::from(*c)).sum();
            assert!((sum - whole).abs() <= 1e-5 * whole.abs() + 1e-12, "{name}: {sum} {whole} {path:#?}");
            ends.push(path.end);
        }
        assert!(ends.contains(&PathEnd::Roulette), "{name} has paths that end by chance");
    }
}

/// In a closed box of one lamp every path begins on a wall, and what the records say of it is consistent.
#[test]
fn records_say_what_happened() {
    let scene = builtin("cornell");
    let records = assert_replays("cornell", &scene, &with_settings(&scene, PathSettings::default()));
    let vertices: Vec<_> = records.iter().flat_map(|r| &r.paths).flat_map(|path| &path.vertices).collect();
    for vertex in &vertices {
        let VertexPlace::Surface(surface) = vertex.place else { continue };
        let facing: f32 = surface.normal.iter().zip(vertex.direction).map(|(n, d)| n * d).sum();
        assert!(facing <= 1e-6, "normals face the side that the path comes from: {vertex:#?}");
        assert!((surface.instance as usize) < scene.instances.len());
        assert!((surface.material as usize) < scene.materials.len());
        let Some(light) = vertex.light_sample else { continue };
        let dark = light.contribution == [0.0; 3];
        assert_eq!(dark, light.visibility != LightVisibility::Visible, "{light:?}");
        if light.visibility == LightVisibility::Visible && !light.delta {
            let [a, b] = [light.pdf, light.scattering_pdf].map(f64::from);
            let expected = a * a / (a * a + b * b);
            assert!((f64::from(light.weight) - expected).abs() < 1e-5, "the power heuristic: {light:?}");
        }
    }
    let seen =
        |v: LightVisibility| vertices.iter().any(|x| x.light_sample.is_some_and(|l| l.visibility == v));
    assert!(seen(LightVisibility::Visible) && seen(LightVisibility::Occluded));
    assert!(vertices.iter().any(|v| v.depth == 1 && !v.found.is_empty()), "the lamp is in the picture");
}

#[test]
fn what_cannot_be_replayed_is_refused() {
    let scene = builtin("cornell");
    let view = with_settings(&scene, PathSettings::default()).view(0.0);
    let refused = |queries: &RayQueries, view: &View, pixel| {
        queries.replay(view, pixel, 0).expect_err("refused").to_string()
    };
    let queries_of_box = queries(&scene);
    assert!(refused(&queries_of_box, &view, [SIDE, 0]).contains("no pixel 20,0"));
    let first_hits = View { integrator: Integrator::Aov, ..view.clone() };
    assert!(refused(&queries_of_box, &first_hits, [0, 0]).contains("not of `aov`"));
    let mut foggy = scene;
    let medium = Medium { scattering: [0.1; 3].into(), ..Medium::default() };
    foggy.fog = Some(Fog { medium, top: f32::INFINITY });
    assert!(refused(&queries(&foggy), &view, [0, 0]).contains("media"));
}
