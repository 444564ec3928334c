use super::*;

fn session(scene: &str, width: u32, height: u32) -> Session {
    let mut session = Session::new().expect("a back end");
    session.resize(width, height).expect("possible");
    session.open(scene).expect("a scene");
    session
}

/// Renders until every pixel has so many samples.
fn finish(session: &mut Session, spp: u32) {
    for _ in 0..10_000 {
        if session.render(spp, Duration::from_millis(5)).expect("rendered").is_done(spp) {
            return;
        }
    }
    panic!("it never ends");
}

#[test]
fn slices_make_the_picture_that_the_command_line_makes() {
    let mut session = session("cornell", 40, 30);
    finish(&mut session, 3);
    let film = session.renderer.film().expect("a film").expect("rendered").to_image();
    let loaded = Source::parse("cornell").load(&LoadOptions::default()).expect("it is built in");
    let mut renderer = Renderer::cpu(Some(1)).expect("a back end");
    renderer.load(&loaded.scene).expect("loaded");
    let job = Job { width: 40, height: 30, ..Job::for_scene(&loaded.scene) };
    renderer.render_pass(&job.view(0.0), 3, &alhazen::Control::new()).expect("rendered");
    let whole = renderer.film().expect("a film").expect("rendered").to_image();
    assert_eq!(film.data(), whole.data());
}

#[test]
fn after_a_motion_a_coarse_picture_comes_first_and_stays_until_the_other_is_there() {
    let mut session = session("cornell", 640, 480);
    session.navigate(Gesture::Orbit(Vec2::new(0.1, 0.0))).expect("a scene is open");
    let first = session.render(1, Duration::from_secs(60)).expect("rendered").clone();
    assert_eq!((first.coarseness, first.spp), (1, 0), "the coarse picture is whole: {first:?}");
    let coarse = session.shown(true).expect("shown");
    assert!(coarse.width < 640, "{}", coarse.width);
    // One slice of the whole picture: below it there is still the coarse one.
    session.render(1, Duration::ZERO).expect("rendered");
    let mixed = session.shown(true).expect("shown");
    assert_eq!(mixed.width, 640);
    let row = |y: u32| &mixed.rgba[4 * (640 * y) as usize..4 * (640 * (y + 1)) as usize];
    let last: f64 = row(470).iter().map(|&c| f64::from(c)).sum();
    assert!(last > 255.0 * 640.0 * 1.05, "the lower rows are black: {last}");
}

#[test]
fn settings_that_change_no_sample_keep_the_picture() {
    let mut session = session("cornell", 16, 16);
    finish(&mut session, 2);
    let dark = session.shown(false).expect("shown");
    session.set("exposure", "4").expect("possible");
    assert!(session.render(2, Duration::ZERO).expect("rendered").is_done(2), "begun anew");
    assert_ne!(dark, session.shown(false).expect("shown"));
    session.set("mis", "bsdf").expect("possible");
    assert!(!session.render(2, Duration::ZERO).expect("rendered").is_done(2), "another picture");
    assert!(session.set("mis", "both").is_err());
}

#[test]
fn files_are_opened_with_what_they_refer_to_and_bad_ones_change_nothing() {
    let mut session = session("cornell", 16, 16);
    session.give("m/a.obj", b"mtllib a.mtl\nusemtl lamp\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec());
    session.give("m/a.mtl", b"newmtl lamp\nKe 5 5 5\n".to_vec());
    session.give("broken.glb", b"no model".to_vec());
    let opened = session.open("m/a.obj").expect("it was given");
    assert_eq!((opened.triangles, opened.name.as_str()), (1, "a"));
    let camera = session.camera();
    assert!(session.open("broken.glb").is_err() && session.open("none.glb").is_err());
    assert_eq!(session.camera(), camera, "the scene that was open is open");
    finish(&mut session, 1);
    assert!(session.light_by("none.hdr").is_err());
    assert!(session.png(false).expect("a file").starts_with(b"\x89PNG"));
    assert!(session.exr().expect("a file").len() > 100);
}

#[test]
fn paths_are_explained_where_they_are_seen() {
    let mut session = session("cornell", 64, 64);
    // The floor, which sees the lamp.
    let explanations: Vec<_> =
        (0..8).map(|sample| session.explain([20, 60], sample).expect("a pixel")).collect();
    assert!(explanations.iter().all(|e| !e.instances.is_empty()));
    assert!(explanations.iter().any(|e| e.sample.paths[0].vertices.len() > 1));
    // Some light samples lie behind the surface, and have no line.
    let mut lines = explanations.iter().flat_map(|e| &e.lines);
    let first = lines.find(|line| line.vertex == 0).expect("a light sample at the first vertex");
    let [x, y, ..] = first.pieces[0];
    assert!((x - 20.5).abs() < 1.0 && (y - 60.5).abs() < 1.0, "it begins in the pixel: {x}, {y}");
    assert!(session.explain([64, 0], 0).is_err());
    session.set("integrator", "direct").expect("possible");
    assert!(session.explain([1, 1], 0).is_err(), "only paths are explained");
}

#[test]
fn impossible_pictures_are_refused() {
    let mut session = Session::new().expect("a back end");
    assert!(matches!(session.resize(0, 10), Err(SessionError::Size(0, 10))));
    assert!(matches!(session.shown(true), Err(SessionError::NoScene)));
    assert!(matches!(session.render(1, Duration::ZERO), Err(SessionError::NoScene)));
}
