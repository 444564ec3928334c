// For tracers whose walks can only begin at the root: no shafts, no lists.

#import rays

@group(3) @binding(5) var<storage, read_write> light_masks: array<u32>;

fn light_word(at: u32) -> u32 {
    return light_masks[at];
}

fn set_light_word(at: u32, word: u32) {
    light_masks[at] = word;
}

fn tile_of(id: vec2u) -> u32 {
    return 0u;
}

fn occluded_in_shaft(tile: u32, light: u32, origin: vec3f, direction: vec3f, distance: f32, salt: u32) -> bool {
    return occluded(origin, direction, distance, salt);
}
