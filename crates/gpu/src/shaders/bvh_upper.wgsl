// The upper level of our own hierarchy, built or refitted on the device for instances that move every frame.
//
// Instances are sorted along a curve that fills space; eight in a row become a node, eight nodes in a row a node above, up to
// the root. There are no pointers to find: where a node and its children stand follows from their numbers. A refit keeps the
// order of the last build.
//
// Method: Kamel and Faloutsos, "On Packing R-trees", CIKM 1993, with Morton's curve; nodes as in `accel::encode`. The order of
// siblings along the curve is that of octants, which is what slots mean.

struct UpperInfo {
    /// Instances, and the power of two from there on that is sorted.
    count: u32,
    sorted: u32,
    /// Levels of nodes.
    levels: u32,
    /// Level of this dispatch, from 0 above the instances.
    level: u32,
    /// Of the sort: size of the sequences that are merged, and distance of the pairs that are compared.
    size: u32,
    distance: u32,
    padding0: u32,
    padding1: u32,
}

/// What is known of a bottom-level structure.
struct UpperObject {
    low: vec3f,
    root: u32,
    high: vec3f,
    /// BVH_INSTANCE_SPHERES.
    flags: u32,
}

/// Rows of a 3×4 matrix from object to world space.
struct UpperPlace {
    rows: array<vec4f, 3>,
}

struct UpperBox {
    low: vec3f,
    /// Number of the instance, for boxes of instances.
    instance: u32,
    high: vec3f,
    padding: u32,
}

/// Eight boxes; see `bvh_records.wgsl`.
struct UpperNode {
    grid: vec4u,
    links: vec4u,
    planes: array<vec4u, 6>,
}

struct UpperInstance {
    world_to_object: array<vec4f, 3>,
    extent: vec3f,
    root: u32,
    index: u32,
    flags: u32,
    unused: vec2u,
}

