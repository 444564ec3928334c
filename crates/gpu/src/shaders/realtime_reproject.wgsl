// What may be kept of the frame before: each pixel's surface is looked for where it was then. Diffuse light stays on its
// surface; what a smooth surface reflects moves with the picture behind the mirror.

#import histories, planes, realtime_frame, realtime_guides, realtime_history
#import optics::history, optics::light_tree, optics::math

@group(3) @binding(12) var<storage, read> histories_before: array<vec4u>;

/// Reflections of surfaces rougher than this move with the surface.
const ROUGHEST_MIRROR: f32 = 0.7;
/// Weight of the texels that count, under which a place counts as unseen.
const LEAST_WEIGHT: f32 = 0.02;

fn no_history() -> History {
    return History(vec3f(0.0), 0.0, vec3f(0.0), 0.0, vec4f(0.0), 0.0);
}

/// A history that was found, and the weight with which it was.
struct Found {
    history: History,
    weight: f32,
}

fn is_sound(h: History) -> bool {
    return is_finite3(h.diffuse) && is_finite3(h.specular) && is_finite(h.diffuse_count) && is_finite(h.specular_count)
        && is_finite3(h.moments.xyz) && is_finite(h.moments.w) && is_finite(h.hit_distance);
}

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
    let cos_between = dot(octahedral_decode(guide.normal), octahedral_decode(owner.z));
    return is_same_surface(expected, found, realtime.depth_tolerance, cos_between, realtime.normal_tolerance);
}

fn add_weighted(sum: Found, h: History, weight: f32) -> Found {
    var next = sum;
    next.weight += weight;
    next.history.diffuse += h.diffuse * weight;
    next.history.diffuse_count += h.diffuse_count * weight;
    next.history.specular += h.specular * weight;
    next.history.specular_count += h.specular_count * weight;
    next.history.moments += h.moments * weight;
    next.history.hit_distance += h.hit_distance * weight;
    return next;
}

fn mean_of(sum: Found) -> History {
    let scale = 1.0 / max(sum.weight, 1e-6);
    return add_weighted(Found(no_history(), 0.0), sum.history, scale).history;
}

/// The history at a place between texels: of those around it that showed the surface.
fn history_at(guide: Guide, place: vec2f, ignores_depth: bool) -> Found {
    var sum = Found(no_history(), 0.0);
    let corner = floor(place);
    for (var i = 0u; i < 4u; i++) {
        let there = vec2i(corner) + vec2i(vec2u(i & 1u, i >> 1u));
        let weight = bilinear_weight(place - corner, i);
        if weight > 0.0 && showed(guide, there, ignores_depth) {
            let h = load_before(place_of(vec2u(there)));
            if is_sound(h) {
                sum = add_weighted(sum, h, weight);
            }
        }
    }
    return sum;
}

/// The same from all texels nearby: at an edge, where samples fall now on this side and now on that.
fn history_around(guide: Guide, place: vec2f) -> Found {
    var sum = Found(no_history(), 0.0);
    let center = vec2i(round(place));
    for (var i = 0; i < 9; i++) {
        let there = center + vec2i(i % 3 - 1, i / 3 - 1);
        if showed(guide, there, false) {
            let h = load_before(place_of(vec2u(there)));
            if is_sound(h) {
                sum = add_weighted(sum, h, 1.0);
            }
        }
    }
    return sum;
}

/// Where a clip position lies in the window, in pixels to the right and down.
fn window_place(clip: vec4f) -> vec2f {
    return vec2f(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * vec2f(realtime.size);
}

/// How the picture that a mirror at the surface shows has moved in the window.
fn reflection_motion(guide: Guide, hit_distance: f32, roughness: f32) -> vec2f {
    let share = mirror_share(roughness);
    let now = realtime.clip_from_world
        * vec4f(virtual_point(realtime.eye, guide.position, hit_distance, share) - realtime.eye, 1.0);
    let point = virtual_point(realtime.eye, guide.position, hit_distance, share);
    let before = realtime.previous_clip_from_world * vec4f(point - realtime.previous_eye, 1.0);
    if now.w <= 0.0 || before.w <= 0.0 {
        return guide.motion;
    }
    return window_place(now) - window_place(before);
}

/// What may be kept for a pixel that sees `guide`.
fn kept_history(pixel: vec2u, guide: Guide) -> History {
    if !is_set(REALTIME_HAS_PAST) || guide.distance <= 0.0 {
        return no_history();
    }
    let still = is_set(REALTIME_STANDS_STILL);
    let motion = select(guide.motion, vec2f(0.0), still);
    let place = vec2f(pixel) - motion;
    var found = history_at(guide, place, false);
    if found.weight < LEAST_WEIGHT {
        found = history_around(guide, place);
    }
    if found.weight < LEAST_WEIGHT {
        return no_history();
    }
    var kept = mean_of(found);
    let roughness = guide.colors.roughness;
    if !still && roughness < ROUGHEST_MIRROR {
        let mirrored = history_at(guide, vec2f(pixel) - reflection_motion(guide, kept.hit_distance, roughness), true);
        if mirrored.weight >= LEAST_WEIGHT {
            let seen = mean_of(mirrored);
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
