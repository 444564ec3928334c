//! The megakernel: one compute shader that does everything.

use crate::batch::{Batch, BatchPixels};
use crate::film::{AOVS, FILM, FilmBuffers, TALLY, VIEW};
use crate::kernel::{Kernel, KernelKind};
use crate::pass::{Pass, PassGroups, PassSpec, compile, submit};
use crate::shader::Variant;
use crate::timing::Timer;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};

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
