//! `alhazen bench lights`: what it is worth to choose lights by where they are.

use super::report::{Percentiles, Report, ReportArgs, Table};
use super::views::{ViewArgs, open_scene, render};
use crate::commands::render::parsing::parse_duration;
use crate::console::{print_result, say};
use alhazen::{Job, Limits, Renderer, SceneTables};
use anyhow::ensure;
use clap::Args;
use std::time::Duration;

/// Errors of pictures of equal time, with lights chosen by power alone and with a tree of lights, which knows where they are.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench lights lanterns
  alhazen bench lights lanterns city.glb --time 20s --backend gpu")]
pub struct LightsArgs {
    #[command(flatten)]
    views: ViewArgs,
    /// Time for each picture.
    #[arg(long, value_name = "DURATION", default_value = "5s", value_parser = parse_duration)]
    time: Duration,
    /// Pictures of different noise for each way.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    #[command(flatten)]
    report: ReportArgs,
}

/// Measures, prints and writes.
pub fn run(args: &LightsArgs) -> anyhow::Result<()> {
    let mut renderer = args.views.renderer()?;
    let mut settings = args.views.settings(&renderer);
    settings.push(("time", format!("{:?}", args.time)));
    settings.push(("seeds", args.seeds.to_string()));
    let mut report = Report::new("lights", "Choosing among many lights", &settings);
    report.text(
        "relMSE of pictures of equal time, medians over seeds: lights chosen by power, and from a tree by where they are. \
         The gain is the ratio of the errors.",
    );
    let columns =
        ["scene", "lights", "spp by power", "relMSE by power", "spp by place", "relMSE by place", "gain"];
    let mut table = Table::new("error", "Error at equal time", &columns);
    for name in args.views.scenes()? {
        let (tables, row) = measure(args, name, &mut renderer)?;
        let [by_power, by_place] = row;
        table.push(vec![
            name.as_str().into(),
            (tables.lights.len() as f64).into(),
            by_power.spp.into(),
            by_power.rel_mse.into(),
            by_place.spp.into(),
            by_place.rel_mse.into(),
            (by_power.rel_mse / by_place.rel_mse).into(),
        ]);
    }
    report.table(table);
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// Medians over seeds.
struct Measured {
    spp: f64,
    rel_mse: f64,
}

/// By power, and by place.
fn measure(
    args: &LightsArgs,
    name: &str,
    renderer: &mut Renderer,
) -> anyhow::Result<(SceneTables, [Measured; 2])> {
    let view = args.views.open(name, renderer)?;
    let scene = open_scene(name)?;
    let tables = SceneTables::build(&scene);
    ensure!(!tables.light_tree.is_empty(), "{name} has too few lights for a tree: {}", tables.lights.len());
    let limits = Limits { spp: u32::MAX, time: Some(args.time), ..Limits::default() };
    let mut pictures = |tables: SceneTables| -> anyhow::Result<Measured> {
        renderer.load_tables(tables)?;
        // Shaders are compiled for the first sample, which is no cost of a picture.
        render(renderer, &view.job, &Limits { spp: 1, ..Limits::default() })?;
        let (mut spp, mut errors) = (Vec::new(), Vec::new());
        for seed in 1..=args.seeds {
            let (picture, summary) = render(renderer, &Job { seed, ..view.job.clone() }, &limits)?;
            spp.push(f64::from(summary.spp));
            errors.push(view.distance(&picture)?.rel_mse);
        }
        Ok(Measured { spp: Percentiles::of(&spp).p50, rel_mse: Percentiles::of(&errors).p50 })
    };
    let by_power = pictures(tables.clone().with_lights_by_power())?;
    let by_place = pictures(tables.clone())?;
    Ok((tables, [by_power, by_place]))
}
