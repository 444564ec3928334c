//! `alhazen view` in a build without windows.

use crate::exit::Exit;
use crate::windowless::LEFT_OUT;

/// Open a scene in a window: not in this build.
#[derive(Debug, clap::Args)]
pub struct ViewArgs {
    /// Whatever a build with windows would take.
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// No window opens.
pub fn run_default() -> Option<anyhow::Result<()>> {
    None
}

/// Says that there is no window.
pub fn run(_: &ViewArgs) -> anyhow::Result<()> {
    Err(Exit::Usage.with(anyhow::anyhow!(LEFT_OUT)))
}
