//! `alhazen submit` and the examples of docs/cluster.md: jobs that engines run give the pictures that one machine gives.

mod common;

use common::{fail, names, succeed};
use film::ExrFile;
use std::path::{Path, PathBuf};
use std::process::Command;

const RENDER: &str =
    "three-spheres --width 24 --height 18 --spp 5 --fps 4 --backend cpu --aov normal,samples";

/// A program of the folder that `ALHAZEN_CLUSTER_TOOLS` names, or of the path; `None`, after saying so, if there is none.
fn tool(name: &str, test: &str) -> Option<PathBuf> {
    let folders = ["ALHAZEN_CLUSTER_TOOLS", "PATH"].into_iter().filter_map(std::env::var_os);
    let found = folders.flat_map(|f| std::env::split_paths(&f).collect::<Vec<_>>()).map(|f| f.join(name));
    let found = found.into_iter().find(|path| path.is_file());
    if found.is_none() {
        testkit::skip_without_tool(test, &format!("there is no {name}; `cargo xtask test` installs it"));
    }
    found
}

/// The path with our binary's folder before the others.
fn path_with_alhazen() -> std::ffi::OsString {
    let ours = Path::new(env!("CARGO_BIN_EXE_alhazen")).parent().unwrap().to_owned();
    let others = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::iter::once(ours).chain(std::env::split_paths(&others))).unwrap()
}

fn read(path: &Path) -> ExrFile {
    let mut file = ExrFile::read(path).unwrap_or_else(|e| panic!("{e}"));
    assert!(file.metadata.remove("render_seconds").is_some());
    file
}

/// Compares the frames of a job with those of one process.
fn check_frames(folder: &Path, job: &str, frames: std::ops::Range<u32>) {
    let range = format!("{}..{}", frames.start, frames.end);
    succeed(folder, &format!("render {RENDER} -q --frames {range} -o whole-##.exr"));
    for frame in frames {
        let pair = [job, "whole-"].map(|name| read(&folder.join(format!("{name}{frame:02}.exr"))));
        assert!(pair[0] == pair[1], "frame {frame}");
    }
}

#[test]
fn an_openjd_job_of_four_frames_runs_and_gives_the_same_bits() {
    let Some(openjd) = tool("openjd", "an_openjd_job_of_four_frames_runs_and_gives_the_same_bits") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let split = "submit openjd --tiles 2 --sample-ranges 2 --job job.json --";
    succeed(folder.path(), &format!("{split} {RENDER} --frames 0..4 -o job-##.exr -o job-##.png"));
    for command in ["check", "run"] {
        let mut openjd = Command::new(&openjd);
        openjd.args([command, "job.json"]).current_dir(folder.path()).env("PATH", path_with_alhazen());
        let output = openjd.output().unwrap();
        let text = [output.stdout, output.stderr].map(|o| String::from_utf8_lossy(&o).into_owned()).concat();
        assert!(output.status.success(), "{command}: {text}");
    }
    check_frames(folder.path(), "job-", 0..4);
    assert!(names(folder.path()).contains(&"job-03.png".to_owned()));
}

#[test]
fn openjd_templates_name_files_as_parameters() {
    let folder = common::folder_with_triangle();
    let scene = "./triangle.obj --environment 1,1,1";
    let ran =
        succeed(folder.path(), &format!("submit openjd --name turn -- {scene} -o out/a.exr -o out/a.png"));
    let job = ran.json();
    assert_eq!(job["specificationVersion"], "jobtemplate-2023-09");
    assert_eq!(job["name"], "turn");
    let arguments = job["steps"][0]["script"]["actions"]["onRun"]["args"].as_array().unwrap();
    assert_eq!(arguments[1], "{{Param.SceneFolder}}/triangle.obj");
    assert_eq!(arguments.last().unwrap(), "{{Param.OutputFolder}}/a.png");
    assert_eq!(job["steps"].as_array().unwrap().len(), 1, "there is nothing to merge");
    let parameters = job["parameterDefinitions"].as_array().unwrap();
    let of = |name: &str| parameters.iter().find(|p| p["name"] == name).unwrap();
    assert_eq!(
        (of("OutputFolder")["default"].as_str(), of("SceneFolder")["default"].as_str()),
        (Some("out"), Some("."))
    );
    // What is not below the template has no place that other machines would know.
    std::fs::create_dir(folder.path().join("jobs")).unwrap();
    let ran = succeed(folder.path(), &format!("submit openjd --job jobs/job.json -- {scene}"));
    assert!(ran.stderr.contains("-p SceneFolder="), "{}", ran.stderr);
}

/// A stand-in for Slurm's `sbatch` that runs the tasks of an array at once, one after the other, as Slurm would start them.
const SBATCH: &str = r#"#!/usr/bin/env bash
set -euo pipefail
for argument in "$@"; do
    case "$argument" in
    --array=*) array=${argument#--array=} ;;
    -*) ;;
    *) break ;;
    esac
    shift
