// Subgroup packet traversal, for rays that go nearly the same way, such as those through one pixel: all rays of a subgroup walk
// together.
//
// At a node each invocation tests one of the eight boxes, against all of the rays at once (two where a subgroup is only four); in a
// leaf each tests the primitives with its own ray. A visit costs what one box costs, not eight, and no invocation waits for others
// that are elsewhere. What a ray finds is what it finds alone: it meets at least the nodes that it would meet alone, in the same order.
//
// Method: Wald, Slusallek, Benthin and Wagner, "Interactive Rendering with Coherent Ray Tracing", Eurographics 2001, for rays that walk
// together; Boulos, Wald and Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006, for bounds of all
// of them by interval arithmetic; Günther, Popov, Seidel and Slusallek, "Realtime Ray Tracing on GPU with BVH-based Packet Traversal",
// RT 2007, for the stack that they share.

#import bvh_beam_boxes, bvh_nodes, bvh_records, bvh_scene, scene, tracer_bvh
#import optics::constants

// What the rays of a subgroup have in common, in the space of a structure.
struct BvhBeam {
    // Where planes are measured from: the origin of one of the rays.
    anchor: vec3f,
    // The least and the greatest `BvhRay.inverse`.
    inverse_low: vec3f,
    inverse_high: vec3f,
    // What origins that are elsewhere, and rounding, change at the least and at the most of where rays cross planes.
    near: vec3f,
    far: vec3f,
    // As in BvhRay.
    upwards: u32,
    faces: vec3u,
    // Which of the BVH_BEAM_BOXES boxes that are tested at a time this invocation tests. The first invocations of a subgroup do so in the
    // order of visits, the last first; others do the same once more.
    part: u32,
}

// Whether all rays go the same way along each axis, and those are there that test boxes. Only such rays have a beam.
fn bvh_is_narrow(ray: BvhRay) -> bool {
    const TESTERS: u32 = (1u << BVH_BEAM_BOXES) - 1u;
    return subgroupAll(ray.upwards == subgroupBroadcastFirst(ray.upwards))
        && (subgroupBallot(true).x & TESTERS) == TESTERS;
}

fn bvh_beam(ray: BvhRay) -> BvhBeam {
    let anchor = subgroupBroadcastFirst(ray.origin);
    let offset = (anchor - ray.origin) * ray.inverse;
    return BvhBeam(
        anchor,
        subgroupMin(ray.inverse),
        subgroupMax(ray.inverse),
        subgroupMin(offset - ray.room),
        subgroupMax(offset + ray.room),
        ray.upwards,
        ray.faces,
        subgroupExclusiveAdd(1u) & (BVH_BEAM_BOXES - 1u),
    );
}

// Faces of the box in `slot` of node `index` along the three axes, in grid steps.
fn bvh_box_faces(index: u32, faces: vec3u, slot: u32) -> vec3f {
    let pair = slot >> 1u;
    let shift = 16u * (slot & 1u);
    return vec3f(
        unpack2x16float(bvh_plane_pair(index, faces.x, pair) >> shift).x,
        unpack2x16float(bvh_plane_pair(index, faces.y, pair) >> shift).x,
        unpack2x16float(bvh_plane_pair(index, faces.z, pair) >> shift).x,
    );
}

// Whether a ray of the beam may hit the box in `slot` of node `index` between `t_min` and `t_max`. `grid` is the node's.
fn bvh_beam_hits(index: u32, grid: vec4u, slot: u32, beam: BvhBeam, t_min: f32, t_max: f32) -> bool {
    let step = bitcast<vec3f>(vec3u(grid.w << 23u, grid.w << 15u, grid.w << 7u) & vec3u(0x7f800000u));
    let corner = bitcast<vec3f>(grid.xyz) - beam.anchor;
    let enter = bvh_box_faces(index, beam.faces, slot) * step + corner;
    let leave = bvh_box_faces(index, beam.faces ^ vec3u(1u), slot) * step + corner;
    let first = min(enter * beam.inverse_low, enter * beam.inverse_high) + beam.near;
    let last = max(leave * beam.inverse_low, leave * beam.inverse_high) + beam.far;
    return max(max(first.x, first.y), max(first.z, t_min)) <= min(min(last.x, last.y), min(last.z, t_max));
}

// What rays of the beam may hit in node `index`: bits of inner children in the order of visits, and of primitives in its leaves.
fn bvh_beam_visits(index: u32, grid: vec4u, kinds: vec2u, beam: BvhBeam, t_min: f32, t_max: f32) -> vec2u {
    let inner = grid.w >> 24u;
    var children = 0u;
    var primitives = 0u;
    for (var boxes = 0u; boxes < 8u; boxes += BVH_BEAM_BOXES) {
        let slot = (boxes + beam.part) ^ beam.upwards;
        let is_hit = bvh_beam_hits(index, grid, slot, beam, t_min, t_max);
        let is_inner = ((inner >> slot) & 1u) != 0u;
        let hits = subgroupBallot(is_hit && is_inner).x & ((1u << BVH_BEAM_BOXES) - 1u);
        children |= hits << boxes;
        let kind = select(kinds.x, kinds.y, slot >= 4u) >> (8u * (slot & 3u));
        primitives |= select(0u, ((kind >> 5u) & 7u) << (kind & 31u), is_hit && !is_inner);
    }
    return vec2u(children, subgroupOr(primitives));
}

