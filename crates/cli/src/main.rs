//! The `alhazen` command: arguments in, pictures out. Each subcommand is one file in `commands`.

mod commands;
mod console;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// A physically based ray tracer that always gives a picture.
#[derive(Debug, Parser)]
#[command(name = "alhazen", version, about, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(Box<commands::render::RenderArgs>),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        None => commands::render::run(&commands::render::RenderArgs::default_picture()),
        Some(Command::Render(args)) => commands::render::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::print_error(&error);
            ExitCode::FAILURE
        }
    }
}
