//! Nothing finished is lost, and nothing is replaced that is no output: bad names, full disks, kills, signals, closed pipes.
//!
//! `ALHAZEN_TRUST_RUNS=N` makes N times as many random kills, full disks and signals.

mod common;

use common::{TRIANGLE, fail, files, folder_with_triangle, names, run, succeed};
use film::Image;
use std::path::Path;

const SMALL: &str = "-q --width 16 --height 16 --spp 1 --backend cpu --threads 1";

/// Exit codes, as `alhazen --help` lists them.
const USAGE: i32 = 2;
const INPUT: i32 = 3;
#[cfg(target_os = "linux")]
const REFUSED: i32 = 4;
const OUTPUT: i32 = 6;
#[cfg(target_os = "linux")]
const MEMORY: i32 = 8;

#[test]
fn exit_codes_tell_what_failed() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    std::fs::write(folder.join("bad.obj"), "f 1 2 3\n").unwrap();
    std::fs::write(folder.join("bright.toml"), "[fog]\nabsorption = 1e-20\nemission = 1\n").unwrap();
    let cases = [
        (format!("render triangle.obj {SMALL} --nonsense"), USAGE),
        (format!("render triangle.obj {SMALL} -o a.tif"), USAGE),
        (format!("render triangle.obj {SMALL} --eye 1,1,1 --target 1,1,1 -o a.png"), USAGE),
        (format!("render triangle.obj {SMALL} --crop 0,0,99,9 -o a.png"), USAGE),
        (format!("render triangle.obj {SMALL} --frames 0..2 -o a.mp4 --tile 1/2"), USAGE),
        (format!("render missing.obj {SMALL} -o a.png"), INPUT),
        (format!("render bright.toml {SMALL} -o a.png"), INPUT),
        ("merge triangle.obj -o a.png".into(), INPUT),
        (format!("render triangle.obj {SMALL} -o missing/a.png"), OUTPUT),
    ];
    for (arguments, code) in cases {
        let ran = fail(folder, &arguments, "error");
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.stderr);
    }
    let help = succeed(folder, "--help").stdout;
    for code in ["2    wrong arguments", "6    an output", "130  stopped"] {
        assert!(help.contains(code), "{help}");
    }
}

#[test]
fn numbers_that_are_none_are_wrong_arguments() {
    let folder = folder_with_triangle();
    let render = [
        "--saturation",
        "--environment-rotation",
        "--environment-intensity",
        "--exposure",
        "--fov",
        "--focus",
        "--f-number",
        "--noise",
        "--fps",
        "--at",
        "--turntable",
        "--turbidity",
        "--light-cutoff",
        "--max-invalid",
        "--reflection-survival",
        "--frame-tolerance",
        "--depth-tolerance",
        "--normal-tolerance",
        "--history",
        "--history-clip",
        "--roulette-min-survival",
        "--time",
        "--every",
        "--budget",
        "--eye",
        "--target",
        "--falloff",
        "--threads",
        "--crop",
        "--width",
        "--spp",
        "--max-depth",
        "--seed",
        "--sun",
    ];
    let lidar = [
        "--heading",
        "--elevations",
        "--divergence",
        "--noise",
        "--min-intensity",
        "--range-resolution",
        "--position",
        "--range",
        "--azimuth",
        "--elevation",
        "--pose",
        "--threads",
    ];
    let render = render.map(|option| ("render triangle.obj -q -o a.png --checkpoint c.exr", option));
    let lidar = lidar.map(|option| ("sensor lidar triangle.obj -q -o a.ply", option));
    let compare = ["--exposure", "--max-flip", "--max-rel-mse"].map(|option| ("compare a.png b.png", option));
    let merge = ["--exposure", "--saturation"].map(|option| ("merge a.exr -o b.png", option));
    for (command, option) in render.into_iter().chain(lidar).chain(compare).chain(merge) {
        for value in ["nan", "inf", "-inf", "1e999"] {
            let ran = fail(folder.path(), &format!("{command} {option}={value}"), option);
            assert_eq!(ran.code, Some(USAGE), "{option} {value}: {}", ran.stderr);
        }
    }
}

