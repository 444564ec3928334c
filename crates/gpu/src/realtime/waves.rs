//! A frame's samples as waves: instead of one kernel that follows each path to its end, a kernel for each thing that happens on
//! the way. All but the first vertices, whose light is kept apart by lobes, go through the stages of `path`'s wavefront.
//!
//! Both ways make the same samples. Which is the faster one, [`Waves::are_faster`] says.

use super::buffers::Buffers;
use super::passes::{
    planes,
    slots::{LIGHTS_FOUND, REALTIME},
};
use crate::bindings::PassBinding::{Uniform, Write};
use crate::bindings::whole;
use crate::film::{FilmBuffers, VIEW};
use crate::gbuffer::{
    GBuffer,
    slots::{FRAME, PIXELS},
};
use crate::pass::{Dispatch, Pass, PassGroups, PassSpec};
use crate::scene::upload::empty_buffer;
use crate::shader::{Linkage, Variant};
use crate::tracer::{Tracer, TracerKind};
use crate::wavefront::queues::{Dispatches, GATHERED, HITS, PATHS, Queues, SHADOW_RAYS, WAVE, most_paths};
use crate::wavefront::stage::Stage;
use crate::{Gpu, GpuError, GpuScene};
use wgpu::BufferUsages;

/// What happens to all paths of a wave before the next thing does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Forgets the wave before.
    Restart,
    /// First vertices.
    Begin,
    /// Their shadow rays.
    ConnectFirst,
    /// How far away second vertices are.
    Measure,
    /// What `path`'s wavefront does, too.
    Stage(Stage),
    /// Adds samples to pixels.
    Finish,
}

/// Behind the slots of all other passes.
const SPLIT_SAMPLES: u32 = 28;

/// Bytes of a sample on its way: planes of four words each, see `shaders/realtime_wave.wgsl`.
const SPLIT_SAMPLE: u64 = 3 * 16;

/// Paths from which on waves are worth their dispatches: between the pictures of 640 × 360 and of 960 × 540 pixels of
/// `docs/performance.md`.
const ENOUGH_PATHS: u32 = 1 << 18;

impl Step {
    /// All of them.
    const ALL: [Self; 10] = [
        Self::Restart,
        Self::Begin,
        Self::ConnectFirst,
        Self::Measure,
        Self::Stage(Stage::Extend),
        Self::Stage(Stage::ExtendLast),
        Self::Stage(Stage::Shade),
        Self::Stage(Stage::Prepare),
        Self::Stage(Stage::Connect),
        Self::Finish,
    ];

    fn index(self) -> usize {
        Self::ALL.iter().position(|s| *s == self).unwrap_or_default()
    }

    fn spec(self) -> PassSpec {
        match self {
            Self::Restart => PassSpec { own: &[WAVE, PATHS], ..PassSpec::new("realtime_wave", "restart") },
            Self::Begin => PassSpec {
                film: &[VIEW],
                own: &[
                    Uniform(FRAME),
                    Write(PIXELS),
                    Uniform(REALTIME),
                    Write(LIGHTS_FOUND),
                    Write(SPLIT_SAMPLES),
                    WAVE,
                    PATHS,
                    SHADOW_RAYS,
                ],
                ..PassSpec::of_scene("realtime_wave_begin", "begin_paths")
            },
            Self::ConnectFirst => PassSpec {
                film: &[VIEW],
                own: &[Write(SPLIT_SAMPLES), WAVE, SHADOW_RAYS],
                ..PassSpec::tracing("realtime_wave_connect", "connect_first")
            },
            Self::Measure => PassSpec {
                own: &[Write(SPLIT_SAMPLES), WAVE, PATHS, HITS],
                ..PassSpec::new("realtime_wave_finish", "measure")
            },
            Self::Stage(stage) => stage.spec(),
            Self::Finish => PassSpec {
                own: &[Uniform(REALTIME), Write(LIGHTS_FOUND), Write(SPLIT_SAMPLES), GATHERED],
                ..PassSpec::new("realtime_wave_finish", "finish_paths")
            },
        }
    }
}

/// The steps of waves, and the paths in flight.
pub(super) struct Waves {
    /// By [`Step::index`].
    steps: Vec<Pass>,
    are_faster: bool,
    buffers: Option<WaveBuffers>,
    /// By [`Step::index`]; nothing as long as there is nothing to bind.
    groups: Vec<PassGroups>,
}

/// What depends on the picture's size.
struct WaveBuffers {
    size: [u32; 2],
    queues: Queues,
    split_samples: wgpu::Buffer,
}

impl WaveBuffers {
    fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        let area = size[0] * size[1];
        let bytes = u64::from(area) * SPLIT_SAMPLE;
        let split_samples = empty_buffer(gpu, "samples on their way", bytes, BufferUsages::STORAGE)?;
        Ok(Self { size, queues: Queues::new(gpu, Some(area))?, split_samples })
    }
}

