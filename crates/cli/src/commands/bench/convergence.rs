//! `alhazen bench convergence`: how the error of a picture falls.

use super::report::{Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::views::{View, ViewArgs, render};
use crate::console::{print_result, say};
use alhazen::{Image, Job, Limits, Renderer};
use clap::Args;

/// How the error of pictures falls with samples, rays and time: relMSE and FLIP against a converged reference.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench convergence cornell --spp 4,16,64
  alhazen bench convergence model.glb --backend gpu --width 1280 --height 720 --report model")]
pub struct ConvergenceArgs {
    #[command(flatten)]
    views: ViewArgs,
    /// Samples per pixel to measure at, separated by commas.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [4, 16, 64, 256])]
    spp: Vec<u32>,
    /// Pictures of different noise at each number of samples.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    #[command(flatten)]
    report: ReportArgs,
}

/// What was measured at one number of samples; every list has a value for each seed.
#[derive(Debug, Default)]
struct Measured {
    rays: Vec<f64>,
    seconds: Vec<f64>,
    rel_mse: Vec<f64>,
    flip: Vec<f64>,
}

/// Measures, prints and writes.
pub fn run(args: &ConvergenceArgs) -> anyhow::Result<()> {
    let mut renderer = args.views.renderer()?;
    let mut settings = args.views.settings(&renderer);
    settings.push(("seeds", args.seeds.to_string()));
    let mut report = Report::new("convergence", "Convergence", &settings);
    report.text(
        "Error of pictures against a converged reference: the median over seeds, and how far it is spread.",
    );
    let columns = ["scene", "spp", "rays", "seconds", "relMSE", "p5", "p95", "FLIP"];
    let mut table = Table::new("error", "Error by samples per pixel", &columns);
    let (mut plots, mut crops) = (Vec::new(), Vec::new());
    for scene in args.views.scenes()? {
        let view = args.views.open(scene, &mut renderer)?;
        let (mut by_time, mut flip, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
        for &spp in &args.spp {
            let (measured, picture) = measure(&mut renderer, &view, spp, args.seeds)?;
            pictures.push(picture);
            let median = |values: &[f64]| Percentiles::of(values).p50;
            let (seconds, error) = (median(&measured.seconds), Percentiles::of(&measured.rel_mse));
            by_time.push((seconds, error.p50));
            flip.push((seconds, median(&measured.flip)));
            table.push(vec![
                view.name.as_str().into(),
                f64::from(spp).into(),
                median(&measured.rays).into(),
                seconds.into(),
                error.p50.into(),
                error.p5.into(),
                error.p95.into(),
                median(&measured.flip).into(),
            ]);
        }
        pictures.push(view.reference.clone());
        let spp: Vec<String> = args.spp.iter().map(u32::to_string).collect();
        crops.push((
            format!("{}: {} samples per pixel, reference", view.name, spp.join(", ")),
            view.crops(&pictures),
        ));
        plots.push((view.name, by_time, flip));
    }
    report.table(table);
    let axis = ("seconds", Scale::Log);
    let mut by_time = Plot::new("relMSE over time", axis, ("relMSE", Scale::Log));
    let mut flip = Plot::new("FLIP over time", axis, ("mean FLIP error", Scale::Log));
    for (name, errors, flips) in plots {
        (by_time, flip) = (by_time.with(&name, errors), flip.with(&name, flips));
    }
    report.plot(by_time);
    report.plot(flip);
    for (title, picture) in crops {
        report.picture(&title, &picture)?;
    }
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// What was measured, and the last picture.
fn measure(renderer: &mut Renderer, view: &View, spp: u32, seeds: u32) -> anyhow::Result<(Measured, Image)> {
    let mut last = view.reference.clone();
    let mut measured = Measured::default();
    for seed in 1..=seeds {
        let job = Job { seed, ..view.job.clone() };
        let (picture, summary) = render(renderer, &job, &Limits { spp, ..Limits::default() })?;
        let distance = view.distance(&picture)?;
        measured.rays.push(summary.rays as f64);
        measured.seconds.push(summary.elapsed.as_secs_f64());
        measured.rel_mse.push(distance.rel_mse);
        measured.flip.push(distance.flip);
        last = picture;
    }
    Ok((measured, last))
}
