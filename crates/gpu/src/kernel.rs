//! What runs on the device for a batch of samples.

use crate::film::{Batch, BatchPixels, FilmBuffers};
use crate::hybrid::HybridKernel;
use crate::rays::{RayBuffers, RayKernel, RayQuestion};
use crate::realtime::RealtimeKernel;
use crate::shader::{Variant, assemble};
use crate::timing::Timer;
use crate::tracer::Tracer;
use crate::wavefront::{Queues, WavefrontKernel};
use crate::{Gpu, GpuError, GpuScene};
use backend::Integrator;
use scene::tables::Changes;
use std::fmt;
use std::str::FromStr;

/// Which integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum KernelKind {
    /// Path tracing.
    Path,
    /// Fixed cost.
    Direct,
    /// Fixed cost, pass by pass.
    Hybrid,
    /// Paths in real time.
    Realtime,
    /// First hits only.
    Aov,
}

impl KernelKind {
    /// All whose text differs.
    pub const ALL: [Self; 3] = [Self::Path, Self::Direct, Self::Aov];

    /// The kernel of an integrator.
    pub fn of(integrator: &Integrator) -> Self {
        match integrator {
            Integrator::Path(_) => Self::Path,
            Integrator::Direct(_) => Self::Direct,
            Integrator::Hybrid(_) => Self::Hybrid,
            Integrator::Realtime(_) => Self::Realtime,
            Integrator::Aov => Self::Aov,
        }
    }

    /// For messages and profiles.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Direct => "direct",
            Self::Hybrid => "hybrid",
            Self::Realtime => "realtime",
            Self::Aov => "aov",
        }
    }

    /// Its WGSL: film, integrator, and a function `render_pixel` for one pixel of the window. No entry point. Where one kernel
    /// has to do everything, those of `direct` and of `path` make the pictures of the real-time renderers.
    pub fn text(self, variant: Variant) -> String {
        let (film, rays) = (include_str!("shaders/film.wgsl"), include_str!("shaders/rays.wgsl"));
        let vertex = include_str!("shaders/path_vertex.wgsl");
        match self {
            Self::Path if variant.volumes => {
                let media = include_str!("shaders/volume_media.wgsl");
                let vertices = include_str!("shaders/volume_vertex.wgsl");
                [film, rays, vertex, media, vertices, include_str!("shaders/kernel_volumes.wgsl")].join("\n")
            }
            Self::Path | Self::Realtime => {
                [film, rays, vertex, include_str!("shaders/kernel_path.wgsl")].join("\n")
            }
            Self::Direct | Self::Hybrid => {
                let reach = include_str!("shaders/light_reach.wgsl");
                let direct = include_str!("shaders/direct.wgsl");
                [film, rays, reach, direct, include_str!("shaders/kernel_direct.wgsl")].join("\n")
            }
            Self::Aov => [film, rays, include_str!("shaders/kernel_aov.wgsl")].join("\n"),
        }
    }

    /// Its WGSL with an entry point `main` for compute shaders.
    pub fn compute_text(self, variant: Variant) -> String {
        [&self.text(variant), include_str!("shaders/entry_compute.wgsl")].join("\n")
    }
}

/// How path tracing is spread over dispatches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PathKernel {
    /// The faster one by the rule of [`crate::wavefront::choice`]: the wavefront for many samples at once, else the megakernel.
    #[default]
    Auto,
    /// One kernel follows each path from the camera to its end.
    Megakernel,
    /// A kernel for each thing that happens at a vertex, with queues between them ([`crate::wavefront`]).
    Wavefront,
}

impl PathKernel {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Megakernel, Self::Wavefront];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Megakernel => "megakernel",
            Self::Wavefront => "wavefront",
        }
    }
}

impl fmt::Display for PathKernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no kernel has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown kernel `{0}`; there are: {names}", names = PathKernel::ALL.map(PathKernel::name).join(", "))]
pub struct UnknownKernel(pub String);

impl FromStr for PathKernel {
    type Err = UnknownKernel;

    fn from_str(name: &str) -> Result<Self, UnknownKernel> {
        Self::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| UnknownKernel(name.to_owned()))
    }
}

