// Path tracing as a megakernel: an invocation follows all paths of a pixel from their first vertex to the last.
//
// One loop runs over the segments of all samples of a pixel: when a path ends, the invocation goes on with the next sample
// instead of waiting for its neighbours' longer paths.

#import film, path_vertex, rays, scene, surface, variant
#import optics::camera, optics::constants

/// Where the paths of one camera ray part, if more than one goes on from its first vertex.
struct Fork {
    /// The camera's path before it arrived.
    path: Path,
    hit: Hit,
    /// Paths that have not gone on yet.
    waiting: u32,
}

/// Renders the samples of this dispatch of one pixel of the window.
fn render_pixel(work: PixelWork) {
    let pixel = work.pixel;
    var sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    var sample = work.first_sample;
    let end = work.first_sample + view.sample_count;
    var path = start_path(pixel, sample);
    var fork: Fork;
    // Not zero: the path has been at the fork before, and is sent on as this branch.
    var branch = 0u;
    while sample < end {
        var hit = fork.hit;
        if !(SPLITS_PATHS && branch > 0u) {
            hit = closest(path.origin, path.direction, path_salt(path));
        }
        var alive = false;
        if hit.instance == NONE {
            path.state = shade_miss(path, path.origin);
            if WANTS_AOVS && path.state.depth == 1u {
                record_miss(pixel, sample);
            }
            if WANTS_FEATURES && path.looks {
                record_sky(pixel, path.state.throughput, path.state.depth);
            }
        } else {
            let s = surface_at(path.origin, path.direction, hit);
            if path.state.depth == 1u && !(SPLITS_PATHS && branch > 0u) {
                if WANTS_AOVS {
                    record_first_hit(pixel, sample, s, hit.t);
                }
                if SPLITS_PATHS && view.max_depth > 1u {
                    fork = Fork(path, hit, view.splitting - 1u);
                }
            }
            var shadow = no_shadow_ray();
            let looks = WANTS_FEATURES && path.looks;
            let arriving = path.state;
            alive = shade_hit(&path, s, hit.t, branch, &shadow);
            if looks && !(alive && path.looks) {
                path.looks = false;
                let footprint = pixel_footprint(pixel_spread(), path.length);
                record_features(pixel, arriving.throughput, arriving.depth, s, footprint);
            }
            if is_wanted(shadow) && !occluded(shadow.origin, shadow.direction, shadow.distance, shadow.salt) {
                path.state.radiance += shadow.contribution;
            }
        }
        branch = 0u;
        if alive {
            continue;
        }
        if SPLITS_PATHS && fork.waiting > 0u {
            // The next branch goes on from the fork; what it gathers is added to what the sample has so far.
            branch = view.splitting - fork.waiting;
            fork.waiting -= 1u;
            let gathered = path.state.radiance;
            path = fork.path;
            path.looks = false;
            path.state.radiance = gathered;
            continue;
        }
        sums = add_sample(sums, path.state.radiance);
        sample += 1u;
        path = start_path(pixel, sample);
    }
    store_samples(work, sums);
}
