//! The arguments of `alhazen render`.

use super::output::OutputArgs;
use super::parsing::{
    Numbers, parse_crop, parse_duration, parse_falloff, parse_finite, parse_fov, parse_fraction,
    parse_frames, parse_list, parse_not_negative, parse_position, parse_positive, parse_projection,
    parse_seconds, parse_share, parse_threads, parse_turbidity,
};
use super::places::is_video;
use super::realtime::FrameSettings;
use super::roulette::RouletteArgs;
use super::shutter::ShutterArgs;
use super::split::SplitArgs;
use crate::commands::loading::LoadingArgs;
use crate::commands::tone::ToneArgs;
use alhazen::{
    Adaptive, Aov, BackendChoice, Denoiser, Integrator, Mis, PathKernel, Projection, Rect, SamplerKind,
    SunPosition, Switch, TevAddress,
};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, FromArgMatches, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// The help of `--aov`, with the names of all layers.
fn layers_help() -> String {
    let names = Aov::ALL.map(Aov::name).join(", ");
    format!("Auxiliary layers for EXR, separated by commas: {names}. Cryptomattes are made by the CPU only")
}

/// Render a scene to a picture.
///
/// The scene is a file (.obj, .gltf, .glb, .pbrt, .ply, .stl, or a .toml scene file) or the name of a built-in scene, see
/// `alhazen scenes`. Progress goes to stderr. Ctrl-C, SIGTERM and SIGHUP stop and keep what is there; a second one stops at once.
#[derive(Debug, Clone, Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  alhazen render cornell -o cornell.png
  alhazen render model.glb -o model.exr --environment sky.hdr --aov depth,normal,albedo
  alhazen render three-spheres --frames 0..240 --fps 24 -o frame.png
  alhazen render fox.glb --animation Run --frames 0..48 -o run.png
  alhazen render model.glb --turntable 10 -o turntable.mp4
  alhazen render atrium --tile 2/4 -o part2.exr        then: alhazen merge part*.exr -o atrium.png
  alhazen render atrium --noise 0.02 --time 5m -o atrium.png")]
pub struct RenderArgs {
    /// Scene file or name of a built-in scene.
    #[arg(value_name = "FILE|SCENE", default_value = "three-spheres")]
    pub scene: String,
    /// Picture to write: .png or .jpg (tone mapped), .exr (linear, layers, metadata) or .hdr; of a sequence also .mp4, if there is
    /// ffmpeg. May be given several times.
    #[arg(short, long, value_name = "FILE", default_value = "render.png")]
    pub output: Vec<PathBuf>,
    /// Parameter of the scene, as NAME=VALUE. May be given several times.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = crate::commands::parse_parameter)]
    pub(super) parameters: Vec<(String, String)>,
    /// Go on without what the file requires but Alhazen does not know.
    #[arg(long)]
    pub(super) lenient: bool,
    #[command(flatten)]
    pub(super) loading: LoadingArgs,
    /// Show one of the material variants that a glTF file has.
    #[arg(long, value_name = "NAME")]
    pub(super) variant: Option<String>,

    /// Width in pixels.
    #[arg(long, help_heading = "Picture", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(super) width: Option<u32>,
    /// Height in pixels.
    #[arg(long, help_heading = "Picture", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(super) height: Option<u32>,
    /// Render only this part: X,Y,WIDTH,HEIGHT in pixels from the upper left.
    #[arg(long, help_heading = "Picture", value_name = "X,Y,W,H", value_parser = parse_crop)]
    pub(super) crop: Option<Rect>,
    /// Samples per pixel [default: what the scene says, or 64].
    #[arg(long, help_heading = "Picture", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,
    /// Stop after this time, such as 30s, 5m, 1.5h.
    #[arg(long, help_heading = "Picture", value_name = "DURATION", value_parser = parse_duration)]
    pub(super) time: Option<Duration>,
    /// Stop when the relative standard error of the picture is below this, such as 0.02. Samples go where they lower it
    /// most (--sampling adaptive). Without --spp, at most 65536 samples are made.
    #[arg(long, help_heading = "Picture", value_name = "ERROR", value_parser = parse_positive)]
    pub(super) noise: Option<f32>,
    /// How samples are spread over the picture [default: adaptive with --noise, else uniform].
    #[arg(long, help_heading = "Picture", value_enum)]
    pub(super) sampling: Option<SamplingName>,
    /// Adaptive sampling: samples that every pixel gets before errors are looked at.
    #[arg(long, help_heading = "Picture", value_name = "SPP", default_value_t = Adaptive::default().min_spp, value_parser = clap::value_parser!(u32).range(2..))]
    pub(super) min_spp: u32,
    #[arg(long, help_heading = "Picture", value_name = "LIST", value_delimiter = ',', help = layers_help())]
    pub(super) aov: Vec<Aov>,
    /// Remove the noise of the finished picture, guided by albedo and normals. An .exr file keeps the picture as it was as
    /// the layer `noisy`.
    #[arg(long, help_heading = "Picture", value_enum, value_name = "WHAT", num_args = 0..=1, require_equals = true, default_missing_value = "network")]
    pub(super) denoise: Option<DenoiserName>,
    /// Show the picture in a running tev while it is rendered; without a port that is 14158, tev's own.
    #[arg(long, help_heading = "Output", value_name = "HOST:PORT")]
    pub(super) tev: Option<TevAddress>,
    /// Seed of the noise.
    #[arg(long, help_heading = "Picture", default_value_t = 0)]
    pub(super) seed: u32,

