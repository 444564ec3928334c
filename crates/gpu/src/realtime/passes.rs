//! The passes of a frame behind the G-buffer: their texts and what they bind.

use crate::bindings::{buffer, entry};
use crate::frame_pass::{FramePass, PassParts};
use crate::shader::{PLANES, Variant, scene_text};
use crate::tracer::{Tracer, TracerText};
use crate::{Gpu, GpuError, GpuScene};
use wgpu::{BufferBindingType, ShaderStages};

/// A pass; in the order of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// What the passes below need to know of surfaces.
    Surfaces,
    /// What may be kept of the frame before.
    Reproject,
    /// The map of the noise.
    MeasureNoise,
    /// Spreads it along rows.
    BlurAcross,
    /// And along columns.
    BlurDown,
    /// How many samples each pixel wants.
    Choose,
    /// Counts them, and keeps to the budget.
    CountSamples,
    /// Sizes of the dispatches.
    LayOut,
    /// The list of the pixels that get samples.
    ListPixels,
    /// Tiles choose lights that their pixels may look at.
    Presample,
    /// A sample for each pixel, or for those of the list.
    Sample,
    /// New samples join the past.
    Accumulate,
    /// The spatial filter, with pixels so many steps apart: 2 to this power.
    Filter(u32),
    /// From light to radiance.
    Recombine,
    /// Joins the picture before.
    Antialias,
    /// Adds the frame to the film.
    Compose,
}

/// Most passes of the spatial filter.
pub const MOST_FILTER_PASSES: u32 = 8;

/// Bindings of group 3, by number, as the shaders name them. The first are the hybrid renderer's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The G-buffer's uniform.
    Frame = 0,
    /// First hits.
    Pixels = 6,
    /// The instances of the frame before.
    PreviousInstances = 7,
    /// The frame's own uniform.
    Realtime = 9,
    /// What pixels see.
    Guides = 10,
    /// The past as the frame before left it.
    HistoriesBefore = 12,
    /// The past as this frame has it.
    Histories = 13,
    /// Sums of the frame's samples.
    LightsFound = 14,
    /// What the filter reads.
    SignalsIn = 15,
    /// What it writes.
    SignalsOut = 16,
    /// The map of the noise.
    Noise = 18,
    /// The same, spread along rows.
    Blurred = 19,
    /// Counts and sizes of dispatches.
    Work = 20,
    /// The frame's colours.
    Colors = 21,
    /// The picture before.
    ShownBefore = 22,
    /// The picture.
    ShownNow = 23,
    /// The map of the noise, spread along rows and columns.
    Spread = 25,
    /// What goes to the film.
    Sums = 26,
}

/// A binding of group 3 and whether the pass writes there.
pub type Bound = (Slot, bool);

const READS: bool = false;
const WRITES: bool = true;

const FILM: &str = include_str!("../shaders/film.wgsl");
const RAYS: &str = include_str!("../shaders/rays.wgsl");
const GROUP_RAYS: &str = include_str!("../shaders/group_rays.wgsl");
const VERTEX: &str = include_str!("../shaders/path_vertex.wgsl");
const HYBRID_FRAME: &str = include_str!("../shaders/hybrid_frame.wgsl");
const PIXELS: &str = include_str!("../shaders/hybrid_pixels.wgsl");
const FRAME: &str = include_str!("../shaders/realtime_frame.wgsl");
const TILES: &str = include_str!("../shaders/realtime_tiles.wgsl");
const FIRST: &str = include_str!("../shaders/realtime_first.wgsl");
// The planes of records.
const GUIDES: &str = include_str!("../shaders/realtime_guides.wgsl");
const FOUND: &str = include_str!("../shaders/realtime_found.wgsl");
const HISTORY: &str = include_str!("../shaders/realtime_history.wgsl");