/// As `Instance` of `scene.wgsl`.
struct SceneInstance {
    object_to_world: array<vec4f, 3>,
    world_to_object: array<vec4f, 3>,
    first_binding: u32,
    flags: u32,
    blas: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> info: UpperInfo;
@group(0) @binding(1) var<storage, read> objects: array<UpperObject>;
@group(0) @binding(2) var<storage, read> places: array<UpperPlace>;
@group(0) @binding(3) var<storage, read_write> scene_instances: array<SceneInstance>;
/// Boxes of the instances by number, then those of the nodes.
@group(0) @binding(4) var<storage, read_write> boxes: array<UpperBox>;
/// Place on the curve, and number of the instance.
@group(0) @binding(5) var<storage, read_write> order: array<vec2u>;
/// Bounds of all boxes' centres, as whole numbers in the order of floats: low corner, high corner.
@group(0) @binding(6) var<storage, read_write> bounds: array<atomic<u32>, 6>;
@group(0) @binding(7) var<storage, read_write> nodes: array<UpperNode>;
@group(0) @binding(8) var<storage, read_write> upper_instances: array<UpperInstance>;

const NOTHING: u32 = 0xffffffffu;
const SCENE_IDENTITY: u32 = 1u;
const SCENE_MIRRORED: u32 = 2u;
const UPPER_IDENTITY: u32 = 1u;

fn flat_index(id: vec3u, groups: vec3u) -> u32 {
    return id.y * groups.x * 256u + id.x;
}

/// A whole number for each float, in the same order.
fn ordered(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

fn unordered(bits: u32) -> f32 {
    return bitcast<f32>(select(~bits, bits & 0x7fffffffu, (bits & 0x80000000u) != 0u));
}

fn is_empty(b: UpperBox) -> bool {
    return !(b.low.x <= b.high.x && b.low.y <= b.high.y && b.low.z <= b.high.z);
}

fn is_usable(v: vec3f) -> bool {
    return all(abs(v) < vec3f(1e30));
}

/// Rows of the inverse; zeros if there is none.
fn inverse_rows(m: array<vec4f, 3>) -> array<vec4f, 3> {
    let x = cross(m[1].xyz, m[2].xyz);
    let y = cross(m[2].xyz, m[0].xyz);
    let z = cross(m[0].xyz, m[1].xyz);
    let det = dot(m[0].xyz, x);
    if !(abs(det) > 1e-30) {
        return array<vec4f, 3>(vec4f(0.0), vec4f(0.0), vec4f(0.0));
    }
    let shift = -(x * m[0].w + y * m[1].w + z * m[2].w) / det;
    return array<vec4f, 3>(
        vec4f(vec3f(x.x, y.x, z.x) / det, shift.x),
        vec4f(vec3f(x.y, y.y, z.y) / det, shift.y),
        vec4f(vec3f(x.z, y.z, z.z) / det, shift.z),
    );
}

fn is_identity(m: array<vec4f, 3>) -> bool {
    return all(m[0] == vec4f(1.0, 0.0, 0.0, 0.0)) && all(m[1] == vec4f(0.0, 1.0, 0.0, 0.0))
        && all(m[2] == vec4f(0.0, 0.0, 1.0, 0.0));
}

/// One axis of a transformed box, with room for the rounding of transformed rays: low, high.
fn transformed_axis(row: vec4f, low: vec3f, high: vec3f) -> vec2f {
    let a = row.xyz * low;
    let b = row.xyz * high;
    let small = min(a, b);
    let large = max(a, b);
    let size = max(abs(a), abs(b));
    let room = (abs(row.w) + size.x + size.y + size.z) * 1e-6;
    return vec2f(row.w + small.x + small.y + small.z - room, row.w + large.x + large.y + large.z + room);
}

var<workgroup> group_bounds: array<atomic<u32>, 6>;

@compute @workgroup_size(1)
fn clear_bounds() {
    for (var i = 0u; i < 3u; i++) {
        atomicStore(&bounds[i], 0xffffffffu);
        atomicStore(&bounds[i + 3u], 0u);
    }
}

/// Puts every instance in its place: the scene's record, its box, and the bounds of all. One without volume, or without an
/// inverse, is not there.
@compute @workgroup_size(256)
fn place(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    if local < 6u {
        atomicStore(&group_bounds[local], select(0u, 0xffffffffu, local < 3u));
    }
    workgroupBarrier();
    let i = flat_index(id, groups);
    if i < info.count {
        let rows = places[i].rows;
        let back = inverse_rows(rows);
        let object = objects[scene_instances[i].blas];
        var flags = 0u;
        if is_identity(rows) { flags |= SCENE_IDENTITY; }
        if dot(rows[0].xyz, cross(rows[1].xyz, rows[2].xyz)) < 0.0 { flags |= SCENE_MIRRORED; }
        scene_instances[i].object_to_world = rows;
        scene_instances[i].world_to_object = back;
        scene_instances[i].flags = flags;
        let x = transformed_axis(rows[0], object.low, object.high);
        let y = transformed_axis(rows[1], object.low, object.high);
        let z = transformed_axis(rows[2], object.low, object.high);
        var b = UpperBox(vec3f(x.x, y.x, z.x), i, vec3f(x.y, y.y, z.y), 0u);
        let there = object.root != NOTHING && any(back[0].xyz != vec3f(0.0)) && is_usable(b.low) && is_usable(b.high);
        if !there {
            b.low = vec3f(1.0);
            b.high = vec3f(-1.0);
        } else {
            let center = 0.5 * b.low + 0.5 * b.high;
            for (var axis = 0u; axis < 3u; axis++) {
                atomicMin(&group_bounds[axis], ordered(center[axis]));
                atomicMax(&group_bounds[axis + 3u], ordered(center[axis]));
            }
        }
        boxes[i] = b;
    }
    workgroupBarrier();
    if local < 3u {
        atomicMin(&bounds[local], atomicLoad(&group_bounds[local]));
    } else if local < 6u {
        atomicMax(&bounds[local], atomicLoad(&group_bounds[local]));
    }
}

/// Spreads the lower ten bits: two zeros after each.
fn spread(x: u32) -> u32 {
    var v = x & 0x3ffu;
    v = (v | (v << 16u)) & 0x030000ffu;
    v = (v | (v << 8u)) & 0x0300f00fu;
    v = (v | (v << 4u)) & 0x030c30c3u;
    return (v | (v << 2u)) & 0x09249249u;
}

/// Every instance's place on the curve; what is not there comes last.
@compute @workgroup_size(256)
fn find_keys(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = flat_index(id, groups);
    if i >= info.sorted {
        return;
    }
    var key = NOTHING;
    if i < info.count && !is_empty(boxes[i]) {
        let low = vec3f(unordered(atomicLoad(&bounds[0])), unordered(atomicLoad(&bounds[1])), unordered(atomicLoad(&bounds[2])));
        let high = vec3f(unordered(atomicLoad(&bounds[3])), unordered(atomicLoad(&bounds[4])), unordered(atomicLoad(&bounds[5])));
        let center = 0.5 * boxes[i].low + 0.5 * boxes[i].high;
        let at = vec3u(clamp((center - low) / max(high - low, vec3f(1e-30)), vec3f(0.0), vec3f(1.0)) * 1023.0);
        key = spread(at.x) | (spread(at.y) << 1u) | (spread(at.z) << 2u);
    }
    order[i] = vec2u(key, i);
}

fn comes_after(a: vec2u, b: vec2u) -> bool {
    return a.x > b.x || (a.x == b.x && a.y > b.y);
}

const SORTED_TOGETHER: u32 = 512u;
var<workgroup> together: array<vec2u, SORTED_TOGETHER>;

fn compare_together(at: u32, distance: u32, ascending: bool) {
    let a = together[at];
    let b = together[at + distance];
    if comes_after(a, b) == ascending {
        together[at] = b;
        together[at + distance] = a;
    }
}

/// A bitonic sort (Batcher 1968) of `SORTED_TOGETHER` neighbours, from sequences of `first_size` on.
fn sort_neighbours(group: u32, local: u32, first_size: u32, last_size: u32) {
    let base = group * SORTED_TOGETHER;
    together[local] = order[base + local];
    together[local + 256u] = order[base + local + 256u];
    for (var size = first_size; size <= last_size; size <<= 1u) {
        for (var distance = min(size, SORTED_TOGETHER) >> 1u; distance > 0u; distance >>= 1u) {
            workgroupBarrier();
            let at = ((local & ~(distance - 1u)) << 1u) | (local & (distance - 1u));
            compare_together(at, distance, ((base + at) & size) == 0u);
        }
    }
    workgroupBarrier();
    order[base + local] = together[local];
    order[base + local + 256u] = together[local + 256u];
}

/// Sorts each `SORTED_TOGETHER` neighbours.
@compute @workgroup_size(256)
fn sort_small(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    sort_neighbours(group.y * groups.x + group.x, local, 2u, SORTED_TOGETHER);
}

/// Compares pairs that are farther apart.
@compute @workgroup_size(256)
fn sort_far(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pair = flat_index(id, groups);
    let at = ((pair & ~(info.distance - 1u)) << 1u) | (pair & (info.distance - 1u));
    if at + info.distance >= info.sorted {
        return;
    }
    let a = order[at];
    let b = order[at + info.distance];
    if comes_after(a, b) == ((at & info.size) == 0u) {
        order[at] = b;
        order[at + info.distance] = a;
    }
}

/// What is left of a merge when pairs are near.
@compute @workgroup_size(256)
fn sort_near(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    sort_neighbours(group.y * groups.x + group.x, local, info.size, info.size);
}

/// The records that a walk enters instances by, in order.
@compute @workgroup_size(256)
fn enter(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let at = flat_index(id, groups);
    if at >= info.count {
        return;
    }
    let i = order[at].y;
    let object = objects[scene_instances[i].blas];
    var flags = object.flags;
    if (scene_instances[i].flags & SCENE_IDENTITY) != 0u { flags |= UPPER_IDENTITY; }
    let extent = max(abs(object.low), abs(object.high));
    upper_instances[at + 1u] = UpperInstance(scene_instances[i].world_to_object, extent, object.root, i, flags, vec2u(0u));
}

/// Nodes of a level, from 0 above the instances.
fn nodes_of(level: u32) -> u32 {
    var n = info.count;
    for (var l = 0u; l <= level; l++) {
        n = (n + 7u) / 8u;
    }
    return n;
}

/// Number of a level's first node: the levels above stand in front of it.
fn first_node(level: u32) -> u32 {
    var first = 0u;
    for (var l = level + 1u; l < info.levels; l++) {
        first += nodes_of(l);
    }
    return first;
}

/// One axis of a node's grid.
struct UpperGrid {
    exponent: u32,
    origin: f32,
    inverse_spacing: f32,
}

/// The finest grid of 2048 steps from `low` that reaches `high`.
fn grid_of(low: f32, high: f32) -> UpperGrid {
    let step = (high - low) * (1.000001 / 2048.0);
    let bits = bitcast<u32>(max(step, 1e-30));
    let exponent = clamp((bits >> 23u) + select(0u, 1u, (bits & 0x7fffffu) != 0u), 1u, 253u);
    return UpperGrid(exponent, low, bitcast<f32>((254u - exponent) << 23u));
}

/// Steps below and above a face; a face may be a thousandth of a step off by rounding.
fn step_below(grid: UpperGrid, x: f32) -> f32 {
    return clamp(floor((x - grid.origin) * grid.inverse_spacing - 0.001), 0.0, 2048.0);
}

fn step_above(grid: UpperGrid, x: f32) -> f32 {
    return clamp(ceil((x - grid.origin) * grid.inverse_spacing + 0.001), 0.0, 2048.0);
}

/// Two faces of a child as halves of a word. Those of a child that is not there are infinitely far beyond each other, so that no
/// ray is between them.
fn faces_below(grid: UpperGrid, a: UpperBox, b: UpperBox, low: vec2f) -> u32 {
    let steps = pack2x16float(vec2f(step_below(grid, low.x), step_below(grid, low.y)));
    return select(steps & 0xffffu, 0x7c00u, is_empty(a)) | select(steps & 0xffff0000u, 0x7c000000u, is_empty(b));
}

fn faces_above(grid: UpperGrid, a: UpperBox, b: UpperBox, high: vec2f) -> u32 {
    let steps = pack2x16float(vec2f(step_above(grid, high.x), step_above(grid, high.y)));
    return select(steps & 0xffffu, 0xfc00u, is_empty(a)) | select(steps & 0xffff0000u, 0xfc000000u, is_empty(b));
}

/// The box of a child of a node of this dispatch's level.
fn child_box(node: u32, slot: u32) -> UpperBox {
    let child = 8u * node + slot;
    let nothing = UpperBox(vec3f(1.0), NOTHING, vec3f(-1.0), 0u);
    if info.level == 0u {
        if child >= info.count {
            return nothing;
        }
        return boxes[order[child].y];
    }
    if child >= nodes_of(info.level - 1u) {
        return nothing;
    }
    return boxes[info.count + first_node(info.level - 1u) + child];
}

/// Makes the nodes of a level from the boxes below.
@compute @workgroup_size(64)
fn make_nodes(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let node = id.y * groups.x * 64u + id.x;
    if node >= nodes_of(info.level) {
        return;
    }
    var children: array<UpperBox, 8>;
    var low = vec3f(3e38);
    var high = vec3f(-3e38);
    for (var slot = 0u; slot < 8u; slot++) {
        children[slot] = child_box(node, slot);
        if !is_empty(children[slot]) {
            low = min(low, children[slot].low);
            high = max(high, children[slot].high);
        }
    }
    let at = first_node(info.level) + node;
    boxes[info.count + at] = UpperBox(low, NOTHING, high, 0u);
    if info.level + 1u == info.levels {
        finish_world(low, high);
    }
    let x = grid_of(low.x, high.x);
    let y = grid_of(low.y, high.y);
    let z = grid_of(low.z, high.z);
    // By axis, low and high, then pairs of slots.
    var planes: array<vec4u, 6>;
    var kinds = vec2u(0u);
    var inner = 0u;
    for (var pair = 0u; pair < 4u; pair++) {
        let a = children[2u * pair];
        let b = children[2u * pair + 1u];
        planes[0][pair] = faces_below(x, a, b, vec2f(a.low.x, b.low.x));
        planes[1][pair] = faces_above(x, a, b, vec2f(a.high.x, b.high.x));
        planes[2][pair] = faces_below(y, a, b, vec2f(a.low.y, b.low.y));
        planes[3][pair] = faces_above(y, a, b, vec2f(a.high.y, b.high.y));
        planes[4][pair] = faces_below(z, a, b, vec2f(a.low.z, b.low.z));
        planes[5][pair] = faces_above(z, a, b, vec2f(a.high.z, b.high.z));
    }
    for (var slot = 0u; slot < 8u; slot++) {
        var kind = 0u;
        if info.level > 0u {
            // Also where all of a node's instances are gone: its siblings are found by counting.
            if 8u * node + slot < nodes_of(info.level - 1u) {
                kind = 0x38u | slot;
                inner |= 1u << slot;
            }
        } else if !is_empty(children[slot]) {
            kind = 0x20u | slot;
        }
        kinds[slot / 4u] |= kind << (8u * (slot % 4u));
    }
    var first = vec2u(0u, 1u + 8u * node);
    if info.level > 0u {
        first = vec2u(first_node(info.level - 1u) + 8u * node, 0u);
    }
    let exponents = x.exponent | (y.exponent << 8u) | (z.exponent << 16u) | (inner << 24u);
    nodes[at].grid = vec4u(bitcast<vec3u>(low), exponents);
    nodes[at].links = vec4u(first, kinds);
    nodes[at].planes = planes;
}

/// The record of the world itself.
fn finish_world(low: vec3f, high: vec3f) {
    let there = all(low <= high);
    upper_instances[0].world_to_object = array<vec4f, 3>(vec4f(1.0, 0.0, 0.0, 0.0), vec4f(0.0, 1.0, 0.0, 0.0), vec4f(0.0, 0.0, 1.0, 0.0));
    upper_instances[0].extent = select(vec3f(0.0), max(abs(low), abs(high)), vec3<bool>(there));
    upper_instances[0].root = select(NOTHING, 0u, there);
    upper_instances[0].index = NOTHING;
    upper_instances[0].flags = UPPER_IDENTITY;
}
