//! What runs on the device for a batch of samples.

use crate::film::{AOVS, Batch, BatchPixels, FILM, FilmBuffers, TALLY, VIEW};
use crate::hybrid::HybridKernel;
use crate::pass::{Dispatch, Pass, PassGroups, PassSpec, compile};
use crate::rays::{RAY_LIST, RayBuffers, RayKernel, RayQuestion};
use crate::realtime::RealtimeKernel;
use crate::shader::{Linkage, Variant};
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

    /// What modules are linked with that import `kernel`, which has a function `render_pixel` for one pixel of the window. Where one
    /// kernel has to do everything, those of `direct` and of `path` make the pictures of the real-time renderers.
    pub fn linkage(self, variant: Variant) -> Linkage {
        let kernel = match self {
            Self::Path if variant.volumes => "kernel_volumes",
            Self::Path | Self::Realtime => "kernel_path",
            Self::Direct | Self::Hybrid => "kernel_direct",
            Self::Aov => "kernel_aov",
        };
        Linkage::of(variant).bind("kernel", kernel)
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

    /// Compiles what answers lists of rays.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    fn ray_kernel(
        &self,
        gpu: &Gpu,
        question: RayQuestion,
        scene: &GpuScene,
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
                Ok(Box::new(Megakernel::new(gpu, kind, variant, scene, &*self.0)?))
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
    ) -> Result<Box<dyn RayKernel>, GpuError> {
        let packets = if question == RayQuestion::ClosestPacket { self.0.linkage_packets() } else { None };
        let (question, tracer) = match packets {
            None => (question.of_any_rays(), self.0.linkage()),
            Some(packets) => (question, packets),
        };
        let linkage = question.linkage(scene.variant()).with(&tracer);
        let spec =
            PassSpec { name: "rays", film: RAY_LIST, ..PassSpec::tracing("entry_rays_compute", "main") };
        let mut pass = Pass::new(gpu, "list of", spec, &linkage, Some(scene), Some(&*self.0))?;
        compile(gpu, [&mut pass])?;
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

/// Submits a pass of at least `size` invocations, eight by eight a workgroup.
fn submit(
    gpu: &Gpu,
    pass: &Pass,
    groups: &PassGroups,
    size: [u32; 2],
    timer: &mut Timer,
) -> Result<wgpu::SubmissionIndex, GpuError> {
    let workgroups = size.map(|n| n.div_ceil(8));
    let offered = gpu.limits.max_compute_workgroups_per_dimension;
    if let Some(&needed) = workgroups.iter().find(|&&n| n > offered) {
        let (adapter, needed, offered) = (gpu.info.name.clone(), needed.into(), offered.into());
        return Err(GpuError::Limit { adapter, limit: "workgroups of one dispatch", needed, offered });
    }
    gpu.guarded(|| {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        pass.record(&mut encoder, timer, groups, Dispatch::Groups(workgroups));
        gpu.queue.submit([encoder.finish()])
    })
    .map_err(|reason| GpuError::Device { doing: "starting a pass", reason })
}

/// One compute shader that does everything: an invocation renders all samples of a pixel.
pub struct Megakernel {
    pass: Pass,
    /// The groups for a film, which its pixels tell from others.
    bound: Option<(wgpu::Buffer, PassGroups)>,
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
    ) -> Result<Self, GpuError> {
        let linkage = kind.linkage(variant).with(&tracer.linkage());
        let film = &[VIEW, FILM, TALLY, AOVS];
        let spec = PassSpec { name: kind.name(), film, ..PassSpec::tracing("entry_compute", "main") };
        let mut pass = Pass::new(gpu, "megakernel", spec, &linkage, Some(scene), Some(tracer))?;
        compile(gpu, [&mut pass])?;
        Ok(Self { pass, bound: None })
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
        let groups = match self.bound.take().filter(|(bound, _)| *bound == film.pixels) {
            Some((_, groups)) => groups,
            None => self.pass.bind(gpu, &film.resources(), &[])?,
        };
        let submitted = submit(gpu, &self.pass, &groups, size, timer);
        self.bound = Some((film.pixels.clone(), groups));
        submitted
    }
}

/// A compute shader that answers rays.
struct ComputeRays(Pass);

impl RayKernel for ComputeRays {
    fn submit(&mut self, gpu: &Gpu, rays: &RayBuffers, timer: &mut Timer) -> Result<(), GpuError> {
        let groups = self.0.bind(gpu, &rays.resources(), &[])?;
        submit(gpu, &self.0, &groups, rays.size(), timer).map(|_| ())
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
