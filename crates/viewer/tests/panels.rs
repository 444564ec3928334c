//! Panels are used as people use them: by their labels, without a window.

mod common;

use alhazen::{Control, Limits, LoadOptions, Renderer, Scene, Source, ToneMapper};
use common::{click, open_with, until};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use std::path::Path;
use std::time::Duration;
use viewer::panels::Tab;
use viewer::settings::Settings;
use viewer::viewer::{Command, FirstView, Viewer};
use viewer::worker::{Layer, layer_image};

fn open(scene: &str) -> Harness<'static, Viewer> {
    open_with(scene, Settings::default(), FirstView::default())
}

/// Opens a page. Its name may stand elsewhere, too.
fn page(harness: &mut Harness<'_, Viewer>, tab: Tab) {
    harness.state_mut().open.tab = tab;
    harness.run_steps(3);
}

#[test]
fn every_page_shows_what_it_is_for() {
    let mut harness = open("three-spheres");
    for (tab, label) in [
        (Tab::Render, "Tone mapper"),
        (Tab::Objects, "Add model…"),
        (Tab::Lights, "Add spot light"),
        (Tab::Sky, "Environment map from a file…"),
        (Tab::Camera, "Depth of field"),
        (Tab::Speed, "Triangles"),
        (Tab::Image, "Move the pointer over the picture."),
        (Tab::File, "Reload when the file changes"),
    ] {
        page(&mut harness, tab);
        assert!(harness.query_all_by_label(label).next().is_some(), "{tab:?} has no {label:?}");
    }
}

#[test]
fn objects_are_selected_changed_and_brought_back() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Objects);
    let name = harness.state().document.as_ref().expect("open").scene().instances[0].name.clone();
    click(&mut harness, &name);
    let selection = harness.state().selection.expect("selected");
    assert_eq!(selection.object, 0);
    let visible =
        |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().instances[0].visible;
    click(&mut harness, "Hide / show");
    assert!(!visible(&harness));
    let ctx = harness.ctx.clone();
    harness.state_mut().run(Command::Undo, &ctx);
    assert!(visible(&harness));
    click(&mut harness, "Thin-walled");
    let material = |h: &Harness<'_, Viewer>| {
        h.state().document.as_ref().expect("open").scene().materials[selection.material as usize].clone()
    };
    assert!(material(&harness).thin_walled);
    click(&mut harness, "Reset material");
    assert!(!material(&harness).thin_walled);
    let count = |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().materials.len();
    let before = count(&harness);
    click(&mut harness, "Make unique");
    assert_eq!(count(&harness), before + 1);
    click(&mut harness, "Delete");
    assert!(harness.state().selection.is_none() && !visible(&harness));
    assert!(harness.query_by_label(&name).is_none(), "what was deleted is not listed");
}

#[test]
fn lights_come_and_go() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Lights);
    let count = |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().lights.len();
    let before = count(&harness);
    click(&mut harness, "Add directional light");
    assert_eq!(count(&harness), before + 1);
    click(&mut harness, "Remove");
    assert_eq!(count(&harness), before);
    click(&mut harness, "Reset lights");
    assert!(harness.state().document.as_ref().expect("open").edits().lights.is_none());
}

#[test]
fn what_is_set_is_rendered() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Render);
    click(&mut harness, "Strict glTF BRDF (single scattering)");
    assert!(harness.state().render.single_scatter);
    let wanted = harness.state().job();
    until(&mut harness, "the new picture", |v| v.shot().is_some_and(|s| *s.job == wanted));
    click(&mut harness, "False colour");
    assert!(harness.state().shown.false_colour.is_some());
    harness.state_mut().shown.tone.mapper = ToneMapper::Aces;
    click(&mut harness, "Reset display");
    assert_ne!(harness.state().shown.tone.mapper, ToneMapper::Aces);
    page(&mut harness, Tab::Image);
    click(&mut harness, "Two settings");
    assert!(harness.state().comparison.split().is_some());
}

