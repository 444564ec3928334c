//! What files say about motion, and what becomes of it while the shutter is open.

use scene::load::{packed, scene_file};
use scene::tables::SceneTables;
use scene::{LoadError, LoadOptions, Loaded, Shutter};
use std::path::Path;

fn scene_file(text: &str) -> Result<Loaded, LoadError> {
    let options = LoadOptions::default();
    scene_file::parse(text, Path::new("motion.toml"), Path::new("."), &Default::default(), &options)
}

fn pbrt(text: &str) -> Result<Loaded, LoadError> {
    scene::load::pbrt::load_bytes(Path::new("motion.pbrt"), text.as_bytes().to_vec(), &LoadOptions::default())
}

const MOVING: &str = r#"
[render]
shutter = { open = -0.5, close = 0.5, shape = "triangle", rolling = "rows:0.25" }

[[camera]]
motion = [
    { time = -1, eye = [0, 1, 5], target = [0, 0, 0] },
    { time = 1, eye = [1, 1, 5], target = [0, 0, 0] },
]

[[shape]]
kind = "sphere"
radius = 0.5
motion = [{ time = -1, translate = [-1, 0, 0] }, { time = 1, translate = [1, 0, 0], scale = 2 }]

[[shape]]
kind = "box"
translate = [0, -2, 0]
"#;

#[test]
fn scene_files_say_what_moves_and_when() {
    let mut scene = scene_file(MOVING).expect("the scene").scene;
    let shutter = scene.defaults.shutter.expect("a shutter");
    assert_eq!(shutter.to_string(), "-0.5..0.5 triangle rows:0.25");
    scene.open_shutter(0.0, &shutter);
    let motion = scene.motion.clone().expect("something moves");
    assert_eq!(motion.instances.keys().copied().collect::<Vec<_>>(), [0]);
    assert!(motion.lights.is_empty() && motion.held.is_empty());
    assert_eq!(scene.cameras[0].keys.len(), 17);
    // The middle of what the rows see is an eighth of a second after the moment.
    assert!((scene.instances[0].transform.translation.x - 0.125).abs() < 1e-5);
    let tables = SceneTables::build(&scene);
    let moved = |time: f32| {
        let index = (0..tables.instances.len() as u32).find_map(|i| tables.moved_instance(i, time));
        index.expect("an instance that moves").object_to_world
    };
    assert!((moved(0.0)[0][3] + 0.5).abs() < 1e-5 && (moved(1.0)[0][3] - 0.75).abs() < 1e-5);
    assert!((moved(0.0)[1][1] - 1.25).abs() < 1e-5, "the scale grows evenly");
    scene.set_time(0.0);
    assert!(scene.motion.is_none() && scene.cameras[0].keys.is_empty(), "an instant");
}

#[test]
fn what_cannot_move_is_refused() {
    for (text, what) in [
        ("[[shape]]\nkind = \"box\"\ntranslate = [1, 0, 0]\nmotion = [{ time = 0 }]", "motion"),
        ("[[shape]]\nkind = \"box\"\nmotion = [{ time = 0, turn = 1 }]", "turn"),
        ("[[light]]\nkind = \"point\"\nintensity = 1\nmotion = [{ time = 0 }]", "motion"),
        (
            "[[camera]]\neye = [0, 0, 1]\nmotion = [{ time = 0, eye = [0, 0, 1], target = [0, 0, 0] }]",
            "motion",
        ),
        ("[render]\nshutter = { open = 0, close = 1, shape = \"round\" }", "round"),
    ] {
        let error = scene_file(text).err().unwrap_or_else(|| panic!("{text}"));
        assert!(error.to_string().contains(what), "{error}");
    }
    let disordered =
        "[[shape]]\nkind = \"box\"\nmotion = [{ time = 1 }, { time = 0, translate = [1, 0, 0] }]";
    let loaded = scene_file(disordered).expect("the rest of the scene");
    assert!(
        loaded.report.notes.iter().any(|note| note.to_string().contains("0 s")),
        "{:?}",
        loaded.report.notes
    );
}

#[test]
fn pbrt_files_move_by_active_transforms() {
    let loaded = pbrt(
        "LookAt 0 0 5  0 0 0  0 1 0\n\
         TransformTimes 0 2\n\
         Camera \"perspective\" \"float shutteropen\" 0.5 \"float shutterclose\" 1.5\n\
         WorldBegin\n\
         AttributeBegin\nActiveTransform EndTime\nTranslate 4 0 0\nActiveTransform All\nTranslate 0 1 0\n\
         Shape \"sphere\"\nAttributeEnd\n\
         Shape \"sphere\"\n",
    )
    .expect("the scene");
    let mut scene = loaded.scene;
    let shutter = scene.defaults.shutter.expect("a shutter");
    assert_eq!(shutter, Shutter::new(0.5, 1.5).expect("a shutter"));
    scene.open_shutter(0.0, &shutter);
    let motion = scene.motion.expect("something moves");
    assert_eq!(motion.instances.keys().copied().collect::<Vec<_>>(), [0], "the second one is outside");
    let place = scene.instances[0].transform.translation;
    assert!((place.x.abs() - 2.0).abs() < 1e-5 && (place.y - 1.0).abs() < 1e-5, "{place}");
    assert!(pbrt("TransformTimes 1 0\n").is_err());
}

#[test]
fn saved_scenes_keep_the_motion_of_an_open_shutter() {
    let mut scene = scene_file(MOVING).expect("the scene").scene;
    scene.open_shutter(0.0, &Shutter::new(0.0, 0.5).expect("a shutter"));
    let bytes = packed::pack(&scene).expect("packed");
    let read = packed::unpack(Path::new("scene"), &bytes).expect("unpacked");
    assert_eq!(read.motion, scene.motion);
    assert_eq!(read.cameras, scene.cameras);
    assert_eq!(SceneTables::build(&read).fingerprint(), SceneTables::build(&scene).fingerprint());
    scene.set_time(0.25);
    assert_ne!(SceneTables::build(&read).fingerprint(), SceneTables::build(&scene).fingerprint());
}
