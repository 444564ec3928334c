//! Choosing lights, and the density with which a light found by chance would have been chosen.

use crate::fetch::surface::Surface;
use crate::scene::CpuScene;
use crate::shade::material::{coverage, emission_at};
use optics::constants::FAR;
use optics::light::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_RECTANGLE, LIGHT_SPHERE, LIGHT_TRIANGLE, LightSample,
    directional_light_contains, light_sample, no_light_sample, rectangle_light_pdf, sphere_light_side_pdf,
    textured_radiance, triangle_light_pdf,
};
use optics::light_profile::{profile_cell, profile_mix};
use optics::light_tree::{ALL_SIDES, octahedral_decode};
use optics::random::dither;
use optics::shape::{sphere_uv, turned_direction};
use optics::texture_point::{TexturePoint, texture_point_at};
use optics::vector::{cross, dot, normalize};
use optics::warp::{alias_choose_dithered, alias_slot, pdf_cone};
use optics::{Vec2f, Vec3f, vec2f, vec3f, vec4f};
use scene::tables::{LightChoice, LightRecord, NONE, SceneTables};

/// Samples a direction towards a light chosen by the irradiance that it can bring; the density includes the choice. `None` if no
/// light can be chosen.
///
/// - `sampling_normal`: normal of the surface on the side that light can reach, by `octahedral_encode`, or `ALL_SIDES`.
/// - `u`: `u.x` chooses the light, and what is left of it goes with `u.y` into the direction.
/// - `time`: of the path, see [`SceneTables::light_at`].
#[inline(always)]
pub(crate) fn sample_light(
    scene: &CpuScene,
    p: Vec3f,
    sampling_normal: u32,
    u: Vec2f,
    time: f32,
) -> Option<LightSample> {
    let choice = choose_light(&scene.tables, p, octahedral_decode(sampling_normal), u)?;
    let mut sample = sample_one_light(scene, choice.index, p, [choice.remainder, u.y], time);
    sample.pdf *= choice.probability;
    Some(sample)
}

/// Chooses a light. `normal`: unit normal on the side that light can reach, or zero.
#[inline(always)]
pub(crate) fn choose_light(tables: &SceneTables, p: Vec3f, normal: Vec3f, u: Vec2f) -> Option<LightChoice> {
    let rest = dither(u.x, u.y);
    if tables.light_tree.is_empty() {
        return choose_by_power(tables, u.x, rest);
    }
    tables.light_tree.choose(p, normal, u.x, rest)
}

/// Chooses among the lights of the alias table; `rest`: another number for the bits that the choice uses up.
#[inline(always)]
fn choose_by_power(tables: &SceneTables, u: f32, rest: f32) -> Option<LightChoice> {
    let alias = &tables.light_alias;
    match alias[..] {
        [] => return None,
        // No bit of the number is used up.
        [only] => return Some(LightChoice { index: 0, probability: only.probability, remainder: u }),
        _ => {}
    }
    let count = alias.len() as u32;
    let slot = alias_slot(u, count);
    let entry = alias[slot as usize];
    let choice = alias_choose_dithered(u, count, slot, entry.threshold, entry.alias, rest);
    let probability = alias[choice.index as usize].probability;
    Some(LightChoice { index: choice.index, probability, remainder: choice.remainder })
}

/// Probability with which [`choose_light`] takes light `index`. `sampling_normal`: as it was given to [`sample_light`].
#[inline(always)]
fn light_probability(tables: &SceneTables, index: u32, p: Vec3f, sampling_normal: u32) -> f32 {
    if tables.light_tree.is_empty() {
        return tables.light_alias[index as usize].probability;
    }
    tables.light_tree.probability_of(index, p, octahedral_decode(sampling_normal))
}

