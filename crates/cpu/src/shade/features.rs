//! What guides denoisers: the first surface on the way of a path that is neither mirror nor clear glass.
//!
//! The first hit of a sample is recorded for it, as for all layers. Where that shows a sharp picture of other things, what
//! is recorded is what the sample's path, which goes on from there anyway, comes upon.

use crate::fetch::surface::Surface;
use crate::shade::closures::surface_albedo;
use crate::shade::path_batch::{Context, PathBatch};
use optics::Vec3f;
use optics::vertex::{is_last_segment, seen_albedo};

/// How a path goes on from a surface, as far as it matters for what guides denoisers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Continuation {
    /// Into what the surface shows a sharp picture of.
    Sharp,
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

    /// Notes what guides denoisers where a path arrives that goes on in this way, if it still looks for that. `throughput`: of the
    /// path as it arrives.
    pub(crate) fn find_features(
        &mut self,
        context: &Context,
        slot: u32,
        throughput: Vec3f,
        surface: &Surface,
        footprint: f32,
        continuation: Continuation,
    ) {
        let sample = &mut self.aovs[(slot / context.branches) as usize];
        // Nobody looks at where last segments end.
        let is_followed = !is_last_segment(context.depth + 1, context.settings.max_depth);
        if continuation == Continuation::Sharp && is_followed {
            (sample.denoising_albedo, sample.denoising_normal) = ([0.0; 3], [0.0; 3]);
            return;
        }
        self.looking[slot as usize] = false;
        let tables = &*context.scene.tables;
        let albedo = surface_albedo(tables, &tables.materials[surface.material as usize], surface, footprint);
        let seen = seen_albedo(throughput, context.depth, context.branches, albedo);
        (sample.denoising_albedo, sample.denoising_normal) =
            (seen.to_array(), surface.shading_normal.to_array());
    }
}
