//! Folders of the repository, and programs that are run.

use anyhow::{Context, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The root folder of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}

/// The folder with test data that is too large for the repository: `ALHAZEN_SHARED`, or `shared` beside the repository.
pub fn shared_dir() -> Option<PathBuf> {
    let named = std::env::var_os("ALHAZEN_SHARED").map(PathBuf::from);
    let dir = named.or_else(|| Some(root().parent()?.join("shared")))?;
    dir.is_dir().then_some(dir)
}

/// A cargo command in the root folder, of the toolchain that runs this.
pub fn cargo(arguments: &[&str]) -> Command {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    command
}

/// Runs a command to its end; an error if it fails.
pub fn run(command: &mut Command) -> anyhow::Result<()> {
    let shown = show(command);
    eprintln!("$ {shown}");
    let status = command.status().with_context(|| format!("cannot run {shown}"))?;
    ensure!(status.success(), "{shown} failed ({status})");
    Ok(())
}

/// What a command printed to stdout; an error with the end of its stderr if it fails.
pub fn output(command: &mut Command) -> anyhow::Result<String> {
    let shown = show(command);
    let output = command.output().with_context(|| format!("cannot run {shown}"))?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let lines: Vec<_> = stderr.lines().collect();
        bail!("{shown} failed ({}):\n{}", output.status, lines[lines.len().saturating_sub(8)..].join("\n"));
    }
    String::from_utf8(output.stdout).context("the output is not text")
}

/// As [`output`], but ends the program after `limit`. Its output must fit the pipes' buffers.
pub fn output_within(command: &mut Command, limit: Duration) -> anyhow::Result<String> {
    let shown = show(command);
    let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = spawned.with_context(|| format!("cannot run {shown}"))?;
    let start = Instant::now();
    while child.try_wait()?.is_none() {
        if start.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            bail!("ended after {} s", limit.as_secs());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output()?;
    let stderr = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{}", stderr.trim());
    String::from_utf8(output.stdout).context("the output is not text")
}

/// The folder that cargo builds in.
pub fn target_dir() -> anyhow::Result<PathBuf> {
    let metadata = output(&mut cargo(&["metadata", "--no-deps", "--format-version", "1"]))?;
    let metadata: serde_json::Value = serde_json::from_str(&metadata).context("cargo metadata")?;
    let target = metadata["target_directory"].as_str().context("cargo metadata has no target_directory")?;
    Ok(target.into())
}

/// Builds the `alhazen` binary with optimisation and returns its path.
pub fn release_binary() -> anyhow::Result<PathBuf> {
    run(&mut cargo(&["build", "--release", "--package", "cli"]))?;
    Ok(target_dir()?.join("release").join(format!("alhazen{}", std::env::consts::EXE_SUFFIX)))
}

/// The commit of the checkout, with `+` if files differ from it.
pub fn commit() -> String {
    let git = |arguments: &[&str]| output(Command::new("git").args(arguments).current_dir(root()));
    let Ok(hash) = git(&["rev-parse", "--short=12", "HEAD"]) else { return "unknown".into() };
    let dirty = git(&["status", "--porcelain", "--untracked-files=no"]).is_ok_and(|s| !s.trim().is_empty());
    format!("{}{}", hash.trim(), if dirty { "+" } else { "" })
}

/// A Python that can import `module`: `wanted`, or else one on the path.
pub fn python_with(wanted: Option<&Path>, module: &str) -> Option<PathBuf> {
    let candidates = match wanted {
        Some(path) => vec![path.to_owned()],
        None => vec!["python3".into(), "python".into()],
    };
    let works = |python: &PathBuf| {
        let mut command = Command::new(python);
        command.args(["-c", &format!("import {module}")]).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|s| s.success())
    };
    candidates.into_iter().find(works)
}

fn show(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|w| w.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
