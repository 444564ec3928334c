//! The kernels of the scene that is loaded: which one makes the pictures of a view.

use super::{GpuBackend, Loaded};
use crate::GpuError;
use crate::kernel::{Kernel, KernelKind, PathKernel};
use crate::plan::Pace;
use crate::shader::Variant;
use crate::wavefront::{Queues, choice};
use backend::View;

/// What tells kernels of a scene from each other.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct KernelKey {
    pub kind: KernelKind,
    pub variant: Variant,
    pub wavefront: bool,
}

/// A kernel, and how fast it was so far.
pub(super) struct CompiledKernel {
    pub kernel: Box<dyn Kernel>,
    pub pace: Pace,
}

impl GpuBackend {
    /// Compiles the kernel for a view, if it is the first of its kind.
    pub(super) fn prepare_kernel(
        &mut self,
        view: &View,
        samples: u32,
        kind: KernelKind,
    ) -> Result<KernelKey, GpuError> {
        let aovs = self.picture.as_ref().is_some_and(|p| p.buffers.wants_aovs());
        let features = self.picture.as_ref().is_some_and(|p| p.buffers.wants_features());
        let variant = Variant { aovs, features, ..self.variant_of(view, kind) };
        let Variant { volumes, motion, .. } = variant;
        let all_samples = u64::from(samples) * view.window.area() as u64;
        let is_there = |wavefront| {
            let key = KernelKey { kind, variant, wavefront };
            self.scene.as_ref().is_some_and(|loaded| loaded.kernels.contains_key(&key))
        };
        let wanted = match self.path_kernel {
            // Its queues have no place for what paths are in, nor for when they have left.
            _ if volumes || motion => false,
            // Pieces of a picture differ in size; none is worth compiling a second kernel for.
            PathKernel::Auto if choice::is_close(all_samples) && is_there(true) != is_there(false) => {
                is_there(true)
            }
            PathKernel::Auto => choice::is_faster(&self.gpu, self.kind, all_samples),
            PathKernel::Megakernel => false,
            PathKernel::Wavefront => true,
        };
        let key = KernelKey { kind, variant, wavefront: wanted && kind == KernelKind::Path };
        if key.wavefront {
            match self.prepare_wavefront(key) {
                Ok(false) => {}
                Ok(true) => {
                    self.taken = Some(PathKernel::Wavefront.name());
                    return Ok(key);
                }
                // Who did not ask for queues need not hear that there is no memory for them.
                Err(GpuError::Allocation { .. }) if self.path_kernel == PathKernel::Auto => {
                    self.path_kernel = PathKernel::Megakernel;
                }
                Err(error) => return Err(error),
            }
        }
        let key = KernelKey { wavefront: false, ..key };
        if let (Some(Loaded { scene, tracing, kernels, .. }), Some(picture)) =
            (&mut self.scene, &self.picture)
            && !kernels.contains_key(&key)
        {
            if volumes && self.path_kernel == PathKernel::Wavefront {
                let notice = "paths through media are followed by one kernel; it renders without a wavefront";
                self.notices.push(notice.to_owned());
            }
            let kernel = tracing.kernel(&self.gpu, kind, variant, scene, &picture.buffers)?;
            kernels.insert(key, CompiledKernel { kernel, pace: Pace::default() });
        }
        self.taken = Some(PathKernel::Megakernel.name());
        Ok(key)
    }

    /// The shaders for a view, without auxiliary layers.
    pub(super) fn variant_of(&self, view: &View, kind: KernelKind) -> Variant {
        // Kernels of other kinds stay when the scene becomes another.
        let specialises = self.specialises && kind == KernelKind::Path;
        let variant_of = |s: &Loaded| match specialises {
            true => s.scene.special_variant(),
            false => s.scene.variant(),
        };
        let of_scene = self.scene.as_ref().map(variant_of).unwrap_or_default();
        let needs_volumes = self.scene.as_ref().is_some_and(|s| s.scene.tables.needs_volumes());
        let volumes = needs_volumes && kind == KernelKind::Path;
        // Where paths know what they are in, what absorbs is a medium like others.
        let absorption = of_scene.absorption && !volumes;
        let of_view = of_scene.for_view(view);
        // Frames show the middle of the shutter.
        let motion = of_view.motion && !view.integrator.makes_frames();
        let scene_moves = of_view.scene_moves && motion;
        Variant { volumes, absorption, motion, scene_moves, ..of_view }
    }

    /// Compiles the wavefront, if it is not there already. Returns whether this way of tracing can have one.
    fn prepare_wavefront(&mut self, key: KernelKey) -> Result<bool, GpuError> {
        let Some(Loaded { scene, tracing, kernels, .. }) = &mut self.scene else { return Ok(false) };
        if kernels.contains_key(&key) {
            return Ok(true);
        }
        let queues = match self.queues.take() {
            Some(queues) => queues,
            None => Queues::new(&self.gpu, self.paths_in_flight)?,
        };
        let kernel = tracing.wavefront(&self.gpu, key.variant, scene, &queues)?;
        let Some(kernel) = kernel else {
            let name = self.kind.name();
            self.notices.push(format!(
                "{name} follows whole paths in its ray generation shader; it renders without a wavefront"
            ));
            self.path_kernel = PathKernel::Megakernel;
            return Ok(false);
        };
        self.queues = Some(queues);
        kernels.insert(key, CompiledKernel { kernel, pace: Pace::default() });
        Ok(true)
    }
}
