//! A tree over the lights, for choosing one by the irradiance that it can bring to a vertex.
//!
//! Up to eight lights are the children of one node: a list. Of more, those that have a place are a tree; those that are infinitely
//! far away stand beside it below the root.
//!
//! Source: Conty Estévez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018; costs as in Pharr,
//! Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 12.6.3. Nodes have eight children, of which the groups
//! that are largest are divided first.

use super::LightRecord;
use super::light_bounds::{Bounds, Leaf};
use super::light_groups::divide;
use super::motion_table::MotionTable;
use optics::Vec3f;
use optics::constants::NONE;
use optics::light_node::{LightNode, NODE_WIDTH};
use optics::light_tree::{
    LIGHT_NODE_INDEX, LIGHT_NODE_LEAF, UNIFORM_SHARE, child_weight, light_branch, light_choice_probability,
    light_share, node_weight, refill, uniform_light, uniform_remainder,
};

/// Of fewer lights none is chosen.
const FEWEST_LIGHTS: usize = 2;

/// A light that was chosen.
#[derive(Clone, Copy, Debug)]
pub struct LightChoice {
    /// Which one.
    pub index: u32,
    /// Probability of that, counted as part of all choices of a light.
    pub probability: f32,
    /// A fresh uniform number in `[0, 1)`.
    pub remainder: f32,
}

/// The lights in a tree; empty where none has to be chosen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    /// Nodes; the first one is the root.
    pub nodes: Vec<LightNode>,
    /// Where each light stands, as long as the lights: eight times the index of its node, plus which child of that it is. `NONE`
    /// for lights that never shine, which are not in the tree.
    pub places: Vec<u32>,
    /// Whether the root's children are defended: see [`child_weight`].
    pub defends_root: bool,
    /// Share of the choices that are uniform over all lights: see [`UNIFORM_SHARE`].
    pub uniform_share: f32,
}

impl LightTree {
    /// The tree over `lights`.
    pub fn new(lights: &[LightRecord]) -> Self {
        Self::of_moving(lights, None)
    }

    /// As [`LightTree::new`], of lights that may move.
    pub(super) fn of_moving(lights: &[LightRecord], motion: Option<&MotionTable>) -> Self {
        let leaf = |(index, light)| Leaf::moving(index, light, motion);
        let mut leaves: Vec<Leaf> = (0..).zip(lights).filter_map(leaf).collect();
        if leaves.len() < FEWEST_LIGHTS {
            return Self::default();
        }
        let mut tree = Self { places: vec![NONE; lights.len()], ..Self::default() };
        if leaves.len() <= NODE_WIDTH {
            tree.defends_root = true;
            tree.add_node(leaves.chunks_mut(1).collect(), NONE, 0);
            return tree;
        }
        tree.uniform_share = UNIFORM_SHARE;
        let distant = |leaf: &Leaf| leaf.bounds.infinitely_far;
        leaves.sort_by_key(|leaf| !distant(leaf));
        let distants = leaves.iter().filter(|leaf| distant(leaf)).count();
        let (far, placed) = leaves.split_at_mut(distants);
        if far.is_empty() || placed.is_empty() {
            tree.build(if far.is_empty() { placed } else { far }, NONE, 0);
            return tree;
        }
        // How much a group of many lights brings is not known well.
        tree.defends_root = true;
        let mut groups = vec![placed];
        if far.len() < NODE_WIDTH {
            groups.extend(far.chunks_mut(1));
        } else {
            groups.push(far);
        }
        tree.add_node(groups, NONE, 0);
        tree
    }

    /// Whether there is no tree.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The only node, whose children are all lights, and how many it has, if they are few. Every choice is defended there.
    #[inline(always)]
    pub fn list(&self) -> Option<(&LightNode, usize)> {
        match &self.nodes[..] {
            [only] => Some((only, only.intensity.iter().filter(|i| **i > 0.0).count())),
            _ => None,
        }
    }

