//! Scattering of many plain vertices at once.
//!
//! Most vertices of most pictures are on diffuse surfaces. They are collected until a vector register is full, and then
//! random numbers, light sample (`lane_lights`), BSDF sample and the next ray are computed by loops over the lanes. The loops call the
//! same optics functions as everything else; they have no branches left after inlining, so the compiler turns each
//! into vector instructions of the instruction set that the kernel is compiled for.

use crate::path::{PAIR_FILM, PAIR_LENS, SampleId, sampler_kind};
use crate::queue::Path;
use backend::{PathSettings, View};
use optics::camera::{CameraFrame, camera_ray};
use optics::dielectric::{dielectric_bsdf, smooth_dielectric_sample};
use optics::frame::{frame_from_normal, to_local, to_world};
use optics::offset::offset_ray_origin;
use optics::path::{PathState, roulette_survival};
use optics::random::{
    PixelSampler, SAMPLER_BLUE_NOISE, SAMPLER_INDEPENDENT, SAMPLER_SOBOL, sample_2d, sampler_new,
};
use optics::vector::dot;
use optics::warp::{pdf_cosine_hemisphere, sample_cosine_hemisphere};
use optics::{Vec2f, Vec3f, vec2f, vec3f};

/// Vertices that are scattered together: single-precision numbers in the widest vector register.
pub(crate) const LANES: usize = 16;

/// One number for each lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Lanes<T>(pub [T; LANES]);

impl<T: Copy + Default> Default for Lanes<T> {
    fn default() -> Self {
        Self([T::default(); LANES])
    }
}

/// One vector for each lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Vectors {
    x: Lanes<f32>,
    y: Lanes<f32>,
    z: Lanes<f32>,
}

impl Vectors {
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3f {
        vec3f(self.x.0[lane], self.y.0[lane], self.z.0[lane])
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3f) {
        self.x.0[lane] = v.x;
        self.y.0[lane] = v.y;
        self.z.0[lane] = v.z;
    }
}

/// Two numbers for each lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pairs {
    pub x: Lanes<f32>,
    pub y: Lanes<f32>,
}

impl Pairs {
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec2f {
        vec2f(self.x.0[lane], self.y.0[lane])
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec2f) {
        self.x.0[lane] = v.x;
        self.y.0[lane] = v.y;
    }
}

/// Random numbers of one dimension pair for all lanes.
#[inline(always)]
pub(crate) fn draw(kind: u32, scramble: &Lanes<u32>, index: &Lanes<u32>, pair: u32, out: &mut Pairs) {
    // With the kind known the lanes have no branches.
    match kind {
        SAMPLER_SOBOL => draw_by(SAMPLER_SOBOL, scramble, index, pair, out),
        SAMPLER_BLUE_NOISE => draw_by(SAMPLER_BLUE_NOISE, scramble, index, pair, out),
        _ => draw_by(SAMPLER_INDEPENDENT, scramble, index, pair, out),
    }
}

#[inline(always)]
fn draw_by(kind: u32, scramble: &Lanes<u32>, index: &Lanes<u32>, pair: u32, out: &mut Pairs) {
    for lane in 0..LANES {
        let sampler = PixelSampler { kind, scramble: scramble.0[lane], index: index.0[lane] };
        out.set(lane, sample_2d(sampler, pair));
    }
}

/// Camera rays.
#[derive(Default)]
pub(crate) struct CameraLanes {
    x: Lanes<u32>,
    y: Lanes<u32>,
    /// See [`PixelSampler`].
    pub scramble: Lanes<u32>,
    /// See [`PixelSampler`].
    pub index: Lanes<u32>,
    jitter: Pairs,
    lens: Pairs,
    /// Where the rays start.
    pub origin: Vectors,
    /// Their unit directions.
    pub direction: Vectors,
}

