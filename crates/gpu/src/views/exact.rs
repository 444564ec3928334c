//! Exact layers of many views: what is bound, and the chunks that views are made in.

use super::Run;
use super::download::{Downloads, UnderWay, copy};
use crate::bindings::{PassBinding, Resource, whole};
use crate::scene::upload::{empty_buffer, write_buffer};
use crate::shader::{Linkage, Variant};
use crate::timing::Timer;
use crate::view::CameraFrame;
use crate::{Gpu, GpuError};
use backend::{ViewBatch, ViewLayer, ViewPictures, ViewValues};
use bytemuck::{Pod, Zeroable};
use optics::camera::CameraFrame as Frame;
use std::fmt::Write;
use std::ops::Range;
use wgpu::BufferUsages;

/// What a pass that makes exact layers binds of group 2.
pub(crate) const EXACT_LAYERS: &[PassBinding] =
    &[PassBinding::Uniform(0), PassBinding::Read(1), PassBinding::Write(2)];

/// What a shader of exact layers has to know of surfaces: what only wants distances fetches none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ExactWants {
    /// Normals and positions.
    pub surface: bool,
    /// Base colours.
    pub albedo: bool,
    /// Where things are in the next picture.
    pub flow: bool,
}

impl ExactWants {
    /// Of these layers.
    pub fn of(layers: impl Iterator<Item = ViewLayer> + Clone) -> Self {
        let has = |wanted: &[ViewLayer]| layers.clone().any(|layer| wanted.contains(&layer));
        let (albedo, flow) = (has(&[ViewLayer::Albedo]), has(&[ViewLayer::Flow]));
        Self { surface: albedo || flow || has(&[ViewLayer::Normal, ViewLayer::Position]), albedo, flow }
    }

    /// What modules are linked with that import `views_layers`.
    pub fn linkage(self, variant: Variant) -> Linkage {
        let switches =
            [("WANTS_SURFACE", self.surface), ("WANTS_ALBEDO", self.albedo), ("WANTS_FLOW", self.flow)];
        let mut text = String::new();
        for (name, is_on) in switches {
            let _ = writeln!(text, "const {name}: bool = {is_on};"); // writing to a string cannot fail
        }
        Linkage::of(variant).generate("view_layers", text)
    }
}

/// As `ViewsTask` of `shaders/views_layers.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct ViewsTask {
    width: u32,
    height: u32,
    count: u32,
    rows: u32,
    depth: u32,
    normal: u32,
    position: u32,
    albedo: u32,
    flow: u32,
    instance: u32,
    material: u32,
    primitive: u32,
}

impl ViewsTask {
    /// For a chunk of `count` views; without words for layers that are not wanted.
    fn new(batch: &ViewBatch, count: u32) -> Self {
        const NONE: u32 = u32::MAX;
        let (width, height) = (batch.view.width, batch.view.height);
        let rows = height.next_multiple_of(8);
        let mut task = Self { width, height, count, rows, ..Self::default() };
        let mut next = 0;
        for layer in ViewLayer::ALL {
            let Some(first) = task.first_mut(layer) else { continue };
            *first = NONE;
            if batch.layers.contains(&layer) {
                *first = next;
                next += count * width * height * layer.channels() as u32;
            }
        }
        task
    }

    fn first_mut(&mut self, layer: ViewLayer) -> Option<&mut u32> {
        match layer {
            ViewLayer::Rgb => None,
            ViewLayer::Depth => Some(&mut self.depth),
            ViewLayer::Normal => Some(&mut self.normal),
            ViewLayer::Position => Some(&mut self.position),
            ViewLayer::Albedo => Some(&mut self.albedo),
            ViewLayer::Flow => Some(&mut self.flow),
            ViewLayer::Instance => Some(&mut self.instance),
            ViewLayer::Material => Some(&mut self.material),
            ViewLayer::Primitive => Some(&mut self.primitive),
        }
    }
}

