// Before anything is drawn: which items the camera can see, and which lights matter to which part of the view.

#import draw_classes, film, hybrid_frame, hybrid_items, light_reach, primitive, scene, texels
#import optics::constants

/// As the driver reads it.
struct HybridDraw {
    vertex_count: u32,
    instance_count: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
}

@group(3) @binding(3) var<storage, read_write> seen_items: array<u32>;
@group(3) @binding(4) var<storage, read_write> draws: array<HybridDraw>;
/// A bit for each light, for each cluster.
@group(3) @binding(5) var<storage, read_write> light_masks: array<u32>;

/// Whether a box in the space of an instance may be seen: not all of it lies beyond one side of the view.
fn is_in_view(instance: u32, low: vec3f, high: vec3f) -> bool {
    var beyond = 0x3fu;
    for (var corner = 0u; corner < 8u; corner++) {
        let high_side = (vec3u(corner) & vec3u(1u, 2u, 4u)) != vec3u(0u);
        let local = select(low, high, high_side);
        let clip = clip_position(transform_point(instances[instance].object_to_world, local));
        var outside = 0u;
        if clip.x > clip.w { outside |= 1u; }
        if clip.x < -clip.w { outside |= 2u; }
        if clip.y > clip.w { outside |= 4u; }
        if clip.y < -clip.w { outside |= 8u; }
        if clip.z > clip.w { outside |= 16u; }
        if clip.z < 0.0 { outside |= 32u; }
        beyond &= outside;
    }
    return beyond == 0u;
}

@compute @workgroup_size(64)
fn cull(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = flat_index(id, groups);
    if index >= frame.item_count {
        return;
    }
    let item = items[index];
    if !is_in_view(item.instance, parts[item.part].low, parts[item.part].high) {
        return;
    }
    var class_ = 0u;
    while class_ + 1u < DRAW_CLASSES && index >= class_start(class_ + 1u) {
        class_ += 1u;
    }
    let slot = atomicAdd(&draws[class_].instance_count, 1u);
    seen_items[class_start(class_) + slot] = index;
}

/// An axis-parallel box in world space.
struct ClusterBox {
    low: vec3f,
    high: vec3f,
}

/// The box around a cluster, a little larger than it is: positions are rounded.
fn cluster_box(cluster: u32) -> ClusterBox {
    let across = cluster % frame.clusters.x;
    let down = cluster / frame.clusters.x % frame.clusters.y;
    let slice = cluster / (frame.clusters.x * frame.clusters.y);
    let start = slice_start(slice);
    let end = select(slice_start(slice + 1u), FAR, slice + 1u == frame.clusters.z);
    var bounds = ClusterBox(vec3f(FAR), vec3f(-FAR));
    for (var corner = 0u; corner < 4u; corner++) {
        let pixel = vec2f(vec2u(across + (corner & 1u), down + (corner >> 1u)) * frame.tile);
        let film = (vec2f(f32(view.window_x), f32(view.window_y)) + pixel) / vec2f(f32(view.width), f32(view.height));
        let ray = film_ray(film, frame.lens);
        let step = ray.direction / dot(ray.direction, frame.axis);
        let near = ray.origin + step * start;
        let far = ray.origin + step * end;
        bounds.low = min(bounds.low, min(near, far));
        bounds.high = max(bounds.high, max(near, far));
    }
    let room = 1e-4 * (max(abs(bounds.low), abs(bounds.high)) + end);
    return ClusterBox(bounds.low - room, bounds.high + room);
}

@compute @workgroup_size(64)
fn cluster_lights(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = flat_index(id, groups);
    let cluster = index / frame.light_words;
    if cluster >= frame.clusters.x * frame.clusters.y * frame.clusters.z {
        return;
    }
    let bounds = cluster_box(cluster);
    let first = 32u * (index % frame.light_words);
    var mask = 0u;
    for (var bit = 0u; bit < 32u && first + bit < scene.light_count; bit++) {
        let reach = counting_reach(first + bit);
        let nearest = clamp(reach.center, bounds.low, bounds.high);
        if length(nearest - reach.center) <= reach.radius {
            mask |= 1u << bit;
        }
    }
    light_masks[index] = mask;
}
