//! `alhazen completions`: what the Tab key needs to know.

use crate::console::print_result;
use clap_complete::Shell;

/// Print completions for a shell.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen completions bash > ~/.local/share/bash-completion/completions/alhazen
  alhazen completions fish > ~/.config/fish/completions/alhazen.fish
  alhazen completions zsh > \"${fpath[1]}/_alhazen\"")]
pub struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

/// Prints the completions of `command`.
pub fn run(args: &CompletionsArgs, mut command: clap::Command) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "alhazen", &mut script);
    print_result(&String::from_utf8_lossy(&script))
}