impl Pass {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        let before = [
            Self::Surfaces,
            Self::Reproject,
            Self::MeasureNoise,
            Self::BlurAcross,
            Self::BlurDown,
            Self::Choose,
            Self::CountSamples,
            Self::LayOut,
            Self::ListPixels,
            Self::Presample,
            Self::Sample,
            Self::Accumulate,
        ];
        let filters = (0..MOST_FILTER_PASSES).map(Self::Filter);
        before.into_iter().chain(filters).chain([Self::Recombine, Self::Antialias, Self::Compose])
    }

    /// What measures the noise.
    pub const NOISE: [Self; 3] = [Self::MeasureNoise, Self::BlurAcross, Self::BlurDown];
    /// What decides which pixels get samples.
    pub const ALLOCATION: [Self; 4] = [Self::Choose, Self::CountSamples, Self::LayOut, Self::ListPixels];

    /// Those of a frame whose samples adapt to the noise or do not, whose lights are chosen by tiles or are not, with so many passes
    /// of the filter.
    pub fn of_frame(adapts: bool, presamples: bool, filter_passes: u32) -> Vec<Self> {
        let mut passes = vec![Self::Surfaces, Self::Reproject];
        if adapts {
            passes.extend(Self::NOISE);
            passes.extend(Self::ALLOCATION);
        }
        if presamples {
            passes.push(Self::Presample);
        }
        passes.extend([Self::Sample, Self::Accumulate]);
        passes.extend((0..filter_passes).map(Self::Filter));
        passes.extend([Self::Recombine, Self::Antialias, Self::Compose]);
        passes
    }

    /// Its place among [`Pass::all`].
    pub fn index(self) -> usize {
        match self {
            Self::Surfaces => 0,
            Self::Reproject => 1,
            Self::MeasureNoise => 2,
            Self::BlurAcross => 3,
            Self::BlurDown => 4,
            Self::Choose => 5,
            Self::CountSamples => 6,
            Self::LayOut => 7,
            Self::ListPixels => 8,
            Self::Presample => 9,
            Self::Sample => 10,
            Self::Accumulate => 11,
            Self::Filter(level) => 12 + level as usize,
            Self::Recombine => 12 + MOST_FILTER_PASSES as usize,
            Self::Antialias => 13 + MOST_FILTER_PASSES as usize,
            Self::Compose => 14 + MOST_FILTER_PASSES as usize,
        }
    }

    /// Name of its entry point.
    pub fn entry_point(self) -> &'static str {
        match self {
            Self::Surfaces => "surfaces",
            Self::Reproject => "reproject",
            Self::MeasureNoise => "measure_noise",
            Self::BlurAcross => "blur_across",
            Self::BlurDown => "blur_down",
            Self::Choose => "choose",
            Self::CountSamples => "count_samples",
            Self::LayOut => "lay_out",
            Self::ListPixels => "list_pixels",
            Self::Presample => "presample_lights",
            Self::Sample => "sample_pixels",
            Self::Accumulate => "accumulate",
            Self::Filter(_) => "filter_signals",
            Self::Recombine => "recombine",
            Self::Antialias => "antialias",
            Self::Compose => "compose_frame",
        }
    }

    /// Whether it sees the scene.
    pub fn sees_scene(self) -> bool {
        self.traces() || matches!(self, Self::Surfaces | Self::Presample | Self::Compose)
    }

    /// Whether it asks the tracer.
    pub fn traces(self) -> bool {
        self == Self::Sample
    }

    /// Bindings of the film's group that it needs beside the view; `None`: not even that.
    pub fn film_bindings(self) -> Option<&'static [u32]> {
        match self {
            Self::Surfaces | Self::Presample => Some(&[]),
            Self::Sample => Some(&[2]),
            Self::Compose => Some(&[1, 2, 3]),
            _ => None,
        }
    }

    /// Bindings of group 3 that it needs.
    pub fn bindings(self) -> &'static [Bound] {
        match self {
            Self::Surfaces => &[
                (Slot::Frame, READS),
                (Slot::Pixels, WRITES),
                (Slot::PreviousInstances, READS),
                (Slot::Realtime, READS),
                (Slot::Guides, WRITES),
                (Slot::LightsFound, WRITES),
            ],
            Self::Reproject => &[
                (Slot::Realtime, READS),
                (Slot::Guides, READS),
                (Slot::HistoriesBefore, READS),
                (Slot::Histories, WRITES),
            ],
            Self::MeasureNoise => &[
                (Slot::Realtime, READS),
                (Slot::Guides, READS),
                (Slot::Histories, READS),
                (Slot::Noise, WRITES),
            ],
            Self::BlurAcross => &[(Slot::Realtime, READS), (Slot::Noise, WRITES), (Slot::Blurred, WRITES)],
            Self::BlurDown => &[(Slot::Realtime, READS), (Slot::Blurred, WRITES), (Slot::Spread, WRITES)],
            Self::Choose => &[
                (Slot::Realtime, READS),
                (Slot::Guides, READS),
                (Slot::Histories, READS),
                (Slot::LightsFound, WRITES),
                (Slot::Work, WRITES),
                (Slot::Spread, WRITES),
            ],
            Self::CountSamples => {
                &[(Slot::Realtime, READS), (Slot::LightsFound, WRITES), (Slot::Work, WRITES)]
            }
            Self::LayOut => &[(Slot::Work, WRITES)],
            Self::ListPixels => &[(Slot::Realtime, READS), (Slot::LightsFound, WRITES), (Slot::Work, WRITES)],
            Self::Presample | Self::Sample => &[
                (Slot::Frame, READS),
                (Slot::Pixels, WRITES),
                (Slot::Realtime, READS),
                (Slot::LightsFound, WRITES),
            ],
            Self::Accumulate => &[
                (Slot::Realtime, READS),
                (Slot::Guides, READS),
                (Slot::Histories, WRITES),
                (Slot::LightsFound, READS),
                (Slot::SignalsOut, WRITES),
            ],
            Self::Filter(_) => &[
                (Slot::Realtime, READS),
                (Slot::Guides, READS),
                (Slot::SignalsIn, READS),
                (Slot::SignalsOut, WRITES),
            ],
            Self::Recombine => &[
                (Slot::Realtime, READS),
                (Slot::Guides, READS),
                (Slot::Histories, READS),
                (Slot::LightsFound, READS),
                (Slot::SignalsIn, READS),
                (Slot::Noise, READS),
                (Slot::Colors, WRITES),
                (Slot::Spread, READS),
            ],
            Self::Antialias => &[
                (Slot::Realtime, READS),
                (Slot::Guides, READS),
                (Slot::Colors, READS),
                (Slot::ShownBefore, READS),
                (Slot::ShownNow, WRITES),
                (Slot::Sums, WRITES),
            ],
            Self::Compose => {
                &[(Slot::Frame, READS), (Slot::Pixels, WRITES), (Slot::Realtime, READS), (Slot::Sums, READS)]
            }
        }
    }

    /// The text that it is in.
    pub fn text(self, tracer: &TracerText, variant: Variant) -> String {
        let lobes = lobes_text(variant);
        let scene = |rest: &[&str]| {
            let first = [&scene_text(variant), FILM].join("\n");
            [&[first.as_str(), HYBRID_FRAME, PIXELS, FRAME], rest].concat().join("\n")
        };
        match self {
            Self::Surfaces => {
                scene(&[GUIDES, FOUND, lobes, include_str!("../shaders/realtime_surfaces.wgsl")])
            }
            Self::Compose => scene(&[include_str!("../shaders/realtime_compose.wgsl")]),
            Self::Presample => scene(&[FOUND, TILES, include_str!("../shaders/realtime_presample.wgsl")]),
            Self::Sample => {
                let paths = include_str!("../shaders/realtime_paths.wgsl");
                let scene = scene_text(variant);
                let frame = [HYBRID_FRAME, PIXELS, FRAME, FOUND, lobes, FIRST];
                let own = [&[FILM, RAYS, GROUP_RAYS, VERTEX], &frame[..], &[TILES, paths]].concat();
                [&[tracer.enables, &scene, &tracer.text], &own[..]].concat().join("\n")
            }
            Self::Reproject => {
                image_text(&[GUIDES, HISTORY, include_str!("../shaders/realtime_reproject.wgsl")])
            }
            Self::MeasureNoise
            | Self::BlurAcross
            | Self::BlurDown
            | Self::Choose
            | Self::CountSamples
            | Self::LayOut
            | Self::ListPixels => noise_text(),
            Self::Accumulate => {
                image_text(&[GUIDES, FOUND, HISTORY, include_str!("../shaders/realtime_accumulate.wgsl")])
            }
            Self::Filter(level) => filter_text(level),
            Self::Recombine => {
                image_text(&[GUIDES, FOUND, HISTORY, include_str!("../shaders/realtime_recombine.wgsl")])
            }
            Self::Antialias => image_text(&[GUIDES, include_str!("../shaders/realtime_antialias.wgsl")]),
        }
    }
}

