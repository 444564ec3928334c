//! The walk on a device against its scalar twin and against the CPU's own traversal; layouts.

use super::*;
use crate::layout::{constant, layout_of};
use crate::shader::{Linkage, Variant, check};
use crate::{GpuOptions, LimitCaps, open_for_test};
use accel::encode::{EncodedInstance, INSTANCE_IDENTITY, INSTANCE_SPHERES, OWNER_SPHERE, TraversalCounts};
use accel::{Blas, Hit, Opaque, Ray, Tlas};
use bytemuck::Zeroable;
use std::mem::offset_of;
use testkit::Random;

#[test]
fn pages_cover_all_records() {
    for (records, size, limit, expected) in [
        (0, 48, 1 << 27, Pages { shift: 21, count: 1 }),
        (2_097_152, 48, 1 << 27, Pages { shift: 21, count: 1 }),
        (2_097_153, 48, 1 << 27, Pages { shift: 21, count: 2 }),
        (100, 80, 1000, Pages { shift: 3, count: 13 }),
    ] {
        let pages = Pages::new(records, size, limit);
        assert_eq!(pages, expected);
        assert!((1u64 << pages.shift) * size as u64 <= limit);
        assert!(u64::from(pages.count) << pages.shift >= records as u64);
    }
}

#[test]
fn layouts_match_the_shader() {
    let module = check::module("bvh_records");
    let expect = |name: &str, fields: &[(&str, usize)], size: usize| {
        let fields = fields.iter().map(|&(name, offset)| (name.to_owned(), offset)).collect();
        assert_eq!(layout_of(&module, name), (fields, size), "{name}");
    };
    expect(
        "BvhNode",
        &[
            ("grid", offset_of!(EncodedNode, origin)),
            ("links", offset_of!(EncodedNode, first_child)),
            ("planes", offset_of!(EncodedNode, planes)),
        ],
        size_of::<EncodedNode>(),
    );
    // What the shader takes from the words by hand.
    assert_eq!(offset_of!(EncodedNode, exponents), 12);
    assert_eq!(offset_of!(EncodedNode, inner), 15);
    assert_eq!(offset_of!(EncodedNode, first_primitive), 20);
    assert_eq!(offset_of!(EncodedNode, meta), 24);
    expect(
        "BvhPrimitive",
        &[
            ("a", offset_of!(EncodedPrimitive, a)),
            ("b", offset_of!(EncodedPrimitive, b)),
            ("c", offset_of!(EncodedPrimitive, c)),
        ],
        size_of::<EncodedPrimitive>(),
    );
    assert_eq!(offset_of!(EncodedPrimitive, primitive), 12);
    assert_eq!(offset_of!(EncodedPrimitive, geometry), 28);
    assert_eq!(offset_of!(EncodedPrimitive, owner), 44);
    use EncodedInstance as BvhInstance;
    crate::layout::assert_layout!(
        module,
        BvhInstance { world_to_object, extent, root, index, flags, unused }
    );
    assert_eq!(constant(&module, "BVH_INSTANCE_IDENTITY"), INSTANCE_IDENTITY);
    assert_eq!(constant(&module, "BVH_INSTANCE_SPHERES"), INSTANCE_SPHERES);
    assert_eq!(constant(&module, "BVH_OWNER_SPHERE"), OWNER_SPHERE);
}

/// A hit, as the test's shader writes it.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, Zeroable)]
#[repr(C)]
struct Found {
    t: f32,
    u: f32,
    v: f32,
    instance: u32,
    geometry: u32,
    primitive: u32,
    any: u32,
    padding: u32,
}

const KERNEL: &str = "
#import tracer
struct Found { hit: Hit, any: u32, padding: u32 }
@group(2) @binding(0) var<storage, read> rays: array<vec4f>;
@group(2) @binding(1) var<storage, read_write> found: array<Found>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&found) { return; }
    let o = rays[2u * id.x];
    let d = rays[2u * id.x + 1u];
    let any = trace_any(o.xyz, d.xyz, o.w, d.w, 0u);
    found[id.x] = Found(trace_closest(o.xyz, d.xyz, o.w, d.w, 0u), select(0u, 1u, any), 0u);
}
";

