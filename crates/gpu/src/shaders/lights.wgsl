// Choosing lights, and the density with which a light found by chance would have been chosen.

#import light_choice, light_chooser, material, scene, scene_records, surface, texels, variant
#import optics::constants, optics::equirect, optics::light, optics::light_profile, optics::light_tree
#import optics::material, optics::mis, optics::path, optics::portal, optics::random, optics::shape, optics::sky
#import optics::spherical_triangle, optics::texture_point, optics::warp
#ifdef SCENE_MOVES
#import motion
#endif

/// How light counts that is found in two ways.
const MIS: MisHeuristic = MisHeuristic(MIS_LIGHTS, MIS_BSDFS, MIS_SQUARED);

fn load_light(index: u32) -> Light {
    let record = lights[index];
#ifdef SCENE_MOVES
    return light_now(index, Light(record.kind, record.position, record.edge1, record.edge2, record.emission,
        record.size, (record.flags & LIGHT_TWO_SIDED) != 0u));
#else
    return Light(record.kind, record.position, record.edge1, record.edge2, record.emission, record.size,
        (record.flags & LIGHT_TWO_SIDED) != 0u);
#endif
}

/// Samples a direction towards a light chosen by the irradiance that it can bring; the density includes the choice, 0 if no light
/// can be chosen.
///
/// - `sampling_normal`: normal of the surface on the side that light can reach, by `octahedral_encode`, or ALL_SIDES; or what
///   `light_key` makes of it.
/// - `u`: `u.x` chooses the light, and what is left of it goes with `u.y` into the direction.
fn sample_light(p: vec3f, sampling_normal: u32, u: vec2f) -> LightSample {
    if scene.light_count == 0u {
        return no_light_sample();
    }
    let choice = choose_light(p, sampling_normal, u.x, dither(u.x, u.y));
    if choice.probability <= 0.0 {
        return no_light_sample();
    }
    var light = sample_one_light(choice.index, p, vec2f(choice.remainder, u.y));
    light.pdf *= choice.probability;
    return light;
}

/// Chooses a light; `rest`: another number for the bits that the choice uses up.
fn choose_light(p: vec3f, sampling_normal: u32, u: f32, rest: f32) -> LightChoice {
    if ONE_LIGHT {
        return LightChoice(0u, 1.0, u);
    }
    if !LIGHT_TREE {
        return choose_by_power(u, rest);
    }
    let uniform_share = uniform_light_share();
    var choice = LightChoice(0u, 0.0, u);
    if uniform_share <= 0.0 {
        choice = choose_by_importance(p, sampling_normal, u);
    } else {
        let branch = light_branch(uniform_share, 1.0 - uniform_share, u);
        if branch.second {
            choice = choose_by_importance(p, sampling_normal, branch.remainder);
            if choice.probability > 0.0 {
                choice.probability =
                    light_choice_probability(choice.probability, uniform_share, f32(scene.light_count));
            }
        } else {
            choice.index = uniform_light(branch.remainder, scene.light_count);
            choice.probability = light_probability(choice.index, p, sampling_normal);
            choice.remainder = uniform_remainder(branch.remainder, scene.light_count);
        }
    }
    choice.remainder = refill(choice.remainder, choice.probability, rest);
    return choice;
}

/// Chooses among the lights of the alias table; `rest`: another number for the bits that the choice uses up.
fn choose_by_power(u: f32, rest: f32) -> LightChoice {
    let slot = alias_slot(u, scene.light_count);
    let choice =
        alias_choose_dithered(u, scene.light_count, slot, lights[slot].threshold, lights[slot].alias_index, rest);
    return LightChoice(choice.index, lights[choice.index].probability, choice.remainder);
}

/// Probability with which `choose_light` takes a light.
fn light_probability(index: u32, p: vec3f, sampling_normal: u32) -> f32 {
    if ONE_LIGHT {
        return 1.0;
    }
    if !LIGHT_TREE {
        return lights[index].probability;
    }
    let probability = probability_by_importance(index, p, sampling_normal);
    let uniform_share = uniform_light_share();
    if uniform_share <= 0.0 {
        return probability;
    }
    return light_choice_probability(probability, uniform_share, f32(scene.light_count));
}

