// Puts a level together with the result of the next coarser one.

#import denoise_levels, denoise_math, denoise_step

@group(3) @binding(4) var<storage, read_write> combined: array<DenoiseValues>;

@compute @workgroup_size(8, 8)
fn combine(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < denoise_step.size) {
        combined[id.y * denoise_step.size.x + id.x] = combined_pixel(id.xy, denoise_step.size);
    }
}
