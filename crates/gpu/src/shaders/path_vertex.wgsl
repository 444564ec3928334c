// What happens at a vertex of a path: the same decisions with the same random numbers as the CPU's, by the optics' path
// functions. Nothing here asks a tracer. Whoever follows paths, the megakernel's loop or the wavefront's stages, finds the
// vertex, calls `shade_hit`, and asks for the shadow ray that it hands out.

#import film, light_chooser, lights, material, scattering, scene, surface, texels, variant
#import optics::constants, optics::frame, optics::intersect, optics::light, optics::light_tree
#import optics::medium, optics::path, optics::random, optics::vertex

/// A path on its way to the next vertex.
struct Path {
    state: PathState,
    sampler: PixelSampler,
    origin: vec3f,
    direction: vec3f,
    /// Length of the path so far, for footprints.
    length: f32,
    /// What the light sample of the last vertex knew of its surface; see `light_key`. Only where there is a LIGHT_TREE.
    sampling_normal: u32,
    /// Whether it has met nothing yet but mirrors and clear glass, and looks for what guides denoisers. Only if WANTS_FEATURES.
    looks: bool,
}

/// A question for the tracer: is anything between a vertex and a light sample?
struct ShadowRay {
    origin: vec3f,
    /// Where it ends, in metres.
    distance: f32,
    direction: vec3f,
    salt: u32,
    /// What the light adds to the sample if nothing is in between. Zero: nobody needs to ask.
    contribution: vec3f,
}

fn start_path(pixel: vec2u, sample: u32) -> Path {
    let sampler = pixel_sampler(pixel, sample);
    let ray = pixel_ray(pixel, sampler);
    var state = path_start();
    state.throughput *= ray.weight;
    return Path(state, sampler, ray.origin, ray.direction, 0.0, ALL_SIDES, WANTS_FEATURES);
}

/// A number of the ray that tells tracers' questions about holes apart.
fn path_salt(path: Path) -> u32 {
    return path.sampler.scramble + path.state.depth;
}

/// Whether nothing of the segment that the path is on counts but light at its end.
fn is_on_last_segment(path: Path) -> bool {
    return is_last_segment(path.state.depth, view.max_depth);
}

/// Whether a surface that shines may be in the path's way.
fn may_meet_emitter(path: Path) -> bool {
    let inverse = inverse_direction(path.direction);
    for (var i = 0u; i < scene.emitter_box_count; i++) {
        let low = scene.emitter_boxes + 6u * i;
        if intersect_box(path.origin, inverse, words_vec3(low), words_vec3(low + 3u), 0.0, FAR).hit {
            return true;
        }
    }
    return false;
}

/// Whether anything can come of following the path.
fn is_worth_following(path: Path) -> bool {
    return !is_on_last_segment(path) || distant_light_shines() || may_meet_emitter(path);
}

/// Whether all that matters is whether the path leaves the scene, so that any hit will do.
fn only_has_to_miss(path: Path) -> bool {
    return is_on_last_segment(path) && !may_meet_emitter(path);
}

/// Whether the path ends where it arrives, and finds no light there.
fn ends_in_the_dark(path: Path, hit: Hit) -> bool {
    return is_on_last_segment(path) && !may_shine(hit_binding(hit).material);
}

fn no_shadow_ray() -> ShadowRay {
    return ShadowRay(vec3f(0.0), 0.0, vec3f(0.0), 0u, vec3f(0.0));
}

/// Whether a light sample counts, unless something is in between.
fn is_wanted(ray: ShadowRay) -> bool {
    return !all(ray.contribution == vec3f(0.0));
}

/// Everything that happens where a path arrives after a segment of length `t`: light that the surface emits, a light sample,
/// the path's continuation. Returns whether there is one.
///
/// - `branch`: which of the paths that part at the first vertex this is. What is seen there counts for the first one only.
fn shade_hit(
    path: ptr<function, Path>,
    s: Surface,
    t: f32,
    branch: u32,
    shadow: ptr<function, ShadowRay>,
) -> bool {
    let footprint = travel(path, s, t);
    if !(SPLITS_PATHS && branch > 0u) {
        let emitted = surface_emission(s, footprint);
        if emitted.x + emitted.y + emitted.z > 0.0 {
            let pdf = surface_light_pdf(s, (*path).origin, (*path).sampling_normal, (*path).direction, t);
            let before = (*path).state.radiance;
            (*path).state = limit_found(path_add_emission((*path).state, emitted, pdf, MIS), before);
        }
    }
    return depart(path, s, footprint, branch, true, shadow);
}

/// The path after leaving the scene: what is infinitely far away is what it finds.
fn shade_miss(path: Path, vertex: vec3f) -> PathState {
    let found = path_add_distant(path.state, vertex, path.sampling_normal, path.direction);
    return limit_found(found, path.state.radiance);
}

/// A path after a step on which it may have found light; `before`: what it had found until then. See `path_limit_found`.
fn limit_found(state: PathState, before: vec3f) -> PathState {
    if LIMITS_INDIRECT {
        return path_limit_found(state, before, view.most_indirect);
    }
    return state;
}

