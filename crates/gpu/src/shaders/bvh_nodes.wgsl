// Rays, nodes and primitives of our own hierarchy: what walks through it are made of.
//
// The format is that of `accel::encode`.

#import bvh_records, bvh_scene, material, primitive, scene, variant
#import optics::intersect
#ifdef SCENE_MOVES
#import motion
#endif

// Bits of a group's second word that stand for nodes; the lower 24 stand for primitives or instances.
const BVH_NODES: u32 = 0xff000000u;

// Groups of siblings that wait for their visit. For the whole thread, because a variable of a function is
// set to zero in every call.
var<private> bvh_stack: array<vec2u, BVH_STACK>;

fn bvh_push(size: u32, group: vec2u) -> u32 {
    bvh_stack[size] = group;
    return size + 1u;
}

// A ray in the space of a structure, with what nodes and primitives need of it.
struct BvhRay {
    origin: vec3f,
    direction: vec3f,
    shear: RayShear,
    inverse: vec3f,
    // By how much a plane's ray parameter may be wrong: no box that the ray touches is missed.
    room: vec3f,
    // Bit a is set if the ray does not go down along axis a.
    upwards: u32,
    // Which planes of a node it enters through: numbers of `BvhNode.planes`.
    faces: vec3u,
}

fn bvh_ray(origin: vec3f, direction: vec3f, extent: vec3f) -> BvhRay {
    let size = abs(direction);
    // Zero would give infinity, and infinity NaN. This is small enough to be parallel at any distance that a grid has.
    let tiny = vec3f(max(max(size.x, max(size.y, size.z)) * 1e-20, 1e-37));
    let inverse = 1.0 / select(direction, select(-tiny, tiny, direction >= vec3f(0.0)), size < tiny);
    // Eight roundings: the reciprocal (2.5 units in the last place), the grid's corner, products and sums.
    let room = (abs(origin) + extent) * abs(inverse) * 9.5367431640625e-7;
    let up = select(vec3u(0u), vec3u(1u, 2u, 4u), inverse >= vec3f(0.0));
    let faces = select(vec3u(1u, 3u, 5u), vec3u(0u, 2u, 4u), inverse >= vec3f(0.0));
    return BvhRay(origin, direction, ray_shear(direction), inverse, room, up.x | up.y | up.z, faces);
}

// Where a ray meets the planes of slots 0 to 3 (`planes.xy`) or 4 to 7 (`planes.zw`).
fn bvh_crossings(planes: vec2u, scale: f32, offset: f32) -> vec4f {
    return vec4f(unpack2x16float(planes.x), unpack2x16float(planes.y)) * scale + offset;
}

fn bvh_bits(v: vec4f) -> vec4i {
    return bitcast<vec4i>(v);
}

// Which of four children the ray hits, as bits 0 to 3, from where it crosses their planes.
fn bvh_hit_four(
    enter_x: vec4f,
    enter_y: vec4f,
    enter_z: vec4f,
    leave_x: vec4f,
    leave_y: vec4f,
    leave_z: vec4f,
    t_min: f32,
    t_max: f32,
) -> u32 {
    // As whole numbers: `t_min` is not negative, and from zero on the bits of floats are in the order of their values. A
    // negative number is below all others either way.
    let enter = max(max(bvh_bits(enter_x), bvh_bits(enter_y)), max(bvh_bits(enter_z), vec4i(bitcast<i32>(t_min))));
    let leave = min(min(bvh_bits(leave_x), bvh_bits(leave_y)), min(bvh_bits(leave_z), vec4i(bitcast<i32>(t_max))));
    let hit = enter <= leave;
    var hits = 0u;
    if hit.x { hits = 1u; }
    if hit.y { hits |= 2u; }
    if hit.z { hits |= 4u; }
    if hit.w { hits |= 8u; }
    return hits;
}

// Which children of node `index` the ray hits: a bit for each slot. `grid` is that of the node.
fn bvh_hit_children(index: u32, grid: vec4u, ray: BvhRay, t_min: f32, t_max: f32) -> u32 {
    let exponents = vec3u(grid.w << 23u, grid.w << 15u, grid.w << 7u) & vec3u(0x7f800000u);
    let scale = bitcast<vec3f>(exponents) * ray.inverse;
    let corner = bitcast<vec3f>(grid.xyz) - ray.origin;
    let near = corner * ray.inverse - ray.room;
    let far = corner * ray.inverse + ray.room;
    // Going up along an axis, a ray enters through lower faces.
    let enter_x = bvh_planes(index, ray.faces.x);
    let leave_x = bvh_planes(index, ray.faces.x ^ 1u);
    let enter_y = bvh_planes(index, ray.faces.y);
    let leave_y = bvh_planes(index, ray.faces.y ^ 1u);
    let enter_z = bvh_planes(index, ray.faces.z);
    let leave_z = bvh_planes(index, ray.faces.z ^ 1u);
    let first = bvh_hit_four(
        bvh_crossings(enter_x.xy, scale.x, near.x),
        bvh_crossings(enter_y.xy, scale.y, near.y),
        bvh_crossings(enter_z.xy, scale.z, near.z),
        bvh_crossings(leave_x.xy, scale.x, far.x),
        bvh_crossings(leave_y.xy, scale.y, far.y),
        bvh_crossings(leave_z.xy, scale.z, far.z),
        t_min,
        t_max,
    );
    let second = bvh_hit_four(
        bvh_crossings(enter_x.zw, scale.x, near.x),
        bvh_crossings(enter_y.zw, scale.y, near.y),
        bvh_crossings(enter_z.zw, scale.z, near.z),
        bvh_crossings(leave_x.zw, scale.x, far.x),
        bvh_crossings(leave_y.zw, scale.y, far.y),
        bvh_crossings(leave_z.zw, scale.z, far.z),
        t_min,
        t_max,
    );
    return first | (second << 4u);
}

