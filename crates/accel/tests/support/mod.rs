//! Random scenes, and the answer of a loop over all primitives.
#![allow(dead_code, reason = "each test uses some of this")]

use accel::{Blas, Candidate, Hit, HitFilter, Instance, InstructionSet, MISS, Ray, Sphere, Tlas};
use optics::intersect::{intersect_sphere, intersect_triangle, ray_shear};
use wgsl_rs::std::vec3f;

/// A small random number generator (PCG32).
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Rng {
        let mut rng = Rng(seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407));
        rng.next();
        rng
    }

    pub fn next(&mut self) -> u32 {
        let old = self.0;
        self.0 = old.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((((old >> 18) ^ old) >> 27) as u32).rotate_right((old >> 59) as u32)
    }

    /// Uniform in `[-1, 1)`.
    pub fn signed(&mut self) -> f32 {
        (self.next() >> 8) as f32 * (2.0 / 16777216.0) - 1.0
    }

    pub fn point(&mut self) -> [f32; 3] {
        [self.signed(), self.signed(), self.signed()]
    }
}

/// `full` tests of an ordinary run, few of them under Miri.
pub fn amount(full: usize) -> usize {
    if cfg!(miri) { full.div_ceil(50).min(20) } else { full }
}

/// A triangle list.
#[derive(Clone, Default)]
pub struct Mesh {
    pub positions: Vec<[f32; 3]>,
    pub indices: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn soup(rng: &mut Rng, count: usize, size: f32) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..count as u32 {
            let c = rng.point();
            for _ in 0..3 {
                let d = rng.point();
                mesh.positions.push([0, 1, 2].map(|a: usize| c[a] + d[a] * size));
            }
            mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        mesh
    }

    /// A closed, bumpy sphere of `2 n (n - 1)` triangles.
    pub fn blob(n: u32) -> Mesh {
        let mut mesh = Mesh::default();
        let (tau, n2) = (std::f32::consts::TAU, n);
        mesh.positions.push([0.0, 1.0, 0.0]);
        for row in 1..n {
            for column in 0..n2 {
                let (theta, phi) = (row as f32 / n as f32 * tau / 2.0, column as f32 / n2 as f32 * tau);
                let r = 1.0 + 0.2 * (5.0 * theta).sin() * (3.0 * phi).cos();
                mesh.positions.push([
                    r * theta.sin() * phi.cos(),
                    r * theta.cos(),
                    r * theta.sin() * phi.sin(),
                ]);
            }
        }
        mesh.positions.push([0.0, -1.0, 0.0]);
        let at = |row: u32, column: u32| 1 + (row - 1) * n2 + column % n2;
        let last = mesh.positions.len() as u32 - 1;
        for c in 0..n2 {
            mesh.indices.push([0, at(1, c + 1), at(1, c)]);
            mesh.indices.push([last, at(n - 1, c), at(n - 1, c + 1)]);
            for row in 1..n - 1 {
                mesh.indices.push([at(row, c), at(row, c + 1), at(row + 1, c)]);
                mesh.indices.push([at(row, c + 1), at(row + 1, c + 1), at(row + 1, c)]);
            }
        }
        mesh
    }

    pub fn geometry(&self, first_id: u32) -> accel::Geometry<'_> {
        accel::Geometry { positions: &self.positions, indices: &self.indices, first_id }
    }

    pub fn corners(&self, triangle: usize) -> [[f32; 3]; 3] {
        self.indices[triangle].map(|i| self.positions[i as usize])
    }
}

/// What can be hit, with ids, in world space.
#[derive(Clone, Default)]
pub struct Everything {
    pub triangles: Vec<(u32, u32, [[f32; 3]; 3])>,
    pub spheres: Vec<(u32, u32, Sphere)>,
}

impl Everything {
    pub fn add_mesh(&mut self, instance: u32, first_id: u32, mesh: &Mesh, m: &[[f32; 4]; 3]) {
        for i in 0..mesh.indices.len() {
            self.triangles.push((instance, first_id + i as u32, mesh.corners(i).map(|p| transform(m, p))));
        }
    }

    /// All hits on the ray's line between its ends that the filter accepts.
    pub fn hits<F: HitFilter>(&self, ray: &Ray, filter: &F) -> Vec<Hit> {
        let v = |a: [f32; 3]| vec3f(a[0], a[1], a[2]);
        let (o, shear, t_min) = (v(ray.origin), ray_shear(v(ray.direction)), ray.t_min.max(0.0));
        let mut hits = Vec::new();
        for &(instance, primitive, [a, b, c]) in &self.triangles {
            let h = intersect_triangle(o, shear, v(a), v(b), v(c), t_min, ray.t_max);
            let (direction, outward) = (ray.direction, [0.0; 3]);
            let candidate = Candidate { instance, primitive, u: h.u, v: h.v, direction, outward };
            if h.hit && filter.accept(&candidate) {
                hits.push(Hit { t: h.t, u: h.u, v: h.v, primitive, instance });
            }
        }
        for &(instance, primitive, s) in &self.spheres {
            let h = intersect_sphere(o, v(ray.direction), v(s.center), s.radius);
            for t in [h.near, h.far] {
                let outward = ((o + v(ray.direction) * t - v(s.center)) * (1.0 / s.radius)).to_array();
                let direction = ray.direction;
                let candidate = Candidate { instance, primitive, u: 0.0, v: 0.0, direction, outward };
                if h.hit && t > t_min && t < ray.t_max && filter.accept(&candidate) {
                    hits.push(Hit { t, u: 0.0, v: 0.0, primitive, instance });
                }
            }
        }
        hits
    }

