//! What paths find in the directions that they sample, for who learns from it.

use crate::shade::path_batch::PathBatch;
use guiding::{Found, Learner};
use optics::math::luminance;
use optics::{Vec3f, vec3f};

/// A direction that a path has sampled at a vertex, while it is being found out what it brings.
#[derive(Clone, Copy)]
pub(crate) struct Find {
    /// Where the path's light is summed.
    pub slot: u32,
    /// The vertex, metres.
    pub position: Vec3f,
    /// The unit direction, world space.
    pub wi: Vec3f,
    /// Densities over solid angle with which it was sampled, in all and by BSDF and guide alone.
    pub pdf: f32,
    pub bsdf_pdf: f32,
    pub guide_pdf: f32,
    /// Throughput from the camera to what is found, before roulette: who dies of it finds nothing, and others find more.
    pub throughput: Vec3f,
    /// What the path had gathered before it went that way.
    pub before: Vec3f,
}

/// The finds of a batch of paths.
#[derive(Default)]
pub(crate) struct Finds {
    list: Vec<Find>,
    /// Those whose `before` is known.
    noted: usize,
}

impl Finds {
    pub fn push(&mut self, find: Find) {
        self.list.push(find);
    }
}

impl PathBatch {
    /// Notes what paths have gathered up to the vertices that they have just left, light samples there included.
    pub(crate) fn note_finds(&mut self) {
        for find in &mut self.finds.list[self.finds.noted..] {
            find.before = self.radiance[find.slot as usize];
        }
        self.finds.noted = self.finds.list.len();
    }

    /// Tells what the batch's paths have found, all of which have ended.
    pub(crate) fn learn(&mut self, learner: &Learner) {
        for find in self.finds.list.drain(..) {
            let found = self.radiance[find.slot as usize] - find.before;
            let share = |found: f32, throughput: f32| if throughput > 0.0 { found / throughput } else { 0.0 };
            let radiance = vec3f(
                share(found.x, find.throughput.x),
                share(found.y, find.throughput.y),
                share(found.z, find.throughput.z),
            );
            learner.add(&Found {
                position: find.position,
                wi: find.wi,
                pdf: find.pdf,
                bsdf_pdf: find.bsdf_pdf,
                guide_pdf: find.guide_pdf,
                radiance: luminance(radiance),
                contribution: luminance(found),
            });
        }
        self.finds.noted = 0;
    }
}
