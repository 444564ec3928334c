// What the fixed-cost integrators do at a vertex: direct light with shadows, reflection, refraction and ambient occlusion; no
// global illumination. The same rays with the same random numbers as the CPU's, whose recursion is two loops here: mirrors
// and glass are followed in a chain, and only the vertex at the end of the camera's own chain sends out reflection rays, each
// of which is a chain again.
//
// A kernel defines what is to be noted of the first vertex:
//
//     fn camera_missed(pixel: vec2u, sample: u32)
//     fn camera_hit(pixel: vec2u, sample: u32, s: Surface, distance: f32)

#import film, first_hits, light_reach, lights, material, rays, scattering, scene, surface, texels
#import optics::constants, optics::direct_light, optics::frame, optics::light, optics::random
#import optics::vertex, optics::warp

/// Pairs of random numbers are drawn one after the other; those of pixel and lens are the first.
var<private> next_pair: u32;

fn draw(sampler: PixelSampler) -> vec2f {
    next_pair += 1u;
    return sample_2d(sampler, next_pair - 1u);
}

/// What a ray may see.
const SEES_ALL: u32 = 0u;
/// After a lobe for which lights were sampled already, what they are sampled on is black: surfaces that shine, and the sun.
const SEES_NO_LIGHT: u32 = 1u;

/// A way through mirrors and glass: the vertex or the ray that it has come to, and what it has gathered.
struct Chain {
    /// Whether the next ray leaves `surface`, as `bsdf` scatters by the two random numbers. Else it is the one below.
    departs: bool,
    surface: Surface,
    bsdf: Scattering,
    u_lobe: f32,
    u: vec2f,
    /// The next ray.
    origin: vec3f,
    direction: vec3f,
    /// Length of the path before it.
    length: f32,
    depth: u32,
    /// SEES_…, of the ray on its way.
    sees: u32,
    /// Whether its vertices get the whole number of rays, as all do that the camera sees directly, in mirrors or in
    /// polished glass.
    full: bool,
    throughput: vec3f,
    radiance: vec3f,
    /// Whether it ended at `surface`, which may reflect.
    reflects: bool,
}

fn new_chain(origin: vec3f, direction: vec3f) -> Chain {
    var chain: Chain;
    chain.origin = origin;
    chain.direction = direction;
    chain.depth = 1u;
    chain.sees = SEES_ALL;
    chain.full = true;
    chain.throughput = vec3f(1.0);
    return chain;
}

/// Makes a chain leave a vertex by one of the lobes that are not diffuse.
fn depart(chain: ptr<function, Chain>, s: Surface, bsdf: Scattering, u_lobe: f32, u: vec2f) {
    (*chain).departs = true;
    (*chain).surface = s;
    (*chain).bsdf = scattering_without_diffuse(bsdf);
    (*chain).u_lobe = u_lobe;
    (*chain).u = u;
}

/// The radiance that a chain of the camera gathers, and the reflections at its end. `first_round`: 0, or 1 if the chain has come to
/// its end already.
fn chain_radiance(start: Chain, first_round: u32, sampler: PixelSampler, pixel: vec2u, sample: u32) -> vec3f {
    // The loop's first round is the camera's chain, the others are reflections at its end.
    var seen = start;
    var radiance = vec3f(0.0);
    var chain = seen;
    var rounds = select(1u, 1u + view.reflection_samples, first_round > 0u && seen.reflects);
    for (var round = first_round; round < rounds; round++) {
        if round > 0u {
            chain = reflection(seen, sampler);
        }
        follow(&chain, sampler, pixel, sample);
        if round > 0u {
            radiance += chain.radiance * (1.0 / f32(view.reflection_samples));
            continue;
        }
        radiance = chain.radiance;
        seen = chain;
        if seen.reflects {
            rounds += view.reflection_samples;
        }
    }
    return radiance;
}

/// A chain that leaves the end of another one.
fn reflection(seen: Chain, sampler: PixelSampler) -> Chain {
    var chain = seen;
    chain.reflects = false;
    chain.radiance = vec3f(0.0);
    let u = draw(sampler);
    var u_lobe = 0.0;
    if scattering_is_layered(seen.bsdf) {
        u_lobe = draw(sampler).x;
    }
    depart(&chain, seen.surface, seen.bsdf, u_lobe, u);
    return chain;
}

