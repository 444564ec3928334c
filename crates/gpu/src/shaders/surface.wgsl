// From a hit to the surface there.

#import primitive, scene, scene_records, texture, texture_points, variant
#import optics::constants, optics::frame, optics::image_texture, optics::material, optics::math
#import optics::offset, optics::shape, optics::terminator, optics::texture_point
#ifdef SCENE_MOVES
#import motion
#endif

/// A point on a surface as a ray arrives there. World space unless it says otherwise.
struct Surface {
    position: vec3f,
    /// How far off the primitive rays must start: see the optics' `offset`.
    clearance: f32,
    /// Unit geometric normal on the side of the ray's origin.
    normal: vec3f,
    /// Whether the ray arrives at the front.
    front: bool,
    /// Unit shading normal on that side, normal map applied.
    shading_normal: vec3f,
    /// Where light is gathered and rays start that leave on that side: the position, or where the smooth surface would be that
    /// vertex normals stand for; see the optics' `terminator`.
    origin: vec3f,
    /// Unit normal of the plane that what can reach the surface is above: the geometric one, or that of the smooth surface.
    horizon: vec3f,
    /// Index into `materials`.
    material: u32,
    /// Unit direction back along the ray.
    wo: vec3f,
    /// Index into `lights`, or NONE.
    light: u32,
    /// Both sets of texture coordinates.
    coords: vec4f,
    /// Linear vertex colour, ones where there is none.
    color: vec4f,
    /// Position in object space, for procedural patterns.
    object_position: vec3f,
    /// Unit geometric normal in object space. This and the densities are only set if SCENE_HAS_GRAPHS.
    object_normal: vec3f,
    /// See the optics' TexturePoint.
    object_density: f32,
    uv_density: vec2f,
    /// What the user calls an instance.
    object: u32,
    /// Number of the primitive in its geometry.
    primitive: u32,
    /// The shading normal without the normal map, and the frame along the texture coordinates: what layers need. Only set
    /// if SCENE_HAS_LAYERS.
    layer_frame: Frame,
    /// Index of refraction of the body behind the surface over that of what is around it; 0: its own counts, against vacuum.
    /// Only set if FOLLOWS_VOLUMES.
    relative_ior: f32,
}

/// What a primitive knows of a point on it, before the viewer's side and the normal map count.
struct SurfacePoint {
    position: vec3f,
    clearance: f32,
    /// Unit geometric normal of the front.
    normal: vec3f,
    /// Whether `shading` counts; flat otherwise.
    smooth_shaded: bool,
    /// Unit interpolated normal of the front.
    shading: vec3f,
    /// Only set if SCENE_HAS_SMOOTH_TERMINATORS.
    lift: TerminatorLift,
    /// Of the tangent: 1 or −1; 0 if there is none.
    handedness: f32,
    tangent: vec3f,
    coords: vec4f,
    color: vec4f,
    object_position: vec3f,
    /// Where texture graphs are evaluated; only set if SCENE_HAS_GRAPHS and the material has some.
    texture: TexturePoint,
}

/// In what coordinates an instance's transform rounds: the largest of three points in world space, and of the translation.
fn transformed_extent(to_world: array<vec4f, 3>, a: vec3f, b: vec3f, c: vec3f) -> f32 {
    let translation = vec3f(to_world[0].w, to_world[1].w, to_world[2].w);
    return max_component(largest_components(a, b, c)) + max_component(abs(translation));
}

