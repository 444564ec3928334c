//! What runs on the device for a batch of samples.

use crate::film::{Batch, FilmBuffers};
use crate::shader::{Variant, assemble};
use crate::timing::Timer;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use backend::Integrator;
use scene::tables::Changes;

/// Which integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum KernelKind {
    /// Path tracing.
    Path,
    /// Fixed cost.
    Direct,
    /// First hits only.
    Aov,
}

impl KernelKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Path, Self::Direct, Self::Aov];

    /// The kernel of an integrator.
    pub fn of(integrator: &Integrator) -> Self {
        match integrator {
            Integrator::Path(_) => Self::Path,
            Integrator::Direct(_) => Self::Direct,
            Integrator::Aov => Self::Aov,
        }
    }

    /// For messages and profiles.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Direct => "direct",
            Self::Aov => "aov",
        }
    }

    /// Its WGSL: film, integrator, and a function `render_pixel` for one pixel of the window. No entry point.
    pub fn text(self) -> String {
        let film = include_str!("shaders/film.wgsl");
        let integrator = match self {
            Self::Path => include_str!("shaders/kernel_path.wgsl"),
            Self::Direct => include_str!("shaders/kernel_direct.wgsl"),
            Self::Aov => include_str!("shaders/kernel_aov.wgsl"),
        };
        [film, integrator].join("\n")
    }

    /// Its WGSL with an entry point `main` for compute shaders.
    pub fn compute_text(self) -> String {
        [&self.text(), include_str!("shaders/entry_compute.wgsl")].join("\n")
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
        Ok(Box::new(Megakernel::new(gpu, kind, variant, scene, &*self.0, film)?))
    }

    fn update(&mut self, gpu: &Gpu, scene: &GpuScene, changes: Changes) -> Result<bool, GpuError> {
        // The shaders read everything else from the scene's own buffers.
        if changes.transforms { self.0.move_instances(gpu, scene) } else { Ok(true) }
    }

    fn memory_bytes(&self) -> u64 {
        self.0.memory_bytes()
    }
}

/// One compute shader that does everything: an invocation renders all samples of a pixel.
pub struct Megakernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    scene: wgpu::BindGroup,
    tracer: wgpu::BindGroup,
}

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
        let text = assemble(&tracer.text(), &kind.compute_text(), variant);
        let name = format!("{} on {}", kind.name(), tracer.kind().name());
        let pipeline = gpu.compute_pipeline(&name, &text, &[&scene.layout, tracer.layout(), &film.layout])?;
        let (scene, tracer) = (scene.bind_group.clone(), tracer.bind_group().clone());
        Ok(Self { name: kind.name(), pipeline, scene, tracer })
    }
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
        let slot = timer.slot(self.name);
        let groups = [film.contents.window_width(), batch.row_count].map(|n| n.div_ceil(8));
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(self.name),
                timestamp_writes: slot.map(|s| s.compute()),
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.scene, &[]);
            pass.set_bind_group(1, &self.tracer, &[]);
            pass.set_bind_group(2, &film.bind_group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
            drop(pass);
            gpu.queue.submit([encoder.finish()])
        })
        .map_err(|reason| GpuError::Device { doing: "starting a pass", reason })
    }
}