    /// Camera of the file, by name or number.
    #[arg(long, help_heading = "Camera", value_name = "NAME")]
    pub(super) camera: Option<String>,
    /// Position of the camera.
    #[arg(long, help_heading = "Camera", value_name = "X,Y,Z", value_parser = parse_position, allow_hyphen_values = true)]
    pub(super) eye: Option<[f64; 3]>,
    /// Point that the camera looks at.
    #[arg(long, help_heading = "Camera", value_name = "X,Y,Z", value_parser = parse_position, allow_hyphen_values = true)]
    pub(super) target: Option<[f64; 3]>,
    /// How the camera maps directions to the picture: perspective, orthographic, panorama (360° × 180°), fisheye, cubemap
    /// (six faces side by side) [default: that of the camera].
    #[arg(long, help_heading = "Camera", value_name = "NAME", value_parser = parse_projection)]
    pub(super) projection: Option<Projection>,
    /// Vertical field of view in degrees; of a fisheye the angle of its circle.
    #[arg(long, help_heading = "Camera", value_name = "DEGREES", value_parser = parse_fov)]
    pub(super) fov: Option<f32>,
    /// f-number of the lens, for a 36 mm × 24 mm film; smaller is blurrier.
    #[arg(long, help_heading = "Camera", value_name = "N", value_parser = parse_positive)]
    pub(super) f_number: Option<f32>,
    /// Distance in focus, in metres [default: the target].
    #[arg(long, help_heading = "Camera", value_name = "METRES", value_parser = parse_positive)]
    pub(super) focus: Option<f32>,

    /// Intrinsics of a calibrated camera, in pixels of the picture, as OpenCV has them: pixel centres are at whole numbers.
    #[arg(long, help_heading = "Camera", value_name = "FX,FY,CX,CY[,S]", value_parser = parse_list, allow_hyphen_values = true, conflicts_with = "fov")]
    pub(super) intrinsics: Option<Numbers>,
    /// Coefficients of the lens in the order of OpenCV. What lies outside of its field is black.
    #[arg(long, help_heading = "Camera", value_name = "K1,K2,P1,P2[,K3[,K4,K5,K6]]", value_parser = parse_list, allow_hyphen_values = true, conflicts_with = "fisheye")]
    pub(super) distortion: Option<Numbers>,
    /// The same of OpenCV's fisheye.
    #[arg(long, help_heading = "Camera", value_name = "K1,K2,K3,K4", value_parser = parse_list, allow_hyphen_values = true)]
    pub(super) fisheye: Option<Numbers>,

