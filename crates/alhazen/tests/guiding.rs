//! Path guiding: the same expected picture, and bits that depend on nothing but scene, view and seed.

mod common;

use alhazen::{
    BackendError, Control, Description, Integrator, Job, Limits, LoadOptions, Merger, PartJob, PathSettings,
    Renderer, Scene, Source, Switch, Tile,
};
use common::{assert_same_coarse, job, render, render_with};
use testkit::{Estimate, repository_root};

/// Two rooms, a lamp in one of them, a door ajar between them.
fn door() -> Scene {
    let file = repository_root().join("docs/scenes/door.toml");
    Source::parse(&file.to_string_lossy()).load(&LoadOptions::default()).expect("it is there").scene
}

/// A small picture by paths of at most eight segments, of which many die early.
fn small(scene: &Scene, guiding: Switch) -> Job {
    let path = PathSettings { max_depth: 8, roulette_start: 3, guiding, ..PathSettings::default() };
    Job { integrator: Integrator::Path(path), ..job(scene, 48, 32, 8) }
}

#[test]
fn bits_depend_neither_on_threads_nor_on_parts() {
    let scene = door();
    let job = small(&scene, Switch::On);
    let (one, _) = render_with(&scene, &job, 6, Some(1));
    let (three, _) = render_with(&scene, &job, 6, Some(3));
    assert!(one == three, "three threads give other bits than one");
    assert!(one != render(&scene, &small(&scene, Switch::Off), 6), "nothing was guided");

    let about = Description::new("door", &[], &scene);
    let whole = PartJob::whole(&job, 6, &about);
    let mut merger = Merger::new();
    for (index, samples) in [(0, 0..6), (1, 0..2), (1, 2..6)] {
        // Each as if on a machine of its own.
        let mut renderer = Renderer::cpu(Some(2)).expect("threads");
        renderer.load(&scene).expect("small");
        let part = PartJob { tile: Some(Tile { index, count: 2 }), samples: Some(samples), ..whole.clone() };
        let (part, _) = renderer.render_part(&part, None, &Control::new(), None).expect("a part");
        merger.add(&format!("{index}"), part).expect("it belongs to the picture");
    }
    // Parts that were not guided are parts of another picture.
    let other = small(&scene, Switch::Off);
    let mut renderer = Renderer::cpu(Some(2)).expect("threads");
    renderer.load(&scene).expect("small");
    let part = PartJob { tile: Some(Tile { index: 0, count: 2 }), ..PartJob::whole(&other, 6, &about) };
    let (part, _) = renderer.render_part(&part, None, &Control::new(), None).expect("a part");
    assert!(merger.add("unguided", part).is_err());
    let merged = merger.finish().expect("complete");
    assert!(merged.film().pixels() == one.pixels(), "parts give other bits than the whole");
}

/// The mean of pictures with many guides and noises.
fn mean_of_seeds(scene: &Scene, guiding: Switch, seeds: u32) -> Estimate {
    let mut renderer = Renderer::cpu(None).expect("threads");
    renderer.load(scene).expect("small");
    let mut films = (0..seeds).map(|seed| {
        let job = Job { seed, ..small(scene, guiding) };
        let limits = Limits { spp: 32, ..Limits::default() };
        renderer.render(&job, &limits, &Control::new()).expect("it renders");
        renderer.film().expect("the film").expect("there is one").clone()
    });
    let mut sum = films.next().expect("at least one seed");
    for film in films {
        for (pixel, more) in sum.pixels_mut().iter_mut().zip(film.pixels()) {
            pixel.merge(more);
        }
    }
    Estimate::from_film(&sum)
}

#[test]
fn the_expected_picture_is_the_same() {
    let scene = door();
    let [plain, guided] = [Switch::Off, Switch::On].map(|guiding| mean_of_seeds(&scene, guiding, 24));
    assert_same_coarse("door", &plain, &guided);
    // Surfaces of several lobes, some of them mirrors, and layers.
    let scene = Source::parse("layers").load(&LoadOptions::default()).expect("built in").scene;
    let [plain, guided] = [Switch::Off, Switch::On].map(|guiding| mean_of_seeds(&scene, guiding, 8));
    assert_same_coarse("layers", &plain, &guided);
}

#[test]
fn auto_says_what_it_chose() {
    let cornell = Source::parse("cornell").load(&LoadOptions::default()).expect("built in").scene;
    let mut renderer = Renderer::cpu(Some(2)).expect("threads");
    renderer.load(&cornell).expect("small");
    let limits = Limits { spp: 4, ..Limits::default() };
    let mut notices = |guiding| {
        renderer.render(&small(&cornell, guiding), &limits, &Control::new()).expect("it renders");
        renderer.take_notices().concat()
    };
    assert_eq!(notices(Switch::Off), "");
    assert!(notices(Switch::On).starts_with("path guiding: on, "));
    let auto = notices(Switch::Auto);
    assert!(auto.starts_with("path guiding: off, "), "{auto}");
    // What was decided once is not decided again.
    assert_eq!(notices(Switch::Auto), "");
    // Then the picture is that without a guide.
    let picture = |guiding| render(&cornell, &small(&cornell, guiding), 4).to_image();
    assert_eq!(picture(Switch::Auto), picture(Switch::Off));
}

#[test]
fn training_can_be_cancelled_and_media_are_not_guided() {
    let scene = door();
    let mut renderer = Renderer::cpu(Some(1)).expect("threads");
    renderer.load(&scene).expect("small");
    let control = Control::new();
    control.cancel();
    let view = small(&scene, Switch::On).view(0.0);
    let stats = renderer.render_pass(&view, 4, &control).expect("it is no error");
    assert!(stats.cancelled && stats.samples == 0);
    // The next call is as if it had not been.
    let (whole, _) = render_with(&scene, &small(&scene, Switch::On), 2, Some(2));
    renderer.render_pass(&view, 2, &Control::new()).expect("it renders");
    assert!(renderer.film().expect("the film").expect("there is one").pixels() == whole.pixels());

    let file = repository_root().join("docs/scenes/volumes.toml");
    let fog =
        Source::parse(&file.to_string_lossy()).load(&LoadOptions::default()).expect("it is there").scene;
    renderer.load(&fog).expect("small");
    let limits = Limits { spp: 1, ..Limits::default() };
    renderer.render(&small(&fog, Switch::On), &limits, &Control::new()).expect("it renders");
    assert!(renderer.take_notices().concat().contains("media"));
}

#[test]
fn back_ends_without_guides_say_so() {
    let view = small(&door(), Switch::On).view(0.0);
    let Err(BackendError::View { reason }) = backend::check_switches(&view) else { panic!("accepted") };
    assert!(reason.contains("cpu"), "{reason}");
    let auto = small(&door(), Switch::Auto).view(0.0);
    assert!(backend::check_switches(&auto).is_ok());
}
