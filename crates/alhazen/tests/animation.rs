//! A scene that is brought to another moment gives the picture of the scene that is loaded at that moment.

mod common;

use alhazen::{Control, Film, Limits, LoadOptions, Renderer, Scene};
use common::job;

fn picture(renderer: &mut Renderer, scene: &Scene) -> Film {
    let job = job(scene, 48, 48, 3);
    renderer.render(&job, &Limits { spp: 4, ..Limits::default() }, &Control::new()).expect("render");
    renderer.film().expect("film").expect("rendered").clone()
}

/// How many pixels of two pictures differ by more than rounding.
fn differing(a: &Film, b: &Film) -> usize {
    let differs = |(a, b): (&film::PixelStats, &film::PixelStats)| {
        a.mean().iter().zip(b.mean()).any(|(a, b)| (a - b).abs() > 1e-3 * (a.abs() + b.abs()))
    };
    a.pixels().iter().zip(b.pixels()).filter(|&p| differs(p)).count()
}

#[test]
fn refitted_structures_give_the_picture_of_new_ones() {
    let Some(shared) = testkit::require_shared("refitted_structures_give_the_picture_of_new_ones") else {
        return;
    };
    for (file, clip, times) in [
        ("khr_SimpleSkin/SimpleSkin.gltf", "0", [0.0, 1.5]),
        ("khr_Fox/Fox.glb", "Run", [0.1, 0.5]),
        ("khr_MorphStressTest/morph-stress-test.glb", "TheWave", [0.2, 0.9]),
    ] {
        let path = shared.join("scenes").join(file);
        let mut scene =
            scene::load::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
        scene.environment = alhazen::Environment::Constant(glam::Vec3::ONE);
        assert!(scene.play(clip), "{file} has {clip}");
        let camera = scene.default_camera();
        scene.cameras = vec![camera];
        scene.set_time(times[0]);
        let (mut moved, mut fresh) =
            (Renderer::cpu(None).expect("threads"), Renderer::cpu(None).expect("threads"));
        moved.load(&scene).expect("load");
        let before = picture(&mut moved, &scene);
        scene.set_time(times[1]);
        moved.update(&scene).expect("update");
        let after = picture(&mut moved, &scene);
        fresh.load(&scene).expect("load");
        let expected = picture(&mut fresh, &scene);
        let (wrong, all) = (differing(&after, &expected), expected.pixels().len());
        assert!(wrong * 500 <= all, "{file}: {wrong} of {all} pixels are not those of new structures");
        let changed = differing(&before, &after);
        assert!(
            changed * 100 > all,
            "{file}: only {changed} pixels have changed from {} s to {} s",
            times[0],
            times[1]
        );
    }
}
