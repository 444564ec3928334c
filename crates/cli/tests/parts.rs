//! `alhazen render` in parts and in several sittings, and `alhazen merge`: the same bits as in one go.

mod common;

use common::{fail, names, run, succeed};
use film::ExrFile;
use std::path::Path;

const PICTURE: &str = "render cornell -q --width 33 --height 21 --spp 12 --seed 5 --backend cpu \
                       --aov depth,normal,instance,samples,standard-error";

/// An EXR file without what no two runs have in common.
fn read(folder: &Path, name: &str) -> ExrFile {
    let mut file = ExrFile::read(&folder.join(name)).unwrap();
    assert!(file.metadata.remove("render_seconds").is_some(), "{name}");
    file
}

#[test]
fn tiles_and_ranges_of_samples_merge_to_the_whole_picture() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, &format!("{PICTURE} -o whole.exr -o whole.png"));
    for (i, tile) in ["1/3", "2/3", "3/3"].iter().enumerate() {
        for (j, range) in ["0..5", "5..6", "6..12"].iter().enumerate() {
            succeed(folder, &format!("{PICTURE} --tile {tile} --sample-range {range} -o part-{i}{j}.exr"));
        }
    }
    let parts =
        "part-21.exr part-00.exr part-12.exr part-02.exr part-20.exr part-11.exr part-22.exr part-10.exr";
    let incomplete = "the picture is not complete (see --allow-missing): there are no samples 5..6 of the";
    fail(folder, &format!("merge {parts} -o missing.exr"), incomplete);
    let ran = succeed(folder, &format!("merge {parts} -o missing.exr --allow-missing"));
    assert!(ran.stderr.contains("warning: the picture is not complete"), "{}", ran.stderr);
    assert_eq!(read(folder, "missing.exr").metadata["spp"], "11");

    succeed(folder, &format!("merge {parts} part-01.exr -o merged.exr -o merged.png"));
    assert!(read(folder, "merged.exr") == read(folder, "whole.exr"));
    assert_eq!(read(folder, "merged.exr").metadata["spp"], "12");
    assert!(read(folder, "merged.exr").camera.is_some());
    let bytes = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(bytes("merged.png") == bytes("whole.png"));

    // In two steps.
    succeed(folder, &format!("merge {parts} --part -o most.exr"));
    succeed(folder, "merge part-01.exr most.exr -o again.exr");
    assert!(read(folder, "again.exr") == read(folder, "whole.exr"));
    // With other display settings.
    succeed(folder, "merge part-01.exr most.exr --exposure 0.5 -o dark.png");
    assert!(bytes("dark.png") != bytes("whole.png"));
}

#[test]
fn parts_that_do_not_go_together_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, &format!("{PICTURE} --tile 1/2 -o one.exr"));
    let others = [
        ("seed.exr", "--seed 6", "seed is `5` in the one and `6` in the other"),
        ("depth.exr", "--max-depth 3", "integrator is `Path"),
        ("camera.exr", "--eye 1,1,3", "camera is `CameraFrame"),
        ("size.exr", "--height 22", "size is `33×21"),
        ("layers.exr", "--aov depth", "the list of layers is"),
        ("light.exr", "--environment 1,1,1", "scene is `"),
        ("sampler.exr", "--sampler independent", "sampler is `Sobol`"),
        ("show.exr", "--exposure 0.7", "tone mapping is `"),
        ("crop.exr", "--crop 0,0,33,20", "size is `33×21 at (0, 0) of 33×21`"),
    ];
    for (name, change, difference) in others {
        let flag = change.split(' ').next().unwrap();
        // The last of two values does not count here: an argument may be given once.
        let words: Vec<&str> = PICTURE.split_whitespace().collect();
        let at = words.iter().position(|w| *w == flag);
        let kept = words.iter().enumerate().filter(|(i, _)| at.is_none_or(|at| *i != at && *i != at + 1));
        let base = kept.map(|(_, w)| *w).collect::<Vec<_>>().join(" ");
        succeed(folder, &format!("{base} {change} --tile 2/2 -o {name}"));
        let ran = fail(folder, &format!("merge one.exr {name} -o out.png"), difference);
        let both = format!("one.exr and {name} do not belong together");
        assert!(ran.stderr.contains(&both), "{}", ran.stderr);
    }
    succeed(folder, &format!("{PICTURE} --sample-range 11..12 -o last.exr"));
    fail(folder, "merge one.exr last.exr -o out.png", "one.exr and last.exr both have samples 11..12 of the");
    fail(folder, "merge one.exr one.exr -o out.png", "one.exr and one.exr both have samples 0..12 of the");

    succeed(folder, &format!("{PICTURE} -o whole.exr"));
    fail(
        folder,
        "merge one.exr whole.exr -o out.png",
        "whole.exr: this is a finished picture, not a part of one",
    );
    fail(folder, "merge one.exr missing.exr -o out.png", "missing.exr");
    let bytes = std::fs::read(folder.join("last.exr")).unwrap();
    for (name, cut) in [("cut.exr", bytes.len() * 2 / 3), ("cut.exr", bytes.len() - 1), ("cut.exr", 0)] {
        std::fs::write(folder.join(name), &bytes[..cut]).unwrap();
        fail(folder, "merge one.exr cut.exr -o out.png", "cut.exr");
    }
    let mut broken = bytes;
    let middle = broken.len() * 3 / 4;
    broken[middle] ^= 4;
    std::fs::write(folder.join("broken.exr"), broken).unwrap();
    fail(folder, "merge one.exr broken.exr -o out.png", "broken.exr");
}

