// Where samples are wanted: the map of the noise, spread; how many samples each pixel gets; and the list of those that get any,
// the neediest first. Everything here depends on frames before only.

#import lights_found, realtime_found, realtime_frame, realtime_guides, realtime_history
#import optics::allocation, optics::estimator, optics::history, optics::random

/// Counts of a frame's samples, and the sizes of its dispatches, as the driver reads them.
struct Work {
    /// Samples wanted by all pixels.
    wanted: atomic<u32>,
    padding0: u32,
    padding1: u32,
    padding2: u32,
    /// Pixels that get so many samples.
    with_samples: array<atomic<u32>, 65>,
    /// Where in the list pixels of so many samples go next.
    next: array<atomic<u32>, 65>,
    padding3: u32,
    padding4: u32,
    /// Workgroups of the dispatch that takes the first sample, the second, and so on.
    dispatches: array<vec4u, 64>,
}

@group(3) @binding(18) var<storage, read_write> noise: array<f32>;
@group(3) @binding(19) var<storage, read_write> blurred: array<f32>;
@group(3) @binding(25) var<storage, read_write> spread: array<f32>;
@group(3) @binding(20) var<storage, read_write> work: Work;

/// Samples that a pixel's own moments need to be trusted.
const TRUSTED_SAMPLES: f32 = 8.0;
/// Workgroups in a row of a dispatch.
const ROW_OF_GROUPS: u32 = 1024u;

/// Mean luminance of both signals.
fn luminance_of(moments: vec4f) -> f32 {
    return moments.x + moments.z;
}

/// Variance of one sample's luminance by the pixel's own samples.
fn own_variance(h: History) -> f32 {
    return sample_variance(h.moments.x, h.moments.y, h.diffuse_count)
        + sample_variance(h.moments.z, h.moments.w, h.specular_count);
}

/// The same by the means of the pixels around it that show the same surface.
fn local_variance(pixel: vec2u, at: u32) -> f32 {
    let surface = guide_surface(at);
    var moments = moments_empty();
    var samples = 0.0;
    let radius = i32(realtime.noise_radius);
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let there = vec2i(pixel) + vec2i(x, y);
            if any(there < vec2i(0)) || any(there >= vec2i(realtime.size)) {
                continue;
            }
            let other = place_of(vec2u(there));
            let count = diffuse_count(other);
            if guide_surface(other) == surface && count > 0.0 {
                moments = moments_add(moments, luminance_of(history_moments(other)));
                samples += count;
            }
        }
    }
    return variance_of_means(moments, samples);
}

/// Variance of one of the pixel's samples as it is seen; NOTHING_KNOWN where it has no past.
@compute @workgroup_size(8, 8)
fn measure_noise(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    if guide_distance(at) <= 0.0 {
        noise[at] = 0.0;
        return;
    }
    let h = load_history(at);
    if h.diffuse_count < 1.0 {
        noise[at] = NOTHING_KNOWN;
        return;
    }
    var around = 0.0;
    if h.diffuse_count < TRUSTED_SAMPLES {
        around = local_variance(id.xy, at);
    }
    noise[at] = seen_noise(own_variance(h), around, luminance_of(h.moments), realtime.white);
}

@compute @workgroup_size(8, 8)
fn blur_across(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    var most = 0.0;
    let radius = i32(realtime.blur_radius);
    for (var i = -radius; i <= radius; i++) {
        let x = i32(id.x) + i;
        if x >= 0 && x < i32(realtime.size.x) {
            most = spread_noise(most, noise[place_of(vec2u(u32(x), id.y))], u32(abs(i)), realtime.blur_radius);
        }
    }
    blurred[place_of(id.xy)] = most;
}

@compute @workgroup_size(8, 8)
fn blur_down(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    var most = 0.0;
    let radius = i32(realtime.blur_radius);
    for (var i = -radius; i <= radius; i++) {
        let y = i32(id.y) + i;
        if y >= 0 && y < i32(realtime.size.y) {
            most = spread_noise(most, blurred[place_of(vec2u(id.x, u32(y)))], u32(abs(i)), realtime.blur_radius);
        }
    }
    spread[place_of(id.xy)] = most;
}

