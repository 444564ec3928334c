//! `alhazen view`: the interactive window.

use crate::console::{print_result, say};
use alhazen::edits::DaylightRecord;
use alhazen::{
    BackendChoice, Daylight, Integrator, LoadOptions, PathKernel, RendererOptions, Source, SunPosition,
    TevAddress,
};
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};
use std::time::Instant;
use viewer::smoke::{Smoke, parse, steps_help};
use viewer::viewer::{FirstEnvironment, FirstView, Start};
use viewer::{Options, ViewerError};

/// Haziness of the sky of `--sun`: clear.
const TURBIDITY: f32 = 3.0;
/// What the ground reflects below that sky.
const GROUND: [f32; 3] = [0.2; 3];

/// Open a scene in a window: look at it, change it, save it.
#[derive(Debug, clap::Args)]
pub struct ViewArgs {
    /// A file (.obj, .gltf, .glb, .pbrt, .ply, .stl, .toml) or a built-in scene, see `alhazen scenes`.
    #[arg(default_value = alhazen::builtin::DEFAULT)]
    scene: String,
    /// Set a parameter of a scene; may be given several times.
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE", value_parser = super::parse_parameter)]
    parameters: Vec<(String, String)>,
    /// Go on without what the file requires but Alhazen does not know.
    #[arg(long)]
    lenient: bool,
    #[command(flatten)]
    loading: super::loading::LoadingArgs,
    /// Width of the picture in pixels [default: the window's].
    #[arg(long, requires = "height", value_parser = clap::value_parser!(u32).range(16..=16_384))]
    width: Option<u32>,
    /// Height of the picture in pixels.
    #[arg(long, requires = "width", value_parser = clap::value_parser!(u32).range(16..=16_384))]
    height: Option<u32>,
    /// How light is transported [default: what the scene says, or path].
    #[arg(long, value_name = "INTEGRATOR", value_parser = super::render::integrators())]
    integrator: Option<Integrator>,
    /// Samples per pixel after which the picture is done [default: what the scene says, or 1024].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Camera of the file, by name or number.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Light from outside: an .hdr or .exr panorama, a constant radiance R,G,B, or studio, sky or night.
    #[arg(long, value_name = "FILE|R,G,B|NAME")]
    environment: Option<String>,
    /// A clear sky with its sun, where it stands: see `alhazen render --help`. Try --exposure 0.02.
    #[arg(long, value_name = "POSITION", conflicts_with = "environment")]
    sun: Option<SunPosition>,
    /// Factor on radiance before tone mapping.
    #[arg(long, value_parser = super::render::parsing::parse_positive)]
    exposure: Option<f32>,
    /// What renders: auto (a GPU if there is a real one), cpu, gpu, gpu-bvh, gpu-query, gpu-pipeline, all.
    #[arg(long, value_name = "NAME", default_value_t = BackendChoice::Auto)]
    backend: BackendChoice,
    /// Which GPU: a part of its name, see `alhazen doctor`. Several, separated by commas, work together.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// How a GPU follows paths: auto, megakernel or wavefront.
    #[arg(long, value_name = "NAME", default_value_t = PathKernel::Auto)]
    kernel: PathKernel,
    /// Number of threads [default: all cores].
    #[arg(long, value_parser = super::render::parsing::parse_threads)]
    threads: Option<usize>,
    /// Send pictures to a running tev as they are shown; without a port that is 14158, tev's own.
    #[arg(long, value_name = "HOST:PORT")]
    tev: Option<TevAddress>,
    /// Size of the window, WIDTHxHEIGHT in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    window: Option<[u32; 2]>,
    /// Run unattended: close after so many frames, and remember nothing.
    #[arg(long, help_heading = "Tests", value_name = "FRAMES")]
    smoke: Option<u64>,
    /// A picture of the window at the end.
    #[arg(long, help_heading = "Tests", value_name = "FILE", requires = "smoke")]
    screenshot: Option<PathBuf>,
    /// What to do, a step a line; --help lists the steps.
    #[arg(long, help_heading = "Tests", value_name = "FILE", requires = "smoke", long_help = script_help())]
    smoke_script: Option<PathBuf>,
}

/// What `--help` says of scripts.
fn script_help() -> String {
    format!("What to do, a step a line; upper and lower case are the same:\n{}", steps_help())
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("expected WIDTHxHEIGHT, such as 1280x800")?;
    let side = |text: &str| match text.parse() {
        Ok(side @ 64..=16_384) => Ok(side),
        _ => Err(format!("`{text}` is not between 64 and 16384")),
    };
    Ok([side(width)?, side(height)?])
}

