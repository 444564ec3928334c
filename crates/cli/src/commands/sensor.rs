//! `alhazen sensor`: what a sensor would measure in a scene.

use super::render::parsing::{parse_finite_f64, parse_not_negative, parse_not_negative_f64, parse_threads};
use crate::console::{bytes, keep_each, print_report, say, seconds};
use crate::exit::Exit;
use crate::interrupt::cancel_on_signal;
use alhazen::{ProtectedFiles, RayQueries, SceneTables, prove_writable};
use anyhow::{Context, ensure};
use clap::{Subcommand, ValueEnum};
use glam::{DAffine3, DMat3, DVec3};
use sensors::{Lidar, ReturnMode, level_pose};
use std::path::PathBuf;
use std::time::Instant;

/// Measure a scene as a sensor would.
#[derive(Debug, clap::Args)]
pub struct SensorArgs {
    #[command(subcommand)]
    sensor: Sensor,
}

#[derive(Debug, Subcommand)]
enum Sensor {
    Lidar(Box<LidarArgs>),
}

/// Scan a scene with a spinning laser scanner.
///
/// The sensor's axes are x forward, y left, z up; points are written in them. Without --pose it stands level at --position.
/// Intensity is the share of light that comes back: 1 is a white diffuse surface that faces the sensor, at any distance;
/// it falls with the cosine of the angle of incidence.
/// Clear glass lets beams through and dims what is behind it twice; media (fog, rain) dim it by their extinction. Beams are
/// followed on the CPU.
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  alhazen sensor lidar street.glb --position 0,1.8,0 -o scan.ply
  alhazen sensor lidar street.glb --position 0,1.8,0 --channels 128 --elevation -25..15 --noise 0.02 -o scan.npz")]
struct LidarArgs {
    /// Scene file or name of a built-in scene.
    #[arg(value_name = "FILE|SCENE")]
    scene: String,
    /// Point cloud to write: .ply or .npz.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Parameter of the scene, as NAME=VALUE. May be given several times.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = super::parse_parameter)]
    parameters: Vec<(String, String)>,
    #[command(flatten)]
    loading: super::loading::LoadingArgs,

    /// Where the sensor stands, in metres.
    #[arg(long, help_heading = "Place", value_name = "X,Y,Z", value_parser = parse_list::<3>, default_value = "0,0,0", allow_hyphen_values = true)]
    position: [f64; 3],
    /// Where it looks, in degrees counter-clockwise seen from above; 0 is towards -Z.
    #[arg(long, help_heading = "Place", value_name = "DEGREES", default_value_t = 0.0, value_parser = parse_finite_f64)]
    heading: f64,
    /// Sensor to world instead: twelve numbers, the rows of a rotation and a translation.
    #[arg(long, help_heading = "Place", value_name = "LIST", value_parser = parse_list::<12>, allow_hyphen_values = true, conflicts_with_all = ["position", "heading"])]
    pose: Option<[f64; 12]>,

    /// Number of lasers, at equal angles.
    #[arg(long, help_heading = "Sensor", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=65_535))]
    channels: u32,
    /// Lowest and highest elevation, in degrees.
    #[arg(long, help_heading = "Sensor", value_name = "A..B", value_parser = parse_range, default_value = "-25..15", allow_hyphen_values = true)]
    elevation: (f64, f64),
    /// Elevation of each laser, in degrees, separated by commas; instead of --channels and --elevation.
    #[arg(
        long,
        help_heading = "Sensor",
        value_name = "LIST",
        value_delimiter = ',',
        value_parser = parse_finite_f64,
        allow_hyphen_values = true
    )]
    elevations: Vec<f64>,
    /// Firings of a turn.
    #[arg(long, help_heading = "Sensor", default_value_t = 1024)]
    azimuths: u32,
    /// Azimuths between which it measures, in degrees; 0 is forward, counter-clockwise.
    #[arg(long, help_heading = "Sensor", value_name = "A..B", value_parser = parse_range, default_value = "0..360", allow_hyphen_values = true)]
    azimuth: (f64, f64),
    /// Ranges that are measured, in metres. What is nearer blocks the beam.
    #[arg(long, help_heading = "Sensor", value_name = "A..B", value_parser = parse_range, default_value = "0.5..120")]
    range: (f64, f64),
    /// Full angle of a beam, in milliradians.
    #[arg(long, help_heading = "Sensor", value_name = "MRAD", default_value_t = 0.0, value_parser = parse_not_negative_f64)]
    divergence: f64,
    /// Rays that sample a beam with a divergence.
    #[arg(long, help_heading = "Sensor", value_name = "N", default_value_t = 16)]
    beam_rays: u32,
    /// Which return counts where a beam meets several surfaces.
    #[arg(long, help_heading = "Sensor", value_enum, default_value_t = ReturnName::Strongest)]
    returns: ReturnName,
    /// Surfaces closer to each other than this melt into one return, in metres.
    #[arg(long, help_heading = "Sensor", value_name = "METRES", default_value_t = 0.3, value_parser = parse_not_negative)]
    range_resolution: f32,
    /// Standard deviation of the range, in metres.
    #[arg(long, help_heading = "Sensor", value_name = "METRES", default_value_t = 0.0, value_parser = parse_not_negative)]
    noise: f32,
    /// Returns of lower intensity are lost.
    #[arg(long, help_heading = "Sensor", value_name = "SHARE", default_value_t = 0.0, value_parser = parse_not_negative)]
    min_intensity: f32,
    /// Seed of the noise.
    #[arg(long, help_heading = "Sensor", default_value_t = 0)]
    seed: u32,

    /// Number of threads [default: all cores].
    #[arg(long, help_heading = "Running", value_parser = parse_threads)]
    threads: Option<usize>,
    /// No report.
    #[arg(short, long, help_heading = "Running")]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ReturnName {
    /// The nearest.
    First,
    /// The one with the highest intensity.
    Strongest,
    /// The farthest.
    Last,
    /// Every one, nearest first.
    All,
}

