//! Build and query speed. Run with `cargo bench -p accel`, optionally with words that the printed
//! names must contain.
//!
//! With the environment variable `ALHAZEN_RAY_SETS` naming a folder, its `mesh250k` and `mesh2m`
//! (`.mesh`, and the `.rays` and `.hits` of the sets primary, bounce, shuffled and shadow) are
//! measured, and hits compared. Without it, a procedural mesh of 250k triangles and rays of the
//! same kinds made from it stand in. All files are little-endian:
//!
//! - `.mesh`: u32 vertices, u32 triangles, f32 xyz each, u32 ijk each
//! - `.rays`: per ray 8 f32: origin, t_min, direction, t_max
//! - `.hits`: per ray f32 t (-1: miss), u32 triangle; for shadow rays, 1 is occluded and 0 free
//!
//! Each figure is the best and the median of several runs; compare ratios of runs that were made in
//! turns.

#![allow(clippy::disallowed_methods, reason = "no picture is compared with another platform's")]

#[path = "../tests/support/mod.rs"]
mod support;

use accel::{Blas, Coherence, Geometry, Hit, Instance, InstructionSet, MISS, Opaque, Quality, Ray, Tlas};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use support::{Mesh, Rng};

/// As in the front ends.
#[global_allocator]
static ALLOCATOR: accel::HugePages = accel::HugePages;

const REPEAT: usize = 7;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let bench = Bench { words };
    eprintln!("kernels: {:?}", InstructionSet::available());
    if bench.wants_mesh("cornell") {
        cornell(&bench);
    }
    match std::env::var_os("ALHAZEN_RAY_SETS") {
        Some(folder) => {
            for name in ["mesh250k", "mesh2m"].into_iter().filter(|name| bench.wants_mesh(name)) {
                from_files(&bench, Path::new(&folder), name);
            }
        }
        None if bench.words.iter().any(|w| w == "cornell") => {}
        None => {
            eprintln!("ALHAZEN_RAY_SETS is not set: measuring a procedural mesh instead");
            let mesh = Mesh::blob(354);
            let sets = procedural_sets(&mesh);
            measure(&bench, "blob250k", &mesh, &sets);
        }
    }
}

struct Bench {
    words: Vec<String>,
}

impl Bench {
    /// A word that names a mesh excludes the others.
    fn wants_mesh(&self, name: &str) -> bool {
        !self.words.iter().any(|w| w.starts_with("mesh") || w.starts_with("cornell"))
            || self.words.iter().any(|w| w == name)
    }

    /// Runs `f` several times on `threads` threads and prints the speed of `count` things a run.
    fn run(&self, name: &str, count: usize, unit: &str, threads: usize, mut f: impl FnMut() + Send) {
        let name = format!("{name} threads={threads}");
        if !self.words.iter().all(|w| name.contains(w.as_str())) {
            return;
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let (mut times, mut cpu_times) = (Vec::new(), Vec::new());
        pool.install(|| {
            f();
            for _ in 0..REPEAT {
                let (start, cpu) = (Instant::now(), cpu_seconds());
                f();
                times.push(start.elapsed().as_secs_f64());
                cpu_times.push(cpu_seconds() - cpu);
            }
        });
        times.sort_by(f64::total_cmp);
        cpu_times.sort_by(f64::total_cmp);
        let rate = |t: f64| count as f64 / t * 1e-6;
        let (best, median, cpu) = (rate(times[0]), rate(times[REPEAT / 2]), rate(cpu_times[0]));
        println!("{name}: best {best:.2} median {median:.2} {unit}, best per cpu-second {cpu:.2}");
    }
}

/// Processor time of all threads so far; other programs do not count. Zero where the system does
/// not tell.
fn cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let nanoseconds = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() * 1e-9
}

/// A set of rays and the hits to expect of them, where known.
struct Set {
    name: &'static str,
    rays: Vec<Ray>,
    expected: Option<Vec<(f32, u32)>>,
}

const SETS: [&str; 4] = ["primary", "bounce", "shuffled", "shadow"];

fn words_of(path: &Path) -> Vec<u32> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("cannot read {}: {e}", path.display()));
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn from_files(bench: &Bench, folder: &Path, name: &str) {
    let data = words_of(&folder.join(format!("{name}.mesh")));
    let (positions, indices) = data[2..].split_at(3 * data[0] as usize);
    let mesh = Mesh {
        positions: positions.chunks_exact(3).map(|p| [p[0], p[1], p[2]].map(f32::from_bits)).collect(),
        indices: indices.chunks_exact(3).map(|i| [i[0], i[1], i[2]]).collect(),
    };
    let sets = SETS.map(|set| {
        let rays = words_of(&folder.join(format!("{name}.{set}.rays")));
        let rays = rays.chunks_exact(8).map(|w| ray_from(std::array::from_fn(|i| f32::from_bits(w[i]))));
        let hits = words_of(&folder.join(format!("{name}.{set}.hits")));
        let hits = hits.chunks_exact(2).map(|w| (f32::from_bits(w[0]), w[1])).collect();
        Set { name: set, rays: rays.collect(), expected: Some(hits) }
    });
    measure(bench, name, &mesh, &sets);
}

