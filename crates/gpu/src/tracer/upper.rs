//! The upper level of our own hierarchy, built or refitted on the device.
//!
//! The host hands over one matrix for each instance and nothing else. From those the device makes the records of the scene, the
//! records that a walk enters instances by, and the nodes above them (`shaders/bvh_upper.wgsl`): for many instances that move
//! in every frame, where building on the host would cost more than the frame.

use crate::scene::upload::{empty_buffer, storage_buffer, write_buffer};
use crate::shader::Linkage;
use crate::timing::PassClock;
use crate::{Gpu, GpuError, GpuScene};
use accel::encode::{INSTANCE_SPHERES, ObjectInfo};
use bytemuck::{Pod, Zeroable};
use wgpu::{BufferUsages, ShaderStages};

/// Instances that one workgroup sorts.
const SORTED_TOGETHER: u32 = 512;
/// Invocations of a workgroup of most passes.
const GROUP: u32 = 256;
/// Distance of the dispatches' uniforms in their buffer: what every device takes.
const UNIFORM_STRIDE: u64 = 256;

/// Rows of a 3×4 matrix from object to world space.
pub type Place = [[f32; 4]; 3];

/// Levels of nodes above `count` instances, at least one.
pub fn depth(count: u32) -> u32 {
    let (mut nodes, mut levels) = (count.div_ceil(8).max(1), 1);
    while nodes > 1 {
        nodes = nodes.div_ceil(8);
        levels += 1;
    }
    levels
}

/// Nodes above `count` instances.
fn node_count(count: u32) -> u32 {
    let (mut nodes, mut sum) = (count.div_ceil(8).max(1), 0);
    loop {
        sum += nodes;
        if nodes == 1 {
            return sum;
        }
        nodes = nodes.div_ceil(8);
    }
}

/// How the upper level follows instances that have moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpperUpdate {
    /// Sort them anew: the same quality after any movement.
    Rebuild,
    /// Keep their order and make new boxes: faster, and good while neighbours stay neighbours.
    Refit,
}

/// See `shaders/bvh_upper.wgsl` for the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct UpperInfo {
    count: u32,
    sorted: u32,
    levels: u32,
    level: u32,
    size: u32,
    distance: u32,
    padding0: u32,
    padding1: u32,
}

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct UpperObject {
    low: [f32; 3],
    root: u32,
    high: [f32; 3],
    flags: u32,
}

/// A dispatch: which shader, how many workgroups, and what it is told.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    shader: &'static str,
    groups: u32,
    info: UpperInfo,
}

const SHADERS: [&str; 8] =
    ["clear_bounds", "place", "find_keys", "sort_small", "sort_far", "sort_near", "enter", "make_nodes"];

/// All dispatches of an update for `count` instances.
fn steps(count: u32, update: UpperUpdate) -> Vec<Step> {
    let sorted = count.next_power_of_two().max(SORTED_TOGETHER);
    let info = UpperInfo { count, sorted, levels: depth(count), ..UpperInfo::default() };
    let step = |shader, invocations: u32, group: u32| Step {
        shader,
        groups: invocations.div_ceil(group).max(1),
        info,
    };
    let mut steps = vec![step("clear_bounds", 1, 1), step("place", count, GROUP)];
    if update == UpperUpdate::Rebuild {
        steps.push(step("find_keys", sorted, GROUP));
        steps.push(step("sort_small", sorted, SORTED_TOGETHER));
        let mut size = 2 * SORTED_TOGETHER;
        while size <= sorted {
            let mut distance = size / 2;
            while distance >= SORTED_TOGETHER {
                let far = step("sort_far", sorted / 2, GROUP);
                steps.push(Step { info: UpperInfo { size, distance, ..info }, ..far });
                distance /= 2;
            }
            let near = step("sort_near", sorted, SORTED_TOGETHER);
            steps.push(Step { info: UpperInfo { size, ..info }, ..near });
            size *= 2;
        }
    }
    steps.push(step("enter", count, GROUP));
    let mut nodes = count;
    for level in 0..info.levels {
        nodes = nodes.div_ceil(8).max(1);
        let make = step("make_nodes", nodes, 64);
        steps.push(Step { info: UpperInfo { level, ..info }, ..make });
    }
    steps
}

/// Builds the upper level of a scene on the device.
pub struct UpperBuilder {
    count: u32,
    places: wgpu::Buffer,
    pipelines: Vec<wgpu::ComputePipeline>,
    group: wgpu::BindGroup,
    /// Dispatches of both updates; their uniforms follow each other in this order.
    rebuild: Vec<Step>,
    refit: Vec<Step>,
    memory_bytes: u64,
}

