// Path tracing: the same decisions with the same random numbers as the CPU's. What happens at a vertex is the optics'
// path functions; this is only the loop.
//
// One loop runs over the segments of all samples of a pixel: when a path ends, the invocation goes on with the next sample
// instead of waiting for its neighbours' longer paths.

const PAIRS_BEFORE_VERTICES: u32 = 2u;
const PAIRS_PER_VERTEX: u32 = 4u;
const PAIR_BSDF: u32 = 0u;
const PAIR_LIGHT: u32 = 1u;
/// x: which lobe. y: Russian roulette.
const PAIR_LOBE: u32 = 2u;
/// x: which of the models that a material mixes.
const PAIR_MODEL: u32 = 3u;

/// A path on its way to the next vertex.
struct Path {
    state: PathState,
    sampler: PixelSampler,
    origin: vec3f,
    direction: vec3f,
    /// Length of the path so far, for footprints.
    length: f32,
}

/// Where the paths of one camera ray part, if more than one goes on from its first vertex.
struct Fork {
    /// The camera's path before it arrived.
    path: Path,
    hit: Hit,
    /// Paths that have not gone on yet.
    waiting: u32,
}

fn start_path(pixel: vec2u, sample: u32) -> Path {
    let sampler = pixel_sampler(pixel, sample);
    let ray = pixel_ray(pixel, sampler);
    return Path(path_start(), sampler, ray.origin, ray.direction, 0.0);
}

/// A number of the ray that tells tracers' questions about holes apart.
fn path_salt(path: Path) -> u32 {
    return path.sampler.scramble + path.state.depth;
}

/// Renders the samples of this dispatch of one pixel of the window.
fn render_pixel(pixel: vec2u) {
    var sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    var sample = view.first_sample;
    let end = view.first_sample + view.sample_count;
    var path = start_path(pixel, sample);
    var fork: Fork;
    var at_fork = false;
    while sample < end {
        var hit = fork.hit;
        if !(SPLITS_PATHS && at_fork) {
            hit = closest(path.origin, path.direction, path_salt(path));
        }
        var alive = false;
        if hit.instance == NONE {
            path.state = path_add_distant(path.state, path.direction);
            if WANTS_AOVS && path.state.depth == 1u {
                record_miss(pixel, sample);
            }
        } else {
            alive = arrive(&path, &fork, hit, at_fork, pixel, sample);
        }
        at_fork = false;
        if alive {
            continue;
        }
        if SPLITS_PATHS && fork.waiting > 0u {
            // The next branch goes on from the fork; what it gathers is added to what the sample has so far.
            let gathered = path.state.radiance;
            path = fork.path;
            path.state.radiance = gathered;
            at_fork = true;
            continue;
        }
        sums = add_sample(sums, path.state.radiance);
        sample += 1u;
        path = start_path(pixel, sample);
    }
    store_samples(pixel, sums);
}

/// Everything that happens where a path arrives. Returns whether it goes on. `at_fork`: it has been here before, and all
/// that is left to do is to send the next branch on its way.
fn arrive(path: ptr<function, Path>, fork: ptr<function, Fork>, hit: Hit, at_fork: bool, pixel: vec2u, sample: u32) -> bool {
    let s = surface_at((*path).origin, (*path).direction, hit);
    let before = *path;
    (*path).length += hit.t;
    let footprint = view.pixel_spread * (*path).length;
    if !(SPLITS_PATHS && at_fork) {
        if WANTS_AOVS && (*path).state.depth == 1u {
            record_hit(pixel, sample, s, hit.t);
        }
        let emitted = surface_emission(s, footprint);
        if emitted.x + emitted.y + emitted.z > 0.0 {
            let pdf = surface_light_pdf(s, (*path).origin, (*path).direction, hit.t);
            (*path).state = path_add_emission((*path).state, emitted, pdf);
        }
        if (*path).state.depth >= view.max_depth {
            return false;
        }
        if SPLITS_PATHS && (*path).state.depth == 1u {
            (*fork).path = before;
            (*fork).hit = hit;
            (*fork).waiting = view.splitting;
        }
    }
    if SPLITS_PATHS && (*path).state.depth == 1u {
        // The branches share what comes; each draws numbers of its own.
        let branch = view.splitting - (*fork).waiting;
        (*fork).waiting -= 1u;
        (*path).state.throughput *= 1.0 / f32(view.splitting);
        (*path).sampler.scramble = hash_combine((*path).sampler.scramble, branch);
    }
    return scatter(path, s, footprint);
}