/// What a light sample adds at the end of a path's next segment.
fn limit_sampled(found: vec3f, path: PathState) -> vec3f {
    if LIMITS_INDIRECT {
        return limit_indirect(found, path.depth + 1u, view.most_indirect);
    }
    return found;
}

/// What a segment of length `t` does to a path. Returns the footprint where it ends.
fn travel(path: ptr<function, Path>, s: Surface, t: f32) -> f32 {
    (*path).length += t;
    if SCENE_ABSORBS && !s.front {
        // The far side of a body tells what the light has come through.
        (*path).state.throughput *= transmittance(materials[s.material].absorption, t);
    }
    return pixel_spread() * (*path).length;
}

/// A light sample, if the vertex `asks_light`, and the path's continuation. Returns whether there is one. `branch`: see `shade_hit`.
fn depart(
    path: ptr<function, Path>,
    s: Surface,
    footprint: f32,
    branch: u32,
    asks_light: bool,
    shadow: ptr<function, ShadowRay>,
) -> bool {
    if (*path).state.depth >= view.max_depth {
        return false;
    }
    if SPLITS_PATHS && (*path).state.depth == 1u {
        // Each branch draws numbers of its own.
        (*path).state = path_branch((*path).state, view.splitting);
        (*path).sampler.scramble = hash_combine((*path).sampler.scramble, branch);
    }
    return scatter(path, s, footprint, asks_light, shadow);
}

/// Next-event estimation, if the vertex `asks_light`, and the path's continuation at a surface. Returns whether there is one.
fn scatter(
    path: ptr<function, Path>,
    s: Surface,
    footprint: f32,
    asks_light: bool,
    shadow: ptr<function, ShadowRay>,
) -> bool {
    let sampler = (*path).sampler;
    // Numbers are drawn only where something depends on them.
    let pair = vertex_pair((*path).state.depth);
    var u_model = 0.0;
    if wants_model_number(s.material) {
        u_model = sample_2d(sampler, pair + PAIR_MODEL).x;
    }
    let throughput = (*path).state.throughput;
    let bsdf = surface_scattering(s, footprint, throughput, u_model, view.single_scatter != 0u);
    if !scatters(bsdf) {
        return false;
    }
    let frame = scattering_frame(bsdf, s);
    let wo = to_local(frame, s.wo);
    if asks_light && scattering_has_smooth_part(bsdf) && scene.light_count > 0u {
        if LIGHT_TREE {
            (*path).sampling_normal = light_key(s.origin, sampling_normal(frame.normal, scattering_transmits(bsdf)));
        }
        let light = sample_light(s.origin, (*path).sampling_normal, sample_2d(sampler, pair + PAIR_LIGHT));
        *shadow = light_shadow_ray(*path, s, frame, bsdf, wo, light);
    }
    var u_lobe = vec2f(0.0);
    if (*path).state.depth + 1u >= view.roulette_start || scattering_has_lobes(bsdf) {
        u_lobe = sample_2d(sampler, pair + PAIR_LOBE);
    }
    let next = scattering_sample(bsdf, wo, u_lobe.x, sample_2d(sampler, pair + PAIR_BSDF));
    let continuation = continue_from_surface((*path).state, next, frame, s.horizon, scattering_eta(bsdf),
        path_roulette(), u_lobe.y);
    if !continuation.alive {
        return false;
    }
    (*path).state = continuation.state;
    (*path).origin = ray_origin(s, continuation.above);
    (*path).direction = continuation.wi;
    if WANTS_FEATURES {
        // Nobody looks at where last segments end.
        (*path).looks = (*path).looks && scattering_is_sharp(bsdf) && !is_on_last_segment(*path);
    }
    return is_worth_following(*path);
}

/// How paths of this picture end by chance.
fn path_roulette() -> Roulette {
    return Roulette(view.roulette_start, view.roulette_min_survival);
}

/// The question whether a light sample counts; none if it cannot contribute.
fn light_shadow_ray(
    path: Path,
    s: Surface,
    frame: Frame,
    bsdf: Scattering,
    wo: vec3f,
    light: LightSample,
) -> ShadowRay {
    let side = light_side(light.wi, light.pdf, frame, s.horizon, scattering_transmits(bsdf));
    if !side.possible {
        return no_shadow_ray();
    }
    let value = scattering_eval(bsdf, wo, side.wi);
    let found = path_light_contribution(path.state.throughput, value, light.radiance, light.pdf, light.delta, MIS);
    return shadow_ray(s, light, side.above, path_salt(path), limit_sampled(found, path.state));
}

/// The way from a surface to a light sample; `above`: on the side of the surface's normal.
fn shadow_ray(s: Surface, light: LightSample, above: bool, salt: u32, contribution: vec3f) -> ShadowRay {
    let origin = ray_origin(s, above);
    let way = shadow_way(light.wi, light.distance, origin - s.origin);
    return ShadowRay(origin, way.distance, way.direction, salt, contribution);
}