/// The kind of a light that is not the environment. Where all are of one kind, the others are left out of the shader.
fn light_kind(index: u32) -> u32 {
    return select(ALL_LIGHTS_ARE, lights[index].kind, ALL_LIGHTS_ARE == NONE);
}

/// Samples a direction towards light `index`.
fn sample_one_light(index: u32, p: vec3f, u: vec2f) -> LightSample {
    if lights[index].kind == LIGHT_ENVIRONMENT {
        return sample_environment(p, u);
    }
    var sampled = load_light(index);
    sampled.kind = light_kind(index);
    var light: LightSample;
    if FLAT_LIGHTS_ARE_FAR && light_is_flat(sampled.kind) {
        light = flat_light_sample_by_area(sampled, p, u);
    } else {
        light = light_sample(sampled, p, u);
    }
    // A disc that is not seen cannot be found by chance: its samples count in full.
    let unseen = sampled.kind == LIGHT_DIRECTIONAL && (lights[index].flags & LIGHT_VISIBLE) == 0u;
    light.delta = light.delta || unseen;
    if SCENE_HAS_PROFILES && (lights[index].flags & LIGHT_PROFILE) != 0u {
        light.radiance *= profile_at(index, -light.wi);
    }
    if LIGHTS_HAVE_TEXTURES && lights[index].textured_material != NONE {
        let emission = textured_emission(index, light_texture_point(index, p, light));
        light.radiance = textured_radiance(sampled, light.distance, emission);
    }
    return light;
}

/// How much of a light's intensity its profile leaves in a unit direction away from it.
fn profile_at(index: u32, direction: vec3f) -> f32 {
    let at = lights[index].texture_places;
    let cell = profile_cell(lights[index].edge1, lights[index].edge2.z, direction, words[at], words[at + 1u]);
    let values = at + 2u;
    return profile_mix(cell, word_f32(values + cell.first), word_f32(values + cell.second),
        word_f32(values + cell.third), word_f32(values + cell.fourth));
}

/// A sampled point of a textured surface. Vertex colours count as ones.
fn light_texture_point(index: u32, p: vec3f, light: LightSample) -> TexturePoint {
    let at = lights[index].texture_places;
    let world = p + light.wi * light.distance;
    if light_kind(index) == LIGHT_SPHERE {
#ifdef SCENE_MOVES
        let outward = world - load_light(index).position;
        let rows = light_to_object_now(index, at);
        let normal = turned_direction(rows[0].xyz, rows[1].xyz, rows[2].xyz, outward);
#else
        let outward = world - lights[index].position;
        let normal = turned_direction(words_vec3(at), words_vec3(at + 4u), words_vec3(at + 8u), outward);
#endif
        var point = texture_point_at(sphere_uv(normal).xyxy, vec4f(1.0));
        if SCENE_HAS_GRAPHS {
            let h = vec4f(world, 1.0);
#ifndef SCENE_MOVES
            let rows = array<vec4f, 3>(words_vec4(at), words_vec4(at + 4u), words_vec4(at + 8u));
#endif
            point.position = vec3f(dot(rows[0], h), dot(rows[1], h), dot(rows[2], h));
            point.world = world;
            point.normal = normal;
        }
        return point;
    }
    let weights = vec3f(1.0 - light.barycentrics.x - light.barycentrics.y, light.barycentrics.x, light.barycentrics.y);
    let uv0 = words_vec2(at) * weights.x + words_vec2(at + 2u) * weights.y + words_vec2(at + 4u) * weights.z;
    let uv1 = words_vec2(at + 6u) * weights.x + words_vec2(at + 8u) * weights.y + words_vec2(at + 10u) * weights.z;
    var point = texture_point_at(vec4f(uv0, uv1), vec4f(1.0));
    if SCENE_HAS_GRAPHS {
        let c0 = words_vec3(at + 12u);
        let d1 = words_vec3(at + 15u) - c0;
        let d2 = words_vec3(at + 18u) - c0;
        point.position = c0 + d1 * weights.y + d2 * weights.z;
        point.world = world;
        point.normal = normalize(cross(d1, d2));
    }
    return point;
}

