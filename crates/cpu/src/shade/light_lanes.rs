//! Light samples of many plain vertices at once: see `lanes`.

use crate::batch::departures::{ConnectionLanes, LightLanes};
use crate::batch::lanes::{ALL_LANES, LANES, Lanes, Pairs, Vectors};
use crate::batch::vertices::Vertices;
use crate::scene::CpuScene;
use crate::shade::lights::{choose_light, sample_one_light};
use crate::shade::scatter_lanes::Lobes;
use crate::simd::Instructions;
use optics::light::{
    LIGHT_RECTANGLE, LIGHT_TRIANGLE, Light, LightSample, RECTANGLE_CENTER, TRIANGLE_CENTER,
    flat_light_is_near, flat_light_sample_by_area, light_sample, light_way, rectangle_light_sample,
    triangle_light_sample,
};
use optics::light_tree::{
    ChildChoice, LIGHT_NODE_WIDTH, NodeImportance, child_choice_add, child_remainder, child_weight,
    light_importance, light_share, node_importance_add, node_weight, octahedral_decode, octahedral_encode,
    refill,
};
use optics::mis::MisHeuristic;
use optics::path::path_light_contribution;
use optics::random::dither;
use optics::vector::dot;
use optics::warp::{alias_choose_dithered, alias_slot};
use optics::{Vec2f, Vec3f, vec2f};
use scene::tables::{LightChoice, LightNode, SceneTables};

impl LightLanes {
    #[inline(always)]
    fn set(&mut self, lane: usize, sample: &LightSample, probability: f32) {
        self.wi.set(lane, sample.wi);
        self.distance.0[lane] = sample.distance;
        self.radiance.set(lane, sample.radiance);
        self.pdf.0[lane] = sample.pdf * probability;
        self.delta.0[lane] = u32::from(sample.delta);
    }
}

impl ConnectionLanes {
    /// Connects every vertex with its light sample. `origin`: where rays start that leave on the side of the viewer.
    #[inline(always)]
    pub fn compute(
        &mut self,
        v: &Vertices,
        origin: &Vectors,
        lights: &LightLanes,
        lobes: &impl Lobes,
        mis: MisHeuristic,
    ) {
        for lane in 0..LANES {
            let (normal, wi) = (v.normal.get(lane), lights.wi.get(lane));
            let above = dot(wi, normal) > 0.0 && dot(wi, v.shading_normal.get(lane)) > 0.0;
            let value = lobes.eval(v, lane, wi);
            let pdf = if above { lights.pdf.0[lane] } else { 0.0 };
            let (radiance, delta) = (lights.radiance.get(lane), lights.delta.0[lane] != 0);
            let throughput = v.throughput.get(lane);
            let contribution = path_light_contribution(throughput, value, radiance, pdf, delta, mis);
            let origin = origin.get(lane);
            let way = light_way(wi, lights.distance.0[lane], origin - v.position.get(lane));
            self.direction.set(lane, way.direction);
            self.distance.0[lane] = way.distance;
            self.contribution.set(lane, contribution);
            self.origin.set(lane, origin);
        }
    }
}

/// Samples lights for the first `waiting` vertices. `times`: of their paths.
#[inline(always)]
pub(crate) fn sample_lights<I: Instructions>(
    i: I,
    scene: &CpuScene,
    v: &mut Vertices,
    waiting: usize,
    u: &Pairs,
    times: impl Fn(usize) -> f32,
    out: &mut LightLanes,
) {
    let tables = &*scene.tables;
    let by_place = !tables.light_tree.is_empty();
    if by_place {
        // As light that is met by chance will know the normal.
        for lane in 0..LANES {
            v.sampling_normal.0[lane] = octahedral_encode(v.shading_normal.get(lane));
        }
    }
    let mut choices = ChoiceLanes::default();
    if let Some((list, count)) = tables.light_tree.list() {
        choose_lights_of_list(list, count, v, u, &mut choices);
    } else if by_place {
        choose_lights_of_tree(tables, v, waiting, u, &mut choices);
    } else {
        choose_lights_by_power(tables, u, &mut choices);
    }
    if scene.plain_lights {
        sample_flat_lights(i, tables, v, &choices, u, out);
    } else {
        sample_any_lights(scene, v, waiting, &choices, u, times, out);
    }
}

