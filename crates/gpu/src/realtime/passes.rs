//! The passes of a frame behind the G-buffer: their texts and what they bind.

use crate::bindings::PassBinding::{self, Read, Uniform, Write};
use crate::film::{AOVS, FILM, TALLY, VIEW};
use crate::gbuffer::slots::{FRAME, PIXELS, PREVIOUS_INSTANCES};
use crate::pass::{self as compute, PassSpec};
use crate::shader::{Linkage, Variant};
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};

/// A pass; in the order of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RealtimePass {
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

/// Numbers of group 3's bindings, as the shaders have them. Beside these there are the G-buffer's.
pub(super) mod slots {
    /// The frame's own uniform.
    pub const REALTIME: u32 = 9;
    /// What pixels see.
    pub const GUIDES: u32 = 10;
    /// The past as the frame before left it.
    pub const HISTORIES_BEFORE: u32 = 12;
    /// The past as this frame has it.
    pub const HISTORIES: u32 = 13;
    /// Sums of the frame's samples.
    pub const LIGHTS_FOUND: u32 = 14;
    /// What the filter reads.
    pub const SIGNALS_IN: u32 = 15;
    /// What it writes.
    pub const SIGNALS_OUT: u32 = 16;
    /// The map of the noise.
    pub const NOISE: u32 = 18;
    /// The same, spread along rows.
    pub const BLURRED: u32 = 19;
    /// Counts and sizes of dispatches.
    pub const WORK: u32 = 20;
    /// The frame's colours.
    pub const COLORS: u32 = 21;
    /// The picture before.
    pub const SHOWN_BEFORE: u32 = 22;
    /// The picture.
    pub const SHOWN_NOW: u32 = 23;
    /// The map of the noise, spread along rows and columns.
    pub const SPREAD: u32 = 25;
    /// What goes to the film.
    pub const SUMS: u32 = 26;
}

use slots::*;

/// Planes of records that several modules read, each with the module that declares it. Whether they may be written depends on the pass.
const PLANES: [(&str, u32); 3] =
    [("guides", GUIDES), ("histories", HISTORIES), ("lights_found", LIGHTS_FOUND)];

impl RealtimePass {
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

    /// Its place among [`RealtimePass::all`].
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

    /// What it is.
    pub fn spec(self) -> PassSpec {
        const NOISE_MODULE: &str = "realtime_noise";
        match self {
            Self::Surfaces => PassSpec {
                film: &[VIEW],
                own: &[
                    Uniform(FRAME),
                    Write(PIXELS),
                    Read(PREVIOUS_INSTANCES),
                    Uniform(REALTIME),
                    Write(GUIDES),
                    Write(LIGHTS_FOUND),
                ],
                ..PassSpec::of_scene("realtime_surfaces", "surfaces")
            },
            Self::Reproject => PassSpec {
                own: &[Uniform(REALTIME), Read(GUIDES), Read(HISTORIES_BEFORE), Write(HISTORIES)],
                ..PassSpec::new("realtime_reproject", "reproject")
            },
            Self::MeasureNoise => PassSpec {
                own: &[Uniform(REALTIME), Read(GUIDES), Read(HISTORIES), Write(NOISE)],
                ..PassSpec::new(NOISE_MODULE, "measure_noise")
            },
            Self::BlurAcross => PassSpec {
                own: &[Uniform(REALTIME), Write(NOISE), Write(BLURRED)],
                ..PassSpec::new(NOISE_MODULE, "blur_across")
            },
            Self::BlurDown => PassSpec {
                own: &[Uniform(REALTIME), Write(BLURRED), Write(SPREAD)],
                ..PassSpec::new(NOISE_MODULE, "blur_down")
            },
            Self::Choose => PassSpec {
                own: &[
                    Uniform(REALTIME),
                    Read(GUIDES),
                    Read(HISTORIES),
                    Write(LIGHTS_FOUND),
                    Write(WORK),
                    Write(SPREAD),
                ],
                ..PassSpec::new(NOISE_MODULE, "choose")
            },
            Self::CountSamples => PassSpec {
                own: &[Uniform(REALTIME), Write(LIGHTS_FOUND), Write(WORK)],
                ..PassSpec::new(NOISE_MODULE, "count_samples")
            },
            Self::LayOut => PassSpec { own: &[Write(WORK)], ..PassSpec::new(NOISE_MODULE, "lay_out") },
            Self::ListPixels => PassSpec {
                own: &[Uniform(REALTIME), Write(LIGHTS_FOUND), Write(WORK)],
                ..PassSpec::new(NOISE_MODULE, "list_pixels")
            },
            Self::Presample => PassSpec {
                film: &[VIEW],
                own: &[Uniform(FRAME), Write(PIXELS), Uniform(REALTIME), Write(LIGHTS_FOUND)],
                ..PassSpec::of_scene("realtime_presample", "presample_lights")
            },
            Self::Sample => PassSpec {
                film: &[VIEW, TALLY],
                own: &[Uniform(FRAME), Write(PIXELS), Uniform(REALTIME), Write(LIGHTS_FOUND)],
                ..PassSpec::tracing("realtime_paths", "sample_pixels")
            },
            Self::Accumulate => PassSpec {
                own: &[
                    Uniform(REALTIME),
                    Read(GUIDES),
                    Write(HISTORIES),
                    Read(LIGHTS_FOUND),
                    Write(SIGNALS_OUT),
                ],
                ..PassSpec::new("realtime_accumulate", "accumulate")
            },
            Self::Filter(_) => PassSpec {
                own: &[Uniform(REALTIME), Read(GUIDES), Read(SIGNALS_IN), Write(SIGNALS_OUT)],
                ..PassSpec::new("realtime_filter", "filter_signals")
            },
            Self::Recombine => PassSpec {
                own: &[
                    Uniform(REALTIME),
                    Read(GUIDES),
                    Read(HISTORIES),
                    Read(LIGHTS_FOUND),
                    Read(SIGNALS_IN),
                    Read(NOISE),
                    Write(COLORS),
                    Read(SPREAD),
                ],
                ..PassSpec::new("realtime_recombine", "recombine")
            },
            Self::Antialias => PassSpec {
                own: &[
                    Uniform(REALTIME),
                    Read(GUIDES),
                    Read(COLORS),
                    Read(SHOWN_BEFORE),
                    Write(SHOWN_NOW),
                    Write(SUMS),
                ],
                ..PassSpec::new("realtime_antialias", "antialias")
            },
            Self::Compose => PassSpec {
                film: &[VIEW, FILM, TALLY, AOVS],
                own: &[Uniform(FRAME), Write(PIXELS), Uniform(REALTIME), Read(SUMS)],
                ..PassSpec::of_scene("realtime_compose", "compose_frame")
            },
        }
    }