fn textured_emission(index: u32, point: TexturePoint) -> vec3f {
    let material = lights[index].textured_material;
    let emitted = emission_at(material, point);
    if !material_has_holes(materials[material]) {
        return emitted;
    }
    return emitted * coverage(material, point);
}

/// Density over solid angle, seen from `origin`, with which `sample_light` would have found an emissive surface at distance
/// `distance` in unit direction `wi`; 0 if it is not sampled. `sampling_normal`: as it was given there.
fn surface_light_pdf(s: Surface, origin: vec3f, sampling_normal: u32, wi: vec3f, distance: f32) -> f32 {
    if s.light == NONE {
        return 0.0;
    }
    return surface_direction_pdf(s, origin, wi, distance) * light_probability(s.light, origin, sampling_normal);
}

/// The same once the light, which is not NONE, has been chosen: the density of `sample_one_light`.
fn surface_direction_pdf(s: Surface, origin: vec3f, wi: vec3f, distance: f32) -> f32 {
    let kind = light_kind(s.light);
    var pdf = 0.0;
#ifdef SCENE_MOVES
    let light = load_light(s.light);
    if kind == LIGHT_TRIANGLE {
        pdf = triangle_light_pdf(light.position - origin, light.edge1, light.edge2, wi, distance);
    } else if kind == LIGHT_RECTANGLE {
        pdf = rectangle_light_pdf(light.position - origin, light.edge1, light.edge2, wi, distance);
    } else if kind == LIGHT_SPHERE {
        pdf = sphere_light_side_pdf(light.position, light.size, origin, s.front);
    }
#else
    if FLAT_LIGHTS_ARE_FAR && light_is_flat(kind) {
        pdf = flat_light_pdf_by_area(kind, lights[s.light].edge1, lights[s.light].edge2, wi, distance);
    } else if kind == LIGHT_TRIANGLE {
        let to_first = lights[s.light].position - origin;
        pdf = triangle_light_pdf(to_first, lights[s.light].edge1, lights[s.light].edge2, wi, distance);
    } else if kind == LIGHT_RECTANGLE {
        let to_first = lights[s.light].position - origin;
        pdf = rectangle_light_pdf(to_first, lights[s.light].edge1, lights[s.light].edge2, wi, distance);
    } else if kind == LIGHT_SPHERE {
        pdf = sphere_light_side_pdf(lights[s.light].position, lights[s.light].size, origin, s.front);
    }
#endif
    return pdf;
}

/// Radiance of a pixel of the environment image, and the probability of sampling it.
fn environment_pixel(x: u32, y: u32) -> vec4f {
    return textureLoad(environment_texels, vec2u(x, y), 0);
}

/// Radiance of the environment, without the sun, from unit direction `wi`. Bilinear interpolation of an image wraps around
/// horizontally and stops at the poles.
fn environment_radiance(wi: vec3f) -> vec3f {
    if scene.environment_width == 0u {
        return gradient_sky(wi, scene.horizon, scene.zenith, scene.ground);
    }
    let uv = direction_to_equirect(wi, scene.environment_rotation);
    let at = equirect_place(uv, scene.environment_width, scene.environment_height);
    return equirect_mix(at, environment_pixel(at.left, at.top).rgb, environment_pixel(at.right, at.top).rgb,
        environment_pixel(at.left, at.bottom).rgb, environment_pixel(at.right, at.bottom).rgb);
}

/// Density over solid angle with which the environment image's table chooses `wi`; 0 without an image.
fn environment_image_pdf(wi: vec3f) -> f32 {
    if scene.environment_width == 0u {
        return 0.0;
    }
    let uv = direction_to_equirect(wi, scene.environment_rotation);
    let pixel = equirect_pixel(uv, scene.environment_width, scene.environment_height);
    return equirect_pixel_pdf(environment_pixel(pixel.x, pixel.y).a, environment_pixel_count(), uv.y);
}

