//! `cargo xtask bench cpu`: speed as a ratio against another renderer, measured in turns.
//!
//! Absolute figures move with the machine's load and clock, so every run of ours is followed by one of the peer's, and
//! the ratio of the two is what is reported: its median and its spread.

use crate::bench_peer::{Peer, Renderer, Task};
use crate::bench_python::PythonBenchArgs;
use crate::bench_scaling::ScalingArgs;
use crate::plot::{Bar, bars};
use crate::shell::{commit, output, python_with, release_binary, root, shared_dir};
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Scenes that `make_scenes.py` writes, and what to know of their comparison.
const SCENES: [(&str, &str); 4] = [
    ("cornell", "diffuse"),
    ("spheres", "glTF metallic-roughness with energy compensation here, the principled BSDF there"),
    ("glass", "diffuse and smooth dielectrics"),
    ("hairy", "diffuse; 2 million triangles, 112 million with all instances"),
];

const SIZE: u32 = 512;
const MAX_DEPTH: u32 = 8;
const ROULETTE_START: u32 = 5;

/// What to measure.
#[derive(Debug, clap::Subcommand)]
pub enum BenchCommand {
    Cpu(CpuArgs),
    Scaling(ScalingArgs),
    Python(PythonBenchArgs),
}

/// The CPU back end against another renderer: 512×512 pixels, depth 8, Russian roulette from depth 5, box filter.
#[derive(Debug, clap::Args)]
pub struct CpuArgs {
    /// The other renderer.
    #[arg(long, value_enum, default_value_t = Renderer::Mitsuba)]
    peer: Renderer,
    /// A Python that has mitsuba or bpy; without one only our own speed is measured [default: the one on the path].
    #[arg(long, value_name = "PATH")]
    python: Option<PathBuf>,
    /// Folder with cornell.glb, spheres.glb, glass.glb and hairy.glb [default: written to target/bench by
    /// tools/make_scenes.py of the shared data, which needs a Python with numpy].
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Samples per pixel.
    #[arg(long, default_value_t = 64)]
    spp: u32,
    /// Runs of each renderer for each scene.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    repeat: u32,
    /// Only scenes whose name contains this.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Mitsuba's variant.
    #[arg(long, default_value = "llvm_ad_rgb")]
    variant: String,
    /// Write all numbers to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the plot to this file.
    #[arg(long, value_name = "FILE", default_value = "target/bench/cpu.svg")]
    plot: PathBuf,
}

/// Runs of both renderers on one scene, in Msamples/s.
#[derive(Debug)]
struct Measured {
    name: &'static str,
    note: &'static str,
    ours: Vec<Value>,
    theirs: Vec<Value>,
    ratios: Vec<f64>,
}

/// Measures, prints and plots.
pub fn run(args: &CpuArgs) -> anyhow::Result<()> {
    let binary = release_binary()?;
    let peer = Peer::find(args.peer, args.python.as_deref());
    let folder = data(args.data.as_deref(), args.python.as_deref())?;
    let task = task(args.spp, &args.variant);
    println!("scene      ours Ms/s   peer Ms/s   ratio (spread)        peak memory, ours / peer");
    let mut all = Vec::new();
    for (name, note, file) in scene_files(&folder, args.only.as_deref())? {
        let mut measured = Measured { name, note, ours: vec![], theirs: vec![], ratios: vec![] };
        for _ in 0..args.repeat {
            measured.ours.push(run_ours(&binary, &file, &task, &[])?);
            if let Some(peer) = &peer {
                measured.theirs.push(peer.run(&file, &task)?);
                let last = |runs: &[Value], key: &str| runs.last().and_then(|r| r[key].as_f64());
                let ours = last(&measured.ours, "msamples_s").context("no speed of ours")?;
                let theirs = last(&measured.theirs, "msamples_s").context("no speed of the peer")?;
                measured.ratios.push(ours / theirs);
            }
        }
        println!("{}", row(&measured));
        all.push(measured);
    }
    write_results(args, &all)
}

/// What every renderer is asked for.
pub fn task(spp: u32, variant: &str) -> Task {
    Task { size: SIZE, spp, max_depth: MAX_DEPTH, roulette_start: ROULETTE_START, variant: variant.into() }
}

/// Name, note and file of each scene whose name contains `only`.
pub fn scene_files(
    folder: &Path,
    only: Option<&str>,
) -> anyhow::Result<Vec<(&'static str, &'static str, PathBuf)>> {
    let wanted: Vec<_> =
        SCENES.into_iter().filter(|(name, _)| only.is_none_or(|only| name.contains(only))).collect();
    ensure!(!wanted.is_empty(), "no scene is called anything like `{}`", only.unwrap_or_default());
    let file = |(name, note)| {
        let file = folder.join(format!("{name}.glb"));
        ensure!(file.is_file(), "{} is missing", file.display());
        Ok((name, note, file))
    };
    wanted.into_iter().map(file).collect()
}

/// The folder with the scenes, which are written if need be.
pub fn data(folder: Option<&Path>, python: Option<&Path>) -> anyhow::Result<PathBuf> {
    if let Some(folder) = folder {
        return Ok(folder.to_owned());
    }
    let folder = root().join("target/bench");
    let missing = SCENES.iter().map(|(name, _)| *name).filter(|n| !folder.join(format!("{n}.glb")).is_file());
    let missing: Vec<_> = missing.collect();
    if missing.is_empty() {
        return Ok(folder);
    }
    let script = shared_dir().map(|dir| dir.join("tools/make_scenes.py")).filter(|s| s.is_file());
    let Some(script) = script else { bail!("no scenes: name their folder with --data") };
    let python = python_with(python, "numpy").or_else(|| python_with(None, "numpy"));
    let python = python.context("no scenes, and no Python with numpy to make them (--python PATH)")?;
    eprintln!("writing {} to {}", missing.join(", "), folder.display());
    output(Command::new(python).arg(script).arg(&folder).args(&missing))?;
    Ok(folder)
}

