//! Tracing without ray tracing hardware: our own hierarchy, in a few storage buffers, walked in compute shaders.

use super::upper::{self, UpperBuilder};
use super::{Instances, Tracer, TracerKind};
use crate::scene::upload::{storage_buffer, write_buffer};
use crate::shader::Linkage;
use crate::shader::constants::numbers;
use crate::{Gpu, GpuError, GpuScene};
use accel::encode::{EncodedInstance, EncodedNode, EncodedPrimitive, EncodedScene, Object, SphereGeometry};
use accel::{Geometry, Instance, InstanceMotions, Quality, Sphere};
use bytemuck::{Pod, Zeroable};
use scene::tables::{BlasRecord, GeometryKind, GeometryRecord, InstanceRecord, MotionRange, SceneTables};
use std::fmt::Write;
use wgpu::{BufferUsages, Features};

/// Defined where walks may begin below the root. Most shaders begin all of them there, and their text knows of nothing else.
const BELOW: &str = "BVH_BELOW";

/// Binding of the first page of nodes. The instances come before it, the pages of primitives after the nodes.
const FIRST_PAGE: u32 = 1;

/// Nodes from which on a shader tests primitives one a turn. Measured: with 7 nodes that is 16 % slower, with a few thousand
/// it makes no difference, with hundreds of thousands it is up to 8 % faster.
const TURNS_FROM_NODES: usize = 4096;

/// Storage buffers of the groups beside this one: six of the scene, three of the film.
const OTHER_BUFFERS: u32 = 9;

/// Primitives of instances that stand still are joined to one object if there are no more than so many: a quarter of a gigabyte.
const MOST_JOINED: usize = 1 << 22;

/// The same for drivers that trace on the host, which would be busy with building for longer than that saves.
const MOST_JOINED_IN_SOFTWARE: usize = 1 << 18;

/// Encodes the acceleration structures of a scene whose instances may be moved, or move while the
/// shutter is open.
pub fn encode(tables: &SceneTables, quality: Quality) -> EncodedScene {
    let (objects, instances) = objects_and_instances(tables);
    EncodedScene::build_moving(&objects, &instances, &motions(tables), quality)
}

/// How the instances move while the shutter is open.
fn motions(tables: &SceneTables) -> InstanceMotions {
    let Some(motion) = &tables.motion else { return InstanceMotions::default() };
    let of_instances = motion.instances.iter().map(MotionRange::range).collect();
    InstanceMotions { segments: motion.segments.clone(), of_instances }
}

/// As [`encode`], of a scene whose instances stand still.
pub fn encode_still(tables: &SceneTables, quality: Quality, is_software: bool) -> EncodedScene {
    let (objects, instances) = objects_and_instances(tables);
    let most_joined = if is_software { MOST_JOINED_IN_SOFTWARE } else { MOST_JOINED };
    EncodedScene::build_flattened(&objects, &instances, quality, most_joined)
}

fn objects_and_instances(tables: &SceneTables) -> (Vec<Object<'_>>, Vec<Instance>) {
    let objects = tables.blas.iter().map(|b| object(tables, b)).collect();
    (objects, tables.instances.iter().map(instance).collect())
}

fn instance(record: &InstanceRecord) -> Instance {
    Instance { blas: record.blas, object_to_world: record.object_to_world, mask: u32::MAX }
}

fn object<'a>(tables: &'a SceneTables, blas: &BlasRecord) -> Object<'a> {
    let geometries = &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
    let triangles = |g: &GeometryRecord| Geometry {
        positions: &tables.positions[g.first_vertex as usize..][..g.vertex_count as usize],
        indices: &tables.indices[g.first_primitive as usize..][..g.primitive_count as usize],
        first_id: g.first_in_blas,
    };
    let spheres = |g: &GeometryRecord| {
        let all: &[Sphere] = bytemuck::cast_slice(&tables.spheres);
        let spheres = &all[g.first_primitive as usize..][..g.primitive_count as usize];
        SphereGeometry { spheres, first_id: g.first_in_blas }
    };
    match blas.kind {
        GeometryKind::Triangles => Object::Triangles(geometries.iter().map(triangles).collect()),
        GeometryKind::Spheres => Object::Spheres(geometries.iter().map(spheres).collect()),
    }
}

