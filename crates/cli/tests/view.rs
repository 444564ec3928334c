//! The window, driven by scripts on a display without a screen (Xvfb). Windows are drawn by whatever Vulkan driver there is.

mod common;

use alhazen::{Image, metrics};
use common::Ran;
use common::display::Display;
use std::path::Path;
use std::process::Command;
use std::sync::Mutex;

/// One window at a time: they share two cores.
static TURN: Mutex<()> = Mutex::new(());

impl Display {
    /// Runs a script; it must succeed.
    fn view(&self, folder: &Path, arguments: &str, script: &str) -> Ran {
        let ran = self.try_view(folder, arguments, script);
        assert_eq!(ran.code, Some(0), "{arguments}\n{script}\n{}\n{}", ran.stdout, ran.stderr);
        ran
    }

    fn try_view(&self, folder: &Path, arguments: &str, script: &str) -> Ran {
        std::fs::write(folder.join("script.txt"), script).expect("written");
        let mut command = Command::new(env!("CARGO_BIN_EXE_alhazen"));
        command.arg("view").args(arguments.split_whitespace());
        command.args(["--smoke", "3", "--smoke-script", "script.txt", "--window", "900x640"]);
        command.env("DISPLAY", &self.name).env_remove("WAYLAND_DISPLAY").current_dir(folder);
        // No dialog of a desktop: nobody would answer it.
        command.env("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nonexistent").env("PATH", "");
        let output = command.output().expect("the binary can be run");
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        let ran =
            Ran { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) };
        assert!(!ran.stderr.contains("panicked"), "{arguments}\n{script}\n{}", ran.stderr);
        ran
    }
}

fn open(path: &Path) -> Image {
    Image::open(path).unwrap_or_else(|e| panic!("{e}"))
}

/// Whether two pictures have the same mean in each of 4 × 4 blocks, within `tolerance` of linear display values. One of them
/// is enlarged, so edges at the borders of blocks differ.
fn assert_alike(a: &Image, b: &Image, tolerance: f32, what: &str) {
    let block = |image: &Image, bx: u32, by: u32| {
        let (w, h) = (image.width() / 4, image.height() / 4);
        let part = image.crop(bx * w, by * h, w, h);
        let mean = part.to_rgb().mean();
        [mean[0] as f32, mean[1] as f32, mean[2] as f32]
    };
    for (bx, by) in (0..16).map(|i| (i % 4, i / 4)) {
        let (x, y) = (block(a, bx, by), block(b, bx, by));
        let far = (0..3).any(|c| (x[c] - y[c]).abs() > tolerance);
        assert!(!far, "{what}: block {bx}, {by} is {x:?} and {y:?}");
    }
}

/// The picture's part of a screenshot, as the report says where it is.
fn picture_of(screenshot: &Path, report: &str) -> Image {
    let line =
        report.lines().rev().find_map(|l| l.strip_prefix("picture at ")).expect("the report says where");
    let n: Vec<u32> = line.split_whitespace().map(|w| w.parse().expect("a number")).collect();
    open(screenshot).crop(n[0], n[1], n[2], n[3])
}

#[test]
fn the_comparison_of_screenshots_notices_a_difference() {
    let grey = |v: f32| Image::from_fn(64, 64, move |_, _| [v; 3]);
    assert_alike(&grey(0.5), &grey(0.505), 0.01, "alike");
    let mut other = grey(0.5);
    (0..64 * 3).for_each(|i| other.data_mut()[i] = 0.9);
    let result = std::panic::catch_unwind(|| assert_alike(&grey(0.5), &other, 0.01, "one row of a block"));
    assert!(result.is_err());
}

#[test]
fn every_built_in_scene_is_shown_as_it_is_rendered() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("every_built_in_scene_is_shown_as_it_is_rendered") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let names: Vec<_> = alhazen::builtin::list().into_iter().map(|b| b.name).collect();
    let mut script = "denoise off\nspp 4\n".to_owned();
    for name in &names {
        script +=
            &format!("open {name}\nspp 4\nwait 4\nframes 2\npicture {name}.exr\nscreenshot {name}.png\n");
    }
    let ran = display.view(folder.path(), "cornell --backend cpu --width 160 --height 120", &script);
    for name in &names {
        let path = |ending: &str| folder.path().join(format!("{name}{ending}"));
        let arguments = format!(
            "render {name} --backend cpu --width 160 --height 120 --spp 4 --quiet -o {name}.h.exr -o {name}.h.png"
        );
        common::succeed(folder.path(), &arguments);
        // The same samples: the same picture, bit for bit.
        let (ours, headless) = (open(&path(".exr")), open(&path(".h.exr")));
        assert_eq!(ours.data(), headless.data(), "{name}");
        let shown = picture_of(&path(".png"), &ran.stdout);
        assert_alike(&shown, &open(&path(".h.png")), 0.06, name);
    }
}

