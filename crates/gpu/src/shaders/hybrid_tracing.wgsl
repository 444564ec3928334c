// The passes that trace rays. Each begins at the first hit, which the pass before has found, and adds to the pixel's radiance.
//
// Random numbers are those of the pixel's sample; each effect has numbers of its own, so that what one effect draws does not
// depend on another being on, nor a light's on which lights are culled.

const PAIR_FIRST: u32 = 2u;
const PAIR_AMBIENT: u32 = 0x10000u;
const PAIR_REFLECTION: u32 = 0x20000u;
const PAIR_LIGHTS: u32 = 0x1000000u;

// Whoever finishes the frame notes first hits.
fn camera_missed(pixel: vec2u, sample: u32) {}
fn camera_hit(pixel: vec2u, sample: u32, s: Surface, distance: f32) {}

@group(3) @binding(5) var<storage, read> light_masks: array<u32>;

var<workgroup> group_rays: atomic<u32>;

/// All invocations of a workgroup begin with this and end with `finish`.
fn begin(local: u32) {
    if local == 0u {
        atomicStore(&group_rays, 0u);
    }
    workgroupBarrier();
    rays_traced = 0u;
}

fn finish(local: u32) {
    atomicAdd(&group_rays, rays_traced);
    workgroupBarrier();
    if local == 0u {
        count_rays(atomicLoad(&group_rays));
    }
}

fn is_in_rows(id: vec3u) -> bool {
    return id.x < view.window_width && id.y < view.row_count;
}

fn pixel_of(id: vec3u) -> vec2u {
    return vec2u(id.x, view.first_row + id.y);
}

/// A pixel's first surface, with what every effect needs of it.
struct FirstVertex {
    surface: Surface,
    bsdf: Bsdf,
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
    vertex.footprint = view.pixel_spread * hit.t;
    let u = sample_2d(vertex.sampler, PAIR_FIRST);
    vertex.u_lobe = u.y;
    vertex.bsdf = surface_bsdf(vertex.surface, vertex.footprint, u.x, view.single_scatter != 0u);
    return vertex;
}

/// The first hits by rays, where no rasteriser draws them.
@compute @workgroup_size(8, 8)
fn camera_rays(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    begin(local);
    if is_in_rows(id) {
        let pixel = pixel_of(id);
        let ray = frame_ray(pixel);
        store_first_hit(pixel, ray, closest(ray.origin, ray.direction, pixel_sampler(pixel, frame.sample).scramble));
    }
    finish(local);
}

/// The word of a cluster's mask in which light 32 × `word` has the lowest bit.
fn lights_of_cluster(cluster: u32, word: u32) -> u32 {
    if frame.clustered == 0u {
        return 0xffffffffu;
    }
    return light_masks[cluster * frame.light_words + word];
}

fn cluster_at(pixel: vec2u, position: vec3f) -> u32 {
    let tile = pixel / frame.tile;
    let slice = cluster_slice(dot(position - frame.eye, frame.axis));
    return (slice * frame.clusters.y + tile.y) * frame.clusters.x + tile.x;
}

/// The lights that count at the first hit, with their shadow rays.
fn first_hit_light(pixel: vec2u, vertex: FirstVertex) -> vec3f {
    let frame_there = frame_from_normal(vertex.surface.shading_normal);
    let cluster = cluster_at(pixel, vertex.surface.position);
    var sum = vec3f(0.0);
    for (var word = 0u; word < frame.light_words; word++) {
        var left = lights_of_cluster(cluster, word);
        while left != 0u {
            let index = 32u * word + firstTrailingBit(left);
            left &= left - 1u;
            if index >= scene.light_count {
                break;
            }
            next_pair = PAIR_LIGHTS + index * view.shadow_samples;
            sum += light_with_shadows(index, vertex.surface, frame_there, vertex.bsdf, true, vertex.sampler);
        }
    }
    return sum;
}

