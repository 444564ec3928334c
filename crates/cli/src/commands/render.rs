//! `alhazen render`: a picture, or a sequence of pictures, of a scene.

use crate::console::{ProgressDisplay, bytes, metric, print_report, print_result, seconds};
use crate::profile::Profile;
use alhazen::{
    Aov, BackendChoice, Camera, Control, DirectSettings, Environment, Integrator, Job, Limits, LoadOptions,
    LoadStats, Loaded, PathSettings, Projection, Rect, Renderer, RendererOptions, SamplerKind, Summary,
    ToneMapper, add_daylight_if_dark, output,
};
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Render a scene to a picture.
///
/// The scene is a file (.obj, .gltf, .glb, .ply, or a .toml scene file) or the name of a built-in scene, see
/// `alhazen scenes`. Progress goes to stderr. Ctrl-C stops and keeps what is there; a second one stops at once.
#[derive(Debug, Clone, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  alhazen render cornell -o cornell.png
  alhazen render model.glb -o model.exr --environment sky.hdr --aov depth,normal,albedo
  alhazen render three-spheres --frames 0..240 --fps 24 -o frame.png
  alhazen render atrium --noise 0.02 --time 5m -o atrium.png")]
pub struct RenderArgs {
    /// Scene file or name of a built-in scene.
    #[arg(value_name = "FILE|SCENE", default_value = "three-spheres")]
    scene: String,
    /// Picture to write: .png (tone mapped), .exr (linear, layers, metadata) or .hdr. May be given several times.
    #[arg(short, long, value_name = "FILE", default_value = "render.png")]
    output: Vec<PathBuf>,
    /// Parameter of the scene, as NAME=VALUE. May be given several times.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = super::parse_parameter)]
    parameters: Vec<(String, String)>,
    /// Go on without what the file requires but Alhazen does not know.
    #[arg(long)]
    lenient: bool,

    /// Width in pixels.
    #[arg(long, help_heading = "Picture", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    width: Option<u32>,
    /// Height in pixels.
    #[arg(long, help_heading = "Picture", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    height: Option<u32>,
    /// Render only this part: X,Y,WIDTH,HEIGHT in pixels from the upper left.
    #[arg(long, help_heading = "Picture", value_name = "X,Y,W,H", value_parser = parse_crop)]
    crop: Option<Rect>,
    /// Samples per pixel [default: what the scene says, or 64].
    #[arg(long, help_heading = "Picture", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Stop after this time, such as 30s, 5m, 1.5h.
    #[arg(long, help_heading = "Picture", value_name = "DURATION", value_parser = parse_duration)]
    time: Option<Duration>,
    /// Stop when the relative standard error of the picture is below this, such as 0.02. Without --spp, at most
    /// 65536 samples are made.
    #[arg(long, help_heading = "Picture", value_name = "ERROR", value_parser = parse_positive)]
    noise: Option<f32>,
    /// Auxiliary layers for EXR: depth, position, normal, geometric-normal, uv, albedo, material, instance,
    /// primitive, samples, standard-error; separated by commas.
    #[arg(long, help_heading = "Picture", value_name = "LIST", value_delimiter = ',')]
    aov: Vec<Aov>,
    /// Seed of the noise.
    #[arg(long, help_heading = "Picture", default_value_t = 0)]
    seed: u32,

    /// Camera of the file, by name or number.
    #[arg(long, help_heading = "Camera", value_name = "NAME")]
    camera: Option<String>,
    /// Position of the camera.
    #[arg(long, help_heading = "Camera", value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    eye: Option<[f32; 3]>,
    /// Point that the camera looks at.
    #[arg(long, help_heading = "Camera", value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    target: Option<[f32; 3]>,
    /// Vertical field of view in degrees.
    #[arg(long, help_heading = "Camera", value_name = "DEGREES", value_parser = parse_fov)]
    fov: Option<f32>,
    /// f-number of the lens, for a 36 mm × 24 mm film; smaller is blurrier.
    #[arg(long, help_heading = "Camera", value_name = "N", value_parser = parse_positive)]
    f_number: Option<f32>,
    /// Distance in focus, in metres [default: the target].
    #[arg(long, help_heading = "Camera", value_name = "METRES", value_parser = parse_positive)]
    focus: Option<f32>,

