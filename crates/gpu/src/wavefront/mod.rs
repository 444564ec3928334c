//! Path tracing as wavefronts: instead of one kernel that follows a path to its end, a kernel for each thing that happens
//! at a vertex, with queues between them. All paths of a wave take a step before any takes the next, so invocations that
//! run side by side do the same.
//!
//! Method: Laine, Karras and Aila, "Megakernels Considered Harmful: Wavefront Path Tracing on GPUs", HPG 2013.
//!
//! What happens at a vertex is the same text as the megakernel's (`shaders/path_vertex.wgsl`) with the same random numbers,
//! so both make the same samples, up to rounding.

pub mod choice;
pub(crate) mod queues;
pub mod stage;

pub use queues::Queues;

use crate::batch::Batch;
use crate::film::FilmBuffers;
use crate::kernel::Kernel;
use crate::pass::{Dispatch, Pass, PassGroups, begin, compile};
use crate::shader::{Linkage, Variant};
use crate::timing::Timer;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use queues::{Dispatches, GROUP, SHADE_GROUP};
use stage::Stage;

/// The compiled stages for a scene and a tracer.
pub struct WavefrontKernel {
    /// By stage.
    stages: Vec<Pass>,
    queues: Queues,
    wants_aovs: bool,
    wants_features: bool,
    /// The groups of all stages for a film, which its pixels tell from others.
    bound: Option<(wgpu::Buffer, Vec<PassGroups>)>,
}

impl WavefrontKernel {
    /// Compiles the stages.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    pub fn new(
        gpu: &Gpu,
        variant: Variant,
        scene: &GpuScene,
        tracer: &dyn Tracer,
        queues: Queues,
    ) -> Result<Self, GpuError> {
        let linkage = Linkage::of(variant).with(&tracer.linkage());
        let make =
            |stage: Stage| Pass::new(gpu, "wavefront", stage.spec(), &linkage, Some(scene), Some(tracer));
        let mut stages = Stage::ALL.into_iter().map(make).collect::<Result<Vec<_>, _>>()?;
        compile(gpu, &mut stages)?;
        let Variant { aovs: wants_aovs, features: wants_features, .. } = variant;
        Ok(Self { stages, queues, wants_aovs, wants_features, bound: None })
    }

    /// Binds a film, if it is not the one that is bound.
    fn bind_film(&mut self, gpu: &Gpu, film: &FilmBuffers) -> Result<(), GpuError> {
        if self.bound.as_ref().is_none_or(|(bound, _)| *bound != film.pixels) {
            let (film_resources, queues) = (film.resources(), self.queues.resources());
            let groups = self.stages.iter().map(|stage| stage.bind(gpu, &film_resources, &queues));
            self.bound = Some((film.pixels.clone(), groups.collect::<Result<_, _>>()?));
        }
        Ok(())
    }

    /// Records one pass of some stages, one after the other.
    fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &mut Timer,
        name: &'static str,
        work: &[(Stage, Dispatch<'_>)],
    ) {
        let mut recorded = begin(encoder, timer, name);
        for &(stage, size) in work {
            if let Some((_, groups)) = &self.bound {
                self.stages[stage as usize].dispatch(&mut recorded, &groups[stage as usize], size);
            }
        }
    }

    /// Records all passes of a wave of `paths` camera paths.
    fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &mut Timer,
        paths: u32,
        pixels: u32,
        branches: u32,
        max_depth: u32,
    ) {
        let groups = |count: u32, group| Dispatch::Groups([count.div_ceil(group), 1]);
        let invocations = |count: u32| groups(count, GROUP);
        let arriving = Dispatch::Indirect(self.queues.dispatches(), Dispatches::PATHS);
        let shading = Dispatch::Indirect(self.queues.dispatches(), Dispatches::SHADING);
        let prepare = (Stage::Prepare, Dispatch::Groups([1, 1]));
        let shadow_rays = Dispatch::Indirect(self.queues.dispatches(), Dispatches::SHADOW_RAYS);
        let connect = (Stage::Connect, shadow_rays);
        let mut pass = |stage: Stage, work: &[(Stage, Dispatch<'_>)]| {
            self.pass(encoder, timer, stage.spec().name, work);
        };
        pass(Stage::Generate, &[(Stage::Generate, invocations(paths))]);
        for depth in 1..=max_depth {
            // The host knows how many paths there are only at the first vertex.
            let first = depth == 1;
            let extend = if first { invocations(paths) } else { arriving };
            let shade = if first { groups(paths * branches, SHADE_GROUP) } else { shading };
            let extending = Stage::extending(depth, max_depth);
            pass(Stage::Extend, &[(extending, extend)]);
            pass(Stage::Shade, &[(Stage::Shade, shade)]);
            // Shading finds out which vertices are what guides denoisers.
            if self.wants_aovs && (first || self.wants_features) {
                pass(Stage::Record, &[(Stage::Record, extend)]);
            }
            // From the last vertex no path goes on, and no light is asked.
            if depth < max_depth {
                pass(Stage::Connect, &[prepare, connect]);
            }
        }
        pass(Stage::Accumulate, &[(Stage::Accumulate, invocations(pixels))]);
    }
}

/// Passes of a wave.
fn pass_count(max_depth: u32) -> usize {
    2 + 4 * max_depth as usize
}

/// The parts in which `pixels` pixels go through queues that hold `most` at a time: as few as possible, of equal size.
fn waves(pixels: u32, most: u32) -> impl Iterator<Item = (u32, u32)> {
    let count = pixels.div_ceil(most.max(1)).max(1);
    let size = pixels.div_ceil(count).max(1);
    (0..pixels).step_by(size as usize).map(move |first| (first, size.min(pixels - first)))
}

impl Kernel for WavefrontKernel {
    fn submit(
        &mut self,
        gpu: &Gpu,
        film: &mut FilmBuffers,
        batch: Batch,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        self.bind_film(gpu, film)?;
        let (branches, max_depth) = (film.contents.splitting(), film.contents.max_depth());
        let capacity = self.queues.capacity() / branches;
        if capacity == 0 {
            let (adapter, limit) = (gpu.info.name.clone(), "paths in flight");
            let (needed, offered) = (u64::from(branches), u64::from(self.queues.capacity()));
            return Err(GpuError::Limit { adapter, limit, needed, offered });
        }
        // Layers are sums over a pixel's samples: two samples of one pixel at a time would get in each other's way.
        let most_samples = if self.wants_aovs { 1 } else { capacity };
        let end = batch.first_sample + batch.sample_count;
        let pixels = batch.pixel_count(film.contents.window_width());
        let failed = |reason| GpuError::Device { doing: "starting a wave", reason };
        let mut last = None;
        for first_sample in (batch.first_sample..end).step_by(most_samples as usize) {
            let sample_count = most_samples.min(end - first_sample);
            film.set_batch(gpu, Batch { first_sample, sample_count, ..batch })?;
            for (first_pixel, pixel_count) in waves(pixels, capacity / sample_count) {
                let paths = pixel_count * sample_count;
                self.queues.begin(gpu, first_pixel, pixel_count, paths)?;
                timer.reserve(gpu, pass_count(max_depth))?;
                let submit = || {
                    let mut encoder =
                        gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                    self.record(&mut encoder, timer, paths, pixel_count, branches, max_depth);
                    gpu.queue.submit([encoder.finish()])
                };
                last = Some(gpu.guarded(submit).map_err(failed)?);
            }
        }
        last.ok_or_else(|| failed("the batch is empty".into()))
    }
}

#[cfg(test)]
mod tests;
