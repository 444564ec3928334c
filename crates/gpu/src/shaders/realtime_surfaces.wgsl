// From first hits to what the other passes need to know of surfaces, so that only this one and the paths know a scene.

@group(3) @binding(10) var<storage, read_write> guides: array<Guide>;
@group(3) @binding(14) var<storage, read_write> lights_found: array<FoundLight>;
/// Position, and the normal's bits: what the filter asks of each neighbour.
@group(3) @binding(17) var<storage, read_write> keys: array<vec4f>;

/// Farther away than anything that could be a neighbour.
const NOWHERE: f32 = 1e30;

fn see_surface(ray: CameraRay, hit: Hit, pixel: Guide) -> Guide {
    var guide = pixel;
    let s = surface_at(ray.origin, ray.direction, hit);
    let footprint = view.pixel_spread * hit.t;
    guide.emitted = surface_emission(s, footprint);
    if SCENE_ABSORBS && !s.front {
        guide.emitted *= transmittance(materials[s.material].absorption, hit.t);
    }
    // Where a material mixes models, colours of one of them: they only divide and multiply.
    let scattering = surface_scattering(s, footprint, vec3f(1.0), 0.5, view.single_scatter != 0u);
    guide.colors = pack_colors(scattering_colors(scattering));
    guide.position = s.position;
    guide.distance = hit.t;
    guide.normal = octahedral_encode(s.shading_normal);
    guide.surface = hash_combine(hash_combine(hit.instance, hit.geometry), s.material);
    let local = transform_point(instances[hit.instance].world_to_object, s.position);
    let before = transform_point(previous_instances[hit.instance].object_to_world, local);
    guide.distance_before = hit.t + length(before - frame.previous_eye) - length(s.position - frame.eye);
    return guide;
}

@compute @workgroup_size(8, 8)
fn surfaces(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    let hit = first_hit(at);
    let ray = frame_ray(id.xy);
    var guide: Guide;
    guide.motion = vec2f(pixels[at].motion_x, pixels[at].motion_y);
    if hit.instance == NONE {
        guide.emitted = distant_radiance(ray.direction);
        keys[at] = vec4f(vec3f(NOWHERE), 0.0);
    } else {
        guide = see_surface(ray, hit, guide);
        keys[at] = vec4f(guide.position, bitcast<f32>(guide.normal));
    }
    guides[at] = guide;
    // The frame's samples begin with none; how many there were in all goes on.
    let drawn = lights_found[at].drawn;
    let wanted = select(realtime.most_samples, 0u, hit.instance == NONE);
    lights_found[at] = FoundLight(vec3f(0.0), 0u, vec3f(0.0), 0.0, vec2f(0.0), drawn, wanted, NONE, 0.0, at, 0u);
}