/// A compiled way to make exact layers of views of one scene.
pub trait ExactKernel: Send {
    /// Submits the work for a chunk.
    ///
    /// - `size`: columns and rows of invocations.
    ///
    /// # Errors
    /// When the device fails at once; most failures come out when somebody waits.
    fn submit(
        &mut self,
        gpu: &Gpu,
        buffers: &ExactBuffers,
        size: [u32; 2],
        timer: &mut Timer,
    ) -> Result<(), GpuError>;
}

/// Bind group 2 of an [`ExactKernel`].
pub struct ExactBuffers {
    /// Binding 0: what the chunk is, uniform.
    pub task: wgpu::Buffer,
    /// Binding 1: its cameras.
    pub cameras: wgpu::Buffer,
    /// Binding 2: what is found.
    pub values: wgpu::Buffer,
}

impl ExactBuffers {
    /// All of the group, for a pass to bind.
    pub(crate) fn resources(&self) -> [Resource<'_>; 3] {
        [whole(0, &self.task), whole(1, &self.cameras), whole(2, &self.values)]
    }
}

/// Buffers for chunks of views, kept from call to call.
pub(crate) struct ExactViews {
    buffers: ExactBuffers,
    downloads: Downloads,
}

/// How a batch is cut.
struct Cut {
    /// Views of a chunk; the last one may have fewer.
    views: usize,
    /// Bytes of a view's values.
    view_bytes: u64,
    /// Bytes of a view's cameras.
    camera_bytes: u64,
}

impl Cut {
    fn new(gpu: &Gpu, batch: &ViewBatch, most_bytes: u64) -> Result<Self, GpuError> {
        let limits = &gpu.limits;
        let words: usize = batch.exact_layers().map(ViewLayer::channels).sum();
        let view_bytes = (batch.pixels() * words * 4) as u64;
        let cameras = if batch.next.is_empty() { 1 } else { 2 };
        let camera_bytes = cameras * size_of::<CameraFrame>() as u64;
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if view_bytes > limit {
            return Err(GpuError::BufferTooLarge {
                object: "the layers of a view",
                bytes: view_bytes,
                limit,
            });
        }
        let groups = u64::from(batch.view.height.div_ceil(8));
        let most = (most_bytes.min(limit) / view_bytes)
            .min(limit / camera_bytes)
            .min(u64::from(limits.max_compute_workgroups_per_dimension) / groups);
        let views = most.clamp(1, batch.cameras.len().max(1) as u64) as usize;
        Ok(Self { views, view_bytes, camera_bytes })
    }
}

impl ExactViews {
    /// Whether there is room for the chunks of a batch.
    fn fits(&self, cut: &Cut) -> bool {
        let views = cut.views as u64;
        self.downloads.room() >= views * cut.view_bytes
            && self.buffers.cameras.size() >= views * cut.camera_bytes
    }

    fn new(gpu: &Gpu, cut: &Cut) -> Result<Self, GpuError> {
        let (readable, views) = (BufferUsages::STORAGE | BufferUsages::COPY_SRC, cut.views as u64);
        let value_bytes = views * cut.view_bytes;
        let task_bytes = size_of::<ViewsTask>() as u64;
        let buffers = ExactBuffers {
            task: empty_buffer(gpu, "the views", task_bytes, BufferUsages::UNIFORM)?,
            cameras: empty_buffer(gpu, "cameras of views", views * cut.camera_bytes, BufferUsages::STORAGE)?,
            values: empty_buffer(gpu, "layers of views", value_bytes, readable)?,
        };
        Ok(Self { buffers, downloads: Downloads::new(gpu, value_bytes)? })
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        let ExactBuffers { task, cameras, values } = &self.buffers;
        task.size() + cameras.size() + values.size() + self.downloads.memory_bytes()
    }