/// The text of the passes that decide about samples.
pub(super) fn noise_text() -> String {
    image_text(&[GUIDES, FOUND, HISTORY, include_str!("../shaders/realtime_noise.wgsl")])
}

/// The text of a pass of the filter. All are compiled by themselves: where neighbours are is known then. The first one, between
/// pixels that all differ, takes 5 × 5 of them; those behind it, between means, 3 × 3.
fn filter_text(level: u32) -> String {
    let radius = if level == 0 { 2 } else { 1 };
    let step = 1 << level;
    let steps = format!("const FILTER_STEP: i32 = {step};\nconst FILTER_RADIUS: i32 = {radius};");
    image_text(&[GUIDES, &steps, include_str!("../shaders/realtime_filter.wgsl")])
}

/// How scattering functions are divided into lobes.
fn lobes_text(variant: Variant) -> &'static str {
    if variant.layers {
        include_str!("../shaders/realtime_lobes_layered.wgsl")
    } else {
        include_str!("../shaders/realtime_lobes_plain.wgsl")
    }
}

/// What passes know that begin paths at first surfaces, and ask no tracer.
pub(super) fn first_vertex_text(variant: Variant) -> String {
    let scene = scene_text(variant);
    [&scene, FILM, VERTEX, HYBRID_FRAME, PIXELS, FRAME, FOUND, lobes_text(variant), FIRST].join("\n")
}

