// Where the lists of shafts are, and how walks read them (`bvh_entries.wgsl`): a tile's bounds and a list for each light.

#import film, hybrid_light_masks, shaft_numbers

/// By four, because entries are read so.
@group(3) @binding(5) var<storage, read_write> light_masks: array<vec4u>;

fn light_word(at: u32) -> u32 {
    return light_masks[at / 4u][at % 4u];
}

fn set_light_word(at: u32, word: u32) {
    light_masks[at / 4u][at % 4u] = word;
}

/// Four words of a tile's bounds: lower and upper corner.
const BOUNDS_SIZE: u32 = 2u;
/// Four words of a list: how long it is, then its entries, see `bvh_entry_low` and `bvh_entry_high`.
const LIST_SIZE: u32 = 1u + 2u * SHAFT_ENTRIES;

fn shaft_tiles() -> vec2u {
    return (vec2u(view.window_width, view.row_count) + SHAFT_TILE - 1u) / SHAFT_TILE;
}

/// Number of the tile of a pixel of the dispatch.
fn tile_of(id: vec2u) -> u32 {
    let tile = id / SHAFT_TILE;
    return tile.y * shaft_tiles().x + tile.x;
}

/// Where a tile's bounds are, in `light_masks`: after what is known of pixels.
fn tile_bounds_at(tile: u32) -> u32 {
    return (hidden_word(0u, view.shadow_samples, 0u) + 3u) / 4u + BOUNDS_SIZE * tile;
}

/// Where the list of a tile for a light begins: after all bounds.
fn shaft_list(tile: u32, light: u32) -> u32 {
    let tiles = shaft_tiles();
    return tile_bounds_at(tiles.x * tiles.y) + LIST_SIZE * (light * tiles.x * tiles.y + tile);
}

fn bvh_entry_low(list: u32, i: u32) -> vec4u {
    return light_masks[list + 1u + 2u * i];
}

fn bvh_entry_high(list: u32, i: u32) -> vec4u {
    return light_masks[list + 2u + 2u * i];
}
