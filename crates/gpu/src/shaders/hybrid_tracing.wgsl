// The passes that trace rays. Each begins at the first hit, which the pass before has found, and adds to the pixel's radiance.
//
// Random numbers are those of the pixel's sample; each effect has numbers of its own, so that what one effect draws does not
// depend on another being on, nor a light's on which lights are culled.

#import direct, film, hybrid_frame, hybrid_pixels, hybrid_reflecting, rays, scattering, scene
#import surface, texels
#import optics::camera, optics::constants, optics::direct_light, optics::frame, optics::random

const PAIR_FIRST: u32 = 2u;
const PAIR_AMBIENT: u32 = 0x10000u;
const PAIR_REFLECTION: u32 = 0x20000u;
const PAIR_LIGHTS: u32 = 0x1000000u;

/// Adds what this invocation has traced.
fn count_pixel_rays(at: u32) {
    ray_counts[at] += rays_traced;
}

/// A pixel's first surface, with what every effect needs of it.
struct FirstVertex {
    surface: Surface,
    bsdf: Scattering,
    sampler: PixelSampler,
    u_lobe: f32,
    distance: f32,
    footprint: f32,
}

/// For pixels that have hit something.
fn first_vertex(pixel: vec2u, hit: Hit) -> FirstVertex {
    let ray = frame_ray(pixel);
    var vertex: FirstVertex;
    vertex.sampler = pixel_sampler(pixel, frame.sample);
    vertex.surface = surface_at(ray.origin, ray.direction, hit);
    vertex.distance = hit.t;
    vertex.footprint = pixel_footprint(view.pixel_spread, hit.t);
    let u = sample_2d(vertex.sampler, PAIR_FIRST);
    vertex.u_lobe = u.y;
    let single_scatter = view.single_scatter != 0u;
    vertex.bsdf = surface_scattering(vertex.surface, vertex.footprint, vec3f(1.0), u.x, single_scatter);
    return vertex;
}

/// What the pixel's reflection rays count for, 0 if none are sent. Glossy surfaces play Russian roulette with about what they
/// reflect; mirrors and glass always go on.
fn reflection_weight(vertex: FirstVertex) -> f32 {
    if view.max_depth <= 1u || !scatters(vertex.bsdf) {
        return 0.0;
    }
    if scattering_is_interface(vertex.bsdf) {
        return 1.0;
    }
    if !scattering_reflects(vertex.bsdf) || view.reflection_samples == 0u {
        return 0.0;
    }
    let cos_o = unit_cosine(vertex.surface.wo, vertex.surface.shading_normal);
    let reflected = scattering_reflected_share(vertex.bsdf, cos_o);
    return reflection_roulette(reflected, view.reflection_survival, vertex.u_lobe);
}

fn environment_is_black() -> bool {
    return scene.environment_width == 0u && all(scene.horizon + scene.zenith + scene.ground == vec3f(0.0));
}

/// The environment's light on the first surface, with occlusion.
@compute @workgroup_size(8, 8)
fn ambient_occlusion(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_rows(id) || environment_is_black() {
        return;
    }
    let pixel = pixel_in_rows(id);
    let at = pixel_number(pixel);
    let hit = first_hit(at);
    if hit.instance == NONE {
        return;
    }
    let vertex = first_vertex(pixel, hit);
    if any(scattering_diffuse_albedo(vertex.bsdf) + scattering_diffuse_albedo_below(vertex.bsdf) != vec3f(0.0)) {
        next_pair = PAIR_AMBIENT;
        let gathered = pixel_radiance(at);
        let ambient = ambient_light(vertex.surface, vertex.bsdf, true, vertex.sampler);
        store_radiance(at, gathered.xyz + ambient, gathered.w);
        count_pixel_rays(at);
    }
}

/// What the first surface reflects and lets through: glossy ones one bounce, mirrors and glass along their chain.
fn reflected(pixel: vec2u, vertex: FirstVertex) -> vec3f {
    next_pair = PAIR_REFLECTION;
    var chain = new_chain(vertex.surface.position, -vertex.surface.wo);
    chain.length = vertex.distance;
    let at_end = !scattering_is_interface(vertex.bsdf);
    if at_end {
        chain.reflects = true;
        chain.surface = vertex.surface;
        chain.bsdf = vertex.bsdf;
    } else {
        depart(&chain, vertex.surface, vertex.bsdf, vertex.u_lobe, draw(vertex.sampler));
    }
    return chain_radiance(chain, select(0u, 1u, at_end), vertex.sampler, pixel, frame.sample);
}

/// For the pixels of the list.
@compute @workgroup_size(REFLECTING_GROUP)
fn reflections(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let index = reflecting_index(group, local);
    if index >= atomicLoad(&reflecting.count) {
        return;
    }
    let at = reflecting.pixels[index];
    let pixel = vec2u(at % view.window_width, at / view.window_width);
    let seen = reflected(pixel, first_vertex(pixel, first_hit(at)));
    let gathered = pixel_radiance(at);
    store_radiance(at, with_reflection(gathered.xyz, gathered.w, seen), gathered.w);
    count_pixel_rays(at);
}