#[test]
fn cameras_have_every_projection_and_its_number() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Camera);
    for projection in alhazen::Projection::NAMED.into_iter().skip(1) {
        let before = harness.state().camera.projection.name();
        harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Projection").click();
        harness.run_steps(3);
        harness.get_by_role_and_label(egui::accesskit::Role::Button, projection.name()).click();
        harness.run_steps(3);
        let now = harness.state().camera.projection;
        assert_eq!(now.name(), projection.name(), "after {before}");
        assert_eq!(
            harness.query_all_by_label("Field of view (°)").next().is_some(),
            projection.parameter().is_some_and(|(parameter, _)| parameter.label == "Field of view"),
            "{projection}"
        );
    }
}

#[test]
fn errors_are_shown_until_they_are_dismissed() {
    let mut harness = open("cornell");
    let before = harness.state().generation();
    harness.state_mut().open_source(Source::parse("no/such/file.obj"));
    until(&mut harness, "an error", |v| v.notices.iter().any(|n| n.is_error));
    harness.run_steps(3);
    assert_eq!(harness.state().generation(), before, "nothing else changes");
    click(&mut harness, "Dismiss");
    assert!(!harness.state().notices.iter().any(|n| n.is_error));
}

/// A scene with a picture beside its folder.
fn write_scene_with_a_picture_elsewhere(folder: &Path) -> String {
    let scene = folder.join("scene");
    std::fs::create_dir_all(&scene).expect("a folder");
    let picture = alhazen::Image::from_fn(2, 2, |_, _| [1.0, 0.0, 0.0]);
    picture.write_png_encoded(&folder.join("red.png")).expect("a picture");
    let text = "[[shape]]\nkind = \"quad\"\nmaterial = { base-color-texture = \"../red.png\" }\n";
    let file = scene.join("scene.toml");
    std::fs::write(&file, text).expect("a scene");
    file.to_string_lossy().into_owned()
}

/// Whether the loader says that it left out the picture.
fn misses_the_picture(viewer: &Viewer) -> bool {
    let report = viewer.document.as_ref().map(|d| &d.report);
    report.is_some_and(|report| report.notes.iter().any(|note| note.message.contains("red.png")))
}

#[test]
fn files_elsewhere_are_read_only_if_the_user_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = write_scene_with_a_picture_elsewhere(folder.path());
    let mut harness = open(&scene);
    until(&mut harness, "a question", |v| v.elsewhere.is_some());
    harness.run_steps(3);
    assert!(misses_the_picture(harness.state()), "it was read before anybody was asked");
    click(&mut harness, "Leave them out");
    harness.state_mut().reload();
    until(&mut harness, "the scene", |v| v.generation() == 2);
    harness.run_steps(3);
    assert!(harness.state().elsewhere.is_none(), "nobody is asked twice");

    let mut harness = open(&scene);
    until(&mut harness, "a question", |v| v.elsewhere.is_some());
    harness.run_steps(3);
    click(&mut harness, "Allow these folders");
    until(&mut harness, "the scene", |v| v.generation() == 2);
    assert!(!misses_the_picture(harness.state()));
    assert!(harness.state().elsewhere.is_none());
}

/// A file with a triangle that moves by 4 m to the right within two seconds.
fn write_moving(folder: &Path) -> String {
    let numbers: [f32; 17] = [
        -1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0, // corners
        0.0, 2.0, // times
        0.0, 0.0, 0.0, 4.0, 0.0, 0.0, // translations
    ];
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    std::fs::write(folder.join("moving.bin"), bytes).expect("written");
    let json = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": 68, "uri": "moving.bin"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 8}, {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
        "animations": [{"name": "Slide", "samplers": [{"input": 1, "output": 2}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}]}"#;
    let path = folder.join("moving.gltf");
    std::fs::write(&path, json).expect("written");
    path.display().to_string()
}