/// Samples a direction towards light `index`.
#[inline(always)]
pub(crate) fn sample_one_light(
    scene: &CpuScene,
    index: u32,
    p: Vec3f,
    u: [f32; 2],
    time: f32,
) -> LightSample {
    if scene.tables.motion.is_some() {
        return sample_record(scene, &scene.tables.light_record_at(index, time), p, u);
    }
    sample_record(scene, &scene.tables.lights[index as usize], p, u)
}

/// Samples a direction towards the light of a record.
#[inline(always)]
fn sample_record(scene: &CpuScene, record: &LightRecord, p: Vec3f, u: [f32; 2]) -> LightSample {
    if record.light.kind == LIGHT_ENVIRONMENT {
        return sample_environment(scene, p, u);
    }
    let mut sample = light_sample(record.light, p, vec2f(u[0], u[1]));
    // A disc that is not seen cannot be found by chance: its samples count in full.
    sample.delta |= record.light.kind == LIGHT_DIRECTIONAL && !record.visible;
    if record.profile != NONE {
        sample.radiance *= profile_at(&scene.tables, record, -sample.wi);
    }
    if record.textured_material != NONE {
        let emission = textured_emission(scene, record, &light_texture_point(record, p, &sample));
        sample.radiance = textured_radiance(record.light, sample.distance, emission);
    }
    sample
}

/// How much of a light's intensity its profile leaves in a unit direction away from it.
fn profile_at(tables: &SceneTables, record: &LightRecord, direction: Vec3f) -> f32 {
    let table = &tables.profiles[record.profile as usize..];
    let (axis, zero) = (record.light.edge1, record.light.edge2.z);
    let cell = profile_cell(axis, zero, direction, table[0], table[1]);
    let value = |i: u32| f32::from_bits(table[2 + i as usize]);
    profile_mix(cell, value(cell.first), value(cell.second), value(cell.third), value(cell.fourth))
}

fn sample_environment(scene: &CpuScene, p: Vec3f, u: [f32; 2]) -> LightSample {
    let environment = &scene.tables.environment;
    let (wi, pdf) = environment.sample(p, u);
    let barycentrics = vec2f(0.0, 0.0);
    LightSample { wi, distance: FAR, radiance: environment.radiance(wi), pdf, delta: false, barycentrics }
}

/// A sampled point of a textured surface. Vertex colours count as ones.
fn light_texture_point(record: &LightRecord, p: Vec3f, sample: &LightSample) -> TexturePoint {
    let places = &record.texture_places;
    let ones = vec4f(1.0, 1.0, 1.0, 1.0);
    let world = p + sample.wi * sample.distance;
    if record.light.kind == LIGHT_SPHERE {
        let row = |i: usize| vec3f(places[4 * i], places[4 * i + 1], places[4 * i + 2]);
        let rows = [row(0), row(1), row(2)];
        let normal = turned_direction(rows[0], rows[1], rows[2], world - record.light.position);
        let uv = sphere_uv(normal);
        let along = |i: usize| dot(rows[i], world) + places[4 * i + 3];
        let position = vec3f(along(0), along(1), along(2));
        let point = texture_point_at(vec4f(uv.x, uv.y, uv.x, uv.y), ones);
        return TexturePoint { position, world, normal, ..point };
    }
    let [b1, b2] = [sample.barycentrics.x, sample.barycentrics.y];
    // Of each set the pairs of three vertices, then their positions.
    let at = |i: usize| places[i] * (1.0 - b1 - b2) + places[i + 2] * b1 + places[i + 4] * b2;
    let corner = |i: usize| vec3f(places[12 + 3 * i], places[13 + 3 * i], places[14 + 3 * i]);
    let [c0, c1, c2] = [corner(0), corner(1), corner(2)];
    let position = c0 * (1.0 - b1 - b2) + c1 * b1 + c2 * b2;
    let normal = normalize(cross(c1 - c0, c2 - c0));
    let point = texture_point_at(vec4f(at(0), at(1), at(6), at(7)), ones);
    TexturePoint { position, world, normal, ..point }
}

