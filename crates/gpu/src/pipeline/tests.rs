//! Rays through the pipeline against the same rays on the CPU.

use super::*;
use crate::scene::upload::storage_buffer;
use crate::{GpuOptions, open_for_test};
use accel::{Blas, Geometry, HitFilter, Instance, Quality, Ray, Sphere, Tlas};
use bytemuck::{Pod, Zeroable};
use scene::tables::{GeometryKind, SceneTables};
use table::MaterialClass;
use wgpu::BufferUsages;

/// Traces every ray of a buffer both ways and writes down what the shaders say.
const KERNEL: &str = "
#import tracer
struct TestRay { origin: vec3f, t_min: f32, direction: vec3f, t_max: f32 }
struct Found { hit: Hit, occluded: u32, material: u32, material_class: u32 }
@group(2) @binding(0) var<storage, read> rays: array<TestRay>;
@group(2) @binding(1) var<storage, read_write> found: array<Found>;

@ray_generation
fn generate(@builtin(ray_invocation_id) id: vec3u) {
    let ray = rays[id.x];
    let hit = trace_closest(ray.origin, ray.direction, ray.t_min, ray.t_max, id.x);
    let material = payload.material;
    let material_class = payload.material_class;
    let occluded = trace_any(ray.origin, ray.direction, ray.t_min, ray.t_max, id.x);
    found[id.x] = Found(hit, u32(occluded), material, material_class);
}
";

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Found {
    t: f32,
    u: f32,
    v: f32,
    instance: u32,
    geometry: u32,
    primitive: u32,
    occluded: u32,
    material: u32,
    material_class: u32,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct TestRay {
    origin: [f32; 3],
    t_min: f32,
    direction: [f32; 3],
    t_max: f32,
}

fn traced(gpu: &Gpu, tables: &Arc<SceneTables>, rays: &[Ray]) -> Vec<Found> {
    let scene = GpuScene::upload(gpu, tables.clone()).expect("upload");
    let tracing = PipelineTracing::build(gpu, &scene).expect("structures");
    traced_through(gpu, &tracing, &scene, rays)
}

fn traced_through(gpu: &Gpu, tracing: &PipelineTracing, scene: &GpuScene, rays: &[Ray]) -> Vec<Found> {
    let variant = scene.variant();
    let text = Linkage::of(variant).with(&linkage()).generate("test", KERNEL).text("test").expect("linked");
    let mut program = tracing.program("test", &text, &tracing.hits).expect("pipeline");
    let as_test = |r: &Ray| TestRay {
        origin: r.origin,
        t_min: r.t_min,
        direction: r.direction,
        t_max: r.t_max.min(f32::MAX),
    };
    let rays: Vec<_> = rays.iter().map(as_test).collect();
    let rays_buffer = storage_buffer(gpu, "rays", &rays, BufferUsages::empty()).expect("rays");
    let blank = vec![Found::default(); rays.len()];
    let found = storage_buffer(gpu, "found", &blank, BufferUsages::COPY_SRC).expect("found");
    let own = [((2, 0), Resource::Buffer(rays_buffer)), ((2, 1), Resource::Buffer(found.clone()))];
    program.bind(scene_resources(scene).into_iter().chain(own).collect()).expect("bind");
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: None });
    program.trace(&mut encoder, [rays.len() as u32, 1, 1]).expect("trace");
    gpu.queue.submit([encoder.finish()]);
    gpu.check("tracing").expect("no errors");
    read(gpu, &found, rays.len())
}

fn read(gpu: &Gpu, buffer: &wgpu::Buffer, count: usize) -> Vec<Found> {
    let size = (count * size_of::<Found>()) as u64;
    let back = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: None });
    encoder.copy_buffer_to_buffer(buffer, 0, &back, 0, size);
    gpu.queue.submit([encoder.finish()]);
    back.map_async(wgpu::MapMode::Read, .., |result| result.expect("map"));
    gpu.wait("reading").expect("wait");
    let view = back.get_mapped_range(..).expect("mapped");
    bytemuck::pod_collect_to_vec(&view)
}