/// As [`KERNEL`], for packets. Those of any hit are not asked: a hit that is found says yes.
const KERNEL_PACKETS: &str = "
#import tracer_bvh_packets
struct Found { hit: Hit, any: u32, padding: u32 }
@group(2) @binding(0) var<storage, read> rays: array<vec4f>;
@group(2) @binding(1) var<storage, read_write> found: array<Found>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let wanted = id.x < arrayLength(&found);
    let index = select(0u, id.x, wanted);
    let o = rays[2u * index];
    let d = rays[2u * index + 1u];
    let hit = trace_closest_packet(o.xyz, d.xyz, o.w, d.w, 0u, wanted);
    if wanted {
        found[index] = Found(hit, select(0u, 1u, hit.instance != NONE), 0u);
    }
}
";

/// The text of a kernel.
fn linked(tracer: &Linkage, kernel: &'static str) -> String {
    Linkage::of(Variant::default()).with(tracer).generate("test", kernel).text("test").expect("linked")
}

/// Traces rays on the device, each alone.
fn trace(gpu: &Gpu, tables: &SceneTables, encoded: &EncodedScene, rays: &[Ray]) -> Vec<Found> {
    let tracer = BvhTracer::upload(gpu, encoded.clone()).expect("upload");
    // Holes are not there for the traversals that this is compared with.
    let text = linked(&tracer.linkage(), KERNEL);
    trace_with(gpu, tables, &tracer, &text, rays)
}

/// Traces rays with a shader.
fn trace_with(gpu: &Gpu, tables: &SceneTables, tracer: &BvhTracer, text: &str, rays: &[Ray]) -> Vec<Found> {
    let scene = GpuScene::upload(gpu, std::sync::Arc::new(tables.clone())).expect("upload");
    let words: Vec<[f32; 8]> = rays
        .iter()
        .map(|r| {
            let ([ox, oy, oz], [dx, dy, dz]) = (r.origin, r.direction);
            [ox, oy, oz, r.t_min, dx, dy, dz, r.t_max.min(f32::MAX)]
        })
        .collect();
    let input = storage_buffer(gpu, "rays", &words, BufferUsages::empty()).expect("buffer");
    let output = storage_buffer(gpu, "hits", &vec![Found::zeroed(); rays.len()], BufferUsages::COPY_SRC);
    let output = output.expect("buffer");
    let read_only = |binding, read_only| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[read_only(0, true), read_only(1, false)],
    });
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
        ],
    });
    let pipeline =
        gpu.compute_pipeline("test", text, &[&scene.layout, tracer.layout(), &layout]).expect("shader");
    let staging = crate::scene::upload::empty_buffer(
        gpu,
        "reading",
        output.size(),
        BufferUsages::MAP_READ | BufferUsages::COPY_DST,
    )
    .expect("buffer");
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &scene.bind_group, &[]);
    pass.set_bind_group(1, tracer.bind_group(), &[]);
    pass.set_bind_group(2, &group, &[]);
    pass.dispatch_workgroups(rays.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output, 0, &staging, 0, output.size());
    gpu.queue.submit([encoder.finish()]);
    crate::readback::read_mapped(gpu, &staging, staging.size(), "testing", |bytes| {
        bytemuck::pod_collect_to_vec(bytes)
    })
    .expect("hits")
}