fn triangle_point(
    binding: Binding,
    instance_index: u32,
    primitive: u32,
    barycentrics: vec2f,
    wo: vec3f,
) -> SurfacePoint {
    let corners = triangle_corners(binding, primitive);
    let weights = vec3f(1.0 - barycentrics.x - barycentrics.y, barycentrics.x, barycentrics.y);
    let v0 = vertices[binding.first_vertex + corners.x];
    let v1 = vertices[binding.first_vertex + corners.y];
    let v2 = vertices[binding.first_vertex + corners.z];
    let local = v0.position * weights.x + v1.position * weights.y + v2.position * weights.z;
    let local_normal = cross(v1.position - v0.position, v2.position - v0.position);
    let local_shading = v0.normal * weights.x + v1.normal * weights.y + v2.normal * weights.z;
    var point: SurfacePoint;
    point.object_position = object_position(binding, local);
    if SCENE_HAS_GRAPHS && has_graphs(binding.material) {
        point.texture = triangle_texture_point(binding, instance_index, primitive, weights);
    }
    var tangent = vec4f(0.0);
    let needs_tangent = has_texture(binding.material, SLOT_NORMAL)
        || (SCENE_HAS_LAYERS && (materials[binding.material].flags & MATERIAL_TANGENTS) != 0u);
    if binding.first_tangent != NONE && needs_tangent {
        tangent = triangle_words4(binding.first_tangent, corners, weights);
        point.handedness = select(1.0, -1.0, tangent.w < 0.0);
    }
    var shading = local_shading;
    // In world space.
    var p0 = v0.position;
    var p1 = v1.position;
    var p2 = v2.position;
    var n0 = v0.normal;
    var n1 = v1.normal;
    var n2 = v2.normal;
    let flags = instance_flags(instance_index);
    var transformed = 0.0;
    if (flags & INSTANCE_IDENTITY) != 0u {
        point.position = local;
        point.normal = normalize(local_normal);
        point.tangent = tangent.xyz;
    } else {
#ifdef SCENE_MOVES
        let to_world = object_to_world_now(instance_index);
        let to_object = world_to_object_now(instance_index);
#else
        let to_world = instances[instance_index].object_to_world;
        let to_object = instances[instance_index].world_to_object;
#endif
        point.position = transform_point(to_world, local);
        point.normal = normalize(transform_normal(to_object, local_normal));
        shading = transform_normal(to_object, local_shading);
        point.tangent = transform_vector(to_world, tangent.xyz);
        if (flags & INSTANCE_MIRRORED) != 0u {
            point.handedness = -point.handedness;
        }
        p0 = transform_point(to_world, p0);
        p1 = transform_point(to_world, p1);
        p2 = transform_point(to_world, p2);
        transformed = transformed_extent(to_world, p0, p1, p2);
        if SCENE_HAS_SMOOTH_TERMINATORS {
            n0 = transform_normal(to_object, n0);
            n1 = transform_normal(to_object, n1);
            n2 = transform_normal(to_object, n2);
        }
    }
    point.clearance = triangle_clearance(p0, p1, p2, point.normal, transformed);
    point.smooth_shaded = (binding.flags & BINDING_NORMALS) != 0u && dot(shading, shading) > 1e-20;
    point.shading = select(point.normal, normalize(shading), point.smooth_shaded);
    if SCENE_HAS_SMOOTH_TERMINATORS && point.smooth_shaded
        && (materials[binding.material].flags & MATERIAL_SMOOTH_TERMINATOR) != 0u {
        let side = select(-1.0, 1.0, dot(point.normal, wo) >= 0.0);
        point.lift = terminator_lift(point.position, p0, p1, p2, n0, n1, n2, side, point.normal * side, weights);
    }
    point.coords = triangle_coords(binding, corners, weights);
    point.color = triangle_color(binding, corners, weights);
    return point;
}

fn sphere_point(binding: Binding, instance_index: u32, primitive: u32, world: vec3f) -> SurfacePoint {
    let sphere = sphere_at(binding, primitive);
    let center = sphere.xyz;
    let flags = instance_flags(instance_index);
    var local = world;
    if (flags & INSTANCE_IDENTITY) == 0u {
#ifdef SCENE_MOVES
        local = transform_point(world_to_object_now(instance_index), world);
#else
        local = transform_point(instances[instance_index].world_to_object, world);
#endif
    }
    // Back onto the sphere: the ray's parameter alone is off by more than an offset of the origin hides.
    let outward = normalize(local - center);
    let on_sphere = center + outward * sphere.w;
    var point: SurfacePoint;
    point.coords = sphere_uv(sphere_direction(binding, outward)).xyxy;
    point.object_position = object_position(binding, on_sphere);
    if SCENE_HAS_GRAPHS && has_graphs(binding.material) {
        point.texture = sphere_texture_point(binding, instance_index, primitive, outward);
    }
    if SCENE_TURNS_TANGENTS {
        point.tangent = sphere_tangent_turned(point.coords.xy, materials[binding.material].tangent_turn);
    } else {
        point.tangent = sphere_tangent(point.coords.x);
    }
    let mirrored = (materials[binding.material].flags & MATERIAL_TANGENTS_MIRRORED) != 0u;
    point.handedness = select(1.0, -1.0, mirrored);
    if SCENE_HAS_PLACEMENTS && binding.placement != NONE {
        // Of similar shapes only, which transform tangents as normals.
        let rows = array<vec4f, 3>(words_vec4(binding.placement), words_vec4(binding.placement + 4u),
            words_vec4(binding.placement + 8u));
        point.tangent = transform_normal(rows, point.tangent);
        let turned_over = dot(rows[0].xyz, cross(rows[1].xyz, rows[2].xyz)) < 0.0;
        point.handedness = select(point.handedness, -point.handedness, turned_over);
    }
    if (flags & INSTANCE_IDENTITY) != 0u {
        point.position = on_sphere;
        point.normal = outward;
        point.clearance = sphere_clearance(on_sphere, center, sphere.w, outward, 0.0);
    } else {
#ifdef SCENE_MOVES
        let to_world = object_to_world_now(instance_index);
        point.position = transform_point(to_world, on_sphere);
        point.normal = normalize(transform_normal(world_to_object_now(instance_index), outward));
#else
        let to_world = instances[instance_index].object_to_world;
        point.position = transform_point(to_world, on_sphere);
        point.normal = normalize(transform_normal(instances[instance_index].world_to_object, outward));
#endif
        point.tangent = transform_vector(to_world, point.tangent);
        if (flags & INSTANCE_MIRRORED) != 0u {
            point.handedness = -point.handedness;
        }
        // The sphere's own axes bound it in world space as corners bound a triangle.
        let low = transform_point(to_world, center - sphere.w);
        let high = transform_point(to_world, center + sphere.w);
        let transformed = transformed_extent(to_world, low, high, point.position);
        point.clearance = sphere_clearance(point.position, point.position, 0.0, point.normal, transformed);
    }
    point.smooth_shaded = false;
    point.shading = point.normal;
    point.color = vec4f(1.0);
    return point;
}

