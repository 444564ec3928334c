// Shafts: where the shadow rays from a tile of pixels to one light may pass.
//
// The rays of neighbouring pixels to a light take nearly the same way through the upper levels of the hierarchy. So that way is
// taken once for all of a tile: by the hull of where its rays begin and where they end. What is left of it is a short list of nodes
// that the hull touches; each ray begins its walk at those of them whose boxes it hits. Where the list is empty, nothing can be in
// the way, and no ray is traced.
//
// The hull of two boxes is all that a box passes which moves from the one to the other, so whether it touches a third box is asked
// as for a ray: within which interval of the way do they overlap along each axis?
//
// Sources: Haines and Wallace, "Shaft Culling for Efficient Ray-Cast Radiosity", EGWR 1991; Reshetov, Soupikov and Hurley,
// "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005, for beginning below the root.
//
// This file makes the lists; `hybrid_shaft_rays.wgsl` uses them.

#import bvh_entries, bvh_nodes, bvh_records, bvh_scene, hybrid_frame, hybrid_pixels
#import hybrid_shaft_lists, lights, shaft_numbers, surface, texels
#import optics::bounds, optics::constants, optics::shaft

// The corners of where a tile's rays begin, as whole numbers in the order of their values.
var<workgroup> tile_low: array<atomic<u32>, 3>;
var<workgroup> tile_high: array<atomic<u32>, 3>;

fn in_order(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

fn from_order(bits: u32) -> f32 {
    return bitcast<f32>(select(~bits, bits & 0x7fffffffu, (bits & 0x80000000u) != 0u));
}

fn include_pixel(id: vec2u) {
    let pixel = pixel_in_rows(vec3u(id, 0u));
    let hit = first_hit(pixel_number(pixel));
    if hit.instance == NONE {
        return;
    }
    let ray = frame_ray(pixel);
    let s = surface_at(ray.origin, ray.direction, hit);
    let origins = box_of_two(ray_origin(s, true), ray_origin(s, false));
    for (var axis = 0u; axis < 3u; axis++) {
        atomicMin(&tile_low[axis], in_order(origins.low[axis]));
        atomicMax(&tile_high[axis], in_order(origins.high[axis]));
    }
}

/// The box around where a tile's shadow rays begin.
@compute @workgroup_size(8, 8)
fn tile_bounds(
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    if number < 3u {
        atomicStore(&tile_low[number], 0xffffffffu);
        atomicStore(&tile_high[number], 0u);
    }
    workgroupBarrier();
    for (var y = local.y; y < SHAFT_TILE; y += 8u) {
        for (var x = local.x; x < SHAFT_TILE; x += 8u) {
            let id = SHAFT_TILE * tile.xy + vec2u(x, y);
            if is_in_rows(vec3u(id, 0u)) {
                include_pixel(id);
            }
        }
    }
    workgroupBarrier();
    let tiles = shaft_tiles();
    if number == 0u && tile.x < tiles.x && tile.y < tiles.y {
        var low = vec3f(FAR);
        var high = vec3f(-FAR);
        if atomicLoad(&tile_low[0]) <= atomicLoad(&tile_high[0]) {
            for (var axis = 0u; axis < 3u; axis++) {
                low[axis] = from_order(atomicLoad(&tile_low[axis]));
                high[axis] = from_order(atomicLoad(&tile_high[axis]));
            }
        }
        let at = tile_bounds_at(tile.y * tiles.x + tile.x);
        light_masks[at] = vec4u(bitcast<vec3u>(low), 0u);
        light_masks[at + 1u] = vec4u(bitcast<vec3u>(high), 0u);
    }
}

/// A shaft in the space of structure `index`.
fn shaft_in(index: u32, shaft: Shaft) -> ShaftRay {
    let extent = bvh_instances[index].extent;
    if (bvh_instances[index].flags & BVH_INSTANCE_IDENTITY) != 0u {
        return shaft_ray(shaft_ends(shaft), extent);
    }
    let rows = bvh_instances[index].world_to_object;
    return shaft_ray(shaft_ends_in(shaft, rows[0], rows[1], rows[2]), extent);
}

/// Which of four children a shaft touches along one axis: what is left of where on its way it is in them so far.
fn shaft_axis(
    lower: vec2u,
    upper: vec2u,
    scale: f32,
    corner: f32,
    low: f32,
    high: f32,
    low_inverse: f32,
    high_inverse: f32,
    interval: ShaftInterval,
) -> ShaftInterval {
    let over = shaft_crossing(scale, corner, high, high_inverse);
    let under = shaft_crossing(scale, corner, low, low_inverse);
    return shaft_within(interval, bvh_crossings(lower, over.x, over.y), bvh_crossings(upper, under.x, under.y),
        low_inverse, high_inverse);
}

fn grid_scale(grid: vec4u) -> vec3f {
    return bitcast<vec3f>(vec3u(grid.w << 23u, grid.w << 15u, grid.w << 7u) & vec3u(0x7f800000u));
}

/// Which of four children a shaft touches, as bits 0 to 3; planes along x, y and z.
fn shaft_four(lower: array<vec2u, 3>, upper: array<vec2u, 3>, grid: vec4u, shaft: ShaftRay) -> u32 {
    let scale = grid_scale(grid);
    let corner = bitcast<vec3f>(grid.xyz);
    var interval = ShaftInterval(vec4f(0.0), vec4f(1.0));
    interval = shaft_axis(lower[0], upper[0], scale.x, corner.x, shaft.low.x, shaft.high.x, shaft.low_inverse.x,
        shaft.high_inverse.x, interval);
    interval = shaft_axis(lower[1], upper[1], scale.y, corner.y, shaft.low.y, shaft.high.y, shaft.low_inverse.y,
        shaft.high_inverse.y, interval);
    interval = shaft_axis(lower[2], upper[2], scale.z, corner.z, shaft.low.z, shaft.high.z, shaft.low_inverse.z,
        shaft.high_inverse.z, interval);
    let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), interval.first <= interval.last);
    return bits.x | bits.y | bits.z | bits.w;
}