/// Bundles of rays of a few sizes, from nearly one point to nearly another. Of some the origins lie apart as on a lens; some rays are
/// short, some no rays at all; some bundles are so wide that not all of their rays go the same way along each axis.
fn bundles(tables: &SceneTables, count: usize, seed: u64) -> Vec<Ray> {
    let around = rays(tables, count, seed);
    let mut random = Random::new(seed + 1);
    let (mut bundle, mut next, mut sizes) = (0, 0, [64, 7, 32, 100].into_iter().cycle());
    let radius = tables.bounding_sphere[3];
    (0..count)
        .map(|i| {
            if i == next {
                bundle = i;
                next += sizes.next().unwrap_or(count);
            }
            let Ray { origin, direction, .. } = around[bundle];
            let (lens, spread) = ([0.0, 0.01][i / 2000 % 2], [1e-3, 0.02, 0.5][i / 1000 % 3]);
            let mut near = |p: f32, by: f32| p + by * radius * (2.0 * random.uniform_f32() - 1.0);
            let mut ray = Ray::new(origin.map(|p| near(p, lens)), direction.map(|d| near(d, spread)));
            match i % 50 {
                3 => (ray.t_min, ray.t_max) = (0.3, 0.9),
                13 => ray.direction = [0.0; 3],
                23 => ray.origin[1] = f32::NAN,
                33 => (ray.t_min, ray.t_max) = (0.9, 0.3),
                _ => {}
            }
            ray
        })
        .collect()
}

/// The same scene for the CPU.
fn cpu_scene(tables: &SceneTables) -> Tlas {
    let blas = |b: &BlasRecord| match object(tables, b) {
        Object::Triangles(g) => Blas::triangles(&g, Quality::Balanced),
        Object::Spheres(g) => {
            let all: Vec<Sphere> = g.iter().flat_map(|g| g.spheres).copied().collect();
            Blas::spheres(&all, 0, Quality::Balanced)
        }
    };
    let instances: Vec<Instance> = tables.instances.iter().map(instance).collect();
    Tlas::build(&instances, tables.blas.iter().map(|b| blas(b).into()).collect())
}

/// Rays from around the scene into it, and from inside of it in all directions; some are short.
fn rays(tables: &SceneTables, count: usize, seed: u64) -> Vec<Ray> {
    let [x, y, z, r] = tables.bounding_sphere;
    let mut random = Random::new(seed);
    let mut point = |spread: f32| [x, y, z].map(|c| c + r * spread * (2.0 * random.uniform_f32() - 1.0));
    (0..count)
        .map(|i| {
            let (o, to) = (point(if i % 2 == 0 { 1.5 } else { 0.5 }), point(0.7));
            let mut ray = Ray::new(o, [0, 1, 2].map(|a: usize| to[a] - o[a]));
            if i % 5 == 0 {
                (ray.t_min, ray.t_max) = (0.1, 0.9);
            }
            ray
        })
        .collect()
}

/// Counts the rays whose hit is not the CPU's, up to rounding.
fn differences(found: &[Found], rays: &[Ray], expected: impl Fn(&Ray) -> Hit) -> usize {
    assert!(!rays.is_empty() && found.len() == rays.len(), "nothing to compare");
    let differs = |(f, ray): (&Found, &Ray)| {
        let e = expected(ray);
        if (f.instance == u32::MAX) == (f.any == 1) || e.is_miss() != (f.any == 0) {
            return true;
        }
        let same = (f.instance, f.primitive) == (e.instance, e.primitive);
        let near = |a: f32, b: f32, by: f32| (a - b).abs() <= by;
        !e.is_miss()
            && (!near(f.t, e.t, 1e-4 * e.t.max(1e-3))
                || (same && !(near(f.u, e.u, 1e-2) && near(f.v, e.v, 1e-2))))
    };
    found.iter().zip(rays).filter(|&pair| differs(pair)).count()
}

/// Meshes, spheres, instances of both.
fn scenes() -> Vec<(&'static str, SceneTables)> {
    let with_spheres = scene::builtin::load("three-spheres", &Default::default(), &Default::default())
        .expect("a scene")
        .scene;
    [
        ("cornell", testkit::scenes::cornell()),
        ("glass", testkit::scenes::glass()),
        ("spheres", testkit::scenes::spheres()),
        ("hairy", testkit::scenes::hairy(5, 2)),
        ("three-spheres", with_spheres),
    ]
    .map(|(name, scene)| (name, SceneTables::build(&scene)))
    .into()
}