/// Next-event estimation and the path's continuation at a surface. Returns whether there is one.
fn scatter(path: ptr<function, Path>, s: Surface, footprint: f32) -> bool {
    let sampler = (*path).sampler;
    // Numbers are drawn only where something depends on them.
    let pair = PAIRS_BEFORE_VERTICES + PAIRS_PER_VERTEX * ((*path).state.depth - 1u);
    var u_model = 0.0;
    if mixes_models(s.material) {
        u_model = sample_2d(sampler, pair + PAIR_MODEL).x;
    }
    let bsdf = surface_bsdf(s, footprint, u_model, view.single_scatter != 0u);
    if bsdf.kind == BSDF_NONE {
        return false;
    }
    let frame = frame_from_normal(s.shading_normal);
    let wo = to_local(frame, s.wo);
    if bsdf_has_smooth_part(bsdf) && scene.light_count > 0u {
        let light = sample_light(s.position, sample_2d(sampler, pair + PAIR_LIGHT));
        (*path).state.radiance += connect(*path, s, frame, bsdf, wo, light);
    }
    var u_lobe = vec2f(0.0);
    if (*path).state.depth + 1u >= view.roulette_start || bsdf_has_lobes(bsdf) {
        u_lobe = sample_2d(sampler, pair + PAIR_LOBE);
    }
    let next = bsdf_sample(bsdf, wo, u_lobe.x, sample_2d(sampler, pair + PAIR_BSDF));
    let wi = to_world(frame, next.wi);
    let above = dot(wi, s.normal) > 0.0;
    // Between shading and geometric normal there are directions that would leak through the surface.
    if next.pdf <= 0.0 || above == next.transmitted {
        return false;
    }
    (*path).state = path_scatter((*path).state, next, bsdf.eta);
    let survival = roulette_survival((*path).state, view.roulette_start, view.roulette_min_survival);
    if u_lobe.y >= survival {
        return false;
    }
    (*path).state.throughput *= 1.0 / survival;
    (*path).origin = ray_origin(s, above);
    (*path).direction = wi;
    return true;
}

/// What a light sample adds to the pixel: nothing if it is occluded or cannot contribute.
fn connect(path: Path, s: Surface, frame: Frame, bsdf: Bsdf, wo: vec3f, light: LightSample) -> vec3f {
    let above = dot(light.wi, s.normal) > 0.0;
    let wi = to_local(frame, light.wi);
    if light.pdf <= 0.0 || !(above || bsdf_transmits(bsdf)) || above != (wi.z > 0.0) {
        return vec3f(0.0);
    }
    let value = bsdf_eval(bsdf, wo, wi);
    let contribution =
        path_light_contribution(path.state.throughput, value, light.radiance, light.pdf, light.delta);
    if all(contribution == vec3f(0.0)) || shadowed(s, light, above, path_salt(path)) {
        return vec3f(0.0);
    }
    return contribution;
}

/// Whether something is between a surface and a light sample; `above`: on the side of the surface's normal.
fn shadowed(s: Surface, light: LightSample, above: bool, salt: u32) -> bool {
    let origin = ray_origin(s, above);
    // The offset may be longer than the way to a light that is very near.
    let distance = light.distance - dot(origin - s.position, light.wi);
    return occluded(origin, light.wi, distance * SHADOW_END, salt);
}
