// What more than one pass of the denoiser computes.

/// From all numbers to between 0 and 1.
fn denoise_sigmoid(x: vec4f) -> vec4f {
    return 1.0 / (1.0 + exp(-x));
}

/// Eight values of a pixel.
struct DenoiseValues {
    a: vec4f,
    b: vec4f,
}

/// The mean of four pixels.
fn denoise_mean(p: DenoiseValues, q: DenoiseValues, r: DenoiseValues, s: DenoiseValues) -> DenoiseValues {
    return DenoiseValues(0.25 * ((p.a + q.a) + (r.a + s.a)), 0.25 * ((p.b + q.b) + (r.b + s.b)));
}
