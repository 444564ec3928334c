// Convolutions by the device's matrix units: what goes into them and what becomes of what comes
// out. The products themselves are generated (`denoise/matrices.rs`).

#import denoise_inputs, denoise_numbers, denoise_outputs, denoise_shape

@group(3) @binding(3) var<storage, read> weights: array<Number>;

/// From one pixel to the next in `chunk_inputs`: more than the channels of a chunk, so that eight
/// rows of a matrix lie in different banks of shared memory.
const PIXEL_STRIDE: u32 = 24u;
/// Subgroups of a workgroup; each computes two rows of its tile.
const SUBGROUPS: u32 = TILE_HEIGHT / 2u;
/// Sums of sixteen channels that a subgroup hands on: those of its two rows.
const ROW_SUMS: u32 = 2u * TILE_WIDTH * 16u;

var<workgroup> chunk_inputs: array<Number, HALO_PIXELS * PIXEL_STRIDE>;
var<workgroup> row_sums: array<f32, SUBGROUPS * ROW_SUMS>;

/// Brings a chunk of a workgroup's inputs to shared memory.
fn load_chunk(group: vec2u, chunk: u32, thread: u32) {
    workgroupBarrier();
    for (var item = thread; item < HALO_PIXELS * CHUNK_QUADS; item += SUBGROUPS * SUBGROUP_SIZE) {
        let quad = chunk_item(group, chunk, item);
        let at = item / CHUNK_QUADS * PIXEL_STRIDE + item % CHUNK_QUADS * 4u;
        chunk_inputs[at] = quad.x;
        chunk_inputs[at + 1u] = quad.y;
        chunk_inputs[at + 2u] = quad.z;
        chunk_inputs[at + 3u] = quad.w;
    }
    workgroupBarrier();
}

/// Writes the sixteen channels of block `block` that all subgroups have left in `row_sums`.
fn write_block(group: vec2u, block: u32, thread: u32) {
    workgroupBarrier();
    for (var item = thread; item < SUBGROUPS * ROW_SUMS / 4u; item += SUBGROUPS * SUBGROUP_SIZE) {
        let at = 4u * item;
        let sums = vec4f(row_sums[at], row_sums[at + 1u], row_sums[at + 2u], row_sums[at + 3u]);
        let place = item / 4u;
        let pixel = group * vec2u(TILE_WIDTH, TILE_HEIGHT) + vec2u(place % TILE_WIDTH, place / TILE_WIDTH);
        write_quad(pixel, 4u * block + item % 4u, sums);
    }
    workgroupBarrier();
}