    /// Chooses a light for a point of a surface. `None` if no light of the tree can reach it.
    ///
    /// - `p`: the point. `normal`: unit normal on the side that light can reach, or zero if it can reach both.
    /// - `u`: a uniform number in `[0, 1)`; `rest`: another one, for the bits that the choice uses up.
    #[inline(always)]
    pub fn choose(&self, p: Vec3f, normal: Vec3f, u: f32, rest: f32) -> Option<LightChoice> {
        if self.uniform_share <= 0.0 {
            let choice = self.choose_by_importance(p, normal, u)?;
            let remainder = refill(choice.remainder, choice.probability, rest);
            return Some(LightChoice { remainder, ..choice });
        }
        let count = self.places.len() as u32;
        let branch = light_branch(self.uniform_share, 1.0 - self.uniform_share, u);
        let choice = if branch.second {
            let choice = self.choose_by_importance(p, normal, branch.remainder)?;
            let probability = light_choice_probability(choice.probability, self.uniform_share, count as f32);
            LightChoice { probability, ..choice }
        } else {
            let index = uniform_light(branch.remainder, count);
            LightChoice {
                index,
                probability: self.probability_of(index, p, normal),
                remainder: uniform_remainder(branch.remainder, count),
            }
        };
        Some(LightChoice { remainder: refill(choice.remainder, choice.probability, rest), ..choice })
    }

    /// Walks down the tree. Bits of the remainder are used up.
    #[inline(always)]
    fn choose_by_importance(&self, p: Vec3f, normal: Vec3f, u: f32) -> Option<LightChoice> {
        let mut node = self.nodes.first()?;
        let mut choice = LightChoice { index: 0, probability: 1.0, remainder: u };
        let mut defends = self.defends_root;
        loop {
            let child = node.choose(p, normal, defends, choice.remainder);
            choice.probability *= child.probability;
            if choice.probability <= 0.0 {
                return None;
            }
            choice.remainder = child.remainder;
            choice.index = child.link & LIGHT_NODE_INDEX;
            if child.link & LIGHT_NODE_LEAF != 0 {
                return Some(choice);
            }
            node = &self.nodes[choice.index as usize];
            defends = false;
        }
    }

    /// Probability with which [`LightTree::choose`] takes light `index`.
    #[inline(always)]
    pub fn probability_of(&self, index: u32, p: Vec3f, normal: Vec3f) -> f32 {
        let mut place = self.places[index as usize];
        let mut probability = if place == NONE { 0.0 } else { 1.0 };
        while place != NONE {
            let (node, child) = (&self.nodes[place as usize / NODE_WIDTH], place as usize % NODE_WIDTH);
            let (importances, together) = node.importances(p, normal);
            let defends = self.defends_root && node.place == NONE;
            let weight = child_weight(importances[child], together, defends);
            probability *= light_share(weight, node_weight(together, defends));
            place = node.place;
        }
        if self.uniform_share <= 0.0 {
            return probability;
        }
        light_choice_probability(probability, self.uniform_share, self.places.len() as f32)
    }

    /// Whether light `index` is in the tree.
    pub fn contains(&self, index: u32) -> bool {
        self.places.get(index as usize).is_some_and(|&place| place != NONE)
    }

