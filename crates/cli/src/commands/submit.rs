//! `alhazen submit`: jobs for the engines that clusters already have.

mod openjd;
mod plan;
mod slurm;

use super::render::check_place;
use crate::console::{print_result, say, write_text};
use anyhow::Context;
use plan::JobPlan;
use std::num::NonZeroU32;
use std::path::PathBuf;

/// Make a job for a cluster: tiles and ranges of samples as tasks, then a merge.
///
/// What to render follows `--`, as for `alhazen render`. The job is written, not submitted: the engine's own command does
/// that, and retries what fails. `alhazen` must be found on the path of the machines that work, and the files must be
/// where they are here, or where the engine maps them to.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen submit openjd --tiles 4 --job job.json -- model.glb --frames 0..240 -o out/frame-####.exr
  openjd run job.json                                     on this machine
  deadline bundle submit .                                on AWS Deadline Cloud; the job is template.json then
  alhazen submit slurm --tiles 4 --sample-ranges 8 --job job.sh -- atrium --spp 4096 -o atrium.exr
  bash job.sh --partition=long                            on a cluster with Slurm")]
pub struct SubmitArgs {
    #[command(subcommand)]
    engine: Engine,
}

#[derive(Debug, clap::Subcommand)]
enum Engine {
    /// A job template of Open Job Description 2023-09, as JSON: for openjd-cli and AWS Deadline Cloud.
    Openjd(JobArgs),
    /// A script that submits itself to Slurm as an array of tasks and a merge that waits for them.
    Slurm(JobArgs),
}

/// How to divide a render.
#[derive(Debug, clap::Args)]
struct JobArgs {
    /// Tiles of each picture.
    #[arg(long, value_name = "N", default_value = "1")]
    tiles: NonZeroU32,
    /// Ranges of samples of each tile.
    #[arg(long, value_name = "N", default_value = "1")]
    sample_ranges: NonZeroU32,
    /// Name of the job [default: the first output's].
    #[arg(long)]
    name: Option<String>,
    /// File to write the job to [default: stdout].
    #[arg(long, value_name = "FILE")]
    job: Option<PathBuf>,
    /// Arguments of `alhazen render`, after `--`.
    #[arg(last = true, value_name = "RENDER ARGUMENTS")]
    render: Vec<String>,
}

/// Writes the job.
pub fn run(args: &SubmitArgs) -> anyhow::Result<()> {
    let (Engine::Openjd(job_args) | Engine::Slurm(job_args)) = &args.engine;
    let plan = JobPlan::new(&job_args.render, job_args.tiles.get(), job_args.sample_ranges.get())?;
    let name = job_args.name.clone().unwrap_or_else(|| plan.stem());
    let text = match &args.engine {
        Engine::Openjd(_) => {
            let folder = job_args.job.as_deref().and_then(|job| job.parent());
            let job = openjd::Job::new(&plan, &name, folder.unwrap_or("".as_ref()))?;
            job.notices.iter().for_each(|notice| say!("{notice}"));
            job.text
        }
        Engine::Slurm(_) => slurm::script(&plan, &name),
    };
    match &job_args.job {
        None => print_result(&text),
        Some(path) => {
            check_place(path)?;
            write_text(path, &text).with_context(|| format!("cannot write the job {}", path.display()))
        }
    }
}