/// Where the desktop has no file dialog, the window asks by its own.
#[test]
fn without_a_desktop_files_are_chosen_all_the_same() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("without_a_desktop_files_are_chosen_all_the_same") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("wall.obj"), "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n")
        .expect("written");
    let script = "spp 2\nwait 2\nscreenshot before.png\ncommand Save the rendered picture (EXR)…\nframes 60\n\
                  screenshot dialog.png\nchoose saved\nframes 20\ncommand Open a scene…\nchoose wall.obj\n\
                  frames 30\nwait 2\ncommand Save the scene as…\nchoose wall.toml\nframes 3\n";
    display.view(folder.path(), "cornell --backend cpu --width 96 --height 96", script);
    let at = |name: &str| folder.path().join(name);
    assert_eq!(open(&at("saved.exr")).width(), 96);
    let scene = std::fs::read_to_string(at("wall.toml")).expect("saved");
    assert!(scene.contains("wall.obj"), "{scene}");
    let [before, dialog] = ["before.png", "dialog.png"].map(|name| open(&at(name)));
    assert!(metrics::mse(&before, &dialog).expect("the same size") > 1e-4, "no dialog is shown");
}

/// Pictures are denoised while they are rendered, and saved as they are shown.
#[test]
fn pictures_are_denoised() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("pictures_are_denoised") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = "wait 4\npicture shown.exr\ndenoise off\nwait 4\npicture noisy.exr\n";
    display.view(folder.path(), "cornell --backend cpu --width 96 --height 96 --spp 4", script);
    common::succeed(
        folder.path(),
        "render cornell --backend cpu --width 96 --height 96 --spp 4 --denoise -q -o headless.exr",
    );
    let [shown, noisy, headless] =
        ["shown", "noisy", "headless"].map(|n| open(&folder.path().join(format!("{n}.exr"))));
    assert_eq!(shown.data(), headless.data(), "not what the command line makes");
    assert!(metrics::mse(&shown, &noisy).expect("the same size") > 1e-4, "nothing has been denoised");
}

#[test]
fn edits_are_shown_saved_and_rendered_again() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("edits_are_shown_saved_and_rendered_again") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = "\
denoise off\nwait 4\npicture before.exr\nmaterial 0 red 0.1\nmaterial 0 roughness 0.9\nselect 0.5 0.5
command Add a sphere light\ncommand Duplicate the object\nwait 4\npicture after.exr\nsave edited.toml
command Undo\ncommand Undo\ncommand Undo\ncommand Undo\nwait 4\npicture undone.exr\nopen edited.toml\nwait 4\npicture opened.exr\n";
    // Not by a step of the script: by then a quick machine has rendered more samples than those.
    display.view(folder.path(), "cornell --backend cpu --width 96 --height 96 --spp 4", script);
    common::succeed(folder.path(), "render edited.toml --backend cpu --spp 4 --quiet -o headless.exr");
    let [before, after, undone, opened, headless] = ["before", "after", "undone", "opened", "headless"]
        .map(|n| open(&folder.path().join(format!("{n}.exr"))));
    assert!(metrics::mse(&before, &after).expect("the same size") > 1e-4, "the edits are seen");
    assert_eq!(before.data(), undone.data(), "undo takes them back");
    assert_eq!(after.data(), headless.data(), "what was saved renders as it was seen");
    assert_eq!(after.data(), opened.data(), "what was saved opens as it was seen");
}