#[test]
fn inputs_are_never_replaced() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    let material = "newmtl red\nKd 0.8 0.1 0.1\nmap_Kd tex.png\n";
    std::fs::write(folder.join("triangle.mtl"), material).unwrap();
    std::fs::write(folder.join("triangle.obj"), TRIANGLE.replace("f 1 2 3", "vt 0 0\nf 1/1 2/1 3/1"))
        .unwrap();
    Image::from_fn(4, 4, |_, _| [0.5; 3]).write_png_encoded(&folder.join("tex.png")).unwrap();
    Image::from_fn(8, 4, |_, _| [0.5; 3]).write_hdr(&folder.join("sky.hdr")).unwrap();
    for output in ["tex.png", "./tex.png", "sky.hdr"] {
        let arguments = format!("render triangle.obj {SMALL} --environment sky.hdr -o a.exr -o {output}");
        let ran = fail(folder, &arguments, "which would be lost");
        assert_eq!(ran.code, Some(OUTPUT), "{output}");
    }
    fail(folder, &format!("render triangle.obj {SMALL} -o a.png --profile triangle.mtl"), "would be lost");
    for tile in ["1/2", "2/2"] {
        succeed(folder, &format!("render triangle.obj {SMALL} --tile {tile} -o part{}.exr", &tile[..1]));
    }
    fail(folder, "merge part1.exr part2.exr -o part1.exr", "part1.exr: it is an input of this command");
    fail(folder, "merge part1.exr part2.exr -o a.png -o part2.exr --part", "part");
    fail(folder, &format!("render triangle.obj {SMALL} -o part1.exr"), "there is a part of a picture");
    succeed(folder, "merge part1.exr part2.exr -o whole.exr");
    fail(folder, "compare whole.exr whole.exr --difference whole.exr", ".png");
}

#[cfg(unix)]
mod on_unix {
    use super::*;
    use film::Part;
    use std::os::unix::fs::symlink;
    use std::os::unix::process::ExitStatusExt;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    /// How often random things happen: `usual` times, or as often as `ALHAZEN_TRUST_RUNS` says.
    fn runs(usual: u32) -> u32 {
        let factor = std::env::var("ALHAZEN_TRUST_RUNS").ok().and_then(|n| n.parse().ok());
        factor.map_or(usual, |factor: u32| usual * factor)
    }

    /// Evenly spread numbers in `[0, 1)` that look random: multiples of the golden ratio.
    fn spread(i: u32) -> f64 {
        (f64::from(i) * 0.618_033_988_749_895).fract()
    }

    /// Runs a line of a shell, in which `alhazen` is the program.
    fn shell(folder: &Path, line: &str) -> common::Ran {
        let line = line.replace("alhazen", env!("CARGO_BIN_EXE_alhazen"));
        let output = Command::new("bash").args(["-c", &line]).current_dir(folder).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        let ran = common::Ran {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        };
        assert!(!ran.stderr.contains("panicked"), "{line}: {}", ran.stderr);
        ran
    }

    #[test]
    fn special_files_are_never_replaced() {
        let folder = folder_with_triangle();
        let folder = folder.path();
        symlink("/dev/null", folder.join("null.png")).unwrap();
        assert!(Command::new("mkfifo").arg(folder.join("fifo.png")).status().unwrap().success());
        for name in ["null.png", "fifo.png"] {
            let ran = fail(folder, &format!("render triangle.obj {SMALL} -o {name}"), "it is a device");
            assert_eq!(ran.code, Some(OUTPUT));
            assert!(std::fs::symlink_metadata(folder.join(name)).is_ok_and(|m| !m.is_file()), "{name}");
        }
        symlink("target.png", folder.join("link.png")).unwrap();
        succeed(folder, &format!("render triangle.obj {SMALL} -o link.png"));
        assert!(std::fs::symlink_metadata(folder.join("link.png")).unwrap().is_symlink());
        assert!(Image::open(folder.join("target.png")).is_ok());
    }

    #[test]
    fn every_output_is_tried_and_the_last_line_says_where_it_is() {
        let folder = folder_with_triangle();
        let folder = folder.path();
        std::fs::create_dir(folder.join("gone")).unwrap();
        // The folder goes while the picture is rendered.
        let line = format!(
            "alhazen render triangle.obj {} -o gone/a.png -o b.png & sleep 1; rmdir gone; kill -TERM %1; wait %1",
            SMALL.replace("--spp 1", "--spp 1000000 --sampler independent")
        );
        let ran = shell(folder, &line);
        assert_eq!(ran.code, Some(OUTPUT), "{ran:?}");
        assert!(Image::open(folder.join("b.png")).is_ok());
        let (_, kept) = ran.stderr.split_once("could not write gone/a.png; it is kept as ").expect("told");
        let kept = Path::new(kept.lines().next().unwrap());
        assert!(Image::open(kept).is_ok(), "{ran:?}");
        std::fs::remove_file(kept).unwrap();
    }

