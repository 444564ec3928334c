// Path tracing where there is something between surfaces, as a megakernel: an invocation follows all paths of a pixel.
//
// One ray a turn, whoever asks for it: the path, or a light sample, whose way may lead through many boundaries. So neighbours
// in different situations trace their rays together, and the tracer stands once in the program.

#import film, path_vertex, rays, scene, scene_records, surface, texels, tracer, variant
#import volume_media, volume_vertex
#import optics::camera, optics::constants, optics::interiors, optics::random, optics::vertex
#import optics::volume

/// Who asks for the next ray. What the camera stands in:
const ASKS_AROUND: u32 = 0u;
/// What the camera ray sees first, behind all boundaries: auxiliary layers.
const ASKS_FIRST: u32 = 1u;
const ASKS_PATH: u32 = 2u;
const ASKS_LIGHT: u32 = 3u;

/// Where the paths of one camera ray part, if more than one goes on from its first vertex.
struct Fork {
    /// The path as it has arrived there.
    walk: VolumePath,
    hit: Hit,
    event: PathEvent,
    /// Paths that have not gone on yet.
    waiting: u32,
}

/// Renders the samples of this dispatch of one pixel of the window.
fn render_pixel(work: PixelWork) {
    let pixel = work.pixel;
    var sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    var sample = work.first_sample;
    let end = work.first_sample + view.sample_count;
    var surroundings = surroundings_unknown();
    var walk: VolumePath;
    var way = way_along(pixel_camera(pixel).origin, surroundings_direction());
    // The host does not count it either.
    way.crossings = 1u;
    var asks = ASKS_AROUND;
    var fork: Fork;
    // Not zero: the path has been at the fork before, and is sent on as this branch.
    var branch = 0u;
    var alive = false;
    var begins = false;
    while sample < end {
        if begins {
            begins = false;
            walk = start_volume_path(pixel, sample, surroundings.around);
            asks = select(ASKS_PATH, ASKS_FIRST, WANTS_AOVS);
            way = way_along(walk.path.origin, walk.path.direction);
        }
        if asks == ASKS_PATH {
            way = way_along(walk.path.origin, walk.path.direction);
        }
        var hit = hit_nothing();
        if SPLITS_PATHS && branch > 0u {
            hit = fork.hit;
        } else if way.end > 0.0 && (asks != ASKS_AROUND || (scene.volume_flags & VOLUMES_BODIES) != 0u) {
            // What looks through boundaries counts as one ray, as on the CPU, where that is no more.
            rays_traced += select(0u, 1u, asks == ASKS_PATH || asks == ASKS_LIGHT || way.crossings == 0u);
            hit = trace_closest(way.origin, way.direction, 0.0, way.end, path_salt(walk.path));
        }
        let hits = hit.instance != NONE;
        var s: Surface;
        if hits {
            s = surface_at(way.origin, way.direction, hit);
        }
        if asks == ASKS_AROUND {
            if hits && way.crossings < MOST_AROUND_CAMERA {
                if is_body(s.material) {
                    surroundings = surroundings_past(surroundings, s.material, materials[s.material].priority, s.front);
                }
                way.crossings += 1u;
                way.origin = ray_origin(s, false);
                continue;
            }
            begins = true;
            continue;
        }
        if WANTS_AOVS && asks == ASKS_FIRST {
            if hits && is_boundary(s.material) && way.crossings < MOST_CROSSINGS {
                way.crossings += 1u;
                way.origin = ray_origin(s, false);
                continue;
            }
            if hits {
                record_hit(pixel, sample, s, view_depth(s.position, walk.path.origin, walk.path.direction));
            } else {
                record_miss(pixel, sample);
            }
            asks = ASKS_PATH;
            continue;
        }
        if asks == ASKS_LIGHT {
            if follow_way(&way, hits, hit.t, s) {
                continue;
            }
            walk.path.state.radiance += way.contribution;
            asks = ASKS_PATH;
        } else {
            var event = fork.event;
            if !(SPLITS_PATHS && branch > 0u) {
                event = advance(&walk, hits, hit.t, s);
            }
            alive = event.kind == EVENT_CROSSING;
            way.contribution = vec3f(0.0);
            let is_vertex = event.kind == EVENT_IN_MEDIUM || event.kind == EVENT_ON_SURFACE;
            if is_vertex && (event.subsurface || walk.path.state.depth < view.max_depth) {
                if SPLITS_PATHS && !event.subsurface && walk.path.state.depth == 1u {
                    if branch == 0u {
                        fork = Fork(walk, hit, event, view.splitting - 1u);
                    }
                    // The branches share what comes; each draws numbers of its own.
                    walk.path.state = path_branch(walk.path.state, view.splitting);
                    walk.path.sampler.scramble = hash_combine(walk.path.sampler.scramble, branch);
                }
                alive = scatter_where(&walk, event, s, &way);
            }
            branch = 0u;
            if !all(way.contribution == vec3f(0.0)) {
                asks = ASKS_LIGHT;
                continue;
            }
        }
        if alive {
            continue;
        }
        if SPLITS_PATHS && fork.waiting > 0u {
            // The next branch goes on from the fork; what it gathers is added to what the sample has so far.
            branch = view.splitting - fork.waiting;
            fork.waiting -= 1u;
            let gathered = walk.path.state.radiance;
            walk = fork.walk;
            walk.path.state.radiance = gathered;
            continue;
        }
        sums = add_sample(sums, walk.path.state.radiance);
        sample += 1u;
        begins = true;
    }
    store_samples(work, sums);
}