// Moves the bit of each slot to the place of its turn: the highest bit is visited first.
fn bvh_in_order(slots: u32, upwards: u32) -> u32 {
    var turns = slots;
    turns = select(turns, ((turns & 0x55u) << 1u) | ((turns >> 1u) & 0x55u), (upwards & 1u) != 0u);
    turns = select(turns, ((turns & 0x33u) << 2u) | ((turns >> 2u) & 0x33u), (upwards & 2u) != 0u);
    turns = select(turns, ((turns & 0x0fu) << 4u) | (turns >> 4u), (upwards & 4u) != 0u);
    return turns;
}

// The primitives in the leaves of some slots, as bits; `kinds` are those of slots 0 to 3 and 4 to 7.
fn bvh_in_leaves(slots: u32, kinds: vec2u) -> u32 {
    var leaves = slots;
    var primitives = 0u;
    while leaves != 0u {
        let slot = firstTrailingBit(leaves);
        leaves &= leaves - 1u;
        let kind = select(kinds.x, kinds.y, slot >= 4u) >> (8u * (slot & 3u));
        primitives |= ((kind >> 5u) & 7u) << (kind & 31u);
    }
    return primitives;
}

// Whether a query may start: a direction, an interval, and nothing infinite or NaN.
fn bvh_is_valid(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32) -> bool {
    let size = abs(direction);
    let largest = vec3f(3.4028234e38);
    return all(abs(origin) <= largest) && all(size <= largest) && max(size.x, max(size.y, size.z)) > 0.0 && t_min < t_max;
}

// The ray as it enters instance `index` of the upper level.
fn bvh_enter(index: u32, origin: vec3f, direction: vec3f) -> BvhRay {
    var o = origin;
    var d = direction;
    if (bvh_instances[index].flags & BVH_INSTANCE_IDENTITY) == 0u {
#ifdef SCENE_MOVES
        let to_object = world_to_object_now(bvh_instances[index].index);
        o = transform_point(to_object, origin);
        d = transform_vector(to_object, direction);
#else
        o = transform_point(bvh_instances[index].world_to_object, origin);
        d = transform_vector(bvh_instances[index].world_to_object, direction);
#endif
    }
    return bvh_ray(o, d, bvh_instances[index].extent);
}

// Tests primitive `index` of an instance, or where instances are joined, of the one that it belongs to. A hit nearer than `hit` takes
// its place.
fn bvh_test(
    index: u32,
    instance: u32,
    has_spheres: bool,
    ray: BvhRay,
    t_min: f32,
    salt: u32,
    hit: ptr<function, Hit>,
) {
    let p = bvh_primitive(index);
    let a = bitcast<vec3f>(p.a.xyz);
    let b = bitcast<vec3f>(p.b.xyz);
    var owner = instance;
    var is_sphere = has_spheres;
    if BVH_JOINED {
        owner = p.c.w & ~BVH_OWNER_SPHERE;
        is_sphere = (p.c.w & BVH_OWNER_SPHERE) != 0u;
    }
    if BVH_HAS_SPHERES && (is_sphere || !BVH_HAS_TRIANGLES) {
        let sphere = vec4f(a, b.x);
        let t = sphere_crossing(owner, p.b.w, p.a.w, sphere, ray.origin, ray.direction, t_min, (*hit).t);
        if t > t_min {
            *hit = Hit(t, 0.0, 0.0, owner, p.b.w, p.a.w);
        }
    } else {
        let c = bitcast<vec3f>(p.c.xyz);
        let h = intersect_triangle(ray.origin, ray.shear, a, b, c, t_min, (*hit).t);
        if h.hit && (!SCENE_HAS_ALPHA || alpha_accepts(owner, p.b.w, p.a.w, h.u, h.v, ray.direction, salt)) {
            *hit = Hit(h.t, h.u, h.v, owner, p.b.w, p.a.w);
        }
    }
}