fn cpu_structures(tables: &SceneTables) -> Tlas {
    let build = |b: &scene::tables::BlasRecord| {
        let geometries = &tables.geometries[b.first_geometry as usize..][..b.geometry_count as usize];
        Arc::new(match b.kind {
            GeometryKind::Triangles => {
                let triangles = |g: &scene::tables::GeometryRecord| Geometry {
                    positions: &tables.positions[g.first_vertex as usize..][..g.vertex_count as usize],
                    indices: &tables.indices[g.first_primitive as usize..][..g.primitive_count as usize],
                    first_id: g.first_in_blas,
                };
                Blas::triangles(&geometries.iter().map(triangles).collect::<Vec<_>>(), Quality::Fast)
            }
            GeometryKind::Spheres => {
                let range = |g: &scene::tables::GeometryRecord| {
                    &tables.spheres[g.first_primitive as usize..][..g.primitive_count as usize]
                };
                let sphere = |s: &[f32; 4]| Sphere { center: [s[0], s[1], s[2]], radius: s[3] };
                let spheres: Vec<_> = geometries.iter().flat_map(range).map(sphere).collect();
                Blas::spheres(&spheres, 0, Quality::Fast)
            }
        })
    };
    let instance = |i: &scene::tables::InstanceRecord| Instance {
        blas: i.blas,
        object_to_world: i.object_to_world,
        mask: u32::MAX,
    };
    let instances: Vec<_> = tables.instances.iter().map(instance).collect();
    Tlas::build(&instances, tables.blas.iter().map(build).collect())
}

/// Drops hits on surfaces that are holes altogether, as the materials of these tests are.
struct Holes<'a>(&'a SceneTables);

impl HitFilter for Holes<'_> {
    const OPAQUE: bool = false;

    fn accept(&self, candidate: &accel::Candidate) -> bool {
        let (instance, primitive) = (candidate.instance, candidate.primitive);
        let tables = self.0;
        let instance = &tables.instances[instance as usize];
        let blas = &tables.blas[instance.blas as usize];
        let geometries = &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
        let within = |g: &scene::tables::GeometryRecord| {
            (g.first_in_blas..g.first_in_blas + g.primitive_count).contains(&primitive)
        };
        let geometry = geometries.iter().position(within).expect("a geometry has it") as u32;
        let binding = &tables.bindings[(instance.first_binding + geometry) as usize];
        let material = &tables.materials[binding.material as usize];
        material.alpha_cutoff <= material.base_color.w
    }
}

/// Rays from around the scene to points near its middle, and some that miss, start inside or are no rays at all.
fn rays(tables: &SceneTables, count: usize) -> Vec<Ray> {
    let [x, y, z, radius] = tables.bounding_sphere;
    let center = glam::vec3(x, y, z);
    let mut random = testkit::Random::new(7);
    let mut point = |scale: f32| {
        let mut coordinate = || random.uniform_f32() * 2.0 - 1.0;
        center + glam::vec3(coordinate(), coordinate(), coordinate()) * (radius * scale)
    };
    let mut rays: Vec<Ray> = (0..count)
        .map(|i| {
            let origin = point(if i % 3 == 0 { 0.5 } else { 2.0 });
            Ray::new(origin.to_array(), (point(0.7) - origin).to_array())
        })
        .collect();
    rays[1].t_max = 0.3;
    rays[2].t_min = 0.7;
    rays[3].direction = [0.0; 3];
    rays[4].origin[1] = f32::NAN;
    rays[5].direction[2] = f32::INFINITY;
    rays[6].t_max = -1.0;
    rays
}

/// Compares what both find. Rays that graze an edge may see another surface: at most one in a thousand.
fn assert_same_hits(name: &str, tables: &SceneTables, rays: &[Ray], found: &[Found]) {
    let tlas = cpu_structures(tables);
    let (mut hits, mut different) = (0, Vec::new());
    for (i, (ray, found)) in rays.iter().zip(found).enumerate() {
        let expected = tlas.closest(ray, &Holes(tables));
        hits += usize::from(!expected.is_miss());
        let same_place = (expected.instance, expected.primitive) == (found.instance, found.primitive);
        let close = |a: f32, b: f32| (a - b).abs() <= 2e-4 * a.abs().max(1.0);
        let same = match (expected.is_miss(), found.instance == u32::MAX) {
            (true, true) => found.occluded == 0,
            (false, false) => {
                let close =
                    close(expected.t, found.t) && close(expected.u, found.u) && close(expected.v, found.v);
                same_place && close && found.occluded == 1
            }
            _ => false,
        };
        if !same {
            different.push((i, expected, *found));
        } else if found.instance != u32::MAX {
            assert_record(tables, found);
        }
    }
    assert!(hits * 5 > rays.len(), "{name}: only {hits} of {} rays hit anything", rays.len());
    let allowed = rays.len() / 1000;
    assert!(
        different.len() <= allowed,
        "{name}: {} of {} differ: {:?}",
        different.len(),
        rays.len(),
        &different[..1]
    );
}

