// The wavefront's stages that trace nothing.

#import film, handing, path_vertex, surface, wavefront
#import optics::camera, optics::constants

/// Starts the paths of the wave at the camera.
@compute @workgroup_size(GROUP)
fn generate(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.path_count {
        return;
    }
    if id.x == 0u {
        count_rays(wave.path_count);
    }
    let work = wave_work(id.x);
    let path = start_path(work.pixel, work.first_sample);
    store_path(half_of(1u) + id.x, path, id.x * branch_count());
}

/// Records what the camera's paths have hit, and at every vertex what guides denoisers. Layers are sums over a pixel's samples, so
/// a wave with layers has one sample of each pixel.
@compute @workgroup_size(GROUP)
fn record(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.path_count {
        return;
    }
    let is_first = wave.depth == 1u;
    let features = WANTS_FEATURES && has_features(id.x);
    if !(is_first || features) {
        return;
    }
    let at = half_of(wave.depth) + id.x;
    let path = load_path(at);
    let hit = load_hit(id.x);
    let work = wave_work(path_slot(at) / branch_count());
    if hit.instance == NONE {
        if is_first {
            record_miss(work.pixel, work.first_sample);
        }
        if features {
            record_sky(work.pixel, path.state.throughput, wave.depth);
        }
        return;
    }
    let s = surface_at(path.origin, path.direction, hit);
    if is_first {
        record_first_hit(work.pixel, work.first_sample, s, hit.t);
    }
    if features {
        let footprint = pixel_footprint(view.pixel_spread, path.length + hit.t);
        record_features(work.pixel, path.state.throughput, wave.depth, s, footprint);
    }
}

/// Everything that happens where paths arrive. At the first vertex there is an invocation for each branch of each path.
@compute @workgroup_size(SHADE_GROUP)
fn shade(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let depth = wave.depth;
    let branches = select(1u, branch_count(), depth == 1u);
    var path: Path;
    var shadow = no_shadow_ray();
    var slot = 0u;
    var alive = false;
    if id.x < wave.path_count * branches {
        let index = id.x / branches;
        let branch = id.x % branches;
        let at = half_of(depth) + index;
        path = load_path(at);
        slot = path_slot(at) + branch;
        let hit = load_hit(index);
        if hit.instance == NONE {
            if branch == 0u {
                path.state = shade_miss(path, path.origin);
                if WANTS_FEATURES && path.looks {
                    note_features(index);
                }
            }
        } else if !ends_in_the_dark(path, hit) {
            let s = surface_at(path.origin, path.direction, hit);
            let looks = WANTS_FEATURES && path.looks && branch == 0u;
            alive = shade_hit(&path, s, hit.t, branch, &shadow);
            path.looks = looks && path.looks;
            if looks && !(alive && path.looks) {
                note_features(index);
            }
        }
        if depth == 1u {
            gathered[slot] = vec4f(path.state.radiance, 0.0);
        } else if !all(path.state.radiance == vec3f(0.0)) {
            gathered[slot] += vec4f(path.state.radiance, 0.0);
        }
    }
    hand_on(local, path, alive, shadow, slot, depth);
}

fn groups_for(invocations: u32, group: u32) -> array<u32, 3> {
    return array<u32, 3>((invocations + group - 1u) / group, 1u, 1u);
}

/// Moves on to the next vertex: what `shade` has handed out is what the next dispatches work on.
@compute @workgroup_size(1)
fn prepare() {
    let next_paths = atomicExchange(&wave.next_path_count, 0u);
    let casting = atomicExchange(&wave.casting, 0u);
    count_rays(next_paths + casting);
    wave.path_count = next_paths;
    wave.shadow_rays = casting;
    wave.depth += 1u;
    dispatches.paths = groups_for(next_paths, GROUP);
    dispatches.shading = groups_for(next_paths, SHADE_GROUP);
    dispatches.shadow_rays = groups_for(casting, GROUP);
}

/// Adds the samples of the wave to the film.
@compute @workgroup_size(GROUP)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.pixel_count {
        return;
    }
    let branches = branch_count();
    let first = id.x * view.sample_count;
    var sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    for (var index = first; index < first + view.sample_count; index++) {
        var radiance = vec3f(0.0);
        for (var branch = 0u; branch < branches; branch++) {
            radiance += gathered[index * branches + branch].xyz;
        }
        sums = add_sample(sums, radiance);
    }
    store_samples(wave_work(first), sums);
}