/// A compiled way to render batches of one scene.
pub trait Kernel: Send {
    /// Submits the work for one batch. The film is bound and the view holds everything but the batch.
    ///
    /// # Errors
    /// When the device fails at once; most failures come out when somebody waits.
    fn submit(
        &mut self,
        gpu: &Gpu,
        film: &mut FilmBuffers,
        batch: Batch,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError>;

    /// Whether batches have to be whole pictures, one sample at a time.
    fn makes_whole_frames(&self) -> bool {
        false
    }

    /// The scene is another one now: what is kept of pictures before may be out of date.
    fn scene_changed(&mut self) {}

    /// Nothing is to be kept of pictures before.
    fn forget(&mut self) {}

    /// How paths are to be followed from now on, for who can follow them in more than one way.
    fn set_path_kernel(&mut self, _kernel: PathKernel) {}

    /// How paths were followed last.
    fn taken_kernel(&self) -> PathKernel {
        PathKernel::Megakernel
    }
}

/// A scene's structures for finding hits, from which kernels are made.
pub trait Tracing: Send {
    /// Compiles the kernel of an integrator. `film` has the layout of all later films.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    fn kernel(
        &self,
        gpu: &Gpu,
        kind: KernelKind,
        variant: Variant,
        scene: &GpuScene,
        film: &FilmBuffers,
    ) -> Result<Box<dyn Kernel>, GpuError>;

    /// Compiles the path tracer as a wavefront, with queues that may be shared with others. `None` where rays cannot be
    /// traced from several kernels.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    fn wavefront(
        &self,
        _gpu: &Gpu,
        _variant: Variant,
        _scene: &GpuScene,
        _queues: &Queues,
    ) -> Result<Option<Box<dyn Kernel>>, GpuError> {
        Ok(None)
    }

    /// Compiles what answers lists of rays. `rays` has the layout of all later lists.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    fn ray_kernel(
        &self,
        gpu: &Gpu,
        question: RayQuestion,
        scene: &GpuScene,
        rays: &RayBuffers,
    ) -> Result<Box<dyn RayKernel>, GpuError>;

    /// Follows a change of the scene, which has already taken it. Returns whether that was possible; otherwise the
    /// structures and all kernels have to be made again.
    ///
    /// # Errors
    /// When the device fails.
    fn update(&mut self, gpu: &Gpu, scene: &GpuScene, changes: Changes) -> Result<bool, GpuError>;

    /// Bytes of the structures on the device, as far as they are known.
    fn memory_bytes(&self) -> u64;
}

/// Tracing in compute shaders.
pub struct ComputeTracing(pub Box<dyn Tracer>);

impl Tracing for ComputeTracing {
    fn kernel(
        &self,
        gpu: &Gpu,
        kind: KernelKind,
        variant: Variant,
        scene: &GpuScene,
        film: &FilmBuffers,
    ) -> Result<Box<dyn Kernel>, GpuError> {
        match kind {
            KernelKind::Hybrid => {
                let settings = if let Integrator::Hybrid(settings) = film.integrator {
                    settings
                } else {
                    Default::default()
                };
                Ok(Box::new(HybridKernel::new(gpu, variant, scene, &*self.0, &settings)?))
            }
            KernelKind::Realtime => {
                let settings = if let Integrator::Realtime(settings) = film.integrator {
                    settings
                } else {
                    Default::default()
                };
                Ok(Box::new(RealtimeKernel::new(gpu, variant, scene, &*self.0, &settings)?))
            }
            KernelKind::Path | KernelKind::Direct | KernelKind::Aov => {
                Ok(Box::new(Megakernel::new(gpu, kind, variant, scene, &*self.0, film)?))
            }
        }
    }

    fn wavefront(
        &self,
        gpu: &Gpu,
        variant: Variant,
        scene: &GpuScene,
        queues: &Queues,
    ) -> Result<Option<Box<dyn Kernel>>, GpuError> {
        Ok(Some(Box::new(WavefrontKernel::new(gpu, variant, scene, &*self.0, queues.clone())?)))
    }

    fn ray_kernel(
        &self,
        gpu: &Gpu,
        question: RayQuestion,
        scene: &GpuScene,
        rays: &RayBuffers,
    ) -> Result<Box<dyn RayKernel>, GpuError> {
        let together = if question == RayQuestion::ClosestTogether { self.0.text_together() } else { None };
        let (question, tracer) = match together {
            None => (question.of_any_rays(), self.0.text()),
            Some(text) => (question, text),
        };
        let text = assemble(&tracer, &question.compute_text(), scene.variant());
        let pass = ComputePass::new(gpu, "rays", &text, scene, &*self.0, &rays.layout)?;
        Ok(Box::new(ComputeRays(pass)))
    }

