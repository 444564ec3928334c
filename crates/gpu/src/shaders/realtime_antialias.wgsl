// Filtered pictures are antialiased by the pictures before, each of which looked through another place of the pixels.

#import realtime_frame, realtime_guides
#import optics::antialiasing, optics::history, optics::math, optics::reprojection

@group(3) @binding(21) var<storage, read> colors_in: array<vec4f>;
/// What was shown; w: how many frames it is the mean of.
@group(3) @binding(22) var<storage, read> shown_before: array<vec4f>;
@group(3) @binding(23) var<storage, read_write> shown_now: array<vec4f>;
/// For the film: radiance to add; w: samples to count, 0 or 1.
@group(3) @binding(26) var<storage, read_write> sums_out: array<vec4f>;

/// The picture before at a place between pixels, bilinear and compressed; w: least number of frames.
fn shown_at(place: vec2f) -> vec4f {
    let corner = upper_left_texel(place);
    var sum = vec4f(0.0, 0.0, 0.0, 1e9);
    for (var i = 0u; i < 4u; i++) {
        let texel = vec2i(corner) + vec2i(vec2u(i & 1u, i >> 1u));
        let inside = clamp(texel, vec2i(0), vec2i(realtime.size) - 1);
        sum = shown_add(sum, shown_before[place_of(vec2u(inside))], bilinear_weight(place - corner, i));
    }
    return sum;
}

/// The motion of the nearest surface around: edges move with what is in front.
fn front_motion(pixel: vec2u) -> vec2f {
    var nearest = 3.0e38;
    var motion = vec2f(0.0);
    for (var i = 0; i < 9; i++) {
        let there = clamp(vec2i(pixel) + vec2i(i % 3 - 1, i / 3 - 1), vec2i(0), vec2i(realtime.size) - 1);
        let at = place_of(vec2u(there));
        let distance = guide_distance(at);
        if distance > 0.0 && distance < nearest {
            nearest = distance;
            motion = guide_motion(at);
        }
    }
    return motion;
}

fn clipped_to_around(pixel: vec2u, past: vec3f) -> vec3f {
    var around = ShownColors(vec3f(0.0), vec3f(0.0));
    for (var i = 0; i < 9; i++) {
        let there = clamp(vec2i(pixel) + vec2i(i % 3 - 1, i / 3 - 1), vec2i(0), vec2i(realtime.size) - 1);
        around = shown_colors_add(around, colors_in[place_of(vec2u(there))].xyz);
    }
    return clip_to_shown(past, around);
}

/// The frame's colour with those before, while anything moves: compared and mixed as colours are shown, for at the edge of a
/// lamp any past would lie within the range of the pixels around. `past`: compressed.
fn mixed_in_motion(pixel: vec2u, color: vec3f, past: vec4f) -> vec4f {
    return shown_in_motion(color, clipped_to_around(pixel, past.xyz), past.w);
}

/// The frame's colour with those before; w: how many frames that are.
fn antialiased(pixel: vec2u, color: vec3f) -> vec4f {
    if !is_set(REALTIME_HAS_PAST) || realtime.show != SHOW_PICTURE || !is_set(REALTIME_GATHERS) {
        return vec4f(color, 1.0);
    }
    if is_set(REALTIME_STANDS_STILL) {
        let past = shown_before[place_of(pixel)];
        if !is_finite3(past.xyz) || past.w < 1.0 {
            return vec4f(color, 1.0);
        }
        return shown_at_rest(color, past);
    }
    let place = vec2f(pixel) - front_motion(pixel);
    if any(place < vec2f(-0.5)) || any(place > picture_size() - 0.5) {
        return vec4f(color, 1.0);
    }
    let past = shown_at(place);
    if !is_finite3(past.xyz) || past.w < 1.0 {
        return vec4f(color, 1.0);
    }
    return mixed_in_motion(pixel, color, past);
}

/// What the frame adds to the film's sums.
fn film_sums(at: u32, color: vec4f, now: vec4f) -> vec4f {
    if !is_set(REALTIME_GATHERS) && realtime.show == SHOW_PICTURE {
        return color;
    }
    // The film's mean becomes this frame: what it had of the frame before is taken back.
    let before = select(vec3f(0.0), shown_before[at].xyz, realtime.on_film > 1u);
    return vec4f(film_replacement(now.xyz, before, f32(realtime.on_film)), 1.0);
}

@compute @workgroup_size(8, 8)
fn antialias(@builtin(global_invocation_id) id: vec3u) {
    if is_in_picture(id.xy) {
        let at = place_of(id.xy);
        let color = colors_in[at];
        let now = antialiased(id.xy, color.xyz);
        shown_now[at] = now;
        sums_out[at] = film_sums(at, color, now);
    }
}
