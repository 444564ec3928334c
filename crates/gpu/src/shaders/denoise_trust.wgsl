// The finest level of what is filtered: radiance, irradiance, and the trust in them, by which they
// are multiplied.

#import denoise_decoded, denoise_math, denoise_picture, denoise_step

/// The weights of four logits for each channel, then their bias.
@group(3) @binding(4) var<storage, read> trust_weights: array<vec4f>;
/// Two words of a pixel: radiance and the first value of irradiance; its other values, the trust,
/// zero.
@group(3) @binding(5) var<storage, read_write> trusted: array<vec4f>;

/// The trust in the four pixels that a pixel of the decoder stands for, between 0.001 and 1.
fn trust_of(place: u32) -> vec4f {
    let quads = denoise_step.fine_quads;
    var logits = trust_weights[4u * quads];
    for (var quad = 0u; quad < quads; quad++) {
        let channels = decoded_quad(place, quad);
        for (var k = 0u; k < 4u; k++) {
            logits += channels[k] * trust_weights[4u * quad + k];
        }
    }
    return 0.001 + 0.999 * denoise_sigmoid(logits);
}

@compute @workgroup_size(8, 8)
fn find_trust(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= denoise_step.size) {
        return;
    }
    let trusts = trust_of(id.y * denoise_step.size.x + id.x);
    for (var place = 0u; place < 4u; place++) {
        let pixel = 2u * id.xy + vec2u(place % 2u, place / 2u);
        let at = pixel.y * 2u * denoise_step.size.x + pixel.x;
        let values = picture_pixel(at);
        let trust = trusts[place];
        let irradiance = values.colour / demodulator_of(values.albedo) * trust;
        trusted[2u * at] = vec4f(values.colour * trust, irradiance.x);
        trusted[2u * at + 1u] = vec4f(irradiance.yz, trust, 0.0);
    }
}
