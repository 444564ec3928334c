// What the rasteriser draws: pieces of geometries in their places.

#import hybrid_frame

/// Consecutive primitives of a geometry.
struct HybridPart {
    /// Bounds in object space.
    low: vec3f,
    /// Number of the geometry within its bottom-level structure.
    geometry: u32,
    high: vec3f,
    /// Number of the first primitive within the geometry.
    first: u32,
    count: u32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
}

/// A part of an instance.
struct HybridItem {
    instance: u32,
    part: u32,
}

/// Bits of an identification that number a primitive within its part; the others are the item's.
const PRIMITIVE_BITS: u32 = 7u;
/// The identification of nothing.
const SEES_NOTHING: u32 = 0xffffffffu;

@group(3) @binding(1) var<storage, read> items: array<HybridItem>;
@group(3) @binding(2) var<storage, read> parts: array<HybridPart>;

/// The first number of a class's items.
fn class_start(class_: u32) -> u32 {
    return frame.class_first[class_ / 4u][class_ % 4u];
}
