//! `alhazen bench denoise`: what denoisers are worth.

use super::denoise_frames::{self, Orbit};
use super::report::{Report, ReportArgs, Table};
use super::views::{View, ViewArgs};
use crate::commands::render::DenoiserName;
use crate::commands::render::parsing::parse_finite;
use crate::console::{print_result, say};
use alhazen::{Control, Image, Job, Limits, NoisyPicture, Renderer, metrics};
use anyhow::Context;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::time::Instant;

/// How much closer to a converged reference pictures come by denoising.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench denoise
  alhazen bench denoise room.glb --spp 4,64 --denoiser network,oidn --width 1280 --height 720
  alhazen bench denoise cornell --spp 4 --frames 12")]
pub struct DenoiseArgs {
    #[command(flatten)]
    views: ViewArgs,
    /// Samples per pixel of the pictures, separated by commas.
    #[arg(long, value_name = "LIST", default_value = "16", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    spp: Vec<u32>,
    /// Pictures of different noise.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// What denoises, separated by commas.
    #[arg(long, value_enum, value_name = "LIST", default_value = "network", value_delimiter = ',')]
    denoiser: Vec<DenoiserName>,
    /// Denoise a sequence of so many frames, too, in which the camera goes around what it looks at:
    /// the network with what frames before have found and without, all others frame by frame. Each
    /// frame has a reference.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000))]
    frames: Option<u32>,
    /// By how many degrees the camera goes around from frame to frame.
    #[arg(long, value_name = "DEGREES", default_value_t = 1.0, value_parser = parse_finite, allow_hyphen_values = true)]
    orbit: f32,
    /// Write the crops of the report to this folder, too: denoising-SCENE-SPP.png with the noisy
    /// picture, that of each denoiser and the reference side by side.
    #[arg(long, value_name = "FOLDER")]
    crops: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgs,
}

/// Means over the seeds, of one denoiser.
#[derive(Clone, Debug, Default)]
struct Measured {
    rel_mse: f64,
    flip: f64,
    /// FLIP between pictures of different noise.
    flicker: f64,
    /// Largest relative change of a colour's mean over the picture.
    energy: f64,
    seconds: f64,
    /// Milliseconds that the device's passes took; NaN on the CPU.
    device_ms: f64,
    /// The last one.
    picture: Option<Image>,
}

/// Columns of the table.
const COLUMNS: [&str; 10] = [
    "scene",
    "spp",
    "denoiser",
    "relMSE",
    "left",
    "FLIP",
    "flicker",
    "mean changed by",
    "seconds",
    "device ms",
];

