// What a pass of the denoiser is told.

struct DenoiseStep {
    /// Columns and rows of what the pass writes, in pixels of its level.
    size: vec2u,
    /// Channels of the input of half the resolution, divided by four; it comes first.
    coarse_quads: u32,
    /// Channels of the other input, divided by four.
    fine_quads: u32,
    /// Convolutions: 1 if the other input has double the resolution, and the largest of each 2×2
    /// counts. Kernels: pixels of the filtered level, across, for one of the decoder's.
    scale: u32,
    /// Zero.
    unused: u32,
    /// The first column and row that are kept of the region.
    core: vec2u,
    /// Columns and rows of the region.
    region: vec2u,
}

@group(3) @binding(0) var<uniform> denoise_step: DenoiseStep;