    /// Render frames A to B − 1 of a sequence; the output's name gets the frame's number.
    #[arg(long, help_heading = "Sequence", value_name = "A..B", value_parser = parse_frames)]
    frames: Option<(u32, u32)>,
    /// Frames per second.
    #[arg(long, help_heading = "Sequence", default_value_t = 24.0, value_parser = parse_positive)]
    fps: f32,

    /// How light is transported.
    #[arg(long, help_heading = "Light", value_enum)]
    integrator: Option<IntegratorName>,
    /// Longest path: 1 is emission, 2 direct light [default: what the scene says, or 32].
    #[arg(long, help_heading = "Light", value_parser = clap::value_parser!(u32).range(1..=1000))]
    max_depth: Option<u32>,
    /// Light from outside: an .hdr or .exr panorama, or a constant radiance R,G,B. Without one, a scene in which
    /// nothing shines gets a cloudy sky.
    #[arg(long, help_heading = "Light", value_name = "FILE|R,G,B")]
    environment: Option<String>,
    /// Rotation of the environment in degrees.
    #[arg(
        long,
        help_heading = "Light",
        value_name = "DEGREES",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    environment_rotation: f32,
    /// Factor on the environment file.
    #[arg(long, help_heading = "Light", default_value_t = 1.0, value_parser = parse_positive)]
    environment_intensity: f32,
    /// Follow glTF 2.0 to the letter: no compensation for light lost between microfacets.
    #[arg(long, help_heading = "Light")]
    single_scatter: bool,
    /// First path length that Russian roulette may end.
    #[arg(long, help_heading = "Light", value_name = "DEPTH", default_value_t = 5)]
    roulette_start: u32,
    /// Paths that go on from the first hit of each camera ray.
    #[arg(long, help_heading = "Light", value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    splitting: u32,
    /// How samples are drawn.
    #[arg(long, help_heading = "Light", value_enum, default_value_t = SamplerName::Sobol)]
    sampler: SamplerName,
    /// `direct`: shadow rays for each light.
    #[arg(long, help_heading = "Light", value_name = "N")]
    shadow_samples: Option<u32>,
    /// `direct`: reflection rays at the first hit.
    #[arg(long, help_heading = "Light", value_name = "N")]
    reflection_samples: Option<u32>,
    /// `direct`: ambient occlusion rays at the first hit.
    #[arg(long, help_heading = "Light", value_name = "N")]
    ambient_samples: Option<u32>,
    /// `direct`: hard shadows.
    #[arg(long, help_heading = "Light")]
    hard_shadows: bool,

    /// Factor on radiance before tone mapping.
    #[arg(long, help_heading = "Display", value_parser = parse_positive)]
    exposure: Option<f32>,
    /// Curve from radiance to display.
    #[arg(long, help_heading = "Display", value_enum)]
    tonemap: Option<ToneMapName>,
    /// Saturation after the curve; 1 changes nothing.
    #[arg(long, help_heading = "Display")]
    saturation: Option<f32>,