    /// Bytes in all arrays.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.places[..])
    }

    /// Most nodes that a tree of so many lights has: nodes are full but for the lowest ones, which have at least two lights. So
    /// with n lights there are at most n/2 lowest nodes, and a seventh of that above them; and a root above the trees of lights that
    /// have a place and of those that have none.
    pub const fn most_nodes(lights: u64) -> u64 {
        lights.div_ceil(2) * 8 / 7 + 3
    }

    /// Appends a node at `place` and everything below it; `level`: nodes above it. Returns what is known of all its lights.
    fn build(&mut self, leaves: &mut [Leaf], place: u32, level: u32) -> Bounds {
        self.add_node(divide(leaves, level), place, level)
    }

    /// The same for a node that has these groups of lights as children: some, and none of them empty.
    fn add_node(&mut self, groups: Vec<&mut [Leaf]>, place: u32, level: u32) -> Bounds {
        let at = self.nodes.len();
        self.nodes.push(LightNode::at(place));
        let mut all: Option<Bounds> = None;
        let first = groups[0][0].bounds;
        for (child, group) in groups.into_iter().enumerate() {
            let place = (at * NODE_WIDTH + child) as u32;
            let (bounds, link) = if let [leaf] = group {
                self.places[leaf.light as usize] = place;
                (leaf.bounds, LIGHT_NODE_LEAF | leaf.light)
            } else {
                let node = self.nodes.len() as u32;
                (self.build(group, place, level + 1), node)
            };
            self.nodes[at].set(child, &bounds.group(group), link);
            all = Some(all.map_or(bounds, |all| all.union(&bounds)));
        }
        all.unwrap_or(first)
    }
}

#[cfg(test)]
mod tests {
    use super::super::light::Rectangle;
    use super::super::light_bounds::vec3;
    use super::*;
    use glam::Vec3;
    use optics::light_tree::MOST_VARIANCE;
    use std::f32::consts::PI;

    /// Points, spots, spheres, triangles and rectangles here and there, and the sun.
    fn lights(count: usize) -> Vec<LightRecord> {
        let mut state = 7u32;
        let mut unit = move || {
            state = optics::random::pcg_hash(state);
            optics::random::unit_float(state)
        };
        let mut point = move || Vec3::new(unit(), unit(), unit()) * 10.0 - 5.0;
        let mut lights: Vec<_> = (0..count)
            .map(|i| {
                let (p, q, power) = (point(), point(), point().abs());
                match i % 6 {
                    0 => LightRecord::point(p, power),
                    1 => LightRecord::spot(p, q.normalize(), power, 0.2, 0.7),
                    2 => LightRecord::sphere(p, 0.2, power, false, 1.0),
                    3 => LightRecord::triangle([p, p + Vec3::X * 0.3, p + q * 0.1], power, false, 1.0),
                    4 => LightRecord::triangle([p, p + Vec3::Y * 0.3, p + q * 0.1], power, true, 0.5),
                    _ => {
                        let (edge1, edge2) = (Vec3::X * 0.4, Vec3::new(0.0, q.y, q.z).normalize() * 0.2);
                        LightRecord::rectangle(&Rectangle { first: p, edge1, edge2 }, power, q.x > 0.0)
                    }
                }
            })
            .collect();
        lights.push(LightRecord::directional(Vec3::Y, Vec3::ONE, 0.0, false, 10.0));
        lights
    }

    fn places() -> impl Iterator<Item = (Vec3f, Vec3f)> {
        (0..40).map(|i| {
            let t = i as f32;
            let p = Vec3::new((t * 1.7).sin(), (t * 2.3).cos(), (t * 0.9).sin()) * (0.3 * t);
            let n = Vec3::new((t * 3.1).cos(), (t * 0.7).sin(), 0.3).normalize();
            (vec3(p), if i % 3 == 0 { vec3(Vec3::ZERO) } else { vec3(n) })
        })
    }

    #[test]
    fn places_are_where_lights_are() {
        for count in [1, NODE_WIDTH - 1, NODE_WIDTH, 100, 10_000] {
            let lights = lights(count);
            let tree = LightTree::new(&lights);
            assert_eq!(tree.list().map(|(_, lights)| lights), (count < NODE_WIDTH).then_some(count + 1));
            assert!(
                tree.nodes.len() as u64 <= LightTree::most_nodes(count as u64 + 1),
                "{} nodes",
                tree.nodes.len()
            );
            for light in 0..=count {
                let place = tree.places[light] as usize;
                let link = tree.nodes[place / NODE_WIDTH].link[place % NODE_WIDTH];
                assert_eq!(link, LIGHT_NODE_LEAF | light as u32, "of {count} lights");
            }
            for (index, node) in tree.nodes.iter().enumerate().skip(1) {
                let parent = node.place as usize;
                assert_eq!(
                    tree.nodes[parent / NODE_WIDTH].link[parent % NODE_WIDTH],
                    index as u32,
                    "of {count} lights"
                );
            }
            assert_eq!(tree.nodes[0].place, NONE);
            assert!((0..=count as u32).all(|i| tree.contains(i)), "{count} lights and the sun");
        }
        assert!(LightTree::new(&lights(0)).is_empty(), "one light need not be chosen");
    }

