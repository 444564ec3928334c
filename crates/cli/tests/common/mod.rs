//! Runs the real binary in a folder of its own.

#![allow(dead_code, reason = "each test program uses some of this")]

pub mod display;

use std::path::Path;
use std::process::Command;

/// What a run left behind.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    /// The one JSON value on stdout.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("not JSON: {e}\n{}", self.stdout))
    }
}

/// Runs `alhazen` with `arguments` (separated by blanks) in `folder`.
pub fn run(folder: &Path, arguments: &str) -> Ran {
    let mut command = Command::new(env!("CARGO_BIN_EXE_alhazen"));
    command.args(arguments.split_whitespace()).current_dir(folder);
    let output = command.output().expect("the binary can be run");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    let ran = Ran { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) };
    assert!(!ran.stderr.contains("panicked"), "{arguments}: {}", ran.stderr);
    ran
}

/// Runs what must succeed.
pub fn succeed(folder: &Path, arguments: &str) -> Ran {
    let ran = run(folder, arguments);
    assert_eq!(ran.code, Some(0), "{arguments}: {}", ran.stderr);
    ran
}

/// Runs what must fail, with one error message that contains `reason`, nothing on stdout, and no file changed.
pub fn fail(folder: &Path, arguments: &str, reason: &str) -> Ran {
    let before = files(folder);
    let ran = run(folder, arguments);
    assert!(matches!(ran.code, Some(1..)), "{arguments} did not fail: {ran:?}");
    let errors = ran.stderr.lines().filter(|l| l.starts_with("error:")).count();
    assert_eq!(errors, 1, "{arguments}: {}", ran.stderr);
    assert!(ran.stderr.contains(reason), "{arguments}: expected {reason:?} in: {}", ran.stderr);
    assert_eq!(ran.stdout, "", "{arguments}");
    assert_eq!(before, files(folder), "{arguments} left something behind");
    ran
}

/// Names and contents of all files of a folder, in order.
pub fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap()).filter(|e| e.path().is_file());
    let mut files: Vec<_> =
        entries.map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).unwrap())).collect();
    files.sort();
    files
}

/// Names of all files of a folder, in order.
pub fn names(folder: &Path) -> Vec<String> {
    files(folder).into_iter().map(|(name, _)| name).collect()
}

/// A red triangle that fills most of the view of `--eye 0,0,3 --target 0,0,0`.
pub const TRIANGLE: &str = "mtllib triangle.mtl\nv -2 -2 0\nv 2 -2 0\nv 0 2 0\nusemtl red\nf 1 2 3\n";

/// The material of [`TRIANGLE`].
pub const TRIANGLE_MATERIAL: &str = "newmtl red\nKd 0.8 0.1 0.1\n";

/// A folder with `triangle.obj` and its material.
pub fn folder_with_triangle() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("triangle.obj"), TRIANGLE).unwrap();
    std::fs::write(folder.path().join("triangle.mtl"), TRIANGLE_MATERIAL).unwrap();
    folder
}