/// What the pixel's reflection rays count for, 0 if none are sent. Glossy surfaces play Russian roulette with about what they
/// reflect; mirrors and glass always go on.
fn reflection_weight(vertex: FirstVertex) -> f32 {
    if view.max_depth <= 1u || vertex.bsdf.kind == BSDF_NONE {
        return 0.0;
    }
    if vertex.bsdf.kind != BSDF_GLOSSY {
        return 1.0;
    }
    if vertex.bsdf.specular_probability <= 0.0 || view.reflection_samples == 0u {
        return 0.0;
    }
    let cos_o = dot(vertex.surface.wo, vertex.surface.shading_normal);
    let reflected = max_component(glossy_reflectance(vertex.bsdf, cos_o));
    let survival = clamp(reflected, view.reflection_survival, 1.0);
    return select(0.0, 1.0 / survival, vertex.u_lobe < survival);
}

/// What the first surface emits, what lies behind everything, and direct light.
@compute @workgroup_size(8, 8)
fn direct_lights(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    begin(local);
    if is_in_rows(id) {
        let pixel = pixel_of(id);
        let at = pixel_number(pixel);
        let hit = first_hit(at);
        if hit.instance == NONE {
            pixels[at].radiance = distant_radiance(frame_ray(pixel).direction);
        } else {
            let vertex = first_vertex(pixel, hit);
            var radiance = surface_emission(vertex.surface, vertex.footprint);
            if bsdf_has_smooth_part(vertex.bsdf) {
                radiance += first_hit_light(pixel, vertex);
            }
            pixels[at].radiance = radiance;
            pixels[at].reflection_weight = reflection_weight(vertex);
        }
    }
    finish(local);
}

fn environment_is_black() -> bool {
    return scene.environment_width == 0u && all(scene.horizon + scene.zenith + scene.ground == vec3f(0.0));
}

/// The environment's light on the first surface, with occlusion. Lists what the next pass works on, because this one has the room.
@compute @workgroup_size(8, 8)
fn ambient_occlusion(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    begin(local);
    if is_in_rows(id) {
        let pixel = pixel_of(id);
        let at = pixel_number(pixel);
        if pixels[at].reflection_weight > 0.0 {
            list_reflecting(at);
        }
        let hit = first_hit(at);
        if hit.instance != NONE && !environment_is_black() {
            let vertex = first_vertex(pixel, hit);
            if vertex.bsdf.kind == BSDF_GLOSSY {
                next_pair = PAIR_AMBIENT;
                pixels[at].radiance += ambient_light(vertex.surface, vertex.bsdf, true, vertex.sampler);
            }
        }
    }
    finish(local);
}

/// What the first surface reflects and lets through: glossy ones one bounce, mirrors and glass along their chain.
fn reflected(pixel: vec2u, vertex: FirstVertex) -> vec3f {
    next_pair = PAIR_REFLECTION;
    var chain = new_chain(vertex.surface.position, -vertex.surface.wo);
    chain.length = vertex.distance;
    if vertex.bsdf.kind == BSDF_GLOSSY {
        chain.reflects = true;
        chain.surface = vertex.surface;
        chain.bsdf = vertex.bsdf;
        return chain_radiance(chain, 1u, vertex.sampler, pixel, frame.sample);
    }
    if !go_on(&chain, vertex.surface, vertex.bsdf, vertex.u_lobe, vertex.sampler) {
        return vec3f(0.0);
    }
    return chain_radiance(chain, 0u, vertex.sampler, pixel, frame.sample);
}

/// For the pixels of the list.
@compute @workgroup_size(REFLECTING_GROUP)
fn reflections(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    begin(local);
    let index = reflecting_index(group, local);
    if index < atomicLoad(&reflecting.count) {
        let at = reflecting.pixels[index];
        let pixel = vec2u(at % view.window_width, at / view.window_width);
        let seen = reflected(pixel, first_vertex(pixel, first_hit(at)));
        pixels[at].radiance += pixels[at].reflection_weight * seen;
    }
    finish(local);
}
