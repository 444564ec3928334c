// A frame's samples join what was kept of those before. Samples of the pixels around say how far the past may be from the
// present, while anything moves, and how far a single sample may stand out.

#import histories, planes, realtime_found, realtime_frame, realtime_guides, realtime_history
#import optics::allocation, optics::history, optics::signal

@group(3) @binding(16) var<storage, read_write> signals: array<vec4u>;

/// Pixels beside a workgroup's own that it looks at.
const APRON: u32 = 2u;
const TILE_SIDE: u32 = 8u + 2u * APRON;
const TILE_AREA: u32 = TILE_SIDE * TILE_SIDE;
/// Histories of fewer samples have no variance of their own that could be trusted.
const TRUSTED_SAMPLES: f32 = 4.0;
/// The past of pixels with more samples is not disturbed by single ones.
const CALM_SAMPLES: f32 = 64.0;

/// The frame's mean at a pixel, without the surface's colour.
struct Fresh {
    diffuse: vec3f,
    count: u32,
    specular: vec3f,
    surface: u32,
}

var<workgroup> tile: array<Fresh, 144>;

fn fresh_at(pixel: vec2i) -> Fresh {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(realtime.size)) {
        return Fresh(vec3f(0.0), 0u, vec3f(0.0), 0u);
    }
    let at = place_of(vec2u(pixel));
    let light = load_found_light(at);
    let colors = guide_colors(at);
    let scale = 1.0 / max(f32(light.count), 1.0);
    return Fresh(demodulate(light.diffuse * scale, colors.diffuse), light.count,
        demodulate(light.specular * scale, colors.specular), guide_surface(at));
}

/// The samples around a pixel, of one signal.
struct Around {
    mean: vec3f,
    mean_of_squares: vec3f,
    /// Largest luminance of the others.
    brightest: f32,
    /// Mean and mean of squares of luminance.
    luminance: vec2f,
    count: f32,
}

fn add_around(sum: Around, c: vec3f, is_other: bool) -> Around {
    var next = sum;
    let y = luminance(c);
    let encoded = ycocg_encode(c);
    next.mean += encoded;
    next.mean_of_squares += encoded * encoded;
    next.luminance += vec2f(y, y * y);
    next.brightest = max(next.brightest, select(0.0, y, is_other));
    next.count += 1.0;
    return next;
}

fn around_mean(sum: Around) -> Around {
    let scale = 1.0 / max(sum.count, 1.0);
    return Around(sum.mean * scale, sum.mean_of_squares * scale, sum.brightest, sum.luminance * scale, sum.count);
}

fn clipped(past: vec3f, around: Around) -> vec3f {
    if around.count < 4.0 {
        return past;
    }
    let half = vec3f(deviation(around.mean.x, around.mean_of_squares.x), deviation(around.mean.y, around.mean_of_squares.y),
        deviation(around.mean.z, around.mean_of_squares.z)) * realtime.clip;
    return max(ycocg_decode(clip_to_box(ycocg_encode(past), around.mean, half)), vec3f(0.0));
}

/// Variance of the mean of `count` samples: by the pixel's own moments, or by the pixels around it while those are few.
fn variance_of_mean(moments: vec2f, count: f32, fresh: f32, around: Around) -> f32 {
    var variance = sample_variance(moments.x, moments.y, count);
    if count < TRUSTED_SAMPLES {
        let spatial = max(around.luminance.y - around.luminance.x * around.luminance.x, 0.0) * max(fresh, 1.0);
        variance = max(variance, spatial);
    }
    return variance / max(count, 1.0);
}

/// One signal's share of a history.
struct Mean {
    color: vec3f,
    count: f32,
    moments: vec2f,
}

/// A frame's mean of `count` samples joins the past; `square`: mean of squares of the samples' luminance.
fn joined(past: Mean, now: vec3f, count: f32, square: f32) -> Mean {
    if count <= 0.0 {
        return past;
    }
    let most = select(realtime.most_history, 1e9, is_set(REALTIME_STANDS_STILL));
    let weight = history_weight(past.count, count, most);
    var next = past;
    next.color += (now - past.color) * weight;
    next.moments += (vec2f(luminance(now), square) - past.moments) * weight;
    next.count = min(past.count, most) + count;
    return next;
}

fn limited(c: vec3f, around: Around, past: f32) -> vec3f {
    if is_set(REALTIME_SMOOTHS) && around.count > 4.0 && past < CALM_SAMPLES {
        return limit_luminance(c, around.brightest);
    }
    return c;
}

@compute @workgroup_size(8, 8)
fn accumulate(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) local_index: u32,
) {
    let corner = vec2i(group.xy * 8u) - vec2i(i32(APRON));
    for (var i = local_index; i < TILE_AREA; i += 64u) {
        tile[i] = fresh_at(corner + vec2i(vec2u(i % TILE_SIDE, i / TILE_SIDE)));
    }
    workgroupBarrier();
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    let own = tile[(local.y + APRON) * TILE_SIDE + local.x + APRON];
    if guide_distance(at) <= 0.0 {
        signals[at] = vec4u(0u);
        return;
    }
    var diffuse = Around(vec3f(0.0), vec3f(0.0), 0.0, vec2f(0.0), 0.0);
    var specular = diffuse;
    for (var i = 0u; i < 25u; i++) {
        let there = tile[(local.y + i / 5u) * TILE_SIDE + local.x + i % 5u];
        if there.count > 0u && there.surface == own.surface {
            diffuse = add_around(diffuse, there.diffuse, i != 12u);
            specular = add_around(specular, there.specular, i != 12u);
        }
    }
    diffuse = around_mean(diffuse);
    specular = around_mean(specular);

    var past = load_history(at);
    let count = f32(own.count);
    if !is_set(REALTIME_STANDS_STILL) && is_set(REALTIME_GATHERS) {
        past.diffuse = clipped(past.diffuse, diffuse);
        past.specular = clipped(past.specular, specular);
    }
    let light = load_found_light(at);
    let colors = guide_colors(at);
    let luminances = vec2f(luminance(divisor(colors.diffuse)), luminance(divisor(colors.specular)));
    let squares = light.squares / max(count, 1.0) / (luminances * luminances);
    let new_diffuse = limited(own.diffuse, diffuse, past.diffuse_count);
    let new_specular = limited(own.specular, specular, past.specular_count);
    let d = joined(Mean(past.diffuse, past.diffuse_count, past.moments.xy), new_diffuse, count, squares.x);
    let s = joined(Mean(past.specular, past.specular_count, past.moments.zw), new_specular, count, squares.y);
    var hit_distance = past.hit_distance;
    if count > 0.0 {
        let weight = history_weight(past.specular_count, count, realtime.most_history);
        hit_distance += (light.hit_distance / count - past.hit_distance) * weight;
    }
    histories[in_plane(HISTORY_DIFFUSE, at)] = plane_floats(d.color, d.count);
    histories[in_plane(HISTORY_SPECULAR, at)] = plane_floats(s.color, s.count);
    histories[in_plane(HISTORY_MOMENTS, at)] = bitcast<vec4u>(vec4f(d.moments, s.moments));
    histories[in_plane(HISTORY_OWNER, at)].x = bitcast<u32>(hit_distance);
    let scale = 1.0 / realtime.white;
    let diffuse_deviation = sqrt(max(variance_of_mean(d.moments, d.count, count, diffuse), 0.0));
    let specular_deviation = sqrt(max(variance_of_mean(s.moments, s.count, count, specular), 0.0));
    signals[at] = pack_signal(
        Signal(d.color * scale, diffuse_deviation * scale, s.color * scale, specular_deviation * scale));
}
