// The finest level of what is filtered: radiance, irradiance, and the trust in them, by which they
// are multiplied; and beta, the share of the picture that is filtered without its albedo.

#import denoise_decoded, denoise_math, denoise_picture, denoise_step

/// The weights of four logits of trust and four of beta for each channel, then their bias.
@group(3) @binding(4) var<storage, read> trust_weights: array<vec4f>;
/// Two words of a pixel: radiance and the first value of irradiance; its other values, the trust,
/// beta.
@group(3) @binding(5) var<storage, read_write> trusted: array<vec4f>;

/// What is said of the four pixels that a pixel of the decoder stands for.
struct Shares {
    /// Between 0.001 and 1.
    trust: vec4f,
    /// Between 0 and 1.
    beta: vec4f,
}

/// Trust and beta of the four pixels that a pixel of the decoder stands for.
fn shares_of(place: u32) -> Shares {
    let quads = denoise_step.fine_quads;
    var trust = trust_weights[8u * quads];
    var beta = trust_weights[8u * quads + 1u];
    for (var quad = 0u; quad < quads; quad++) {
        let channels = decoded_quad(place, quad);
        for (var k = 0u; k < 4u; k++) {
            let at = 2u * (4u * quad + k);
            trust += channels[k] * trust_weights[at];
            beta += channels[k] * trust_weights[at + 1u];
        }
    }
    return Shares(0.001 + 0.999 * denoise_sigmoid(trust), denoise_sigmoid(beta));
}

@compute @workgroup_size(8, 8)
fn find_trust(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= denoise_step.size) {
        return;
    }
    let shares = shares_of(id.y * denoise_step.size.x + id.x);
    for (var place = 0u; place < 4u; place++) {
        let pixel = 2u * id.xy + vec2u(place % 2u, place / 2u);
        let at = pixel.y * 2u * denoise_step.size.x + pixel.x;
        let values = picture_pixel(at);
        let trust = shares.trust[place];
        let irradiance = values.colour / demodulator_of(values.albedo) * trust;
        trusted[2u * at] = vec4f(values.colour * trust, irradiance.x);
        trusted[2u * at + 1u] = vec4f(irradiance.yz, trust, shares.beta[place]);
    }
}
