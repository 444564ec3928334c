//! `cargo xtask docs`: figures that are made from the code.

use crate::shell::{cargo, run as run_command};

/// Writes the figures. Tests compare them with the code, so they cannot fall behind.
pub fn run() -> anyhow::Result<()> {
    let mut command = cargo(&["test", "--package", "gpu", "--test", "shader_binding_table"]);
    run_command(command.env("ALHAZEN_UPDATE_DOCS", "1"))
}
