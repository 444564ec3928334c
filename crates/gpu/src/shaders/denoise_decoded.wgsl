// What the decoder says of the pixels of a level, channels last.

#import denoise_numbers, denoise_step

@group(3) @binding(3) var<storage, read> decoded: array<Quad>;

/// Four channels of pixel `place`, row by row.
fn decoded_quad(place: u32, quad: u32) -> vec4f {
    return vec4f(decoded[place * denoise_step.fine_quads + quad]);
}
