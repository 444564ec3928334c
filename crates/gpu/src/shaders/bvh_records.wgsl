// Records of `accel::encode`, and the buffers that are never cut into pages: bind group 1.

// Eight boxes on a grid.
struct BvhNode {
    // xyz: the grid's lowest corner, as bits of floats. w: from the lowest byte, the exponents of the grid's spacing along
    // x, y and z, then a bit for each slot that holds a node.
    grid: vec4u,
    // x: first child that is a node. y: first primitive or instance. zw: what the slots hold, a byte each.
    links: vec4u,
    // Faces of the boxes along x, y and z, lower and upper, in grid steps: floats of sixteen bits, one for each slot.
    planes: array<vec4u, 6>,
}

// A triangle, or a sphere of centre a and radius b.x. Coordinates are bits of floats.
struct BvhPrimitive {
    // w: number of the primitive in its object.
    a: vec4u,
    // w: number of the geometry in its object.
    b: vec4u,
    // w: where instances are joined, the one that it belongs to, and BVH_OWNER_SPHERE.
    c: vec4u,
}

const BVH_INSTANCE_IDENTITY: u32 = 1u;
const BVH_INSTANCE_SPHERES: u32 = 2u;
const BVH_OWNER_SPHERE: u32 = 0x80000000u;

struct BvhInstance {
    // Rows of the matrix from world to object space.
    world_to_object: array<vec4f, 3>,
    // The largest magnitude of a coordinate of the object, by axis.
    extent: vec3f,
    // Index of the root node, or NONE.
    root: u32,
    // Which instance of the scene this is.
    index: u32,
    // BVH_INSTANCE_… bits.
    flags: u32,
    unused: vec2u,
}

// The world itself, then the instances in the order of the upper level. Where there is no upper level, the only instance
// stands in the world's place.
@group(1) @binding(0) var<storage, read> bvh_instances: array<BvhInstance>;