    pub fn closest<F: HitFilter>(&self, ray: &Ray, filter: &F) -> Hit {
        self.hits(ray, filter).into_iter().min_by(|a, b| a.t.total_cmp(&b.t)).unwrap_or(MISS)
    }
}

pub fn transform(m: &[[f32; 4]; 3], p: [f32; 3]) -> [f32; 3] {
    m.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3])
}

/// Whether `actual` is the nearest hit, or one at the same distance up to rounding. Grazing hits
/// within rounding of an edge may differ: the caller counts how often this is false.
pub fn same_hit(expected: &Hit, actual: &Hit) -> bool {
    if expected.is_miss() || actual.is_miss() {
        return expected.is_miss() && actual.is_miss();
    }
    let close = (expected.t - actual.t).abs() <= 1e-4 * expected.t.abs().max(1e-3);
    let same = (expected.primitive, expected.instance) == (actual.primitive, actual.instance);
    close && (!same || ((expected.u - actual.u).abs() < 1e-2 && (expected.v - actual.v).abs() < 1e-2))
}

/// Compares every instruction set with the loop over everything.
pub fn check<F: HitFilter>(tlas: &mut Tlas, all: &Everything, rays: &[Ray], filter: &F) {
    let expected: Vec<Hit> = rays.iter().map(|r| all.closest(r, filter)).collect();
    for isa in InstructionSet::available() {
        tlas.set_instruction_set(isa);
        check_one(tlas, all, rays, &expected, filter);
    }
}

fn check_one<F: HitFilter>(tlas: &Tlas, all: &Everything, rays: &[Ray], expected: &[Hit], filter: &F) {
    let isa = tlas.instruction_set();
    let mut differ = 0;
    for (ray, e) in rays.iter().zip(expected) {
        let hit = tlas.closest(ray, filter);
        assert!(!hit.t.is_nan() && !hit.u.is_nan() && !hit.v.is_nan(), "{isa:?}: {hit:?}");
        if !same_hit(e, &hit) {
            differ += 1;
        }
        if tlas.any(ray, filter) == hit.is_miss() {
            differ += 1;
        }
    }
    // Rays that graze an edge may see it or not; nothing else may differ.
    assert!(differ * 1000 <= rays.len(), "{isa:?}: {differ} of {} rays differ", rays.len());
    for coherence in [accel::Coherence::Incoherent, accel::Coherence::Coherent] {
        let mut hits = vec![MISS; rays.len()];
        tlas.closest_stream(rays, &mut hits[..], filter, coherence);
        let differ = hits.iter().zip(expected).filter(|(h, e)| !same_hit(e, h)).count();
        assert!(differ * 1000 <= rays.len(), "{isa:?} {coherence:?}: {differ} of {} rays differ", rays.len());
        let mut any = vec![false; rays.len()];
        tlas.any_stream(rays, &mut any, filter, coherence);
        let differ = any.iter().zip(expected).filter(|&(&a, e)| a == e.is_miss()).count();
        assert!(
            differ * 1000 <= rays.len(),
            "{isa:?} {coherence:?} any: {differ} of {} rays differ",
            rays.len()
        );
    }
    let _ = all;
}

/// Rays from random points to random points, some of them short.
pub fn random_rays(rng: &mut Rng, count: usize, spread: f32) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let (o, to) = (rng.point().map(|x| x * spread), rng.point());
            let mut ray = Ray::new(o, [0, 1, 2].map(|a: usize| to[a] - o[a]));
            if i % 5 == 0 {
                ray.t_min = 0.1;
                ray.t_max = 0.9;
            }
            if i % 7 == 0 {
                ray.direction[i % 3] = 0.0;
            }
            ray
        })
        .collect()
}

/// A camera's rays, `n × n`, row by row.
pub fn camera_rays(n: usize, eye: [f32; 3], half_width: f32) -> Vec<Ray> {
    let at = |i: usize| (i as f32 + 0.5) / n as f32 * 2.0 - 1.0;
    (0..n * n)
        .map(|i| {
            let target = [at(i % n) * half_width, -at(i / n) * half_width, 0.0];
            Ray::new(eye, [0, 1, 2].map(|a: usize| target[a] - eye[a]))
        })
        .collect()
}

/// One object, as it is.
pub fn alone(blas: Blas) -> Tlas {
    Tlas::build(&[Instance::identity(0)], vec![blas.into()])
}