/// Which children of a node a shaft touches, a bit for each slot.
fn shaft_children(index: u32, grid: vec4u, shaft: ShaftRay) -> u32 {
    let x = array<vec4u, 2>(bvh_planes(index, 0u), bvh_planes(index, 1u));
    let y = array<vec4u, 2>(bvh_planes(index, 2u), bvh_planes(index, 3u));
    let z = array<vec4u, 2>(bvh_planes(index, 4u), bvh_planes(index, 5u));
    let first = shaft_four(
        array<vec2u, 3>(x[0].xy, y[0].xy, z[0].xy), array<vec2u, 3>(x[1].xy, y[1].xy, z[1].xy), grid, shaft);
    let second = shaft_four(
        array<vec2u, 3>(x[0].zw, y[0].zw, z[0].zw), array<vec2u, 3>(x[1].zw, y[1].zw, z[1].zw), grid, shaft);
    return first | (second << 4u);
}

/// Where a walk may begin.
struct Entry {
    structure: u32,
    node: u32,
    /// The node that it is a child of, and in which slot; NONE: it is a root.
    parent: u32,
    slot: u32,
}

// Entries that may be divided further, as a ring: the oldest first, so that all get to about the same depth.
var<private> entry_ring: array<Entry, SHAFT_ENTRIES>;

fn root_entry(structure: u32) -> Entry {
    return Entry(structure, bvh_instances[structure].root, NONE, 0u);
}

/// One of the eight numbers of planes.
fn plane_in_slot(planes: vec4u, slot: u32) -> f32 {
    let pair = unpack2x16float(planes[slot >> 1u]);
    return select(pair.x, pair.y, (slot & 1u) != 0u);
}