/// The picture of a scene that `alhazen render --at` would make of what the viewer shows.
fn rendered_at(viewer: &Viewer, file: &str, seconds: Option<f32>) -> alhazen::Image {
    let mut scene: Scene =
        Source::parse(file).load(&LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
    alhazen::add_daylight_if_dark(&mut scene, &mut alhazen::LoadReport::default(), None);
    seconds.into_iter().for_each(|time| scene.set_time(time));
    let mut renderer = Renderer::cpu(None).expect("threads");
    renderer.load(&scene).expect("loads");
    let spp = viewer.shot().expect("a picture").spp;
    let limits = Limits { spp, ..Limits::default() };
    renderer.render(&viewer.job(), &limits, &Control::new()).expect("renders");
    layer_image(renderer.film().expect("a film").expect("rendered"), Layer::Picture)
}

/// Waits for the picture of the clock's moment and compares it with that of the command line.
fn shows(harness: &mut Harness<'_, Viewer>, file: &str, what: &str) -> alhazen::Image {
    until(harness, what, |v| v.is_current() && v.shot().is_some_and(|s| !s.preview && s.spp >= v.render.spp));
    let viewer = harness.state();
    let shown = viewer.shot().expect("done").linear.as_ref().clone();
    let expected = rendered_at(viewer, file, viewer.clock.moment().time);
    let worst = shown.data().iter().zip(expected.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // Structures that were refitted may round differently.
    assert!(worst < 1e-4, "{what}: {worst} away from what the command line renders");
    shown
}

#[test]
fn time_is_played_stepped_and_taken_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = write_moving(folder.path());
    let mut harness = open(&file);
    harness.state_mut().shown.denoiser = None;
    // Another seed: what was begun may have more samples.
    (harness.state_mut().render.spp, harness.state_mut().render.seed) = (4, 1);
    let rest = shows(&mut harness, &file, "at rest");
    click(&mut harness, "Next frame");
    assert_eq!(harness.state().clock.frame(), 1);
    shows(&mut harness, &file, "frame 1");
    harness.state_mut().clock.seek(30);
    let later = shows(&mut harness, &file, "frame 30");
    assert!(later.data() != rest.data(), "nothing has moved");
    click(&mut harness, "Play");
    let before = harness.state().shots_seen();
    until(&mut harness, "pictures while time passes", |v| {
        v.clock.frame() > 31 && v.shots_seen() > before + 3
    });
    click(&mut harness, "Pause");
    assert!(!harness.state().clock.playing);
    shows(&mut harness, &file, "where it was stopped");
    assert!(harness.state().command_line().contains("--at "), "{}", harness.state().command_line());
    click(&mut harness, "Rest pose");
    let again = shows(&mut harness, &file, "at rest again");
    assert!(again.data() == rest.data(), "the scene at rest has changed");
}

#[test]
fn edits_survive_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = open(&write_moving(folder.path()));
    harness.state_mut().edit("hide", |edits| edits.object(0).visible = Some(false));
    harness.state_mut().clock.seek(12);
    until(&mut harness, "frame 12", Viewer::is_current);
    let instance =
        |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().instances[0].clone();
    assert!(!instance(&harness).visible);
    assert_eq!(instance(&harness).transform.translation.x, 1.0);
    let ctx = harness.ctx.clone();
    harness.state_mut().run(Command::Undo, &ctx);
    assert!(instance(&harness).visible && instance(&harness).transform.translation.x == 1.0);
}

#[test]
fn skins_follow_the_clock() {
    let Some(shared) = testkit::require_shared("skins_follow_the_clock") else { return };
    let file = shared.join("scenes/khr_SimpleSkin/SimpleSkin.gltf").display().to_string();
    let mut harness = open(&file);
    harness.state_mut().shown.denoiser = None;
    (harness.state_mut().render.spp, harness.state_mut().render.seed) = (2, 1);
    let rest = shows(&mut harness, &file, "at rest");
    harness.state_mut().clock.seek(36);
    let bent = shows(&mut harness, &file, "frame 36");
    assert!(bent.data() != rest.data(), "the skin does not bend");
    let ctx = harness.ctx.clone();
    harness.state_mut().run(Command::Rest, &ctx);
    assert!(shows(&mut harness, &file, "at rest again").data() == rest.data());
}

