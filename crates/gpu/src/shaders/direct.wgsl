// What the fixed-cost integrators do at a vertex: direct light with shadows, reflection, refraction and ambient occlusion; no
// global illumination. The same rays with the same random numbers as the CPU's, whose recursion is two loops here: mirrors
// and glass are followed in a chain, and only the vertex at the end of the camera's own chain sends out reflection rays, each
// of which is a chain again.
//
// A kernel defines what is to be noted of the first vertex:
//
//     fn camera_missed(pixel: vec2u, sample: u32)
//     fn camera_hit(pixel: vec2u, sample: u32, s: Surface, distance: f32)

#import film, first_hits, light_reach, lights, material, rays, scene, surface, texels
#import optics::bsdf, optics::constants, optics::falloff, optics::frame, optics::light
#import optics::phong, optics::random, optics::scatter, optics::warp

/// Pairs of random numbers are drawn one after the other; those of pixel and lens are the first.
var<private> next_pair: u32;

fn draw(sampler: PixelSampler) -> vec2f {
    next_pair += 1u;
    return sample_2d(sampler, next_pair - 1u);
}

/// What a ray may see.
const SEES_ALL: u32 = 0u;
/// After a lobe for which lights were sampled already, a surface that lights are sampled on is black.
const SEES_NO_SAMPLED_LIGHT: u32 = 1u;
/// So is the sun.
const SEES_NO_LIGHT: u32 = 2u;

