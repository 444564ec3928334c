// Before anything is drawn: which items the camera can see, and which lights matter to which part of the view.

#import draw_classes, film, hybrid_frame, hybrid_items, light_reach, primitive, scene, texels
#import optics::bounds, optics::camera, optics::clusters, optics::constants

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

/// The box around a cluster, a little larger than it is: positions are rounded.
fn cluster_box(cluster: u32) -> AxisBox {
    let across = cluster % frame.clusters.x;
    let down = cluster / frame.clusters.x % frame.clusters.y;
    let slice = cluster / (frame.clusters.x * frame.clusters.y);
    let start = slice_start(slice);
    let end = select(slice_start(slice + 1u), FAR, slice + 1u == frame.clusters.z);
    var bounds = box_of_nothing();
    for (var corner = 0u; corner < 4u; corner++) {
        let pixel = vec2f(vec2u(across + (corner & 1u), down + (corner >> 1u)) * frame.tile);
        let at = vec2f(f32(view.window_x), f32(view.window_y)) + pixel;
        let ray = film_ray(view.camera, film_position(at, vec2f(f32(view.width), f32(view.height))), frame.lens);
        bounds = cluster_add_edge(bounds, ray.origin, ray.direction, frame.axis, start, end);
    }
    return cluster_with_room(bounds, end);
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
        if is_within_reach(bounds, counting_reach(first + bit)) {
            mask |= 1u << bit;
        }
    }
    light_masks[index] = mask;
}