    /// What its module is linked with.
    pub fn linkage(self, tracer: &Linkage, variant: Variant) -> Linkage {
        let linkage = Linkage::of(variant).with(tracer).with(&planes(self.spec().own));
        if let Self::Filter(level) = self {
            linkage.generate("filter_steps", filter_steps(level))
        } else {
            linkage
        }
    }
}

/// The modules of [`PLANES`] for a pass. What it does not bind only others of the same module use.
pub(crate) fn planes(bindings: &[PassBinding]) -> Linkage {
    PLANES.into_iter().fold(Linkage::default(), |linkage, (name, binding)| {
        let access = if bindings.contains(&Read(binding)) { "read" } else { "read_write" };
        let text = format!("@group(3) @binding({binding}) var<storage, {access}> {name}: array<vec4u>;\n");
        linkage.generate(name, text)
    })
}

/// What the filter's passes are told. All are compiled by themselves: where neighbours are is known then. The first one, between
/// pixels that all differ, takes 5 × 5 of them; those behind it, between means, 3 × 3.
fn filter_steps(level: u32) -> String {
    let radius = if level == 0 { 2 } else { 1 };
    let step = 1 << level;
    format!("const FILTER_STEP: i32 = {step};\nconst FILTER_RADIUS: i32 = {radius};\n")
}

/// A pass for a scene and a tracer, not compiled yet.
///
/// # Errors
/// When the device cannot bind what it needs.
pub(super) fn frame_pass(
    gpu: &Gpu,
    pass: RealtimePass,
    variant: Variant,
    scene: &GpuScene,
    tracer: &dyn Tracer,
) -> Result<compute::Pass, GpuError> {
    // Who finishes the frame records first hits.
    let variant =
        Variant { aovs: variant.aovs && pass == RealtimePass::Compose, splitting: false, ..variant };
    let linkage = pass.linkage(&tracer.linkage(), variant);
    compute::Pass::new(gpu, "realtime", pass.spec(), &linkage, Some(scene), Some(tracer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::check::check_pass;
    use crate::tracer::query;

    #[test]
    fn passes_bind_what_they_use() {
        let all = Variant {
            alpha: true,
            aovs: true,
            layers: true,
            absorption: true,
            light_tree: true,
            ..Variant::default()
        };
        for variant in [Variant::default(), all] {
            for pass in RealtimePass::all() {
                let linkage = pass.linkage(&query::linkage(), variant);
                check_pass(&pass.spec(), &linkage, &format!("{pass:?}, {variant:?}"));
            }
        }
    }

    #[test]
    fn frames_with_everything_have_all_passes() {
        assert_eq!(
            RealtimePass::of_frame(true, true, MOST_FILTER_PASSES),
            RealtimePass::all().collect::<Vec<_>>()
        );
        let few = RealtimePass::of_frame(false, false, 1);
        assert!(few.contains(&RealtimePass::Filter(0)) && !few.contains(&RealtimePass::Filter(1)));
        assert!(!few.contains(&RealtimePass::Choose) && !few.contains(&RealtimePass::Presample));
    }

    #[test]
    fn passes_are_where_their_numbers_say() {
        assert!(RealtimePass::all().enumerate().all(|(i, pass)| pass.index() == i));
    }
}
