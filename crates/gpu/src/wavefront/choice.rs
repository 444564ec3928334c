//! Which path kernel is the faster one.
//!
//! A rule from measurements (`docs/performance.md`, "Path tracing on a GPU"): the wavefront wins where neighbouring rays need
//! very different times, which is where there is glass, where rays enter instances, or where the hierarchy is deep, and only
//! with millions of paths in flight. It has been measured with our own hierarchy only.

use super::queues;
use crate::Gpu;
use crate::tracer::TracerKind;
use scene::tables::{ModelTag, SceneTables};

/// Unique triangles from which on a hierarchy counts as deep: between the largest scene measured that the megakernel wins
/// (0.25 million) and the smallest that the wavefront wins for this reason (2 million).
const MANY_TRIANGLES: usize = 1 << 20;

/// Paths in flight from which on the wavefront wins at all.
const ENOUGH_PATHS: u64 = 1 << 21;

/// Whether the wavefront is the faster one on this device for so many samples, all pixels together.
pub fn is_faster(gpu: &Gpu, kind: TracerKind, tables: &SceneTables, samples: u64) -> bool {
    let measured = kind == TracerKind::Bvh && !gpu.is_software();
    measured && queues::suitable_paths(gpu).min(samples) >= ENOUGH_PATHS && makes_rays_part(tables)
}

/// Whether neighbouring rays soon need very different times.
fn makes_rays_part(tables: &SceneTables) -> bool {
    let refracts = tables.materials.iter().any(|m| m.model == ModelTag::Dielectric || m.transmission > 0.0);
    // What never moves and is there once is one instance by itself.
    refracts || tables.instances.len() > 1 || tables.indices.len() >= MANY_TRIANGLES
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::scenes;

    #[test]
    fn glass_instances_and_many_triangles_make_rays_part() {
        let tables = [scenes::cornell(), scenes::spheres(), scenes::glass()].map(|s| SceneTables::build(&s));
        assert_eq!(tables.each_ref().map(makes_rays_part), [false, false, true]);
        let mut large = tables[0].clone();
        large.indices.resize(MANY_TRIANGLES, [0; 3]);
        assert!(makes_rays_part(&large));
        assert!(makes_rays_part(&SceneTables::build(&scenes::assortment())));
        let mut twice = tables[1].clone();
        twice.instances.push(twice.instances[0]);
        assert!(makes_rays_part(&twice));
    }

    #[test]
    fn few_samples_and_software_are_the_megakernels() {
        let test = "few_samples_and_software_are_the_megakernels";
        let Some(gpu) = crate::open_for_test(test, &crate::GpuOptions::default()) else { return };
        let tables = SceneTables::build(&scenes::glass());
        assert_eq!(is_faster(&gpu, TracerKind::Bvh, &tables, 1 << 30), !gpu.is_software());
        assert!(!is_faster(&gpu, TracerKind::Bvh, &tables, 1 << 20));
        assert!(!is_faster(&gpu, TracerKind::Query, &tables, 1 << 30));
    }
}
