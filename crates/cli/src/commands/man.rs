//! `alhazen man`: manual pages.

use crate::console::print_result;
use anyhow::Context;
use std::path::PathBuf;

/// Print the manual page, or write the pages of all subcommands to a folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen man | man -l -
  alhazen man --output ~/.local/share/man/man1")]
pub struct ManArgs {
    /// Folder for alhazen.1, alhazen-render.1 and so on; made if it is missing.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Prints or writes the pages of `command`.
pub fn run(args: &ManArgs, command: clap::Command) -> anyhow::Result<()> {
    let Some(folder) = &args.output else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        return print_result(&String::from_utf8_lossy(&page));
    };
    let written = std::fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(command, folder));
    written.with_context(|| format!("cannot write manual pages to {}", folder.display()))
}