fn textured_emission(scene: &CpuScene, record: &LightRecord, point: &TexturePoint) -> Vec3f {
    let material = &scene.tables.materials[record.textured_material as usize];
    let emitted = emission_at(&scene.tables, material, point);
    if material.has_holes() { emitted * coverage(&scene.tables, material, point) } else { emitted }
}

/// Radiant intensity of a light at one point in a unit direction away from it, W/sr.
pub(crate) fn point_intensity(scene: &CpuScene, record: &LightRecord, direction: Vec3f) -> Vec3f {
    let sample = sample_record(scene, record, record.light.position + direction, [0.5, 0.5]);
    sample.radiance * (if sample.pdf > 0.0 { sample.distance * sample.distance } else { 0.0 })
}

/// Radiance of a light's surface at its point `from`. `place`: of a flat one, where on its edges that is.
pub(crate) fn surface_emission(scene: &CpuScene, record: &LightRecord, from: Vec3f, place: Vec2f) -> Vec3f {
    if record.textured_material == NONE {
        return record.light.emission;
    }
    let at = LightSample { barycentrics: place, ..no_light_sample() };
    textured_emission(scene, record, &light_texture_point(record, from, &at))
}

/// Density over solid angle, seen from `from`, with which [`sample_light`] would have found an emissive surface at
/// distance `distance` in unit direction `wi`; 0 if it is not sampled. `sampling_normal`: as it was given there.
#[inline]
pub(crate) fn surface_light_pdf(
    scene: &CpuScene,
    s: &Surface,
    from: Vec3f,
    sampling_normal: u32,
    wi: Vec3f,
    distance: f32,
    time: f32,
) -> f32 {
    if s.light == NONE {
        return 0.0;
    }
    let light = scene.tables.light_at(s.light, time);
    let pdf = match light.kind {
        LIGHT_TRIANGLE => triangle_light_pdf(light.position - from, light.edge1, light.edge2, wi, distance),
        LIGHT_RECTANGLE => rectangle_light_pdf(light.position - from, light.edge1, light.edge2, wi, distance),
        LIGHT_SPHERE => sphere_light_side_pdf(light.position, light.size, from, s.front),
        _ => 0.0,
    };
    pdf * light_probability(&scene.tables, s.light, from, sampling_normal)
}

/// Everything infinitely far away in a direction: radiance and the density of having sampled it.
pub(crate) struct Distant {
    pub radiance: Vec3f,
    pub pdf: f32,
    /// Index of the light, or `NONE` of what is not sampled.
    pub light: u32,
}

/// Calls `found` with each source that is seen infinitely far away from `from` in unit direction `wi`. `sampling_normal`: as it was given to
/// [`sample_light`].
pub(crate) fn for_each_distant(
    scene: &CpuScene,
    from: Vec3f,
    sampling_normal: u32,
    wi: Vec3f,
    time: f32,
    mut found: impl FnMut(Distant),
) {
    let tables = &*scene.tables;
    let environment = &tables.environment;
    let mut pdf = 0.0;
    if environment.light != NONE {
        pdf = environment.pdf(from, wi) * light_probability(tables, environment.light, from, sampling_normal);
    }
    found(Distant { radiance: environment.radiance(wi), pdf, light: environment.light });
    for &index in &scene.visible_discs {
        let light = tables.light_at(index, time);
        if directional_light_contains(light, wi) {
            let pdf = pdf_cone(light.size) * light_probability(tables, index, from, sampling_normal);
            found(Distant { radiance: light.emission, pdf, light: index });
        }
    }
}

/// Radiance of everything infinitely far away in a direction.
pub(crate) fn distant_radiance(scene: &CpuScene, wi: Vec3f, time: f32) -> Vec3f {
    let mut sum = vec3f(0.0, 0.0, 0.0);
    // What is seen of portals from anywhere says something of densities only.
    for_each_distant(scene, vec3f(0.0, 0.0, 0.0), ALL_SIDES, wi, time, |d| sum += d.radiance);
    sum
}
