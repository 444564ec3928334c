// A frame's samples join what was kept of those before. Samples of the pixels around say how far the past may be from the
// present, while anything moves, and how far a single sample may stand out.

#import histories, planes, realtime_found, realtime_frame, realtime_guides, realtime_history
#import optics::accumulation, optics::signal

@group(3) @binding(16) var<storage, read_write> signals: array<vec4u>;

/// Pixels beside a workgroup's own that it looks at.
const APRON: u32 = 2u;
const TILE_SIDE: u32 = 8u + 2u * APRON;
const TILE_AREA: u32 = TILE_SIDE * TILE_SIDE;
/// The past of pixels with more samples is not disturbed by single ones.
const CALM_SAMPLES: f32 = 64.0;

/// The frame's mean at a pixel, without the surface's colour.
struct Fresh {
    diffuse: vec3f,
    count: u32,
    specular: vec3f,
    surface: u32,
}

/// The workgroup's pixels and those around: the diffuse mean and the count of each, then the specular mean and the surface of
/// each. Whole vec4s side by side can be read by a subgroup at once; records of two cannot.
var<workgroup> tile: array<vec4u, 2u * TILE_AREA>;

fn load_fresh(i: u32) -> Fresh {
    let diffuse = tile[i];
    let specular = tile[TILE_AREA + i];
    return Fresh(plane_vector(diffuse), diffuse.w, plane_vector(specular), specular.w);
}

fn store_fresh(i: u32, fresh: Fresh) {
    tile[i] = plane_words(fresh.diffuse, fresh.count);
    tile[TILE_AREA + i] = plane_words(fresh.specular, fresh.surface);
}

fn fresh_at(pixel: vec2i) -> Fresh {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(realtime.size)) {
        return Fresh(vec3f(0.0), 0u, vec3f(0.0), 0u);
    }
    let at = place_of(vec2u(pixel));
    let light = load_found_light(at);
    let colors = guide_colors(at);
    return Fresh(demodulate(found_mean(light.diffuse, light.count), colors.diffuse), light.count,
        demodulate(found_mean(light.specular, light.count), colors.specular), guide_surface(at));
}

fn limited(c: vec3f, around: Neighbourhood, past: f32) -> vec3f {
    if is_set(REALTIME_SMOOTHS) && around.count > LEAST_NEIGHBOURS && past < CALM_SAMPLES {
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
        store_fresh(i, fresh_at(corner + vec2i(vec2u(i % TILE_SIDE, i / TILE_SIDE))));
    }
    workgroupBarrier();
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    let own = load_fresh((local.y + APRON) * TILE_SIDE + local.x + APRON);
    if guide_distance(at) <= 0.0 {
        signals[at] = vec4u(0u);
        return;
    }
    var diffuse = neighbourhood_empty();
    var specular = neighbourhood_empty();
    for (var i = 0u; i < 25u; i++) {
        let there = load_fresh((local.y + i / 5u) * TILE_SIDE + local.x + i % 5u);
        if there.count > 0u && there.surface == own.surface {
            diffuse = neighbourhood_add(diffuse, there.diffuse, i != 12u);
            specular = neighbourhood_add(specular, there.specular, i != 12u);
        }
    }
    diffuse = neighbourhood_mean(diffuse);
    specular = neighbourhood_mean(specular);

    var past = load_history(at);
    let count = f32(own.count);
    if !is_set(REALTIME_STANDS_STILL) && is_set(REALTIME_GATHERS) {
        past.diffuse = clip_to_neighbourhood(past.diffuse, diffuse, realtime.clip);
        past.specular = clip_to_neighbourhood(past.specular, specular, realtime.clip);
    }
    let light = load_found_light(at);
    let colors = guide_colors(at);
    let squares = demodulated_squares(light.squares, count, colors.diffuse, colors.specular);
    let most = select(realtime.most_history, 1e9, is_set(REALTIME_STANDS_STILL));
    let new_diffuse = limited(own.diffuse, diffuse, past.diffuse_count);
    let new_specular = limited(own.specular, specular, past.specular_count);
    let past_diffuse = SignalMean(past.diffuse, past.diffuse_count, past.moments.xy);
    let past_specular = SignalMean(past.specular, past.specular_count, past.moments.zw);
    let d = signal_mean_join(past_diffuse, new_diffuse, count, squares.x, most);
    let s = signal_mean_join(past_specular, new_specular, count, squares.y, most);
    let hit_distance = hit_distance_join(
        past.hit_distance, past.specular_count, light.hit_distance, count, realtime.most_history);
    histories[in_plane(HISTORY_DIFFUSE, at)] = plane_floats(d.color, d.count);
    histories[in_plane(HISTORY_SPECULAR, at)] = plane_floats(s.color, s.count);
    histories[in_plane(HISTORY_MOMENTS, at)] = bitcast<vec4u>(vec4f(d.moments, s.moments));
    histories[in_plane(HISTORY_OWNER, at)].x = bitcast<u32>(hit_distance);
    let diffuse_variance = variance_of_mean(d.moments, d.count, count, diffuse);
    let specular_variance = variance_of_mean(s.moments, s.count, count, specular);
    signals[at] = pack_signal(
        signal_of_means(d.color, diffuse_variance, s.color, specular_variance, realtime.white));
}
