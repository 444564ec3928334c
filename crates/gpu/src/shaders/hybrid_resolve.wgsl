// From what the rasteriser has drawn to hits like those of rays, and from the finished frame to the film. No rays.

#import hybrid_frame, hybrid_items, hybrid_pixels, hybrid_spheres, primitive, scene, scene_records
#import optics::camera, optics::constants, optics::intersect

@group(3) @binding(8) var ids: texture_2d<u32>;

/// The hit that the ray of a pixel makes on the primitive that the rasteriser saw there. At an edge, where the two may
/// disagree by a fraction of a pixel, it is the primitive's nearest point.
fn hit_on(id: u32, ray: CameraRay) -> Hit {
    let item = items[id >> PRIMITIVE_BITS];
    let part = parts[item.part];
    let binding = bindings[instances[item.instance].first_binding + part.geometry];
    let in_geometry = part.first + (id & ((1u << PRIMITIVE_BITS) - 1u));
    let primitive = binding.first_in_blas + in_geometry;
    var origin = ray.origin;
    var direction = ray.direction;
    if (instances[item.instance].flags & INSTANCE_IDENTITY) == 0u {
        origin = transform_point(instances[item.instance].world_to_object, origin);
        direction = transform_vector(instances[item.instance].world_to_object, direction);
    }
    if (binding.flags & BINDING_SPHERES) != 0u {
        let sphere = sphere_at(binding, in_geometry);
        let seen = seen_sphere(item.instance, part.geometry, binding, in_geometry, ray);
        let t = select(nearest_to_point(origin, direction, sphere.xyz), seen, seen > 0.0);
        return Hit(t, 0.0, 0.0, item.instance, part.geometry, primitive);
    }
    let corners = triangle_corners(binding, in_geometry);
    let a = vertices[binding.first_vertex + corners.x].position;
    let b = vertices[binding.first_vertex + corners.y].position;
    let c = vertices[binding.first_vertex + corners.z].position;
    var h = intersect_triangle(origin, ray_shear(direction), a, b, c, 0.0, FAR);
    if !h.hit {
        h = nearest_triangle_point(origin, direction, a, b, c);
    }
    return Hit(h.t, h.u, h.v, item.instance, part.geometry, primitive);
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_rows(id) {
        return;
    }
    let pixel = pixel_in_rows(id);
    let seen = textureLoad(ids, pixel, 0).x;
    let ray = frame_ray(pixel);
    if seen == SEES_NOTHING {
        store_first_hit(pixel, ray, hit_nothing());
    } else {
        store_first_hit(pixel, ray, hit_on(seen, ray));
    }
}
