// What may be kept of the frame before: each pixel's surface is looked for where it was then. Diffuse light stays on its
// surface; what a smooth surface reflects moves with the picture behind the mirror.

#import histories, planes, projection, realtime_frame, realtime_guides, realtime_history
#import optics::history, optics::reprojection

@group(3) @binding(12) var<storage, read> histories_before: array<vec4u>;

/// Reflections of surfaces rougher than this move with the surface.
const ROUGHEST_MIRROR: f32 = 0.7;
/// Weight of the texels that count, under which a place counts as unseen.
const LEAST_WEIGHT: f32 = 0.02;

fn load_before(at: u32) -> History {
    return history_of(histories_before[in_plane(HISTORY_DIFFUSE, at)], histories_before[in_plane(HISTORY_SPECULAR, at)],
        histories_before[in_plane(HISTORY_MOMENTS, at)], histories_before[in_plane(HISTORY_OWNER, at)]);
}

/// Whether the texel `there` of the frame before showed the surface of `guide`. `ignores_depth`: it may be another point of it.
fn showed(guide: Guide, there: vec2i, ignores_depth: bool) -> bool {
    if any(there < vec2i(0)) || any(there >= vec2i(realtime.size)) {
        return false;
    }
    let owner = histories_before[in_plane(HISTORY_OWNER, place_of(vec2u(there)))];
    if owner.y != guide.surface {
        return false;
    }
    let found = bitcast<f32>(owner.w);
    let expected = select(guide.distance_before, found, ignores_depth);
    let cos_between = cos_of_codes(guide.normal, owner.z);
    return is_same_surface(expected, found, realtime.depth_tolerance, cos_between, realtime.normal_tolerance);
}

/// The history at a place between texels: of those around it that showed the surface.
fn history_at(guide: Guide, place: vec2f, ignores_depth: bool) -> HistorySum {
    var sum = history_sum_empty();
    let corner = upper_left_texel(place);
    for (var i = 0u; i < 4u; i++) {
        let there = vec2i(corner) + vec2i(vec2u(i & 1u, i >> 1u));
        let weight = bilinear_weight(place - corner, i);
        if weight > 0.0 && showed(guide, there, ignores_depth) {
            let h = load_before(place_of(vec2u(there)));
            if history_is_sound(h) {
                sum = history_sum_add(sum, h, weight);
            }
        }
    }
    return sum;
}

/// The same from all texels nearby: at an edge, where samples fall now on this side and now on that.
fn history_around(guide: Guide, place: vec2f) -> HistorySum {
    var sum = history_sum_empty();
    let center = vec2i(nearest_texel(place));
    for (var i = 0; i < 9; i++) {
        let there = center + vec2i(i % 3 - 1, i / 3 - 1);
        if showed(guide, there, false) {
            let h = load_before(place_of(vec2u(there)));
            if history_is_sound(h) {
                sum = history_sum_add(sum, h, 1.0);
            }
        }
    }
    return sum;
}

/// How the picture that a mirror at the surface shows has moved in the window.
fn reflection_motion(guide: Guide, hit_distance: f32, roughness: f32) -> vec2f {
    let point = virtual_point(realtime.eye, guide.position, hit_distance, mirror_share(roughness));
    let now = clip_from(realtime.clip_from_world, realtime.eye, point);
    let before = clip_from(realtime.previous_clip_from_world, realtime.previous_eye, point);
    return window_motion(now, before, picture_size(), guide.motion);
}

/// What may be kept for a pixel that sees `guide`.
fn kept_history(pixel: vec2u, guide: Guide) -> History {
    if !is_set(REALTIME_HAS_PAST) || guide.distance <= 0.0 {
        return history_empty();
    }
    let still = is_set(REALTIME_STANDS_STILL);
    let motion = select(guide.motion, vec2f(0.0), still);
    let place = vec2f(pixel) - motion;
    var found = history_at(guide, place, false);
    if found.weight < LEAST_WEIGHT {
        found = history_around(guide, place);
    }
    if found.weight < LEAST_WEIGHT {
        return history_empty();
    }
    var kept = history_sum_mean(found);
    let roughness = guide.colors.roughness;
    if !still && roughness < ROUGHEST_MIRROR {
        let mirrored = history_at(guide, vec2f(pixel) - reflection_motion(guide, kept.hit_distance, roughness), true);
        if mirrored.weight >= LEAST_WEIGHT {
            let seen = history_sum_mean(mirrored);
            kept.specular = seen.specular;
            kept.specular_count = seen.specular_count;
            kept.moments = vec4f(kept.moments.xy, seen.moments.zw);
        }
    }
    return kept;
}

@compute @workgroup_size(8, 8)
fn reproject(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    let guide = load_guide(at);
    let kept = kept_history(id.xy, guide);
    histories[in_plane(HISTORY_DIFFUSE, at)] = plane_floats(kept.diffuse, kept.diffuse_count);
    histories[in_plane(HISTORY_SPECULAR, at)] = plane_floats(kept.specular, kept.specular_count);
    histories[in_plane(HISTORY_MOMENTS, at)] = bitcast<vec4u>(kept.moments);
    histories[in_plane(HISTORY_OWNER, at)] =
        vec4u(bitcast<u32>(kept.hit_distance), guide.surface, guide.normal, bitcast<u32>(guide.distance));
}
