//! What is to be rendered: camera, picture, integrator.

use crate::{Mis, RealtimeSettings, Switch};
use film::{Aov, Rect};
use optics::camera::CameraFrame;
use optics::motion::motion_place;
use optics::moving_camera::{CameraSegment, camera_in_motion};
use optics::shutter::Shutter;
use std::sync::Arc;

/// How samples are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol points (Burley 2020).
    #[default]
    Sobol,
    /// Independent uniform numbers.
    Independent,
    /// Sobol points that also complete each other among neighbouring pixels, which spreads the error as blue noise
    /// (Ahmed and Wonka 2020).
    BlueNoise,
}

impl SamplerKind {
    /// All kinds, the default first.
    pub const ALL: [Self; 3] = [Self::Sobol, Self::Independent, Self::BlueNoise];

    /// The name that users give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Independent => "independent",
            Self::BlueNoise => "blue-noise",
        }
    }
}

impl std::fmt::Display for SamplerKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for SamplerKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|kind| kind.name() == name);
        known.ok_or_else(|| format!("unknown `{name}`; there are: {}", Self::ALL.map(Self::name).join(", ")))
    }
}

/// Samples that one pixel is to get.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelSamples {
    /// Index of the pixel in the view's window, row by row from the top.
    pub pixel: u32,
    /// Index of the first sample. The samples of a pixel should be consecutive from one call to the next: the points of a
    /// low-discrepancy sequence are good only together.
    pub first: u32,
    /// Number of samples.
    pub count: u32,
}

/// A camera and everything else that decides the expected picture and its noise.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: CameraFrame,
    /// Width of the whole picture in pixels.
    pub width: u32,
    /// Height of the whole picture in pixels.
    pub height: u32,
    /// The part of the picture to render.
    pub window: Rect,
    /// How light is transported.
    pub integrator: Integrator,
    /// Follow glTF 2.0 Appendix B to the letter instead of giving back energy lost between microfacets.
    pub single_scatter: bool,
    /// How samples are drawn.
    pub sampler: SamplerKind,
    /// Changes the noise of the whole picture.
    pub seed: u32,
    /// Index of the first sample to render, so that sample ranges can be rendered apart and merged.
    pub first_sample: u32,
    /// Auxiliary layers to fill.
    pub aovs: Vec<Aov>,
    /// When camera rays leave; `None` is an instant, for which everything is in the middle of its
    /// motion.
    pub shutter: Option<ViewShutter>,
}

/// When camera rays leave, and where the camera is then.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewShutter {
    /// In the time of the scene's motion, from 0 to 1.
    pub timing: Shutter,
    /// Segments of the camera's motion; none if it stands still. [`View::camera`] is in the middle
    /// of them.
    pub camera: Arc<[CameraSegment]>,
}

impl View {
    /// The camera at `time`.
    pub fn camera_at(&self, time: f32) -> CameraFrame {
        match &self.shutter {
            Some(ViewShutter { camera, .. }) if !camera.is_empty() => {
                let place = motion_place(time, camera.len() as u32);
                camera_in_motion(self.camera, camera[place.segment as usize], place.fraction)
            }
            _ => self.camera,
        }
    }

    /// Whether the camera moves while the shutter is open.
    pub fn camera_moves(&self) -> bool {
        self.shutter.as_ref().is_some_and(|shutter| !shutter.camera.is_empty())
    }
}

/// How light is transported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// Monte Carlo path tracing: unbiased, the reference for all others.
    Path(PathSettings),
    /// Fixed cost: direct light, reflection, refraction, ambient occlusion.
    Direct(DirectSettings),
    /// A G-buffer from the rasteriser and rays for everything else, pass by pass: what `direct` shows, in real time.
    Hybrid(HybridSettings),
    /// What `path` shows, in real time: few paths from the G-buffer's first hits, what frames before have found, a filter.
    Realtime(RealtimeSettings),
    /// The first hit only: base colour under a headlight, and auxiliary layers.
    Aov,
    /// Ambient occlusion at the first hit: the share of the hemisphere that is open, by the cosine. No light, no material.
    AmbientOcclusion(AmbientOcclusion),
}