fn ray_from([ox, oy, oz, t_min, dx, dy, dz, t_max]: [f32; 8]) -> Ray {
    Ray { origin: [ox, oy, oz], t_min, direction: [dx, dy, dz], t_max }
}

/// Rays of the same kinds as in the files: from a camera, from what it sees in random directions,
/// and to a light.
fn procedural_sets(mesh: &Mesh) -> [Set; 4] {
    let tlas = tlas_of(mesh, Quality::Balanced);
    let mut primary = support::camera_rays(512, [0.0, 0.0, 2.5], 1.6);
    primary.retain(|r| !tlas.closest(r, &Opaque).is_miss());
    let mut rng = Rng::new(42);
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    for r in &primary {
        let hit = tlas.closest(r, &Opaque);
        let p = [0, 1, 2].map(|a: usize| r.origin[a] + r.direction[a] * hit.t * 0.9999);
        let n = p.map(|x| -x); // inwards: all rays stay in the closed mesh
        let inside = [0, 1, 2].map(|a: usize| r.origin[a] + r.direction[a] * hit.t * 1.0001);
        bounce.push(Ray::new(inside, [0, 1, 2].map(|a: usize| n[a] + rng.signed())));
        shadow.push(Ray {
            t_max: 0.999,
            ..Ray::new(p, [0, 1, 2].map(|a: usize| [1.0, 5.0, 1.0][a] * rng.signed() - p[a]))
        });
    }
    let mut shuffled = bounce.clone();
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, rng.next() as usize % (i + 1));
    }
    let sets = [primary, bounce, shuffled, shadow];
    let mut names = SETS.iter();
    sets.map(|rays| Set { name: names.next().expect("four sets"), rays, expected: None })
}

fn tlas_of(mesh: &Mesh, quality: Quality) -> Tlas {
    let blas = Blas::triangles(&[mesh.geometry(0)], quality);
    Tlas::build(&[Instance::identity(0)], vec![Arc::new(blas)])
}

/// Calls `f` with parts of the rays and of the results, on all threads.
fn in_parts<T: Send>(rays: &[Ray], results: &mut [T], f: impl Fn(&[Ray], &mut [T]) + Sync) {
    use rayon::prelude::*;
    rays.par_chunks(4096).zip(results.par_chunks_mut(4096)).for_each(|(r, h)| f(r, h));
}

fn measure(bench: &Bench, name: &str, mesh: &Mesh, sets: &[Set]) {
    let triangles = mesh.indices.len();
    for quality in [Quality::Fast, Quality::Balanced, Quality::High] {
        for threads in [1, 2] {
            bench.run(&format!("build {name} {quality:?}"), triangles, "Mtris/s", threads, || {
                let geometry = Geometry { positions: &mesh.positions, indices: &mesh.indices, first_id: 0 };
                std::hint::black_box(Blas::triangles(&[geometry], quality));
            });
        }
    }
    for quality in [Quality::Balanced, Quality::High, Quality::Fast] {
        let named = |q: Quality| bench.words.iter().any(|w| *w == format!("{q:?}"));
        if [Quality::Fast, Quality::Balanced, Quality::High].into_iter().any(named) && !named(quality) {
            continue;
        }
        if !bench.words.is_empty() && bench.words.iter().any(|w| w == "build") {
            continue;
        }
        let mut tlas = tlas_of(mesh, quality);
        let bytes = tlas.memory_bytes() as f64;
        println!(
            "memory {name} {quality:?}: {:.1} MB = {:.1} bytes a triangle",
            bytes * 1e-6,
            bytes / triangles as f64
        );
        for isa in InstructionSet::available() {
            tlas.set_instruction_set(isa);
            for set in sets {
                for threads in [1, 2] {
                    query(bench, &format!("{name} {quality:?} {isa:?}"), &tlas, set, threads);
                }
            }
        }
    }
}