/// How an array of records is cut into buffers that a shader can bind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Pages {
    /// log₂ of the number of records in a page.
    shift: u32,
    count: u32,
}

impl Pages {
    /// The fewest pages for `records` of `size` bytes where a binding may have `limit`.
    fn new(records: usize, size: usize, limit: u64) -> Pages {
        let most = (limit / size as u64).clamp(1, 1 << 31);
        let shift = most.ilog2();
        Pages { shift, count: (records.max(1) as u64).div_ceil(1 << shift) as u32 }
    }

    /// WGSL: the buffers `bvh_{name}s_…`, from `binding` on.
    fn bindings(self, name: &str, record: &str, binding: u32) -> String {
        let mut text = String::new();
        for page in 0..self.count {
            let binding = binding + page;
            let _ = writeln!(
                text,
                "@group(1) @binding({binding}) var<storage, read> bvh_{name}s_{page}: array<{record}>;"
            );
        }
        text
    }

    /// WGSL: a function that reads `field` of record `index` of `bvh_{name}s_…`.
    fn reader(self, name: &str, signature: &str, field: &str) -> String {
        if self.count == 1 {
            return format!("fn {signature} {{ return bvh_{name}s_0[index]{field}; }}\n");
        }
        let mut text = format!("fn {signature} {{\n    let at = index & {:#x}u;\n", (1u64 << self.shift) - 1);
        let _ = writeln!(text, "    switch index >> {}u {{", self.shift);
        for page in 1..self.count {
            let _ = writeln!(text, "        case {page}u: {{ return bvh_{name}s_{page}[at]{field}; }}");
        }
        let _ = writeln!(text, "        default: {{ return bvh_{name}s_0[at]{field}; }}\n    }}\n}}");
        text
    }

    fn buffers<T: Pod>(
        self,
        gpu: &Gpu,
        object: &'static str,
        records: &[T],
    ) -> Result<Vec<wgpu::Buffer>, GpuError> {
        let first = records.len().min(1 << self.shift);
        let pages = std::iter::once(&records[..first]).chain(records[first..].chunks(1 << self.shift));
        pages.map(|page| storage_buffer(gpu, object, page, BufferUsages::empty())).collect()
    }
}

/// The hierarchy of a scene on a device.
pub struct BvhTracer {
    /// The module `bvh_scene`.
    scene_module: String,
    layout: wgpu::BindGroupLayout,
    bind_group: wgpu::BindGroup,
    memory_bytes: u64,
    /// Boxes that a subgroup tests at a time in packet traversal, where the device can do that.
    beam_boxes: Option<u32>,
    /// The upper level on the host.
    upper: EncodedScene,
    /// Where its instances and, in front of all others, its nodes are on the device.
    instances: wgpu::Buffer,
    first_nodes: wgpu::Buffer,
}

impl BvhTracer {
    /// Builds the hierarchy of a scene on the host and copies it to the device.
    ///
    /// # Errors
    /// When the scene is too large for the device, or there is no memory.
    pub fn new(gpu: &Gpu, scene: &GpuScene, instances: Instances) -> Result<Self, GpuError> {
        if instances == Instances::StandStill && scene.tables.motion.is_none() {
            let encoded = encode_still(&scene.tables, Quality::Balanced, gpu.is_software());
            let is_joined = encoded.is_flattened();
            let made = Self::upload(gpu, encoded);
            // What is too large for the device joined may not be as it is.
            if made.is_ok() || !is_joined || gpu.is_lost() {
                return made;
            }
        }
        Self::upload(gpu, encode(&scene.tables, Quality::Balanced))
    }

    /// As [`BvhTracer::new`] for instances that move, with what builds the upper level on the device whenever instances have moved. `None` in its place
    /// where there is no upper level: of a single instance that stands in the world as it is.
    ///
    /// # Errors
    /// As [`BvhTracer::new`].
    pub fn dynamic(gpu: &Gpu, scene: &GpuScene) -> Result<(Self, Option<UpperBuilder>), GpuError> {
        let count = scene.tables.instances.len();
        let mut encoded = encode(&scene.tables, Quality::Balanced);
        if encoded.is_single() || count == 0 {
            return Ok((Self::upload(gpu, encoded)?, None));
        }
        let stack = encoded.stack_size().max(encoded.object_depth() + upper::depth(count as u32));
        let objects: Vec<_> = encoded.objects().collect();
        // Instances that cannot be hit now may be later.
        encoded.instances.resize(count + 1, EncodedInstance::zeroed());
        let tracer = Self::upload_with_stack(gpu, encoded, stack)?;
        let builder = UpperBuilder::new(gpu, scene, &objects, &tracer.first_nodes, &tracer.instances)?;
        Ok((tracer, Some(builder)))
    }