impl Integrator {
    /// Name on the command line and in metadata.
    pub fn name(&self) -> &'static str {
        match self {
            Integrator::Path(_) => "path",
            Integrator::Direct(_) => "direct",
            Integrator::Hybrid(_) => "hybrid",
            Integrator::Realtime(_) => "realtime",
            Integrator::Aov => "aov",
            Integrator::AmbientOcclusion(_) => "ao",
        }
    }

    /// One of each, with usual settings.
    pub fn all() -> [Self; 6] {
        [
            Self::Path(PathSettings::default()),
            Self::Direct(DirectSettings::default()),
            Self::Hybrid(HybridSettings::default()),
            Self::Realtime(RealtimeSettings::default()),
            Self::Aov,
            Self::AmbientOcclusion(AmbientOcclusion::default()),
        ]
    }

    /// The integrator of a name, with usual settings.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|integrator| integrator.name() == name)
    }

    /// What it does, in one line for users.
    pub fn description(&self) -> &'static str {
        match self {
            Self::Path(_) => "Monte Carlo path tracing",
            Self::Direct(_) => "Fixed cost: direct light, reflection, refraction, ambient occlusion",
            Self::Hybrid(_) => {
                "What `direct` shows, in real time: a rasterised first hit, and few rays for each effect"
            }
            Self::Realtime(_) => {
                "What `path` shows, in real time: few paths for each pixel, frames before, and a filter"
            }
            Self::Aov => "First hit only",
            Self::AmbientOcclusion(_) => {
                "Ambient occlusion: how much of the hemisphere above the first hit is open"
            }
        }
    }

    /// Longest path in segments, for those that follow paths.
    pub fn max_depth_mut(&mut self) -> Option<&mut u32> {
        match self {
            Self::Path(path) => Some(&mut path.max_depth),
            Self::Direct(direct) => Some(&mut direct.max_depth),
            Self::Hybrid(hybrid) => Some(&mut hybrid.rays.max_depth),
            Self::Realtime(realtime) => Some(&mut realtime.path.max_depth),
            Self::Aov | Self::AmbientOcclusion(_) => None,
        }
    }

    /// Whether it makes frames one after the other, which need a GPU.
    pub fn makes_frames(&self) -> bool {
        matches!(self, Self::Hybrid(_) | Self::Realtime(_))
    }

    /// Ambient occlusion, for those that have it.
    pub fn ambient_mut(&mut self) -> Option<&mut AmbientOcclusion> {
        match self {
            Self::Direct(direct) => Some(&mut direct.ambient),
            Self::Hybrid(hybrid) => Some(&mut hybrid.rays.ambient),
            Self::AmbientOcclusion(ambient) => Some(ambient),
            Self::Path(_) | Self::Realtime(_) | Self::Aov => None,
        }
    }

    /// As [`Integrator::ambient_mut`], to read.
    pub fn ambient(mut self) -> Option<AmbientOcclusion> {
        self.ambient_mut().copied()
    }
}

/// Settings of [`Integrator::Path`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// Longest path in segments: 1 = emission seen directly, 2 = direct light.
    pub max_depth: u32,
    /// Paths shorter than this never meet Russian roulette.
    pub roulette_start: u32,
    /// Least probability of survival, in `(0, 1]`.
    pub roulette_min_survival: f32,
    /// Paths that go on from the first vertex of each camera ray, at least 1.
    pub splitting: u32,
    /// How the two ways to find light are weighted.
    pub mis: Mis,
    /// The most that light which a path finds after more than two segments may add to a sample, W·sr⁻¹·m⁻², positive. `None`
    /// limits nothing. A limit removes bright specks and the light that they stand for: the picture is biased, darker.
    pub clamp_indirect: Option<f32>,
    /// How light is found that comes by mirrors or through glass.
    pub caustics: Switch,
    /// Whether paths follow what was learned of the light before.
    pub guiding: Switch,
}

impl PathSettings {
    /// The most that indirect light may add to a branch of a path; [`f32::MAX`] limits nothing.
    pub fn most_indirect(&self) -> f32 {
        self.clamp_indirect.map_or(f32::MAX, |most| most / self.splitting.max(1) as f32)
    }
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            max_depth: 32,
            roulette_start: 5,
            roulette_min_survival: 0.05,
            splitting: 1,
            mis: Mis::Power,
            clamp_indirect: None,
            caustics: Switch::Off,
            guiding: Switch::default(),
        }
    }
}

/// Rays that ask how much of the hemisphere above a surface is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientOcclusion {
    /// Rays from a first hit.
    pub samples: u32,
    /// How far occluders count, in metres, above 0; infinite reaches everything.
    pub distance: f32,
}

