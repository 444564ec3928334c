// The level of half the resolution: the mean of each 2×2.

#import denoise_math, denoise_step

@group(3) @binding(1) var<storage, read> finer: array<DenoiseValues>;
@group(3) @binding(2) var<storage, read_write> halved: array<DenoiseValues>;

@compute @workgroup_size(8, 8)
fn halve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= denoise_step.size) {
        return;
    }
    let pitch = 2u * denoise_step.size.x;
    let at = 2u * id.y * pitch + 2u * id.x;
    let mean = denoise_mean(finer[at], finer[at + 1u], finer[at + pitch], finer[at + pitch + 1u]);
    halved[id.y * denoise_step.size.x + id.x] = mean;
}