// The largest number of the subgroup; none is negative.
fn bvh_largest(t: f32) -> f32 {
    return bitcast<f32>(subgroupMax(bitcast<u32>(t)));
}

// The nearest hit of every ray. All invocations of a subgroup have to ask; for those that are not `wanted` nothing is found.
fn trace_closest_packet(
    ray_origin: vec3f,
    ray_direction: vec3f,
    t_min: f32,
    t_max: f32,
    salt: u32,
    wanted: bool,
) -> Hit {
    let nothing = Hit(t_max, 0.0, 0.0, NONE, NONE, NONE);
    let start = max(t_min, 0.0);
    let asks = wanted && bvh_is_valid(ray_origin, ray_direction, start, t_max);
    let world_root = bvh_instances[0].root;
    let leader = subgroupMin(select(NONE, subgroupExclusiveAdd(1u), asks));
    if world_root == NONE || leader == NONE {
        return nothing;
    }
    // Who asks nothing walks along with one who does, and its own interval is empty.
    let origin = select(subgroupShuffle(ray_origin, leader), ray_origin, asks);
    let direction = select(subgroupShuffle(ray_direction, leader), ray_direction, asks);
    var ray = bvh_ray(origin, direction, bvh_instances[0].extent);
    if !bvh_is_narrow(ray) {
        return bvh_walk(ray_origin, ray_direction, t_min, select(t_min, t_max, wanted), salt, false);
    }
    var beam = bvh_beam(ray);
    var hit = nothing;
    hit.t = select(start, t_max, asks);
    let first_start = bitcast<f32>(subgroupMin(bitcast<u32>(select(t_max, start, asks))));
    var last_end = bvh_largest(hit.t);
    // As in `bvh_walk`.
    var inside = BVH_SINGLE;
    var instance = bvh_instances[0].index;
    var has_spheres = (bvh_instances[0].flags & BVH_INSTANCE_SPHERES) != 0u;
    var upper_size = 0u;
    var size = 0u;
    var nodes = vec2u(world_root, 0x80000000u);
    var primitives = vec2u(0u);
    loop {
        if primitives.y == 0u {
            let bit = firstLeadingBit(nodes.y);
            nodes.y &= ~(1u << bit);
            if (nodes.y & BVH_NODES) != 0u {
                size = bvh_push(size, nodes);
            }
            let visited = (bit - 24u) ^ beam.upwards;
            let index = nodes.x + countOneBits(nodes.y & 0xffu & ~(0xffffffffu << visited));
            let grid = bvh_grid(index);
            let links = bvh_links(index);
            let hits = bvh_beam_visits(index, grid, links.zw, beam, first_start, last_end);
            nodes = vec2u(links.x, (hits.x << 24u) | (grid.w >> 24u));
            primitives = vec2u(links.y, hits.y);
        }
        if primitives.y != 0u && (BVH_SINGLE || inside) {
            while primitives.y != 0u {
                let bit = firstLeadingBit(primitives.y);
                primitives.y &= ~(1u << bit);
                bvh_test(primitives.x + bit, instance, has_spheres, ray, start, salt, &hit);
            }
            last_end = bvh_largest(hit.t);
        } else if primitives.y != 0u {
            let bit = firstLeadingBit(primitives.y);
            let index = primitives.x + bit;
            primitives.y &= ~(1u << bit);
            if primitives.y != 0u {
                size = bvh_push(size, primitives);
                primitives.y = 0u;
            }
            if (nodes.y & BVH_NODES) != 0u {
                size = bvh_push(size, nodes);
            }
            upper_size = size;
            ray = bvh_enter(index, origin, direction);
            if !bvh_is_narrow(ray) {
                return bvh_walk(ray_origin, ray_direction, t_min, select(t_min, t_max, wanted), salt, false);
            }
            beam = bvh_beam(ray);
            inside = true;
            instance = bvh_instances[index].index;
            has_spheres = (bvh_instances[index].flags & BVH_INSTANCE_SPHERES) != 0u;
            nodes = vec2u(bvh_instances[index].root, 0x80000000u);
        }
        if primitives.y == 0u && (nodes.y & BVH_NODES) == 0u {
            if !BVH_SINGLE && inside && size == upper_size {
                inside = false;
                ray = bvh_ray(origin, direction, bvh_instances[0].extent);
                beam = bvh_beam(ray);
            }
            if size == 0u {
                break;
            }
            size--;
            nodes = bvh_stack[size];
            if !BVH_SINGLE && (nodes.y & BVH_NODES) == 0u {
                primitives = nodes;
            }
        }
    }
    if !asks {
        return nothing;
    }
    return hit;
}
