//! Who they are: the tracers, and the kernels of each.

use crate::film::FilmBuffers;
use crate::hybrid::HybridKernel;
use crate::kernel::{Kernel, KernelKind, Tracing};
use crate::megakernel::Megakernel;
use crate::pass::{Pass, PassGroups, PassSpec, compile, submit};
use crate::rays::{RAY_LIST, RayBuffers, RayKernel, RayQuestion};
use crate::realtime::RealtimeKernel;
use crate::shader::Variant;
use crate::timing::Timer;
use crate::tracer::bvh::BvhTracer;
use crate::tracer::query::QueryTracer;
use crate::tracer::{Instances, Tracer, TracerKind};
use crate::views::{EXACT_LAYERS, ExactBuffers, ExactKernel, ExactWants};
use crate::wavefront::{Queues, WavefrontKernel};
use crate::{Gpu, GpuError, GpuScene};
use backend::Integrator;
use scene::tables::Changes;

impl TracerKind {
    /// Builds the structures of a scene.
    ///
    /// # Errors
    /// When the device cannot trace so, or the scene is too large for it.
    pub fn build(
        self,
        gpu: &Gpu,
        scene: &GpuScene,
        instances: Instances,
    ) -> Result<Box<dyn Tracing>, GpuError> {
        self.check(gpu)?;
        match self {
            Self::Bvh => Ok(Box::new(ComputeTracing(Box::new(BvhTracer::new(gpu, scene, instances)?)))),
            Self::Query => Ok(Box::new(ComputeTracing(Box::new(QueryTracer::new(gpu, scene)?)))),
            #[cfg(not(any(target_vendor = "apple", target_arch = "wasm32")))]
            Self::Pipeline => Ok(Box::new(crate::pipeline::PipelineTracing::build(gpu, scene)?)),
            #[cfg(any(target_vendor = "apple", target_arch = "wasm32"))]
            Self::Pipeline => Err(GpuError::Unsupported {
                adapter: gpu.info.name.clone(),
                tracer: self.name(),
                missing: "it is not in this build".into(),
            }),
        }
    }
}

/// Tracing in compute shaders.
pub(crate) struct ComputeTracing(pub Box<dyn Tracer>);

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
                let pixels = film.contents.picture().pixels();
                Ok(Box::new(RealtimeKernel::new(gpu, variant, scene, &*self.0, &settings, pixels)?))
            }
            _ => Ok(Box::new(Megakernel::new(gpu, kind, variant, scene, &*self.0)?)),
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

    fn exact_kernel(
        &self,
        gpu: &Gpu,
        wants: ExactWants,
        scene: &GpuScene,
    ) -> Result<Box<dyn ExactKernel>, GpuError> {
        let linkage = wants.linkage(scene.variant()).with(&self.0.linkage());
        let spec = PassSpec {
            name: "views",
            film: EXACT_LAYERS,
            ..PassSpec::tracing("entry_views_compute", "main")
        };
        let mut pass = Pass::new(gpu, "layers of", spec, &linkage, Some(scene), Some(&*self.0))?;
        compile(gpu, [&mut pass])?;
        Ok(Box::new(ComputeExact { pass, bound: None }))
    }

    fn update(&mut self, gpu: &Gpu, scene: &GpuScene, changes: Changes) -> Result<bool, GpuError> {
        // The shaders read everything else from the scene's own buffers.
        if changes.transforms { self.0.move_instances(gpu, scene) } else { Ok(true) }
    }

    fn memory_bytes(&self) -> u64 {
        self.0.memory_bytes()
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

/// A compute shader that makes exact layers of views.
struct ComputeExact {
    pass: Pass,
    /// The groups for buffers, which their values tell from others.
    bound: Option<(wgpu::Buffer, PassGroups)>,
}

impl ExactKernel for ComputeExact {
    fn submit(
        &mut self,
        gpu: &Gpu,
        buffers: &ExactBuffers,
        size: [u32; 2],
        timer: &mut Timer,
    ) -> Result<(), GpuError> {
        let groups = match self.bound.take().filter(|(bound, _)| *bound == buffers.values) {
            Some((_, groups)) => groups,
            None => self.pass.bind(gpu, &buffers.resources(), &[])?,
        };
        let submitted = submit(gpu, &self.pass, &groups, size, timer);
        self.bound = Some((buffers.values.clone(), groups));
        submitted.map(|_| ())
    }
}
