// What a convolution writes.

#import denoise_numbers, denoise_shape, denoise_step

@group(3) @binding(4) var<storage, read> bias: array<vec4f>;
@group(3) @binding(5) var<storage, read_write> outputs: array<Quad>;

/// Writes four channels of a pixel, if it is one of the picture's: sums of products become the
/// larger of zero and sum and bias.
fn write_quad(pixel: vec2u, quad: u32, sums: vec4f) {
    if all(pixel < denoise_step.size) {
        let rectified = clamp(sums + bias[quad], vec4f(0.0), vec4f(LARGEST_NUMBER));
        outputs[(pixel.y * denoise_step.size.x + pixel.x) * (OUTPUTS / 4u) + quad] = Quad(rectified);
    }
}
