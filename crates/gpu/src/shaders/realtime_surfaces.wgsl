// From first hits to what the other passes need to know of surfaces, so that only this one and the paths know a scene.

#import film, guides, hybrid_frame, hybrid_pixels, lights, lights_found, material, planes
#import primitive, realtime_found, realtime_frame, realtime_guides, scattering, scene, surface
#import variant
#import optics::camera, optics::constants, optics::history, optics::light_tree, optics::medium
#import optics::random

/// Farther away than anything that could be a neighbour.
const NOWHERE: f32 = 1e30;

fn see_surface(ray: CameraRay, hit: Hit, pixel: Guide) -> Guide {
    var guide = pixel;
    let s = surface_at(ray.origin, ray.direction, hit);
    let footprint = pixel_footprint(view.pixel_spread, hit.t);
    guide.emitted = surface_emission(s, footprint);
    if SCENE_ABSORBS && !s.front {
        guide.emitted = transmitted_radiance(guide.emitted, materials[s.material].absorption, hit.t);
    }
    // Where a material mixes models, colours of one of them: they only divide and multiply.
    let scattering = surface_scattering(s, footprint, vec3f(1.0), 0.5, view.single_scatter != 0u);
    guide.colors = scattering_lobe_colors(scattering);
    guide.position = s.position;
    guide.distance = hit.t;
    guide.normal = octahedral_encode(s.shading_normal);
    guide.surface = hash_combine(hash_combine(hit.instance, hit.geometry), s.material);
    let local = transform_point(instances[hit.instance].world_to_object, s.position);
    let before = transform_point(previous_instances[hit.instance].object_to_world, local);
    guide.distance_before = distance_before(hit.t, s.position, frame.eye, before, frame.previous_eye);
    return guide;
}

fn store_guide(at: u32, guide: Guide) {
    guides[in_plane(GUIDE_EMITTED, at)] = plane_floats(guide.emitted, guide.distance);
    guides[in_plane(GUIDE_POINT, at)] = plane_words(guide.position, guide.normal);
    guides[in_plane(GUIDE_COLORS, at)] = pack_colors(guide.colors);
    let before = bitcast<u32>(guide.distance_before);
    guides[in_plane(GUIDE_PAST, at)] = vec4u(guide.surface, before, bitcast<vec2u>(guide.motion));
}

/// The frame's samples begin with none; how many there were in all goes on.
fn begin_samples(at: u32, wanted: u32) {
    lights_found[in_plane(FOUND_DIFFUSE, at)] = vec4u(0u);
    lights_found[in_plane(FOUND_SPECULAR, at)] = vec4u(0u);
    lights_found[in_plane(FOUND_SQUARES, at)] = vec4u(0u, 0u, samples_drawn(at), wanted);
    if realtime.light_candidates > 0u || is_set(REALTIME_ADAPTS) {
        lights_found[in_plane(FOUND_OFFER, at)] = vec4u(NONE, 0u, at, NONE);
    }
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
    guide.motion = first_motion(at);
    if hit.instance == NONE {
        guide.emitted = seen_radiance(ray, distant_radiance(ray.direction));
        guide.position = vec3f(NOWHERE);
    } else {
        guide = see_surface(ray, hit, guide);
    }
    store_guide(at, guide);
    begin_samples(at, select(realtime.most_samples, 0u, hit.instance == NONE));
}