/// Renders a scene with the release binary and more `arguments`; returns what it said, with `msamples_s`.
pub fn run_ours(binary: &Path, file: &Path, task: &Task, arguments: &[&str]) -> anyhow::Result<Value> {
    let picture =
        root().join("target/bench").join(file.with_extension("exr").file_name().unwrap_or_default());
    std::fs::create_dir_all(root().join("target/bench"))?;
    let (size, spp) = (task.size.to_string(), task.spp.to_string());
    let mut command = Command::new(binary);
    command.arg("render").arg(file).arg("--output").arg(&picture).args(["--quiet", "--json", "--lenient"]);
    command.args(["--width", &size, "--height", &size, "--spp", &spp]);
    command.args(["--max-depth", &task.max_depth.to_string()]);
    command.args(["--roulette-start", &task.roulette_start.to_string()]).args(arguments);
    let mut result = last_line_as_json(&output(&mut command)?)?;
    let rate = result["samples_per_second"].as_f64().context("no samples_per_second")?;
    result["msamples_s"] = json!(rate / 1e6);
    result["scene"] = json!(file.file_name().unwrap_or_default().to_string_lossy());
    result["output"] = Value::Null;
    Ok(result)
}

/// What a program said last.
pub fn last_line_as_json(text: &str) -> anyhow::Result<Value> {
    let line = text.lines().rfind(|l| l.starts_with('{')).context("no JSON in the output")?;
    serde_json::from_str(line).context("the output is not JSON")
}

/// Smallest, median and largest.
pub fn spread(values: &[f64]) -> Option<[f64; 3]> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n == 0 {
        return None;
    }
    Some([sorted[0], (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0, sorted[n - 1]])
}

/// A number of each run.
pub fn column(runs: &[Value], key: &str) -> Vec<f64> {
    runs.iter().filter_map(|r| r[key].as_f64()).collect()
}

fn row(m: &Measured) -> String {
    let median = |values: Vec<f64>| spread(&values).map_or("-".into(), |[_, x, _]| format!("{x:.3}"));
    let ratio = spread(&m.ratios).map_or("-".into(), |[a, x, b]| format!("{x:.2} ({a:.2} to {b:.2})"));
    let mebibytes: Vec<_> =
        column(&m.ours, "peak_memory_bytes").iter().map(|b| b / f64::from(1 << 20)).collect();
    let memory = |values: Vec<f64>| spread(&values).map_or("-".into(), |[_, _, x]| format!("{x:.0} MB"));
    format!(
        "{:<9} {:>10}  {:>10}   {:<20}  {} / {}",
        m.name,
        median(column(&m.ours, "msamples_s")),
        median(column(&m.theirs, "msamples_s")),
        ratio,
        memory(mebibytes),
        memory(column(&m.theirs, "rss_peak_mb")),
    )
}

fn write_results(args: &CpuArgs, all: &[Measured]) -> anyhow::Result<()> {
    let plotted: Vec<_> =
        all.iter().filter_map(|m| Some(Bar { name: m.name.into(), ratio: spread(&m.ratios)? })).collect();
    if !plotted.is_empty() {
        let peer = args.peer.name();
        let title = format!("Samples per second against {peer} (median, spread of {})", args.repeat);
        write(&args.plot, &bars(&title, &plotted))?;
        println!("plot: {}", args.plot.display());
    }
    let Some(path) = &args.json else { return Ok(()) };
    let scene = |m: &Measured| {
        json!({ "scene": m.name, "note": m.note, "ratio": spread(&m.ratios), "ratios": m.ratios, "ours": m.ours,
            "peer": m.theirs })
    };
    let peer = args.peer.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned());
    let results = json!({
        "commit": commit(),
        // Where things lie on this machine is of no use to others.
        "command": format!("cargo xtask bench cpu --peer {peer} --spp {} --repeat {}", args.spp, args.repeat),
        "peer": args.peer.name(),
        "threads": std::thread::available_parallelism().map_or(1, usize::from),
        "width": SIZE, "height": SIZE, "spp": args.spp, "max_depth": MAX_DEPTH, "roulette_start": ROULETTE_START,
        "filter": "box", "repeat": args.repeat,
        "scenes": all.iter().map(scene).collect::<Vec<_>>(),
    });
    write(path, &format!("{results:#}\n"))?;
    println!("numbers: {}", path.display());
    Ok(())
}

/// Writes a file and the folders that it lies in.
pub fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_lies_between_the_extremes() {
        assert_eq!(spread(&[]), None);
        assert_eq!(spread(&[3.0, 1.0, 2.0]), Some([1.0, 2.0, 3.0]));
        assert_eq!(spread(&[4.0, 1.0, 2.0, 3.0]), Some([1.0, 2.5, 4.0]));
    }

    #[test]
    fn scenes_that_are_not_there_are_named() {
        let error = |only| scene_files(Path::new("nowhere"), Some(only)).unwrap_err().to_string();
        assert!(error("teapot").contains("`teapot`"), "{}", error("teapot"));
        assert!(error("glass").contains("glass.glb is missing"), "{}", error("glass"));
    }

    #[test]
    fn the_result_is_the_last_line_that_is_json() {
        let value = last_line_as_json("warning\n{\"a\": 1}\n{\"a\": 2}\nbye\n").unwrap();
        assert_eq!(value["a"], 2);
        assert!(last_line_as_json("nothing").is_err());
    }
}