#[test]
fn hits_are_those_of_the_cpu() {
    let Some(gpu) = open_for_test("hits_are_those_of_the_cpu", &GpuOptions::default()) else { return };
    let mut kinds = std::collections::BTreeSet::new();
    let moving =
        scenes().into_iter().map(|(name, tables)| (name, encode(&tables, Quality::Balanced), tables));
    let still = scenes()
        .into_iter()
        .map(|(name, tables)| (name, encode_still(&tables, Quality::Balanced, true), tables));
    let mut joined = std::collections::BTreeSet::new();
    for (name, encoded, tables) in moving.chain(still.filter(|(_, encoded, _)| encoded.is_flattened())) {
        let rays = rays(&tables, 20_000, 7);
        if encoded.is_flattened() {
            joined.insert((name, encoded.kinds()));
        }
        kinds.insert((encoded.is_single(), encoded.nodes.len() >= TURNS_FROM_NODES));
        let found = trace(&gpu, &tables, &encoded, &rays);
        let cpu = cpu_scene(&tables);
        let differ = differences(&found, &rays, |ray| cpu.closest(ray, &Opaque));
        // Rays that graze an edge may see it or not.
        assert!(differ * 2000 <= rays.len(), "{name}: {differ} of {} rays differ from the CPU's", rays.len());
        let mut counts = TraversalCounts::default();
        let twin = |ray: &Ray| match encoded.closest(ray, |_| true, &mut TraversalCounts::default()) {
            None => accel::MISS,
            Some(h) => Hit { t: h.t, u: h.u, v: h.v, primitive: h.primitive, instance: h.instance },
        };
        let differ = differences(&found, &rays, twin);
        assert!(
            differ * 2000 <= rays.len(),
            "{name}: {differ} of {} rays differ from the twin's",
            rays.len()
        );
        for (ray, found) in rays.iter().zip(&found) {
            let expected = encoded.closest(ray, |_| true, &mut counts);
            if let Some(e) =
                expected.filter(|e| (e.instance, e.primitive) == (found.instance, found.primitive))
            {
                assert_eq!(e.geometry, found.geometry, "{name}: {ray:?}");
            }
        }
    }
    assert_eq!(kinds.len(), 4, "one level and two, large and small: {kinds:?}");
    assert!(joined.contains(&("three-spheres", (true, true))), "both kinds in one tree: {joined:?}");
    assert!(joined.contains(&("hairy", (true, false))), "triangles of several instances: {joined:?}");
}

/// The walk must give the same through several pages.
#[test]
fn pages_change_nothing() {
    let caps = LimitCaps { storage_binding_bytes: 1 << 20, ..LimitCaps::default() };
    let options = GpuOptions { limits: Some(caps), ..GpuOptions::default() };
    let Some(small) = open_for_test("pages_change_nothing", &options) else { return };
    let large = Gpu::open(&GpuOptions::default()).expect("as the other one");
    let tables = SceneTables::build(&testkit::scenes::glass());
    let encoded = encode(&tables, Quality::Balanced);
    assert!(size_of_val(&encoded.primitives[..]) > 2 << 20, "one page would do");
    let rays = rays(&tables, 5000, 8);
    // The scene's own buffers are larger than the small device's: only the tracer's are on it.
    let empty = SceneTables::build(&scene::Scene::default());
    assert_eq!(trace(&small, &empty, &encoded, &rays), trace(&large, &empty, &encoded, &rays));
}

#[test]
fn too_many_pages_are_an_error() {
    let caps = LimitCaps { storage_binding_bytes: 1 << 12, ..LimitCaps::default() };
    let options = GpuOptions { limits: Some(caps), ..GpuOptions::default() };
    let Some(gpu) = open_for_test("too_many_pages_are_an_error", &options) else { return };
    let tables = SceneTables::build(&testkit::scenes::glass());
    let error = BvhTracer::upload(&gpu, encode(&tables, Quality::Balanced)).err().expect("too large");
    assert!(matches!(error, GpuError::Limit { limit: "storage buffers a shader", .. }), "{error}");
}

