// The tracer that needs no ray tracing hardware: a walk through our own compressed eight-wide hierarchy.
//
// Method: Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017.
// The format is that of `accel::encode`, whose `walk.rs` takes the same steps on the host.
//
// The text in front of this one defines, besides the structures `BvhNode` to `BvhInstance` and their buffers:
//   BVH_STACK          how many groups may wait at a time
//   BVH_SINGLE         whether there is one instance that stands in the world as it is
//   BVH_HAS_TRIANGLES, BVH_HAS_SPHERES
//   fn bvh_node(index: u32) -> BvhNode, fn bvh_primitive(index: u32) -> BvhPrimitive

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
}

fn bvh_ray(origin: vec3f, direction: vec3f, extent: vec3f) -> BvhRay {
    let size = abs(direction);
    // Zero would give infinity, and infinity NaN. This is small enough to be parallel at any distance.
    let tiny = vec3f(max(max(size.x, max(size.y, size.z)) * 1e-24, 1e-37));
    let inverse = 1.0 / select(direction, select(-tiny, tiny, direction >= vec3f(0.0)), size < tiny);
    // Eight roundings: the reciprocal (2.5 units in the last place), the grid's corner, products and sums.
    let room = (abs(origin) + extent) * abs(inverse) * 9.5367431640625e-7;
    let up = select(vec3u(0u), vec3u(1u, 2u, 4u), inverse >= vec3f(0.0));
    return BvhRay(origin, direction, ray_shear(direction), inverse, room, up.x | up.y | up.z);
}

// Which of four children the ray hits, as bits 0 to 3.
fn bvh_hit_four(
    near: vec3u,
    far: vec3u,
    scale: vec3f,
    near_offset: vec3f,
    far_offset: vec3f,
    t_min: f32,
    t_max: f32,
) -> u32 {
    let enter_x = vec4f(unpack4xU8(near.x)) * scale.x + near_offset.x;
    let enter_y = vec4f(unpack4xU8(near.y)) * scale.y + near_offset.y;
    let enter_z = vec4f(unpack4xU8(near.z)) * scale.z + near_offset.z;
    let leave_x = vec4f(unpack4xU8(far.x)) * scale.x + far_offset.x;
    let leave_y = vec4f(unpack4xU8(far.y)) * scale.y + far_offset.y;
    let leave_z = vec4f(unpack4xU8(far.z)) * scale.z + far_offset.z;
    let enter = max(max(enter_x, enter_y), max(enter_z, vec4f(t_min)));
    let leave = min(min(leave_x, leave_y), min(leave_z, vec4f(t_max)));
    let hits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), enter <= leave);
    return (hits.x | hits.y) | (hits.z | hits.w);
}

// Which children of a node the ray hits: a bit for each slot.
fn bvh_hit_children(node: BvhNode, ray: BvhRay, t_min: f32, t_max: f32) -> u32 {
    let exponents = vec3u(node.grid.w << 23u, node.grid.w << 15u, node.grid.w << 7u) & vec3u(0x7f800000u);
    let scale = bitcast<vec3f>(exponents) * ray.inverse;
    let corner = bitcast<vec3f>(node.grid.xyz) - ray.origin;
    let near_offset = corner * ray.inverse - ray.room;
    let far_offset = corner * ray.inverse + ray.room;
    let low_x = node.planes_0.xy;
    let low_y = node.planes_0.zw;
    let low_z = node.planes_1.xy;
    let high_x = node.planes_1.zw;
    let high_y = node.planes_2.xy;
    let high_z = node.planes_2.zw;
    let up_x = (ray.upwards & 1u) != 0u;
    let up_y = (ray.upwards & 2u) != 0u;
    let up_z = (ray.upwards & 4u) != 0u;
    let near_x = select(high_x, low_x, up_x);
    let near_y = select(high_y, low_y, up_y);
    let near_z = select(high_z, low_z, up_z);
    let far_x = select(low_x, high_x, up_x);
    let far_y = select(low_y, high_y, up_y);
    let far_z = select(low_z, high_z, up_z);
    return bvh_hit_four(
        vec3u(near_x.x, near_y.x, near_z.x),
        vec3u(far_x.x, far_y.x, far_z.x),
        scale, near_offset, far_offset, t_min, t_max,
    ) | (bvh_hit_four(
        vec3u(near_x.y, near_y.y, near_z.y),
        vec3u(far_x.y, far_y.y, far_z.y),
        scale, near_offset, far_offset, t_min, t_max,
    ) << 4u);
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
        o = transform_point(bvh_instances[index].world_to_object, origin);
        d = transform_vector(bvh_instances[index].world_to_object, direction);
    }
    return bvh_ray(o, d, bvh_instances[index].extent);
}