/// The window of `alhazen` alone, where there is a display; `None` where no window can be opened.
///
/// Being a display's name in the environment does not make it one: what cannot be opened is as good as none.
pub fn run_default() -> Option<anyhow::Result<()>> {
    if !viewer::has_display() {
        return None;
    }
    let options = Options {
        source: Source::parse(alhazen::builtin::DEFAULT),
        start: Start::default(),
        window: None,
        smoke: None,
        began: Instant::now(),
    };
    match viewer::run(options) {
        Err(error @ (ViewerError::Display(_) | ViewerError::Window(_) | ViewerError::Surface(_))) => {
            say!("no window: {:#}", anyhow::Error::from(error));
            None
        }
        result => Some(result.map(drop).map_err(Into::into)),
    }
}

/// Opens the window.
pub fn run(args: &ViewArgs) -> anyhow::Result<()> {
    let began = Instant::now();
    let mut source = Source::parse(&args.scene);
    source.parameters = args.parameters.iter().cloned().collect();
    let start = Start {
        load: LoadOptions { lenient: args.lenient, ..args.loading.options() },
        renderer: RendererOptions {
            backend: args.backend,
            adapter: args.adapter.clone(),
            threads: args.threads,
            kernel: args.kernel,
        },
        size: args.width.zip(args.height).map(|(width, height)| [width, height]),
        first: first_view(args)?,
        tev: args.tev.clone(),
        ..Start::default()
    };
    let smoke = match args.smoke {
        None => None,
        Some(frames) => {
            let script = match &args.smoke_script {
                None => Vec::new(),
                Some(path) => {
                    let text = std::fs::read_to_string(path)
                        .with_context(|| format!("cannot read {}", path.display()))?;
                    parse(&text)?
                }
            };
            Some(Smoke { frames, screenshot: args.screenshot.clone(), script })
        }
    };
    let report = viewer::run(Options { source, start, window: args.window, smoke, began })?;
    print_result(&report.iter().map(|line| format!("{line}\n")).collect::<String>())
}

/// How the scene is looked at first.
fn first_view(args: &ViewArgs) -> anyhow::Result<FirstView> {
    let of_sun = |sun: SunPosition| {
        let daylight = Daylight { sun, turbidity: TURBIDITY, ground: GROUND.into(), intensity: 1.0 };
        FirstEnvironment::Daylight(DaylightRecord::from(&daylight))
    };
    let environment = match &args.environment {
        Some(text) => Some(parse_environment(text)?),
        None => args.sun.map(of_sun),
    };
    Ok(FirstView {
        integrator: args.integrator.map(|integrator| integrator.name().to_owned()),
        spp: args.spp,
        camera: args.camera.clone(),
        environment,
        exposure: args.exposure,
    })
}

/// A file, or three numbers where there is no file of that name; as `alhazen render` has it.
fn parse_environment(text: &str) -> anyhow::Result<FirstEnvironment> {
    if let Some(preset) = super::render::environment_preset(text) {
        return Ok(FirstEnvironment::Preset(preset));
    }
    match super::render::parsing::parse_vector(text) {
        Ok(radiance) if !Path::new(text).exists() => {
            ensure!(radiance.iter().all(|c| *c >= 0.0), "--environment {text}: radiance cannot be negative");
            Ok(FirstEnvironment::Constant(radiance))
        }
        _ => {
            ensure!(Path::new(text).is_file(), "--environment {text}: there is no such file");
            Ok(FirstEnvironment::File(text.into()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn environments_are_numbers_or_files() {
        let studio = FirstEnvironment::Preset(alhazen::EnvironmentPreset::Studio);
        assert_eq!(parse_environment("studio").expect("ours"), studio);
        assert_eq!(parse_environment("1,2,3").expect("numbers"), FirstEnvironment::Constant([1.0, 2.0, 3.0]));
        let error = parse_environment("-1,0,0").unwrap_err().to_string();
        assert!(error.contains("negative"), "{error}");
        let error = parse_environment("no such.hdr").unwrap_err().to_string();
        assert!(error.contains("no such.hdr") && error.contains("no such file"), "{error}");
    }

    #[test]
    fn sizes_of_windows() {
        assert_eq!(parse_size("1280x800"), Ok([1280, 800]));
        for wrong in ["1280", "1280x", "1x1", "axb", "99999x800"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }
}
