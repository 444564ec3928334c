//! A compute pass of frames: bound when it is made, compiled when a frame first needs it.

use crate::bindings::film_layout;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use wgpu::ShaderStages;

/// What a pass is made of.
pub(crate) struct PassParts<'a> {
    /// For messages.
    pub name: String,
    /// Where its text begins.
    pub entry_point: &'static str,
    /// All of its text.
    pub text: String,
    /// The scene, if it sees that.
    pub scene: Option<&'a GpuScene>,
    /// The tracer, if it asks that.
    pub tracer: Option<&'a dyn Tracer>,
    /// Bindings of the film's group beside the view; `None` if it does not need the group.
    pub film_bindings: Option<&'a [u32]>,
}

/// A compute pass, ready but for its buffers. It is compiled when a frame first needs it: no frame needs them all.
pub(crate) struct FramePass {
    name: String,
    entry_point: &'static str,
    text: String,
    scene_layout: Option<wgpu::BindGroupLayout>,
    tracer_layout: Option<wgpu::BindGroupLayout>,
    pipeline: Option<wgpu::ComputePipeline>,
    /// Of group 2.
    pub film_layout: Option<wgpu::BindGroupLayout>,
    /// Of group 3.
    pub layout: wgpu::BindGroupLayout,
}

/// Groups 2 and 3 of a pass.
pub(crate) struct BoundPass {
    pub film: Option<wgpu::BindGroup>,
    pub frame: wgpu::BindGroup,
}

impl FramePass {
    /// A pass whose group 3 has the layout that `layout` makes, not compiled yet.
    ///
    /// # Errors
    /// When the device cannot bind what it needs.
    pub fn new(
        gpu: &Gpu,
        parts: PassParts<'_>,
        layout: impl FnOnce() -> wgpu::BindGroupLayout,
    ) -> Result<Self, GpuError> {
        let of_film = |bindings| film_layout(gpu, bindings, ShaderStages::COMPUTE);
        let (film_layout, layout) = gpu
            .guarded(|| (parts.film_bindings.map(of_film), layout()))
            .map_err(|reason| GpuError::Device { doing: "binding a frame", reason })?;
        Ok(Self {
            name: parts.name,
            entry_point: parts.entry_point,
            text: parts.text,
            scene_layout: parts.scene.map(|scene| scene.layout.clone()),
            tracer_layout: parts.tracer.map(|tracer| tracer.layout().clone()),
            pipeline: None,
            film_layout,
            layout,
        })
    }

    /// Compiles it, unless that was done.
    ///
    /// # Errors
    /// When the driver refuses the shader.
    pub fn compile(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        if self.pipeline.is_none() {
            let groups = [
                self.scene_layout.as_ref(),
                self.tracer_layout.as_ref(),
                self.film_layout.as_ref(),
                Some(&self.layout),
            ];
            let text = gpu.shader_text(&self.name, self.text.clone());
            self.pipeline = Some(text.pipeline(self.entry_point, &groups)?);
        }
        Ok(())
    }

    /// Sets pipeline and bind groups: what comes next is dispatched as this pass. Returns whether that can be: not before it is
    /// compiled.
    #[must_use]
    pub fn set(
        &self,
        recorded: &mut wgpu::ComputePass<'_>,
        scene: &wgpu::BindGroup,
        tracer: &wgpu::BindGroup,
        bound: &BoundPass,
    ) -> bool {
        let Some(pipeline) = &self.pipeline else { return false };
        recorded.set_pipeline(pipeline);
        recorded.set_bind_group(0, self.scene_layout.is_some().then_some(scene), &[]);
        recorded.set_bind_group(1, self.tracer_layout.is_some().then_some(tracer), &[]);
        recorded.set_bind_group(2, bound.film.as_ref(), &[]);
        recorded.set_bind_group(3, &bound.frame, &[]);
        true
    }
}