fn environment_pixel_count() -> u32 {
    return scene.environment_width * scene.environment_height;
}

/// A unit direction by the environment image's table, first a row, then a pixel of it; and, last, its density over solid angle.
fn sample_environment_image(u: vec2f) -> vec4f {
    let width = scene.environment_width;
    let height = scene.environment_height;
    let row_slot = alias_slot(u.y, height);
    let row_at = scene.row_alias + 2u * row_slot;
    let row = alias_choose_dithered(u.y, height, row_slot, word_f32(row_at), words[row_at + 1u], dither(u.x, u.y));
    let slot = alias_slot(u.x, width);
    let entry = textureLoad(environment_alias, vec2u(slot, row.index), 0).xy;
    let column = alias_choose_dithered(u.x, width, slot, bitcast<f32>(entry.x), entry.y, dither(u.y, u.x));
    let uv = equirect_point(vec2u(column.index, row.index), vec2f(column.remainder, row.remainder), width, height);
    let probability = environment_pixel(column.index, row.index).a;
    let pdf = equirect_pixel_pdf(probability, environment_pixel_count(), uv.y);
    return vec4f(equirect_to_direction(uv, scene.environment_rotation), pdf);
}

/// Half of a portal, as seen from a point.
struct PortalTriangle {
    to_first: vec3f,
    edge1: vec3f,
    edge2: vec3f,
}

fn portal_triangle(index: u32, p: vec3f) -> PortalTriangle {
    let at = scene.first_portal + 9u * index;
    let first = vec3f(word_f32(at), word_f32(at + 1u), word_f32(at + 2u));
    let edge1 = vec3f(word_f32(at + 3u), word_f32(at + 4u), word_f32(at + 5u));
    let edge2 = vec3f(word_f32(at + 6u), word_f32(at + 7u), word_f32(at + 8u));
    return PortalTriangle(first - p, edge1, edge2);
}

/// What is seen of all portals from a point, steradians.
fn portal_solid_angle(p: vec3f) -> f32 {
    var sum = 0.0;
    for (var i = 0u; i < scene.portal_count; i++) {
        let t = portal_triangle(i, p);
        sum += spherical_triangle_new(t.to_first, t.edge1, t.edge2).solid_angle;
    }
    return sum;
}

/// Halves of portals that count from `p`, in unit direction `wi`, one behind the other.
fn portals_passed(p: vec3f, wi: vec3f) -> u32 {
    var count = 0u;
    for (var i = 0u; i < scene.portal_count; i++) {
        let t = portal_triangle(i, p);
        if triangle_is_passed(t.to_first, t.edge1, t.edge2, wi) &&
            spherical_triangle_new(t.to_first, t.edge1, t.edge2).solid_angle > 0.0 {
            count++;
        }
    }
    return count;
}

/// A direction through a portal: a triangle in proportion to its solid angle, then uniform over that. `solid_angle`: of all, positive.
fn sample_portals(p: vec3f, solid_angle: f32, u: vec2f) -> vec3f {
    var left = u.x * solid_angle;
    var chosen: PortalTriangle;
    var seen: SphericalTriangle;
    var rest = 0.0;
    for (var i = 0u; i < scene.portal_count; i++) {
        let t = portal_triangle(i, p);
        let of_this = spherical_triangle_new(t.to_first, t.edge1, t.edge2);
        if of_this.solid_angle <= 0.0 {
            continue;
        }
        chosen = t;
        seen = of_this;
        rest = left;
        if left < of_this.solid_angle {
            break;
        }
        left -= of_this.solid_angle;
    }
    let at = sample_spherical_triangle(seen, vec2f(rest_of_choice(rest, seen.solid_angle), u.y));
    return normalize(chosen.to_first + chosen.edge1 * at.x + chosen.edge2 * at.y);
}

