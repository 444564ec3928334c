// Filters a level: each pixel becomes the mean of the 5×5 around it, weighted by the kernel that a
// head of the network says, and by trust. An invocation filters what one pixel of the decoder
// stands for: one pixel, or 2×2 of the picture.

#import denoise_decoded, denoise_math, denoise_step

/// Values of trusted pixels, as `denoise_trust` writes them.
@group(3) @binding(1) var<storage, read> trusted: array<DenoiseValues>;
/// The head's weights, 28 outputs a pixel: [pixel][channel][7].
@group(3) @binding(2) var<storage, read> head_weights: array<vec4f>;
/// Its bias: [pixel][7].
@group(3) @binding(4) var<storage, read> head_bias: array<vec4f>;
/// Radiance and the first value of irradiance; its other values, the logits alpha and beta.
@group(3) @binding(5) var<storage, read_write> filtered: array<DenoiseValues>;

/// How far kernels reach.
const REACH: i32 = 2;
/// Outputs of a head for a pixel, divided by four: 25 logits of the kernel, one that is not used
/// here, alpha and beta.
const SLOT_QUADS: u32 = 7u;

/// The outputs of the head for pixel `pixel` of those that the decoder's pixel `place` stands for.
fn slots_of(place: u32, pixel: u32) -> array<vec4f, 7> {
    let first = pixel * SLOT_QUADS;
    var s0 = head_bias[first];
    var s1 = head_bias[first + 1u];
    var s2 = head_bias[first + 2u];
    var s3 = head_bias[first + 3u];
    var s4 = head_bias[first + 4u];
    var s5 = head_bias[first + 5u];
    var s6 = head_bias[first + 6u];
    for (var quad = 0u; quad < denoise_step.fine_quads; quad++) {
        let channels = decoded_quad(place, quad);
        for (var k = 0u; k < 4u; k++) {
            let at = ((pixel * denoise_step.fine_quads + quad) * 4u + k) * SLOT_QUADS;
            let channel = channels[k];
            s0 += channel * head_weights[at];
            s1 += channel * head_weights[at + 1u];
            s2 += channel * head_weights[at + 2u];
            s3 += channel * head_weights[at + 3u];
            s4 += channel * head_weights[at + 4u];
            s5 += channel * head_weights[at + 5u];
            s6 += channel * head_weights[at + 6u];
        }
    }
    return array<vec4f, 7>(s0, s1, s2, s3, s4, s5, s6);
}

/// The largest of the kernel's logits, by which they are shifted.
fn largest_logit(slots: array<vec4f, 7>) -> f32 {
    let most = max(max(max(slots[0], slots[1]), max(slots[2], slots[3])), max(slots[4], slots[5]));
    return max(max(max(most.x, most.y), max(most.z, most.w)), slots[6].x);
}

/// A pixel of a level of `size`, filtered.
fn filter_pixel(pixel: vec2u, size: vec2u, kernel: array<vec4f, 7>) -> DenoiseValues {
    var slots = kernel;
    let shift = largest_logit(kernel);
    var sum = DenoiseValues();
    for (var tap = 0u; tap < 25u; tap++) {
        let there = vec2u(vec2i(pixel) + vec2i(vec2u(tap % 5u, tap / 5u)) - REACH);
        // What is negative is a large number.
        if all(there < size) {
            let weight = exp(slots[tap / 4u][tap % 4u] - shift);
            let values = trusted[there.y * size.x + there.x];
            sum.a += weight * values.a;
            sum.b += weight * values.b;
        }
    }
    let factor = 1.0 / sum.b.z;
    return DenoiseValues(sum.a * factor, vec4f(sum.b.xy * factor, kernel[6].zw));
}

@compute @workgroup_size(8, 8)
fn filter_level(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= denoise_step.size) {
        return;
    }
    let size = denoise_step.size * denoise_step.scale;
    for (var i = 0u; i < denoise_step.scale * denoise_step.scale; i++) {
        let pixel = denoise_step.scale * id.xy + vec2u(i % denoise_step.scale, i / denoise_step.scale);
        let slots = slots_of(id.y * denoise_step.size.x + id.x, i);
        filtered[pixel.y * size.x + pixel.x] = filter_pixel(pixel, size, slots);
    }
}