#[test]
fn noise_ends_pictures_and_is_taken_out_of_them() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Render);
    click(&mut harness, "Adaptive sampling");
    click(&mut harness, "Noise limit");
    let viewer = harness.state_mut();
    (viewer.render.noise, viewer.render.spp) = (Some(0.2), 100_000);
    viewer.shown.denoiser = Some(alhazen::Denoiser::Network);
    // Not one from before these settings, whose samples are spread evenly.
    until(&mut harness, "a picture of little noise", |v| {
        v.shot().is_some_and(|s| {
            let is_quiet = s.pass.noise.is_some_and(|n| n <= 0.2);
            let is_adaptive = s.counts.iter().min() < s.counts.iter().max();
            s.pass.denoised_by.is_some() && is_quiet && is_adaptive
        })
    });
    let shot = harness.state().shot().expect("shown").clone();
    let noise = shot.pass.noise.expect("measured");
    assert!(noise <= 0.2 && shot.spp < 100_000, "{noise} after {} spp", shot.spp);
    let least = shot.counts.iter().min().expect("pixels");
    assert!(*least >= 16, "some pixels have {least} samples only");
    assert!(
        harness.state().command_line().ends_with("--noise 0.2 --denoise"),
        "{}",
        harness.state().command_line()
    );
    harness.state_mut().shown.denoiser = None;
    until(&mut harness, "the noise", |v| {
        v.is_current() && v.shot().is_some_and(|s| s.pass.denoised_by.is_none())
    });
}

#[test]
fn frames_of_a_rasteriser_need_one() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Render);
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Integrator").click();
    harness.run_steps(3);
    let offers = |h: &Harness<'_, Viewer>, name: &str| h.query_all_by_label(name).next().is_some();
    assert!(offers(&harness, "direct") && !offers(&harness, "hybrid"));
    // The name of what renders is all that the panel asks for.
    harness.state_mut().backend.name = "gpu-query".into();
    harness.run_steps(3);
    click(&mut harness, "hybrid");
    assert_eq!(harness.state().render.integrators.chosen().name(), "hybrid");
    click(&mut harness, "Rasterised first hits");
    let alhazen::Integrator::Hybrid(settings) = harness.state().job().integrator else { panic!("hybrid") };
    assert_eq!(settings.visibility, alhazen::Visibility::Rays);
}

#[test]
fn what_frames_are_made_of_and_what_they_show_is_set() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Render);
    // The name of what renders is all that the panel asks for; the CPU goes on with paths.
    harness.state_mut().backend.name = "gpu-bvh".into();
    harness.run_steps(3);
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Integrator").click();
    harness.run_steps(3);
    click(&mut harness, "realtime");
    assert!(harness.query_by_label("Adaptive sampling").is_none(), "frames choose by themselves");
    click(&mut harness, "Adaptive frames");
    click(&mut harness, "Time budget");
    click(&mut harness, "Spatial filter");
    click(&mut harness, "Rasterised first hits");
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Displayed buffer").click();
    harness.run_steps(3);
    click(&mut harness, "blurred-noise");
    let alhazen::Integrator::Realtime(settings) = harness.state().job().integrator else {
        panic!("realtime")
    };
    assert_eq!(settings.samples, alhazen::FrameSamples::ADAPTIVE);
    assert_eq!(settings.budget, Some(Duration::from_millis(8)));
    assert!(!settings.filter && settings.visibility == alhazen::Visibility::Rays);
    assert_eq!(settings.show, alhazen::FrameView::BlurredNoise);
    let line = harness.state().command_line();
    assert!(line.contains("--budget 8ms --no-filter --show blurred-noise"), "{line}");
    click(&mut harness, "Adaptive frames");
    let alhazen::Integrator::Realtime(settings) = harness.state().job().integrator else {
        panic!("realtime")
    };
    assert!(settings.samples.is_fixed() && settings.budget.is_none(), "{settings:?}");
    let wanted = harness.state().job();
    until(&mut harness, "paths on the CPU", |v| v.shot().is_some_and(|s| *s.job == wanted && s.spp > 1));
}