impl UpperBuilder {
    /// A builder that writes to the buffers of a tracer: nodes, of which the first belong to the upper level, and instances.
    ///
    /// # Errors
    /// When there is no memory, or the driver refuses a shader.
    pub(super) fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        objects: &[ObjectInfo],
        nodes: &wgpu::Buffer,
        instances: &wgpu::Buffer,
    ) -> Result<Self, GpuError> {
        let count = scene.tables.instances.len() as u32;
        let (rebuild, refit) = (steps(count, UpperUpdate::Rebuild), steps(count, UpperUpdate::Refit));
        let mut uniforms = Vec::new();
        for step in rebuild.iter().chain(&refit) {
            uniforms.extend_from_slice(bytemuck::bytes_of(&step.info));
            uniforms.resize(uniforms.len().next_multiple_of(UNIFORM_STRIDE as usize), 0);
        }
        let objects: Vec<UpperObject> = objects
            .iter()
            .map(|o| UpperObject {
                low: o.low,
                root: o.root,
                high: o.high,
                flags: if o.has_spheres { INSTANCE_SPHERES } else { 0 },
            })
            .collect();
        let places: Vec<Place> = scene.tables.instances.iter().map(|i| i.object_to_world).collect();
        let storage = |object, bytes: u64| empty_buffer(gpu, object, bytes, BufferUsages::STORAGE);
        let info =
            empty_buffer(gpu, "steps of the upper level", uniforms.len() as u64, BufferUsages::UNIFORM)?;
        write_buffer(gpu, "steps of the upper level", &info, &uniforms)?;
        let places = storage_buffer(gpu, "places of instances", &places, BufferUsages::empty())?;
        let sorted = u64::from(rebuild[0].info.sorted);
        let buffers = [
            storage_buffer(gpu, "bounds of objects", &objects, BufferUsages::empty())?,
            places.clone(),
            scene.buffers.instances.clone(),
            storage("boxes of the upper level", 32 * u64::from(count + node_count(count)))?,
            storage("order of instances", 8 * sorted)?,
            storage("bounds of the upper level", 24)?,
            nodes.clone(),
            instances.clone(),
        ];
        let own = [&info, &places, &buffers[0], &buffers[3], &buffers[4], &buffers[5]];
        let memory_bytes = own.iter().map(|b| b.size()).sum();
        let (layout, group) = gpu
            .guarded(|| bind(gpu, &info, &buffers))
            .map_err(|reason| GpuError::Device { doing: "binding the upper level", reason })?;
        let text = Linkage::default().text("bvh_upper")?;
        let text = gpu.shader_text("the hierarchy's upper level", text);
        let pipelines =
            SHADERS.iter().map(|name| text.pipeline(name, &[Some(&layout)])).collect::<Result<_, _>>()?;
        Ok(Self { count, places, pipelines, group, rebuild, refit, memory_bytes })
    }

    /// Number of instances.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Bytes on the device beside those of scene and tracer.
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// Hands over where all instances stand now, for the next update: one matrix each. One that no inverse exists of takes its
    /// instance out of the world.
    ///
    /// # Errors
    /// When there is no memory for the way, or the number of matrices is another.
    pub fn set_places(&self, gpu: &Gpu, places: &[Place]) -> Result<(), GpuError> {
        if places.len() != self.count as usize {
            let reason = format!("{} matrices for {} instances", places.len(), self.count);
            return Err(GpuError::Device { doing: "moving instances", reason });
        }
        write_buffer(gpu, "places of instances", &self.places, bytemuck::cast_slice(places))
    }

    /// Records an update. The first one has to be a rebuild.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, clock: &mut dyn PassClock, update: UpperUpdate) {
        let (steps, before) = match update {
            UpperUpdate::Rebuild => (&self.rebuild, 0),
            UpperUpdate::Refit => (&self.refit, self.rebuild.len()),
        };
        let slot = clock.slot("upper level");
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("upper level"),
            timestamp_writes: slot.map(|s| s.compute()),
        });
        for (number, step) in steps.iter().enumerate() {
            // The list has every shader that steps name.
            let shader = SHADERS.iter().position(|name| *name == step.shader).unwrap_or_default();
            pass.set_pipeline(&self.pipelines[shader]);
            pass.set_bind_group(0, &self.group, &[((before + number) as u64 * UNIFORM_STRIDE) as u32]);
            const ROW: u32 = 32_768;
            pass.dispatch_workgroups(step.groups.min(ROW), step.groups.div_ceil(ROW), 1);
        }
    }
}

fn bind(
    gpu: &Gpu,
    info: &wgpu::Buffer,
    buffers: &[wgpu::Buffer; 8],
) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    // Objects and places are read, everything else is written.
    const READ: u32 = 2;
    let storage = |binding: u32| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: binding <= READ },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let uniform = wgpu::BindGroupLayoutEntry {
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        },
        ..storage(0)
    };
    let entries: Vec<_> = std::iter::once(uniform).chain((1..=8).map(storage)).collect();
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("upper level"),
        entries: &entries,
    });
    let step = wgpu::BufferBinding {
        buffer: info,
        offset: 0,
        size: wgpu::BufferSize::new(size_of::<UpperInfo>() as u64),
    };
    let first = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(step) };
    let others = (1..)
        .zip(buffers)
        .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() });
    let entries: Vec<_> = std::iter::once(first).chain(others).collect();
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("upper level"),
        layout: &layout,
        entries: &entries,
    });
    (layout, group)
}

#[cfg(test)]
mod tests;
