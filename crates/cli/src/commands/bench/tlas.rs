//! `alhazen bench tlas`: what moving instances cost.

use super::frames::{FrameArgs, crowd, crowd_places};
use super::report::{Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::stage::Stage;
use crate::console::{print_result, say};
use alhazen::HybridSettings;
use alhazen::gpu::tracer::upper::UpperUpdate;
use clap::Args;

/// Time to rebuild or refit the upper level of the hierarchy on the device, by the number of instances that all move in every frame.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench tlas
  alhazen bench tlas --instances 1000,10000 --warm-up 50 --frames 500")]
pub struct TlasArgs {
    /// Numbers of instances, separated by commas.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [10, 100, 1000, 10_000, 100_000])]
    instances: Vec<u32>,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Measures, prints and writes.
pub fn run(args: &TlasArgs) -> anyhow::Result<()> {
    let mut stage = Stage::open(&args.frames, "moving instances")?;
    let mut report = Report::new("tlas", "Moving instances", stage.settings());
    report.text(
        "Milliseconds a frame, medians. Update: bounds, order and nodes of the upper level, and the records of instances, by the device's \
         clock. Host: computing and handing over all places, and recording the frame.",
    );
    let mut columns =
        vec!["instances", "update", "update ms", "p95", "frame ms", "host ms", "host p95", "frames/s"];
    columns.extend(stage.columns());
    let mut table = Table::new("update", "Upper level by instances", &columns);
    let mut plot = Plot::new("Update of the upper level", ("instances", Scale::Log), ("ms", Scale::Log));
    let (mut rebuild, mut refit) = (Vec::new(), Vec::new());
    for &instances in &args.instances {
        let scene = crowd(instances);
        let view = args.frames.view(&scene, scene.default_camera(), HybridSettings::default());
        let mut shown = stage.load(&scene, &view, 2)?;
        for (update, name, curve) in
            [(UpperUpdate::Rebuild, "rebuild", &mut rebuild), (UpperUpdate::Refit, "refit", &mut refit)]
        {
            let measured = stage.measure(&mut shown, &mut |number, places| {
                crowd_places(instances, number, places);
                (view.clone(), Some(update))
            })?;
            let pass = measured.passes.iter().find(|(pass, _)| *pass == "upper level");
            let time = Percentiles::of(pass.map_or(&[], |(_, times)| times));
            let host = Percentiles::of(&measured.host);
            curve.push((f64::from(instances), time.p50));
            let mut row = vec![
                f64::from(instances).into(),
                name.into(),
                time.p50.into(),
                time.p95.into(),
                Percentiles::of(&measured.device).p50.into(),
                host.p50.into(),
                host.p95.into(),
                measured.rate().into(),
            ];
            row.extend(measured.shown());
            table.push(row);
        }
    }
    plot = plot.with("rebuild", rebuild).with("refit", refit);
    report.table(table);
    report.plot(plot);
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}