/// What the record of the shader binding table said is what the tables say of the place.
fn assert_record(tables: &SceneTables, found: &Found) {
    let instance = &tables.instances[found.instance as usize];
    let binding = &tables.bindings[(instance.first_binding + found.geometry) as usize];
    assert_eq!(found.material, binding.material, "{found:?}");
    let class = MaterialClass::of(&tables.materials[binding.material as usize]);
    assert_eq!(found.material_class, class as u32, "{found:?}");
    let blas = &tables.blas[instance.blas as usize];
    let geometry = &tables.geometries[(blas.first_geometry + found.geometry) as usize];
    let range = geometry.first_in_blas..geometry.first_in_blas + geometry.primitive_count;
    assert!(range.contains(&found.primitive), "{found:?}");
}

#[test]
fn hits_are_those_of_the_cpu() {
    let Some(gpu) = open_for_pipelines("hits_are_those_of_the_cpu") else { return };
    for (name, scene) in [
        ("cornell", testkit::scenes::cornell()),
        ("spheres", testkit::scenes::spheres()),
        ("glass", testkit::scenes::glass()),
    ] {
        let tables = Arc::new(SceneTables::build(&scene));
        let rays = rays(&tables, 20_000);
        assert_same_hits(name, &tables, &rays, &traced(&gpu, &tables, &rays));
    }
}

/// Two meshes of several geometries, of triangles and of spheres, in many instances with all classes of materials and with
/// holes: a picture of the shader binding table's rule.
fn many_records() -> scene::Scene {
    use scene::{AlphaMode, Material, Mesh, Model, Part, Shape, shapes};
    let mut scene = scene::Scene::default();
    let hole = |alpha: f32| Material {
        base_color: glam::vec4(1.0, 1.0, 1.0, alpha),
        alpha_mode: AlphaMode::Mask(0.5),
        ..Material::default()
    };
    scene.materials = vec![
        Material::default(),
        Material { model: Model::Dielectric, ..Material::default() },
        Material { emission: glam::Vec3::ONE, ..Material::default() },
        hole(0.2),
        hole(0.9),
        Material { model: Model::Mirror, ..Material::default() },
    ];
    let triangles = |size: f32, at: f32| {
        let mesh = shapes::cuboid(glam::Vec3::splat(size), 0.0, 1);
        let moved = glam::Affine3A::from_translation(glam::vec3(at, 0.3 * at, 0.0));
        Shape::Triangles(shapes::transformed(mesh, &moved))
    };
    let spheres = |radius: f32, at: f32| {
        let sphere = |x: f32| scene::Sphere { center: glam::vec3(x, 0.4, -x), radius };
        Shape::Spheres(vec![sphere(at), sphere(at + 0.35), sphere(at - 0.35)])
    };
    let part = |shape, material| Part { shape, material };
    scene.meshes = vec![
        Mesh {
            name: "boxes".into(),
            parts: vec![
                part(triangles(0.5, -0.6), 0),
                part(triangles(0.3, 0.0), 1),
                part(triangles(0.4, 0.6), 2),
                part(triangles(1.9, 0.0), 3),
            ],
        },
        Mesh {
            name: "mixed".into(),
            parts: vec![
                part(spheres(0.2, 0.5), 5),
                part(triangles(0.4, 0.2), 4),
                part(spheres(0.15, -0.5), 1),
                part(spheres(0.1, 0.0), 2),
            ],
        },
    ];
    let overrides: [Option<Vec<u32>>; 5] =
        [None, Some(vec![2, 0, 5, 3]), Some(vec![4, 4, 3, 3]), None, Some(vec![1, 3, 0, 4])];
    for (i, materials) in overrides.into_iter().cycle().take(40).enumerate() {
        let place = glam::vec3((i % 5) as f32 * 2.5, (i / 5 % 4) as f32 * 2.5, (i / 20) as f32 * 2.5);
        let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, i as f32, 0.7 * i as f32, 0.2);
        let scale = glam::vec3(1.0, 0.6 + 0.1 * (i % 7) as f32, if i % 3 == 0 { -1.0 } else { 1.0 });
        let transform = glam::Affine3A::from_scale_rotation_translation(scale, turn, place);
        let instance = scene::Instance::new(format!("{i}"), (i % 2) as u32, transform);
        scene.instances.push(scene::Instance { materials, ..instance });
    }
    scene
}