    /// Render frames A to B − 1 of a sequence, or the one frame A. The output's name gets the frame's number: before its
    /// ending, or where it has #### instead of digits.
    #[arg(long, help_heading = "Sequence", value_name = "A..B", value_parser = parse_frames)]
    pub frames: Option<(u32, u32)>,
    /// Frames per second.
    #[arg(long, help_heading = "Sequence", default_value_t = 24.0, value_parser = parse_positive)]
    pub(super) fps: f32,
    /// Render one picture of the scene as it is after this many seconds; without this and --frames, animated scenes are
    /// rendered as their file describes them at rest.
    #[arg(long, help_heading = "Sequence", value_name = "SECONDS", value_parser = parse_seconds, conflicts_with = "frames")]
    pub(super) at: Option<f32>,
    #[command(flatten)]
    pub(super) shutter: ShutterArgs,
    /// Which of the file's animations is played, by name or number [default: the first].
    #[arg(long, help_heading = "Sequence", value_name = "NAME")]
    pub(super) animation: Option<String>,
    /// Start the animation again after its end, instead of holding its last pose.
    #[arg(long, help_heading = "Sequence")]
    pub(super) repeat: bool,
    /// A turntable: the camera goes once around its target in this many seconds. Without --frames, all of the turn is
    /// rendered.
    #[arg(long, help_heading = "Sequence", value_name = "SECONDS", value_parser = parse_positive, conflicts_with = "at")]
    pub(super) turntable: Option<f32>,

    /// With --denoise: denoise each frame by itself. Without this, frames also use what those before them have found, as far
    /// as it agrees: they are cleaner and flicker less, and depend on which frame the command began with.
    #[arg(long, help_heading = "Sequence", requires = "denoise")]
    pub(super) frames_alone: bool,

    #[command(flatten)]
    pub(super) split: SplitArgs,

