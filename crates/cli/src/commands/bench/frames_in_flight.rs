//! `alhazen bench frames-in-flight`: what it is worth that host and device work at the same time.

use super::frames::{FrameArgs, Measured, crowd, crowd_places, usual};
use super::report::{Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::stage::Stage;
use crate::console::{print_result, say};
use alhazen::HybridSettings;
use alhazen::gpu::tracer::upper::UpperUpdate;
use clap::Args;

/// Throughput and latency by the number of frames in flight, for many models that move.
///
/// Every model has 1369 vertices and 2592 triangles and moves in every frame; the upper level of the hierarchy is built anew on the
/// device. The host computes all places.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench frames-in-flight
  alhazen bench frames-in-flight --models 1,1000 --in-flight 1,2,3 --warm-up 50 --frames 500 --trace frames.json")]
pub struct FramesInFlightArgs {
    /// Numbers of models, separated by commas [default: 1,5,10,100,1000,10000, or 1,10 where there is no GPU].
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    models: Vec<u32>,
    /// Numbers of frames in flight, from 1 to 5, separated by commas [default: 1,2,3,4,5, or 1,2 where there is no GPU].
    #[arg(long, value_name = "LIST", value_delimiter = ',',
        value_parser = clap::value_parser!(u32).range(1..=5))]
    in_flight: Vec<u32>,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Measures, prints and writes.
pub fn run(args: &FramesInFlightArgs) -> anyhow::Result<()> {
    let mut stage = Stage::open(&args.frames, "frames in flight")?;
    let mut report = Report::new("frames-in-flight", "Frames in flight", stage.settings());
    report.text(
        "Milliseconds a frame, medians. Host: what the processor does for a frame. Waited: what it waited for a free slot. Device: \
         all passes. Latency: from the beginning of the host's work, when input is read, to the end of the device's. Going from 1 to \
         2 frames hides the shorter of host and device time; more than that helps only where times vary.",
    );
    let mut columns = vec![
        "models",
        "in flight",
        "frames/s",
        "over 1",
        "host ms",
        "waited ms",
        "device ms",
        "device p95",
        "latency ms",
        "latency p95",
        "500 frames, s",
    ];
    columns.extend(stage.columns());
    let mut table = Table::new("throughput", "Throughput and latency by frames in flight", &columns);
    let mut rate =
        Plot::new("Frames per second", ("frames in flight", Scale::Linear), ("frames/s", Scale::Log));
    let mut latency = Plot::new("Latency", ("frames in flight", Scale::Linear), ("ms", Scale::Log));
    for models in args.models() {
        say!("{models} models");
        let (mut rates, mut latencies) = (Vec::new(), Vec::new());
        for (in_flight, measured) in measure(args, &mut stage, models)? {
            let median = |values: &[f64]| Percentiles::of(values).p50;
            rates.push((in_flight, measured.rate()));
            latencies.push((in_flight, median(&measured.latency)));
            let mut row = vec![
                f64::from(models).into(),
                in_flight.into(),
                measured.rate().into(),
                (measured.rate() / rates[0].1).into(),
                median(&measured.host).into(),
                median(&measured.waited).into(),
                median(&measured.device).into(),
                Percentiles::of(&measured.device).p95.into(),
                median(&measured.latency).into(),
                Percentiles::of(&measured.latency).p95.into(),
                (500.0 / measured.rate()).into(),
            ];
            row.extend(measured.shown());
            table.push(row);
        }
        let name = format!("{models} models");
        (rate, latency) = (rate.with(&name, rates), latency.with(&name, latencies));
    }
    report.table(table);
    report.plot(rate);
    report.plot(latency);
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

impl FramesInFlightArgs {
    fn models(&self) -> Vec<u32> {
        let usual: &[u32] = usual(&[1, 5, 10, 100, 1000, 10_000], &[1, 10]);
        if self.models.is_empty() { usual.to_vec() } else { self.models.clone() }
    }

    fn in_flight(&self) -> Vec<u32> {
        let usual: &[u32] = usual(&[1, 2, 3, 4, 5], &[1, 2]);
        if self.in_flight.is_empty() { usual.to_vec() } else { self.in_flight.clone() }
    }
}

/// Times by the number of frames in flight.
fn measure(
    args: &FramesInFlightArgs,
    stage: &mut Stage<'_>,
    models: u32,
) -> anyhow::Result<Vec<(f64, Measured)>> {
    let scene = crowd(models);
    let settings = HybridSettings::default();
    let view = args.frames.view(&scene, scene.default_camera(), settings);
    let mut shown = stage.load(&scene, &view, 1)?;
    let mut results = Vec::new();
    for in_flight in args.in_flight() {
        say!("  {in_flight} frames in flight");
        shown.live.frames().set_depth(in_flight as usize);
        let measured = stage.measure(&mut shown, &mut |number, places| {
            crowd_places(models, number, places);
            (view.clone(), Some(UpperUpdate::Rebuild))
        })?;
        results.push((f64::from(in_flight), measured));
    }
    Ok(results)
}