/// The shading normal on the viewer's side, with the normal map applied and bent so that nothing reflects into the
/// surface. `normal`: the geometric one on that side; `side`: 1 at the front, −1 at the back.
fn mapped_normal(
    binding: Binding,
    hit: Hit,
    point: SurfacePoint,
    wo: vec3f,
    normal: vec3f,
    side: f32,
) -> vec3f {
    let material = binding.material;
    var shading = select(normal, point.shading * side, point.smooth_shaded);
    let use_ = materials[material].textures[SLOT_NORMAL];
    if SCENE_HAS_GRAPHS && (use_.flags & TEXTURE_HEIGHT) != 0u {
        let frame = tangent_space(shading, point.tangent, point.handedness, side);
        shading = bumped_normal(binding, hit, use_, point.texture, frame, side);
    } else if has_texture(material, SLOT_NORMAL) {
        let stored = sample_texture(use_, texture_point_at(point.coords, point.color));
        shading = map_normal(tangent_space(shading, point.tangent, point.handedness, side), stored.rgb, materials[material].normal_scale);
    } else if !point.smooth_shaded {
        return normal;
    }
    return bend_normal(wo, normal, shading);
}

/// The surface at a hit that is not a miss; the ray's direction has unit length.
fn surface_at(origin: vec3f, direction: vec3f, hit: Hit) -> Surface {
    let binding = hit_binding(hit);
    let primitive = hit.primitive - binding.first_in_blas;
    var point: SurfacePoint;
    if (binding.flags & BINDING_SPHERES) != 0u {
        point = sphere_point(binding, hit.instance, primitive, origin + direction * hit.t);
    } else {
        point = triangle_point(binding, hit.instance, primitive, vec2f(hit.u, hit.v), -direction);
    }
    let wo = -direction;
    let front = dot(point.normal, wo) >= 0.0;
    let side = select(-1.0, 1.0, front);
    let normal = point.normal * side;
    var s: Surface;
    s.position = point.position;
    s.clearance = point.clearance;
    s.normal = normal;
    s.origin = point.position;
    s.horizon = normal;
    if SCENE_HAS_SMOOTH_TERMINATORS && point.lift.share > 0.0 {
        s.origin += point.lift.offset;
        s.horizon = point.shading * side;
    }
    s.front = front;
    s.shading_normal = mapped_normal(binding, hit, point, wo, normal, side);
    if SCENE_HAS_LAYERS {
        var layer_normal = normal;
        if point.smooth_shaded {
            layer_normal = bend_normal(wo, normal, point.shading * side);
        }
        s.layer_frame = tangent_space(layer_normal, point.tangent, point.handedness, side);
    }
    s.material = binding.material;
    s.wo = wo;
    s.light = NONE;
    if binding.first_light != NONE {
        s.light = words[binding.first_light + primitive];
    }
    s.coords = point.coords;
    s.color = point.color;
    s.object_position = point.object_position;
    if SCENE_HAS_GRAPHS {
        s.object_normal = point.texture.normal;
        s.object_density = point.texture.object_density;
        s.uv_density = point.texture.uv_density;
    }
    s.object = binding.object;
    s.primitive = primitive;
    return s;
}

/// What textures ask of a surface. `width`: of the ray's footprint, metres.
fn texture_point(s: Surface, width: f32) -> TexturePoint {
    return TexturePoint(s.coords, s.color, s.object_position, width, s.position, s.object_density, s.object_normal,
        s.uv_density);
}

/// Where a ray starts that leaves on the side of the viewer (`above`) or on the other. Through surfaces whose origin is not
/// the position nothing leaves on the other.
fn ray_origin(s: Surface, above: bool) -> vec3f {
    return offset_ray_origin(s.origin, select(-s.horizon, s.horizon, above), s.clearance);
}
