//! Sixteen of everything: numbers and vectors by lane, random numbers, camera rays.
//!
//! What is done for one vertex of a path is done for sixteen by loops over lanes. The loops call the same optics functions as
//! everything else; they have no branches left after inlining, so the compiler turns each into vector instructions of the
//! instruction set that the kernel is compiled for. Few things need [`crate::simd`].

use crate::batch::samples::{SampleId, sampler_kind};
use backend::View;
use optics::camera::{CameraFrame, camera_ray};
use optics::random::{
    PixelSampler, SAMPLER_BLUE_NOISE, SAMPLER_INDEPENDENT, SAMPLER_SOBOL, sample_2d, sampler_new,
};
use optics::vertex::{PAIR_FILM, PAIR_LENS};
use optics::{Vec2f, Vec3f, vec2f, vec3f};

/// Vertices that are scattered together: single-precision numbers in the widest vector register.
pub(crate) const LANES: usize = 16;

/// All lanes, as bits.
pub(crate) const ALL_LANES: u32 = (1 << LANES) - 1;

/// As many lanes, as bits, but not more than there are.
#[inline(always)]
pub(crate) fn first_lanes(count: usize) -> u32 {
    ALL_LANES >> (LANES - count.min(LANES))
}

/// One number for each lane, of which there may be twice as many as are used.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Lanes<T, const N: usize = LANES>(pub [T; N]);

impl<T: Copy + Default, const N: usize> Default for Lanes<T, N> {
    fn default() -> Self {
        Self([T::default(); N])
    }
}

/// One vector for each lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Vectors<const N: usize = LANES> {
    pub x: Lanes<f32, N>,
    pub y: Lanes<f32, N>,
    pub z: Lanes<f32, N>,
}

impl<const N: usize> Vectors<N> {
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

/// Random numbers of one dimension pair for sixteen lanes.
#[inline(always)]
pub(crate) fn draw<const N: usize>(
    kind: u32,
    scramble: &Lanes<u32, N>,
    index: &Lanes<u32, N>,
    pair: u32,
    out: &mut Pairs,
) {
    // With the kind known the lanes have no branches.
    match kind {
        SAMPLER_SOBOL => draw_by(SAMPLER_SOBOL, scramble, index, pair, out),
        SAMPLER_BLUE_NOISE => draw_by(SAMPLER_BLUE_NOISE, scramble, index, pair, out),
        _ => draw_by(SAMPLER_INDEPENDENT, scramble, index, pair, out),
    }
}

#[inline(always)]
fn draw_by<const N: usize>(
    kind: u32,
    scramble: &Lanes<u32, N>,
    index: &Lanes<u32, N>,
    pair: u32,
    out: &mut Pairs,
) {
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
    /// Share of their light that reaches the film.
    pub weight: Lanes<f32>,
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
            self.weight.0[lane] = ray.weight;
        }
    }

    /// Makes the ray of a lane anew, as it leaves a camera that moves at `time`.
    pub fn leave_at(&mut self, view: &View, lane: usize, time: f32) {
        let (scramble, index) = (self.scramble.0[lane], self.index.0[lane]);
        let sampler = PixelSampler { kind: sampler_kind(view), scramble, index };
        let jitter = self.jitter.get(lane);
        let film = vec2f(
            (self.x.0[lane] as f32 + jitter.x) / view.width as f32,
            (self.y.0[lane] as f32 + jitter.y) / view.height as f32,
        );
        let ray = camera_ray(view.camera_at(time), film, sample_2d(sampler, PAIR_LENS));
        self.origin.set(lane, ray.origin);
        self.direction.set(lane, ray.direction);
        self.weight.0[lane] = ray.weight;
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
