//! `alhazen bench denoise`: what the denoiser is worth.

use super::ReportArgs;
use super::report::{Report, Table};
use super::views::{View, ViewArgs};
use crate::console::{print_result, say};
use alhazen::{Control, Denoiser, Image, Job, Limits, NoisyPicture, Renderer};
use anyhow::Context;
use clap::Args;
use std::time::Instant;

/// How much closer to a converged reference pictures come by denoising.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench denoise
  alhazen bench denoise room.glb --spp 4 --width 1280 --height 720")]
pub struct DenoiseArgs {
    #[command(flatten)]
    views: ViewArgs,
    /// Samples per pixel of the pictures.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..))]
    spp: u32,
    /// Pictures of different noise.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// Denoise with Open Image Denoise instead of our own filter.
    #[arg(long)]
    oidn: bool,
    #[command(flatten)]
    report: ReportArgs,
}

/// Means over the seeds, before and after.
#[derive(Clone, Debug, Default)]
struct Measured {
    rel_mse: [f64; 2],
    flip: [f64; 2],
    /// Largest relative change of a colour's mean over the picture.
    energy: f64,
    seconds: f64,
    pictures: Vec<Image>,
}

/// Measures, prints and writes.
pub fn run(args: &DenoiseArgs) -> anyhow::Result<()> {
    let mut renderer = args.views.renderer()?;
    let mut settings = args.views.settings(&renderer);
    settings.push(("spp", args.spp.to_string()));
    settings.push(("seeds", args.seeds.to_string()));
    settings.push(("denoiser", if args.oidn { "Open Image Denoise" } else { "our own" }.to_owned()));
    let mut report = Report::new("denoise", "Denoising", &settings);
    report.text("relMSE and FLIP of pictures against a converged reference, before and after denoising; means over seeds.");
    let columns = [
        "scene",
        "relMSE before",
        "after",
        "gain",
        "FLIP before",
        "FLIP after",
        "mean changed by",
        "seconds",
    ];
    let mut table = Table::new("error", "Error before and after", &columns);
    let mut gains = Vec::new();
    let mut crops = Vec::new();
    for scene in args.views.scenes()? {
        let view = args.views.open(scene, &mut renderer)?;
        let m = measure(&mut renderer, &view, args)?;
        let gain = m.rel_mse[0] / m.rel_mse[1];
        gains.push(gain);
        let numbers = [m.rel_mse[0], m.rel_mse[1], gain, m.flip[0], m.flip[1], m.energy, m.seconds];
        table.push([view.name.as_str().into()].into_iter().chain(numbers.map(Into::into)).collect());
        let pictures = [&m.pictures[..], std::slice::from_ref(&view.reference)].concat();
        crops.push((format!("{}: noisy, denoised, reference", view.name), view.crops(&pictures)));
    }
    let mean = gains.iter().sum::<f64>() / gains.len() as f64;
    let blank = f64::NAN;
    let numbers = [blank, blank, mean, blank, blank, blank, blank];
    table.push(["mean".into()].into_iter().chain(numbers.map(Into::into)).collect());
    report.table(table);
    for (title, picture) in crops {
        report.picture(&title, &picture)?;
    }
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

fn measure(renderer: &mut Renderer, view: &View, args: &DenoiseArgs) -> anyhow::Result<Measured> {
    let denoiser = if args.oidn { Denoiser::Oidn } else { Denoiser::Own };
    let share = 1.0 / f64::from(args.seeds);
    let mut measured = Measured::default();
    for seed in 1..=args.seeds {
        let job = Job { seed, aovs: NoisyPicture::LAYERS.to_vec(), ..view.job.clone() };
        renderer.restart();
        renderer.render(&job, &Limits { spp: args.spp, ..Limits::default() }, &Control::new())?;
        let film = renderer.film()?.context("nothing was rendered")?;
        let begin = Instant::now();
        let denoised = denoiser.run(film)?;
        measured.seconds += share * begin.elapsed().as_secs_f64();
        let pictures = vec![film.to_image(), denoised.picture];
        for (i, picture) in pictures.iter().enumerate() {
            let distance = view.distance(picture)?;
            measured.rel_mse[i] += share * distance.rel_mse;
            measured.flip[i] += share * distance.flip;
        }
        let means = pictures[0].mean().into_iter().zip(pictures[1].mean());
        let changes = means.map(|(before, after)| (after / before.max(1e-9) - 1.0).abs());
        measured.energy = changes.fold(measured.energy, f64::max);
        measured.pictures = pictures;
    }
    Ok(measured)
}