    /// How light is transported.
    #[arg(long, help_heading = "Light", value_name = "INTEGRATOR", value_parser = integrators())]
    pub(super) integrator: Option<Integrator>,
    /// Longest path: 1 is emission, 2 direct light [default: what the scene says, or 32].
    #[arg(long, help_heading = "Light", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(super) max_depth: Option<u32>,
    /// Light from outside: an .hdr or .exr panorama, a constant radiance R,G,B, or studio, sky or night. Without one, a
    /// scene without lights, in which nothing is brighter than white paper, gets a cloudy sky, and so does a model whose
    /// lights do not reach what is seen; 0,0,0 leaves it out.
    #[arg(long, help_heading = "Light", value_name = "FILE|R,G,B|NAME")]
    pub(super) environment: Option<String>,
    /// Rotation of the environment in degrees.
    #[arg(
        long,
        help_heading = "Light",
        value_name = "DEGREES",
        default_value_t = 0.0,
        value_parser = parse_finite,
        allow_hyphen_values = true
    )]
    pub(super) environment_rotation: f32,
    /// Factor on the environment file.
    #[arg(long, help_heading = "Light", default_value_t = 1.0, value_parser = parse_positive)]
    pub(super) environment_intensity: f32,
    /// A clear sky with its sun, where it stands: ELEVATION,AZIMUTH in degrees (from north over east), or at a moment and a
    /// place, such as 2026-06-21T14:30+02:00@48.14,11.58. In W·sr⁻¹·m⁻²: --exposure 0.02 shows it.
    #[arg(long, help_heading = "Light", value_name = "POSITION", conflicts_with = "environment")]
    pub(super) sun: Option<SunPosition>,
    /// Haziness of that sky: 2 is very clear, 3 clear, 6 hazy.
    #[arg(long, help_heading = "Light", default_value_t = 3.0, value_parser = parse_turbidity)]
    pub(super) turbidity: f32,
    /// Follow glTF 2.0 to the letter: no compensation for light lost between microfacets.
    #[arg(long, help_heading = "Light")]
    pub(super) single_scatter: bool,
    #[command(flatten)]
    pub(super) roulette: RouletteArgs,
    /// Paths that go on from the first hit of each camera ray.
    #[arg(long, help_heading = "Light", value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) splitting: u32,
    /// How the two ways to find light are weighted, a sample of the lights and the sampled direction of the BSDF: power
    /// (heuristic), balance (heuristic), light (samples of lights alone) or bsdf (samples of BSDFs alone). The expected
    /// picture is the same, the noise is not. Only for `path`.
    #[arg(long, help_heading = "Light", value_name = "HEURISTIC", default_value_t)]
    pub(super) mis: Mis,
    /// Limit what indirect light adds to a sample each time that a path finds some: removes bright specks, and light with
    /// them. The picture is biased, and its metadata says so. Off by default. Only for `path`.
    #[arg(long, help_heading = "Light", value_name = "RADIANCE", value_parser = parse_positive)]
    pub(super) clamp_indirect: Option<f32>,
    /// Photons for light that comes by mirrors or through glass: off, on, or auto, which looks whether the scene has such
    /// surfaces and small lights, and says so. Only for `path`, on the CPU. By default what the scene's file says, or off.
    #[arg(long, help_heading = "Light", value_name = "WHEN")]
    pub(super) caustics: Option<Switch>,
    /// Whether paths follow what training paths have learned of the light before the picture: off, on, or auto (where the
    /// training says that it is worth its time). The expected picture is the same, the noise is not. Only for `path`, on the
    /// CPU. By default what the scene's file says, or off.
    #[arg(long, help_heading = "Light", value_name = "WHEN")]
    pub(super) guiding: Option<Switch>,
    /// How samples are drawn: sobol (Owen-scrambled Sobol points), independent (uniform numbers) or blue-noise (Sobol points
    /// that neighbouring pixels complete: the same error, spread so that eyes and filters take it away).
    #[arg(long, help_heading = "Light", value_name = "KIND", default_value_t)]
    pub(super) sampler: SamplerKind,
    /// `direct` and `hybrid`: shadow rays for each light.
    #[arg(long, help_heading = "Light", value_name = "N")]
    pub(super) shadow_samples: Option<u32>,
    /// `direct` and `hybrid`: reflection rays at the first hit.
    #[arg(long, help_heading = "Light", value_name = "N")]
    pub(super) reflection_samples: Option<u32>,
    /// Ambient occlusion rays at the first hit, for the integrators that have ambient occlusion.
    #[arg(long, help_heading = "Light", value_name = "N")]
    pub(super) ambient_samples: Option<u32>,
    /// How far occluders count in ambient occlusion, in metres; 0 or not given: everything counts.
    #[arg(long, help_heading = "Light", value_name = "METRES", value_parser = parse_not_negative)]
    pub(super) ambient_distance: Option<f32>,
    /// `direct` and `hybrid`: hard shadows.
    #[arg(long, help_heading = "Light")]
    pub(super) hard_shadows: bool,
    /// `direct` and `hybrid`: how lights shade diffuse and glossy surfaces.
    #[arg(long, help_heading = "Light", value_enum, default_value_t = HighlightsName::Microfacets)]
    pub(super) highlights: HighlightsName,
    /// `direct` and `hybrid`: lights that have a place fade with distance d as 1 / (C + L d + Q d²). Physics is 0,0,1.
    #[arg(long, help_heading = "Light", value_name = "C,L,Q", value_parser = parse_falloff)]
    pub(super) falloff: Option<[f32; 3]>,
    /// `hybrid`: no shadows.
    #[arg(long, help_heading = "Light", conflicts_with = "hard_shadows")]
    pub(super) no_shadows: bool,
    /// `hybrid` and `realtime`: how first hits are found, by the rasteriser or by rays.
    #[arg(long, help_heading = "Light", value_enum, default_value_t = VisibilityName::Raster)]
    pub(super) visibility: VisibilityName,
    /// `hybrid`: irradiance in W/m² below which a light does not count at a point; 0 counts all lights everywhere.
    #[arg(long, help_heading = "Light", value_name = "IRRADIANCE", default_value_t = 0.0, value_parser = parse_not_negative)]
    pub(super) light_cutoff: f32,
    /// `hybrid`: least probability with which a glossy surface sends out reflection rays; 1 sends them all.
    #[arg(long, help_heading = "Light", value_name = "SHARE", default_value_t = 0.04, value_parser = parse_share)]
    pub(super) reflection_survival: f32,

    #[command(flatten)]
    pub(super) realtime: FrameSettings,

    #[command(flatten)]
    pub(super) tone: ToneArgs,

    #[command(flatten)]
    pub(super) files: OutputArgs,

    /// What renders: auto (a GPU if there is a real one), cpu, gpu, gpu-bvh, gpu-query, gpu-pipeline, all.
    #[arg(long, help_heading = "Running", value_name = "NAME", default_value_t = BackendChoice::Auto)]
    pub(super) backend: BackendChoice,
    /// Which GPU: a part of its name, see `alhazen doctor`. Several, separated by commas, work together.
    #[arg(long, help_heading = "Running", value_name = "NAME")]
    pub(super) adapter: Option<String>,
    /// How a GPU follows paths: auto, megakernel (one kernel from the camera to the end) or wavefront (a kernel for
    /// each step, with queues between them). The picture is the same.
    #[arg(long, help_heading = "Running", value_name = "NAME", default_value_t = PathKernel::Auto)]
    pub(super) kernel: PathKernel,
    /// Write what took how long to this file, for chrome://tracing.
    #[arg(long, help_heading = "Running", value_name = "FILE")]
    pub(super) profile: Option<PathBuf>,
    /// Number of threads [default: all cores].
    #[arg(long, help_heading = "Running", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Fail, with the picture written, if more than this share of the samples were NaN or infinite.
    #[arg(long, help_heading = "Running", value_name = "SHARE", default_value_t = 0.01, value_parser = parse_fraction)]
    pub(super) max_invalid: f64,
    /// No progress, no report.
    #[arg(short, long, help_heading = "Running")]
    pub quiet: bool,
    /// Print what was measured as JSON to stdout.
    #[arg(long, help_heading = "Running")]
    pub json: bool,
}

