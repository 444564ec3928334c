//! Compute passes: which shader a pass is, what it binds, and how it is dispatched.
//!
//! Bind groups are the same for all: 0 the scene, 1 the tracer's structures, 2 the view and the
//! film, or a list of rays, and 3 what the passes of a renderer hand on to each other.

use crate::bindings::{PassBinding, Resource, group, layout};
use crate::shader::{Linkage, ShaderText};
use crate::timing::{PassClock, Timer};
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use rayon::prelude::*;
use std::collections::HashMap;
use wgpu::ShaderStages;

/// What a pass is, whatever the scene and the device.
#[derive(Clone, Copy, Debug)]
pub struct PassSpec {
    /// For messages and profiles.
    pub name: &'static str,
    /// The module that its shader is linked from.
    pub module: &'static str,
    /// Where its shader begins.
    pub entry_point: &'static str,
    /// Whether it sees the scene.
    pub sees_scene: bool,
    /// Whether it asks the tracer.
    pub traces: bool,
    /// What it binds of group 2. Empty: it does not need the group.
    pub film: &'static [PassBinding],
    /// What it binds of group 3. Empty: it does not need the group.
    pub own: &'static [PassBinding],
}

impl PassSpec {
    /// A pass called as its entry point, which binds nothing yet.
    pub const fn new(module: &'static str, entry_point: &'static str) -> Self {
        let (name, film, own): (_, &[PassBinding], &[PassBinding]) = (entry_point, &[], &[]);
        Self { name, module, entry_point, sees_scene: false, traces: false, film, own }
    }

    /// As [`PassSpec::new`], of a pass that sees the scene.
    pub const fn of_scene(module: &'static str, entry_point: &'static str) -> Self {
        Self { sees_scene: true, ..Self::new(module, entry_point) }
    }

    /// As [`PassSpec::new`], of a pass that sees the scene and asks the tracer.
    pub const fn tracing(module: &'static str, entry_point: &'static str) -> Self {
        Self { traces: true, ..Self::of_scene(module, entry_point) }
    }
}

/// A group that many passes bind.
#[derive(Clone)]
struct SharedGroup {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
}

/// A pass on a device, for a scene and a tracer. It is compiled when [`compile`] is first asked for
/// it: no frame needs all passes.
pub(crate) struct Pass {
    spec: PassSpec,
    /// For messages.
    title: String,
    linkage: Linkage,
    scene: Option<SharedGroup>,
    tracer: Option<SharedGroup>,
    film: Option<wgpu::BindGroupLayout>,
    own: Option<wgpu::BindGroupLayout>,
    pipeline: Option<wgpu::ComputePipeline>,
}

/// Groups 2 and 3 of a pass.
#[derive(Clone)]
pub(crate) struct PassGroups {
    pub film: Option<wgpu::BindGroup>,
    pub own: Option<wgpu::BindGroup>,
}

/// How many workgroups a pass gets.
#[derive(Clone, Copy)]
pub(crate) enum Dispatch<'a> {
    /// So many to the right and down.
    Groups([u32; 2]),
    /// As many as the device has written at an offset of a buffer.
    Indirect(&'a wgpu::Buffer, u64),
}

impl Pass {
    /// A pass that is not compiled yet. `renderer` is in front of its name in messages. What it
    /// sees of scene and tracer has to be there.
    ///
    /// # Errors
    /// When the device cannot bind what it needs.
    pub fn new(
        gpu: &Gpu,
        renderer: &str,
        spec: PassSpec,
        linkage: &Linkage,
        scene: Option<&GpuScene>,
        tracer: Option<&dyn Tracer>,
    ) -> Result<Self, GpuError> {
        let tracer = tracer.filter(|_| spec.traces);
        let on = tracer.map_or(String::new(), |tracer| format!(" on {}", tracer.kind().name()));
        let of_group = |label, bindings: &[PassBinding]| {
            (!bindings.is_empty()).then(|| layout(gpu, label, bindings, ShaderStages::COMPUTE))
        };
        let (film, own) = gpu
            .guarded(|| (of_group("film", spec.film), of_group(spec.name, spec.own)))
            .map_err(|reason| GpuError::Device { doing: "binding a pass", reason })?;
        let scene = scene.filter(|_| spec.sees_scene);
        Ok(Self {
            spec,
            title: format!("{renderer} {}{on}", spec.name),
            linkage: gpu
                .sums
                .iter()
                .fold(linkage.clone(), |linkage, (name, module)| linkage.bind(name, module)),
            scene: scene.map(|s| SharedGroup { layout: s.layout.clone(), group: s.bind_group.clone() }),
            tracer: tracer.map(|t| SharedGroup { layout: t.layout().clone(), group: t.bind_group().clone() }),
            film,
            own,
            pipeline: None,
        })
    }

