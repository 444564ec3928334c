//! Speed of rays alone on this machine's GPU: `cargo run --release -p gpu --example rays [MESH | FILE.mesh]...`.
//!
//! Meshes are `mesh250k` and `mesh2m`, dented spheres in a closed room, or files of the format that `cargo bench -p accel`
//! reads. Kinds of rays are those of that benchmark:
//!
//! - primary: the pixel centres of a camera of 1920×1080
//! - samples: 64 random points of each pixel of every 32nd row, in the path tracer's order: those of a pixel are neighbours
//! - packets: the same, asked as rays of which neighbours go nearly the same way
//! - bounce: one cosine-distributed ray from each primary hit
//! - shadow: one to a random point of a square light under the ceiling from each primary hit, any hit will do
//! - shuffled: the bounce rays in random order
//!
//! Every tracer that the device has answers each list as one dispatch, again and again; the time is the device's own, median
//! and range of 30 dispatches after others that nobody counts. All hits are compared with the scalar twin's.
//! Prints a table, then the same as one JSON object a line.

#![allow(clippy::disallowed_methods, reason = "no picture is compared with another platform's")]

use accel::encode::{EncodedScene, TraversalCounts};
use accel::{Quality, Ray};
use glam::Vec3;
use gpu::rays::{RayBuffers, RayHit, RayQuestion};
use gpu::timing::Timer;
use gpu::tracer::{Instances, TracerKind, bvh};
use gpu::{Gpu, GpuOptions, GpuScene};
use scene::Scene;
use scene::tables::SceneTables;
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};
use testkit::Random;
use testkit::scenes::{Build, blobs_in_a_room, lambert};

/// Dispatches that count.
const RUNS: usize = 30;

/// A chip takes a while until it runs at full speed.
const WARM_UP: Duration = Duration::from_millis(300);

fn main() -> Result<(), Box<dyn Error>> {
    let mut meshes: Vec<String> = std::env::args().skip(1).collect();
    if meshes.is_empty() {
        meshes.push("mesh2m".into());
    }
    let small = std::env::var_os("ALHAZEN_SMALL").is_some(); // to try the program on a software driver
    let size = if small { [192, 108] } else { [1920, 1080] };
    let mut json = Vec::new();
    for mesh in &meshes {
        let scene = match mesh.as_str() {
            "mesh250k" => blobs_in_a_room(6, 3),
            "mesh2m" => blobs_in_a_room(7, 6),
            file => from_file(file)?,
        };
        let tables = Arc::new(SceneTables::build(&scene));
        let twin = bvh::encode(&tables, Quality::Balanced);
        let sets = ray_sets(&tables, &twin, size);
        for kind in TracerKind::ALL {
            let gpu = Gpu::open(&GpuOptions::default())?;
            if kind.check(&gpu).is_err() {
                continue;
            }
            println!("{mesh}, {}, {}", kind.name(), gpu.describe());
            for set in &sets {
                let speed = measure(&gpu, kind, &tables, set, if small { 1 } else { RUNS })?;
                println!("{:10} {speed}", set.name);
                json.push(speed.json(mesh, kind, set, &gpu));
            }
        }
    }
    json.iter().for_each(|line| println!("{line}"));
    Ok(())
}

/// A mesh: little-endian u32 vertices, u32 triangles, f32 xyz each, u32 ijk each.
fn from_file(path: &str) -> Result<Scene, Box<dyn Error>> {
    let bytes = std::fs::read(path).map_err(|e| format!("cannot read {path}: {e}"))?;
    let words: Vec<u32> =
        bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let [vertices, triangles, rest @ ..] = &words[..] else {
        return Err(format!("{path} is no mesh").into());
    };
    let (vertices, triangles) = (*vertices as usize, *triangles as usize);
    if rest.len() != 3 * (vertices + triangles) {
        return Err(format!("{path} is no mesh of {vertices} vertices and {triangles} triangles").into());
    }
    let (positions, indices) = rest.split_at(3 * vertices);
    let mut scene = blobs_in_a_room(0, 0);
    scene.meshes.clear();
    scene.instances.clear();
    let grey = scene.add_material(lambert("grey", [0.6; 3]));
    let mesh = scene::TriangleMesh {
        positions: positions
            .chunks_exact(3)
            .map(|p| Vec3::from([p[0], p[1], p[2]].map(f32::from_bits)))
            .collect(),
        indices: indices.chunks_exact(3).map(|i| [i[0], i[1], i[2]]).collect(),
        ..Default::default()
    };
    scene.add_mesh(path, mesh, grey);
    Ok(scene)
}

