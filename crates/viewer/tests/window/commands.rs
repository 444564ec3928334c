//! No command is silent: each changes something that is seen, or says why not. There is neither a
//! portal of the desktop, nor may files be written, nor is there room for them.

use super::{open, page, until};
use egui_kittest::Harness;
use std::path::Path;
use viewer::outliner::Item::Object;
use viewer::panels::Tab;
use viewer::viewer::{COMMANDS, Command, For, Viewer};

/// All that can be seen of what a command does. Messages have their time: the same one may come
/// again.
fn seen(v: &Viewer) -> String {
    let messages: Vec<_> = v.notices.iter().map(|n| (&n.text, n.time.to_bits())).collect();
    let picture = (v.job(), v.shown, v.zoom, &v.comparison, v.tools.look, v.tools.snapshots.len());
    let tools = (v.tools.zebra, v.gizmo.tool, v.gizmo.local, v.gizmo.aims, v.paused, v.playing);
    let windows = (v.open.side, v.open.tab, v.open.overlay, v.browser.is_some(), v.full_screen, v.quit);
    let renames = v.open.outliner.renaming.is_some();
    let scene = (v.edit_count(), v.generation(), v.selection, v.loading().len(), v.clock.moment(), renames);
    format!("{messages:?} {picture:?} {tools:?} {windows:?} {scene:?} {:?}", v.recording)
}

