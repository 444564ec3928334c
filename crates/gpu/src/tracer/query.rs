//! Ray queries: the driver's acceleration structures, asked from compute shaders.
//!
//! The structures are built from the scene's own vertex and index buffers. Only spheres need a buffer more: their boxes.

use super::{Tracer, TracerKind};
use crate::scene::upload::storage_buffer;
use crate::shader::Linkage;
use crate::{Gpu, GpuError, GpuScene};
use scene::tables::{BlasRecord, GeometryKind, GeometryRecord, SceneTables};
use wgpu::{AccelerationStructureFlags, AccelerationStructureGeometryFlags, AccelerationStructureUpdateMode};

/// What modules are linked with that trace by ray queries.
pub fn linkage() -> Linkage {
    Linkage::default().bind("tracer", "tracer_query")
}

/// The largest number of instances: the driver keeps 24 bits for ours.
const MAX_INSTANCES: usize = 1 << 24;

/// Traces by ray queries.
pub struct QueryTracer {
    layout: wgpu::BindGroupLayout,
    bind_group: wgpu::BindGroup,
    blas: Vec<wgpu::Blas>,
    tlas: wgpu::Tlas,
}

/// One bottom-level structure before it is built: as the driver asks for it, twice.
enum Build {
    Triangles(Vec<wgpu::BlasTriangleGeometrySizeDescriptor>),
    Spheres(Vec<wgpu::BlasAABBGeometrySizeDescriptor>),
}

impl QueryTracer {
    /// Builds the structures of a scene.
    ///
    /// # Errors
    /// When the device cannot, or the scene is too large for it.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, GpuError> {
        TracerKind::Query.check(gpu)?;
        let tables = &*scene.tables;
        check_limits(gpu, tables)?;
        let boxes = sphere_boxes(tables);
        let boxes = storage_buffer(gpu, "boxes of spheres", &boxes, wgpu::BufferUsages::BLAS_INPUT)?;
        let built = gpu
            .guarded(|| {
                let mut encoder = gpu
                    .device
                    .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("build") });
                let (blas, tlas) = record_build(gpu, scene, &boxes, &mut encoder);
                gpu.queue.submit([encoder.finish()]);
                let layout = layout(gpu);
                let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("acceleration structure"),
                    layout: &layout,
                    entries: &[wgpu::BindGroupEntry { binding: 0, resource: tlas.as_binding() }],
                });
                Self { layout, bind_group, blas, tlas }
            })
            .map_err(|reason| GpuError::Device { doing: "building acceleration structures", reason })?;
        gpu.wait("building acceleration structures")?;
        Ok(built)
    }
}

impl Tracer for QueryTracer {
    fn kind(&self) -> TracerKind {
        TracerKind::Query
    }

    fn linkage(&self) -> Linkage {
        linkage()
    }

    fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    fn move_instances(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<bool, GpuError> {
        let (blas, tlas) = (&self.blas, &mut self.tlas);
        gpu.guarded(|| {
            let mut encoder =
                gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("move") });
            place_instances(&scene.tables, blas, tlas);
            encoder.build_acceleration_structures(std::iter::empty(), [&*tlas]);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: "moving instances", reason })?;
        gpu.check("moving instances")?;
        Ok(true)
    }

    fn memory_bytes(&self) -> u64 {
        0 // the driver does not tell
    }
}

fn check_limits(gpu: &Gpu, tables: &SceneTables) -> Result<(), GpuError> {
    let largest =
        |f: fn(&BlasRecord, &SceneTables) -> u64| tables.blas.iter().map(|b| f(b, tables)).max().unwrap_or(0);
    let primitives = |b: &BlasRecord, tables: &SceneTables| {
        geometries(tables, b).iter().map(|g| u64::from(g.primitive_count)).max().unwrap_or(0)
    };
    let checks = [
        (
            "instances",
            tables.instances.len() as u64,
            gpu.limits.max_tlas_instance_count.min(MAX_INSTANCES as u32),
        ),
        (
            "geometries a structure",
            largest(|b, _| u64::from(b.geometry_count)),
            gpu.limits.max_blas_geometry_count,
        ),
        ("primitives a geometry", largest(primitives), gpu.limits.max_blas_primitive_count),
    ];
    for (limit, needed, offered) in checks {
        if needed > u64::from(offered) {
            let adapter = gpu.info.name.clone();
            return Err(GpuError::Limit { adapter, limit, needed, offered: u64::from(offered) });
        }
    }
    Ok(())
}

fn geometries<'a>(tables: &'a SceneTables, blas: &BlasRecord) -> &'a [GeometryRecord] {
    &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize]
}

/// Lower and upper corner of every sphere.
fn sphere_boxes(tables: &SceneTables) -> Vec<[f32; 6]> {
    let corners = |&[x, y, z, r]: &[f32; 4]| [x - r, y - r, z - r, x + r, y + r, z + r];
    tables.spheres.iter().map(corners).collect()
}