impl AmbientOcclusion {
    /// Takes a distance as users say it: metres, and 0 for no limit.
    pub fn set_distance(&mut self, metres: f32) {
        self.distance = if metres > 0.0 { metres } else { f32::INFINITY };
    }
}

impl Default for AmbientOcclusion {
    fn default() -> Self {
        Self { samples: 1, distance: f32::INFINITY }
    }
}

/// Settings of [`Integrator::Direct`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectSettings {
    /// Shadow rays for each light that has an extent; points and hard lights need one.
    pub shadow_samples: u32,
    /// Whether lights with an extent are sampled over it. Otherwise they shine from their centre.
    pub soft_shadows: bool,
    /// Reflection rays at the first hit.
    pub reflection_samples: u32,
    /// Ambient occlusion at the first hit; without rays, ambient light is unoccluded.
    pub ambient: AmbientOcclusion,
    /// Longest chain of mirror reflections and refractions.
    pub max_depth: u32,
    /// How lights shade diffuse and glossy surfaces.
    pub highlights: Highlights,
    /// How lights that have a place fade with distance: c in 1, l in 1/m and q in 1/m² of 1 / (c + l d + q d²), none negative and
    /// one of them positive. [`INVERSE_SQUARE`] is physics.
    pub falloff: [f32; 3],
}

/// [`DirectSettings::falloff`] of light as it is.
pub const INVERSE_SQUARE: [f32; 3] = [0.0, 0.0, 1.0];

/// How [`Integrator::Direct`] and [`Integrator::Hybrid`] shade diffuse and glossy surfaces with lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Highlights {
    /// As all integrators do.
    #[default]
    Microfacets,
    /// Lambert and Phong, to see the difference.
    Phong,
}

impl Highlights {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 2] = [Self::Microfacets, Self::Phong];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Microfacets => "microfacets",
            Self::Phong => "phong",
        }
    }
}

impl DirectSettings {
    /// Whether surfaces and lights are those that all other integrators know.
    pub fn is_physical(&self) -> bool {
        self.highlights == Highlights::Microfacets && self.falloff == INVERSE_SQUARE
    }
}

impl Default for DirectSettings {
    fn default() -> Self {
        Self {
            shadow_samples: 6,
            soft_shadows: true,
            reflection_samples: 4,
            ambient: AmbientOcclusion { samples: 4, ..AmbientOcclusion::default() },
            max_depth: 8,
            highlights: Highlights::Microfacets,
            falloff: INVERSE_SQUARE,
        }
    }
}

/// Settings of [`Integrator::Hybrid`]. Everything may change from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HybridSettings {
    /// Rays for each effect, as the integrator `direct` has them.
    pub rays: DirectSettings,
    /// How the first surface behind each pixel is found.
    pub visibility: Visibility,
    /// Whether lights ask for shadows at all.
    pub shadows: bool,
    /// Irradiance in W/m² below which a light does not count at a point, whatever the angle: a light then costs only where
    /// it matters. 0: all lights count everywhere, and the expected picture is that of `direct`.
    pub light_cutoff: f32,
    /// Least probability in `(0, 1]` with which a glossy surface sends out reflection rays. The probability is about what the
    /// surface reflects, and rays that are sent count for those that are not; 1 sends them all.
    pub reflection_survival: f32,
}

impl HybridSettings {
    /// Whether the expected picture is that of [`Integrator::Direct`] with the same rays.
    pub fn equals_direct(&self) -> bool {
        self.shadows && self.light_cutoff <= 0.0
    }
}

impl Default for HybridSettings {
    fn default() -> Self {
        let one_each = DirectSettings {
            shadow_samples: 1,
            reflection_samples: 1,
            ambient: AmbientOcclusion::default(),
            ..Default::default()
        };
        Self {
            rays: one_each,
            visibility: Visibility::Raster,
            shadows: true,
            light_cutoff: 0.0,
            reflection_survival: 0.04,
        }
    }
}

/// How [`Integrator::Hybrid`] finds the first surface behind each pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Visibility {
    /// The rasteriser draws it. Panoramas, which no rasteriser can draw, take rays.
    #[default]
    Raster,
    /// A ray through each pixel: faster where a chip has few units for triangles and pixels.
    Rays,
}

impl Visibility {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 2] = [Self::Raster, Self::Rays];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Rays => "rays",
        }
    }
}
