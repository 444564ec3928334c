//! Commands for developers: `cargo xtask test`, `ci`, `python`, `gallery`, `bench`, `package`.

mod bench;
mod bench_peer;
mod bench_python;
mod bench_scaling;
mod ci;
mod cluster_tools;
mod cross;
mod display;
mod docs;
#[cfg(test)]
mod documents;
#[cfg(test)]
mod floors;
mod gallery;
mod learn;
mod package;
mod plot;
mod python;
mod shell;
mod tables;
mod test;
mod test_programs;
mod vulkan;
mod web;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Commands for developers of Alhazen.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Test(test::TestArgs),
    /// Check formatting, lints, documentation and tests, as continuous integration does.
    Ci,
    Cross(cross::CrossArgs),
    Docs(docs::DocsArgs),
    Gallery(gallery::GalleryArgs),
    /// Measure speed against other renderers.
    #[command(subcommand)]
    Bench(bench::BenchCommand),
    Package(Box<package::PackageArgs>),
    Python(python::PythonArgs),
    Vulkan(vulkan::VulkanArgs),
    Web(web::WebArgs),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Test(args) => test::run(&args),
        Command::Ci => ci::run(),
        Command::Cross(args) => cross::run(&args),
        Command::Docs(args) => docs::run(&args),
        Command::Gallery(args) => gallery::run(&args),
        Command::Bench(bench::BenchCommand::Cpu(args)) => bench::run(&args),
        Command::Bench(bench::BenchCommand::Scaling(args)) => bench_scaling::run(&args),
        Command::Bench(bench::BenchCommand::Python(args)) => bench_python::run(&args),
        Command::Package(args) => package::run(&args),
        Command::Python(args) => python::run(&args),
        Command::Vulkan(args) => vulkan::run(&args),
        Command::Web(args) => web::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            error.chain().skip(1).for_each(|cause| eprintln!("  because: {cause}"));
            ExitCode::FAILURE
        }
    }
}