fn store_entry(list: u32, number: u32, entry: Entry) {
    var low = vec3f(-FAR);
    var high = vec3f(FAR);
    if entry.parent != NONE {
        let grid = bvh_grid(entry.parent);
        let scale = grid_scale(grid);
        let corner = bitcast<vec3f>(grid.xyz);
        low = grid_point(corner, scale, vec3f(
            plane_in_slot(bvh_planes(entry.parent, 0u), entry.slot),
            plane_in_slot(bvh_planes(entry.parent, 2u), entry.slot),
            plane_in_slot(bvh_planes(entry.parent, 4u), entry.slot),
        ));
        high = grid_point(corner, scale, vec3f(
            plane_in_slot(bvh_planes(entry.parent, 1u), entry.slot),
            plane_in_slot(bvh_planes(entry.parent, 3u), entry.slot),
            plane_in_slot(bvh_planes(entry.parent, 5u), entry.slot),
        ));
    }
    let at = list + 1u + 2u * number;
    light_masks[at] = vec4u(bitcast<vec3u>(low), entry.structure);
    light_masks[at + 1u] = vec4u(bitcast<vec3u>(high), entry.node);
}

/// The list of a shaft, written from word `list` on.
fn write_shaft_list(list: u32, shaft: Shaft) {
    var stored = 0u;
    var first = 0u;
    var size = 0u;
    if bvh_instances[0].root != NONE {
        entry_ring[0] = root_entry(0u);
        size = 1u;
    }
    var space = 0u;
    var there = shaft_in(space, shaft);
    while size > 0u && shaft.known {
        let entry = entry_ring[first];
        if !BVH_SINGLE && bvh_space(entry.structure) != space {
            space = bvh_space(entry.structure);
            there = shaft_in(space, shaft);
        }
        first = (first + 1u) % SHAFT_ENTRIES;
        size--;
        let is_world = !BVH_SINGLE && entry.structure == 0u;
        let grid = bvh_grid(entry.node);
        let links = bvh_links(entry.node);
        let inner = grid.w >> 24u;
        let touched = shaft_children(entry.node, grid, there);
        var instances_touched = bvh_in_leaves(touched & ~inner, links.zw);
        var nodes_touched = touched & inner;
        let more = countOneBits(nodes_touched) + countOneBits(instances_touched);
        if (!is_world && instances_touched != 0u) || stored + size + more > SHAFT_ENTRIES {
            store_entry(list, stored, entry);
            stored++;
            continue;
        }
        while nodes_touched != 0u {
            let slot = firstTrailingBit(nodes_touched);
            nodes_touched &= nodes_touched - 1u;
            let child = links.x + countOneBits(inner & ~(0xffffffffu << slot));
            entry_ring[(first + size) % SHAFT_ENTRIES] = Entry(entry.structure, child, entry.node, slot);
            size++;
        }
        while instances_touched != 0u {
            let index = links.y + firstTrailingBit(instances_touched);
            instances_touched &= instances_touched - 1u;
            entry_ring[(first + size) % SHAFT_ENTRIES] = root_entry(index);
            size++;
        }
    }
    if size > 0u {
        store_entry(list, stored, entry_ring[first]);
        stored++;
    }
    light_masks[list] = vec4u(stored);
}

/// The list of every tile and light.
@compute @workgroup_size(64)
fn shafts(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = flat_index(id, groups);
    let tiles = shaft_tiles();
    let light = index / (tiles.x * tiles.y);
    let tile = index % (tiles.x * tiles.y);
    if light >= scene.light_count {
        return;
    }
    let at = tile_bounds_at(tile);
    let low = bitcast<vec3f>(light_masks[at].xyz);
    let high = bitcast<vec3f>(light_masks[at + 1u].xyz);
    // Tiles without a surface have no rays.
    if low.x <= high.x {
        write_shaft_list(shaft_list(tile, light), light_shaft(load_light(light), low, high, bvh_instances[0].extent));
    }
}
