//! What a kernel is: what runs on the device for a batch of samples. Which there are, `backend/tracing.rs` says.

use crate::batch::Batch;
use crate::film::FilmBuffers;
use crate::rays::{RayKernel, RayQuestion};
use crate::shader::{Linkage, Variant};
use crate::timing::Timer;
use crate::views::{ExactKernel, ExactWants};
use crate::wavefront::Queues;
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
    /// Ambient occlusion at first hits.
    AmbientOcclusion,
}

impl KernelKind {
    /// All whose text differs.
    pub const ALL: [Self; 4] = [Self::Path, Self::Direct, Self::Aov, Self::AmbientOcclusion];

    /// The kernel of an integrator.
    pub fn of(integrator: &Integrator) -> Self {
        match integrator {
            Integrator::Path(_) => Self::Path,
            Integrator::Direct(_) => Self::Direct,
            Integrator::Hybrid(_) => Self::Hybrid,
            Integrator::Realtime(_) => Self::Realtime,
            Integrator::Aov => Self::Aov,
            Integrator::AmbientOcclusion(_) => Self::AmbientOcclusion,
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
            Self::AmbientOcclusion => "ao",
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
            Self::AmbientOcclusion => "kernel_ao",
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

    /// Compiles what makes exact layers of views.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    fn exact_kernel(
        &self,
        gpu: &Gpu,
        wants: ExactWants,
        scene: &GpuScene,
    ) -> Result<Box<dyn ExactKernel>, GpuError>;

    /// Follows a change of the scene, which has already taken it. Returns whether that was possible; otherwise the
    /// structures and all kernels have to be made again.
    ///
    /// # Errors
    /// When the device fails.
    fn update(&mut self, gpu: &Gpu, scene: &GpuScene, changes: Changes) -> Result<bool, GpuError>;

    /// Bytes of the structures on the device, as far as they are known.
    fn memory_bytes(&self) -> u64;
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