    /// Equal places and many lights on one spot must not make the tree deep.
    #[test]
    fn lights_at_one_place_make_a_flat_tree() {
        let lights = vec![LightRecord::point(Vec3::ONE, Vec3::ONE); 5000];
        let tree = LightTree::new(&lights);
        assert!((0..5000).all(|i| tree.contains(i)));
        let (p, n) = (vec3(Vec3::ZERO), vec3(Vec3::Y));
        assert!((0..5000).all(|i| (tree.probability_of(i, p, n) * 5000.0 - 1.0).abs() < 1e-3));
    }

    /// Where a group promises light that none of its halves does, nothing is chosen: probabilities may sum to less.
    #[test]
    fn choices_follow_the_probabilities() {
        for count in [1, 4, 7, 60] {
            choices_follow_the_probabilities_of(count);
        }
    }

    fn choices_follow_the_probabilities_of(count: usize) {
        let lights = lights(count);
        let tree = LightTree::new(&lights);
        let count = lights.len();
        let mut lit = 0;
        for (p, n) in places() {
            let probability: Vec<f64> =
                (0..count as u32).map(|i| f64::from(tree.probability_of(i, p, n))).collect();
            let sum: f64 = probability.iter().sum();
            assert!(sum < 1.0 + 1e-5, "at {p:?}: {sum}");
            lit += usize::from(sum > 0.4);
            let draws = 20_000;
            let mut seen = vec![0.0f64; count];
            for i in 0..draws {
                let Some(choice) = tree.choose(p, n, (i as f32 + 0.5) / draws as f32, 0.5) else { continue };
                let expected = tree.probability_of(choice.index, p, n);
                assert!((choice.probability - expected).abs() <= 1e-5 * expected, "{choice:?}, {expected}");
                assert!((0.0..1.0).contains(&choice.remainder));
                seen[choice.index as usize] += 1.0 / f64::from(draws);
            }
            // Numbers at equal distances: each share is met to a few of them.
            for (i, (seen, expected)) in seen.iter().zip(&probability).enumerate() {
                assert!((seen - expected).abs() < 3e-4, "light {i} at {p:?}: {seen} for {expected}");
            }
        }
        assert!(lit >= 20, "at {lit} of 40 places only are lights chosen more often than not");
    }

    /// What brings light must be chosen sometimes: otherwise pictures would be too dark.
    #[test]
    fn every_light_that_shines_on_a_surface_has_a_probability() {
        let lights = lights(300);
        let tree = LightTree::new(&lights);
        let mut shining = 0;
        for (p, n) in places() {
            for (i, record) in (0..300).zip(&lights) {
                for u in [[0.1, 0.2], [0.5, 0.5], [0.9, 0.3], [0.3, 0.95]] {
                    let sample = optics::light::light_sample(record.light, p, optics::vec2f(u[0], u[1]));
                    let received = optics::vector::dot(sample.wi, n) > 1e-3 || n == vec3(Vec3::ZERO);
                    let radiance = Vec3::from(sample.radiance.to_array()).max_element();
                    if sample.pdf > 0.0 && radiance > 0.0 && received {
                        shining += 1;
                        assert!(tree.probability_of(i, p, n) > 0.0, "light {i} {record:?} at {p:?}, {n:?}");
                    }
                }
            }
        }
        assert!(shining > 10_000, "only {shining} samples");
    }

