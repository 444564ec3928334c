//! `cargo xtask bench scaling`: what more threads bring, as a ratio to one thread.
//!
//! Many short pairs instead of a few long ones: on a shared machine the clock and the neighbours change within seconds, and
//! a pair is worth something only if they stay the same during it.

use crate::bench::{column, data, run_ours, scene_files, spread, task, write};
use crate::bench_peer::Task;
use crate::plot::{Bar, bars};
use crate::shell::{commit, release_binary};
use anyhow::Context;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The CPU back end on several threads against one, in turns: the scenes of `bench cpu`, 512×512 pixels, depth 8.
#[derive(Debug, clap::Args)]
pub struct ScalingArgs {
    /// Threads to compare with one [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=4096))]
    threads: Option<u32>,
    /// Folder with the scenes, as for `bench cpu`.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Samples per pixel.
    #[arg(long, default_value_t = 16)]
    spp: u32,
    /// Pairs of runs for each scene.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Only scenes whose name contains this.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Write all numbers to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the plot to this file.
    #[arg(long, value_name = "FILE", default_value = "target/bench/scaling.svg")]
    plot: PathBuf,
}

/// Pairs of runs of one scene, in Msamples/s.
struct Measured {
    name: &'static str,
    one: Vec<f64>,
    many: Vec<f64>,
}

impl Measured {
    fn ratios(&self) -> Vec<f64> {
        self.many.iter().zip(&self.one).map(|(many, one)| many / one).collect()
    }
}

/// Measures, prints and plots.
pub fn run(args: &ScalingArgs) -> anyhow::Result<()> {
    let binary = release_binary()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.threads.unwrap_or(cores as u32).max(2);
    let task = task(args.spp, "");
    let folder = data(args.data.as_deref(), None)?;
    println!("scene      one Ms/s   {threads} threads   ratio (middle half, extremes)");
    let mut all = Vec::new();
    for (name, _, file) in scene_files(&folder, args.only.as_deref())? {
        let mut measured = Measured { name, one: vec![], many: vec![] };
        for round in 0..args.repeat {
            // Which of the two comes first alternates: what changes slowly cancels out.
            let turns = if round % 2 == 0 { [1, threads] } else { [threads, 1] };
            for count in turns {
                let rate = rate(&binary, &file, &task, count)?;
                let of = if count == 1 { &mut measured.one } else { &mut measured.many };
                of.push(rate);
            }
        }
        println!("{}", row(&measured));
        all.push(measured);
    }
    write_results(args, threads, &all)
}

/// Msamples/s on so many threads.
fn rate(binary: &Path, file: &Path, task: &Task, threads: u32) -> anyhow::Result<f64> {
    let threads = threads.to_string();
    let result = run_ours(binary, file, task, &["--backend", "cpu", "--threads", &threads])?;
    column(&[result], "msamples_s").first().copied().context("no speed")
}

/// The quartiles: a quarter of the values is below the first, half below the second, three quarters below the third.
fn quartiles(values: &[f64]) -> Option<[f64; 3]> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let [_, median, _] = spread(values)?;
    let n = sorted.len();
    Some([sorted[n / 4], median, sorted[n - 1 - n / 4]])
}

fn row(m: &Measured) -> String {
    let median = |values: &[f64]| spread(values).map_or(0.0, |[_, x, _]| x);
    let ratios = m.ratios();
    let [least, _, most] = spread(&ratios).unwrap_or_default();
    let [low, middle, high] = quartiles(&ratios).unwrap_or_default();
    format!(
        "{:<9} {:>9.3}  {:>10.3}   {middle:.3} ({low:.2} to {high:.2}, {least:.2} to {most:.2})",
        m.name,
        median(&m.one),
        median(&m.many),
    )
}

fn write_results(args: &ScalingArgs, threads: u32, all: &[Measured]) -> anyhow::Result<()> {
    let bar = |m: &Measured| Some(Bar { name: m.name.into(), ratio: quartiles(&m.ratios())? });
    let title = format!("{threads} threads against one (median and middle half of {} pairs)", args.repeat);
    write(&args.plot, &bars(&title, &all.iter().filter_map(bar).collect::<Vec<_>>()))?;
    println!("plot: {}", args.plot.display());
    let Some(path) = &args.json else { return Ok(()) };
    let scene = |m: &Measured| -> Value {
        json!({ "scene": m.name, "ratio": quartiles(&m.ratios()), "ratios": m.ratios(), "one": m.one, "many": m.many })
    };
    let results = json!({
        "commit": commit(),
        "command": format!("cargo xtask bench scaling --threads {threads} --spp {} --repeat {}", args.spp, args.repeat),
        "threads": threads, "spp": args.spp, "repeat": args.repeat,
        "scenes": all.iter().map(scene).collect::<Vec<_>>(),
    });
    write(path, &format!("{results:#}\n"))?;
    println!("numbers: {}", path.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_cut_off_a_quarter_on_each_side() {
        assert_eq!(quartiles(&[]), None);
        assert_eq!(quartiles(&[2.0]), Some([2.0, 2.0, 2.0]));
        assert_eq!(quartiles(&[8.0, 1.0, 7.0, 2.0, 6.0, 3.0, 5.0, 4.0]), Some([3.0, 4.5, 6.0]));
    }

    #[test]
    fn ratios_are_those_of_pairs() {
        let measured = Measured { name: "x", one: vec![1.0, 2.0], many: vec![2.0, 3.0] };
        assert_eq!(measured.ratios(), [2.0, 1.5]);
    }
}
