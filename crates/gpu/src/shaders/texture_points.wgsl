// What texture graphs ask of a point: its place in every space, and how dense these are. Only used if SCENE_HAS_GRAPHS.

#import primitive, scene, scene_records, texture
#import optics::frame, optics::image_texture, optics::material, optics::shape, optics::texture_point
#ifdef SCENE_MOVES
#import motion
#endif

/// Whether a texture of a material is a graph.
fn has_graphs(material: u32) -> bool {
    return (materials[material].flags & MATERIAL_GRAPHS) != 0u;
}

/// A point of a bottom-level structure in world space.
fn structure_to_world(instance_index: u32, p: vec3f) -> vec3f {
    if (instances[instance_index].flags & INSTANCE_IDENTITY) != 0u {
        return p;
    }
#ifdef SCENE_MOVES
    return transform_point(object_to_world_now(instance_index), p);
#else
    return transform_point(instances[instance_index].object_to_world, p);
#endif
}

/// The point of a triangle with barycentric weights `weights`, which may lie outside of it. Footprints have no width.
fn triangle_texture_point(binding: Binding, instance_index: u32, primitive: u32, weights: vec3f) -> TexturePoint {
    let corners = triangle_corners(binding, primitive);
    let p0 = vertices[binding.first_vertex + corners.x].position;
    let p1 = vertices[binding.first_vertex + corners.y].position;
    let p2 = vertices[binding.first_vertex + corners.z].position;
    let w0 = structure_to_world(instance_index, p0);
    let e1 = structure_to_world(instance_index, p1) - w0;
    let e2 = structure_to_world(instance_index, p2) - w0;
    let o0 = object_position(binding, p0);
    let d1 = object_position(binding, p1) - o0;
    let d2 = object_position(binding, p2) - o0;
    let t0 = triangle_coords(binding, corners, vec3f(1.0, 0.0, 0.0));
    let u1 = triangle_coords(binding, corners, vec3f(0.0, 1.0, 0.0)) - t0;
    let u2 = triangle_coords(binding, corners, vec3f(0.0, 0.0, 1.0)) - t0;
    var point: TexturePoint;
    point.coords = triangle_coords(binding, corners, weights);
    point.color = triangle_color(binding, corners, weights);
    point.position = o0 + d1 * weights.y + d2 * weights.z;
    point.width = 0.0;
    point.world = w0 + e1 * weights.y + e2 * weights.z;
    point.object_density = area_density(e1, e2, d1, d2);
    point.normal = normalize(cross(d1, d2));
    point.uv_density.x = area_density(e1, e2, vec3f(u1.xy, 0.0), vec3f(u2.xy, 0.0));
    point.uv_density.y = area_density(e1, e2, vec3f(u1.zw, 0.0), vec3f(u2.zw, 0.0));
    return point;
}

/// The point of a sphere in the unit direction `outward` from its centre, in the space of its bottom-level structure.
fn sphere_texture_point(binding: Binding, instance_index: u32, primitive: u32, outward: vec3f) -> TexturePoint {
    let sphere = sphere_at(binding, primitive);
    let on_sphere = sphere.xyz + outward * sphere.w;
    let edge = vec3f(sphere.w, 0.0, 0.0);
    let world_radius = max(
        length(structure_to_world(instance_index, sphere.xyz + edge) - structure_to_world(instance_index, sphere.xyz)),
        1e-30,
    );
    let object_radius = length(object_position(binding, sphere.xyz + edge) - object_position(binding, sphere.xyz));
    let uv_density = sphere_uv_density(world_radius);
    var point: TexturePoint;
    point.coords = sphere_uv(sphere_direction(binding, outward)).xyxy;
    point.color = vec4f(1.0);
    point.position = object_position(binding, on_sphere);
    point.width = 0.0;
    point.world = structure_to_world(instance_index, on_sphere);
    point.object_density = object_radius / world_radius;
    point.normal = normalize(point.position - object_position(binding, sphere.xyz));
    point.uv_density = vec2f(uv_density);
    return point;
}

/// The normal of a surface with heights, of any length, in world space.
///
/// - `point`: there. `frame`: along the surface, on the viewer's side; `side`: 1 at the front, -1 at the back.
fn bumped_normal(
    binding: Binding,
    hit: Hit,
    use_: TextureUse,
    point: TexturePoint,
    frame: Frame,
    side: f32,
) -> vec3f {
    let step = bump_step(point.world);
    let scale = materials[binding.material].normal_scale * side;
    var heights: array<f32, 3>;
    for (var i = 0u; i < 3u; i++) {
        var along = vec3f(0.0);
        if i == 1u {
            along = frame.tangent * step;
        } else if i == 2u {
            along = frame.bitangent * step;
        }
        var moved = moved_texture_point(binding, hit, point, along);
        moved.width = step;
        heights[i] = sample_texture(use_, moved).x * scale;
    }
    let n = height_normal(heights[0], heights[1], heights[2], step);
    return to_world(frame, n);
}

/// The point of the same primitive that is reached by the way `along`, in world space.
fn moved_texture_point(binding: Binding, hit: Hit, point: TexturePoint, along: vec3f) -> TexturePoint {
    let primitive = hit.primitive - binding.first_in_blas;
    let instance = hit.instance;
    if (binding.flags & BINDING_SPHERES) != 0u {
        var p = point.world + along;
        if (instances[instance].flags & INSTANCE_IDENTITY) == 0u {
#ifdef SCENE_MOVES
            p = transform_point(world_to_object_now(instance), p);
#else
            p = transform_point(instances[instance].world_to_object, p);
#endif
        }
        return sphere_texture_point(binding, instance, primitive, normalize(p - sphere_at(binding, primitive).xyz));
    }
    let corners = triangle_corners(binding, primitive);
    let w0 = structure_to_world(instance, vertices[binding.first_vertex + corners.x].position);
    let e1 = structure_to_world(instance, vertices[binding.first_vertex + corners.y].position) - w0;
    let e2 = structure_to_world(instance, vertices[binding.first_vertex + corners.z].position) - w0;
    let shift = barycentric_step(e1, e2, along);
    let weights = vec3f(1.0 - hit.u - hit.v - shift.x - shift.y, hit.u + shift.x, hit.v + shift.y);
    return triangle_texture_point(binding, instance, primitive, weights);
}
