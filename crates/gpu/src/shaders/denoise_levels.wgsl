// How a filtered level is put together with the result of the next coarser one: as much as alpha
// says of what that knows better.

#import denoise_math, denoise_step

/// The level, as `denoise_kernels` writes it.
@group(3) @binding(2) var<storage, read> filtered: array<DenoiseValues>;
/// The result of the level of half the resolution.
@group(3) @binding(3) var<storage, read> coarse: array<DenoiseValues>;

/// The coarse result minus the mean of the level's four pixels there, in a level of `size`, at a
/// pixel of half the resolution.
fn residual(half_pixel: vec2u, size: vec2u) -> DenoiseValues {
    let at = 2u * half_pixel.y * size.x + 2u * half_pixel.x;
    let mean = denoise_mean(filtered[at], filtered[at + 1u], filtered[at + size.x], filtered[at + size.x + 1u]);
    let better = coarse[half_pixel.y * (size.x / 2u) + half_pixel.x];
    return DenoiseValues(better.a - mean.a, better.b - mean.b);
}

/// The residual at a pixel of the level: bilinear between centres of pixels, constant beyond the
/// outermost.
fn enlarged_residual(pixel: vec2u, size: vec2u) -> DenoiseValues {
    let near = pixel / 2u;
    let below = vec2u(max(vec2i(near) - 1, vec2i(0)));
    let above = min(near + 1u, size / 2u - 1u);
    let far = select(above, below, pixel % 2u == vec2u(0u));
    let a = residual(near, size);
    let b = residual(vec2u(far.x, near.y), size);
    let c = residual(vec2u(near.x, far.y), size);
    let d = residual(far, size);
    return DenoiseValues(
        0.5625 * a.a + 0.1875 * b.a + 0.1875 * c.a + 0.0625 * d.a,
        0.5625 * a.b + 0.1875 * b.b + 0.1875 * c.b + 0.0625 * d.b,
    );
}

/// The level's pixel with as much as its alpha says of the residual. The logits stay.
fn combined_pixel(pixel: vec2u, size: vec2u) -> DenoiseValues {
    let values = filtered[pixel.y * size.x + pixel.x];
    let alpha = denoise_sigmoid(values.b).z;
    let better = enlarged_residual(pixel, size);
    return DenoiseValues(values.a + alpha * better.a, vec4f(values.b.xy + alpha * better.b.xy, values.b.zw));
}