    /// What scenes take is counted before; here the count is told to allow what the system does not.
    #[test]
    #[cfg(target_os = "linux")]
    fn where_memory_ends_the_old_picture_stays() {
        let folder = folder_with_triangle();
        let folder = folder.path();
        std::fs::write(folder.join("a.png"), "the old picture").unwrap();
        let terrain = "[[shape]]\nkind = \"terrain\"\ndivisions = [1500, 1500]\n";
        std::fs::write(folder.join("large.toml"), terrain).unwrap();
        let line = format!("ulimit -v 500000; alhazen render large.toml {SMALL} -o a.png");
        let ran = shell(folder, &format!("{line} --max-memory 1TB"));
        assert_eq!(ran.code, Some(MEMORY), "{ran:?}");
        assert!(ran.stderr.contains("memory"), "{ran:?}");
        assert_eq!(std::fs::read(folder.join("a.png")).unwrap(), b"the old picture");
        // Without that the limit of the process is known beforehand.
        let ran = shell(folder, &line);
        assert_eq!(ran.code, Some(REFUSED), "{ran:?}");
        assert!(ran.stderr.contains("--max-memory"), "{ran:?}");
        assert_eq!(names(folder), ["a.png", "large.toml", "triangle.mtl", "triangle.obj"]);
    }

