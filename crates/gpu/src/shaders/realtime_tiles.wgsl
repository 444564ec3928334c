// Tiles of lights: squares of eight by eight pixels choose as many lights together, for a point that one of them sees, and each
// pixel looks at some of those. Every pixel keeps the light that it has chosen for its tile.

#import hybrid_frame, hybrid_pixels, lights, realtime_frame, texels, variant
#import optics::camera, optics::light_tree, optics::reservoir

/// Pixels of a tile in a row and in a column, but for tiles that the window's edge cuts.
const TILE: u32 = 8u;

/// In scenes with several lights, the share of those that are chosen by what they can bring to one point of the tile. Others may
/// see lights that cannot be seen from there, and those must have their chance: the rest is chosen among all alike.
const TILE_TREE_SHARE: f32 = 0.875;

/// A tile in the window.
struct Tile {
    first: vec2u,
    size: vec2u,
}

fn candidate_tile_of(pixel: vec2u) -> Tile {
    let first = pixel / TILE * TILE;
    return Tile(first, min(vec2u(TILE), realtime.size - first));
}

fn tile_area(tile: Tile) -> u32 {
    return tile.size.x * tile.size.y;
}

/// Place of the tile's pixel `index`, of `tile_area`.
fn tile_place(tile: Tile, index: u32) -> u32 {
    return place_of(tile.first + vec2u(index % tile.size.x, index / tile.size.x));
}

/// What a pixel sees first, which is not nothing.
fn seen_point(place: u32) -> vec3f {
    let ray = frame_ray(vec2u(place % realtime.size.x, place / realtime.size.x));
    return camera_ray_point(ray, first_hit(place).t);
}

/// Probability with which each of the tile's choices is light `index`.
///
/// - `center`: the point that the tile chooses for.
fn tile_probability(index: u32, center: vec3f) -> f32 {
    let by_importance = light_probability(index, center, ALL_SIDES);
    return tile_light_probability(tile_share(), by_importance, any_light_probability());
}

/// Share of the choices that are made for the tile's point.
fn tile_share() -> f32 {
    return select(1.0, TILE_TREE_SHARE, LIGHT_TREE);
}

/// Probability with which each of the tile's choices is a light, whichever, because all are chosen alike.
fn any_light_probability() -> f32 {
    return select(0.0, tile_uniform_probability(TILE_TREE_SHARE, scene.light_count), LIGHT_TREE);
}
