// What a convolution reads: two inputs one behind the other, channels last, four channels together.

#import denoise_numbers, denoise_step

@group(3) @binding(1) var<storage, read> coarse: array<Quad>;
@group(3) @binding(2) var<storage, read> fine: array<Quad>;

/// Outputs of a workgroup, across and down.
const TILE_WIDTH: u32 = 16u;
const TILE_HEIGHT: u32 = 8u;
/// With what a kernel of 3×3 reads around them.
const HALO_WIDTH: u32 = TILE_WIDTH + 2u;
const HALO_PIXELS: u32 = HALO_WIDTH * (TILE_HEIGHT + 2u);
/// Input channels that are in shared memory at a time, divided by four.
const CHUNK_QUADS: u32 = 4u;

/// How many times `CHUNK_QUADS` quads the inputs have.
fn chunk_count() -> u32 {
    return (denoise_step.coarse_quads + denoise_step.fine_quads) / CHUNK_QUADS;
}

/// Four channels of the inputs at a pixel; zeros outside.
fn input_quad(pixel: vec2i, quad: u32) -> Quad {
    let place = vec2u(pixel);
    // What is negative is a large number.
    if any(place >= denoise_step.size) {
        return Quad();
    }
    if quad < denoise_step.coarse_quads {
        let half_place = place / 2u;
        return coarse[(half_place.y * (denoise_step.size.x / 2u) + half_place.x) * denoise_step.coarse_quads + quad];
    }
    let channel = quad - denoise_step.coarse_quads;
    if denoise_step.scale == 0u {
        return fine[(place.y * denoise_step.size.x + place.x) * denoise_step.fine_quads + channel];
    }
    let pitch = 2u * denoise_step.size.x * denoise_step.fine_quads;
    let first = 2u * place.y * pitch + 2u * place.x * denoise_step.fine_quads + channel;
    let above = max(fine[first], fine[first + denoise_step.fine_quads]);
    let below = max(fine[first + pitch], fine[first + pitch + denoise_step.fine_quads]);
    return max(above, below);
}

/// Item `item` of a chunk of a workgroup's inputs: pixel by pixel of the tile with what is around
/// it, `CHUNK_QUADS` quads each.
fn chunk_item(group: vec2u, chunk: u32, item: u32) -> Quad {
    let place = item / CHUNK_QUADS;
    let corner = vec2i(group * vec2u(TILE_WIDTH, TILE_HEIGHT)) - 1;
    let pixel = corner + vec2i(vec2u(place % HALO_WIDTH, place / HALO_WIDTH));
    return input_quad(pixel, chunk * CHUNK_QUADS + item % CHUNK_QUADS);
}