/// The real table on the real device: each ray comes back with the data of the record that the formula names.
#[test]
fn rays_find_the_records_of_what_they_hit() {
    let Some(gpu) = open_for_pipelines("rays_find_the_records_of_what_they_hit") else { return };
    let tables = Arc::new(SceneTables::build(&many_records()));
    assert!(tables.has_alpha);
    let rays = rays(&tables, 20_000);
    let found = traced(&gpu, &tables, &rays);
    assert_same_hits("many records", &tables, &rays, &found);
    let met: std::collections::HashSet<_> =
        found.iter().filter(|f| f.instance != u32::MAX).map(|f| (f.instance, f.geometry)).collect();
    let holes = tables.bindings.iter().filter(|b| b.material == 3).count();
    assert!(
        met.len() * 10 >= (tables.bindings.len() - holes) * 7,
        "{} of {}",
        met.len(),
        tables.bindings.len()
    );
}

/// Instances that move are met where they are.
#[test]
fn moved_instances_are_met_where_they_are() {
    let Some(gpu) = open_for_pipelines("moved_instances_are_met_where_they_are") else { return };
    let mut scene = many_records();
    let before = Arc::new(SceneTables::build(&scene));
    let uploaded = GpuScene::upload(&gpu, before.clone()).expect("upload");
    let tracing = PipelineTracing::build(&gpu, &uploaded).expect("structures");
    for (i, instance) in scene.instances.iter_mut().enumerate() {
        let motion = glam::Affine3A::from_rotation_y(0.3 * i as f32);
        instance.transform *= motion;
    }
    let after = Arc::new(SceneTables::build(&scene));
    assert_eq!(HitTable::new(&after), tracing.table, "nothing else has changed");
    tracing.structures.move_instances(&after, &tracing.table.instance_offsets).expect("moved");
    let moved = GpuScene::upload(&gpu, after.clone()).expect("upload");
    let rays = rays(&after, 10_000);
    assert_same_hits("moved", &after, &rays, &traced_through(&gpu, &tracing, &moved, &rays));
}

#[test]
#[should_panic(expected = "differ")]
fn a_wrong_hit_is_noticed() {
    let tables = SceneTables::build(&testkit::scenes::cornell());
    let rays = rays(&tables, 2000);
    let wrong = Found { t: 1.0, instance: 0, geometry: 0, occluded: 1, ..Found::default() };
    assert_same_hits("wrong", &tables, &rays, &vec![wrong; rays.len()]);
}

/// Primitives that are none are not met, and nobody minds them: not even the driver.
#[test]
fn broken_primitives_are_left_out() {
    let Some(gpu) = open_for_pipelines("broken_primitives_are_left_out") else { return };
    let mut scene = testkit::scenes::cornell();
    let sphere = |center: glam::Vec3, radius| scene::Sphere { center, radius };
    let spheres = vec![
        sphere(glam::Vec3::NAN, 1.0),
        sphere(glam::Vec3::splat(2.78), f32::NAN),
        sphere(glam::Vec3::splat(2.78), -1.0),
        sphere(glam::vec3(2.78, f32::INFINITY, 2.78), 1.0),
        sphere(glam::Vec3::splat(2.78), 0.5),
    ];
    let material = scene.instances.len() as u32 % scene.materials.len() as u32;
    scene.meshes.push(scene::Mesh::single("spheres", scene::Shape::Spheres(spheres), material));
    let mesh = scene.meshes.len() as u32 - 1;
    scene.instances.push(scene::Instance::new("spheres", mesh, glam::Affine3A::IDENTITY));
    let mut tables = SceneTables::build(&scene);
    // Around the room, and inside it.
    tables.bounding_sphere = [2.78, 2.78, 2.78, 4.8];
    let tables = Arc::new(tables);
    let rays = rays(&tables, 4000);
    assert_same_hits("broken", &tables, &rays, &traced(&gpu, &tables, &rays));
}

#[test]
fn an_empty_scene_is_all_misses() {
    let Some(gpu) = open_for_pipelines("an_empty_scene_is_all_misses") else { return };
    let tables = Arc::new(SceneTables::build(&scene::Scene::default()));
    let rays = vec![Ray::new([0.0; 3], [0.0, 0.0, 1.0]); 64];
    for found in traced(&gpu, &tables, &rays) {
        assert_eq!((found.instance, found.occluded), (u32::MAX, 0));
    }
}

/// A device with ray tracing pipelines, opened without ray queries: they must not be needed.
fn open_for_pipelines(test: &str) -> Option<testkit::Exclusive<Gpu>> {
    let features = wgpu::Features::all() - wgpu::Features::EXPERIMENTAL_RAY_QUERY;
    let gpu = open_for_test(test, &GpuOptions { features, ..GpuOptions::default() })?;
    match crate::tracer::TracerKind::Pipeline.check(&gpu) {
        Ok(()) => Some(gpu),
        Err(error) => {
            testkit::skip_without_gpu(test, &error.to_string());
            None
        }
    }
}