#[test]
fn impossible_splits_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("there.exr"), "precious").unwrap();
    let cases = [
        ("--tile 0/4 -o a.exr", "is no tile"),
        ("--tile 1/9999 -o a.exr", "cannot be cut into 9999 tiles"),
        ("--sample-range 8..13 -o a.exr", "samples 8..13 are not among the picture's 0..12"),
        ("--sample-range 8..8 -o a.exr", "has no samples"),
        ("--tile 1/2 -o a.png", "a.png cannot hold a part"),
        ("--part", "render.png cannot hold a part"),
        ("--tile 1/2 --noise 0.1 -o a.exr", "--noise"),
        ("--checkpoint a.exr --time 3s -o a.exr", "--time"),
        ("--checkpoint a.exr -o a.exr", "both the checkpoint and an output"),
        ("--checkpoint there.exr -o a.exr", "there already"),
        ("--checkpoint there.exr --resume -o a.exr", "there.exr"),
        ("--checkpoint nowhere/c.exr -o a.exr", "there is no folder nowhere"),
        ("--resume -o a.exr", "--checkpoint"),
    ];
    for (arguments, reason) in cases {
        fail(folder, &format!("{PICTURE} {arguments}"), reason);
    }
    fail(folder, "merge there.exr -o a.exr", "there.exr");
    fail(folder, "merge there.exr --part -o a.png", "a.png cannot hold a part");
    fail(folder, "merge -o a.png", "PART");
}

#[test]
fn a_checkpoint_can_be_refined_with_more_samples() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let with = |spp: &str| PICTURE.replace("--spp 12", spp);
    succeed(folder, &format!("{} -o whole.exr", with("--spp 20")));
    for spp in ["--spp 3", "--spp 20"] {
        succeed(folder, &format!("{} --checkpoint c.exr --resume -o {}.exr", with(spp), &spp[6..]));
    }
    assert!(read(folder, "20.exr") == read(folder, "whole.exr"));
    assert_eq!(read(folder, "3.exr").metadata["spp"], "3");
    let foreign = format!("{} --checkpoint c.exr --resume -o x.exr", PICTURE.replace("--seed 5", "--seed 8"));
    fail(folder, &foreign, "and c.exr do not belong together: seed is `8` in the one and `5` in the other");
}

#[test]
fn single_frames_are_the_frames_of_the_sequence() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let picture = "render three-spheres -q --width 16 --height 12 --spp 2 --fps 2 --aov samples";
    succeed(folder, &format!("{picture} --frames 0..3 -o all-##.exr"));
    succeed(folder, &format!("{picture} --frames 2 --tile 1/2 -o a.exr"));
    succeed(folder, &format!("{picture} --frames 2 --tile 2/2 -o b.exr"));
    succeed(folder, &format!("{picture} --frames 1 --tile 2/2 -o c.exr"));
    let expected = ["a.0002.exr", "all-00.exr", "all-01.exr", "all-02.exr", "b.0002.exr", "c.0001.exr"];
    assert_eq!(names(folder), expected);
    succeed(folder, "merge a.0002.exr b.0002.exr -o merged.exr");
    assert!(read(folder, "merged.exr") == read(folder, "all-02.exr"));
    fail(folder, "merge a.0002.exr c.0001.exr -o no.exr", "do not belong together");
    // A camera that stands still does not make the second frame from the samples of the first.
    succeed(
        folder,
        "render cornell -q --width 8 --height 8 --spp 2 --frames 0..2 --aov samples -o still.exr",
    );
    assert!(read(folder, "still.0000.exr") == read(folder, "still.0001.exr"));
}

