//! Light samples of many plain vertices at once: see `lanes`.

use crate::lanes::{LANES, Lanes, Pairs, Vectors, Vertices};
use crate::lights::choose_by_place;
use optics::light::{
    LIGHT_RECTANGLE, LIGHT_TRIANGLE, Light, LightSample, RECTANGLE_CENTER, TRIANGLE_CENTER,
    flat_light_is_near, flat_light_sample_by_area, light_sample, rectangle_light_sample,
    triangle_light_sample,
};
use optics::light_tree::{octahedral_decode, octahedral_encode};
use optics::offset::offset_ray_origin;
use optics::path::path_light_contribution;
use optics::random::dither;
use optics::scatter::BsdfValue;
use optics::vector::dot;
use optics::warp::{alias_choose_dithered, alias_slot, pdf_cosine_hemisphere};
use optics::{Vec2f, Vec3f, vec2f};
use scene::tables::{LightChoice, SceneTables};

/// Light samples of diffuse vertices.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LightLanes {
    /// Unit direction towards the light.
    pub wi: Vectors,
    /// Distance to the light.
    pub distance: Lanes<f32>,
    /// Contribution to the pixel if nothing is in the way; zero where there is nothing to ask for.
    pub contribution: Vectors,
    /// Where the shadow ray starts.
    pub origin: Vectors,
}

/// The light that each lane has chosen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ChoiceLanes {
    index: Lanes<u32>,
    /// Probability of the choice; 0: there is no light to sample.
    probability: Lanes<f32>,
    /// A fresh number in `[0, 1)`.
    remainder: Lanes<f32>,
}

/// Chooses lights by power for all lanes.
#[inline(always)]
pub(crate) fn choose_lights_by_power(tables: &SceneTables, u: &Pairs, out: &mut ChoiceLanes) {
    let alias = &tables.light_alias[..];
    let count = alias.len() as u32;
    let (mut slot, mut other) = (Lanes::<u32>::default(), Lanes::<u32>::default());
    let mut threshold = Lanes::<f32>::default();
    for lane in 0..LANES {
        slot.0[lane] = alias_slot(u.x.0[lane], count);
    }
    for lane in 0..LANES {
        let entry = &alias[slot.0[lane] as usize];
        threshold.0[lane] = entry.threshold;
        other.0[lane] = entry.alias;
    }
    for lane in 0..LANES {
        let [x, rest] = [u.x.0[lane], dither(u.x.0[lane], u.y.0[lane])];
        let choice = alias_choose_dithered(x, count, slot.0[lane], threshold.0[lane], other.0[lane], rest);
        out.index.0[lane] = choice.index;
        out.remainder.0[lane] = choice.remainder;
    }
    for lane in 0..LANES {
        out.probability.0[lane] = alias[out.index.0[lane] as usize].probability;
    }
}

/// Chooses lights by where the first `waiting` vertices are. Each walks down the tree of lights on a way of its own.
#[inline(always)]
pub(crate) fn choose_lights_by_place(
    tables: &SceneTables,
    v: &mut Vertices,
    waiting: usize,
    u: &Pairs,
    out: &mut ChoiceLanes,
) {
    // The normal as light that is met by chance will know it.
    let mut normal = Vectors::default();
    for lane in 0..LANES {
        v.receiver.0[lane] = octahedral_encode(v.shading_normal.get(lane));
        normal.set(lane, octahedral_decode(v.receiver.0[lane]));
    }
    for lane in 0..waiting {
        let choice = choose_by_place(tables, v.position.get(lane), normal.get(lane), u.get(lane));
        let choice = choice.unwrap_or(LightChoice { index: 0, probability: 0.0, remainder: 0.0 });
        out.index.0[lane] = choice.index;
        out.probability.0[lane] = choice.probability;
        out.remainder.0[lane] = choice.remainder;
    }
}

/// So many near lights among those of all lanes are sampled one by one.
const FEW_NEAR: u32 = 4;

/// Lights that are triangles or rectangles of one radiance.
#[derive(Clone, Copy, Debug, Default)]
struct FlatLanes {
    kind: Lanes<u32>,
    position: Vectors,
    edge1: Vectors,
    edge2: Vectors,
    emission: Vectors,
    two_sided: Lanes<u32>,
}

