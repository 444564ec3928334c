//! `alhazen bench hard`: light that is hard to find, by each technique at equal time.

use super::report::{Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::views::{View, ViewArgs, render};
use crate::commands::render::parsing::parse_duration;
use crate::console::{print_result, say};
use alhazen::{Image, Integrator, Job, Limits, Renderer, Switch};
use anyhow::bail;
use clap::{Args, ValueEnum};
use std::time::Duration;

/// Errors of pictures of equal time in scenes whose light paths rarely find, by each technique that finds it.
///
/// References are made by photons with many passes, unless `--reference` says otherwise.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench hard docs/scenes/pool.toml docs/scenes/ring.toml glass --times 5s,20s
  alhazen bench hard atrium --techniques path,guiding --reference path --reference-spp 16384")]
pub struct HardArgs {
    #[command(flatten)]
    views: ViewArgs,
    /// Times for each picture, separated by commas.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values = ["5s", "20s"], value_parser = parse_duration)]
    times: Vec<Duration>,
    /// Pictures of different noise for each technique and time.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// What is compared, separated by commas. Gains are relative to the first.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values = ["path", "caustics"])]
    techniques: Vec<Technique>,
    /// What makes references.
    #[arg(long, value_name = "TECHNIQUE", default_value = "caustics")]
    reference: Technique,
    #[command(flatten)]
    report: ReportArgs,
}

/// How light is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Technique {
    /// Paths alone.
    Path,
    /// Paths and photons.
    Caustics,
    /// Paths that follow a guide. Its training counts as time.
    Guiding,
}

impl Technique {
    fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Caustics => "caustics",
            Self::Guiding => "guiding",
        }
    }

    /// The same picture by this technique.
    fn of(self, job: &Job) -> anyhow::Result<Job> {
        let mut job = job.clone();
        let name = job.integrator.name();
        let Integrator::Path(path) = &mut job.integrator else {
            bail!("the scene asks for `{name}`, not for `path`");
        };
        let when = |own| if self == own { Switch::On } else { Switch::Off };
        (path.caustics, path.guiding) = (when(Self::Caustics), when(Self::Guiding));
        Ok(job)
    }
}

/// Measures, prints and writes.
pub fn run(args: &HardArgs) -> anyhow::Result<()> {
    let mut renderer = args.views.renderer()?;
    let mut settings = args.views.settings(&renderer);
    settings.push(("seeds", args.seeds.to_string()));
    settings.push(("technique of references", args.reference.name().to_owned()));
    let mut report = Report::new("hard", "Light that is hard to find", &settings);
    report.text(
        "relMSE of pictures of equal time against a converged reference, medians over seeds. The gain is the error of the \
         first technique over that of each.",
    );
    let columns = ["scene", "technique", "seconds", "spp", "relMSE", "p5", "p95", "gain"];
    let mut table = Table::new("error", "Error at equal time", &columns);
    let mut plot = Plot::new("relMSE over time", ("seconds", Scale::Log), ("relMSE", Scale::Log));
    let mut crops = Vec::new();
    for name in args.views.scenes()? {
        let view = open(args, name, &mut renderer)?;
        let mut of_first = Vec::new();
        let mut pictures = Vec::new();
        for technique in args.techniques.iter().copied() {
            let mut curve = Vec::new();
            for (at, time) in args.times.iter().enumerate() {
                let (measured, picture) = measure(args, &mut renderer, &view, technique, *time)?;
                let error = Percentiles::of(&measured.rel_mse);
                let seconds = Percentiles::of(&measured.seconds).p50;
                if technique == args.techniques[0] {
                    of_first.push(error.p50);
                }
                curve.push((seconds, error.p50));
                table.push(vec![
                    view.name.as_str().into(),
                    technique.name().into(),
                    seconds.into(),
                    Percentiles::of(&measured.spp).p50.into(),
                    error.p50.into(),
                    error.p5.into(),
                    error.p95.into(),
                    (of_first[at] / error.p50).into(),
                ]);
                if at + 1 == args.times.len() {
                    pictures.push(picture);
                }
            }
            plot = plot.with(&format!("{}, {}", view.name, technique.name()), curve);
        }
        pictures.push(view.reference.clone());
        let names: Vec<_> = args.techniques.iter().map(|technique| technique.name()).collect();
        crops.push((format!("{}: {}, reference", view.name, names.join(", ")), view.crops(&pictures)));
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
    let by = args.reference.of(&job)?;
    let kept = format!("{name}-{}", args.reference.name());
    let reference = args.views.reference(&kept, &by, renderer)?;
    Ok(View { name, job, reference })
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
    technique: Technique,
    time: Duration,
) -> anyhow::Result<(Measured, Image)> {
    let limits = Limits { spp: u32::MAX, time: Some(time), ..Limits::default() };
    let mut last = view.reference.clone();
    let mut measured = Measured::default();
    for seed in 1..=args.seeds {
        let job = Job { seed, ..technique.of(&view.job)? };
        let (picture, summary) = render(renderer, &job, &limits)?;
        measured.seconds.push(summary.elapsed.as_secs_f64());
        measured.spp.push(f64::from(summary.spp));
        measured.rel_mse.push(view.distance(&picture)?.rel_mse);
        last = picture;
    }
    Ok((measured, last))
}