/// What is selected by a rectangle is deleted together; a crop has the samples of the whole picture; the grid is seen.
#[test]
fn rectangles_select_and_crop_and_the_ground_has_a_grid() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("rectangles_select_and_crop_and_the_ground_has_a_grid") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = "\
denoise off\nwait 2\npicture whole.exr\nframes 60\nscreenshot bare.png\ncommand Show or hide the ground grid\nframes 60
screenshot grid.png\ncommand Show or hide the ground grid\narea 0 0 1 1\ncommand Delete the selection\nwait 2\npicture empty.exr
command Undo\ncrop 0.25 0.5 0.75 1\nwait 2\npicture part.exr\ncommand Reset the crop: render the whole picture\nwait 2\npicture again.exr\n";
    display.view(folder.path(), "cornell --backend cpu --width 96 --height 96 --spp 2", script);
    let [whole, empty, part, again] =
        ["whole", "empty", "part", "again"].map(|n| open(&folder.path().join(format!("{n}.exr"))));
    assert_eq!(whole.data(), again.data(), "undo and the end of the crop bring all back");
    assert!(empty.data().iter().all(|v| *v == 0.0), "something was not selected");
    for (x, y) in (0..96 * 96).map(|i| (i % 96, i / 96)) {
        let is_inside = (24..72).contains(&x) && y >= 48;
        let expected = if is_inside { whole.rgb(x, y) } else { [0.0; 3] };
        assert_eq!(part.rgb(x, y), expected, "{x} {y}");
    }
    let [bare, grid] = ["bare.png", "grid.png"].map(|n| open(&folder.path().join(n)));
    assert!(metrics::mse(&bare, &grid).expect("the same size") > 1e-6, "no grid is seen");
}

#[test]
fn files_are_opened_dropped_reloaded_and_refused() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("files_are_opened_dropped_reloaded_and_refused") else { return };
    let folder = common::folder_with_triangle();
    std::fs::write(folder.path().join("broken.glb"), "no model\n").expect("written");
    let script = "\
spp 2\nopen triangle.obj\nspp 2\nwait 2\npicture first.exr\ndrop broken.glb\nerror\nwait 2\npicture kept.exr
drop none.glb\nerror\ndrop triangle.obj\nwait 2\nreload\nwait 2\nresize 700 500\nframes 5\nwait 2
integrator direct\nwait 2\nlayer depth\nwait 2\nlayer noise\nframes 5\nlayer picture\ncompare first.png\nframes 5
screenshot last.png\nrecord turn.png 2 1\n";
    std::fs::write(folder.path().join("first.png"), []).expect("written");
    display.view(folder.path(), "triangle.obj --backend cpu --width 64 --height 48", script);
    let [first, kept] = ["first.exr", "kept.exr"].map(|n| open(&folder.path().join(n)));
    assert_eq!(first.data(), kept.data(), "a broken file changes nothing");
    assert_eq!(open(&folder.path().join("last.png")).width(), 700, "the window has another size");
    for frame in ["turn.0000.png", "turn.0001.png"] {
        assert_eq!(open(&folder.path().join(frame)).width(), 64);
    }
}

#[test]
fn back_ends_switch_while_the_window_is_open() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("back_ends_switch_while_the_window_is_open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = "\
spp 16\nwait 16\npicture cpu.exr\nbackend gpu-bvh\nwait 16\npicture gpu.exr\nbackend cpu\nframes 5\n";
    display.view(folder.path(), "cornell --backend cpu --width 48 --height 48", script);
    let means = ["cpu.exr", "gpu.exr"].map(|n| open(&folder.path().join(n)).mean());
    // The same samples from the same text: what differs is rounding, and paths that it sends elsewhere.
    let far = means[0].iter().zip(&means[1]).any(|(a, b)| (a - b).abs() > 0.01 * a.abs());
    assert!(!far, "the mean radiance is {means:?}");
}

/// On the CPU `realtime` shows what `path` shows. On a GPU it makes the frames of the command line as long as nothing moves, and
/// goes on from them when the camera does.
#[test]
fn frames_in_real_time_build_on_each_other() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("frames_in_real_time_build_on_each_other") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = "\
denoise off\nspp 8\nintegrator realtime\nwait 8\npicture cpu.exr\nbackend gpu-bvh\nwait 8\npicture still.exr
orbit 0.2\nframes 20\nwait 8\nshow history\nspp 1\nframes 5\ncommand Go to the first camera\nwait 1\npicture history.exr
filter off\nshow samples\nwait 1\nscreenshot samples.png\n";
    let ran = display.view(folder.path(), "cornell --backend cpu --width 48 --height 48", script);
    let size = "render cornell --width 48 --height 48 --quiet --spp 8";
    common::succeed(folder.path(), &format!("{size} --backend cpu --max-depth 4 -o path.exr"));
    common::succeed(
        folder.path(),
        &format!("{size} --backend gpu-bvh --integrator realtime -o headless.exr"),
    );
    let [cpu, still, history, path, headless] = ["cpu", "still", "history", "path", "headless"]
        .map(|n| open(&folder.path().join(format!("{n}.exr"))));
    assert!(cpu.data() == path.data(), "the CPU does not show paths");
    // What frames add to the film is summed in other portions, so it rounds otherwise.
    let far = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-4 * (1.0 + b.abs());
    let differ = still.data().iter().zip(headless.data()).filter(|p| far(*p)).count();
    assert_eq!(differ, 0, "values are not those of the command line");
    // Eight frames from the place before count here. Without a past there would be one, of 32.
    let known = history.mean()[0];
    assert!(known > 0.15, "the past counts for {} samples after the camera has moved", known * 32.0);
    // Numbers are shown as colours, not as light.
    let shown = picture_of(&folder.path().join("samples.png"), &ran.stdout).to_rgb().mean();
    assert!(shown[2] > shown[0] && shown[2] > shown[1], "few samples are not blue: {shown:?}");
}