/// Rays of a kind, and what the twin says that they hit: distances, infinite for a miss.
struct RaySet {
    name: &'static str,
    question: RayQuestion,
    rays: Vec<Ray>,
    /// Rays in a row of what a dispatch takes in squares of eight by eight.
    width: u32,
    expected: Vec<f32>,
}

impl RaySet {
    fn new(
        name: &'static str,
        question: RayQuestion,
        twin: &EncodedScene,
        rays: Vec<Ray>,
        width: u32,
    ) -> Self {
        let trace = |ray: &Ray| {
            let mut counts = TraversalCounts::default();
            match question {
                RayQuestion::Closest | RayQuestion::ClosestPacket => {
                    twin.closest(ray, |_| true, &mut counts).map_or(f32::INFINITY, |h| h.t)
                }
                RayQuestion::Any if twin.any(ray, |_| true, &mut counts) => 0.0,
                RayQuestion::Any => f32::INFINITY,
            }
        };
        let expected = in_parallel(&rays, trace);
        Self { name, question, rays, width, expected }
    }

    /// How many hits are not those of the twin, up to rounding.
    fn wrong(&self, hits: &[RayHit]) -> usize {
        let differs = |(&e, h): (&f32, &RayHit)| match self.question {
            _ if e.is_infinite() || h.is_miss() => e.is_finite() == h.is_miss(),
            RayQuestion::Closest | RayQuestion::ClosestPacket => (e - h.t).abs() > 1e-4 * (1.0 + e),
            RayQuestion::Any => false,
        };
        self.expected.iter().zip(hits).filter(|&pair| differs(pair)).count()
            + self.rays.len().abs_diff(hits.len())
    }
}

fn in_parallel<T: Sync, U: Send>(items: &[T], f: impl Fn(&T) -> U + Sync) -> Vec<U> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let f = &f;
    std::thread::scope(|scope| {
        let parts: Vec<_> = items
            .chunks(items.len().div_ceil(threads).max(1))
            .map(|part| scope.spawn(move || part.iter().map(f).collect::<Vec<U>>()))
            .collect();
        parts.into_iter().flat_map(|part| part.join().expect("a thread panicked")).collect()
    })
}