impl CameraLanes {
    /// The rays of at most sixteen samples.
    #[inline(always)]
    pub fn compute(&mut self, view: &View, camera: CameraFrame, samples: &[SampleId]) {
        for (lane, sample) in samples.iter().enumerate() {
            self.x.0[lane] = sample.x;
            self.y.0[lane] = sample.y;
            self.index.0[lane] = sample.index;
        }
        let kind = sampler_kind(view);
        match kind {
            SAMPLER_SOBOL => self.begin(SAMPLER_SOBOL, view),
            SAMPLER_BLUE_NOISE => self.begin(SAMPLER_BLUE_NOISE, view),
            _ => self.begin(SAMPLER_INDEPENDENT, view),
        }
        draw(kind, &self.scramble, &self.index, PAIR_FILM, &mut self.jitter);
        if camera.lens_radius > 0.0 {
            draw(kind, &self.scramble, &self.index, PAIR_LENS, &mut self.lens);
        }
        let size = vec2f(view.width as f32, view.height as f32);
        for lane in 0..LANES {
            let jitter = self.jitter.get(lane);
            let (x, y) = (self.x.0[lane] as f32, self.y.0[lane] as f32);
            let film = vec2f((x + jitter.x) / size.x, (y + jitter.y) / size.y);
            let ray = camera_ray(camera, film, self.lens.get(lane));
            self.origin.set(lane, ray.origin);
            self.direction.set(lane, ray.direction);
        }
    }

    /// Where each lane's random numbers begin.
    #[inline(always)]
    fn begin(&mut self, kind: u32, view: &View) {
        for lane in 0..LANES {
            let (x, y) = (self.x.0[lane], self.y.0[lane]);
            let sampler = sampler_new(kind, x, y, view.width, self.index.0[lane], view.seed);
            self.scramble.0[lane] = sampler.scramble;
            self.index.0[lane] = sampler.index;
        }
    }
}

/// What vertices on plain surfaces need to go on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Vertices {
    /// World position.
    pub position: Vectors,
    /// See [`PlainPoint::extent`].
    pub extent: Lanes<f32>,
    /// Unit geometric normal on the side of the viewer.
    pub normal: Vectors,
    /// Unit shading normal on that side.
    pub shading_normal: Vectors,
    /// Albedo or tint.
    pub color: Vectors,
    /// Unit direction back along the path.
    pub wo: Vectors,
    /// See [`PlainPoint::eta`].
    pub eta: Lanes<f32>,
    /// Throughput of the path up to here.
    pub throughput: Vectors,
    /// See [`PixelSampler`].
    pub scramble: Lanes<u32>,
    /// See [`PixelSampler`].
    pub index: Lanes<u32>,
    /// See [`PathState::eta_scale`].
    pub eta_scale: Lanes<f32>,
    /// See [`Path::slot`].
    pub slot: Lanes<u32>,
    /// See [`Path::length`].
    pub length: Lanes<f32>,
    /// See [`Path::receiver`]; only where lights are chosen by place.
    pub receiver: Lanes<u32>,
}

/// A point on a plain surface.
pub(crate) struct PlainPoint {
    /// World position.
    pub position: Vec3f,
    /// Largest magnitude of a coordinate of the primitive.
    pub extent: f32,
    /// Unit geometric normal on the side of the viewer.
    pub normal: Vec3f,
    /// Unit shading normal on that side.
    pub shading_normal: Vec3f,
    /// Albedo or tint.
    pub color: Vec3f,
    /// Unit direction back along the path.
    pub wo: Vec3f,
    /// Index of refraction of the far side over that of the side of `wo`.
    pub eta: f32,
}

impl Vertices {
    /// Puts a point into a lane.
    #[inline(always)]
    pub fn set_point(&mut self, lane: usize, point: &PlainPoint) {
        self.position.set(lane, point.position);
        self.extent.0[lane] = point.extent;
        self.normal.set(lane, point.normal);
        self.shading_normal.set(lane, point.shading_normal);
        self.color.set(lane, point.color);
        self.wo.set(lane, point.wo);
        self.eta.0[lane] = point.eta;
    }