impl Waves {
    /// Waves for a scene and a tracer, not compiled yet.
    ///
    /// # Errors
    /// When the device cannot bind what they need.
    pub fn new(gpu: &Gpu, variant: Variant, scene: &GpuScene, tracer: &dyn Tracer) -> Result<Self, GpuError> {
        let variant = Variant { aovs: false, splitting: false, ..variant };
        let linkage = Linkage::of(variant).with(&tracer.linkage()).with(&planes(&[]));
        let make = |step: Step| Pass::new(gpu, "realtime", step.spec(), &linkage, Some(scene), Some(tracer));
        let steps = Step::ALL.into_iter().map(make).collect::<Result<_, GpuError>>()?;
        let are_faster = tracer.kind() == TracerKind::Bvh && !gpu.is_software();
        Ok(Self { steps, are_faster, buffers: None, groups: Vec::new() })
    }

    /// Whether waves of so many paths are faster than one kernel. Measured with our own hierarchy only.
    pub fn are_faster(&self, paths: u32) -> bool {
        self.are_faster && paths >= ENOUGH_PATHS
    }

    /// All steps, to be compiled.
    pub fn steps(&mut self) -> impl Iterator<Item = &mut Pass> {
        self.steps.iter_mut()
    }

    /// What was bound is no more.
    pub fn unbind(&mut self) {
        self.groups.clear();
    }

    /// Makes what depends on the picture's size and binds it, unless that was done. Returns whether a path for each pixel has a
    /// place.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        buffers: &Buffers,
        gbuffer: &GBuffer,
        film: &FilmBuffers,
    ) -> Result<bool, GpuError> {
        let [width, height] = buffers.size;
        if u64::from(width) * u64::from(height) > most_paths(gpu) {
            self.buffers = None;
            return Ok(false);
        }
        let own = match self.buffers.take().filter(|b| b.size == buffers.size) {
            Some(own) => own,
            None => WaveBuffers::new(gpu, buffers.size)?,
        };
        let own = self.buffers.insert(own);
        if !self.groups.is_empty() {
            return Ok(true);
        }
        let doing = "binding waves";
        let pixels = gbuffer
            .pixels()
            .ok_or_else(|| GpuError::Device { doing, reason: "there are no first hits".into() })?;
        let resources: Vec<_> = [
            whole(FRAME, gbuffer.frame()),
            whole(PIXELS, pixels),
            whole(REALTIME, &buffers.realtime),
            whole(LIGHTS_FOUND, &buffers.lights_found),
            whole(SPLIT_SAMPLES, &own.split_samples),
        ]
        .into_iter()
        .chain(own.queues.resources())
        .collect();
        let of_film = film.resources();
        self.groups =
            self.steps.iter().map(|step| step.bind(gpu, &of_film, &resources)).collect::<Result<_, _>>()?;
        Ok(true)
    }

    /// Bytes on the device that depend on the picture's size.
    pub fn memory_bytes(&self) -> u64 {
        self.buffers.as_ref().map_or(0, |b| b.queues.memory_bytes() + b.split_samples.size())
    }

    /// Records a sample for each pixel that wants one, if all is prepared. `pixels`: a dispatch with an invocation for each of them.
    pub fn record(&self, recorded: &mut wgpu::ComputePass<'_>, pixels: Dispatch<'_>, max_depth: u32) {
        let Some(buffers) = &self.buffers else { return };
        let mut run = |step: Step, size: Dispatch<'_>| {
            let at = step.index();
            if let Some(groups) = self.groups.get(at) {
                self.steps[at].dispatch(recorded, groups, size);
            }
        };
        let one = Dispatch::Groups([1, 1]);
        let paths = Dispatch::Indirect(buffers.queues.dispatches(), Dispatches::PATHS);
        let shadow_rays = Dispatch::Indirect(buffers.queues.dispatches(), Dispatches::SHADOW_RAYS);
        run(Step::Restart, one);
        run(Step::Begin, pixels);
        run(Step::Stage(Stage::Prepare), one);
        run(Step::ConnectFirst, shadow_rays);
        for vertex in 2..=max_depth {
            run(Step::Stage(Stage::extending(vertex, max_depth)), paths);
            if vertex == 2 {
                run(Step::Measure, paths);
            }
            run(Step::Stage(Stage::Shade), paths);
            if vertex < max_depth {
                run(Step::Stage(Stage::Prepare), one);
                run(Step::Stage(Stage::Connect), shadow_rays);
            }
        }
        run(Step::Finish, pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::constant;
    use crate::shader::check::{self, check_pass};

    #[test]
    fn steps_bind_what_they_use() {
        let all =
            Variant { alpha: true, layers: true, absorption: true, light_tree: true, ..Variant::default() };
        for variant in [Variant::default(), all] {
            for step in Step::ALL {
                check_pass(&step.spec(), &check::linkage(variant), &format!("{step:?}, {variant:?}"));
            }
        }
    }

    #[test]
    fn records_have_as_many_planes_as_in_the_shader() {
        let planes = constant(&check::module(Step::Finish.spec().module), "SPLIT_PLANES");
        assert_eq!(u64::from(planes) * 16, SPLIT_SAMPLE);
    }
}