/// Measures what the arguments ask for.
pub fn run(args: &SensorArgs) -> anyhow::Result<()> {
    match &args.sensor {
        Sensor::Lidar(args) => lidar(args),
    }
}

fn lidar(args: &LidarArgs) -> anyhow::Result<()> {
    let sensor = sensor(args).map_err(|error| Exit::Usage.or(error))?;
    prove_writable(&args.output)?;
    let options = args.loading.options();
    let _limit = super::loading::memory_limit(&options);
    let loaded = super::load_scene(&args.scene, &args.parameters, &options)?;
    ProtectedFiles::new(options.files_read.list()).check(&args.output)?;
    if !args.quiet {
        print_report(&loaded.report, false);
    }
    let mut pose = pose(args);
    pose.translation -= loaded.scene.origin;
    let start = Instant::now();
    let queries = RayQueries::new(SceneTables::build(&loaded.scene), args.threads)?;
    let built = start.elapsed();
    let start = Instant::now();
    let cloud = sensor.scan(&queries, &pose, &cancel_on_signal()).context("cannot scan")?;
    let scanned = start.elapsed();
    keep_each(std::slice::from_ref(&args.output), |path| Ok(cloud.write(path)?))?;
    if !args.quiet {
        let beams = sensor.elevations.len() * sensor.azimuths as usize;
        // The points of a beam follow each other.
        let mut returned: Vec<_> = cloud.firings.iter().zip(&cloud.channels).collect();
        returned.dedup();
        say!(
            "{} of {beams} beams came back{}; structures built in {}, scanned in {}; {}: {}",
            returned.len(),
            if returned.len() == cloud.len() { String::new() } else { format!(" ({} points)", cloud.len()) },
            seconds(built),
            seconds(scanned),
            args.output.display(),
            bytes(std::fs::metadata(&args.output).map_or(0, |m| m.len())),
        );
    }
    Ok(())
}

fn sensor(args: &LidarArgs) -> anyhow::Result<Lidar> {
    let (low, high) = args.elevation;
    let mut lidar = Lidar::uniform(args.channels, low.to_radians(), high.to_radians(), args.azimuths);
    if !args.elevations.is_empty() {
        lidar.elevations = args.elevations.iter().map(|e| e.to_radians()).collect();
    }
    let (first, end) = args.azimuth;
    ensure!(first < end && end - first <= 360.0, "--azimuth {first}..{end} is empty or more than a turn");
    lidar.first_azimuth = first.to_radians();
    lidar.sweep = (end - first).to_radians();
    (lidar.min_range, lidar.max_range) = (args.range.0 as f32, args.range.1 as f32);
    lidar.divergence = args.divergence * 1e-3;
    lidar.beam_rays = if args.divergence > 0.0 { args.beam_rays } else { 1 };
    lidar.mode = match args.returns {
        ReturnName::First => ReturnMode::First,
        ReturnName::Strongest => ReturnMode::Strongest,
        ReturnName::Last => ReturnMode::Last,
        ReturnName::All => ReturnMode::All,
    };
    lidar.range_resolution = args.range_resolution;
    lidar.range_noise = args.noise;
    lidar.min_intensity = args.min_intensity;
    lidar.seed = args.seed;
    Ok(lidar)
}

fn pose(args: &LidarArgs) -> DAffine3 {
    match args.pose {
        None => level_pose(DVec3::from(args.position), args.heading.to_radians()),
        Some(m) => {
            let column = |i: usize| DVec3::new(m[i], m[4 + i], m[8 + i]);
            DAffine3::from_mat3_translation(DMat3::from_cols(column(0), column(1), column(2)), column(3))
        }
    }
}

fn parse_list<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|t| t.trim().parse()).collect();
    let numbers = numbers.ok().filter(|n| n.iter().all(|x| x.is_finite()));
    numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| format!("expected {N} numbers separated by commas"))
}

fn parse_range(text: &str) -> Result<(f64, f64), String> {
    let number = |t: &str| t.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let parts = text.split_once("..").and_then(|(a, b)| number(a).zip(number(b)));
    parts.ok_or_else(|| "expected two numbers: A..B".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_lists_are_parsed() {
        assert_eq!(parse_range("-25..15.5"), Ok((-25.0, 15.5)));
        assert!(
            parse_range("-25").is_err() && parse_range("a..b").is_err() && parse_range("0..inf").is_err()
        );
        assert_eq!(parse_list::<3>("1, -2,3e1"), Ok([1.0, -2.0, 30.0]));
        assert!(parse_list::<3>("1,2").is_err() && parse_list::<3>("1,2,nan").is_err());
    }
}
