//! What integrators share that make one sample after the other: camera rays, what they hit first,
//! questions about rays.

use crate::batch::samples::{SampleId, new_sampler, ray_time};
use crate::fetch::surface::Surface;
use crate::scene::CpuScene;
use crate::shade::aov::aov_sample;
use crate::shade::material::Shading;
use accel::{Hit, HitFilter, Ray};
use backend::View;
use film::AovSample;
use optics::camera::{camera_pixel_spread, camera_ray};
use optics::motion::MOTION_MIDDLE;
use optics::random::{PixelSampler, sample_2d};
use optics::vec2f;

/// Draws pairs of random numbers one after the other.
pub(crate) struct Draws {
    sampler: PixelSampler,
    next_pair: u32,
}

impl Draws {
    pub fn pair(&mut self) -> [f32; 2] {
        self.next_pair += 1;
        let u = sample_2d(self.sampler, self.next_pair - 1);
        [u.x, u.y]
    }
}

/// A surface that a camera ray hit first.
pub(crate) struct FirstHit {
    pub surface: Surface,
    /// Metres along the ray.
    pub distance: f32,
    /// Radius of the pixel's footprint there, metres.
    pub footprint: f32,
}

/// The rays of single samples; it counts them.
pub(crate) struct CameraRays<'a, F> {
    pub scene: &'a CpuScene,
    pub view: &'a View,
    pub filter: &'a F,
    pub shading: Shading,
    /// When the rays of the current sample leave, see [`ray_time`].
    pub time: f32,
    /// Rays traced so far.
    pub traced: u64,
}

impl<'a, F: HitFilter> CameraRays<'a, F> {
    pub fn new(scene: &'a CpuScene, view: &'a View, filter: &'a F) -> Self {
        let pixel_spread = camera_pixel_spread(view.camera, view.height as f32);
        let shading = Shading { single_scatter: view.single_scatter, pixel_spread };
        Self { scene, view, filter, shading, time: MOTION_MIDDLE, traced: 0 }
    }

    /// The camera ray of a sample, its random numbers, and the ray's weight.
    pub fn camera(&mut self, id: &SampleId) -> (Ray, Draws, f32) {
        let sampler = new_sampler(self.view, id);
        self.time = ray_time(self.view, sampler, id);
        let mut draws = Draws { sampler, next_pair: 0 };
        let (jitter, lens) = (draws.pair(), draws.pair());
        let film = vec2f(
            (id.x as f32 + jitter[0]) / self.view.width as f32,
            (id.y as f32 + jitter[1]) / self.view.height as f32,
        );
        let ray = camera_ray(self.view.camera_at(self.time), film, vec2f(lens[0], lens[1]));
        (Ray::new(ray.origin.to_array(), ray.direction.to_array()), draws, ray.weight)
    }

    /// What a camera ray hit, unless it missed.
    pub fn first_hit(&self, ray: &Ray, hit: &Hit) -> Option<FirstHit> {
        let footprint = self.shading.pixel_spread * hit.t;
        let of = |surface| FirstHit { surface, distance: hit.t, footprint };
        (!hit.is_miss()).then(|| of(Surface::new(self.scene, ray, hit, self.time)))
    }

    /// The auxiliary values of a first hit.
    pub fn aovs(&self, hit: &FirstHit) -> AovSample {
        let tables = &*self.scene.tables;
        let material = &tables.materials[hit.surface.material as usize];
        aov_sample(tables, material, &hit.surface, hit.distance, hit.footprint)
    }

    pub fn closest(&mut self, ray: &Ray) -> Hit {
        self.traced += 1;
        self.scene.tlas.closest_at(ray, self.time, self.filter)
    }

    pub fn visible(&mut self, ray: &Ray) -> bool {
        self.traced += 1;
        !self.scene.tlas.any_at(ray, self.time, self.filter)
    }
}