    /// Copies an encoded scene to the device.
    ///
    /// # Errors
    /// As [`BvhTracer::new`].
    pub fn upload(gpu: &Gpu, scene: EncodedScene) -> Result<Self, GpuError> {
        let stack = scene.stack_size();
        Self::upload_with_stack(gpu, scene, stack)
    }

    /// As [`BvhTracer::upload`], for walks in which `stack` groups may wait.
    fn upload_with_stack(gpu: &Gpu, scene: EncodedScene, stack: u32) -> Result<Self, GpuError> {
        let limit = gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size);
        let nodes = Pages::new(scene.nodes.len(), size_of::<EncodedNode>(), limit);
        let primitives = Pages::new(scene.primitives.len(), size_of::<EncodedPrimitive>(), limit);
        let needed = u64::from(OTHER_BUFFERS + FIRST_PAGE + nodes.count + primitives.count);
        let offered = u64::from(gpu.limits.max_storage_buffers_per_shader_stage);
        if needed > offered {
            let adapter = gpu.info.name.clone();
            return Err(GpuError::Limit { adapter, limit: "storage buffers a shader", needed, offered });
        }
        let mut buffers =
            vec![storage_buffer(gpu, "the hierarchy's instances", &scene.instances, BufferUsages::empty())?];
        buffers.extend(nodes.buffers(gpu, "the hierarchy's nodes", &scene.nodes)?);
        buffers.extend(primitives.buffers(gpu, "the hierarchy's primitives", &scene.primitives)?);
        gpu.queue.submit([]);
        let (layout, bind_group) = gpu
            .guarded(|| bind(gpu, &buffers))
            .map_err(|reason| GpuError::Device { doing: "binding the hierarchy", reason })?;
        let memory_bytes = buffers.iter().map(wgpu::Buffer::size).sum();
        let scene_module = scene_module(&scene, nodes, primitives, stack);
        let [instances, first_nodes] = [&buffers[0], &buffers[FIRST_PAGE as usize]].map(wgpu::Buffer::clone);
        let upper = scene.into_top_level();
        let beam_boxes = beam_boxes(gpu);
        Ok(Self { scene_module, layout, bind_group, memory_bytes, beam_boxes, upper, instances, first_nodes })
    }
}

impl Tracer for BvhTracer {
    fn kind(&self) -> TracerKind {
        TracerKind::Bvh
    }

    fn linkage(&self) -> Linkage {
        linkage(self.scene_module.clone())
    }

    fn linkage_below(&self) -> Option<Linkage> {
        Some(self.linkage().define(BELOW))
    }

    fn linkage_packets(&self) -> Option<Linkage> {
        self.beam_boxes.map(|boxes| with_packets(self.linkage(), boxes))
    }

    fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    fn move_instances(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<bool, GpuError> {
        if self.upper.is_flattened() {
            return Ok(false);
        }
        let (single, stack) = (self.upper.is_single(), self.upper.stack_size());
        let instances: Vec<Instance> = scene.tables.instances.iter().map(instance).collect();
        let changed = self.upper.update_moving(&instances, &motions(&scene.tables));
        let nodes: &[u8] = bytemuck::cast_slice(&self.upper.nodes[..changed]);
        let records: &[u8] = bytemuck::cast_slice(&self.upper.instances);
        // Shaders are compiled for one depth, and with an upper level or without.
        let same_shader = self.upper.is_single() == single && self.upper.stack_size() <= stack;
        let fits = |bytes: &[u8], buffer: &wgpu::Buffer| bytes.len() as u64 <= buffer.size();
        if !same_shader || !fits(nodes, &self.first_nodes) || !fits(records, &self.instances) {
            return Ok(false);
        }
        write_buffer(gpu, "the hierarchy's nodes", &self.first_nodes, nodes)?;
        write_buffer(gpu, "the hierarchy's instances", &self.instances, records)?;
        gpu.check("moving instances")?;
        Ok(true)
    }

    fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }
}

