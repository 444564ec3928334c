// A sample of each pixel as a wave of paths: what happens at the first vertex, and how the wave's light gets to its pixels.
//
//     restart → begin → prepare → connect_first → [extend → measure (once) → shade → prepare → connect] for each
//     vertex but the last → extend_last → shade → finish
//
// Those that are not here are the stages of `path`'s wavefront. The place of a path in `gathered` is its pixel's.

#import wavefront

/// Planes of a sample on its way.
/// What a light brings to the first surface's diffuse lobe, unless something is in between, and how far away the second surface
/// is, metres; 0 if there is none.
const SPLIT_DIFFUSE: u32 = 0u;
/// What it brings to the other lobes.
const SPLIT_SPECULAR: u32 = 1u;
/// How much of what the path gathers belongs to the diffuse lobe.
const SPLIT_SHARE: u32 = 2u;
const SPLIT_PLANES: u32 = 3u;

@group(3) @binding(28) var<storage, read_write> split_samples: array<vec4f>;

/// Where a plane of `split_samples` has its record `at`.
fn in_split_samples(plane: u32, at: u32) -> u32 {
    return plane * (arrayLength(&split_samples) / SPLIT_PLANES) + at;
}

/// A wave without paths.
@compute @workgroup_size(1)
fn restart() {
    wave.capacity = arrayLength(&paths) / (2u * PATH_PLANES);
    wave.depth = 1u;
    wave.path_count = 0u;
    wave.shadow_rays = 0u;
    atomicStore(&wave.next_path_count, 0u);
    atomicStore(&wave.casting, 0u);
}
