//! `alhazen bench`: measurements that anyone can repeat. Each subcommand is one file; what they have in common is
//! [`report`].

mod adaptive;
mod around;
mod backends;
mod batches;
mod convergence;
mod denoise;
mod denoise_frames;
mod frame_views;
mod frames;
mod frames_in_flight;
mod hard;
mod lights;
mod realtime;
pub mod report;
mod shadows;
mod stage;
mod tlas;
mod views;

use clap::{Args, Subcommand};

/// Measure Alhazen on this machine.
///
/// Every measurement prints a table and writes a folder with NAME.json (everything), NAME-TABLE.csv (each table) and
/// NAME.html (one page with plots, which needs no other file). The files name the device, its driver, the commit and all
/// settings.
#[derive(Debug, Args)]
pub struct BenchArgs {
    #[command(subcommand)]
    command: BenchCommand,
}

#[derive(Debug, Subcommand)]
enum BenchCommand {
    Adaptive(adaptive::AdaptiveArgs),
    Backends(backends::BackendsArgs),
    Batches(batches::BatchesArgs),
    Convergence(convergence::ConvergenceArgs),
    Denoise(denoise::DenoiseArgs),
    Hard(hard::HardArgs),
    Lights(lights::LightsArgs),
    FramesInFlight(frames_in_flight::FramesInFlightArgs),
    Realtime(Box<realtime::RealtimeArgs>),
    Shadows(shadows::ShadowArgs),
    Tlas(tlas::TlasArgs),
    Views(frame_views::ViewsArgs),
}

/// Measures what the arguments ask for.
pub fn run(args: &BenchArgs) -> anyhow::Result<()> {
    match &args.command {
        BenchCommand::Adaptive(args) => adaptive::run(args),
        BenchCommand::Backends(args) => backends::run(args),
        BenchCommand::Batches(args) => batches::run(args),
        BenchCommand::Convergence(args) => convergence::run(args),
        BenchCommand::Denoise(args) => denoise::run(args),
        BenchCommand::Hard(args) => hard::run(args),
        BenchCommand::Lights(args) => lights::run(args),
        BenchCommand::FramesInFlight(args) => frames_in_flight::run(args),
        BenchCommand::Realtime(args) => realtime::run(args),
        BenchCommand::Shadows(args) => shadows::run(args),
        BenchCommand::Tlas(args) => tlas::run(args),
        BenchCommand::Views(args) => frame_views::run(args),
    }
}