/// How many of a node's eight boxes the invocations of a subgroup can test at a time, one each, and exchange what they find; `None` if too
/// few. Browsers want a directive for that which naga does not know yet.
fn beam_boxes(gpu: &Gpu) -> Option<u32> {
    let exchange = gpu.features.contains(Features::SUBGROUP) && !cfg!(target_arch = "wasm32");
    let least = gpu.info.subgroup_min_size; // a power of two
    (exchange && least >= 4).then(|| least.min(8))
}

/// What modules are linked with that trace through a scene's hierarchy.
fn linkage(scene_module: String) -> Linkage {
    Linkage::default().bind("tracer", "tracer_bvh").generate("bvh_scene", scene_module)
}

/// The same, for subgroup packet traversal in which a subgroup tests `boxes` boxes at a time.
fn with_packets(alone: Linkage, boxes: u32) -> Linkage {
    alone.generate("bvh_beam_boxes", numbers([("BVH_BEAM_BOXES", boxes)]))
}

fn bind(gpu: &Gpu, buffers: &[wgpu::Buffer]) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let entry = |binding: u32| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = (0..buffers.len() as u32).map(entry).collect();
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("hierarchy"),
        entries: &entries,
    });
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
        .collect();
    let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hierarchy"),
        layout: &layout,
        entries: &entries,
    });
    (layout, bind_group)
}

/// The module `bvh_scene`: how the walk, in which `stack` groups may wait, reads a scene's nodes and primitives from their pages, and
/// what it need not ask of this scene.
fn scene_module(scene: &EncodedScene, nodes: Pages, primitives: Pages, stack: u32) -> String {
    let (has_triangles, has_spheres) = scene.kinds();
    [
        "#import bvh_records\n",
        &nodes.bindings("node", "BvhNode", FIRST_PAGE),
        &nodes.reader("node", "bvh_grid(index: u32) -> vec4u", ".grid"),
        &nodes.reader("node", "bvh_links(index: u32) -> vec4u", ".links"),
        &nodes.reader("node", "bvh_planes(index: u32, plane: u32) -> vec4u", ".planes[plane]"),
        &nodes.reader(
            "node",
            "bvh_plane_pair(index: u32, plane: u32, pair: u32) -> u32",
            ".planes[plane][pair]",
        ),
        &primitives.bindings("primitive", "BvhPrimitive", FIRST_PAGE + nodes.count),
        &primitives.reader("primitive", "bvh_primitive(index: u32) -> BvhPrimitive", ""),
        "// How many groups may wait at a time.\n",
        &format!("const BVH_STACK: u32 = {stack}u;\n"),
        "// Whether primitives are tested one a turn.\n",
        &format!("const BVH_TURNS: bool = {};\n", scene.nodes.len() >= TURNS_FROM_NODES),
        "// Whether there is one instance that stands in the world as it is.\n",
        &format!("const BVH_SINGLE: bool = {};\n", scene.is_single()),
        "// Whether that is made of several, and primitives say which they belong to.\n",
        &format!("const BVH_JOINED: bool = {};\n", scene.is_flattened()),
        &format!("const BVH_HAS_TRIANGLES: bool = {has_triangles};\n"),
        &format!("const BVH_HAS_SPHERES: bool = {has_spheres};\n"),
    ]
    .concat()
}

/// For tests: the linkage for `scene` where a binding may have `limit` bytes.
#[cfg(test)]
pub(crate) fn linkage_for(scene: &EncodedScene, limit: u64) -> Linkage {
    let nodes = Pages::new(scene.nodes.len(), size_of::<EncodedNode>(), limit);
    let primitives = Pages::new(scene.primitives.len(), size_of::<EncodedPrimitive>(), limit);
    linkage(scene_module(scene, nodes, primitives, scene.stack_size()))
}

/// For tests: as [`linkage_for`], with packet traversal, `boxes` boxes at a time.
#[cfg(test)]
pub(crate) fn linkage_packets_for(scene: &EncodedScene, limit: u64, boxes: u32) -> Linkage {
    with_packets(linkage_for(scene, limit), boxes)
}

/// For tests: as [`linkage_for`], for walks that begin below the root.
#[cfg(test)]
pub(crate) fn linkage_below_for(scene: &EncodedScene, limit: u64) -> Linkage {
    linkage_for(scene, limit).define(BELOW)
}

#[cfg(test)]
mod tests;
