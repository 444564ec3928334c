//! The `alhazen` command: arguments in, pictures out. Each subcommand is one file in `commands`.

#![forbid(unsafe_code)]

mod commands;
mod console;
mod exit;
mod interrupt;
mod profile;
#[cfg(not(feature = "window"))]
mod windowless;

use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: alhazen::HugePages = alhazen::HugePages;

const EXAMPLES: &str = "\
Examples:
  alhazen                                  the default scene in a window, or in render.png
  alhazen view model.glb                   open a file in a window
  alhazen render model.glb -o model.png    render a file
  alhazen scenes                           list the built-in scenes
  alhazen help render                      all options of a command";

/// A physically based ray tracer that always gives a picture.
///
/// Without a command it opens the default scene in a window, or renders it to render.png where there is no display.
#[derive(Debug, Parser)]
#[command(name = "alhazen", version, propagate_version = true)]
#[command(after_help = format!("{EXAMPLES}\n\n{}", exit::HELP))]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(Box<commands::render::RenderArgs>),
    View(commands::view::ViewArgs),
    Merge(commands::merge::MergeArgs),
    Denoise(commands::denoise::DenoiseArgs),
    Tonemap(commands::tonemap::TonemapArgs),
    Submit(commands::submit::SubmitArgs),
    Info(commands::info::InfoArgs),
    Scenes(commands::scenes::ScenesArgs),
    Compare(commands::compare::CompareArgs),
    Bench(commands::bench::BenchArgs),
    Sensor(commands::sensor::SensorArgs),
    Dataset(commands::dataset::DatasetArgs),
    Doctor(commands::doctor::DoctorArgs),
    Completions(commands::completions::CompletionsArgs),
    Man(commands::man::ManArgs),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        None => commands::view::run_default()
            .unwrap_or_else(|| commands::render::run(&commands::render::RenderArgs::default_picture())),
        Some(Command::View(args)) => commands::view::run(&args),
        Some(Command::Render(args)) => commands::render::run(&args),
        Some(Command::Merge(args)) => commands::merge::run(&args),
        Some(Command::Denoise(args)) => commands::denoise::run(&args),
        Some(Command::Tonemap(args)) => commands::tonemap::run(&args),
        Some(Command::Submit(args)) => commands::submit::run(&args),
        Some(Command::Info(args)) => commands::info::run(&args),
        Some(Command::Scenes(args)) => commands::scenes::run(&args),
        Some(Command::Bench(args)) => commands::bench::run(&args),
        Some(Command::Compare(args)) => return commands::compare::run(&args),
        Some(Command::Sensor(args)) => commands::sensor::run(&args),
        Some(Command::Dataset(args)) => commands::dataset::run(&args),
        Some(Command::Doctor(args)) => commands::doctor::run(&args),
        Some(Command::Completions(args)) => commands::completions::run(&args, Arguments::command()),
        Some(Command::Man(args)) => commands::man::run(&args, Arguments::command()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::print_error(&error);
            ExitCode::from(exit::Exit::of(&error) as u8)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