    /// What renders: auto (a GPU if there is a real one), cpu, gpu, gpu-bvh, gpu-query, gpu-pipeline.
    #[arg(long, help_heading = "Running", value_name = "NAME", default_value_t = BackendChoice::Auto)]
    backend: BackendChoice,
    /// Which GPU: a part of its name, see `alhazen doctor`.
    #[arg(long, help_heading = "Running", value_name = "NAME")]
    adapter: Option<String>,
    /// Write what took how long to this file, for chrome://tracing.
    #[arg(long, help_heading = "Running", value_name = "FILE")]
    profile: Option<PathBuf>,
    /// Number of threads [default: all cores].
    #[arg(long, help_heading = "Running")]
    threads: Option<usize>,
    /// No progress, no report.
    #[arg(short, long, help_heading = "Running")]
    quiet: bool,
    /// Print what was measured as JSON to stdout.
    #[arg(long, help_heading = "Running")]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum IntegratorName {
    /// Monte Carlo path tracing.
    Path,
    /// Fixed cost: direct light, reflection, refraction, ambient occlusion.
    Direct,
    /// First hit only.
    Aov,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SamplerName {
    /// Owen-scrambled Sobol points.
    Sobol,
    /// Independent uniform numbers.
    Independent,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ToneMapName {
    /// Clip and encode as sRGB.
    Srgb,
    /// Clip.
    None,
    /// Reinhard.
    Reinhard,
    /// ACES (Narkowicz).
    Aces,
    /// AgX.
    Agx,
    /// Khronos PBR Neutral.
    Neutral,
}

impl RenderArgs {
    /// What `alhazen` alone does.
    pub fn default_picture() -> Self {
        use clap::{Args, FromArgMatches};
        let command = Self::augment_args(clap::Command::new("render").no_binary_name(true));
        // Without arguments every value is a default, which the parser has checked in tests.
        Self::from_arg_matches(&command.get_matches_from(std::iter::empty::<&str>()))
            .unwrap_or_else(|e| e.exit())
    }
}

/// Renders what the arguments ask for.
pub fn run(args: &RenderArgs) -> anyhow::Result<()> {
    args.output.iter().try_for_each(|path| check_output(path))?;
    args.profile.as_deref().map_or(Ok(()), check_place)?;
    let options = LoadOptions { lenient: args.lenient, ..LoadOptions::default() };
    let mut loaded = super::load_scene(&args.scene, &args.parameters, &options)?;
    set_environment(args, &mut loaded, &options)?;
    if !args.quiet {
        print_loaded(&loaded);
    }
    let job = job(args, &loaded)?;
    let limits = limits(args, &loaded);
    let tables = alhazen::SceneTables::build(&loaded.scene);
    let names = ObjectNames::of(&loaded);
    let load_time = loaded.report.elapsed;
    // The tables have all that back ends need: free the description before structures are built.
    drop(loaded);
    let mut profile = Profile::new();
    let begin = Instant::now();
    let mut renderer = choose_renderer(args)?;
    profile.span("open the back end", begin);
    let begin = Instant::now();
    let built = renderer.load_tables(tables)?;
    profile.span("load the scene", begin);
    print_notices(&mut renderer);
    let control = cancel_on_interrupt();
    let (first, end) = args.frames.unwrap_or((0, 1));
    for frame in first..end {
        let time = if args.frames.is_some() { frame as f32 / args.fps } else { 0.0 };
        let display = ProgressDisplay::new(control.clone(), u64::from(limits.spp) * pixels(&job), args.quiet);
        let begin = Instant::now();
        let summary = renderer.render_view(&job.view(time), &limits, &control, &mut |_| {})?;
        display.finish();
        profile.span("render", begin);
        profile.passes(&renderer.take_passes(), begin);
        print_notices(&mut renderer);
        let begin = Instant::now();
        let metadata = metadata(args, &job, &summary, &names);
        let written = write_outputs(args, frame, &mut renderer, &job, &metadata)?;
        profile.span("write", begin);
        report(args, &renderer, &job, &summary, load_time, &built, &written)?;
        if summary.cancelled {
            bail!("stopped before the end; the picture has {} samples per pixel", summary.spp);
        }
    }
    args.profile.as_deref().map_or(Ok(()), |path| profile.write(path))
}

/// The back end that the arguments ask for; says once which it is and why.
fn choose_renderer(args: &RenderArgs) -> anyhow::Result<Renderer> {
    let options =
        RendererOptions { backend: args.backend, adapter: args.adapter.clone(), threads: args.threads };
    let chosen = Renderer::choose(&options)?;
    if !args.quiet && !chosen.reason.is_empty() {
        eprintln!("rendering on {}", chosen.reason);
    }
    Ok(chosen.renderer)
}

/// What the back end has to say, even to who wants no progress: the picture was made in another way than asked for.
fn print_notices(renderer: &mut Renderer) {
    renderer.take_notices().iter().for_each(|notice| eprintln!("{notice}"));
}

/// Finds out before rendering what would keep the picture from being written.
fn check_output(path: &Path) -> anyhow::Result<()> {
    output::Format::of(path)?;
    check_place(path)
}

/// Whether a file can be at `path`.
fn check_place(path: &Path) -> anyhow::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    ensure!(folder.is_dir(), "cannot write {}: there is no folder {}", path.display(), folder.display());
    ensure!(!path.is_dir(), "cannot write {}: it is a folder", path.display());
    Ok(())
}

/// Names that go into the metadata so that ids can be understood.
struct ObjectNames {
    materials: String,
    instances: String,
}

impl ObjectNames {
    fn of(loaded: &Loaded) -> Self {
        let limit = 1000;
        let join = |names: Vec<&str>| serde_json::json!(names).to_string();
        Self {
            materials: join(loaded.scene.materials.iter().take(limit).map(|m| m.name.as_str()).collect()),
            instances: join(loaded.scene.instances.iter().take(limit).map(|i| i.name.as_str()).collect()),
        }
    }
}

fn pixels(job: &Job) -> u64 {
    job.crop.map_or(u64::from(job.width) * u64::from(job.height), |c| c.area() as u64)
}

fn cancel_on_interrupt() -> Arc<Control> {
    let control = Arc::new(Control::new());
    let handle = control.clone();
    // Without a handler Ctrl-C still ends the program; it only keeps nothing.
    let _ = ctrlc::set_handler(move || {
        if handle.is_cancelled() {
            std::process::exit(130);
        }
        handle.cancel();
    });
    control
}

fn print_loaded(loaded: &Loaded) {
    let scene = &loaded.scene;
    let (unique, instanced) = (scene.unique_triangles(), scene.instanced_triangles());
    let triangles = if unique as u64 == instanced {
        format!("{unique} triangles")
    } else {
        format!("{unique} triangles ({instanced} instanced)")
    };
    let counts = format!("{} instances, {} materials", scene.instances.len(), scene.materials.len());
    eprintln!("{}: {triangles}, {counts}, loaded in {}", scene.name, seconds(loaded.report.elapsed));
    // Where there is nothing to see, everything that the loader noticed may be the reason.
    print_report(&loaded.report, scene.bounds().is_none());
}

fn set_environment(args: &RenderArgs, loaded: &mut Loaded, options: &LoadOptions) -> anyhow::Result<()> {
    let Some(text) = &args.environment else {
        add_daylight_if_dark(&mut loaded.scene, &mut loaded.report);
        return Ok(());
    };
    loaded.scene.environment = match parse_vector(text) {
        Ok(color) if !Path::new(text).exists() => {
            ensure!(color.iter().all(|c| *c >= 0.0), "--environment {text}: radiance cannot be negative");
            Environment::Constant(color.into())
        }
        _ => {
            let image = alhazen::load_environment(Path::new(text), options, &mut loaded.report)
                .with_context(|| format!("cannot load the environment {text}"))?;
            loaded.scene.images.push(image);
            Environment::Image {
                image: loaded.scene.images.len() as u32 - 1,
                rotation: args.environment_rotation.to_radians(),
                intensity: args.environment_intensity,
            }
        }
    };
    Ok(())
}

fn job(args: &RenderArgs, loaded: &Loaded) -> anyhow::Result<Job> {
    let mut scene_job = Job::for_scene(&loaded.scene);
    scene_job.camera = camera(args, loaded)?;
    let aspect = scene_job.width as f32 / scene_job.height as f32;
    let along = |side: u32, factor: f32| ((side as f32 * factor).round() as u32).max(1);
    (scene_job.width, scene_job.height) = match (args.width, args.height) {
        (Some(w), Some(h)) => (w, h),
        (Some(w), None) => (w, along(w, 1.0 / aspect)),
        (None, Some(h)) => (along(h, aspect), h),
        (None, None) => (scene_job.width, scene_job.height),
    };
    if let Some(crop) = args.crop {
        let whole = Rect::full(scene_job.width, scene_job.height);
        let Rect { x, y, width, height } = crop;
        ensure!(
            whole.contains_rect(&crop) && crop.area() > 0,
            "--crop {x},{y},{width},{height} is not inside the picture of {}×{} pixels",
            whole.width,
            whole.height
        );
        scene_job.crop = Some(crop);
    }
    scene_job.integrator = integrator(args, scene_job.integrator);
    scene_job.single_scatter = args.single_scatter;
    scene_job.sampler = match args.sampler {
        SamplerName::Sobol => SamplerKind::Sobol,
        SamplerName::Independent => SamplerKind::Independent,
    };
    scene_job.seed = args.seed;
    scene_job.aovs = args.aov.clone();
    let tone = &mut scene_job.tone;
    tone.exposure = args.exposure.unwrap_or(tone.exposure);
    tone.saturation = args.saturation.unwrap_or(tone.saturation);
    if let Some(mapper) = args.tonemap {
        tone.mapper = match mapper {
            ToneMapName::Srgb => ToneMapper::Srgb,
            ToneMapName::None => ToneMapper::None,
            ToneMapName::Reinhard => ToneMapper::Reinhard,
            ToneMapName::Aces => ToneMapper::Aces,
            ToneMapName::Agx => ToneMapper::Agx,
            ToneMapName::Neutral => ToneMapper::Neutral,
        };
        // A scene's saturation belongs to its own curve.
        tone.saturation = args.saturation.unwrap_or(1.0);
    }
    Ok(scene_job)
}

fn camera(args: &RenderArgs, loaded: &Loaded) -> anyhow::Result<Camera> {
    let cameras = &loaded.scene.cameras;
    let mut camera = match &args.camera {
        None => loaded.scene.default_camera(),
        Some(name) => {
            let by_number = || name.parse().ok().and_then(|i: usize| cameras.get(i));
            let found = cameras.iter().find(|c| c.name == *name).or_else(by_number);
            let known: Vec<_> = cameras.iter().map(|c| c.name.as_str()).collect();
            found.with_context(|| format!("there is no camera {name:?}; the scene has {known:?}"))?.clone()
        }
    };
    let moved = args.eye.is_some() || args.target.is_some();
    camera.eye = args.eye.map_or(camera.eye, Into::into);
    camera.target = args.target.map_or(camera.target, Into::into);
    if moved {
        ensure!(camera.eye != camera.target, "--eye and --target are the same point");
        camera.focus_distance = (camera.target - camera.eye).length();
        camera.path = None;
    }
    if let Some(fov) = args.fov {
        camera.projection = Projection::Perspective { fov_y: fov.to_radians() };
    }
    camera.focus_distance = args.focus.unwrap_or(camera.focus_distance);
    if let Some(f_number) = args.f_number {
        let Projection::Perspective { fov_y } = camera.projection else {
            bail!("--f-number needs a perspective camera");
        };
        let focal_length = 0.012 / (fov_y * 0.5).tan();
        camera.lens_radius = focal_length / (2.0 * f_number);
    }
    Ok(camera)
}

fn integrator(args: &RenderArgs, of_scene: Integrator) -> Integrator {
    let path = || {
        let scene_depth = if let Integrator::Path(p) = of_scene { Some(p.max_depth) } else { None };
        let default = PathSettings::default();
        Integrator::Path(PathSettings {
            max_depth: args.max_depth.or(scene_depth).unwrap_or(default.max_depth),
            roulette_start: args.roulette_start,
            splitting: args.splitting,
            ..default
        })
    };
    let direct = || {
        let d = DirectSettings::default();
        Integrator::Direct(DirectSettings {
            shadow_samples: args.shadow_samples.unwrap_or(d.shadow_samples),
            reflection_samples: args.reflection_samples.unwrap_or(d.reflection_samples),
            ambient_samples: args.ambient_samples.unwrap_or(d.ambient_samples),
            soft_shadows: !args.hard_shadows,
            max_depth: args.max_depth.unwrap_or(d.max_depth),
            ..d
        })
    };
    match (args.integrator, of_scene) {
        (Some(IntegratorName::Path), _) | (None, Integrator::Path(_)) => path(),
        (Some(IntegratorName::Direct), _) | (None, Integrator::Direct(_)) => direct(),
        (Some(IntegratorName::Aov), _) | (None, Integrator::Aov) => Integrator::Aov,
    }
}

fn limits(args: &RenderArgs, loaded: &Loaded) -> Limits {
    let open_ended = args.time.is_some() || args.noise.is_some();
    let default = if open_ended { 65_536 } else { loaded.scene.defaults.spp.unwrap_or(64) };
    Limits { spp: args.spp.unwrap_or(default), time: args.time, noise: args.noise.map(f64::from) }
}

/// Everything needed to make the picture again, for the EXR header.
fn metadata(args: &RenderArgs, job: &Job, summary: &Summary, names: &ObjectNames) -> Vec<(String, String)> {
    let pair = |k: &str, v: String| (k.to_owned(), v);
    vec![
        pair("software", format!("Alhazen {}", env!("CARGO_PKG_VERSION"))),
        pair("scene", args.scene.clone()),
        pair("parameters", format!("{:?}", args.parameters)),
        pair("camera", format!("{:?}", job.camera)),
        pair("integrator", format!("{:?}", job.integrator)),
        pair("single_scatter", job.single_scatter.to_string()),
        pair("sampler", format!("{:?}", job.sampler)),
        pair("seed", job.seed.to_string()),
        pair("spp", summary.spp.to_string()),
        pair("clamp", "none".into()),
        pair("tone_mapping", format!("{:?}", job.tone)),
        pair("render_seconds", format!("{:.3}", summary.elapsed.as_secs_f64())),
        pair("noise", summary.noise.map_or("unknown".into(), |n| format!("{n:.5}"))),
        pair("invalid_samples", summary.invalid_samples.to_string()),
        pair("material_names", names.materials.clone()),
        pair("instance_names", names.instances.clone()),
    ]
}

fn write_outputs(
    args: &RenderArgs,
    frame: u32,
    renderer: &mut Renderer,
    job: &Job,
    metadata: &[(String, String)],
) -> anyhow::Result<Vec<PathBuf>> {
    let film = renderer.film()?.context("nothing was rendered")?;
    let paths: Vec<_> = args.output.iter().map(|path| frame_path(args, path, frame)).collect();
    for path in &paths {
        output::write(path, film, &job.tone, metadata)?;
    }
    Ok(paths)
}

/// `picture.png` becomes `picture.0007.png` in a sequence.
fn frame_path(args: &RenderArgs, path: &Path, frame: u32) -> PathBuf {
    if args.frames.is_none() {
        return path.to_owned();
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_extension(format!("{frame:04}.{extension}"))
}

fn report(
    args: &RenderArgs,
    renderer: &Renderer,
    job: &Job,
    summary: &Summary,
    load: Duration,
    built: &LoadStats,
    written: &[PathBuf],
) -> anyhow::Result<()> {
    let elapsed = summary.elapsed.as_secs_f64().max(1e-9);
    let (samples_rate, rays_rate) = (summary.samples as f64 / elapsed, summary.rays as f64 / elapsed);
    let memory = alhazen::peak_memory_bytes();
    if args.json {
        let json = serde_json::json!({
            "scene": args.scene, "backend": renderer.backend_name(), "device": renderer.describe(),
            "integrator": job.integrator.name(), "width": job.width, "height": job.height, "spp": summary.spp,
            "samples": summary.samples, "rays": summary.rays, "render_seconds": elapsed,
            "samples_per_second": samples_rate, "rays_per_second": rays_rate,
            "load_seconds": load.as_secs_f64(), "build_seconds": built.build.as_secs_f64(),
            "acceleration_bytes": built.acceleration_bytes, "table_bytes": built.table_bytes,
            "device_bytes": built.device_bytes,
            "device_seconds": summary.device_time.map(|t| t.as_secs_f64()),
            "peak_memory_bytes": memory, "noise": summary.noise, "invalid_samples": summary.invalid_samples,
            "cancelled": summary.cancelled, "output": written,
        });
        print_result(&format!("{json}\n"))?;
    }
    if args.quiet {
        return Ok(());
    }
    if summary.invalid_samples > 0 {
        eprintln!("  {} samples were NaN or infinite and were left out", summary.invalid_samples);
    }
    let names: Vec<_> = written.iter().map(|p| p.display().to_string()).collect();
    eprintln!(
        "{}: {}×{}, {} spp, {} in {} ({}samples/s, {}rays/s) on {}; built in {}{}",
        names.join(", "),
        job.width,
        job.height,
        summary.spp,
        job.integrator.name(),
        seconds(summary.elapsed),
        metric(samples_rate),
        metric(rays_rate),
        renderer.describe(),
        seconds(built.build),
        memory.map_or(String::new(), |m| format!("; peak memory {}", bytes(m))),
    );
    Ok(())
}

fn parse_numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let numbers: Vec<T> = text.split(',').map(|t| t.trim().parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn parse_vector(text: &str) -> Result<[f32; 3], String> {
    let numbers: Option<[f32; 3]> = parse_numbers(text);
    numbers.filter(|v| v.iter().all(|x| x.is_finite())).ok_or_else(|| "expected three numbers: X,Y,Z".into())
}

fn parse_crop(text: &str) -> Result<Rect, String> {
    let [x, y, width, height] = parse_numbers(text).ok_or("expected four whole numbers: X,Y,WIDTH,HEIGHT")?;
    Ok(Rect { x, y, width, height })
}

fn parse_frames(text: &str) -> Result<(u32, u32), String> {
    let (a, b) = text.split_once("..").ok_or("expected A..B")?;
    let number = |t: &str| t.parse::<u32>().map_err(|e| format!("{t:?}: {e}"));
    let (a, b) = (number(a)?, number(b)?);
    if a < b { Ok((a, b)) } else { Err(format!("{a}..{b} has no frames")) }
}

fn parse_duration(text: &str) -> Result<Duration, String> {
    let (number, factor) = match text.strip_suffix(['s', 'm', 'h']) {
        Some(number) if text.ends_with('s') => (number, 1.0),
        Some(number) if text.ends_with('m') => (number, 60.0),
        Some(number) => (number, 3600.0),
        None => (text, 1.0),
    };
    let value: f64 = number.trim().parse().map_err(|_| "expected a duration such as 30s, 5m or 1.5h")?;
    Duration::try_from_secs_f64(value * factor).map_err(|e| e.to_string())
}

fn parse_positive(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| "expected a number")?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("expected a number above zero".into()) }
}

fn parse_fov(text: &str) -> Result<f32, String> {
    let value = parse_positive(text)?;
    if value < 180.0 { Ok(value) } else { Err("expected degrees between 0 and 180".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_picture_has_valid_arguments() {
        let args = RenderArgs::default_picture();
        assert_eq!(args.scene, "three-spheres");
        assert_eq!(args.output, [PathBuf::from("render.png")]);
    }

    #[test]
    fn values_are_parsed_and_checked() {
        assert_eq!(parse_vector("1,-2.5, 3"), Ok([1.0, -2.5, 3.0]));
        assert!(parse_vector("1,2").is_err() && parse_vector("1,2,nan").is_err());
        assert_eq!(parse_crop("1,2,3,4"), Ok(Rect { x: 1, y: 2, width: 3, height: 4 }));
        assert_eq!(parse_frames("2..5"), Ok((2, 5)));
        assert!(parse_frames("5..5").is_err() && parse_frames("5").is_err());
        assert_eq!(parse_duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(parse_duration("2"), Ok(Duration::from_secs(2)));
        assert!(parse_duration("-1s").is_err() && parse_duration("x").is_err());
        assert!(parse_fov("0").is_err() && parse_fov("180").is_err() && parse_fov("45").is_ok());
    }

    #[test]
    fn frames_are_numbered() {
        let mut args = RenderArgs::default_picture();
        assert_eq!(frame_path(&args, Path::new("a/b.png"), 7), PathBuf::from("a/b.png"));
        args.frames = Some((0, 10));
        assert_eq!(frame_path(&args, Path::new("a/b.png"), 7), PathBuf::from("a/b.0007.png"));
    }
}