/// Names of integrators, with what each does.
pub fn integrators() -> impl TypedValueParser<Value = Integrator> {
    let names = Integrator::all().map(|i| PossibleValue::new(i.name()).help(i.description()));
    PossibleValuesParser::new(names).try_map(|name| Integrator::from_name(&name).ok_or("no integrator"))
}

/// What removes noise.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum DenoiserName {
    /// Alhazen's network, which every build has.
    Network,
    /// Weighted regression over albedo and normals.
    Regression,
    /// Open Image Denoise, found where the system looks for libraries or where ALHAZEN_OIDN says.
    Oidn,
}

impl From<DenoiserName> for Denoiser {
    fn from(name: DenoiserName) -> Self {
        match name {
            DenoiserName::Network => Self::Network,
            DenoiserName::Regression => Self::Regression,
            DenoiserName::Oidn => Self::Oidn,
        }
    }
}

/// How samples are spread over the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum SamplingName {
    /// The same number for every pixel.
    Uniform,
    /// Where they lower the picture's error most; --spp is the average.
    Adaptive,
}

/// How lights shade diffuse and glossy surfaces.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum HighlightsName {
    /// As all integrators do.
    Microfacets,
    /// Lambert and Phong, to see the difference.
    Phong,
}

/// How first hits are found.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum VisibilityName {
    /// The rasteriser draws them.
    Raster,
    /// A ray through each pixel.
    Rays,
}

impl RenderArgs {
    /// What `alhazen` alone does.
    pub fn default_picture() -> Self {
        // Few samples are enough to look at. A test checks that the parser takes these arguments.
        let arguments = ["--denoise", "--spp", "8"].map(str::to_owned);
        Self::parse_arguments(&arguments).unwrap_or_else(|e| e.exit())
    }

    /// Reads what would follow `alhazen render`.
    pub fn parse_arguments(arguments: &[String]) -> Result<Self, clap::Error> {
        let command = Self::augment_args(clap::Command::new("render").no_binary_name(true));
        Self::from_arg_matches(&command.try_get_matches_from(arguments)?)
    }

    /// When a frame is, in seconds; `None` if neither a sequence nor a moment was asked for.
    pub(super) fn seconds(&self, frame: u32) -> Option<f32> {
        self.at.or(self.sequence().map(|_| alhazen::frame_time(frame, self.fps)))
    }

    /// The first frame of a sequence, and the one after its last; `None` for a single picture.
    pub(super) fn sequence(&self) -> Option<(u32, u32)> {
        let turn = |seconds: f32| (0, ((seconds * self.fps).round() as u32).max(1));
        self.frames.or(self.turntable.map(turn))
    }

    /// Whether frames are denoised with what those before have found.
    pub(super) fn denoises_sequence(&self) -> bool {
        self.denoise.is_some() && self.sequence().is_some() && !self.frames_alone
    }

    /// Whether samples go where the error is.
    pub(super) fn is_adaptive(&self) -> bool {
        self.sampling.map_or(self.noise.is_some(), |name| name == SamplingName::Adaptive)
    }

    /// The first option given that leaves no room for dividing the render into tasks.
    pub fn not_for_jobs(&self) -> Option<&'static str> {
        let options = [
            (self.time.is_some(), "--time"),
            (self.noise.is_some(), "--noise"),
            (self.is_adaptive(), "--sampling adaptive"),
            (self.profile.is_some(), "--profile"),
            (self.json, "--json"),
            (self.output.iter().any(|path| is_video(path)), "a video"),
            (self.turntable.is_some() && self.frames.is_none(), "--turntable without --frames"),
        ];
        self.split.given().or(options.into_iter().find(|(given, _)| *given).map(|(_, name)| name))
    }
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
}