/// A ray through mirrors and glass, and where it ended.
struct Chain {
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
    /// Whether it ended at a glossy surface that may reflect: the two below.
    reflects: bool,
    surface: Surface,
    bsdf: Bsdf,
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
            if chain.depth == 0u {
                continue;
            }
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

/// A ray through the specular lobe at the end of a chain; depth 0 if there is none.
fn reflection(seen: Chain, sampler: PixelSampler) -> Chain {
    let s = seen.surface;
    var specular = seen.bsdf;
    specular.diffuse = vec3f(0.0);
    specular.specular_probability = 1.0;
    let frame = frame_from_normal(s.shading_normal);
    let next = bsdf_sample(specular, to_local(frame, s.wo), 0.0, draw(sampler));
    let wi = to_world(frame, next.wi);
    var chain = new_chain(ray_origin(s, true), wi);
    chain.length = seen.length;
    chain.depth = select(seen.depth + 1u, 0u, next.pdf <= 0.0 || dot(wi, s.horizon) <= 0.0);
    // Lights are in the direct term already, so a reflected light source itself must not count again.
    chain.sees = SEES_NO_LIGHT;
    chain.full = false;
    chain.throughput = seen.throughput * next.weight;
    return chain;
}

/// Follows a chain to its end and gathers its light.
fn follow(chain: ptr<function, Chain>, sampler: PixelSampler, pixel: vec2u, sample: u32) {
    loop {
        let hit = closest((*chain).origin, (*chain).direction, sampler.scramble + next_pair);
        let from_camera = (*chain).depth == 1u;
        if hit.instance == NONE {
            if from_camera {
                camera_missed(pixel, sample);
            }
            var distant = environment_radiance((*chain).direction);
            if (*chain).sees != SEES_NO_LIGHT {
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
        let footprint = view.pixel_spread * (*chain).length;
        let u = draw(sampler);
        (*chain).radiance += (*chain).throughput * surface_emission(s, footprint);
        let bsdf = surface_bsdf(s, footprint, u.x, view.single_scatter != 0u);
        if bsdf.kind == BSDF_NONE {
            return;
        }
        if bsdf_has_smooth_part(bsdf) {
            (*chain).radiance += (*chain).throughput * direct_light(s, bsdf, (*chain).full, sampler);
        }
        if bsdf.kind == BSDF_GLOSSY {
            (*chain).radiance += (*chain).throughput * ambient_light(s, bsdf, (*chain).full, sampler);
            let deep = (*chain).depth >= view.max_depth;
            (*chain).reflects = (*chain).full && !deep && bsdf.specular_probability > 0.0;
            (*chain).surface = s;
            (*chain).bsdf = bsdf;
            return;
        }
        if (*chain).depth >= view.max_depth {
            return;
        }
        if !go_on(chain, s, bsdf, u.y, sampler) {
            return;
        }
    }
}

/// Turns a chain at a mirror or dielectric into one sampled direction. Returns whether there is one.
fn go_on(chain: ptr<function, Chain>, s: Surface, bsdf: Bsdf, u_lobe: f32, sampler: PixelSampler) -> bool {
    let frame = frame_from_normal(s.shading_normal);
    let next = bsdf_sample(bsdf, to_local(frame, s.wo), u_lobe, draw(sampler));
    let wi = to_world(frame, next.wi);
    let above = dot(wi, s.horizon) > 0.0;
    if next.pdf <= 0.0 || above == next.transmitted {
        return false;
    }
    (*chain).origin = ray_origin(s, above);
    (*chain).direction = wi;
    (*chain).throughput *= next.weight;
    (*chain).depth += 1u;
    (*chain).sees = select(SEES_NO_SAMPLED_LIGHT, SEES_ALL, next.delta);
    (*chain).full = (*chain).full && next.delta;
    return true;
}

/// Every light with its shadow rays.
fn direct_light(s: Surface, bsdf: Bsdf, full: bool, sampler: PixelSampler) -> vec3f {
    let frame = frame_from_normal(s.shading_normal);
    var sum = vec3f(0.0);
    for (var index = 0u; index < scene.light_count; index++) {
        sum += light_with_shadows(index, s, frame, bsdf, full, sampler);
    }
    return sum;
}

/// A light with its shadow rays.
fn light_with_shadows(index: u32, s: Surface, frame: Frame, bsdf: Bsdf, full: bool, sampler: PixelSampler) -> vec3f {
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
    return flat_light_is_above(load_light(index), lights[index].position - s.origin, s.horizon);
}

/// Value times cosine, as lights shade.
fn lit_value(bsdf: Bsdf, wo: vec3f, wi: vec3f) -> vec3f {
    if view.phong != 0u && bsdf.kind == BSDF_GLOSSY {
        return phong_eval(bsdf, wo, wi);
    }
    return bsdf_eval(bsdf, wo, wi).value_cos;
}

/// What a light's sample adds if nothing is in its way.
fn unshadowed_light(s: Surface, frame: Frame, bsdf: Bsdf, wo: vec3f, light: LightSample) -> vec3f {
    let above = dot(light.wi, s.horizon) > 0.0;
    let wi = to_local(frame, light.wi);
    if light.pdf <= 0.0 || above != (wi.z > 0.0) || !(above || bsdf_transmits(bsdf)) {
        return vec3f(0.0);
    }
    let falloff = falloff_factor(view.falloff, light.distance);
    return lit_value(bsdf, wo, wi) * light.radiance * (falloff / light.pdf);
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
    let way = light_way(light.wi, light.distance, origin - s.origin);
    return ShadowRay(origin, way.distance * SHADOW_END, way.direction);
}

/// Whether something stands in the way of a light's sample.
fn is_hidden(s: Surface, light: LightSample, sampler: PixelSampler) -> bool {
    if view.shadows == 0u {
        return false;
    }
    let ray = shadow_ray(s, light);
    return occluded(ray.origin, ray.direction, ray.distance, sampler.scramble + next_pair);
}

/// The environment's light on the diffuse lobe, with occlusion.
fn ambient_light(s: Surface, bsdf: Bsdf, full: bool, sampler: PixelSampler) -> vec3f {
    let albedo = bsdf.diffuse * bsdf.diffuse_scale;
    if all(albedo == vec3f(0.0)) {
        return vec3f(0.0);
    }
    let occlusion_rays = select(0u, view.ambient_samples, full);
    let count = max(occlusion_rays, 1u);
    let frame = frame_from_normal(s.shading_normal);
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let wi = to_world(frame, sample_cosine_hemisphere(draw(sampler)));
        if dot(wi, s.horizon) <= 0.0 {
            continue;
        }
        let salt = sampler.scramble + next_pair;
        if occlusion_rays == 0u || !occluded(ray_origin(s, true), wi, view.ambient_distance, salt) {
            sum += environment_radiance(wi);
        }
    }
    return albedo * sum * (1.0 / f32(count));
}
