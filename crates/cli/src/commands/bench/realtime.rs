//! `alhazen bench realtime`: what the frames of the real-time path tracer cost, and how far they are from the truth.

use super::around::{AroundArgs, Frames};
use super::backends::beside;
use super::frames::{Visibility, usual};
use super::report::{Cell, Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::views::{check_scenes, open_scene, render, short_name};
use crate::commands::render::parsing::parse_not_negative;
use crate::commands::render::realtime::FrameSettings;
use crate::commands::render::roulette::RouletteArgs;
use crate::console::{print_result, say};
use alhazen::gpu::live::LiveScene;
use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{Gpu, GpuOptions};
use alhazen::{
    BackendChoice, Camera, FrameSamples, Image, Integrator, Job, Limits, PathKernel, PathSettings,
    RealtimeSettings, Renderer, RendererOptions, SamplerKind, Scene, SceneTables, View, metrics,
};
use clap::Args;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Time, error and flicker of frames of the integrator `realtime`.
///
/// A camera that moves: relMSE and FLIP of frames against converged pictures of their views, by paths of the same length, for raw
/// frames of one sample per pixel and for filtered ones; and the GPU's time of the same frames, without anybody looking at them. A camera that stands still: how much the last frames differ from each
/// other, and the GPU's time by frame as adaptive frames converge.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench realtime cornell atrium
  alhazen bench realtime model.glb --width 1280 --height 720 --budget 8ms
  alhazen bench realtime atrium --filter learned
  alhazen bench realtime atrium --around 8")]
pub struct RealtimeArgs {
    /// Scene files or names of built-in scenes, each with the place to look from if that is not the scene's first camera:
    /// `room.glb@EYE:TARGET`, both X,Y,Z.
    #[arg(value_name = "FILE|SCENE[@EYE:TARGET]", default_values_t = ["cornell", "atrium"].map(String::from))]
    scenes: Vec<String>,
    /// Width of the frames in pixels [default: 1920, or 160 where there is no GPU].
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=8192))]
    width: Option<u32>,
    /// Height of the frames in pixels [default: 1080, or 90 where there is no GPU].
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=8192))]
    height: Option<u32>,
    /// Frames of the moving camera [default: 16, or 2 where there is no GPU].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    moving_frames: Option<u32>,
    /// How far the camera moves from frame to frame, as a share of the distance to what it looks at.
    #[arg(long, value_name = "SHARE", default_value_t = 0.004, value_parser = parse_not_negative)]
    step: f32,
    /// Frames of the camera that stands still [default: 200, or 32 where there is no GPU].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(32..=100_000))]
    still_frames: Option<u32>,
    /// Samples per pixel of the references [default: 1024, or 32 where there is no GPU]. Their own error adds to every error
    /// measured.
    #[arg(long, value_name = "SPP", value_parser = clap::value_parser!(u32).range(1..))]
    reference_spp: Option<u32>,
    /// Longest path in segments, of frames and references.
    #[arg(long, value_name = "DEPTH")]
    max_depth: Option<u32>,
    /// Of frames; references have the path tracer's usual one.
    #[command(flatten)]
    roulette: RouletteArgs,
    /// How samples are drawn: sobol, independent or blue-noise.
    #[arg(long, value_name = "KIND", default_value_t)]
    sampler: SamplerKind,
    /// How first hits are found.
    #[arg(long, value_enum, default_value_t = Visibility::Raster)]
    visibility: Visibility,
    /// Which GPU: a part of its name.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    settings: FrameSettings,
    #[command(flatten)]
    around: AroundArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Frames whose differences are called flicker.
const FLICKER_FRAMES: u32 = 16;
/// Frames that warm a device up before anything counts.
const WARM_UP: u32 = 16;
/// Frames of the moving camera that are timed at least: it goes its way as often as that takes.
const TIMED_FRAMES: u32 = 64;