/// Follows a chain to its end and gathers its light.
fn follow(chain: ptr<function, Chain>, sampler: PixelSampler, pixel: vec2u, sample: u32) {
    loop {
        if (*chain).departs && !scatter(chain) {
            return;
        }
        let hit = closest((*chain).origin, (*chain).direction, sampler.scramble + next_pair);
        let from_camera = (*chain).depth == 1u;
        if hit.instance == NONE {
            if from_camera {
                camera_missed(pixel, sample);
            }
            var distant = environment_radiance((*chain).direction);
            if (*chain).sees == SEES_ALL {
                distant = distant_radiance((*chain).direction);
            }
            (*chain).radiance += (*chain).throughput * distant;
            return;
        }
        let s = surface_at((*chain).origin, (*chain).direction, hit);
        if from_camera {
            camera_hit(pixel, sample, s, hit.t);
        }
        if (*chain).sees != SEES_ALL && s.light != NONE {
            return;
        }
        (*chain).length += hit.t;
        let footprint = pixel_spread() * (*chain).length;
        let u = draw(sampler);
        (*chain).radiance += (*chain).throughput * surface_emission(s, footprint);
        let bsdf = surface_scattering(s, footprint, (*chain).throughput, u.x, view.single_scatter != 0u);
        if !scatters(bsdf) {
            return;
        }
        let full = (*chain).full;
        if scattering_has_smooth_part(bsdf) {
            (*chain).radiance += (*chain).throughput * direct_light(s, bsdf, full, sampler);
        }
        (*chain).radiance += (*chain).throughput * ambient_light(s, bsdf, full, sampler);
        let deep = (*chain).depth >= view.max_depth;
        if !scattering_is_interface(bsdf) {
            (*chain).reflects = full && !deep && scattering_reflects(bsdf);
            (*chain).surface = s;
            (*chain).bsdf = bsdf;
            return;
        }
        if deep {
            return;
        }
        depart(chain, s, bsdf, u.y, draw(sampler));
    }
}

/// Sends a chain on from its vertex in one sampled direction. Returns whether there is one.
fn scatter(chain: ptr<function, Chain>) -> bool {
    let s = (*chain).surface;
    let frame = scattering_frame((*chain).bsdf, s);
    let next = scattering_sample((*chain).bsdf, to_local(frame, s.wo), (*chain).u_lobe, (*chain).u);
    let wi = to_world(frame, next.wi);
    let above = dot(wi, s.horizon) > 0.0;
    (*chain).departs = false;
    if !leaves_surface(next, above) {
        return false;
    }
    (*chain).origin = ray_origin(s, above);
    (*chain).direction = wi;
    (*chain).throughput *= next.weight;
    (*chain).depth += 1u;
    // Lights are in the direct term already, so one that such a lobe finds must not count again.
    (*chain).sees = select(SEES_NO_LIGHT, SEES_ALL, next.delta);
    (*chain).full = (*chain).full && next.delta;
    return true;
}

/// Every light with its shadow rays.
fn direct_light(s: Surface, bsdf: Scattering, full: bool, sampler: PixelSampler) -> vec3f {
    let frame = scattering_frame(bsdf, s);
    var sum = vec3f(0.0);
    for (var index = 0u; index < scene.light_count; index++) {
        sum += light_with_shadows(index, s, frame, bsdf, full, sampler);
    }
    return sum;
}

/// A light with its shadow rays.
fn light_with_shadows(
    index: u32,
    s: Surface,
    frame: Frame,
    bsdf: Scattering,
    full: bool,
    sampler: PixelSampler,
) -> vec3f {
    if !may_light(index, s) {
        return vec3f(0.0);
    }
    let count = select(1u, view.shadow_samples, has_soft_shadows(index) && full);
    let wo = to_local(frame, s.wo);
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let light = sample_one_light(index, s.origin, light_draw(index, sampler));
        let arriving = unshadowed_light(s, frame, bsdf, wo, light);
        if any(arriving != vec3f(0.0)) && !is_hidden(s, light, sampler) {
            sum += arriving * (1.0 / f32(count));
        }
    }
    return sum;
}

