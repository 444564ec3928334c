// Filtered pictures are antialiased by the pictures before, each of which looked through another place of the pixels.

#import realtime_frame, realtime_guides
#import optics::history, optics::math, optics::signal

@group(3) @binding(21) var<storage, read> colors_in: array<vec4f>;
/// What was shown; w: how many frames it is the mean of.
@group(3) @binding(22) var<storage, read> shown_before: array<vec4f>;
@group(3) @binding(23) var<storage, read_write> shown_now: array<vec4f>;
/// For the film: radiance to add; w: samples to count, 0 or 1.
@group(3) @binding(26) var<storage, read_write> sums_out: array<vec4f>;

/// Frames that a pixel's picture is the mean of while anything moves.
const MOST_FRAMES: f32 = 8.0;
/// Standard deviations of the pixels around by which the picture before may differ.
const CLIP: f32 = 1.25;

/// The picture before at a place between pixels, bilinear and compressed; w: least number of frames.
fn shown_at(place: vec2f) -> vec4f {
    let corner = floor(place);
    var sum = vec3f(0.0);
    var frames = 1e9;
    for (var i = 0u; i < 4u; i++) {
        let texel = vec2i(corner) + vec2i(vec2u(i & 1u, i >> 1u));
        let inside = clamp(texel, vec2i(0), vec2i(realtime.size) - 1);
        let before = shown_before[place_of(vec2u(inside))];
        let weight = bilinear_weight(place - corner, i);
        sum += compress(before.xyz) * weight;
        frames = select(frames, min(frames, before.w), weight > 0.0);
    }
    return vec4f(sum, frames);
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
    var mean = vec3f(0.0);
    var squares = vec3f(0.0);
    for (var i = 0; i < 9; i++) {
        let there = clamp(vec2i(pixel) + vec2i(i % 3 - 1, i / 3 - 1), vec2i(0), vec2i(realtime.size) - 1);
        let c = ycocg_encode(compress(colors_in[place_of(vec2u(there))].xyz));
        mean += c / 9.0;
        squares += c * c / 9.0;
    }
    let half = vec3f(deviation(mean.x, squares.x), deviation(mean.y, squares.y), deviation(mean.z, squares.z)) * CLIP;
    return max(ycocg_decode(clip_to_box(ycocg_encode(past), mean, half)), vec3f(0.0));
}

/// The frame's colour with those before, while anything moves: compared and mixed as colours are shown, for at the edge of a
/// lamp any past would lie within the range of the pixels around. `past`: compressed.
fn mixed_in_motion(pixel: vec2u, color: vec3f, past: vec4f) -> vec4f {
    let kept = clipped_to_around(pixel, past.xyz);
    let weight = history_weight(past.w, 1.0, MOST_FRAMES);
    return vec4f(expand(mix(kept, compress(color), weight)), min(past.w, MOST_FRAMES) + 1.0);
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
        return vec4f(mix(past.xyz, color, history_weight(past.w, 1.0, 1e9)), past.w + 1.0);
    }
    let place = vec2f(pixel) - front_motion(pixel);
    if any(place < vec2f(-0.5)) || any(place > vec2f(realtime.size) - 0.5) {
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
    let frames = f32(realtime.on_film);
    let before = select(vec3f(0.0), shown_before[at].xyz, realtime.on_film > 1u);
    return vec4f(now.xyz * frames - before * (frames - 1.0), 1.0);
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