    #[test]
    fn full_disks_damage_nothing() {
        let folder = folder_with_triangle();
        let folder = folder.path();
        // About 3 kB of PNG, 20 kB of EXR and more than 100 kB of checkpoint.
        let picture = SMALL.replace("16", "48");
        let render = format!("render cornell {picture} --seed 7 -o a.exr -o a.png --checkpoint c.exr");
        let old: [(&str, &[u8]); 2] = [("a.exr", b"the old picture"), ("a.png", b"another")];
        let picture = |name: &str| Image::open(folder.join(name)).is_ok();
        let moments = runs(8);
        let (mut refused, mut whole) = (0, 0);
        for moment in 0..moments {
            old.iter().for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes).unwrap());
            let _ = std::fs::remove_file(folder.join("c.exr"));
            // Blocks of 1024 bytes; files that become larger cannot be written on. The temporary folder is as full.
            let most = 1 + (spread(moment) * spread(moment) * 200.0) as u32;
            let ran = shell(folder, &format!("trap '' XFSZ; ulimit -f {most}; exec alhazen {render}"));
            for (name, bytes) in old {
                let is_old = std::fs::read(folder.join(name)).unwrap() == bytes;
                assert!(is_old || picture(name), "{name} at {most}: {ran:?}");
                match ran.code {
                    Some(0) => assert!(!is_old, "{name} at {most}: {ran:?}"),
                    code => assert_eq!(code, Some(OUTPUT), "{name} at {most}: {ran:?}"),
                }
            }
            let checkpoint = folder.join("c.exr");
            assert!(!checkpoint.exists() || Part::read(&checkpoint).is_ok(), "{most}: {ran:?}");
            // A disk that is full from the beginning is noticed before rendering.
            let rendered = ran.code == Some(0) || ran.stderr.contains("could not write");
            let warned = ran.stderr.contains("warning: cannot write the checkpoint");
            assert!(checkpoint.exists() || warned || !rendered, "{most}: {ran:?}");
            assert!(names(folder).iter().all(|name| !name.ends_with(".tmp")), "{:?}", names(folder));
            if ran.code == Some(0) { whole += 1 } else { refused += 1 }
        }
        assert!(refused > 0 && whole > 0, "{refused} of {moments} disks were full");
    }

    fn start(folder: &Path, arguments: &str) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_alhazen"));
        command.args(arguments.split_whitespace()).current_dir(folder).stderr(Stdio::null());
        command.spawn().unwrap()
    }

    fn signal(child: &Child, name: &str) {
        assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
    }

    fn modified(path: &Path) -> Option<std::time::SystemTime> {
        std::fs::metadata(path).and_then(|m| m.modified()).ok()
    }

    /// Waits until the file is replaced.
    fn wait_for(child: &mut Child, path: &Path, before: Option<std::time::SystemTime>) {
        let start = Instant::now();
        while modified(path).is_none() || modified(path) == before {
            assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
            assert!(start.elapsed() < Duration::from_secs(120), "no checkpoint was written");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    const ENDLESS: &str = "-q --width 32 --height 32 --spp 1000000000 --backend cpu --threads 1";

    fn samples(path: &Path) -> u64 {
        Part::read(path).unwrap().film().total_samples()
    }

    #[test]
    fn kills_lose_no_more_than_an_interval() {
        let folder = folder_with_triangle();
        let folder = folder.path();
        std::fs::write(folder.join("mine.exr"), "not an output").unwrap();
        std::fs::write(folder.join("out.png"), "the old picture").unwrap();
        let sitting =
            format!("render triangle.obj {ENDLESS} --checkpoint c.exr --every 0.05s --resume -o out.png");
        let checkpoint = folder.join("c.exr");
        let mut least = 0;
        for kill in 0..runs(6) {
            let before = modified(&checkpoint);
            let mut child = start(folder, &sitting);
            wait_for(&mut child, &checkpoint, before);
            let saved = samples(&checkpoint);
            std::thread::sleep(Duration::from_secs_f64(0.15 * spread(kill)));
            signal(&child, "-KILL");
            assert_eq!(child.wait().unwrap().signal(), Some(9));
            let now = samples(&checkpoint);
            assert!(
                now >= saved && saved > least,
                "kill {kill}: {now} samples, {saved} before, {least} at first"
            );
            least = now;
        }
        assert_eq!(std::fs::read(folder.join("out.png")).unwrap(), b"the old picture");
        assert_eq!(std::fs::read(folder.join("mine.exr")).unwrap(), b"not an output");
        // The next writer cleans up, whatever it writes.
        succeed(folder, &format!("render triangle.obj {SMALL} -o other.png"));
        let expected = ["c.exr", "mine.exr", "other.png", "out.png", "triangle.mtl", "triangle.obj"];
        assert_eq!(names(folder), expected);
    }

    #[test]
    fn signals_keep_picture_and_checkpoint() {
        let folder = folder_with_triangle();
        let folder = folder.path();
        let checkpoint = folder.join("c.exr");
        for i in 0..runs(3) {
            let name = ["-INT", "-TERM", "-HUP"][i as usize % 3];
            let _ = (std::fs::remove_file(&checkpoint), std::fs::remove_file(folder.join("out.exr")));
            let sitting =
                format!("render triangle.obj {ENDLESS} --checkpoint c.exr --every 0.05s -o out.exr");
            let mut child = start(folder, &sitting);
            wait_for(&mut child, &checkpoint, None);
            let saved = samples(&checkpoint);
            std::thread::sleep(Duration::from_secs_f64(0.1 * spread(i)));
            signal(&child, name);
            assert_eq!(child.wait().unwrap().code(), Some(130), "{name}");
            assert!(samples(&checkpoint) >= saved, "{name}");
            let picture = film::ExrFile::read(&folder.join("out.exr")).unwrap();
            assert!(picture.metadata["spp"].parse::<u32>().unwrap() > 0, "{name}");
        }
    }

    #[test]
    fn a_hangup_that_is_ignored_stays_ignored() {
        let folder = folder_with_triangle();
        let line = format!(
            "trap '' HUP; alhazen render triangle.obj {ENDLESS} -o a.png & sleep 0.7; kill -HUP $!; sleep 0.3; \
             kill -0 $! && echo lives; kill -TERM $!; wait $!"
        );
        let ran = shell(folder.path(), &line);
        assert_eq!((ran.code, ran.stdout.trim()), (Some(130), "lives"), "{ran:?}");
    }

    #[test]
    fn closed_pipes_are_no_failure() {
        let folder = folder_with_triangle();
        let folder = folder.path();
        let render = format!("alhazen render triangle.obj {} -o a.png", SMALL.replace("-q", ""));
        let lines = [
            format!("{render} 2>&-"),
            format!("{render} 2>/dev/full"),
            // What reads stderr is gone before anything is written to it.
            format!("{render} 2> >(exec <&-); exit $?"),
            format!("{render} --json >&-"),
            format!("{render} --json | head -c 0; exit ${{PIPESTATUS[0]}}"),
            "alhazen scenes | head -c 0; exit ${PIPESTATUS[0]}".into(),
            "alhazen info triangle.obj 2>&- | head -c 1; exit ${PIPESTATUS[0]}".into(),
            "alhazen --help | head -c 1; exit ${PIPESTATUS[0]}".into(),
        ];
        for line in lines {
            let ran = shell(folder, &line);
            assert_eq!(ran.code, Some(0), "{line}: {ran:?}");
        }
        let ran = shell(folder, "alhazen scenes > /dev/full");
        assert_eq!(ran.code, Some(OUTPUT), "{ran:?}");
        assert!(run(folder, "scenes --nonsense").code == Some(USAGE) && !files(folder).is_empty());
    }
}