/// Creates all structures and records their build.
fn record_build(
    gpu: &Gpu,
    scene: &GpuScene,
    boxes: &wgpu::Buffer,
    encoder: &mut wgpu::CommandEncoder,
) -> (Vec<wgpu::Blas>, wgpu::Tlas) {
    let tables = &*scene.tables;
    let with_holes = geometries_with_holes(tables);
    let builds: Vec<Build> = tables.blas.iter().map(|b| sizes(tables, b, &with_holes)).collect();
    let blas: Vec<wgpu::Blas> = builds.iter().map(|b| create_blas(gpu, b)).collect();
    let entries: Vec<_> = (tables.blas.iter().zip(&builds).zip(&blas))
        .map(|((record, build), blas)| wgpu::BlasBuildEntry {
            blas,
            geometry: inputs(scene, boxes, record, build),
        })
        .collect();
    let mut tlas = gpu.device.create_tlas(&wgpu::CreateTlasDescriptor {
        label: Some("scene"),
        max_instances: tables.instances.len().max(1) as u32,
        flags: AccelerationStructureFlags::PREFER_FAST_TRACE,
        update_mode: AccelerationStructureUpdateMode::Build,
    });
    place_instances(tables, &blas, &mut tlas);
    encoder.build_acceleration_structures(entries.iter(), [&tlas]);
    drop(entries);
    (blas, tlas)
}

/// Fills the top-level structure before it is built.
fn place_instances(tables: &SceneTables, blas: &[wgpu::Blas], tlas: &mut wgpu::Tlas) {
    for (i, instance) in tables.instances.iter().enumerate() {
        let [a, b, c] = instance.object_to_world;
        let rows = [a, b, c].concat();
        let transform = std::array::from_fn(|k| rows[k]);
        tlas[i] = Some(wgpu::TlasInstance::new(&blas[instance.blas as usize], transform, i as u32, 0xff));
    }
}

/// For each geometry, whether any instance gives it a material with holes.
fn geometries_with_holes(tables: &SceneTables) -> Vec<bool> {
    let mut holes = vec![false; tables.geometries.len()];
    for instance in &tables.instances {
        let blas = &tables.blas[instance.blas as usize];
        for g in 0..blas.geometry_count {
            let material = tables.bindings[(instance.first_binding + g) as usize].material;
            holes[(blas.first_geometry + g) as usize] |= tables.materials[material as usize].has_alpha();
        }
    }
    holes
}

fn sizes(tables: &SceneTables, blas: &BlasRecord, with_holes: &[bool]) -> Build {
    let records = geometries(tables, blas);
    match blas.kind {
        GeometryKind::Triangles => Build::Triangles(
            (blas.first_geometry as usize..)
                .zip(records)
                .map(|(index, g)| wgpu::BlasTriangleGeometrySizeDescriptor {
                    vertex_format: wgpu::VertexFormat::Float32x3,
                    vertex_count: g.vertex_count,
                    index_format: Some(wgpu::IndexFormat::Uint32),
                    index_count: Some(3 * g.primitive_count),
                    flags: if with_holes[index] {
                        AccelerationStructureGeometryFlags::NO_DUPLICATE_ANY_HIT_INVOCATION
                    } else {
                        AccelerationStructureGeometryFlags::OPAQUE
                    },
                })
                .collect(),
        ),
        GeometryKind::Spheres => Build::Spheres(
            records
                .iter()
                .map(|g| wgpu::BlasAABBGeometrySizeDescriptor {
                    primitive_count: g.primitive_count,
                    flags: AccelerationStructureGeometryFlags::empty(),
                })
                .collect(),
        ),
    }
}

fn create_blas(gpu: &Gpu, build: &Build) -> wgpu::Blas {
    let sizes = match build {
        Build::Triangles(sizes) => {
            wgpu::BlasGeometrySizeDescriptors::Triangles { descriptors: sizes.clone() }
        }
        Build::Spheres(sizes) => wgpu::BlasGeometrySizeDescriptors::AABBs { descriptors: sizes.clone() },
    };
    let descriptor = wgpu::CreateBlasDescriptor {
        label: Some("bottom-level structure"),
        flags: AccelerationStructureFlags::PREFER_FAST_TRACE,
        update_mode: AccelerationStructureUpdateMode::Build,
    };
    gpu.device.create_blas(&descriptor, sizes)
}

/// Where the driver finds the geometries of a structure.
fn inputs<'a>(
    scene: &'a GpuScene,
    boxes: &'a wgpu::Buffer,
    blas: &BlasRecord,
    build: &'a Build,
) -> wgpu::BlasGeometries<'a> {
    let records = geometries(&scene.tables, blas);
    match build {
        Build::Triangles(sizes) => wgpu::BlasGeometries::TriangleGeometries(
            (sizes.iter().zip(records))
                .map(|(size, g)| wgpu::BlasTriangleGeometry {
                    size,
                    vertex_buffer: &scene.buffers.vertices,
                    first_vertex: g.first_vertex,
                    vertex_stride: size_of::<crate::scene::records::Vertex>() as u64,
                    // Vertex indices are the first part of the words.
                    index_buffer: Some(&scene.buffers.words),
                    first_index: Some(3 * g.first_primitive),
                    transform_buffer: None,
                    transform_buffer_offset: None,
                })
                .collect(),
        ),
        Build::Spheres(sizes) => wgpu::BlasGeometries::AabbGeometries(
            (sizes.iter().zip(records))
                .map(|(size, g)| wgpu::BlasAabbGeometry {
                    size,
                    stride: wgpu::AABB_GEOMETRY_MIN_STRIDE,
                    aabb_buffer: boxes,
                    primitive_offset: g.first_primitive * wgpu::AABB_GEOMETRY_MIN_STRIDE as u32,
                })
                .collect(),
        ),
    }
}

fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("acceleration structure"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::AccelerationStructure { vertex_return: false },
            count: None,
        }],
    })
}