// The nearest hit, or with `any` the first that is found.
fn bvh_walk(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32, any: bool) -> Hit {
    var hit = Hit(t_max, 0.0, 0.0, NONE, NONE, NONE);
    let start = max(t_min, 0.0);
    let world_root = bvh_instances[0].root;
    if world_root == NONE || !bvh_is_valid(origin, direction, start, t_max) {
        return hit;
    }
    var ray = bvh_ray(origin, direction, bvh_instances[0].extent);
    // The instance that the walk is in, and how much of the stack belongs to the upper level.
    var inside = BVH_SINGLE;
    var instance = bvh_instances[0].index;
    var is_sphere = (bvh_instances[0].flags & BVH_INSTANCE_SPHERES) != 0u;
    var upper_size = 0u;
    var size = 0u;
    // Nodes: their base index; hits in the upper eight bits and slots that hold nodes in the lower eight.
    var nodes = vec2u(world_root, 0x80000000u);
    loop {
        // Primitives or instances: their base index and hits.
        var primitives = nodes;
        if (nodes.y & BVH_NODES) != 0u {
            let bit = firstLeadingBit(nodes.y);
            nodes.y &= ~(1u << bit);
            if (nodes.y & BVH_NODES) != 0u {
                size = bvh_push(size, nodes);
            }
            let slot = (bit - 24u) ^ ray.upwards;
            let node = bvh_node(nodes.x + countOneBits(nodes.y & 0xffu & ~(0xffffffffu << slot)));
            let hits = bvh_hit_children(node, ray, start, hit.t);
            let inner = node.grid.w >> 24u;
            nodes = vec2u(node.links.x, (bvh_in_order(hits & inner, ray.upwards) << 24u) | inner);
            primitives = vec2u(node.links.y, bvh_in_leaves(hits & ~inner, node.links.zw));
        } else {
            nodes.y = 0u;
        }
        if BVH_SINGLE || inside {
            while primitives.y != 0u {
                let bit = firstLeadingBit(primitives.y);
                primitives.y &= ~(1u << bit);
                let p = bvh_primitive(primitives.x + bit);
                let a = bitcast<vec3f>(p.a.xyz);
                let b = bitcast<vec3f>(p.b.xyz);
                if BVH_HAS_SPHERES && (is_sphere || !BVH_HAS_TRIANGLES) {
                    let s = intersect_sphere(ray.origin, ray.direction, a, b.x);
                    let t = select(s.far, s.near, s.near > start);
                    // Spheres have no holes.
                    if s.hit && t > start && t < hit.t {
                        hit = Hit(t, 0.0, 0.0, instance, p.b.w, p.a.w);
                    }
                } else {
                    let c = bitcast<vec3f>(p.c.xyz);
                    let h = intersect_triangle(ray.origin, ray.shear, a, b, c, start, hit.t);
                    if h.hit && (!SCENE_HAS_ALPHA || alpha_accepts(instance, p.b.w, p.a.w, h.u, h.v, salt)) {
                        hit = Hit(h.t, h.u, h.v, instance, p.b.w, p.a.w);
                    }
                }
                if any && hit.instance != NONE {
                    return hit;
                }
            }
        } else if primitives.y != 0u {
            let bit = firstLeadingBit(primitives.y);
            primitives.y &= ~(1u << bit);
            if primitives.y != 0u {
                size = bvh_push(size, primitives);
            }
            if (nodes.y & BVH_NODES) != 0u {
                size = bvh_push(size, nodes);
            }
            upper_size = size;
            let index = primitives.x + bit;
            ray = bvh_enter(index, origin, direction);
            inside = true;
            instance = bvh_instances[index].index;
            is_sphere = (bvh_instances[index].flags & BVH_INSTANCE_SPHERES) != 0u;
            nodes = vec2u(bvh_instances[index].root, 0x80000000u);
        }
        if (nodes.y & BVH_NODES) == 0u {
            if !BVH_SINGLE && inside && size == upper_size {
                inside = false;
                ray = bvh_ray(origin, direction, bvh_instances[0].extent);
            }
            if size == 0u {
                break;
            }
            size--;
            nodes = bvh_stack[size];
        }
    }
    return hit;
}

fn trace_closest(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> Hit {
    return bvh_walk(origin, direction, t_min, t_max, salt, false);
}

fn trace_any(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> bool {
    return bvh_walk(origin, direction, t_min, t_max, salt, true).instance != NONE;
}