/// A uniform random number of a pixel and frame, for what is decided about its samples rather than with them.
fn chance(at: u32, salt: u32) -> f32 {
    return unit_float(hash_combine(hash_combine(hash_combine(realtime.seed, realtime.number), at), salt));
}

/// Samples that a pixel wants, the frame's budget apart.
fn samples_of(at: u32) -> u32 {
    if guide_distance(at) <= 0.0 {
        return 0u;
    }
    let kept = diffuse_count(at);
    if kept < 1.0 {
        return realtime.most_samples;
    }
    let missing = samples_missing(spread[at], kept, realtime.tolerance);
    let wanted = samples_wanted(missing, realtime.least_samples, realtime.most_samples);
    if wanted == 0u && !is_set(REALTIME_GATHERS) {
        // A frame that is its own samples has some everywhere: pixels at edges would else count what they see less often less.
        return 1u;
    }
    if wanted == 0u && is_refreshed(chance(at, 1u), realtime.refresh) {
        return 1u;
    }
    return wanted;
}

// A workgroup counts for itself first: all pixels at one address would wait for each other.
var<workgroup> group_wanted: atomic<u32>;
var<workgroup> group_with_samples: array<atomic<u32>, 65>;
var<workgroup> group_next: array<u32, 65>;

/// The mask: how many samples each pixel wants.
@compute @workgroup_size(8, 8)
fn choose(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if local == 0u {
        atomicStore(&group_wanted, 0u);
    }
    workgroupBarrier();
    if is_in_picture(id.xy) {
        let at = place_of(id.xy);
        let wanted = samples_of(at);
        lights_found[in_plane(FOUND_SQUARES, at)].w = wanted;
        atomicAdd(&group_wanted, wanted);
    }
    workgroupBarrier();
    if local == 0u {
        atomicAdd(&work.wanted, atomicLoad(&group_wanted));
    }
}

fn clear_group_counts(local: u32) {
    for (var i = local; i < 65u; i += 64u) {
        atomicStore(&group_with_samples[i], 0u);
    }
    workgroupBarrier();
}

/// How many pixels there are of each number of samples, once the frame's budget has had its say.
@compute @workgroup_size(8, 8)
fn count_samples(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    clear_group_counts(local);
    if is_in_picture(id.xy) {
        let at = place_of(id.xy);
        var samples = min(samples_wanted_at(at), 64u);
        if realtime.affordable > 0u && samples > 0u {
            let scale = affordable_share(realtime.affordable, atomicLoad(&work.wanted));
            samples = samples_afforded(samples, scale, chance(at, 2u));
            lights_found[in_plane(FOUND_SQUARES, at)].w = samples;
        }
        atomicAdd(&group_with_samples[samples], 1u);
    }
    workgroupBarrier();
    for (var i = local; i < 65u; i += 64u) {
        let count = atomicLoad(&group_with_samples[i]);
        if i > 0u && count > 0u {
            atomicAdd(&work.with_samples[i], count);
        }
    }
}

/// One invocation: where the pixels of each number go in the list, and how far each dispatch reads it.
@compute @workgroup_size(1)
fn lay_out() {
    var before = 0u;
    for (var samples = 64u; samples > 0u; samples--) {
        atomicStore(&work.next[samples], before);
        before += atomicLoad(&work.with_samples[samples]);
        let groups = (before + 63u) / 64u;
        let rows = (groups + ROW_OF_GROUPS - 1u) / ROW_OF_GROUPS;
        work.dispatches[samples - 1u] = vec4u(min(groups, ROW_OF_GROUPS), rows, 1u, before);
    }
}

@compute @workgroup_size(8, 8)
fn list_pixels(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    clear_group_counts(local);
    var samples = 0u;
    var at = 0u;
    if is_in_picture(id.xy) {
        at = place_of(id.xy);
        samples = min(samples_wanted_at(at), 64u);
    }
    let in_group = atomicAdd(&group_with_samples[samples], 1u);
    workgroupBarrier();
    for (var i = local; i < 65u; i += 64u) {
        let count = atomicLoad(&group_with_samples[i]);
        if i > 0u && count > 0u {
            group_next[i] = atomicAdd(&work.next[i], count);
        }
    }
    workgroupBarrier();
    if samples > 0u {
        lights_found[in_plane(FOUND_OFFER, group_next[samples] + in_group)].w = at;
    }
}
