//! What the window begins with, where that is not left to the scene.

mod common;

use alhazen::Image;
use alhazen::edits::EnvironmentRecord;
use common::{click, open_with, until};
use viewer::settings::Settings;
use viewer::viewer::{FirstEnvironment, FirstView, Viewer};

fn environment(viewer: &Viewer) -> Option<EnvironmentRecord> {
    viewer.document.as_ref()?.edits().environment.clone()
}

#[test]
fn the_first_scene_is_looked_at_as_asked_and_the_next_is_not() {
    let first = FirstView {
        integrator: Some("direct".into()),
        spp: Some(3),
        camera: Some("1".into()),
        environment: Some(FirstEnvironment::Constant([0.5, 0.25, 0.125])),
        exposure: Some(2.0),
    };
    let mut harness = open_with("atrium", Settings::default(), first);
    let viewer = harness.state();
    assert_eq!(viewer.render.integrators.chosen().name(), "direct");
    assert_eq!((viewer.render.spp, viewer.shown.tone.exposure), (3, 2.0));
    let second = viewer.document.as_ref().expect("open").scene().cameras[1].clone();
    assert_eq!(viewer.camera.eye, second.eye);
    assert_eq!(environment(viewer), Some(EnvironmentRecord::Constant { radiance: [0.5, 0.25, 0.125] }));
    assert!(viewer.notices.iter().all(|notice| !notice.is_error), "{:?}", viewer.notices);
    harness.state_mut().open_source(alhazen::Source::parse("cornell"));
    until(&mut harness, "the next scene", |v| {
        v.document.as_ref().is_some_and(|d| d.source.to_string() == "cornell")
    });
    assert_eq!(harness.state().render.integrators.chosen().name(), "path");
    assert_eq!(environment(harness.state()), None);
}

#[test]
fn panoramas_are_loaded_and_what_is_not_there_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sky.hdr");
    Image::from_fn(8, 4, |_, _| [1.0, 2.0, 3.0]).write_hdr(&file).expect("written");
    let environment_file = FirstEnvironment::File(file.clone());
    let first = FirstView {
        camera: Some("balcony of nobody".into()),
        environment: Some(environment_file),
        ..FirstView::default()
    };
    let mut harness = open_with("cornell", Settings::default(), first);
    until(
        &mut harness,
        "the panorama",
        |v| matches!(environment(v), Some(EnvironmentRecord::File { file: found, .. }) if found == file),
    );
    let errors: Vec<_> = harness.state().notices.iter().filter(|n| n.is_error).collect();
    assert!(errors.len() == 1 && errors[0].text.contains("balcony of nobody"), "{errors:?}");
    click(&mut harness, "Dismiss");
}