/// Samples the lights that the first `waiting` vertices have chosen, one by one.
#[inline(always)]
fn sample_any_lights(
    scene: &CpuScene,
    v: &Vertices,
    waiting: usize,
    chosen: &ChoiceLanes,
    u: &Pairs,
    times: impl Fn(usize) -> f32,
    out: &mut LightLanes,
) {
    out.pdf = Lanes::default();
    for lane in 0..waiting {
        let probability = chosen.probability.0[lane];
        if probability > 0.0 {
            let u = [chosen.remainder.0[lane], u.y.0[lane]];
            let sample = sample_one_light(scene, chosen.index.0[lane], v.position.get(lane), u, times(lane));
            out.set(lane, &sample, probability);
        }
    }
}

/// The light that each lane has chosen.
#[derive(Clone, Copy, Debug, Default)]
struct ChoiceLanes {
    index: Lanes<u32>,
    /// Probability of the choice; 0: there is no light to sample.
    probability: Lanes<f32>,
    /// A fresh number in `[0, 1)`.
    remainder: Lanes<f32>,
}

/// Chooses lights by power for all lanes.
#[inline(always)]
fn choose_lights_by_power(tables: &SceneTables, u: &Pairs, out: &mut ChoiceLanes) {
    let alias = &tables.light_alias[..];
    if let [only] = alias {
        // Nothing has to be gathered, and no bit of the numbers is used up.
        out.remainder = u.x;
        out.probability.0.fill(only.probability);
        return;
    }
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

/// Chooses lights of a list of `count` for all lanes: the same as [`LightTree::choose`](scene::tables::LightTree::choose), a light
/// after the other instead of a vertex after the other.
#[inline(always)]
fn choose_lights_of_list(list: &LightNode, count: usize, v: &Vertices, u: &Pairs, out: &mut ChoiceLanes) {
    let mut normal = Vectors::<LANES>::default();
    for lane in 0..LANES {
        normal.set(lane, octahedral_decode(v.sampling_normal.0[lane]));
    }
    let mut importances = [Lanes::<f32>::default(); LIGHT_NODE_WIDTH as usize];
    let (mut sum, mut lights) = (Lanes::<f32>::default(), Lanes::<f32>::default());
    for (child, importances) in importances.iter_mut().enumerate().take(count) {
        let group = list.group(child);
        for lane in 0..LANES {
            let importance = light_importance(group, v.position.get(lane), normal.get(lane));
            let before = NodeImportance { sum: sum.0[lane], count: lights.0[lane] };
            let together = node_importance_add(before, importance);
            importances.0[lane] = importance;
            (sum.0[lane], lights.0[lane]) = (together.sum, together.count);
        }
    }
    // Which one each lane has chosen so far, its weight, and where it begins.
    let (mut chosen, mut end) = (Lanes::<u32>::default(), Lanes::<f32>::default());
    let (mut weight, mut before) = (Lanes::<f32>::default(), Lanes::<f32>::default());
    for (child, importances) in (0..).zip(&importances).take(count) {
        for lane in 0..LANES {
            let together = NodeImportance { sum: sum.0[lane], count: lights.0[lane] };
            let at = u.x.0[lane] * node_weight(together, true);
            let choice = ChildChoice {
                child: chosen.0[lane],
                weight: weight.0[lane],
                before: before.0[lane],
                end: end.0[lane],
            };
            let choice =
                child_choice_add(choice, child, child_weight(importances.0[lane], together, true), at);
            (chosen.0[lane], weight.0[lane]) = (choice.child, choice.weight);
            (before.0[lane], end.0[lane]) = (choice.before, choice.end);
        }
    }
    for lane in 0..LANES {
        let sum = node_weight(NodeImportance { sum: sum.0[lane], count: lights.0[lane] }, true);
        let [x, rest] = [u.x.0[lane], dither(u.x.0[lane], u.y.0[lane])];
        let choice = ChildChoice {
            child: chosen.0[lane],
            weight: weight.0[lane],
            before: before.0[lane],
            end: end.0[lane],
        };
        let probability = light_share(choice.weight, sum);
        out.probability.0[lane] = probability;
        out.remainder.0[lane] = refill(child_remainder(choice, x * sum), probability, rest);
    }
    for lane in 0..LANES {
        out.index.0[lane] = list.light(chosen.0[lane]);
    }
}

/// Chooses lights for the first `waiting` vertices. Each walks down the tree of lights on a way of its own.
#[inline(always)]
fn choose_lights_of_tree(
    tables: &SceneTables,
    v: &Vertices,
    waiting: usize,
    u: &Pairs,
    out: &mut ChoiceLanes,
) {
    let mut normal = Vectors::<LANES>::default();
    for lane in 0..LANES {
        normal.set(lane, octahedral_decode(v.sampling_normal.0[lane]));
    }
    for lane in 0..waiting {
        let choice = choose_light(tables, v.position.get(lane), normal.get(lane), u.get(lane));
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
        if let [only] = &tables.lights[..] {
            for lane in 0..LANES {
                self.set(lane, &only.light);
            }
            return;
        }
        for lane in 0..LANES {
            self.set(lane, &tables.lights[chosen.index.0[lane] as usize].light);
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, light: &Light) {
        self.kind.0[lane] = light.kind;
        self.position.set(lane, light.position);
        self.edge1.set(lane, light.edge1);
        self.edge2.set(lane, light.edge2);
        self.emission.set(lane, light.emission);
        self.two_sided.0[lane] = u32::from(light.two_sided);
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

/// A way to sample a flat light, seen from `p`. A type, not a closure: those are compiled without the kernel's instructions.
trait FlatSampling {
    fn sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample;
}

/// All are triangles, and some are near.
struct Triangles;

/// All are rectangles, and some are near.
struct Rectangles;

/// Triangles or rectangles, none of which is near.
struct ByArea;

impl FlatSampling for Triangles {
    #[inline(always)]
    fn sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        triangle_light_sample(Light { kind: LIGHT_TRIANGLE, ..light }, p, u)
    }
}

impl FlatSampling for Rectangles {
    #[inline(always)]
    fn sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        rectangle_light_sample(Light { kind: LIGHT_RECTANGLE, ..light }, p, u)
    }
}

impl FlatSampling for ByArea {
    #[inline(always)]
    fn sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        flat_light_sample_by_area(light, p, u)
    }
}

/// Samples the light that each lane has chosen. The tables hold nothing but triangles and rectangles without textures.
#[inline(always)]
fn sample_flat_lights<I: Instructions>(
    i: I,
    tables: &SceneTables,
    v: &Vertices,
    chosen: &ChoiceLanes,
    u: &Pairs,
    out: &mut LightLanes,
) {
    let mut lights = FlatLanes::default();
    lights.load(tables, chosen);
    let near = lights.near(v);
    let rectangles = i.equal(&lights.kind.0, LIGHT_RECTANGLE);
    // Vector instructions do for all lanes what one of them needs, and a solid angle costs as much as all the rest: few near lanes,
    // and near lanes with lights of both kinds, are quicker one by one.
    let mut near = i.equal(&near.0, 1);
    let many = near.count_ones() > FEW_NEAR;
    // With the kind known the lanes have no branches.
    if many && rectangles == 0 {
        return sample_all::<Triangles>(v, &lights, chosen, u, out);
    }
    if many && rectangles == ALL_LANES {
        return sample_all::<Rectangles>(v, &lights, chosen, u, out);
    }
    sample_all::<ByArea>(v, &lights, chosen, u, out);
    while near != 0 {
        let lane = near.trailing_zeros() as usize % LANES;
        near &= near - 1;
        let u = vec2f(chosen.remainder.0[lane], u.y.0[lane]);
        let sample = light_sample(lights.get(lane), v.position.get(lane), u);
        out.set(lane, &sample, chosen.probability.0[lane]);
    }
}

#[inline(always)]
fn sample_all<S: FlatSampling>(
    v: &Vertices,
    lights: &FlatLanes,
    chosen: &ChoiceLanes,
    u: &Pairs,
    out: &mut LightLanes,
) {
    for lane in 0..LANES {
        let u = vec2f(chosen.remainder.0[lane], u.y.0[lane]);
        let sample = S::sample(lights.get(lane), v.position.get(lane), u);
        out.set(lane, &sample, chosen.probability.0[lane]);
    }
}
