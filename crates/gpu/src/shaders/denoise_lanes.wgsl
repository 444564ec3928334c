// A convolution of 3×3: an invocation computes sixteen channels of four pixels that lie side by
// side.

#import denoise_inputs, denoise_numbers, denoise_outputs, denoise_shape

@group(3) @binding(3) var<storage, read> weights: array<Quad>;

var<workgroup> chunk_inputs: array<Quad, HALO_PIXELS * CHUNK_QUADS>;

/// The weights that an input channel meets in sixteen output channels.
fn weights_at(place: u32) -> mat4x4f {
    return mat4x4f(
        vec4f(weights[place]),
        vec4f(weights[place + 1u]),
        vec4f(weights[place + 2u]),
        vec4f(weights[place + 3u]),
    );
}

/// Writes what an invocation has computed of a pixel.
fn write_sums(pixel: vec2u, block: u32, sums: mat4x4f) {
    for (var i = 0u; i < 4u; i++) {
        write_quad(pixel, 4u * block + i, sums[i]);
    }
}

@compute @workgroup_size(OUTPUTS * 2)
fn convolve(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let block = thread / 32u;
    let first = vec2u(thread % 4u * 4u, thread % 32u / 4u);
    var a = mat4x4f();
    var b = mat4x4f();
    var c = mat4x4f();
    var d = mat4x4f();
    for (var chunk = 0u; chunk < chunk_count(); chunk++) {
        workgroupBarrier();
        for (var item = thread; item < HALO_PIXELS * CHUNK_QUADS; item += OUTPUTS * 2u) {
            chunk_inputs[item] = chunk_item(group.xy, chunk, item);
        }
        workgroupBarrier();
        for (var tap = 0u; tap < 9u; tap++) {
            let place = (first.y + tap / 3u) * HALO_WIDTH + first.x + tap % 3u;
            let tap_weights = ((chunk * 9u + tap) * (OUTPUTS / 16u) + block) * 64u;
            for (var quad = 0u; quad < CHUNK_QUADS; quad++) {
                let at = place * CHUNK_QUADS + quad;
                let in_a = vec4f(chunk_inputs[at]);
                let in_b = vec4f(chunk_inputs[at + CHUNK_QUADS]);
                let in_c = vec4f(chunk_inputs[at + 2u * CHUNK_QUADS]);
                let in_d = vec4f(chunk_inputs[at + 3u * CHUNK_QUADS]);
                for (var k = 0u; k < 4u; k++) {
                    let w = weights_at(tap_weights + 16u * quad + 4u * k);
                    a += w * in_a[k];
                    b += w * in_b[k];
                    c += w * in_c[k];
                    d += w * in_d[k];
                }
            }
        }
    }
    let pixel = group.xy * vec2u(TILE_WIDTH, TILE_HEIGHT) + first;
    write_sums(pixel, block, a);
    write_sums(pixel + vec2u(1u, 0u), block, b);
    write_sums(pixel + vec2u(2u, 0u), block, c);
    write_sums(pixel + vec2u(3u, 0u), block, d);
}
