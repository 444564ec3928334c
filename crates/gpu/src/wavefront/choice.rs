//! Which path kernel is the faster one.
//!
//! A rule from measurements (`docs/performance.md`, "Path tracing on a GPU"): with millions of paths in flight the wavefront wins in
//! every scene, by most where neighbouring rays need very different times. It has been measured with our own hierarchy only.

use super::queues;
use crate::Gpu;
use crate::tracer::TracerKind;

/// Paths in flight from which on the wavefront wins at all.
const ENOUGH_PATHS: u64 = 1 << 21;

/// Whether the wavefront is the faster one on this device for so many samples, all pixels together.
pub fn is_faster(gpu: &Gpu, kind: TracerKind, samples: u64) -> bool {
    let measured = kind == TracerKind::Bvh && !gpu.is_software();
    measured && queues::suitable_paths(gpu).min(samples) >= ENOUGH_PATHS
}

/// Whether so many samples, all pixels together, are near the threshold: then compiling another kernel is taken to cost more
/// than it saves, and the one that is there is used. The factor of four is a guess; no measurement stands behind it.
pub fn is_close(samples: u64) -> bool {
    (ENOUGH_PATHS / 4..ENOUGH_PATHS * 4).contains(&samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_the_threshold_what_is_compiled_wins() {
        assert!(is_close(1920 * 1080) && is_close(ENOUGH_PATHS));
        assert!(!is_close(128 * 128) && !is_close(1920 * 1080 * 64));
    }

    #[test]
    fn few_samples_and_software_are_the_megakernels() {
        let test = "few_samples_and_software_are_the_megakernels";
        let Some(gpu) = crate::open_for_test(test, &crate::GpuOptions::default()) else { return };
        assert_eq!(is_faster(&gpu, TracerKind::Bvh, 1 << 30), !gpu.is_software());
        assert!(!is_faster(&gpu, TracerKind::Bvh, 1 << 20));
        assert!(!is_faster(&gpu, TracerKind::Query, 1 << 30));
    }
}
