//! `cargo xtask bench python`: ray queries from Python against the Rust library and against trimesh with embreex.

use crate::python::{Environment, folder, wheel};
use crate::shell::{cargo, root, run as run_command, target_dir};
use std::path::PathBuf;

/// Ray queries from Python, from Rust, and by trimesh with embreex: 10 million random rays against 2 million triangles.
///
/// Needs a Python with venv and pip, and a package index that pip reaches.
#[derive(Debug, clap::Args)]
pub struct PythonBenchArgs {
    /// The Python to make the environment with.
    #[arg(long, value_name = "PATH", default_value = "python3")]
    python: PathBuf,
    /// Build with the profile of the tests instead of all optimisations.
    #[arg(long)]
    dev: bool,
    /// More arguments for crates/python/benches/ray_queries.py, such as `--repeat 9`.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// Builds both sides and measures.
pub fn run(args: &PythonBenchArgs) -> anyhow::Result<()> {
    let (profile, place) = if args.dev { ("dev", "debug") } else { ("release", "release") };
    // Both packages at once, so that they share their compiled dependencies.
    let mut build = cargo(&["build", "--profile", profile, "--package", "python", "--package", "alhazen"]);
    run_command(build.args(["--example", "ray_queries"]))?;
    let program = target_dir()?
        .join(place)
        .join("examples/ray_queries")
        .with_extension(std::env::consts::EXE_EXTENSION);
    let wheel = wheel(&args.python, !args.dev)?;
    let environment = Environment::kept(&args.python, &folder()?.join("bench"))?;
    environment.install(&["numpy", "trimesh", "embreex"])?;
    // The version is that of an older build; the wheel is not.
    environment.install(&["--force-reinstall", "--no-deps", &wheel.to_string_lossy()])?;
    let mut script = environment.python();
    script.arg(root().join("crates/python/benches/ray_queries.py")).arg("--rust").arg(program);
    run_command(script.args(&args.arguments).current_dir(folder()?))
}
