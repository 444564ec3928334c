//! Image tools: histogram, zebra, values of pixels, differences, snapshots.

use super::{open, page, press, run, until};
use crate::common::click;
use egui::Key;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use viewer::analysis::Difference;
use viewer::panels::Tab;
use viewer::viewer::{Command, Comparison, Look, Viewer};
use viewer::worker::Channels;

/// A finished picture of eight samples without a denoiser.
fn finished(scene: &str) -> Harness<'static, Viewer> {
    let mut harness = open(scene);
    harness.state_mut().shown.denoiser = None;
    // Values above 1 are clipped, and grey stays grey.
    harness.state_mut().shown.tone.mapper = alhazen::ToneMapper::Srgb;
    harness.state_mut().render.spp = 8;
    until(&mut harness, "the picture", |v| {
        v.is_current() && v.shot().is_some_and(|s| !s.preview && s.spp >= 8)
    });
    harness
}

fn says(harness: &Harness<'_, Viewer>, text: &str) -> bool {
    harness.state().notices.iter().any(|notice| notice.text.contains(text))
}

#[test]
fn values_are_distributed_and_clipping_has_stripes() {
    let mut harness = finished("cornell");
    page(&mut harness, Tab::Image);
    until(&mut harness, "a histogram", |v| {
        v.tools.findings.as_ref().is_some_and(|f| f.histogram.is_some() && f.waveform.is_some())
    });
    harness.run_steps(2);
    assert!(harness.query_by_label("Waveform").is_some() && harness.query_by_label("Above 1").is_some());
    let above = |h: &Harness<'_, Viewer>| {
        let findings = h.state().tools.findings.as_ref().expect("found");
        findings.histogram.as_ref().expect("asked for").above_one[3]
    };
    let before = above(&harness);
    harness.state_mut().shown.tone.exposure = 64.0;
    until(&mut harness, "brighter values", |v| {
        let histogram = v.tools.findings.as_ref().and_then(|f| f.histogram.as_ref());
        histogram.is_some_and(|h| h.above_one[3] > 0.5)
    });
    assert!(before < 0.2, "{before}");
    assert!(harness.query_by_label_contains("white: ").is_none());
    press(&mut harness, Key::Z);
    until(&mut harness, "stripes", |v| {
        let clipping = v.tools.findings.as_ref().and_then(|f| f.clipping.as_ref());
        clipping.is_some_and(|c| c.bright > 0.5)
    });
    harness.run_steps(2);
    assert!(harness.query_by_label_contains("white: ").is_some());
    assert!(says(&harness, "zebra"));
}

#[test]
fn snapshots_are_compared_measured_and_forgotten() {
    let mut harness = finished("cornell");
    page(&mut harness, Tab::Image);
    run(&mut harness, Command::NextLook);
    assert!(says(&harness, "nothing to compare with"));
    press(&mut harness, Key::K);
    assert_eq!(harness.state().tools.snapshots.len(), 1);
    harness.run_steps(2);
    click(&mut harness, "Compare");
    assert!(matches!(harness.state().comparison, Comparison::Stored { .. }));
    let compared = |v: &Viewer| v.tools.findings.as_ref().and_then(|f| f.compared.clone());
    until(&mut harness, "a comparison", |v| compared(v).is_some());
    let same = compared(harness.state()).expect("there").expect("alike in size");
    assert_eq!((same.mse, same.flip), (0.0, 0.0), "the picture differs from itself");
    // Another seed: noise differs, the mean does not.
    harness.state_mut().render.seed = 7;
    until(&mut harness, "a difference", |v| matches!(compared(v), Some(Ok(c)) if c.mse > 0.0));
    harness.run_steps(2);
    assert!(harness.query_by_label("FLIP").is_some());
    for look in [Look::A, Look::B, Look::Difference] {
        press(&mut harness, Key::V);
        assert_eq!(harness.state().tools.look, look);
    }
    until(&mut harness, "the legend of the difference", |v| v.legend().is_some());
    harness.state_mut().tools.difference = Difference::Signed;
    until(&mut harness, "signs", |v| v.legend().is_some_and(|l| l.labels[0] == "-1"));
    click(&mut harness, "Go back");
    assert_eq!(harness.state().render.seed, 0);
    click(&mut harness, "Forget");
    assert!(harness.state().tools.snapshots.is_empty());
    assert_eq!(harness.state().comparison, Comparison::None, "what is forgotten is compared with");
}

#[test]
fn pictures_of_another_size_are_not_compared_but_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("other.hdr");
    let picture = alhazen::Image::from_fn(9, 7, |_, _| [0.5; 3]);
    picture.write_hdr(&file).expect("written");
    let mut harness = finished("cornell");
    page(&mut harness, Tab::Image);
    harness.state_mut().compare_with_file(&file);
    until(&mut harness, "an answer", |v| {
        v.tools.findings.as_ref().is_some_and(|f| matches!(f.compared, Some(Err(_))))
    });
    harness.run_steps(2);
    assert!(harness.query_all_by_label_contains("9×7").next().is_some());
    assert_eq!(harness.state().tools.snapshots[0].name, "other.hdr");
}

#[test]
fn channels_are_shown_alone_and_the_picture_is_copied() {
    let mut harness = finished("cornell");
    let colourful = |v: &Viewer| {
        let image = v.shot().expect("a picture").image.clone();
        image.pixels.iter().any(|p| p.r() != p.g())
    };
    assert!(colourful(harness.state()));
    harness.state_mut().shown.channels = Channels::Green;
    until(&mut harness, "grey", |v| !colourful(v));
    run(&mut harness, Command::Picture);
    until(&mut harness, "colours", colourful);
    run(&mut harness, Command::CopyPicture);
    assert!(says(&harness, "copied the picture, 32×24"));
    assert!(harness.state().legend().is_none());
    harness.state_mut().shown.false_colour = Some(6.0);
    harness.run_steps(2);
    let legend = harness.state().legend().expect("false colours have one");
    let middle = format!("{:.3}", 0.18 / harness.state().shown.tone.exposure);
    assert!(legend.labels[1].contains(&middle), "{:?}", legend.labels);
}

#[test]
fn contrast_and_motion_are_set_and_the_compass_looks_along_axes() {
    let mut harness = finished("three-spheres");
    let calm = harness.ctx.global_style();
    assert!(calm.animation_time > 0.0 && calm.visuals.override_text_color.is_none());
    for setting in ["High contrast", "Reduced motion"] {
        click(&mut harness, "View");
        click(&mut harness, setting);
    }
    press(&mut harness, Key::Escape);
    let style = harness.ctx.global_style();
    assert!(style.animation_time == 0.0 && style.visuals.override_text_color.is_some());
    let before = harness.state().camera.clone();
    let room = harness.get_by_role_and_label(egui::accesskit::Role::Image, "Picture").rect();
    let ends = viewer::gizmo::compass::ends(&before, room);
    let above = ends.iter().find(|end| end.axis == 1 && end.is_positive).expect("an end").at;
    harness.hover_at(above);
    harness.run_steps(2);
    harness.drag_at(above);
    harness.run_steps(1);
    harness.drop_at(above);
    harness.run_steps(3);
    let camera = &harness.state().camera;
    assert_eq!(camera.target, before.target);
    let direction = (camera.eye - camera.target).normalize();
    assert!(direction.y > 0.999, "{direction}");
}
