//! `cargo xtask python`: builds the wheel, installs it into a fresh virtual environment and runs its tests there.

use crate::shell::{output, root, run as run_command, target_dir};
use crate::vulkan;
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Build the Python wheel, install it into a clean virtual environment and run its tests.
///
/// Needs a Python 3.9 or later with venv and pip, and a package index that pip reaches.
#[derive(Debug, clap::Args)]
pub struct PythonArgs {
    /// The Python to make the environment with.
    #[arg(long, value_name = "PATH", default_value = "python3")]
    python: PathBuf,
    /// Build with all optimisations, as for publishing; otherwise with the profile of the tests, whose compiled
    /// dependencies it shares.
    #[arg(long)]
    release: bool,
    /// Only build the wheel and print its path.
    #[arg(long)]
    no_test: bool,
    /// More arguments for pytest, such as `-k queries`.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

impl PythonArgs {
    /// What continuous integration does.
    pub fn for_ci() -> Self {
        Self { python: "python3".into(), release: false, no_test: false, arguments: Vec::new() }
    }
}

/// Builds, installs, tests.
pub fn run(args: &PythonArgs) -> anyhow::Result<()> {
    let wheel = wheel(&args.python, args.release)?;
    if args.no_test {
        println!("{}", wheel.display());
        return Ok(());
    }
    let environment = Environment::fresh(&args.python, &folder()?.join("installed"))?;
    let (wheel, package) = (wheel.to_string_lossy(), root().join("crates/python"));
    // What the package works with and does not need: workers, models of robots, environments.
    environment.install(&[&wheel, "pytest", "distributed", "mujoco", "gymnasium"])?;
    let mut pytest = environment.python();
    // Not from the source folder, where `alhazen` would be the sources without the compiled part.
    pytest.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "--rootdir"]).arg(&package);
    pytest.arg(package.join("tests")).args(&args.arguments).current_dir(folder()?);
    // Kernels that tests of Rust compile, too, are compiled in the same way.
    pytest.envs(vulkan::present());
    run_command(&mut pytest)
}

/// Builds the wheel; returns its path.
pub fn wheel(python: &Path, release: bool) -> anyhow::Result<PathBuf> {
    let builder = Environment::kept(python, &folder()?.join("builder"))?;
    builder.install(&["maturin>=1.9.4,<2"])?;
    let wheels = folder()?.join("wheels");
    // What an earlier version left there is not what was built.
    match std::fs::remove_dir_all(&wheels) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            return Err(e).context("cannot remove old wheels");
        }
        _ => {}
    }
    let mut maturin = builder.python();
    maturin.args([
        "-m",
        "maturin",
        "build",
        "--locked",
        "--strip",
        "--profile",
        if release { "release" } else { "dev" },
    ]);
    maturin.args(["--manifest-path", "crates/python/Cargo.toml", "--out"]).arg(&wheels).current_dir(root());
    run_command(&mut maturin)?;
    let entries = std::fs::read_dir(&wheels).context("maturin has left no wheel")?;
    let found: Vec<_> = entries.flatten().map(|e| e.path()).collect();
    ensure!(found.len() == 1, "expected one wheel, found {found:?}");
    Ok(found[0].clone())
}

/// Where all this happens, beside the build.
pub fn folder() -> anyhow::Result<PathBuf> {
    let folder = target_dir()?.join("python");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    Ok(folder)
}

/// A virtual environment of Python.
pub struct Environment(PathBuf);

impl Environment {
    /// One that holds nothing but what will be installed.
    pub fn fresh(python: &Path, place: &Path) -> anyhow::Result<Self> {
        let made = output(Command::new(python).args(["-m", "venv", "--clear"]).arg(place));
        if let Err(error) = made {
            // Debian keeps a part of venv in a package of its own; pip brings the same tool.
            eprintln!("no venv, so virtualenv from pip: {error}");
            let tool = folder()?.join("virtualenv");
            let mut pip = Command::new(python);
            pip.args(["-m", "pip", "install", "--quiet", "--upgrade", "--target"])
                .arg(&tool)
                .arg("virtualenv");
            run_command(&mut pip)?;
            let mut virtualenv = Command::new(python);
            virtualenv.args(["-m", "virtualenv", "--quiet", "--clear"]).arg(place).env("PYTHONPATH", &tool);
            run_command(&mut virtualenv)?;
        }
        Ok(Self(place.into()))
    }

    /// One that may be there from an earlier time.
    pub fn kept(python: &Path, place: &Path) -> anyhow::Result<Self> {
        let environment = Self(place.into());
        let works =
            environment.python().args(["-c", "import pip"]).output().is_ok_and(|o| o.status.success());
        if works { Ok(environment) } else { Self::fresh(python, place) }
    }

    /// Installs packages; those that are there already take no time.
    pub fn install(&self, packages: &[&str]) -> anyhow::Result<()> {
        let mut pip = self.python();
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(packages);
        output(&mut pip).map(drop)
    }

    /// Its interpreter, as a command.
    pub fn python(&self) -> Command {
        let program = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" };
        let mut command = Command::new(self.0.join(program));
        // Whatever else is installed on the machine stays out.
        command.env_remove("PYTHONPATH").env_remove("PYTHONHOME");
        command
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use crate::shell::cargo;
    use std::collections::BTreeSet;

    /// Packages with their versions and features, as they are compiled for what `selection` selects.
    fn packages(selection: &[&str]) -> BTreeSet<String> {
        let tree = ["tree", "--locked", "--prefix", "none", "--format", "{p} {f}"];
        let text = output(cargo(&tree).args(selection)).expect("cargo shows trees");
        text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
    }

    /// What the wheel is made of is what tests are made of, feature by feature: otherwise it would be compiled twice. On other systems
    /// other features differ.
    #[test]
    fn the_wheel_shares_what_is_compiled_for_the_tests() {
        let wheel = packages(&["--package", "python", "--edges", "normal,build"]);
        let tests = packages(&["--workspace", "--edges", "normal,build,dev"]);
        assert!(wheel.iter().any(|package| package.starts_with("wgpu v")), "{wheel:?}");
        let apart: Vec<_> = wheel.difference(&tests).collect();
        assert!(apart.is_empty(), "add features to crates/python/Cargo.toml: {apart:?}");
    }
}