const COMPUTE: ShaderStages = ShaderStages::COMPUTE;

/// The text of a pass that knows no scene.
fn image_text(own: &[&str]) -> String {
    [&[&optics::wgsl::without_layers(), PLANES, FRAME], own].concat().join("\n")
}

/// A pass for a scene and a tracer, not compiled yet.
///
/// # Errors
/// When the device cannot bind what it needs.
pub(super) fn frame_pass(
    gpu: &Gpu,
    pass: Pass,
    variant: Variant,
    scene: &GpuScene,
    tracer: &dyn Tracer,
) -> Result<FramePass, GpuError> {
    // Who finishes the frame records first hits.
    let variant = Variant { aovs: variant.aovs && pass == Pass::Compose, splitting: false, ..variant };
    let parts = PassParts {
        name: format!("realtime {} on {}", pass.entry_point(), tracer.kind().name()),
        entry_point: pass.entry_point(),
        text: pass.text(&tracer.text(), variant),
        scene: pass.sees_scene().then_some(scene),
        tracer: pass.traces().then_some(tracer),
        film_bindings: pass.film_bindings(),
    };
    FramePass::new(gpu, parts, || slot_layout(gpu, pass.bindings()))
}

/// Layout of group 3 with some of its bindings.
fn slot_layout(gpu: &Gpu, bindings: &[Bound]) -> wgpu::BindGroupLayout {
    let ty = |slot: Slot, writes: bool| match slot {
        Slot::Frame | Slot::Realtime => BufferBindingType::Uniform,
        _ => BufferBindingType::Storage { read_only: !writes },
    };
    let entry = |&(slot, writes): &Bound| entry(slot as u32, COMPUTE, buffer(ty(slot, writes)));
    let entries: Vec<_> = bindings.iter().map(entry).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("frame"),
        entries: &entries,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::used_bindings;
    use crate::tracer::query;

    /// Every pass binds what its shader uses, writes what it may, and needs no more storage buffers than a device must have.
    #[test]
    fn passes_bind_what_they_use() {
        const TRACER: usize = 3;
        const SCENE: usize = 6;
        let all = Variant {
            alpha: true,
            aovs: true,
            layers: true,
            absorption: true,
            light_tree: true,
            ..Variant::default()
        };
        for variant in [Variant::default(), all] {
            for pass in Pass::all() {
                let name = format!("{pass:?}, {variant:?}");
                let mut used = used_bindings(&name, &pass.text(&query::TEXT, variant), pass.entry_point());
                used.retain(|&(group, binding, _)| (group, binding) != (2, 0));
                let film = pass.film_bindings().unwrap_or_default().iter().map(|&b| (2, b, true));
                let own = pass.bindings().iter().map(|&(slot, writes)| (3, slot as u32, writes));
                let mut bound: Vec<_> = film.chain(own).collect();
                bound.sort_unstable();
                used.sort_unstable();
                if variant.aovs || pass != Pass::Compose {
                    assert_eq!(used, bound, "{name}");
                }
                let uniforms = pass.bindings().iter().filter(|b| matches!(b.0, Slot::Frame | Slot::Realtime));
                let count = if pass.sees_scene() { SCENE } else { 0 }
                    + if pass.traces() { TRACER } else { 0 }
                    + bound.len()
                    - uniforms.count();
                assert!(count <= crate::STORAGE_BUFFERS as usize, "{name}: {count} buffers");
            }
        }
    }

    #[test]
    fn frames_with_everything_have_all_passes() {
        assert_eq!(Pass::of_frame(true, true, MOST_FILTER_PASSES), Pass::all().collect::<Vec<_>>());
        let few = Pass::of_frame(false, false, 1);
        assert!(few.contains(&Pass::Filter(0)) && !few.contains(&Pass::Filter(1)));
        assert!(!few.contains(&Pass::Choose) && !few.contains(&Pass::Presample));
    }

    #[test]
    fn passes_are_where_their_numbers_say() {
        assert!(Pass::all().enumerate().all(|(i, pass)| pass.index() == i));
    }
}
