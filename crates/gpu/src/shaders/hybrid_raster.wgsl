// The G-buffer's first half: which primitive each pixel sees. No vertex has a layout: vertices are pulled from the scene's own
// buffers by number, indices included. An instance of the draw is an item that was not culled.

#import hybrid_frame, hybrid_items, hybrid_spheres, material, primitive, scene, scene_records
#import optics::bounds, optics::camera, optics::reprojection

/// Which class of items is drawn.
override DRAW_CLASS: u32 = 0u;

@group(3) @binding(3) var<storage, read> seen_items: array<u32>;

struct Corner {
    @builtin(position) clip: vec4f,
    /// Item and primitive.
    @location(0) @interpolate(flat) id: u32,
    /// Barycentric weights of the second and third vertex.
    @location(1) weights: vec2f,
}

/// Where nothing is drawn: behind the far end.
fn no_corner() -> Corner {
    return Corner(vec4f(0.0, 0.0, -1.0, 1.0), SEES_NOTHING, vec2f(0.0));
}

fn item_binding(item: HybridItem) -> Binding {
    return bindings[instances[item.instance].first_binding + parts[item.part].geometry];
}

/// A point of an instance in world space, as the surfaces of the instance have it.
fn world_position(instance: u32, local: vec3f) -> vec3f {
    if (instances[instance].flags & INSTANCE_IDENTITY) != 0u {
        return local;
    }
    return transform_point(instances[instance].object_to_world, local);
}

@vertex
fn triangle_corner(@builtin(vertex_index) vertex: u32, @builtin(instance_index) slot: u32) -> Corner {
    let index = seen_items[class_start(DRAW_CLASS) + slot];
    let item = items[index];
    let in_part = vertex / 3u;
    if in_part >= parts[item.part].count {
        return no_corner();
    }
    let corner = vertex % 3u;
    let binding = item_binding(item);
    let number = words[binding.first_word + 3u * (parts[item.part].first + in_part) + corner];
    let world = world_position(item.instance, vertices[binding.first_vertex + number].position);
    let weights = vec2f(select(0.0, 1.0, corner == 1u), select(0.0, 1.0, corner == 2u));
    return Corner(clip_position(world), (index << PRIMITIVE_BITS) | in_part, weights);
}

@fragment
fn opaque_triangle(in: Corner) -> @location(0) u32 {
    return in.id;
}

@fragment
fn holed_triangle(in: Corner) -> @location(0) u32 {
    let item = items[in.id >> PRIMITIVE_BITS];
    let part = parts[item.part];
    let in_part = in.id & ((1u << PRIMITIVE_BITS) - 1u);
    let primitive = item_binding(item).first_in_blas + part.first + in_part;
    let ray = frame_ray(vec2u(in.clip.xy));
    let direction = transform_vector(instances[item.instance].world_to_object, ray.direction);
    if !alpha_accepts(item.instance, part.geometry, primitive, in.weights.x, in.weights.y, direction, 0u) {
        discard;
    }
    return in.id;
}

/// A corner of the cube around a sphere, a little larger than it must be.
@vertex
fn sphere_corner(@builtin(vertex_index) vertex: u32, @builtin(instance_index) slot: u32) -> Corner {
    let index = seen_items[class_start(DRAW_CLASS) + slot];
    let item = items[index];
    let face = vertex / 6u;
    // Two triangles from the four corners of a side.
    let quad = (0x312210u >> (4u * (vertex % 6u))) & 3u;
    let side = select(vec3f(-1.0), vec3f(1.0), vec3u(face / 3u, quad & 1u, quad >> 1u) != vec3u(0u));
    let axis = face % 3u;
    let cube = select(select(side.yzx, side.zxy, axis == 1u), side, axis == 0u);
    let sphere = sphere_at(item_binding(item), parts[item.part].first);
    let world = world_position(item.instance, sphere_box_corner(sphere.xyz, sphere.w, cube));
    return Corner(clip_position(world), index << PRIMITIVE_BITS, vec2f(0.0));
}

struct SphereSample {
    @location(0) id: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn sphere(in: Corner) -> SphereSample {
    let item = items[in.id >> PRIMITIVE_BITS];
    let ray = frame_ray(vec2u(in.clip.xy));
    let t = seen_sphere(item.instance, parts[item.part].geometry, item_binding(item), parts[item.part].first, ray);
    if t <= 0.0 {
        discard;
    }
    return SphereSample(in.id, clip_depth(clip_position(camera_ray_point(ray, t))));
}