/// Measures, prints and writes.
pub fn run(args: &DenoiseArgs) -> anyhow::Result<()> {
    if let Some(folder) = &args.crops {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let mut renderer = args.views.renderer()?;
    let mut settings = args.views.settings(&renderer);
    settings.push(("seeds", args.seeds.to_string()));
    let mut report = Report::new("denoise", "Denoising", &settings);
    report.text(
        "relMSE and FLIP against a converged reference; flicker: FLIP between pictures of different noise; means over \
         seeds. The geometric mean of what is left of the error is over all rows of a denoiser.",
    );
    let mut table = Table::new("error", "Error after denoising", &COLUMNS);
    let mut sequences = denoise_frames::table();
    let mut left = vec![Vec::new(); args.denoiser.len()];
    for scene in args.views.scenes()? {
        let view = args.views.open(scene, &mut renderer)?;
        for &spp in &args.spp {
            let measured = measure(&mut renderer, &view, spp, args)?;
            push_rows(&mut table, args, (&view.name, spp), &measured, &mut left);
            let pictures: Vec<Image> = measured.into_iter().filter_map(|m| m.picture).collect();
            let names = args.denoiser.iter().map(|d| name(*d)).collect::<Vec<_>>().join(", ");
            let title = format!("{}, {spp} samples: noisy, {names}, reference", view.name);
            let crops = view.crops(&[&pictures[..], std::slice::from_ref(&view.reference)].concat());
            report.picture(&title, &crops)?;
            if let Some(folder) = &args.crops {
                crops.write_png_encoded(&folder.join(format!("denoising-{}-{spp}.png", view.name)))?;
            }
            if let Some(frames) = args.frames {
                let orbit = Orbit { frames, step: args.orbit };
                let denoisers = &args.denoiser;
                denoise_frames::measure(
                    &mut renderer,
                    &view,
                    &args.views,
                    (spp, orbit),
                    denoisers,
                    &mut sequences,
                )?;
            }
        }
    }
    push_means(&mut table, args, &left);
    report.table(table);
    if args.frames.is_some() {
        report.text(
            "Sequences: means over all frames but the first. Flicker: FLIP between a frame and the one before moved to where it is \
             now, divided by that of the references.",
        );
        report.table(sequences);
    }
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// Rows of a view with `spp` samples: without denoising, and with each denoiser, whose logarithms
/// of what it leaves of the error go to `left`.
fn push_rows(
    table: &mut Table,
    args: &DenoiseArgs,
    (view, spp): (&str, u32),
    measured: &[Measured],
    left: &mut [Vec<f64>],
) {
    let before = measured[0].rel_mse;
    for (i, m) in measured.iter().enumerate() {
        let rest = m.rel_mse / before;
        let name = i.checked_sub(1).map_or("none".to_owned(), |i| name(args.denoiser[i]));
        let numbers = [m.rel_mse, rest, m.flip, m.flicker, m.energy, m.seconds, m.device_ms];
        let row = [view.into(), f64::from(spp).into(), name.as_str().into()];
        table.push(row.into_iter().chain(numbers.map(Into::into)).collect());
        if i > 0 {
            left[i - 1].push(rest.ln());
        }
    }
}

/// A row for each denoiser: what it leaves of the error, by the logarithms `left` of all its rows.
fn push_means(table: &mut Table, args: &DenoiseArgs, left: &[Vec<f64>]) {
    for (denoiser, logarithms) in args.denoiser.iter().zip(left) {
        let mean = (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp();
        let name = name(*denoiser);
        let row =
            ["geometric mean".into(), f64::NAN.into(), name.as_str().into(), f64::NAN.into(), mean.into()];
        table.push(row.into_iter().chain([f64::NAN; 5].map(Into::into)).collect());
    }
}

/// As on the command line.
pub(super) fn name(denoiser: DenoiserName) -> String {
    denoiser.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

/// The noisy pictures, and those of each denoiser.
fn measure(
    renderer: &mut Renderer,
    view: &View,
    spp: u32,
    args: &DenoiseArgs,
) -> anyhow::Result<Vec<Measured>> {
    let share = 1.0 / f64::from(args.seeds);
    let mut all = vec![Measured::default(); 1 + args.denoiser.len()];
    for seed in 1..=args.seeds {
        let job = Job { seed, aovs: NoisyPicture::LAYERS.to_vec(), ..view.job.clone() };
        renderer.restart();
        renderer.render(&job, &Limits { spp, ..Limits::default() }, &Control::new())?;
        let input = NoisyPicture::of_film(renderer.film()?.context("nothing was rendered")?)?;
        let noisy = &input.colour;
        renderer.take_passes();
        for (i, measured) in all.iter_mut().enumerate() {
            let begin = Instant::now();
            let picture = match i.checked_sub(1) {
                Some(i) => renderer.denoise(args.denoiser[i].into(), &input)?.picture,
                None => noisy.clone(),
            };
            measured.seconds += share * begin.elapsed().as_secs_f64();
            let passes = renderer.take_passes();
            let device: f64 = passes.iter().map(|pass| pass.duration.as_secs_f64()).sum();
            measured.device_ms += share * if passes.is_empty() { f64::NAN } else { 1e3 * device };
            let distance = view.distance(&picture)?;
            measured.rel_mse += share * distance.rel_mse;
            measured.flip += share * distance.flip;
            let means = noisy.mean().into_iter().zip(picture.mean());
            let changes = means.map(|(before, after)| (after / before.max(1e-9) - 1.0).abs());
            measured.energy = changes.fold(measured.energy, f64::max);
            if let Some(last) = &measured.picture {
                let flicker = metrics::flip(last, &picture, view.job.tone.exposure.log2())?.mean;
                measured.flicker += flicker / f64::from(args.seeds - 1);
            }
            measured.picture = Some(picture);
        }
    }
    Ok(all)
}
