//! `alhazen bench views`: what the frames of a scene cost from several places.

use super::around::cameras_around;
use super::frames::{FrameArgs, Measured};
use super::report::{Cell, Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::stage::Stage;
use super::views::{check_scenes, open_scene};
use crate::console::{print_result, say};
use alhazen::{Camera, HybridSettings, Scene};
use clap::Args;

/// Time of each pass of the hybrid renderer's frames, for all cameras of scenes and for a round trip about what the first one looks
/// at.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench views three-spheres atrium
  alhazen bench views model.glb --around 8 --warm-up 20 --frames 200")]
pub struct ViewsArgs {
    /// Scene files or names of built-in scenes.
    #[arg(value_name = "FILE|SCENE", default_values_t = ["three-spheres", "atrium"].map(String::from))]
    scenes: Vec<String>,
    /// Further views, from around what the first camera looks at.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=360))]
    around: u32,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Passes in the order of a frame.
const PASSES: [&str; 15] = [
    "cluster lights",
    "cull",
    "draw",
    "resolve",
    "camera rays",
    "tile bounds",
    "shafts",
    "shadow rays",
    "lit surfaces",
    "direct lights",
    "ambient occlusion",
    "list reflecting",
    "reflections",
    "compose",
    "screen",
];

/// Measures, prints and writes.
pub fn run(args: &ViewsArgs) -> anyhow::Result<()> {
    let mut stage = Stage::open(&args.frames, "views")?;
    let mut report = Report::new("views", "Views", stage.settings());
    report.text("Milliseconds a frame by the device's clock, medians; each pass by itself.");
    let mut columns = vec!["scene", "view", "frames/s", "frame ms", "p5", "p95"];
    columns.extend(PASSES);
    columns.extend(stage.columns());
    let mut table = Table::new("passes", "Frame time by view and pass", &columns);
    check_scenes(&args.scenes)?;
    for name in &args.scenes {
        let scene = &open_scene(name)?;
        let mut plot =
            Plot::new(&format!("{name}: device time"), ("frame", Scale::Linear), ("ms", Scale::Linear));
        let cameras = cameras(scene, args.around);
        let first = args.frames.view(scene, cameras[0].clone(), HybridSettings::default());
        let mut shown = stage.load(scene, &first, 2)?;
        for camera in cameras {
            say!("{name}, {}", camera.name);
            let view = args.frames.view(scene, camera.clone(), HybridSettings::default());
            let measured = stage.measure(&mut shown, &mut |_, _| (view.clone(), None))?;
            table.push(row(name, &camera.name, &measured));
            // A few hundred points show a curve.
            let step = measured.device.len().div_ceil(500).max(1);
            let numbered = measured.device.iter().enumerate().step_by(step);
            plot = plot.with(&camera.name, numbered.map(|(i, ms)| (i as f64, *ms)).collect());
        }
        report.plot(plot);
    }
    report.table(table);
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// All cameras of a scene, and `around` more; at least one.
fn cameras(scene: &Scene, around: u32) -> Vec<Camera> {
    let mut cameras = scene.cameras.clone();
    if cameras.is_empty() {
        cameras.push(scene.default_camera());
    }
    let first = cameras[0].clone();
    cameras.extend(cameras_around(&first, around));
    cameras
}

fn row(scene: &str, view: &str, measured: &Measured) -> Vec<Cell> {
    let frame = Percentiles::of(&measured.device);
    let mut row: Vec<Cell> = vec![scene.into(), view.into(), measured.rate().into()];
    row.extend([frame.p50, frame.p5, frame.p95].map(Cell::from));
    row.extend(PASSES.map(|pass| Cell::from(measured.pass(pass))));
    row.extend(measured.shown());
    row
}