#[test]
fn restarts_leave_memory_alone() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("restarts_leave_memory_alone") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let ran = display.view(
        folder.path(),
        "cornell --backend cpu --width 160 --height 120",
        "resize 320 240\nspp 1\nwait 1\nframes 30\nrestarts 500\n",
    );
    let line = ran.stdout.lines().find(|l| l.starts_with("restarts: 500")).expect("reported");
    let percent: f64 =
        line.rsplit_once(", ").and_then(|(_, p)| p.trim_end_matches(" %").parse().ok()).expect("a number");
    assert!(percent < 5.0, "{line}");
}

/// Scenes are opened, edited, recorded and thrown away. `ALHAZEN_SOAK_SECONDS=N`: for so long.
#[test]
fn hours_of_editing_leave_nothing_behind() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("hours_of_editing_leave_nothing_behind") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let seconds = std::env::var("ALHAZEN_SOAK_SECONDS").unwrap_or("20".into());
    let edits = "open cornell\nmaterial 0 roughness 0.3\nwait 1\ncommand Add a point light\nframes 5\n\
         command Undo\ncommand Redo\nselect 0.5 0.5\ncommand Duplicate the object\nwait 1\n\
         command Hide or show the selection\ncommand Delete the selection\nresize 720 520\nmaterial 1 emission 2\n\
         integrator direct\nwait 1\nintegrator path\ncommand Compare two settings\nframes 3\n\
         command End the comparison\nlayer normal\nwait 1\nlayer picture\nsave saved.toml\npicture a.exr\n\
         resize 700 500\nopen three-spheres\nmaterial 2 transmission 0.5\nwait 1\nrecord turn.png 3 1\n\
         drop missing.obj\nerror\nopen saved.toml\nwait 1\nreload\nwait 1\n";
    let ran = display.view(
        folder.path(),
        "cornell --backend cpu --width 96 --height 72",
        &format!("resize 700 500\nspp 1\n{edits}rounds {seconds}\n"),
    );
    let line = ran.stdout.lines().find(|l| l.starts_with("rounds: ")).expect("reported");
    println!("{line}");
    let number = |before: &str| -> f64 {
        let (_, rest) = line.split_once(before).expect("a number");
        rest.split([' ', ',']).next().and_then(|n| n.parse().ok()).expect("a number")
    };
    assert!(number("rounds: ") >= 6.0, "{line}");
    assert!(number(" bytes, ") < 8.0, "{line}");
    let (_, files) = line.split_once("files ").expect("files");
    let files: Vec<f64> = files.split([' ', ',']).filter_map(|word| word.parse().ok()).take(2).collect();
    assert!(files[1] <= files[0] + 2.0, "{line}");
}

#[test]
fn unattended_runs_fail_loudly() {
    let _turn = TURN.lock();
    let Some(display) = Display::open("unattended_runs_fail_loudly") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    for (script, part) in [
        ("fly\n", "no step `fly`"),
        ("screnshot a.png\n", "but `screenshot`"),
        ("material 999 red 1\n", "no such material"),
        ("tab nowhere\n", "there are Render, Objects"),
        ("open missing.obj\nwait 1\n", "missing.obj"),
    ] {
        let ran = display.try_view(
            folder.path(),
            "cornell --backend cpu --width 64 --height 48",
            &format!("wait 1\n{script}"),
        );
        assert!(ran.code != Some(0) && ran.stderr.contains(part), "{script}: {ran:?}");
    }
}

#[test]
fn without_a_display_there_is_an_error_and_no_panic() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_alhazen"));
    command.args(["view", "cornell"]).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.env_remove("WAYLAND_SOCKET").current_dir(folder.path());
    let output = command.output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && text.contains("cannot open a window"), "{text}");
    assert!(!text.contains("panicked"), "{text}");
}
