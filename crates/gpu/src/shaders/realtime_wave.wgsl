// A sample of each pixel as a wave of paths: what happens at the first vertex, and how the wave's light gets to its pixels.
//
//     restart → begin → prepare → connect_first → [extend → measure (once) → shade → prepare → connect] for each vertex → finish
//
// Those that are not here are the stages of `path`'s wavefront. The place of a path in `gathered` is its pixel's.

/// A sample on its way.
struct SplitSample {
    /// What a light brings to the first surface, unless something is in between.
    diffuse: vec3f,
    /// From the first surface to the second, metres; 0 if there is none.
    hit_distance: f32,
    specular: vec3f,
    padding0: u32,
    /// How much of what the path gathers belongs to the diffuse lobe.
    diffuse_share: vec3f,
    padding1: u32,
}

@group(3) @binding(28) var<storage, read_write> split_samples: array<SplitSample>;

/// A wave without paths.
@compute @workgroup_size(1)
fn restart() {
    wave.capacity = arrayLength(&paths) / 2u;
    wave.depth = 1u;
    wave.arriving = 0u;
    wave.shadow_rays = 0u;
    atomicStore(&wave.leaving, 0u);
    atomicStore(&wave.casting, 0u);
}
