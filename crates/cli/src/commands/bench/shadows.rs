//! `alhazen bench shadows`: what lights and triangles cost.

use super::frames::{FrameArgs, Measured, add_small_lamps, lit_hills};
use super::report::{Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::stage::Stage;
use crate::commands::load_scene;
use crate::commands::render::parsing::parse_not_negative;
use crate::console::{print_result, say};
use alhazen::{AmbientOcclusion, DirectSettings, HybridSettings, LoadOptions, Scene};
use clap::Args;

/// Time of a frame by number of lights and of vertex indices, with and without shadows; and what culling many small lights saves.
///
/// Hills of so many indices under lamps that reach everything, one shadow ray for each lamp and pixel. No reflections and no ambient
/// light.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench shadows
  alhazen bench shadows --indices 4000 --lights 1,2,4 --warm-up 20 --frames 100 --small-lamps 0")]
pub struct ShadowArgs {
    /// Numbers of lights, separated by commas.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [1, 2, 4, 8, 16])]
    lights: Vec<u32>,
    /// Numbers of vertex indices, three a triangle, separated by commas.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [4000, 15_000_000, 30_000_000])]
    indices: Vec<u32>,
    /// Scene that is lit by many small lamps, with and without culling.
    #[arg(long, value_name = "FILE|SCENE", default_value = "atrium")]
    scene: String,
    /// How many small lamps; 0 leaves this part out.
    #[arg(long, value_name = "N", default_value_t = 256)]
    small_lamps: u32,
    /// Irradiance in W/m² below which a small lamp does not count.
    #[arg(long, value_name = "IRRADIANCE", default_value_t = 0.2, value_parser = parse_not_negative)]
    light_cutoff: f32,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Light and shadows only.
fn shadows_only() -> HybridSettings {
    let one = HybridSettings::default();
    let ambient = AmbientOcclusion { samples: 0, ..one.rays.ambient };
    let rays = DirectSettings { reflection_samples: 0, ambient, max_depth: 1, ..one.rays };
    HybridSettings { rays, ..one }
}

/// Measures, prints and writes.
pub fn run(args: &ShadowArgs) -> anyhow::Result<()> {
    let mut stage = Stage::open(&args.frames, "shadows")?;
    let mut report = Report::new("shadows", "Shadows", stage.settings());
    report.text(
        "Milliseconds a frame, by the device's clock. First hit: everything up to the record of what each pixel sees. A light more: \
         the slope from the fewest lights to the most.",
    );
    let mut columns = vec![
        "indices",
        "lights",
        "shadows",
        "frame ms",
        "p95",
        "first hit ms",
        "lights ms",
        "a light more, ms",
        "frames/s",
    ];
    columns.extend(stage.columns());
    let mut table = Table::new("lights", "Frame time by indices and lights", &columns);
    let mut plot = Plot::new("Frame time", ("lights", Scale::Linear), ("ms", Scale::Linear));
    for &indices in &args.indices {
        for shadows in [true, false] {
            let settings = HybridSettings { shadows, ..shadows_only() };
            let mut curve: Vec<(f64, f64)> = Vec::new();
            for &lights in &args.lights {
                let measured = measure(args, &mut stage, &lit_hills(indices, lights), settings)?;
                let frame = Percentiles::of(&measured.device);
                curve.push((f64::from(lights), frame.p50));
                let slope = (frame.p50 - curve[0].1) / (f64::from(lights) - curve[0].0);
                let mut row = vec![
                    f64::from(indices).into(),
                    f64::from(lights).into(),
                    if shadows { "on" } else { "off" }.into(),
                    frame.p50.into(),
                    frame.p95.into(),
                    first_hit(&measured).into(),
                    light_passes(&measured).into(),
                    slope.into(),
                    measured.rate().into(),
                ];
                row.extend(measured.shown());
                table.push(row);
            }
            let name = format!("{indices} indices, {}", if shadows { "shadows" } else { "no shadows" });
            plot = plot.with(&name, curve);
        }
    }
    report.table(table);
    report.plot(plot);
    if args.small_lamps > 0 {
        report.table(small_lamps(args, &mut stage)?);
    }
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// Everything before light: median of what the device does until each pixel knows what it sees.
fn first_hit(measured: &Measured) -> f64 {
    ["cull", "draw", "resolve", "camera rays"].iter().map(|pass| measured.pass(pass)).sum()
}

/// Milliseconds of the passes that trace and shade lights.
fn light_passes(measured: &Measured) -> f64 {
    const PASSES: [&str; 5] = ["tile bounds", "shafts", "shadow rays", "lit surfaces", "direct lights"];
    PASSES.iter().map(|pass| measured.pass(pass)).sum()
}

fn measure(
    args: &ShadowArgs,
    stage: &mut Stage<'_>,
    scene: &Scene,
    settings: HybridSettings,
) -> anyhow::Result<Measured> {
    let view = args.frames.view(scene, scene.default_camera(), settings);
    let mut shown = stage.load(scene, &view, 2)?;
    stage.measure(&mut shown, &mut |_, _| (view.clone(), None))
}

/// Many small lamps, all counted and culled.
fn small_lamps(args: &ShadowArgs, stage: &mut Stage<'_>) -> anyhow::Result<Table> {
    let mut scene = load_scene(&args.scene, &[], &LoadOptions::default())?.scene;
    add_small_lamps(&mut scene, args.small_lamps);
    let title = format!("{} small lamps in {}", args.small_lamps, args.scene);
    let mut columns =
        vec!["irradiance that counts", "frame ms", "p95", "cluster lights ms", "lights ms", "frames/s"];
    columns.extend(stage.columns());
    let mut table = Table::new("small-lamps", &title, &columns);
    for light_cutoff in [args.light_cutoff, 0.0] {
        let measured = measure(args, stage, &scene, HybridSettings { light_cutoff, ..shadows_only() })?;
        let frame = Percentiles::of(&measured.device);
        let mut row = vec![
            f64::from(light_cutoff).into(),
            frame.p50.into(),
            frame.p95.into(),
            measured.pass("cluster lights").into(),
            light_passes(&measured).into(),
            measured.rate().into(),
        ];
        row.extend(measured.shown());
        table.push(row);
    }
    Ok(table)
}