/// Runs every command in a window that `prepare` has brought to a state.
fn run_all(prepare: impl Fn(&mut Harness<'_, Viewer>)) {
    let mut harness = open("three-spheres");
    until(&mut harness, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
    for info in COMMANDS {
        prepare(&mut harness);
        let (before, ctx) = (seen(harness.state()), harness.ctx.clone());
        harness.state_mut().run(info.command, &ctx);
        // Notices have the time of the frame.
        let at_once = seen(harness.state()) != before;
        assert!(at_once, "{:?} ({}) changes nothing and says nothing", info.command, info.name);
        harness.run_steps(1);
        let viewer = harness.state_mut();
        // What a command has opened is closed, so that the next one is alone.
        (viewer.browser, viewer.open.overlay, viewer.quit) = (None, None, false);
        viewer.notices.clear();
    }
}

#[test]
fn no_command_is_silent_where_nothing_is_selected() {
    run_all(|harness| {
        harness.state_mut().selection = None;
        harness.state_mut().open.outliner.cursor = None;
    });
}

#[test]
fn no_command_is_silent_where_an_object_is_selected() {
    run_all(|harness| harness.state_mut().choose(Object(1)));
}

/// Uses a file and waits for an error that names it.
fn refuses(harness: &mut Harness<'_, Viewer>, what: For, file: &Path) {
    harness.state_mut().notices.clear();
    harness.state_mut().use_file(what, file.to_owned());
    let name = file.display().to_string();
    until(harness, &format!("an error of {what:?}"), |v| {
        v.notices.iter().any(|n| n.is_error && n.text.contains(&name))
    });
}

#[test]
fn what_cannot_be_written_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "a file").expect("written");
    let mut harness = open("three-spheres");
    harness.state_mut().render.spp = 4;
    harness.state_mut().open.record.frames = 1;
    harness.state_mut().open.record.spp = 1;
    harness.state_mut().open.output.quality = None;
    page(&mut harness, Tab::Render);
    until(&mut harness, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
    // Nothing can be made in what is no folder, whoever asks for it.
    for (what, name) in [
        (For::Save, "scene.toml"),
        (For::Picture, "picture.exr"),
        (For::Render, "render.exr"),
        (For::Record, "frame.png"),
        (For::Statistics, "numbers.csv"),
    ] {
        let path = file.join(name);
        let told = if what == For::Record { file.join("frame.0000.png") } else { path.clone() };
        harness.state_mut().notices.clear();
        harness.state_mut().use_file(what, path);
        let name = told.display().to_string();
        until(&mut harness, &format!("an error of {what:?}"), |v| {
            v.notices.iter().any(|n| n.is_error && n.text.contains(&name))
        });
    }
    assert_eq!(std::fs::read_to_string(&file).expect("still there"), "a file");
    until(&mut harness, "the end of rendering", |v| v.recording.is_none());
    // There is no room on this device.
    if Path::new("/dev/full").exists() {
        refuses(&mut harness, For::Statistics, Path::new("/dev/full"));
    }
    for what in [For::Open, For::Model, For::Environment, For::Compare] {
        refuses(&mut harness, what, &folder.path().join("missing.exr"));
    }
    let ctx = harness.ctx.clone();
    harness.state_mut().run(Command::StopRecording, &ctx);
    assert!(harness.state().notices.iter().any(|n| n.text.contains("nothing is being rendered")));
}

/// Where the disk is full, every file that is asked for is an error that names it, and nothing of it is left. A disk of
/// 256 KiB is mounted in a namespace of this test's own; where the system allows none, that is said.
#[test]
fn a_full_disk_is_told_and_leaves_nothing() {
    if let Some(disk) = std::env::var_os("ALHAZEN_FULL_DISK") {
        return use_full_disk(Path::new(&disk));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let script = "mount -t tmpfs -o size=256k tmpfs \"$1\" || exit 77; ALHAZEN_FULL_DISK=\"$1\" exec \"$2\" --exact \
        commands::a_full_disk_is_told_and_leaves_nothing";
    let mut own = std::process::Command::new("unshare");
    own.args(["--user", "--map-root-user", "--mount", "sh", "-c", script, "sh"]);
    own.arg(folder.path()).arg(std::env::current_exe().expect("this program"));
    let Ok(ran) = own.output() else { return println!("left out: there is no `unshare` here") };
    let said = String::from_utf8_lossy(&ran.stderr);
    if ran.status.code() == Some(77) || said.starts_with("unshare:") {
        return println!("left out: the system mounts no disk for tests: {said}");
    }
    assert!(ran.status.success(), "{said}{}", String::from_utf8_lossy(&ran.stdout));
}

/// Asks for files of all kinds on a disk, after filling it.
fn use_full_disk(disk: &Path) {
    let filler = disk.join("filler");
    let mut file = std::fs::File::create(&filler).expect("there is room for a name");
    while std::io::Write::write_all(&mut file, &[1; 4096]).is_ok() {}
    let mut harness = open("three-spheres");
    harness.state_mut().render.spp = 4;
    (harness.state_mut().open.record.frames, harness.state_mut().open.record.spp) = (1, 1);
    harness.state_mut().open.output.quality = None;
    until(&mut harness, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
    for (what, name) in [
        (For::Save, "scene.toml"),
        (For::Picture, "picture.exr"),
        (For::Picture, "picture.png"),
        (For::Picture, "picture.hdr"),
        (For::Render, "render.exr"),
        (For::Record, "frame.0000.png"),
        (For::Statistics, "numbers.csv"),
        (For::Statistics, "numbers.json"),
    ] {
        harness.state_mut().notices.clear();
        let asked = if what == For::Record { "frame.png" } else { name };
        harness.state_mut().use_file(what, disk.join(asked));
        until(&mut harness, &format!("an error of {name}"), |v| {
            v.notices.iter().any(|n| n.is_error && n.text.contains(name) && n.text.contains("No space left"))
        });
        until(&mut harness, "the end of rendering", |v| v.recording.is_none());
    }
    harness.state().settings.save(&disk.join("viewer.json")).expect_err("there is no room");
    let left: Vec<_> =
        std::fs::read_dir(disk).expect("listed").filter_map(|e| Some(e.ok()?.file_name())).collect();
    assert_eq!(left, ["filler"], "something is left");
    // With room again, the same is written.
    std::fs::remove_file(&filler).expect("removed");
    drop(file);
    harness.state_mut().use_file(For::Save, disk.join("scene.toml"));
    assert!(disk.join("scene.toml").is_file(), "{:?}", harness.state().notices);
}

/// Steps of the camera and edits while a file is rendered: it is of what was seen when it was asked
/// for, with the edits.
#[test]
fn files_are_rendered_one_after_the_other_whatever_the_window_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = open("three-spheres");
    harness.state_mut().render.spp = 64;
    (harness.state_mut().open.output.quality, harness.state_mut().shown.denoiser) = (None, None);
    until(&mut harness, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
    let (first, second) = (folder.path().join("first.exr"), folder.path().join("second.exr"));
    harness.state_mut().use_file(For::Render, first.clone());
    harness.state_mut().use_file(For::Render, second.clone());
    assert_eq!(harness.state().recording.as_ref().map(|r| r.waiting), Some(1));
    // The window asks for other pictures all the time.
    for _ in 0..10 {
        harness.state_mut().steer(|camera| alhazen::navigation::dolly(camera, 0.1));
        harness.run_steps(1);
    }
    until(&mut harness, "both files", |v| v.finished == 2);
    assert!(harness.state().recording.is_none());
    let open = |path: &Path| alhazen::Image::open(path).expect("a picture");
    assert!(open(&first).data() == open(&second).data(), "the camera has moved in a file");
    until(&mut harness, "the window's own picture", Viewer::is_current);
}
