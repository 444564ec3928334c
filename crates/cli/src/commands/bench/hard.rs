//! `alhazen bench hard`: light that is hard to find, by each technique at equal time.

use super::report::{Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::views::{View, ViewArgs, render};
use crate::commands::render::parsing::parse_duration;
use crate::console::{print_result, say};
use alhazen::{Image, Integrator, Job, Limits, Renderer, Switch};
use anyhow::ensure;
use clap::Args;
use std::time::Duration;

/// Errors of pictures of equal time in scenes whose light paths rarely find, by each technique that finds it.
///
/// References are made by photons with many passes, unless `--reference-caustics off` says otherwise.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench hard docs/scenes/pool.toml docs/scenes/ring.toml glass --times 5s,20s
  alhazen bench hard atrium --reference-caustics off --reference-spp 16384")]
pub struct HardArgs {
    #[command(flatten)]
    views: ViewArgs,
    /// Times for each picture, separated by commas.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values = ["5s", "20s"], value_parser = parse_duration)]
    times: Vec<Duration>,
    /// Pictures of different noise for each technique and time.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// Whether references are made with photons.
    #[arg(long, value_name = "WHEN", default_value_t = Switch::On)]
    reference_caustics: Switch,
    #[command(flatten)]
    report: ReportArgs,
}

/// The techniques, by the names that reports give them.
const TECHNIQUES: [(&str, Switch); 2] = [("path", Switch::Off), ("caustics", Switch::On)];

/// Measures, prints and writes.
pub fn run(args: &HardArgs) -> anyhow::Result<()> {
    let mut renderer = args.views.renderer()?;
    let mut settings = args.views.settings(&renderer);
    settings.push(("seeds", args.seeds.to_string()));
    settings.push(("caustics of references", args.reference_caustics.to_string()));
    let mut report = Report::new("hard", "Light that is hard to find", &settings);
    report.text(
        "relMSE of pictures of equal time against a converged reference, medians over seeds. The gain is the error of `path` over \
         that of the technique.",
    );
    let columns = ["scene", "technique", "seconds", "spp", "relMSE", "p5", "p95", "gain"];
    let mut table = Table::new("error", "Error at equal time", &columns);
    let mut plot = Plot::new("relMSE over time", ("seconds", Scale::Log), ("relMSE", Scale::Log));
    let mut crops = Vec::new();
    for name in args.views.scenes()? {
        let view = open(args, name, &mut renderer)?;
        let mut of_path = Vec::new();
        let mut pictures = Vec::new();
        for (technique, caustics) in TECHNIQUES {
            let mut curve = Vec::new();
            for (at, time) in args.times.iter().enumerate() {
                let (measured, picture) = measure(args, &mut renderer, &view, caustics, *time)?;
                let error = Percentiles::of(&measured.rel_mse);
                let seconds = Percentiles::of(&measured.seconds).p50;
                if caustics == Switch::Off {
                    of_path.push(error.p50);
                }
                curve.push((seconds, error.p50));
                table.push(vec![
                    view.name.as_str().into(),
                    technique.into(),
                    seconds.into(),
                    Percentiles::of(&measured.spp).p50.into(),
                    error.p50.into(),
                    error.p5.into(),
                    error.p95.into(),
                    (of_path[at] / error.p50).into(),
                ]);
                if at + 1 == args.times.len() {
                    pictures.push(picture);
                }
            }
            plot = plot.with(&format!("{}, {technique}", view.name), curve);
        }
        pictures.push(view.reference.clone());
        crops.push((format!("{}: path, caustics, reference", view.name), view.crops(&pictures)));
    }
    report.table(table);
    report.plot(plot);
    for (title, picture) in crops {
        report.picture(&title, &picture)?;
    }
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// A scene with its reference, which has a name of its own among those that are kept.
fn open(args: &HardArgs, scene: &str, renderer: &mut Renderer) -> anyhow::Result<View> {
    let loaded = super::views::open_scene(scene)?;
    let (width, height) = args.views.size();
    let job = Job { width, height, ..Job::for_scene(&loaded) };
    renderer.load(&loaded)?;
    let name = super::views::short_name(scene);
    let by = with(args.reference_caustics, &job)?;
    let kept = format!("{name}-caustics-{}", args.reference_caustics);
    let reference = args.views.reference(&kept, &by, renderer)?;
    Ok(View { name, job, reference })
}

/// The same picture with caustics as said.
fn with(caustics: Switch, job: &Job) -> anyhow::Result<Job> {
    let mut job = job.clone();
    let name = job.integrator.name();
    ensure!(
        matches!(job.integrator, Integrator::Path(_)),
        "the scene asks for `{name}`, which has no caustics"
    );
    if let Integrator::Path(path) = &mut job.integrator {
        path.caustics = caustics;
    }
    Ok(job)
}

/// What was measured; every list has a value for each seed.
#[derive(Default)]
struct Measured {
    seconds: Vec<f64>,
    spp: Vec<f64>,
    rel_mse: Vec<f64>,
}

/// What was measured of a technique, and the last picture.
fn measure(
    args: &HardArgs,
    renderer: &mut Renderer,
    view: &View,
    caustics: Switch,
    time: Duration,
) -> anyhow::Result<(Measured, Image)> {
    let limits = Limits { spp: u32::MAX, time: Some(time), ..Limits::default() };
    let mut last = view.reference.clone();
    let mut measured = Measured::default();
    for seed in 1..=args.seeds {
        let job = Job { seed, ..with(caustics, &view.job)? };
        let (picture, summary) = render(renderer, &job, &limits)?;
        measured.seconds.push(summary.elapsed.as_secs_f64());
        measured.spp.push(f64::from(summary.spp));
        measured.rel_mse.push(view.distance(&picture)?.rel_mse);
        last = picture;
    }
    Ok((measured, last))
}
