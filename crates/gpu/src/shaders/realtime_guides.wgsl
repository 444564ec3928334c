// The planes of `guides`, for passes that bind it.

#import guides, planes, realtime_frame
#import optics::scatter

/// What is emitted, and the distance.
const GUIDE_EMITTED: u32 = 0u;
/// Position and normal: what the filter asks of each neighbour.
const GUIDE_POINT: u32 = 1u;
/// See `pack_colors`.
const GUIDE_COLORS: u32 = 2u;
/// Surface, distance before, motion.
const GUIDE_PAST: u32 = 3u;

fn guide_emitted(at: u32) -> vec3f {
    return plane_vector(guides[in_plane(GUIDE_EMITTED, at)]);
}

/// 0 where nothing is hit.
fn guide_distance(at: u32) -> f32 {
    return bitcast<f32>(guides[in_plane(GUIDE_EMITTED, at)].w);
}

/// Position; w: normal, by `octahedral_encode`.
fn guide_point(at: u32) -> vec4u {
    return guides[in_plane(GUIDE_POINT, at)];
}

fn guide_colors(at: u32) -> LobeColors {
    return unpack_colors(guides[in_plane(GUIDE_COLORS, at)]);
}

fn guide_surface(at: u32) -> u32 {
    return guides[in_plane(GUIDE_PAST, at)].x;
}

fn guide_motion(at: u32) -> vec2f {
    return bitcast<vec2f>(guides[in_plane(GUIDE_PAST, at)].zw);
}

fn load_guide(at: u32) -> Guide {
    let emitted = guides[in_plane(GUIDE_EMITTED, at)];
    let point = guide_point(at);
    let past = guides[in_plane(GUIDE_PAST, at)];
    return Guide(plane_vector(emitted), bitcast<f32>(emitted.w), plane_vector(point), bitcast<f32>(past.y),
        guide_colors(at), point.w, past.x, bitcast<vec2f>(past.zw));
}