impl FlatLanes {
    #[inline(always)]
    fn load(&mut self, tables: &SceneTables, chosen: &ChoiceLanes) {
        for lane in 0..LANES {
            let light = &tables.lights[chosen.index.0[lane] as usize].light;
            self.kind.0[lane] = light.kind;
            self.position.set(lane, light.position);
            self.edge1.set(lane, light.edge1);
            self.edge2.set(lane, light.edge2);
            self.emission.set(lane, light.emission);
            self.two_sided.0[lane] = u32::from(light.two_sided);
        }
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Light {
        Light {
            kind: self.kind.0[lane],
            position: self.position.get(lane),
            edge1: self.edge1.get(lane),
            edge2: self.edge2.get(lane),
            emission: self.emission.get(lane),
            size: 0.0,
            two_sided: self.two_sided.0[lane] != 0,
        }
    }

    /// Which lanes have a light that is near, 0 or 1.
    #[inline(always)]
    fn near(&self, v: &Vertices) -> Lanes<u32> {
        let mut near = Lanes::<u32>::default();
        for lane in 0..LANES {
            let light = self.get(lane);
            let to_first = light.position - v.position.get(lane);
            let center = if light.kind == LIGHT_RECTANGLE { RECTANGLE_CENTER } else { TRIANGLE_CENTER };
            near.0[lane] = u32::from(flat_light_is_near(to_first, light.edge1, light.edge2, center));
        }
        near
    }
}

/// Samples the light that each lane has chosen. The tables hold nothing but triangles and rectangles without textures.
#[inline(always)]
pub(crate) fn sample_flat_lights(
    tables: &SceneTables,
    v: &Vertices,
    chosen: &ChoiceLanes,
    u: &Pairs,
    out: &mut LightLanes,
) {
    let mut lights = FlatLanes::default();
    lights.load(tables, chosen);
    let near = lights.near(v);
    let rectangles = lights.kind.0.iter().filter(|kind| **kind == LIGHT_RECTANGLE).count();
    // Vector instructions do for all lanes what one of them needs, and a solid angle costs as much as all the rest: few near lanes,
    // and near lanes with lights of both kinds, are quicker one by one.
    let many = near.0.iter().sum::<u32>() > FEW_NEAR;
    // With the kind known the lanes have no branches.
    if many && rectangles == 0 {
        let sample = |light, p, u| triangle_light_sample(Light { kind: LIGHT_TRIANGLE, ..light }, p, u);
        for lane in 0..LANES {
            connect_light(v, &lights, chosen, u, lane, sample, out);
        }
        return;
    }
    if many && rectangles == LANES {
        let sample = |light, p, u| rectangle_light_sample(Light { kind: LIGHT_RECTANGLE, ..light }, p, u);
        for lane in 0..LANES {
            connect_light(v, &lights, chosen, u, lane, sample, out);
        }
        return;
    }
    for lane in 0..LANES {
        connect_light(v, &lights, chosen, u, lane, flat_light_sample_by_area, out);
    }
    for lane in (0..LANES).filter(|&lane| near.0[lane] != 0) {
        connect_light(v, &lights, chosen, u, lane, light_sample, out);
    }
}

/// What a lane's light brings it by what `sample` chooses of the light.
#[inline(always)]
fn connect_light(
    v: &Vertices,
    lights: &FlatLanes,
    chosen: &ChoiceLanes,
    u: &Pairs,
    lane: usize,
    sample: impl Fn(Light, Vec3f, Vec2f) -> LightSample,
    out: &mut LightLanes,
) {
    let position = v.position.get(lane);
    let sample = sample(lights.get(lane), position, vec2f(chosen.remainder.0[lane], u.y.0[lane]));
    let cos_shading = dot(sample.wi, v.shading_normal.get(lane));
    let above = dot(sample.wi, v.normal.get(lane)) > 0.0 && cos_shading > 0.0;
    let pdf = pdf_cosine_hemisphere(cos_shading);
    let value = BsdfValue { value_cos: v.color.get(lane) * pdf, pdf };
    let light_pdf = if above { sample.pdf * chosen.probability.0[lane] } else { 0.0 };
    let contribution =
        path_light_contribution(v.throughput.get(lane), value, sample.radiance, light_pdf, false);
    out.wi.set(lane, sample.wi);
    let origin = offset_ray_origin(position, v.normal.get(lane), v.extent.0[lane]);
    // The offset goes a part of the way: a ray of the whole length would end beyond a near light.
    out.distance.0[lane] = sample.distance - dot(origin - position, sample.wi);
    out.contribution.set(lane, contribution);
    out.origin.set(lane, origin);
}