#[cfg(unix)]
mod interrupted {
    use super::*;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    fn start(folder: &Path, arguments: &str) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_alhazen"));
        command.args(arguments.split_whitespace()).current_dir(folder).stderr(Stdio::null());
        command.spawn().unwrap()
    }

    fn signal(child: &Child, name: &str) {
        assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
    }

    /// Waits until the checkpoint has been replaced, or the process has ended.
    fn wait_for_checkpoint(child: &mut Child, path: &Path, before: Option<std::time::SystemTime>) -> bool {
        let modified = || std::fs::metadata(path).and_then(|m| m.modified()).ok();
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(60) {
            if child.try_wait().unwrap().is_some() {
                return false;
            }
            if modified().is_some() && modified() != before {
                return true;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        panic!("no checkpoint was written");
    }

    #[test]
    fn killed_again_and_again_it_ends_with_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let picture = "render cornell -q --width 64 --height 64 --spp 1500 --backend cpu --aov normal";
        succeed(folder, &format!("{picture} -o whole.exr"));
        let sitting = format!("{picture} --checkpoint c.exr --every 0.1s --resume -o resumed.exr");
        let checkpoint = folder.join("c.exr");
        let (mut kills, mut least) = (0, 0);
        loop {
            let before = std::fs::metadata(&checkpoint).and_then(|m| m.modified()).ok();
            let mut child = start(folder, &sitting);
            if !wait_for_checkpoint(&mut child, &checkpoint, before) {
                assert!(child.wait().unwrap().success());
                break;
            }
            // At another moment of writing and rendering each time.
            std::thread::sleep(Duration::from_millis(7 * kills));
            signal(&child, "-KILL");
            child.wait().unwrap();
            kills += 1;
            // The file can be read whenever it happens, and nothing of it is lost the next time.
            let part = alhazen::Part::read(&checkpoint).unwrap();
            let samples = part.film().total_samples();
            assert!(samples >= least, "{samples} samples after {kills} kills, {least} before");
            least = samples;
            if kills == 12 {
                succeed(folder, &sitting);
                break;
            }
        }
        assert!(kills > 1, "the render was over before it could be killed");
        assert!(read(folder, "resumed.exr") == read(folder, "whole.exr"), "after {kills} kills");
        assert_eq!(names(folder), ["c.exr", "resumed.exr", "whole.exr"], "temporary files are left");
    }

    #[test]
    fn an_interrupt_saves_what_there_is() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        // Slow enough to be interrupted, and then finished with what there is.
        let picture =
            |spp: u32| format!("render cornell -q --width 64 --height 64 --spp {spp} --backend cpu");
        let child = start(folder, &format!("{} --checkpoint c.exr -o a.exr", picture(1_000_000)));
        std::thread::sleep(Duration::from_millis(1500));
        signal(&child, "-INT");
        let mut child = child;
        assert_eq!(child.wait().unwrap().code(), Some(130));
        let part = alhazen::Part::read(&folder.join("c.exr")).unwrap();
        let most = part.film().pixels().iter().map(|p| p.count()).max().unwrap() as u32;
        assert!(most > 0 && !part.missing().is_empty());
        succeed(folder, &format!("{} --checkpoint c.exr --resume -o a.exr", picture(most)));
        succeed(folder, &format!("{} -o whole.exr", picture(most)));
        assert!(read(folder, "a.exr") == read(folder, "whole.exr"), "{most} samples");
    }

    #[test]
    fn sequences_go_on_in_the_frame_where_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let picture =
            "render three-spheres -q --width 48 --height 36 --spp 300 --fps 4 --backend cpu --frames 0..4";
        succeed(folder, &format!("{picture} -o whole.exr"));
        let sitting = format!("{picture} --checkpoint c.exr --every 0.05s --resume -o seq.exr");
        let mut child = start(folder, &sitting);
        let begin = Instant::now();
        while !folder.join("seq.0001.exr").exists() && begin.elapsed() < Duration::from_secs(120) {
            std::thread::sleep(Duration::from_millis(2));
        }
        signal(&child, "-KILL");
        child.wait().unwrap();
        let saved = alhazen::Part::read(&folder.join("c.exr")).unwrap();
        assert!(["1", "2", "3"].contains(&&*saved.identity["frame"]), "{:?}", saved.identity);
        std::fs::remove_file(folder.join("seq.0000.exr")).unwrap();
        succeed(folder, &sitting);
        assert!(!folder.join("seq.0000.exr").exists(), "a finished frame was rendered again");
        for frame in 1..4 {
            let pair = ["seq", "whole"].map(|n| read(folder, &format!("{n}.000{frame}.exr")));
            assert!(pair[0] == pair[1], "frame {frame}");
        }
        let ran = run(folder, &sitting.replace("--frames 0..4", ""));
        assert!(ran.stderr.contains("do not belong together"), "{}", ran.stderr);
        fail(folder, &sitting.replace("0..4", "7..9"), "the checkpoint is of frame 3, not of 7..9");
    }
}