    /// Neither strength nor distance, and no estimate of what arrives, takes more from a light's
    /// share than is allowed.
    #[test]
    fn no_light_of_a_list_starves() {
        for count in 1..NODE_WIDTH {
            let mut lights = lights(count);
            for (i, light) in lights.iter_mut().enumerate() {
                light.strength *= 10.0_f32.powi((7 * i % 13) as i32 - 6);
            }
            let tree = LightTree::new(&lights);
            for (p, n) in places() {
                let probability = |i: usize| tree.probability_of(i as u32, p, n);
                let reaching = (0..lights.len()).filter(|&i| probability(i) > 0.0).count();
                let least = 1.0 / (1.0 + MOST_VARIANCE * (reaching as f32 - 1.0));
                let sum: f32 = (0..lights.len()).map(probability).sum();
                assert!(reaching == 0 || (sum - 1.0).abs() < 1e-5, "{count} lights at {p:?}: {sum}");
                for i in (0..lights.len()).filter(|&i| probability(i) > 0.0) {
                    assert!(
                        probability(i) > least * 0.9999,
                        "light {i} of {count} at {p:?}: {}",
                        probability(i)
                    );
                }
            }
        }
    }

    /// A sun is as important as what it brings, however large the scene is; and colours count alike.
    #[test]
    fn suns_and_lamps_are_chosen_by_the_irradiance_that_they_bring() {
        let (p, up) = (vec3(Vec3::ZERO), vec3(Vec3::Y));
        let lamp = LightRecord::point(Vec3::Y * 2.0, Vec3::Z * 4.0);
        for scene_radius in [1.0, 1e4] {
            let sun = LightRecord::directional(Vec3::Y, Vec3::ONE, 0.01, true, scene_radius);
            let sky = LightRecord::environment(1.0 / PI, scene_radius);
            let tree = LightTree::new(&[lamp, sun, sky]);
            for i in 0..3 {
                let probability = tree.probability_of(i, p, up);
                assert!((probability - 1.0 / 3.0).abs() < 1e-3, "light {i}: {probability}");
            }
            let below = [0, 1, 2].map(|i| tree.probability_of(i, p, vec3(-Vec3::Y)));
            assert_eq!(below, [0.0, 0.0, 1.0], "only the sky is seen from below");
        }
    }

    /// Many suns beside many lamps, and many suns alone.
    #[test]
    fn suns_have_a_tree_of_their_own_if_they_are_many() {
        for lamps in [0, 40] {
            let sun = |i: usize| {
                let direction = Vec3::new((i as f32).sin(), 1.0, (i as f32 * 1.7).cos()).normalize();
                LightRecord::directional(direction, Vec3::ONE, 0.0, false, 1.0)
            };
            let mut lights = lights(lamps);
            lights.extend((0..30).map(sun));
            let tree = LightTree::new(&lights);
            let (p, up) = (vec3(Vec3::ZERO), vec3(Vec3::Y));
            let of_suns: f32 = (lamps + 1..lights.len()).map(|i| tree.probability_of(i as u32, p, up)).sum();
            assert!(of_suns > if lamps == 0 { 0.9 } else { 0.25 }, "{of_suns}");
            let least = (0..lights.len()).map(|i| tree.probability_of(i as u32, p, up)).fold(1.0, f32::min);
            assert!(least >= UNIFORM_SHARE / lights.len() as f32 * 0.999, "{least}");
        }
    }

    /// Near lights are what the tree is for.
    #[test]
    fn near_lights_are_preferred_to_far_ones() {
        let lights: Vec<_> =
            (0..100).map(|i| LightRecord::point(Vec3::new(i as f32, 1.0, 0.0), Vec3::ONE)).collect();
        let tree = LightTree::new(&lights);
        let at = |i: u32| tree.probability_of(i, vec3(Vec3::new(20.0, 0.0, 0.0)), vec3(Vec3::Y));
        // Of the choices that are uniform, each light has its share.
        let by_chance = UNIFORM_SHARE / 100.0;
        assert!(at(20) > 0.2 && at(90) < 1e-3 + by_chance, "{} and {}", at(20), at(90));
    }
}
