// The tracer that needs no ray tracing hardware: a walk through our own compressed eight-wide hierarchy.
//
// Method: Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017.
// `accel::encode`'s `walk.rs` takes the same steps on the host.
//
// There are two walks in this text: where BVH_BELOW is defined, walks begin at entries, nodes below the root
// (`bvh_entries.wgsl`); elsewhere they begin at the root. They are made two before a compiler sees them, because even dead
// code changes what compilers make of the rest.

#ifdef BVH_BELOW
#import bvh_entries
#endif
#import bvh_nodes, bvh_records, bvh_scene, scene
#import optics::constants

// The nearest hit, or with `any` the first that is found.
//
// With BVH_TURNS each turn visits at most one node and tests at most one primitive. Threads that run in step take their turns
// together: a loop over the primitives of a node has most of them wait for those that have more. In small hierarchies all
// have about as many, and the turns themselves cost more.
fn bvh_walk(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32, any: bool) -> Hit {
    var hit = Hit(t_max, 0.0, 0.0, NONE, NONE, NONE);
    let start = max(t_min, 0.0);
    // Who is content with any hit visits children as they come: their order saves no box, and costs work at every node.
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
#ifdef BVH_BELOW
    // The entries that are left, and which structure's space the ray is in.
    var entries = 0u;
    var space = 0u;
#endif
    // Nodes: their base index; hits in the upper eight bits and slots that hold nodes in the lower eight.
    var nodes = vec2u(world_root, 0x80000000u);
    // Primitives or instances, which come before the next node: their base index and hits.
    var primitives = vec2u(0u);
#ifdef BVH_BELOW
    entries = bvh_entries(ray, origin, direction, start, t_max);
    nodes.y = 0u;
#endif
    loop {
#ifndef BVH_BELOW
        if primitives.y == 0u {
#else
        if primitives.y == 0u && (nodes.y & BVH_NODES) != 0u {
#endif
            let bit = firstLeadingBit(nodes.y);
            nodes.y &= ~(1u << bit);
            if (nodes.y & BVH_NODES) != 0u {
                size = bvh_push(size, nodes);
            }
            let order = select(ray.upwards, 0u, any);
            let slot = (bit - 24u) ^ order;
            let index = nodes.x + countOneBits(nodes.y & 0xffu & ~(0xffffffffu << slot));
            let grid = bvh_grid(index);
            let links = bvh_links(index);
            let hits = bvh_hit_children(index, grid, ray, start, hit.t);
            let inner = grid.w >> 24u;
            nodes = vec2u(links.x, (bvh_in_order(hits & inner, order) << 24u) | inner);
            primitives = vec2u(links.y, bvh_in_leaves(hits & ~inner, links.zw));
        }
        while primitives.y != 0u {
            let bit = firstLeadingBit(primitives.y);
            let index = primitives.x + bit;
            primitives.y &= ~(1u << bit);
            if BVH_SINGLE || inside {
                bvh_test(index, instance, is_sphere, ray, start, salt, &hit);
                if any && hit.instance != NONE {
                    return hit;
                }
            } else {
                if primitives.y != 0u {
                    size = bvh_push(size, primitives);
                    primitives.y = 0u;
                }
                if (nodes.y & BVH_NODES) != 0u {
                    size = bvh_push(size, nodes);
                }
                upper_size = size;
                ray = bvh_enter(index, origin, direction);
                inside = true;
#ifdef BVH_BELOW
                space = index;
#endif
                instance = bvh_instances[index].index;
                is_sphere = (bvh_instances[index].flags & BVH_INSTANCE_SPHERES) != 0u;
                nodes = vec2u(bvh_instances[index].root, 0x80000000u);
            }
            if BVH_TURNS {
                break;
            }
        }
        if primitives.y == 0u && (nodes.y & BVH_NODES) == 0u {
#ifndef BVH_BELOW
            if !BVH_SINGLE && inside && size == upper_size {
#else
            if !BVH_SINGLE && inside && size == upper_size && size != 0u {
#endif
                inside = false;
#ifdef BVH_BELOW
                space = 0u;
#endif
                ray = bvh_ray(origin, direction, bvh_instances[0].extent);
            }
            if size == 0u {
#ifndef BVH_BELOW
                break;
#else
                if entries == 0u {
                    break;
                }
                let entry = bvh_entry(firstTrailingBit(entries));
                entries &= entries - 1u;
                if !BVH_SINGLE {
                    ray = bvh_ray_in_space(ray, space, bvh_space(entry.x), origin, direction);
                    space = bvh_space(entry.x);
                    inside = entry.x != 0u;
                    instance = bvh_instances[entry.x].index;
                    is_sphere = (bvh_instances[entry.x].flags & BVH_INSTANCE_SPHERES) != 0u;
                    upper_size = 0u;
                }
                nodes = vec2u(entry.y, 0x80000000u);
                continue;
#endif
            }
            size--;
            nodes = bvh_stack[size];
            if !BVH_SINGLE && (nodes.y & BVH_NODES) == 0u {
                primitives = nodes;
            }
        }
    }
    return hit;
}

fn trace_closest(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> Hit {
    return bvh_walk(origin, direction, t_min, t_max, salt, false);
}

fn trace_either(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32, any: bool) -> Hit {
    return bvh_walk(origin, direction, t_min, t_max, salt, any);
}

fn trace_any(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> bool {
    return bvh_walk(origin, direction, t_min, t_max, salt, true).instance != NONE;
}
