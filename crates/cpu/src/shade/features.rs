//! What guides denoisers: the first surface on the way of a path that is neither mirror nor clear glass.
//!
//! The first hit of a sample is recorded for it, as for all layers. Where that shows a sharp picture of other things, what
//! is recorded is what the sample's path, which goes on from there anyway, comes upon. What shines there has the albedo
//! white: radiance is divided by albedo, and a lamp's black would make the brightest of all pixels of what a mirror shows.

use crate::fetch::surface::Surface;
use crate::shade::closures::surface_albedo;
use crate::shade::path_batch::{Context, PathBatch};
use optics::material::material_shines;
use optics::vertex::{is_last_segment, seen_albedo};
use optics::{Vec3f, vec3f};

const WHITE: Vec3f = vec3f(1.0, 1.0, 1.0);

/// How a path goes on from a surface, as far as it matters for what guides denoisers.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Continuation {
    /// With this throughput into what the surface shows a sharp picture of.
    Sharp(Vec3f),
    /// Not so, or not at all.
    Other,
}

impl PathBatch {
    /// Starts to look for what guides denoisers, for `samples` samples.
    pub(crate) fn begin_features(&mut self, samples: usize, branches: u32) {
        self.looking.clear();
        // The first branch of each path looks for all of them.
        self.looking.extend((0..samples * branches as usize).map(|slot| slot % branches as usize == 0));
    }

    /// Notes what guides denoisers where a path arrives that goes on in this way and still looks for that. `throughput`: of
    /// the path as it arrives.
    pub(crate) fn find_features(
        &mut self,
        context: &Context,
        slot: u32,
        throughput: Vec3f,
        surface: &Surface,
        footprint: f32,
        continuation: Continuation,
    ) {
        let Context { depth, branches, .. } = *context;
        let sample = &mut self.aovs[(slot / branches) as usize];
        // Nobody looks at where last segments end.
        let is_followed = !is_last_segment(depth + 1, context.settings.max_depth);
        if let Continuation::Sharp(throughput) = continuation
            && is_followed
        {
            // The sky, unless something is in the way.
            sample.denoising_albedo = seen_albedo(throughput, depth + 1, branches, WHITE).to_array();
            sample.denoising_normal = [0.0; 3];
            return;
        }
        self.looking[slot as usize] = false;
        let tables = &*context.scene.tables;
        let material = &tables.materials[surface.material as usize];
        let albedo = match depth > 1 && material_shines(*material) {
            true => WHITE,
            false => surface_albedo(tables, material, surface, footprint),
        };
        sample.denoising_albedo = seen_albedo(throughput, depth, branches, albedo).to_array();
        sample.denoising_normal = surface.shading_normal.to_array();
    }
}
