//! A frame's samples as waves: instead of one kernel that follows each path to its end, a kernel for each thing that happens on
//! the way. All but the first vertices, whose light is kept apart by lobes, go through the stages of `path`'s wavefront.
//!
//! Both ways make the same samples. Which is the faster one, [`Waves::are_faster`] says.

use super::buffers::Buffers;
use super::passes::{Slot, first_vertex_text};
use crate::bindings::{buffer, entry, group};
use crate::film::FilmBuffers;
use crate::frame_pass::{BoundPass, FramePass, PassParts};
use crate::hybrid::GBuffer;
use crate::scene::upload::empty_buffer;
use crate::shader::Variant;
use crate::tracer::{Tracer, TracerKind, TracerText};
use crate::wavefront::queues::{Dispatches, GATHERED, HITS, PATHS, Queues, SHADOW_RAYS, WAVE, most_paths};
use crate::wavefront::stage::{self, HANDING, Stage, WAVEFRONT};
use crate::{Gpu, GpuError, GpuScene};
use wgpu::{BufferBindingType, BufferUsages, ShaderStages};

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

/// How many workgroups a step gets.
#[derive(Clone, Copy)]
enum Work {
    One,
    /// For the pixels that get samples.
    Pixels,
    /// As many as the device has written there.
    Counted(u64),
}

/// The pixels of a wave.
#[derive(Clone, Copy)]
pub(super) enum WavePixels<'a> {
    /// All of them, in so many workgroups of eight by eight.
    Window([u32; 2]),
    /// Those at the list's beginning; the size of the dispatch for them, and where it is in the buffer.
    Listed(&'a wgpu::Buffer, u64),
}

const FRAME: u32 = Slot::Frame as u32;
const PIXELS: u32 = Slot::Pixels as u32;
const REALTIME: u32 = Slot::Realtime as u32;
const LIGHTS_FOUND: u32 = Slot::LightsFound as u32;
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

    fn entry_point(self) -> &'static str {
        match self {
            Self::Restart => "restart",
            Self::Begin => "begin_paths",
            Self::ConnectFirst => "connect_first",
            Self::Measure => "measure",
            Self::Stage(stage) => stage.name(),
            Self::Finish => "finish_paths",
        }
    }

    fn traces(self) -> bool {
        match self {
            Self::ConnectFirst => true,
            Self::Stage(stage) => stage.traces(),
            Self::Restart | Self::Begin | Self::Measure | Self::Finish => false,
        }
    }

    fn sees_scene(self) -> bool {
        self.traces() || matches!(self, Self::Begin | Self::Stage(Stage::Shade))
    }

    /// Bindings of the film's group beside the view; `None`: not even that.
    fn film_bindings(self) -> Option<&'static [u32]> {
        match self {
            Self::Begin | Self::ConnectFirst => Some(&[]),
            Self::Stage(stage) => Some(stage.film_bindings()),
            Self::Restart | Self::Measure | Self::Finish => None,
        }
    }

    /// Bindings of group 3.
    fn bindings(self) -> &'static [u32] {
        match self {
            Self::Restart => &[WAVE, PATHS],
            Self::Begin => &[FRAME, PIXELS, REALTIME, LIGHTS_FOUND, SPLIT_SAMPLES, WAVE, PATHS, SHADOW_RAYS],
            Self::ConnectFirst => &[SPLIT_SAMPLES, WAVE, SHADOW_RAYS],
            Self::Measure => &[SPLIT_SAMPLES, WAVE, PATHS, HITS],
            Self::Stage(stage) => stage.queue_bindings(),
            Self::Finish => &[REALTIME, LIGHTS_FOUND, SPLIT_SAMPLES, GATHERED],
        }
    }

    fn text(self, tracer: &TracerText, variant: Variant) -> String {
        let wave = include_str!("../shaders/realtime_wave.wgsl");
        match self {
            Self::Restart | Self::Begin | Self::Measure | Self::Finish => {
                let begin = include_str!("../shaders/realtime_wave_begin.wgsl");
                let finish = include_str!("../shaders/realtime_wave_finish.wgsl");
                [&first_vertex_text(variant), WAVEFRONT, HANDING, wave, begin, finish].join("\n")
            }
            Self::ConnectFirst => {
                let connect = include_str!("../shaders/realtime_wave_connect.wgsl");
                [&stage::tracing_text(tracer, variant), wave, connect].join("\n")
            }
            Self::Stage(stage) if stage.traces() => stage::tracing_text(tracer, variant),
            Self::Stage(_) => stage::shading_text(variant),
        }
    }
}