/// All kinds of rays.
fn ray_sets(tables: &SceneTables, twin: &EncodedScene, [width, height]: [u32; 2]) -> Vec<RaySet> {
    let eye = Vec3::new(0.0, 2.4, 4.6);
    let forward = (Vec3::new(0.0, 1.0, 0.0) - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let half = [1.0 * width as f32 / height as f32, 1.0].map(|s: f32| s * 30f32.to_radians().tan());
    let ray_at = |x: f32, y: f32| {
        let (x, y) = (x / width as f32 * 2.0 - 1.0, 1.0 - y / height as f32 * 2.0);
        Ray::new(eye.into(), (forward + right * (x * half[0]) + up * (y * half[1])).normalize().into())
    };
    let centre = |i: u32| ray_at((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
    let primary: Vec<Ray> = (0..width * height).map(centre).collect();
    let mut random = Random::new(7);
    let in_pixel = |x: u32, y: u32| ray_at(x as f32 + random.uniform_f32(), y as f32 + random.uniform_f32());
    let samples = samples_of_pixels([width, height], in_pixel);
    let normals = in_parallel(&primary, |ray| {
        twin.closest(ray, |_| true, &mut TraversalCounts::default()).map(|hit| {
            let normal = normal_of(tables, hit.geometry, hit.primitive);
            let normal = if normal.dot(ray.direction.into()) > 0.0 { -normal } else { normal };
            (Vec3::from(ray.origin) + Vec3::from(ray.direction) * hit.t + normal * 1e-4, normal)
        })
    });
    let mut random = Random::new(42);
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    for (origin, normal) in normals.into_iter().flatten() {
        let mut uniform = || random.uniform_f32();
        let (u, phi) = (uniform(), uniform() * std::f32::consts::TAU);
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let flat = tangent * phi.cos() + bitangent * phi.sin();
        let direction = flat * u.sqrt() + normal * (1.0 - u).max(0.0).sqrt();
        bounce.push(Ray::new(origin.into(), direction.normalize().into()));
        let light = Vec3::new(uniform() * 2.0 - 1.0, 4.99, uniform() * 2.0 - 1.0);
        shadow.push(Ray { t_max: 0.999, ..Ray::new(origin.into(), (light - origin).into()) });
    }
    let mut shuffled = bounce.clone();
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, random.bits() as usize % (i + 1));
    }
    let set = |name, question, rays, width| RaySet::new(name, question, twin, rays, width);
    vec![
        set("primary", RayQuestion::Closest, primary, width),
        set("samples", RayQuestion::Closest, samples.clone(), IN_ORDER),
        set("packets", RayQuestion::ClosestPacket, samples, IN_ORDER),
        set("bounce", RayQuestion::Closest, bounce, width),
        set("shadow", RayQuestion::Any, shadow, width),
        set("shuffled", RayQuestion::Closest, shuffled, width),
    ]
}

/// Rows so short that a square of them is 64 rays in order.
const IN_ORDER: u32 = 8;

/// 64 rays through each pixel of every 32nd row.
fn samples_of_pixels([width, height]: [u32; 2], mut ray: impl FnMut(u32, u32) -> Ray) -> Vec<Ray> {
    let pixels = (0..height).step_by(32).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels.flat_map(|pixel| std::iter::repeat_n(pixel, 64)).map(|(x, y)| ray(x, y)).collect()
}

/// The unit normal of a triangle of the first structure, which holds all that never moves.
fn normal_of(tables: &SceneTables, geometry: u32, primitive: u32) -> Vec3 {
    let g = &tables.geometries[(tables.blas[0].first_geometry + geometry) as usize];
    let triangle = tables.indices[(g.first_primitive + primitive - g.first_in_blas) as usize];
    let [a, b, c] = triangle.map(|i| Vec3::from(tables.positions[(g.first_vertex + i) as usize]));
    (b - a).cross(c - a).normalize()
}

/// Millions of rays a second.
struct Speed {
    median: f64,
    slowest: f64,
    fastest: f64,
    wrong: usize,
}

impl std::fmt::Display for Speed {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Speed { median, slowest, fastest, wrong } = self;
        write!(f, "{median:8.1} Mrays/s ({slowest:.1} to {fastest:.1}), {wrong} hits differ from the twin's")
    }
}

impl Speed {
    fn json(&self, mesh: &str, kind: TracerKind, set: &RaySet, gpu: &Gpu) -> String {
        let Speed { median, slowest, fastest, wrong } = self;
        let (tracer, rays, count, device) = (kind.name(), set.name, set.rays.len(), gpu.describe());
        format!(
            r#"{{"mesh":{mesh:?},"device":{device:?},"tracer":"{tracer}","rays":"{rays}","count":{count},"mrays_per_second":{median:.2},"slowest":{slowest:.2},"fastest":{fastest:.2},"wrong":{wrong}}}"#
        )
    }
}

fn measure(
    gpu: &Gpu,
    kind: TracerKind,
    tables: &Arc<SceneTables>,
    set: &RaySet,
    runs: usize,
) -> Result<Speed, Box<dyn Error>> {
    let scene = GpuScene::upload(gpu, tables.clone())?;
    let tracing = kind.build(gpu, &scene, Instances::StandStill)?;
    let list = RayBuffers::new(gpu, &set.rays, set.width)?;
    let mut kernel = tracing.ray_kernel(gpu, set.question, &scene)?;
    let mut timer = Timer::new(gpu)?;
    let start = Instant::now();
    while runs > 1 && start.elapsed() < WARM_UP {
        (0..10).try_for_each(|_| kernel.submit(gpu, &list, &mut timer))?;
        timer.collect(gpu)?;
    }
    timer.take();
    (0..runs).try_for_each(|_| kernel.submit(gpu, &list, &mut timer))?;
    timer.collect(gpu)?;
    let mut times: Vec<f64> = timer.take().iter().map(|pass| pass.duration.as_secs_f64()).collect();
    times.sort_by(f64::total_cmp);
    let rate = |at: usize| times.get(at).map_or(f64::NAN, |t| set.rays.len() as f64 / t * 1e-6);
    let (median, slowest, fastest) = (rate(times.len() / 2), rate(times.len().saturating_sub(1)), rate(0));
    Ok(Speed { median, slowest, fastest, wrong: set.wrong(&list.read_hits(gpu)?) })
}
