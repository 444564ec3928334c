//! Displaced surfaces as they are rendered: bodies stay closed.

mod common;

use common::{estimate, job};
use scene::LoadOptions;
use scene::load::scene_file::{self, Parameters};

/// A cube that is subdivided to a body with creases, and displaced by a pattern that is finer than its faces are at first. The
/// camera sees it from outside, and a lamp shines from `lamp`.
fn body(lamp: &str, open: bool) -> scene::Scene {
    let file = tempfile::tempdir().expect("a folder");
    let top = if open { "" } else { "f 3/1 7/2 8/3 4/4\n" };
    let cube = format!(
        "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n\
         vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
         f 1/1 5/2 7/3 3/4\nf 2/1 4/2 8/3 6/4\nf 1/1 2/2 6/3 5/4\nf 1/1 3/2 4/3 2/4\nf 5/1 6/2 8/3 7/4\n{top}"
    );
    std::fs::write(file.path().join("cube.obj"), cube).expect("a file");
    let text = format!(
        "[[model]]\nfile = \"cube.obj\"\n\
         subdivision = {{ edge-pixels = 3, max-levels = 7, creases = [[0, 4, 10], [4, 6, 1.5]] }}\n\
         displacement = {{ scale = 0.6, midlevel = 0.5, texture = {{ node = \"noise\", scale = 9, octaves = 3 }} }}\n\
         [[light]]\nkind = \"point\"\nposition = {lamp}\nintensity = 100\n\
         [[camera]]\neye = [1.0, 3.0, 2.4]\ntarget = [0, 0, 0]\nfov = 45\n\
         [render]\nwidth = 96\nheight = 96\n"
    );
    let path = file.path().join("body.toml");
    let loaded = scene_file::parse(&text, &path, file.path(), &Parameters::new(), &LoadOptions::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let triangles = loaded.scene.unique_triangles();
    assert!(triangles > 10_000, "{triangles} triangles: {:?}", loaded.report.notes);
    loaded.scene
}

#[test]
fn a_light_inside_a_displaced_body_does_not_shine_through() {
    let mean = |scene: &scene::Scene| {
        let mean = estimate(scene, &job(scene, 96, 96, 6), 16).mean_colour();
        mean[0] + mean[1] + mean[2]
    };
    assert_eq!(mean(&body("[0, 0, 0]", false)), 0.0, "it has a crack");
    assert!(mean(&body("[2, 3, 3]", false)) > 0.1, "it is lit from outside");
    assert!(mean(&body("[0, 0, 0]", true)) > 0.01, "without its top, light comes out");
}