/// Density over solid angle of `wi` by image and portals; `passed`: see `portals_passed`.
fn environment_mixture(wi: vec3f, passed: u32, solid_angle: f32) -> f32 {
    let share = image_share(scene.environment_width > 0u, solid_angle);
    return portal_mixture(share, environment_image_pdf(wi), passed, solid_angle);
}

/// Density over solid angle with which `sample_environment` chooses `wi` at `p`.
fn environment_pdf(p: vec3f, wi: vec3f) -> f32 {
    if SCENE_HAS_PORTALS {
        return environment_mixture(wi, portals_passed(p, wi), portal_solid_angle(p));
    }
    return environment_image_pdf(wi);
}

/// Samples the environment from `p`, by its image or through portals.
fn sample_environment(p: vec3f, u: vec2f) -> LightSample {
    var light = no_light_sample();
    light.distance = FAR;
    light.delta = false;
    if SCENE_HAS_PORTALS {
        let solid_angle = portal_solid_angle(p);
        let share = image_share(scene.environment_width > 0u, solid_angle);
        let branch = light_branch(share, 1.0 - share, u.x);
        let fresh = vec2f(branch.remainder, u.y);
        if branch.second {
            if solid_angle <= 0.0 {
                return light;
            }
            light.wi = sample_portals(p, solid_angle, fresh);
        } else {
            light.wi = sample_environment_image(fresh).xyz;
        }
        // Rounding may put a direction outside of the triangle that it was chosen from.
        let passed = max(portals_passed(p, light.wi), select(0u, 1u, branch.second));
        light.pdf = environment_mixture(light.wi, passed, solid_angle);
    } else {
        let by_image = sample_environment_image(u);
        light.wi = by_image.xyz;
        light.pdf = by_image.w;
    }
    light.radiance = environment_radiance(light.wi);
    return light;
}

/// What chose the lights of a vertex: the point and the normal that `sample_light` was given; and, of whoever chooses several
/// times or also in another way, the number of choices like this and the sum of the other ways' probabilities.
struct LightChooser {
    p: vec3f,
    sampling_normal: u32,
    choices: f32,
    others: f32,
}

/// Adds everything that is infinitely far away in unit direction `wi` to a path that goes there from its last vertex, `origin`.
fn path_add_distant(path: PathState, origin: vec3f, sampling_normal: u32, wi: vec3f) -> PathState {
    return path_add_distant_chosen(path, origin, LightChooser(origin, sampling_normal, 1.0, 0.0), wi);
}

/// The same where `chooser` chose the lights at `origin`.
fn path_add_distant_chosen(path: PathState, origin: vec3f, chooser: LightChooser, wi: vec3f) -> PathState {
    var pdf = 0.0;
    if scene.environment_light != NONE && !path.specular {
        pdf = environment_pdf(origin, wi) * chosen_probability(scene.environment_light, chooser);
    }
    var next = path_add_emission(path, environment_radiance(wi), pdf, MIS);
    for (var i = 0u; i < scene.disc_count; i++) {
        let index = words[scene.first_disc + i];
        let light = load_light(index);
        if directional_light_contains(light, wi) {
            pdf = pdf_cone(light.size) * chosen_probability(index, chooser);
            next = path_add_emission(next, light.emission, pdf, MIS);
        }
    }
    return next;
}

fn chosen_probability(index: u32, chooser: LightChooser) -> f32 {
    return chooser.choices * light_probability(index, chooser.p, chooser.sampling_normal) + chooser.others;
}

/// Whether there is light from infinitely far away in any direction.
fn distant_light_shines() -> bool {
    let gradient = scene.horizon + scene.zenith + scene.ground;
    return scene.environment_width > 0u || scene.disc_count > 0u || any(gradient > vec3f(0.0));
}

/// Radiance of everything infinitely far away in unit direction `wi`.
fn distant_radiance(wi: vec3f) -> vec3f {
    return path_add_distant(path_start(), vec3f(0.0), ALL_SIDES, wi).radiance;
}