/// The graph of a texture of the open scene.
fn graph_of(harness: &Harness<'_, Viewer>, id: u32) -> alhazen::TextureGraph {
    let scene = harness.state().document.as_ref().expect("open").scene();
    viewer::node_previews::graph_of(scene, id).expect("a graph").clone()
}

/// Selects an object by its name and returns the texture of its base colour.
fn select_textured(harness: &mut Harness<'_, Viewer>, name: &str) -> u32 {
    page(harness, Tab::Objects);
    click(harness, name);
    let viewer = harness.state();
    let material = viewer.selection.expect("selected").material as usize;
    let scene = viewer.document.as_ref().expect("open").scene();
    scene.materials[material].base_color_texture.expect("a texture").texture
}

#[test]
fn nodes_of_textures_are_shown_changed_and_brought_back() {
    let mut harness = open("textures");
    let id = select_textured(&mut harness, "floor");
    let before = graph_of(&harness, id);
    assert!(harness.query_by_label("Base colour: checkerboard").is_some());
    assert!(harness.query_all_by_label("Preview of node 0").next().is_some());
    let wanted = harness.state().job();
    until(&mut harness, "the picture", |v| v.shot().is_some_and(|s| *s.job == wanted && s.spp >= 1));
    let seen = harness.state().shots_seen();
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "cells").click();
    harness.run_steps(3);
    click(&mut harness, "cubes");
    let after = graph_of(&harness, id);
    assert_eq!((before.nodes[0].parameters[0], after.nodes[0].parameters[0]), (0.0, 1.0));
    let edits = harness.state().document.as_ref().expect("open").edits().clone();
    assert_eq!(edits.textures.keys().copied().collect::<Vec<_>>(), [id]);
    until(&mut harness, "a picture of it", |v| v.shots_seen() > seen && v.is_current());

    let ctx = harness.ctx.clone();
    harness.state_mut().run(Command::Undo, &ctx);
    assert_eq!(graph_of(&harness, id), before);
    harness.state_mut().run(Command::Redo, &ctx);
    assert_eq!(graph_of(&harness, id), after);
    harness.run_steps(2);
    click(&mut harness, "Reset texture");
    assert_eq!(graph_of(&harness, id), before);
    assert!(harness.query_by_label("Reset texture").is_none());
}

/// A drag over several frames is one step.
#[test]
fn sliders_of_nodes_are_dragged_in_one_step() {
    let mut harness = open("textures");
    select_textured(&mut harness, "floor");
    let textures =
        |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().textures.clone();
    let before = textures(&harness);
    let slider = harness.get_by_role_and_label(egui::accesskit::Role::Slider, "octaves").rect();
    let at = |share: f32| egui::pos2(slider.left() + share * slider.width(), slider.center().y);
    harness.drag_at(at(0.2));
    harness.run_steps(2);
    let mut seen = Vec::new();
    for share in [0.3, 0.5, 0.7] {
        harness.hover_at(at(share));
        harness.run_steps(2);
        seen.push(textures(&harness));
    }
    harness.drop_at(at(0.7));
    harness.run_steps(2);
    assert!(seen[0] != before && seen[1] != seen[0] && seen[2] != seen[1], "it does not follow the pointer");
    let ctx = harness.ctx.clone();
    harness.state_mut().run(Command::Undo, &ctx);
    assert!(textures(&harness) == before, "a drag is several steps");
    assert!(!harness.state().document.as_ref().expect("open").can_undo_redo().0);
}

#[test]
fn images_of_materials_have_name_and_size() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = alhazen::Image::from_fn(70, 30, |_, _| [1.0, 0.0, 0.0]);
    picture.write_png_encoded(&folder.path().join("red.png")).expect("a picture");
    let text =
        "[[shape]]\nname = \"plate\"\nkind = \"quad\"\nmaterial = { base-color-texture = \"red.png\" }\n";
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, text).expect("a scene");
    let mut harness = open(&file.to_string_lossy());
    page(&mut harness, Tab::Objects);
    click(&mut harness, "plate");
    assert!(harness.query_by_label_contains("Base colour: ").is_some());
    assert!(harness.query_by_label_contains("70 × 30 pixels").is_some());
}