    /// Puts a path into a lane.
    #[inline(always)]
    pub fn set_path(&mut self, lane: usize, path: &Path) {
        self.throughput.set(lane, path.throughput);
        self.scramble.0[lane] = path.scramble;
        self.index.0[lane] = path.index;
        self.eta_scale.0[lane] = path.eta_scale;
        self.slot.0[lane] = path.slot;
        self.length.0[lane] = path.length;
    }
}

/// Continuations of paths.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NextLanes {
    /// Where the next ray starts.
    pub origin: Vectors,
    /// Its unit direction.
    pub wi: Vectors,
    /// See [`Path::pdf`].
    pub pdf: Lanes<f32>,
    /// Throughput of the path up to the next vertex.
    pub throughput: Vectors,
    /// See [`PathState::eta_scale`].
    pub eta_scale: Lanes<f32>,
    /// Whether the path goes on: the direction is on the right side of the geometric surface, and roulette lets it live.
    pub alive: Lanes<u32>,
}

/// Samples the cosine lobe of every lane.
#[inline(always)]
pub(crate) fn sample_cosine_lobes(v: &Vertices, u: &Pairs, out: &mut NextLanes) {
    for lane in 0..LANES {
        let normal = v.normal.get(lane);
        let local = sample_cosine_hemisphere(u.get(lane));
        let wi = to_world(frame_from_normal(v.shading_normal.get(lane)), local);
        out.wi.set(lane, wi);
        out.pdf.0[lane] = pdf_cosine_hemisphere(local.z);
        out.alive.0[lane] = u32::from(local.z > 0.0 && dot(wi, normal) > 0.0);
        out.origin.set(lane, offset_ray_origin(v.position.get(lane), normal, v.extent.0[lane]));
        // Value times cosine over density of a cosine lobe.
        out.throughput.set(lane, v.throughput.get(lane) * v.color.get(lane));
        out.eta_scale.0[lane] = v.eta_scale.0[lane];
    }
}

/// Chooses between reflection and refraction in every lane, by the first of two random numbers.
#[inline(always)]
pub(crate) fn sample_smooth_interfaces(v: &Vertices, u: &Pairs, out: &mut NextLanes) {
    for lane in 0..LANES {
        let (normal, eta) = (v.normal.get(lane), v.eta.0[lane]);
        let frame = frame_from_normal(v.shading_normal.get(lane));
        let bsdf = dielectric_bsdf(v.color.get(lane), 0.0, eta, false, 1.0);
        let sample = smooth_dielectric_sample(bsdf, to_local(frame, v.wo.get(lane)), u.x.0[lane]);
        let wi = to_world(frame, sample.wi);
        let above = dot(wi, normal) > 0.0;
        let side = if above { 1.0 } else { -1.0 };
        out.wi.set(lane, wi);
        out.pdf.0[lane] = -1.0;
        out.alive.0[lane] = u32::from(above != sample.transmitted);
        out.origin.set(lane, offset_ray_origin(v.position.get(lane), normal * side, v.extent.0[lane]));
        out.throughput.set(lane, v.throughput.get(lane) * sample.weight);
        out.eta_scale.0[lane] = v.eta_scale.0[lane] * if sample.transmitted { eta * eta } else { 1.0 };
    }
}

/// Lets Russian roulette decide in every lane, by the second of two random numbers. `depth`: of the vertices.
#[inline(always)]
pub(crate) fn play_roulette(u: &Pairs, depth: u32, settings: &PathSettings, out: &mut NextLanes) {
    for lane in 0..LANES {
        let state = PathState {
            throughput: out.throughput.get(lane),
            radiance: vec3f(0.0, 0.0, 0.0),
            pdf: out.pdf.0[lane],
            specular: false,
            eta_scale: out.eta_scale.0[lane],
            depth: depth + 1,
        };
        let survival = roulette_survival(state, settings.roulette_start, settings.roulette_min_survival);
        out.alive.0[lane] &= u32::from(u.get(lane).y < survival);
        out.throughput.set(lane, state.throughput * (1.0 / survival));
    }
}
