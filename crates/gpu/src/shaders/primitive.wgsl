// Primitives in the spaces that they lie in: transforms, texture coordinates, colours.

#import scene, scene_records, variant
#import optics::constants, optics::shape

fn transform_point(rows: array<vec4f, 3>, p: vec3f) -> vec3f {
    let h = vec4f(p, 1.0);
    return vec3f(dot(rows[0], h), dot(rows[1], h), dot(rows[2], h));
}

fn transform_vector(rows: array<vec4f, 3>, v: vec3f) -> vec3f {
    return vec3f(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}

/// A normal from object to world space, given the rows of world to object; not normalised.
fn transform_normal(world_to_object: array<vec4f, 3>, n: vec3f) -> vec3f {
    return world_to_object[0].xyz * n.x + world_to_object[1].xyz * n.y + world_to_object[2].xyz * n.z;
}

/// Texture coordinates at a point of a triangle.
fn triangle_coords(binding: Binding, corners: vec3u, weights: vec3f) -> vec4f {
    var coords = vec4f(0.0);
    if (binding.flags & BINDING_UV0) != 0u {
        let first = binding.first_vertex;
        let us = vec3f(vertices[first + corners.x].u, vertices[first + corners.y].u, vertices[first + corners.z].u);
        let vs = vec3f(vertices[first + corners.x].v, vertices[first + corners.y].v, vertices[first + corners.z].v);
        coords.x = dot(us, weights);
        coords.y = dot(vs, weights);
    }
    if binding.first_uv1 != NONE {
        let uv1 = words_vec2(binding.first_uv1 + 2u * corners.x) * weights.x
            + words_vec2(binding.first_uv1 + 2u * corners.y) * weights.y
            + words_vec2(binding.first_uv1 + 2u * corners.z) * weights.z;
        coords.z = uv1.x;
        coords.w = uv1.y;
    }
    return coords;
}

/// Vertex colour or tangent at a point of a triangle: four numbers a vertex from word `first` on.
fn triangle_words4(first: u32, corners: vec3u, weights: vec3f) -> vec4f {
    return words_vec4(first + 4u * corners.x) * weights.x + words_vec4(first + 4u * corners.y) * weights.y
        + words_vec4(first + 4u * corners.z) * weights.z;
}

fn triangle_color(binding: Binding, corners: vec3u, weights: vec3f) -> vec4f {
    if binding.first_color == NONE {
        return vec4f(1.0);
    }
    return triangle_words4(binding.first_color, corners, weights);
}

/// A point of a geometry, in the space of its bottom-level structure, in that of the user's object.
fn object_position(binding: Binding, local: vec3f) -> vec3f {
    if !SCENE_HAS_PLACEMENTS || binding.placement == NONE {
        return local;
    }
    let p = vec4f(local, 1.0);
    let at = binding.placement;
    return vec3f(dot(words_vec4(at), p), dot(words_vec4(at + 4u), p), dot(words_vec4(at + 8u), p));
}

/// A direction from the centre of a sphere, in the space of its bottom-level structure, in the space of the user's object.
fn sphere_direction(binding: Binding, outward: vec3f) -> vec3f {
    if !SCENE_HAS_PLACEMENTS || binding.placement == NONE {
        return outward;
    }
    let at = binding.placement;
    return turned_direction(words_vec3(at), words_vec3(at + 4u), words_vec3(at + 8u), outward);
}