fn query(bench: &Bench, name: &str, tlas: &Tlas, set: &Set, threads: usize) {
    let n = set.rays.len();
    let name = format!("query {name} {}", set.name);
    if set.name == "shadow" {
        let mut any = vec![false; n];
        bench.run(&format!("{name} any"), n, "Mrays/s", threads, || {
            in_parts(&set.rays, &mut any, |rays, any| {
                for (r, a) in rays.iter().zip(any) {
                    *a = tlas.any(r, &Opaque);
                }
            });
        });
        let differ = set.expected.iter().flatten().zip(&any).filter(|(e, a)| (e.1 != 0) != **a).count();
        report(bench, differ, n, &any.iter().any(|&a| a));
        for (coherence, word) in [(Coherence::Incoherent, ""), (Coherence::Coherent, " coherent")] {
            bench.run(&format!("{name} any_stream{word}"), n, "Mrays/s", threads, || {
                in_parts(&set.rays, &mut any, |rays, any| tlas.any_stream(rays, any, &Opaque, coherence));
            });
            let differ = set.expected.iter().flatten().zip(&any).filter(|(e, a)| (e.1 != 0) != **a).count();
            report(bench, differ, n, &any.iter().any(|&a| a));
        }
        return;
    }
    let mut hits = vec![MISS; n];
    let wrong = |hits: &[Hit]| {
        let close = |e: f32, h: &Hit| if e < 0.0 { h.is_miss() } else { (e - h.t).abs() <= 1e-4 * (1.0 + e) };
        set.expected.iter().flatten().zip(hits).filter(|(e, h)| !close(e.0, h)).count()
    };
    bench.run(&format!("{name} closest"), n, "Mrays/s", threads, || {
        in_parts(&set.rays, &mut hits, |rays, hits| {
            for (r, h) in rays.iter().zip(hits) {
                *h = tlas.closest(r, &Opaque);
            }
        });
    });
    report(bench, wrong(&hits), n, &hits.iter().any(|h| !h.is_miss()));
    let coherence = if set.name == "primary" { Coherence::Coherent } else { Coherence::Incoherent };
    bench.run(&format!("{name} closest_stream"), n, "Mrays/s", threads, || {
        in_parts(&set.rays, &mut hits, |rays, hits| tlas.closest_stream(rays, hits, &Opaque, coherence));
    });
    report(bench, wrong(&hits), n, &hits.iter().any(|h| !h.is_miss()));
}

/// Says how many results differ from those expected, if the bench ran at all.
fn report(_: &Bench, differ: usize, n: usize, ran: &bool) {
    if *ran && differ > 0 {
        println!("    {differ} of {n} differ");
    }
}

/// The scene that everyone renders: 38 triangles.
fn cornell(bench: &Bench) {
    let mut mesh = Mesh::default();
    let mut quad = |p: [[f32; 3]; 4]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(p);
        mesh.indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    let mut cuboid = |center: [f32; 3], half: [f32; 3], angle: f32, polygons: &[usize]| {
        let (sin, cos) = angle.sin_cos();
        for &polygon in polygons {
            let (axis, sign) = (polygon / 2, if polygon % 2 == 0 { -1.0 } else { 1.0 });
            quad([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[s, t]| {
                let mut q = [0.0; 3];
                q[axis] = sign * half[axis];
                q[(axis + 1) % 3] = s * half[(axis + 1) % 3];
                q[(axis + 2) % 3] = t * half[(axis + 2) % 3];
                [center[0] + cos * q[0] + sin * q[2], center[1] + q[1], center[2] - sin * q[0] + cos * q[2]]
            }));
        }
    };
    cuboid([0.0; 3], [1.0; 3], 0.0, &[0, 1, 2, 3, 4]);
    cuboid([0.0, 0.98, 0.0], [0.25, 0.005, 0.25], 0.0, &[2, 3]);
    cuboid([-0.35, -0.4, -0.3], [0.3, 0.6, 0.3], 0.3, &[0, 1, 2, 3, 4, 5]);
    cuboid([0.35, -0.7, 0.3], [0.3, 0.3, 0.3], -0.3, &[0, 1, 2, 3, 4, 5]);
    let primary = support::camera_rays(512, [0.0, 0.0, 3.9], 1.4);
    let tlas = tlas_of(&mesh, Quality::Balanced);
    let mut rng = Rng::new(7);
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    for r in &primary {
        let hit = tlas.closest(r, &Opaque);
        if !hit.is_miss() {
            let p = [0, 1, 2].map(|a: usize| r.origin[a] + r.direction[a] * hit.t * 0.9999);
            bounce.push(Ray::new(p, rng.point()));
            let light = [0.25 * rng.signed(), 0.97, 0.25 * rng.signed()];
            shadow.push(Ray { t_max: 0.999, ..Ray::new(p, [0, 1, 2].map(|a: usize| light[a] - p[a])) });
        }
    }
    let mut names = ["primary", "bounce", "shadow"].into_iter();
    let sets = [primary, bounce, shadow].map(|rays| Set {
        name: names.next().expect("three sets"),
        rays,
        expected: None,
    });
    let mut tlas = tlas;
    for isa in InstructionSet::available() {
        tlas.set_instruction_set(isa);
        for set in &sets {
            query(bench, &format!("cornell{} {isa:?}", mesh.indices.len()), &tlas, set, 1);
        }
    }
}