#[test]
#[should_panic(expected = "rays differ")]
fn a_lost_triangle_is_noticed() {
    let Some(gpu) = open_for_test("a_lost_triangle_is_noticed", &GpuOptions::default()) else {
        panic!("skipped; otherwise rays differ");
    };
    let tables = SceneTables::build(&testkit::scenes::cornell());
    let mut encoded = encode(&tables, Quality::Balanced);
    let lost = &mut encoded.primitives[3];
    lost.b = lost.a;
    let rays = rays(&tables, 5000, 9);
    let found = trace(&gpu, &tables, &encoded, &rays);
    let cpu = cpu_scene(&tables);
    let differ = differences(&found, &rays, |ray| cpu.closest(ray, &Opaque));
    assert!(differ * 2000 <= rays.len(), "{differ} of {} rays differ", rays.len());
}

/// Of how many bundles' rays the hit is another if they walk together. `change` may spoil the shader.
fn strays(test: &str, change: impl Fn(String) -> String) -> Option<usize> {
    let gpu = open_for_test(test, &GpuOptions::default())?;
    if beam_boxes(&gpu).is_none() {
        testkit::skip_without_gpu(test, "no subgroups of four");
        return None;
    }
    let scenes = scenes().into_iter().flat_map(|(name, tables)| {
        let still = encode_still(&tables, Quality::Balanced, true);
        let joined = still.is_flattened().then(|| (name, still, tables.clone()));
        [Some((name, encode(&tables, Quality::Balanced), tables)), joined].into_iter().flatten()
    });
    let mut strays = 0;
    for (name, encoded, tables) in scenes {
        let rays = bundles(&tables, 12_000, 11);
        let alone = trace(&gpu, &tables, &encoded, &rays);
        let hits = alone.iter().filter(|f| f.any == 1).count();
        assert!(hits * 5 > rays.len() && hits < rays.len(), "{name}: {hits} of {} hit", rays.len());
        let tracer = BvhTracer::upload(&gpu, encoded).expect("upload");
        let text = linked(&tracer.linkage_packets().expect("a device that can"), KERNEL_PACKETS);
        let packets = trace_with(&gpu, &tables, &tracer, &change(text), &rays);
        strays += alone.iter().zip(&packets).filter(|(a, b)| a != b).count();
    }
    Some(strays)
}

/// Bit by bit, but for rays that graze the edge of a box.
#[test]
fn packets_hit_what_their_rays_hit_alone() {
    let strays = strays("packets_hit_what_their_rays_hit_alone", |text| text);
    assert!(strays.is_none_or(|strays| strays <= 3), "{strays:?} rays differ");
}

/// A device that says nothing of subgroups is not asked for them.
#[test]
fn packets_need_subgroups() {
    let test = "packets_need_subgroups";
    for features in [Features::all(), Features::all() - Features::SUBGROUP] {
        let options = GpuOptions { features, ..GpuOptions::default() };
        let Some(gpu) = open_for_test(test, &options) else { return };
        let tables = SceneTables::build(&testkit::scenes::cornell());
        let tracer = BvhTracer::upload(&gpu, encode(&tables, Quality::Fast)).expect("upload");
        let offered = gpu.features.contains(Features::SUBGROUP);
        assert!(!offered || features == Features::all(), "masked");
        assert_eq!(tracer.linkage_packets().is_some(), offered && gpu.info.subgroup_min_size >= 4);
    }
}

/// Bundles are traced as packets: if they were not, nobody would miss the primitives that packets test.
#[test]
fn a_packet_that_tests_nothing_is_noticed() {
    let change = |text: String| {
        let spoilt = text.replace("bvh_test(primitives.x + bit, instance", "bvh_test(0u, instance");
        assert_ne!(text, spoilt);
        spoilt
    };
    let strays = strays("a_packet_that_tests_nothing_is_noticed", change);
    assert!(strays.is_none_or(|strays| strays > 10_000), "{strays:?} rays differ");
}