    fn update(&mut self, gpu: &Gpu, scene: &GpuScene, changes: Changes) -> Result<bool, GpuError> {
        // The shaders read everything else from the scene's own buffers.
        if changes.transforms { self.0.move_instances(gpu, scene) } else { Ok(true) }
    }

    fn memory_bytes(&self) -> u64 {
        self.0.memory_bytes()
    }
}

/// A compute shader over a grid of invocations, eight by eight a workgroup, that sees a scene, a tracer and one group more.
struct ComputePass {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    scene: wgpu::BindGroup,
    tracer: wgpu::BindGroup,
}

impl ComputePass {
    /// Compiles the whole `text` of a shader; `layout` is that of bind group 2.
    fn new(
        gpu: &Gpu,
        name: &'static str,
        text: &str,
        scene: &GpuScene,
        tracer: &dyn Tracer,
        layout: &wgpu::BindGroupLayout,
    ) -> Result<Self, GpuError> {
        let title = format!("{name} on {}", tracer.kind().name());
        let pipeline = gpu.compute_pipeline(&title, text, &[&scene.layout, tracer.layout(), layout])?;
        let (scene, tracer) = (scene.bind_group.clone(), tracer.bind_group().clone());
        Ok(Self { name, pipeline, scene, tracer })
    }

    /// Submits one pass of at least `size` invocations.
    fn submit(
        &self,
        gpu: &Gpu,
        group: &wgpu::BindGroup,
        size: [u32; 2],
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        let groups = size.map(|n| n.div_ceil(8));
        let offered = gpu.limits.max_compute_workgroups_per_dimension;
        if let Some(&needed) = groups.iter().find(|&&n| n > offered) {
            let (adapter, needed, offered) = (gpu.info.name.clone(), needed.into(), offered.into());
            return Err(GpuError::Limit { adapter, limit: "workgroups of one dispatch", needed, offered });
        }
        let slot = timer.slot(self.name);
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(self.name),
                timestamp_writes: slot.map(|s| s.compute()),
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.scene, &[]);
            pass.set_bind_group(1, &self.tracer, &[]);
            pass.set_bind_group(2, group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
            drop(pass);
            gpu.queue.submit([encoder.finish()])
        })
        .map_err(|reason| GpuError::Device { doing: "starting a pass", reason })
    }
}

/// One compute shader that does everything: an invocation renders all samples of a pixel.
pub struct Megakernel(ComputePass);

impl Megakernel {
    /// Compiles the kernel for a scene and a tracer.
    ///
    /// # Errors
    /// When the driver refuses the shader.
    pub fn new(
        gpu: &Gpu,
        kind: KernelKind,
        variant: Variant,
        scene: &GpuScene,
        tracer: &dyn Tracer,
        film: &FilmBuffers,
    ) -> Result<Self, GpuError> {
        let text = assemble(&tracer.text(), &kind.compute_text(variant), variant);
        ComputePass::new(gpu, kind.name(), &text, scene, tracer, &film.layout).map(Self)
    }
}

/// Invocations for `count` portions, in workgroups of eight by eight.
fn run_size(count: u32) -> [u32; 2] {
    const MOST_COLUMNS: u32 = 1024;
    let groups = count.div_ceil(64);
    let columns = groups.clamp(1, MOST_COLUMNS);
    [8 * columns, 8 * groups.div_ceil(columns)]
}

impl Kernel for Megakernel {
    fn submit(
        &mut self,
        gpu: &Gpu,
        film: &mut FilmBuffers,
        batch: Batch,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        film.set_batch(gpu, batch)?;
        let size = match batch.pixels {
            BatchPixels::Rows { count, .. } => [film.contents.window_width(), count],
            BatchPixels::Portions { count, .. } => run_size(count),
        };
        self.0.submit(gpu, &film.bind_group, size, timer)
    }
}

/// A compute shader that answers rays.
struct ComputeRays(ComputePass);

impl RayKernel for ComputeRays {
    fn submit(&mut self, gpu: &Gpu, rays: &RayBuffers, timer: &mut Timer) -> Result<(), GpuError> {
        self.0.submit(gpu, &rays.bind_group, rays.size(), timer).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parse_back_and_others_are_refused() {
        for kernel in PathKernel::ALL {
            assert_eq!(kernel.name().parse(), Ok(kernel));
        }
        let error = "microkernel".parse::<PathKernel>().expect_err("unknown").to_string();
        assert!(error.contains("`microkernel`") && error.contains("wavefront"), "{error}");
    }
}
