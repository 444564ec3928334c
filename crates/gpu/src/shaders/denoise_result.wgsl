// The filtered picture: the finest level, put together, of radiance filtered with its albedo and
// without. `denoise_step.size` is that of what is kept of the region.

#import denoise_levels, denoise_math, denoise_picture, denoise_step

/// The finest level as `denoise_trust` writes it: the last value is beta.
@group(3) @binding(4) var<storage, read> trusted: array<DenoiseValues>;
/// Scaled radiance, three values a pixel.
@group(3) @binding(5) var<storage, read_write> result: array<f32>;

@compute @workgroup_size(8, 8)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= denoise_step.size) {
        return;
    }
    let pixel = denoise_step.core + id.xy;
    let values = combined_pixel(pixel, denoise_step.region);
    let place = pixel.y * denoise_step.region.x + pixel.x;
    let beta = trusted[place].b.w;
    let demodulator = demodulator_of(picture_pixel(place).albedo);
    let irradiance = vec3f(values.a.w, values.b.xy);
    let mixed = max(beta * demodulator * irradiance + (1.0 - beta) * values.a.xyz, vec3f(0.0));
    let at = 3u * (id.y * denoise_step.size.x + id.x);
    result[at] = mixed.x;
    result[at + 1u] = mixed.y;
    result[at + 2u] = mixed.z;
}