    /// Makes the exact layers of a batch, in chunks of about `most_bytes`. `kept`: buffers of the call before.
    ///
    /// # Errors
    /// When the device fails, or a single view is too large for it.
    pub fn render(
        run: &mut Run<'_>,
        kept: &mut Option<Self>,
        kernel: &mut dyn ExactKernel,
        most_bytes: u64,
        pictures: &mut ViewPictures,
    ) -> Result<(), GpuError> {
        let (gpu, batch) = (run.gpu, run.batch);
        let cut = Cut::new(gpu, batch, most_bytes)?;
        let mut this = match kept.take().filter(|kept| kept.fits(&cut)) {
            Some(kept) => kept,
            None => Self::new(gpu, &cut)?,
        };
        let mut under_way: Option<(Range<usize>, UnderWay)> = None;
        let mut first = 0;
        loop {
            let end =
                if run.control.is_cancelled() { first } else { batch.cameras.len().min(first + cut.views) };
            let begun = match first..end {
                nothing if nothing.is_empty() => None,
                views => Some((views.clone(), this.begin(run, kernel, views)?)),
            };
            if let Some((views, chunk)) = under_way.take() {
                let pixels = (views.len() * batch.pixels()) as u64;
                this.downloads.finish(gpu, chunk, |bytes| hand_out(batch, views, bytes, pictures))?;
                run.count(pixels, pixels)?;
            }
            if begun.is_none() {
                break;
            }
            (under_way, first) = (begun, end);
        }
        *kept = Some(this);
        Ok(())
    }

    /// Submits a chunk, and sends it on its way.
    fn begin(
        &mut self,
        run: &mut Run<'_>,
        kernel: &mut dyn ExactKernel,
        views: Range<usize>,
    ) -> Result<UnderWay, GpuError> {
        let (gpu, batch, count) = (run.gpu, run.batch, views.len());
        let task = ViewsTask::new(batch, count as u32);
        let next = batch.next.get(views.clone()).unwrap_or_default();
        // Through the centres of lenses.
        let cameras = batch.cameras[views].iter().chain(next);
        let cameras: Vec<_> = cameras.map(|&c| CameraFrame::from(Frame { lens_radius: 0.0, ..c })).collect();
        write_buffer(gpu, "the views", &self.buffers.task, bytemuck::bytes_of(&task))?;
        write_buffer(gpu, "cameras of views", &self.buffers.cameras, bytemuck::cast_slice(&cameras))?;
        kernel.submit(gpu, &self.buffers, [task.width, task.rows * task.count], run.timer)?;
        let words: usize = batch.exact_layers().map(ViewLayer::channels).sum();
        self.downloads.begin(gpu, &self.buffers.values, (count * batch.pixels() * words * 4) as u64)
    }
}

/// Copies what a chunk has found to where it belongs.
fn hand_out(batch: &ViewBatch, views: Range<usize>, bytes: &[u8], pictures: &mut ViewPictures) {
    let mut rest = bytes;
    for layer in ViewLayer::ALL.into_iter().filter(|layer| *layer != ViewLayer::Rgb) {
        let Some((_, values)) = pictures.layers.iter_mut().find(|(l, _)| *l == layer) else { continue };
        let of_view = batch.pixels() * layer.channels();
        let (from, others) = rest.split_at(4 * of_view * views.len());
        rest = others;
        let places = of_view * views.start..of_view * views.end;
        match values {
            ViewValues::Float(numbers) => copy(from, bytemuck::cast_slice_mut(&mut numbers[places])),
            ViewValues::Id(ids) => copy(from, bytemuck::cast_slice_mut(&mut ids[places])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::assert_layout;

    #[test]
    fn layouts_match_the_shader() {
        let linkage = crate::shader::check::linkage(Variant::default());
        let text = linkage.with(&ExactWants::default().linkage(Variant::default()));
        let module = crate::shader::check::parse(&text.text("views_layers").expect("linked"));
        assert_layout!(
            module,
            ViewsTask {
                width,
                height,
                count,
                rows,
                depth,
                normal,
                position,
                albedo,
                flow,
                instance,
                material,
                primitive,
            }
        );
    }
}