/// The steps of waves, and the paths in flight.
pub(super) struct Waves {
    /// By [`Step::index`].
    steps: Vec<FramePass>,
    are_faster: bool,
    buffers: Option<WaveBuffers>,
    /// By [`Step::index`]; nothing as long as there is nothing to bind.
    groups: Vec<BoundPass>,
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
        let make = |step: Step| {
            let parts = PassParts {
                name: format!("realtime {} on {}", step.entry_point(), tracer.kind().name()),
                entry_point: step.entry_point(),
                text: step.text(&tracer.text(), variant),
                scene: step.sees_scene().then_some(scene),
                tracer: step.traces().then_some(tracer),
                film_bindings: step.film_bindings(),
            };
            FramePass::new(gpu, parts, || layout(gpu, step.bindings()))
        };
        let steps = Step::ALL.into_iter().map(make).collect::<Result<_, GpuError>>()?;
        let are_faster = tracer.kind() == TracerKind::Bvh && !gpu.is_software();
        Ok(Self { steps, are_faster, buffers: None, groups: Vec::new() })
    }

    /// Whether waves of so many paths are faster than one kernel. Measured with our own hierarchy only.
    pub fn are_faster(&self, paths: u32) -> bool {
        self.are_faster && paths >= ENOUGH_PATHS
    }

    /// Compiles all steps, unless that was done.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    pub fn compile(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        self.steps.iter_mut().try_for_each(|step| step.compile(gpu))
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
        let of_frame = |binding: u32| match binding {
            FRAME => gbuffer.frame(),
            PIXELS => pixels,
            REALTIME => &buffers.realtime,
            LIGHTS_FOUND => &buffers.lights_found,
            SPLIT_SAMPLES => &own.split_samples,
            of_queues => own.queues.buffer(of_queues),
        };
        let of_film = [&film.view, &film.pixels, &film.counters, &film.aovs];
        let bind = |(step, made): (Step, &FramePass)| {
            let film = made.film_layout.as_ref().map(|layout| {
                let bindings = std::iter::once(&0).chain(step.film_bindings().unwrap_or_default());
                group(gpu, "wave", layout, bindings.map(|&b| (b, of_film[b as usize])))
            });
            let frame = group(gpu, "wave", &made.layout, step.bindings().iter().map(|&b| (b, of_frame(b))));
            BoundPass { film, frame }
        };
        self.groups = gpu
            .guarded(|| Step::ALL.into_iter().zip(&self.steps).map(bind).collect())
            .map_err(|reason| GpuError::Device { doing, reason })?;
        Ok(true)
    }

    /// Bytes on the device that depend on the picture's size.
    pub fn memory_bytes(&self) -> u64 {
        self.buffers.as_ref().map_or(0, |b| b.queues.memory_bytes() + b.split_samples.size())
    }

    /// Records a sample for each pixel that wants one, if all is prepared.
    pub fn record(
        &self,
        recorded: &mut wgpu::ComputePass<'_>,
        scene: &wgpu::BindGroup,
        tracer: &wgpu::BindGroup,
        pixels: WavePixels<'_>,
        max_depth: u32,
    ) {
        let Some(buffers) = &self.buffers else { return };
        let mut run = |step: Step, work: Work| {
            let at = step.index();
            let Some(group) = self.groups.get(at) else { return };
            if !self.steps[at].set(recorded, scene, tracer, group) {
                return;
            }
            match work {
                Work::One => recorded.dispatch_workgroups(1, 1, 1),
                Work::Pixels => match pixels {
                    WavePixels::Window([across, down]) => recorded.dispatch_workgroups(across, down, 1),
                    WavePixels::Listed(sizes, offset) => {
                        recorded.dispatch_workgroups_indirect(sizes, offset);
                    }
                },
                Work::Counted(offset) => {
                    recorded.dispatch_workgroups_indirect(buffers.queues.dispatches(), offset);
                }
            }
        };
        let paths = Work::Counted(Dispatches::PATHS);
        let shadow_rays = Work::Counted(Dispatches::SHADOW_RAYS);
        run(Step::Restart, Work::One);
        run(Step::Begin, Work::Pixels);
        run(Step::Stage(Stage::Prepare), Work::One);
        run(Step::ConnectFirst, shadow_rays);
        for vertex in 2..=max_depth {
            run(Step::Stage(Stage::extending(vertex, max_depth)), paths);
            if vertex == 2 {
                run(Step::Measure, paths);
            }
            run(Step::Stage(Stage::Shade), paths);
            if vertex < max_depth {
                run(Step::Stage(Stage::Prepare), Work::One);
                run(Step::Stage(Stage::Connect), shadow_rays);
            }
        }
        run(Step::Finish, Work::Pixels);
    }
}

