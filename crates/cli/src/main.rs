//! The `alhazen` command: arguments in, pictures out. Each subcommand is one file in `commands`.

#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the standard library"))]

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
    View(Box<commands::view::ViewArgs>),
    Merge(commands::merge::MergeArgs),
    Denoise(commands::denoise::DenoiseArgs),
    Tonemap(commands::tonemap::TonemapArgs),
    Submit(commands::submit::SubmitArgs),
    Info(commands::info::InfoArgs),
    Scenes(commands::scenes::ScenesArgs),
    Compare(commands::compare::CompareArgs),
    Explain(Box<commands::explain::ExplainArgs>),
    Bench(commands::bench::BenchArgs),
    Sensor(commands::sensor::SensorArgs),
    Dataset(commands::dataset::DatasetArgs),
    Doctor(commands::doctor::DoctorArgs),
    Completions(commands::completions::CompletionsArgs),
    Man(commands::man::ManArgs),
}

fn main() -> ExitCode {
    interrupt::exit_when_memory_ends();
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
        Some(Command::Explain(args)) => commands::explain::run(&args),
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

    use clap::builder::ValueParser;
    use clap::{Arg, Command};
    use std::any::TypeId;
    use std::ffi::OsString;
    use std::path::PathBuf;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    /// Calls `visit` with the name and the parser of every argument of a command and of those below it.
    fn visit_arguments(command: &Command, path: &str, visit: &mut dyn FnMut(&str, &ValueParser)) {
        let path = format!("{path} {}", command.get_name());
        for argument in command.get_arguments().filter(|a| a.get_action().takes_values()) {
            visit(&format!("{path} {}", argument.get_id()), argument.get_value_parser());
        }
        command.get_subcommands().for_each(|below| visit_arguments(below, &path, visit));
    }

    fn is_valid(parser: &ValueParser, text: &str) -> bool {
        let value = Arg::new("value").long("value").value_parser(parser.clone());
        Command::new("test").arg(value).try_get_matches_from(["test", &format!("--value={text}")]).is_ok()
    }

    /// Whatever has numbers in it refuses those that are none; only texts and paths may be called so.
    #[test]
    fn no_option_takes_what_is_not_finite() {
        let texts = [
            TypeId::of::<String>(),
            TypeId::of::<PathBuf>(),
            TypeId::of::<OsString>(),
            TypeId::of::<(String, String)>(),
            TypeId::of::<alhazen::TevAddress>(),
        ];
        let twelve =
            |at: usize| (0..12).map(|i| if i == at { "X" } else { "1" }).collect::<Vec<_>>().join(",");
        let mut forms: Vec<String> = (0..12).map(twelve).collect();
        let forms_of_few = [
            "X",
            "Xs",
            "Xm",
            "X%",
            "X,1",
            "1,X",
            "X..1",
            "1..X",
            "X,1,1",
            "1,X,1",
            "1,1,X",
            "X,1,1,1",
            "1,1,1,X",
            "X,1,1,1,1",
            "1,1,1,1,X",
            "2026-06-21T14:30+02:00@X,11",
            "2026-06-21T14:30+02:00@48,X",
        ];
        forms.extend(forms_of_few.map(String::from));
        let (mut numbers, mut lists) = (0, 0);
        visit_arguments(&Arguments::command(), "", &mut |name, parser| {
            if texts.iter().any(|text| parser.type_id() == *text) {
                return;
            }
            let is_number =
                parser.type_id() == TypeId::of::<f32>() || parser.type_id() == TypeId::of::<f64>();
            numbers += u32::from(is_number);
            lists += u32::from(
                !is_number && ["1,1", "1..2", "1,1,1", "1,1,1,1"].iter().any(|t| is_valid(parser, t)),
            );
            for form in &forms {
                for number in ["nan", "-inf", "1e999"] {
                    let text = form.replace('X', number);
                    assert!(!is_valid(parser, &text), "{name} takes {text}");
                }
            }
        });
        assert!(numbers >= 30 && lists >= 8, "{numbers} numbers and {lists} lists were found");
    }
}
