// Filters a level: each pixel becomes the mean of the 5×5 around it, weighted by the kernel that a
// head of the network says, and by trust. An invocation filters what four pixels of the decoder
// stand for, each for one pixel or for 2×2 of the picture.

#import denoise_decoded, denoise_math, denoise_step

/// Values of trusted pixels, as `denoise_trust` writes them.
@group(3) @binding(1) var<storage, read> trusted: array<DenoiseValues>;
/// The head's weights, 28 outputs a pixel: [pixel][channel][7].
@group(3) @binding(2) var<storage, read> head_weights: array<vec4f>;
/// Its bias: [pixel][7].
@group(3) @binding(4) var<storage, read> head_bias: array<vec4f>;
/// Radiance and the first value of irradiance; its other values, the logits alpha and detail.
@group(3) @binding(5) var<storage, read_write> filtered: array<DenoiseValues>;

/// How far kernels reach.
const REACH: i32 = 2;
/// Outputs of a head for a pixel, divided by four: 25 logits of the kernel, zero, alpha and detail.
const SLOT_QUADS: u32 = 7u;
/// From one to the next of the four pixels of the decoder that an invocation stands for.
const PLACE_STEP: u32 = 8u;

/// The outputs of a head for a pixel: the first sixteen, and twelve more.
struct Slots {
    low: mat4x4f,
    high: mat3x4f,
}

/// The bias of the head for pixel `pixel`.
fn bias_of(pixel: u32) -> Slots {
    let at = pixel * SLOT_QUADS;
    return Slots(
        mat4x4f(head_bias[at], head_bias[at + 1u], head_bias[at + 2u], head_bias[at + 3u]),
        mat3x4f(head_bias[at + 4u], head_bias[at + 5u], head_bias[at + 6u]),
    );
}

/// The head's weights of a channel for pixel `pixel`.
fn weights_of(pixel: u32, channel: u32) -> Slots {
    let at = (pixel * 4u * denoise_step.fine_quads + channel) * SLOT_QUADS;
    return Slots(
        mat4x4f(head_weights[at], head_weights[at + 1u], head_weights[at + 2u], head_weights[at + 3u]),
        mat3x4f(head_weights[at + 4u], head_weights[at + 5u], head_weights[at + 6u]),
    );
}

/// Adds the products of weights and a channel's value.
fn add_products(slots: Slots, weights: Slots, value: f32) -> Slots {
    return Slots(slots.low + weights.low * value, slots.high + weights.high * value);
}

/// The outputs of the head for pixel `pixel` of those that each of four pixels of the decoder,
/// `places`, stands for. Weights are read once for all four: reading takes longer than multiplying.
fn slots_of(places: vec4u, pixel: u32) -> array<Slots, 4> {
    var a = bias_of(pixel);
    var b = a;
    var c = a;
    var d = a;
    for (var quad = 0u; quad < denoise_step.fine_quads; quad++) {
        let in_a = decoded_quad(places.x, quad);
        let in_b = decoded_quad(places.y, quad);
        let in_c = decoded_quad(places.z, quad);
        let in_d = decoded_quad(places.w, quad);
        for (var k = 0u; k < 4u; k++) {
            let weights = weights_of(pixel, 4u * quad + k);
            a = add_products(a, weights, in_a[k]);
            b = add_products(b, weights, in_b[k]);
            c = add_products(c, weights, in_c[k]);
            d = add_products(d, weights, in_d[k]);
        }
    }
    return array<Slots, 4>(a, b, c, d);
}

/// The largest of the kernel's logits, by which they are shifted.
fn largest_logit(slots: Slots) -> f32 {
    let low = max(max(slots.low[0], slots.low[1]), max(slots.low[2], slots.low[3]));
    let most = max(low, max(slots.high[0], slots.high[1]));
    return max(max(max(most.x, most.y), max(most.z, most.w)), slots.high[2].x);
}

/// A pixel of a level of `size`, filtered.
fn filter_pixel(pixel: vec2u, size: vec2u, slots: Slots) -> DenoiseValues {
    let shift = largest_logit(slots);
    var logits = array<vec4f, 7>(slots.low[0], slots.low[1], slots.low[2], slots.low[3],
        slots.high[0], slots.high[1], slots.high[2]);
    var sum = DenoiseValues();
    for (var tap = 0u; tap < 25u; tap++) {
        let there = vec2u(vec2i(pixel) + vec2i(vec2u(tap % 5u, tap / 5u)) - REACH);
        // What is negative is a large number.
        if all(there < size) {
            let weight = exp(logits[tap / 4u][tap % 4u] - shift);
            let values = trusted[there.y * size.x + there.x];
            sum.a += weight * values.a;
            sum.b += weight * values.b;
        }
    }
    let factor = 1.0 / sum.b.z;
    return DenoiseValues(sum.a * factor, vec4f(sum.b.xy * factor, slots.high[2].zw));
}

/// Filters and writes the pixel, if it is one of the level's.
fn write_filtered(pixel: vec2u, size: vec2u, slots: Slots) {
    if all(pixel < size) {
        filtered[pixel.y * size.x + pixel.x] = filter_pixel(pixel, size, slots);
    }
}

@compute @workgroup_size(8, 8)
fn filter_level(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) id: vec3u) {
    let place = vec2u(4u * PLACE_STEP * group.x + id.x, 8u * group.y + id.y);
    let last = denoise_step.size - 1u;
    // What is beyond the last column or row is not written.
    let columns = min(place.x + PLACE_STEP * vec4u(0u, 1u, 2u, 3u), vec4u(last.x));
    let places = min(place.y, last.y) * denoise_step.size.x + columns;
    let scale = denoise_step.scale;
    let size = denoise_step.size * scale;
    for (var i = 0u; i < scale * scale; i++) {
        let slots = slots_of(places, i);
        let pixel = scale * place + vec2u(i % scale, i / scale);
        let step = vec2u(scale * PLACE_STEP, 0u);
        write_filtered(pixel, size, slots[0]);
        write_filtered(pixel + step, size, slots[1]);
        write_filtered(pixel + 2u * step, size, slots[2]);
        write_filtered(pixel + 3u * step, size, slots[3]);
    }
}
