// How a filtered level is put together with the result of the next coarser one: its means, smoothly
// enlarged, as much as detail says of what is finer than these, and as much as alpha says of what the
// coarser level knows better.

#import denoise_math, denoise_step

/// The level, as `denoise_kernels` writes it.
@group(3) @binding(2) var<storage, read> filtered: array<DenoiseValues>;
/// The result of the level of half the resolution.
@group(3) @binding(3) var<storage, read> coarse: array<DenoiseValues>;

/// Values at half the resolution of a level.
struct HalfResolution {
    /// The mean of the level's four pixels.
    mean: DenoiseValues,
    /// The result of the coarser level.
    coarse: DenoiseValues,
}

/// The values at a pixel of half the resolution, in a level of `size`.
fn half_resolution(half_pixel: vec2u, size: vec2u) -> HalfResolution {
    let at = 2u * half_pixel.y * size.x + 2u * half_pixel.x;
    let mean = denoise_mean(filtered[at], filtered[at + 1u], filtered[at + size.x], filtered[at + size.x + 1u]);
    return HalfResolution(mean, coarse[half_pixel.y * (size.x / 2u) + half_pixel.x]);
}

/// Values between four pixels of half the resolution, of which `a` is the nearest.
fn between(a: DenoiseValues, b: DenoiseValues, c: DenoiseValues, d: DenoiseValues) -> DenoiseValues {
    return DenoiseValues(
        0.5625 * a.a + 0.1875 * b.a + 0.1875 * c.a + 0.0625 * d.a,
        0.5625 * a.b + 0.1875 * b.b + 0.1875 * c.b + 0.0625 * d.b,
    );
}

/// Means and coarse result at a pixel of the level: bilinear between centres of pixels, constant
/// beyond the outermost.
fn enlarged(pixel: vec2u, size: vec2u) -> HalfResolution {
    let near = pixel / 2u;
    let below = vec2u(max(vec2i(near) - 1, vec2i(0)));
    let above = min(near + 1u, size / 2u - 1u);
    let far = select(above, below, pixel % 2u == vec2u(0u));
    let a = half_resolution(near, size);
    let b = half_resolution(vec2u(far.x, near.y), size);
    let c = half_resolution(vec2u(near.x, far.y), size);
    let d = half_resolution(far, size);
    return HalfResolution(
        between(a.mean, b.mean, c.mean, d.mean),
        between(a.coarse, b.coarse, c.coarse, d.coarse),
    );
}

/// A pixel of the level, put together.
fn combined_pixel(pixel: vec2u, size: vec2u) -> DenoiseValues {
    let values = filtered[pixel.y * size.x + pixel.x];
    let shares = denoise_sigmoid(values.b).zw;
    let around = enlarged(pixel, size);
    let smooth_values = around.mean;
    let a = smooth_values.a + shares.y * (values.a - smooth_values.a)
        + shares.x * (around.coarse.a - smooth_values.a);
    let b = smooth_values.b + shares.y * (values.b - smooth_values.b)
        + shares.x * (around.coarse.b - smooth_values.b);
    return DenoiseValues(a, b);
}