fn layout(gpu: &Gpu, bindings: &[u32]) -> wgpu::BindGroupLayout {
    let ty = |binding: u32| match binding {
        FRAME | REALTIME => BufferBindingType::Uniform,
        _ => BufferBindingType::Storage { read_only: false },
    };
    let entries: Vec<_> = bindings.iter().map(|&b| entry(b, ShaderStages::COMPUTE, buffer(ty(b)))).collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("wave"), entries: &entries };
    gpu.device.create_bind_group_layout(&descriptor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::constant;
    use crate::shader::{used_bindings, validate, write_all_languages};

    /// Every step binds what its shader uses, needs no more storage buffers than a device must have, and can be written for all
    /// drivers.
    #[test]
    fn steps_bind_what_they_use() {
        const TRACER: usize = 3;
        const SCENE: usize = 6;
        let all =
            Variant { alpha: true, layers: true, absorption: true, light_tree: true, ..Variant::default() };
        for variant in [Variant::default(), all] {
            for step in Step::ALL {
                let name = format!("{step:?}, {variant:?}");
                let text = step.text(&crate::tracer::query::TEXT, variant);
                let (module, info) = validate(&name, &text);
                write_all_languages(&name, &module, &info, step.entry_point());
                let mut used = used_bindings(&name, &text, step.entry_point());
                used.retain(|&(group, binding, _)| (group, binding) != (2, 0));
                let mut used: Vec<_> = used.into_iter().map(|(g, b, _)| (g, b)).collect();
                let film = step.film_bindings().unwrap_or_default().iter().map(|&b| (2, b));
                let mut bound: Vec<_> = film.chain(step.bindings().iter().map(|&b| (3, b))).collect();
                used.sort_unstable();
                bound.sort_unstable();
                assert_eq!(used, bound, "{name}");
                let uniforms = step.bindings().iter().filter(|b| matches!(**b, FRAME | REALTIME)).count();
                let count = if step.sees_scene() { SCENE } else { 0 }
                    + if step.traces() { TRACER } else { 0 }
                    + bound.len()
                    - uniforms;
                assert!(count <= crate::STORAGE_BUFFERS as usize, "{name}: {count} buffers");
            }
        }
    }

    #[test]
    fn records_have_as_many_planes_as_in_the_shader() {
        let text = Step::Finish.text(&crate::tracer::query::TEXT, Variant::default());
        let planes = constant(&crate::shader::parse(&text), "SPLIT_PLANES");
        assert_eq!(u64::from(planes) * 16, SPLIT_SAMPLE);
    }
}