/// Whether a light can reach a surface, as far as is known before it is sampled. The environment is ambient light here.
fn may_light(index: u32, s: Surface) -> bool {
    let kind = lights[index].kind;
    return kind != LIGHT_ENVIRONMENT && (!light_is_flat(kind) || light_faces(index, s)) && light_counts(index, s.position);
}

/// Whether a light's shadows are to be soft, which takes samples of it.
fn has_soft_shadows(index: u32) -> bool {
    return view.soft_shadows != 0u && (lights[index].size > 0.0 || light_is_flat(lights[index].kind));
}

/// Where on a light the next sample is: its centre, unless its shadows are to be soft.
fn light_draw(index: u32, sampler: PixelSampler) -> vec2f {
    if has_soft_shadows(index) {
        return draw(sampler);
    }
    return vec2f(0.5);
}

/// Whether any of a flat light's corners is on the surface's side.
fn light_faces(index: u32, s: Surface) -> bool {
#ifdef SCENE_MOVES
    let light = load_light(index);
    return flat_light_is_above(light, light.position - s.origin, s.horizon);
#else
    return flat_light_is_above(load_light(index), lights[index].position - s.origin, s.horizon);
#endif
}

/// Value times cosine, as lights shade.
fn lit_value(bsdf: Scattering, wo: vec3f, wi: vec3f) -> vec3f {
    if view.phong != 0u {
        return scattering_phong_eval(bsdf, wo, wi);
    }
    return scattering_eval(bsdf, wo, wi).value_cos;
}

/// What a light's sample adds if nothing is in its way.
fn unshadowed_light(s: Surface, frame: Frame, bsdf: Scattering, wo: vec3f, light: LightSample) -> vec3f {
    let side = light_side(light.wi, light.pdf, frame, s.horizon, scattering_transmits(bsdf));
    if !side.possible {
        return vec3f(0.0);
    }
    return direct_contribution(lit_value(bsdf, wo, side.wi), light, view.falloff);
}

/// The ray to a light's sample.
struct ShadowRay {
    origin: vec3f,
    /// How long it is, metres.
    distance: f32,
    direction: vec3f,
}

fn shadow_ray(s: Surface, light: LightSample) -> ShadowRay {
    let origin = ray_origin(s, dot(light.wi, s.horizon) > 0.0);
    let way = shadow_way(light.wi, light.distance, origin - s.origin);
    return ShadowRay(origin, way.distance, way.direction);
}

/// Whether something stands in the way of a light's sample.
fn is_hidden(s: Surface, light: LightSample, sampler: PixelSampler) -> bool {
    if view.shadows == 0u {
        return false;
    }
    let ray = shadow_ray(s, light);
    return occluded(ray.origin, ray.direction, ray.distance, sampler.scramble + next_pair);
}

/// The environment's light on the diffuse lobes, with occlusion.
fn ambient_light(s: Surface, bsdf: Scattering, full: bool, sampler: PixelSampler) -> vec3f {
    let above = scattering_diffuse_albedo(bsdf);
    let below = scattering_diffuse_albedo_below(bsdf);
    var sum = vec3f(0.0);
    if any(above != vec3f(0.0)) {
        sum += above * ambient_side(s, scattering_frame(bsdf, s), 1.0, full, sampler);
    }
    if any(below != vec3f(0.0)) {
        sum += below * ambient_side(s, scattering_frame(bsdf, s), -1.0, full, sampler);
    }
    return sum;
}

/// The mean of what the environment brings to one side of a surface, 1 or -1, by the cosine.
fn ambient_side(s: Surface, frame: Frame, side: f32, full: bool, sampler: PixelSampler) -> vec3f {
    let occlusion_rays = select(0u, view.ambient_samples, full);
    let count = max(occlusion_rays, 1u);
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let wi = to_world(frame, sample_cosine_hemisphere(draw(sampler)) * vec3f(1.0, 1.0, side));
        if dot(wi, s.horizon) * side <= 0.0 {
            continue;
        }
        let salt = sampler.scramble + next_pair;
        if occlusion_rays == 0u || !occluded(ray_origin(s, side > 0.0), wi, view.ambient_distance, salt) {
            sum += environment_radiance(wi);
        }
    }
    return sum * (1.0 / f32(count));
}