    /// Binds resources of groups 2 and 3.
    ///
    /// # Errors
    /// When the device fails, or a binding has no resource.
    pub fn bind(
        &self,
        gpu: &Gpu,
        film: &[Resource<'_>],
        own: &[Resource<'_>],
    ) -> Result<PassGroups, GpuError> {
        let bind = |layout: &Option<wgpu::BindGroupLayout>, bindings, resources| {
            let bound =
                layout.as_ref().map(|layout| group(gpu, "binding a pass", layout, bindings, resources));
            bound.transpose()
        };
        Ok(PassGroups {
            film: bind(&self.film, self.spec.film, film)?,
            own: bind(&self.own, self.spec.own, own)?,
        })
    }

    /// Sets pipeline and bind groups: what comes next is dispatched as this pass. Returns whether
    /// that can be: not before it is compiled.
    #[must_use]
    pub fn set(&self, recorded: &mut wgpu::ComputePass<'_>, groups: &PassGroups) -> bool {
        let Some(pipeline) = &self.pipeline else { return false };
        recorded.set_pipeline(pipeline);
        recorded.set_bind_group(0, self.scene.as_ref().map(|shared| &shared.group), &[]);
        recorded.set_bind_group(1, self.tracer.as_ref().map(|shared| &shared.group), &[]);
        recorded.set_bind_group(2, groups.film.as_ref(), &[]);
        recorded.set_bind_group(3, groups.own.as_ref(), &[]);
        true
    }

    /// Records a dispatch, if the pass is compiled.
    pub fn dispatch(&self, recorded: &mut wgpu::ComputePass<'_>, groups: &PassGroups, size: Dispatch<'_>) {
        if self.set(recorded, groups) {
            size.record(recorded);
        }
    }

    /// Records a pass of its own with one dispatch, timed.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        groups: &PassGroups,
        size: Dispatch<'_>,
    ) {
        let mut recorded = begin(encoder, clock, self.spec.name);
        self.dispatch(&mut recorded, groups, size);
    }

    /// For tests: puts another shader in its place.
    #[cfg(test)]
    pub fn replace(&mut self, gpu: &Gpu, text: String) -> Result<(), GpuError> {
        self.pipeline = Some(self.pipeline_of(&gpu.shader_text(&self.title, text))?);
        Ok(())
    }

    fn pipeline_of(&self, text: &ShaderText<'_>) -> Result<wgpu::ComputePipeline, GpuError> {
        let shared = |group: &'_ Option<SharedGroup>| group.as_ref().map(|g| g.layout.clone());
        let (scene, tracer) = (shared(&self.scene), shared(&self.tracer));
        let layouts = [scene.as_ref(), tracer.as_ref(), self.film.as_ref(), self.own.as_ref()];
        text.pipeline(self.spec.entry_point, &layouts)
    }
}

impl Dispatch<'_> {
    /// Records a dispatch as the pass that was set.
    pub fn record(self, recorded: &mut wgpu::ComputePass<'_>) {
        match self {
            Self::Groups([across, down]) => recorded.dispatch_workgroups(across, down, 1),
            Self::Indirect(sizes, offset) => recorded.dispatch_workgroups_indirect(sizes, offset),
        }
    }
}

/// Compiles the passes that are not compiled yet, on all threads at once. Those of one text share
/// its module.
///
/// # Errors
/// When modules are missing, or the driver refuses a shader.
pub(crate) fn compile<'a>(gpu: &Gpu, passes: impl IntoIterator<Item = &'a mut Pass>) -> Result<(), GpuError> {
    let mut missing: Vec<&mut Pass> = passes.into_iter().filter(|pass| pass.pipeline.is_none()).collect();
    let texts = missing.par_iter().map(|pass| pass.linkage.text(pass.spec.module));
    let texts = texts.collect::<Result<Vec<String>, _>>()?;
    let mut shaders: HashMap<&str, ShaderText<'_>> = HashMap::new();
    for (pass, text) in missing.iter().zip(&texts) {
        shaders.entry(text).or_insert_with(|| gpu.shader_text(&pass.title, text.clone()));
    }
    let pipelines =
        missing.par_iter().zip(&texts).map(|(pass, text)| pass.pipeline_of(&shaders[text.as_str()]));
    let pipelines: Vec<Result<wgpu::ComputePipeline, GpuError>> = pipelines.collect();
    for (pass, pipeline) in missing.iter_mut().zip(pipelines) {
        pass.pipeline = Some(pipeline?);
    }
    Ok(())
}

/// Submits a pass of at least `size` invocations, eight by eight a workgroup.
///
/// # Errors
/// When the device cannot start so many workgroups, or fails.
pub(crate) fn submit(
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

/// Workgroups of 64 for so many invocations, as rows of a length that every device can start.
pub(crate) fn groups_of_64(invocations: u64) -> [u32; 2] {
    const ROW: u64 = 32_768;
    let groups = invocations.div_ceil(64).max(1);
    [groups.min(ROW) as u32, groups.div_ceil(ROW) as u32]
}

/// Begins a timed compute pass.
pub(crate) fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    clock: &mut dyn PassClock,
    name: &'static str,
) -> wgpu::ComputePass<'a> {
    let slot = clock.slot(name);
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(name),
        timestamp_writes: slot.map(|slot| slot.compute()),
    })
}