/// Measures, prints and writes.
pub fn run(args: &RealtimeArgs) -> anyhow::Result<()> {
    if args.around.around > 0 {
        return run_around(args);
    }
    let settings = args.realtime_settings();
    let adaptive = args.adaptive_settings();
    let PathSettings { roulette_start, roulette_min_survival, .. } = settings.path;
    let roulette = format!("from {roulette_start} segments on, {roulette_min_survival} survive at least");
    let about = [
        ("device", args.open()?.describe()),
        ("size", format!("{}×{}", args.size().0, args.size().1)),
        ("sampler", args.sampler.to_string()),
        ("longest path", settings.path.max_depth.to_string()),
        ("Russian roulette", roulette),
        ("reference", format!("{} samples per pixel", args.reference_spp())),
        ("adaptive samples", adaptive.samples.to_string()),
        ("filter", settings.spatial.to_string()),
        ("budget", adaptive.budget.map_or("none".into(), |b| format!("{:.1} ms", b.as_secs_f64() * 1e3))),
        ("errors are relative to", format!("radiance² + {}", metrics::REL_MSE_EPSILON)),
    ];
    let mut tables = Tables::new();
    let mut report = Report::new("realtime", "The real-time path tracer", &about);
    check_scenes(&args.scenes)?;
    for name in &args.scenes {
        let scene = open_scene(name)?;
        Measurement::new(args, short_name(name), &scene)?.run(&mut tables, &mut report)?;
    }
    tables.add_to(&mut report);
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// Device time of frames from all around, of one sample and of as many as noise wants.
fn run_around(args: &RealtimeArgs) -> anyhow::Result<()> {
    check_scenes(&args.scenes)?;
    let frames = Frames {
        scenes: &args.scenes,
        size: args.size(),
        adapter: args.adapter.clone(),
        sampler: args.sampler,
        ways: vec![("1 sample", args.realtime_settings()), ("adaptive", args.adaptive_settings())],
    };
    let settings = args.around.settings(&frames)?;
    let mut report = Report::new("realtime", "The real-time path tracer from all around", &settings);
    args.around.measure(&frames, &mut report)?;
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

impl RealtimeArgs {
    fn size(&self) -> (u32, u32) {
        let (width, height) = usual((1920, 1080), (160, 90));
        (self.width.unwrap_or(width), self.height.unwrap_or(height))
    }

    fn moving_frames(&self) -> u32 {
        self.moving_frames.unwrap_or(usual(16, 2))
    }

    fn still_frames(&self) -> u32 {
        self.still_frames.unwrap_or(usual(200, 32))
    }

    fn reference_spp(&self) -> u32 {
        self.reference_spp.unwrap_or(usual(1024, 32))
    }

    fn open(&self) -> anyhow::Result<Gpu> {
        Ok(Gpu::open(&GpuOptions { adapter: self.adapter.clone(), ..GpuOptions::default() })?)
    }

    fn visibility(&self) -> alhazen::Visibility {
        match self.visibility {
            Visibility::Raster => alhazen::Visibility::Raster,
            Visibility::Rays => alhazen::Visibility::Rays,
        }
    }

    /// One sample a pixel, filtered.
    fn realtime_settings(&self) -> RealtimeSettings {
        let settings = self.settings.settings(self.max_depth, &self.roulette, self.visibility());
        RealtimeSettings { samples: FrameSamples { least: 1, most: 1 }, budget: None, ..settings }
    }

    /// As many samples as the arguments say, or as is usual.
    fn adaptive_settings(&self) -> RealtimeSettings {
        let settings = self.settings.settings(self.max_depth, &self.roulette, self.visibility());
        let samples = if settings.samples.is_fixed() { FrameSamples::ADAPTIVE } else { settings.samples };
        RealtimeSettings { samples, ..settings }
    }
}

/// The tables of all scenes.
struct Tables {
    errors: Table,
    times: Table,
    still: Table,
    passes: Table,
}

impl Tables {
    fn new() -> Self {
        let errors = ["scene", "frame", "raw relMSE", "relMSE", "gain", "raw FLIP", "FLIP"];
        let times = ["scene", "frames", "ms", "p5", "p95", "of that temporal and filter"];
        let still = [
            "scene",
            "raw flicker",
            "flicker",
            "raw over filtered",
            "first frame ms",
            "last ms",
            "last over first",
        ];
        Self {
            errors: Table::new("errors", "A moving camera: error by frame", &errors),
            times: Table::new("times", "Device time of a frame, milliseconds", &times),
            still: Table::new("still", "A camera that stands still: flicker, and adaptive frames", &still),
            passes: Table::new(
                "passes",
                "Device time by pass, milliseconds, medians",
                &["scene", "frames", "pass", "ms"],
            ),
        }
    }

    fn add_to(self, report: &mut Report) {
        for table in [self.errors, self.times, self.still, self.passes] {
            report.table(table);
        }
    }
}

/// Passes that are neither first hits nor samples nor the way to the film.
const TEMPORAL_AND_FILTER: [&str; 6] =
    ["reproject", "accumulate", "filter", "recombine", "antialias", "noise"];

/// A scene that is measured.
struct Measurement<'a> {
    args: &'a RealtimeArgs,
    name: String,
    scene: &'a Scene,
    live: LiveScene,
    renderer: Renderer,
}

/// Device times of frames, milliseconds: of the whole, and by pass.
#[derive(Default)]
struct Times {
    frames: Vec<f64>,
    passes: BTreeMap<&'static str, Vec<f64>>,
}

impl<'a> Measurement<'a> {
    fn new(args: &'a RealtimeArgs, name: String, scene: &'a Scene) -> anyhow::Result<Self> {
        let tables = Arc::new(SceneTables::build(scene));
        let view = view(args, scene, scene.default_camera(), Integrator::Realtime(args.realtime_settings()));
        let live = LiveScene::new(args.open()?, tables, TracerKind::Bvh, &view, 1)?;
        let options = RendererOptions {
            backend: BackendChoice::Tracer(TracerKind::Bvh),
            adapter: args.adapter.clone(),
            threads: None,
            kernel: PathKernel::Auto,
        };
        let mut renderer = Renderer::choose(&options)?.renderer;
        renderer.load(scene)?;
        Ok(Self { args, name, scene, live, renderer })
    }

    fn run(&mut self, tables: &mut Tables, report: &mut Report) -> anyhow::Result<()> {
        say!("{}: times of a moving camera", self.name);
        let filtered = self.args.realtime_settings();
        let raw = RealtimeSettings { filter: false, ..filtered };
        self.time_moving(raw, tables, "raw, moving")?;
        self.time_moving(filtered, tables, "filtered, moving")?;
        say!("{}: errors of a moving camera", self.name);
        self.moving(raw, filtered, tables, report)?;
        say!("{}: a camera that stands still", self.name);
        let flicker = [raw, filtered].map(|settings| self.flicker(settings));
        let [raw_flicker, flicker] = flicker;
        self.converging((raw_flicker?, flicker?), tables, report)
    }

    /// The camera of a frame: it moves sideways, and is where the scene has it in the last one.
    fn camera(&self, frame: u32) -> Camera {
        let camera = self.scene.default_camera();
        let way = camera.target - camera.eye;
        let right = way.cross(camera.up).normalize_or_zero();
        let frames_left = (self.args.moving_frames() - 1).saturating_sub(frame) as f32;
        let offset = right * (way.length() * self.args.step * frames_left);
        Camera { eye: camera.eye - offset, target: camera.target - offset, path: None, ..camera }
    }

    fn view(&self, frame: u32, settings: RealtimeSettings) -> View {
        let still = self.camera(frame);
        View { first_sample: frame, ..view(self.args, self.scene, still, Integrator::Realtime(settings)) }
    }

    fn warm_up(&mut self, settings: &RealtimeSettings) -> anyhow::Result<()> {
        for frame in 0..WARM_UP {
            self.live.frame(&self.view(frame, *settings), None)?;
        }
        self.live.finish()?;
        self.live.frames().take_reports();
        Ok(())
    }

    /// The time of the frames of the moving camera. While somebody reads a picture back, the device waits and lowers its clock,
    /// and the next frame takes longer than it would: nothing is read here.
    fn time_moving(
        &mut self,
        settings: RealtimeSettings,
        tables: &mut Tables,
        what: &str,
    ) -> anyhow::Result<()> {
        self.warm_up(&settings)?;
        // The first way is not counted either.
        for way in 0..=TIMED_FRAMES.div_ceil(self.args.moving_frames()) {
            self.live.forget();
            for frame in 0..self.args.moving_frames() {
                self.live.frame(&self.view(frame, settings), None)?;
            }
            if way == 0 {
                self.live.finish()?;
                self.live.frames().take_reports();
            }
        }
        self.live.finish()?;
        self.take_times(tables, what);
        Ok(())
    }

    /// Frames of the moving camera with both settings, against references of some of them.
    fn moving(
        &mut self,
        raw: RealtimeSettings,
        filtered: RealtimeSettings,
        tables: &mut Tables,
        report: &mut Report,
    ) -> anyhow::Result<()> {
        let frames = self.args.moving_frames();
        let raw_pictures = self.pictures(raw)?;
        self.take_times(tables, "raw, moving, read back");
        let pictures = self.pictures(filtered)?;
        self.take_times(tables, "filtered, moving, read back");
        let compared = (0..frames).filter(|f| (f + 1).is_power_of_two() || f + 1 == frames);
        let mut curves = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
        for frame in compared {
            let reference = self.reference(frame, filtered)?;
            let exposure = Job::for_scene(self.scene).tone.exposure;
            let (raw, picture) = (&raw_pictures[frame as usize], &pictures[frame as usize]);
            let error = |picture| metrics::rel_mse(&reference, picture);
            let flip = |picture| metrics::flip(&reference, picture, exposure.log2()).map(|f| f.mean);
            let values = [error(raw)?, error(picture)?, flip(raw)?, flip(picture)?];
            let mut row: Vec<Cell> = vec![self.name.as_str().into(), f64::from(frame + 1).into()];
            row.extend([values[0], values[1], values[0] / values[1], values[2], values[3]].map(Cell::from));
            tables.errors.push(row);
            for (curve, value) in curves.iter_mut().zip(values) {
                curve.push((f64::from(frame + 1), value));
            }
            if frame + 1 == frames {
                let tone = Job::for_scene(self.scene).tone;
                let title = format!("{}: raw, filtered, reference; frame {frames}", self.name);
                let half = |image: &Image| {
                    let (w, h) = (image.width() / 2, image.height() / 2);
                    tone.apply(&image.crop(w / 2, h / 2, w, h))
                };
                let crops = [half(raw), half(picture), half(&reference)];
                report.picture(&title, &beside(&crops))?;
            }
        }
        let [raw_error, error, raw_flip, flip] = curves;
        let plot = |title: &str, y: &str| {
            Plot::new(&format!("{}: {title}", self.name), ("frame", Scale::Linear), (y, Scale::Log))
        };
        report
            .plot(plot("relMSE of a moving camera", "relMSE").with("raw", raw_error).with("filtered", error));
        report.plot(plot("FLIP of a moving camera", "FLIP").with("raw", raw_flip).with("filtered", flip));
        Ok(())
    }

    /// All frames of the moving camera.
    fn pictures(&mut self, settings: RealtimeSettings) -> anyhow::Result<Vec<Image>> {
        self.live.forget();
        self.live.frames().take_reports();
        let mut pictures = Vec::new();
        for frame in 0..self.args.moving_frames() {
            let view = self.view(frame, settings);
            self.live.frame(&view, None)?;
            pictures.push(self.live.read(&view)?.to_image());
        }
        Ok(pictures)
    }

    /// The converged picture of a frame of the moving camera.
    fn reference(&mut self, frame: u32, settings: RealtimeSettings) -> anyhow::Result<Image> {
        // Frames may end their paths earlier; references have no need to hurry.
        let path = PathSettings { max_depth: settings.path.max_depth, ..PathSettings::default() };
        let job = Job {
            seed: 0x5eed_0000,
            ..job(self.args, self.scene, self.camera(frame), Integrator::Path(path))
        };
        let limits = Limits { spp: self.args.reference_spp(), ..Limits::default() };
        Ok(render(&mut self.renderer, &job, &limits)?.0)
    }

    /// Standard deviation of pixels over the last frames of a view that stands still, over the mean: root of the means of squares.
    fn flicker(&mut self, settings: RealtimeSettings) -> anyhow::Result<f64> {
        self.live.forget();
        let last = self.args.moving_frames();
        let (mut sum, mut squares) = (Vec::new(), Vec::new());
        for number in 0..2 * FLICKER_FRAMES {
            let view = View { first_sample: number, ..self.view(last, settings) };
            self.live.frame(&view, None)?;
            if number < FLICKER_FRAMES {
                continue;
            }
            let picture = self.live.read(&view)?.to_image().to_rgb();
            sum.resize(picture.data().len(), 0.0);
            squares.resize(picture.data().len(), 0.0);
            for (i, &x) in picture.data().iter().enumerate() {
                sum[i] += f64::from(x);
                squares[i] += f64::from(x) * f64::from(x);
            }
        }
        let n = f64::from(FLICKER_FRAMES);
        let variances = sum.iter().zip(&squares).map(|(s, q)| (q / n - (s / n).powi(2)).max(0.0));
        let mean = sum.iter().sum::<f64>() / n / sum.len() as f64;
        Ok((variances.sum::<f64>() / sum.len() as f64).sqrt() / mean)
    }

    /// Adaptive frames of a view that stands still.
    fn converging(
        &mut self,
        (raw_flicker, flicker): (f64, f64),
        tables: &mut Tables,
        report: &mut Report,
    ) -> anyhow::Result<()> {
        let settings = self.args.adaptive_settings();
        self.warm_up(&settings)?;
        self.live.forget();
        let last = self.args.moving_frames();
        for number in 0..self.args.still_frames() {
            let view = View { first_sample: number, ..self.view(last, settings) };
            self.live.frame(&view, None)?;
        }
        self.live.finish()?;
        let times = self.take_times(tables, "adaptive, still");
        let (first, end) = match times.frames.as_slice() {
            [first, .., _, _] => (*first, Percentiles::of(&times.frames[times.frames.len() * 9 / 10..]).p50),
            _ => (f64::NAN, f64::NAN),
        };
        let numbers = [raw_flicker, flicker, raw_flicker / flicker, first, end, end / first];
        let row = std::iter::once(Cell::from(self.name.as_str())).chain(numbers.map(Cell::from));
        tables.still.push(row.collect());
        let curve = |values: &[f64]| values.iter().enumerate().map(|(i, ms)| (i as f64 + 1.0, *ms)).collect();
        let mut plot = Plot::new(
            &format!("{}: device time of adaptive frames of a view that stands still", self.name),
            ("frame", Scale::Linear),
            ("ms", Scale::Linear),
        )
        .with("frame", curve(&times.frames));
        if let Some(samples) = times.passes.get("samples") {
            plot = plot.with("samples", curve(samples));
        }
        report.plot(plot);
        Ok(())
    }

    /// The times of the frames since the last call, which go to the tables.
    fn take_times(&mut self, tables: &mut Tables, what: &str) -> Times {
        let mut times = Times::default();
        let milliseconds = |d: std::time::Duration| d.as_secs_f64() * 1e3;
        for report in self.live.frames().take_reports() {
            times.frames.push(milliseconds(report.device()));
            let mut of_frame: BTreeMap<&'static str, f64> = BTreeMap::new();
            for pass in &report.passes {
                *of_frame.entry(pass.name).or_default() += milliseconds(pass.duration);
            }
            for (name, ms) in of_frame {
                times.passes.entry(name).or_default().push(ms);
            }
        }
        let frame = Percentiles::of(&times.frames);
        let median = |name: &&str| times.passes.get(*name).map_or(0.0, |v| Percentiles::of(v).p50);
        let filter: f64 = TEMPORAL_AND_FILTER.iter().map(median).sum();
        let mut row: Vec<Cell> = vec![self.name.as_str().into(), what.into()];
        row.extend([frame.p50, frame.p5, frame.p95, filter].map(Cell::from));
        tables.times.push(row);
        for (pass, values) in &times.passes {
            let ms = Percentiles::of(values).p50;
            tables.passes.push(vec![self.name.as_str().into(), what.into(), (*pass).into(), ms.into()]);
        }
        times
    }
}

fn job(args: &RealtimeArgs, scene: &Scene, camera: Camera, integrator: Integrator) -> Job {
    let (width, height) = args.size();
    let sampler = args.sampler;
    Job { camera, width, height, integrator, sampler, ..Job::for_scene(scene) }
}

fn view(args: &RealtimeArgs, scene: &Scene, camera: Camera, integrator: Integrator) -> View {
    let mut job = job(args, scene, camera, integrator);
    if let Integrator::Realtime(r) = &mut job.integrator {
        r.allocation.white = 1.0 / job.tone.exposure.max(1e-6); // as it will be seen
    }
    job.view(0.0)
}