done
for id in $(seq "${array%-*}" "${array#*-}"); do
    SLURM_ARRAY_TASK_ID=$id bash "$@" >> log.txt
done
echo "$RANDOM;cluster"
"#;

/// The path with our binary's folder and the stand-in for `sbatch`, which is written to `folder`.
#[cfg(unix)]
fn path_with_sbatch(folder: &Path) -> std::ffi::OsString {
    use std::os::unix::fs::PermissionsExt;
    let bin = folder.join("bin");
    std::fs::create_dir(&bin).unwrap();
    std::fs::write(bin.join("sbatch"), SBATCH).unwrap();
    std::fs::set_permissions(bin.join("sbatch"), std::fs::Permissions::from_mode(0o755)).unwrap();
    [bin.into_os_string(), path_with_alhazen()].join(std::ffi::OsStr::new(":"))
}

#[cfg(unix)]
#[test]
fn slurm_scripts_cover_every_task_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let split = "submit slurm --tiles 3 --sample-ranges 2 --job job.sh --";
    succeed(folder, &format!("{split} {RENDER} --frames 2..4 -o job-##.exr"));
    let mut bash = Command::new("bash");
    bash.args(["job.sh", "--partition=long"]).current_dir(folder).env("PATH", path_with_sbatch(folder));
    let output = bash.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let log = std::fs::read_to_string(folder.join("log.txt")).unwrap();
    assert_eq!(log.lines().filter(|l| l.contains("tile")).count(), 2 * 3 * 2, "{log}");
    check_frames(folder, "job-", 2..4);
}

/// Commands of docs/cluster.md that are marked to be run, and what with.
fn examples() -> Vec<(String, String)> {
    let text = std::fs::read_to_string(testkit::repository_root().join("docs/cluster.md")).unwrap();
    let marked = text.split("<!-- run").skip(1).map(|example| {
        let (with, rest) = example.split_once("-->").unwrap();
        let commands = rest.trim_start().strip_prefix("```sh\n").unwrap().split("```").next().unwrap();
        (with.trim().to_owned(), commands.to_owned())
    });
    marked.collect()
}

#[cfg(unix)]
#[test]
fn the_documentation_s_examples_run() {
    let examples = examples();
    assert_eq!(examples.len(), 4);
    for (with, commands) in examples {
        let folder = tempfile::tempdir().unwrap();
        let mut path = path_with_sbatch(folder.path());
        if with == "openjd" {
            let Some(openjd) = tool("openjd", "the_documentation_s_examples_run") else { continue };
            path = [openjd.parent().unwrap().as_os_str(), &path].join(std::ffi::OsStr::new(":"));
        }
        let mut bash = Command::new("bash");
        bash.args(["-euc", &commands]).current_dir(folder.path()).env("PATH", path);
        let output = bash.output().unwrap();
        assert!(output.status.success(), "{commands}: {}", String::from_utf8_lossy(&output.stderr));
        let made = names(folder.path());
        assert!(
            made.contains(&"cornell.exr".to_owned()) || made.contains(&"frame-0003.exr".to_owned()),
            "{made:?}"
        );
    }
}

#[test]
fn slurm_scripts_please_shellcheck() {
    let Some(shellcheck) = tool("shellcheck", "slurm_scripts_please_shellcheck") else { return };
    let folder = tempfile::tempdir().unwrap();
    let jobs = [
        "submit slurm --job job.sh -- atrium",
        "submit slurm --tiles 4 --job job.sh --name it's -- atrium -o $a#b'c.exr --frames 3..5",
        "submit slurm --tiles 4 --sample-ranges 9 --job job.sh -- /home/a.glb -o some/where/####.exr",
    ];
    // SC2016 asks whether a `$` in single quotes was meant: in a file's name it is.
    let check = || {
        Command::new(&shellcheck)
            .args(["--exclude=SC2016", "job.sh"])
            .current_dir(folder.path())
            .output()
            .unwrap()
    };
    for job in jobs {
        succeed(folder.path(), job);
        let output = check();
        assert!(output.status.success(), "{job}: {}", String::from_utf8_lossy(&output.stdout));
    }
    // It does find what is wrong.
    let broken = std::fs::read_to_string(folder.path().join("job.sh")).unwrap().replace("\"$0\"", "$0");
    std::fs::write(folder.path().join("job.sh"), broken).unwrap();
    assert!(!check().status.success());
}

#[test]
fn jobs_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fail(folder.path(), "submit openjd -- atrium --tile 1/2", "--tile cannot be used with `alhazen submit`");
    fail(folder.path(), "submit slurm --tiles 0 -- atrium", "--tiles");
    fail(folder.path(), "submit openjd -- {{atrium}}", "has a meaning in job templates");
    fail(folder.path(), "submit openjd --job nowhere/job.json -- atrium", "there is no folder nowhere");
}
