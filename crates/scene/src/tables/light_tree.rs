//! A binary tree over the lights that have a place, for choosing one that matters where it is asked for.
//!
//! Source: Conty Estévez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018; costs as in Pharr,
//! Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 12.6.3.

use super::LightRecord;
use super::light::luminance;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use optics::light::{LIGHT_POINT, LIGHT_SPHERE, LIGHT_SPOT, LIGHT_TRIANGLE};
use optics::light_tree::{
    LIGHT_NODE_INDEX, LIGHT_NODE_LEAF, LIGHT_NODE_TWO_SIDED, LIGHT_NODE_WORDS, LightBounds, cosines_encode,
    light_bounds, light_branch, light_branch_probability, light_importance, octahedral_encode, refill,
};
use optics::{Vec3f, vec3f};
use std::f32::consts::PI;

/// With fewer lights the tree is not worth its walk.
pub const FEWEST_LIGHTS: usize = 9;

/// Groups of more lights are divided by place alone: what it costs to look at their directions grows faster than the gain.
const MOST_COMPARED: usize = 4096;

/// Planes between which groups are divided, for each axis.
const BINS: usize = 12;

/// Levels below the root: a light's trail has a bit for each.
const MOST_LEVELS: u32 = 32;

/// One node, as back ends read it; `LIGHT_NODE_WORDS` words.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightNode {
    /// Corner of a box around the lights, world space.
    pub low: [f32; 3],
    /// The other corner.
    pub high: [f32; 3],
    /// See [`LightBounds::intensity`].
    pub intensity: f32,
    /// See [`LightBounds::axis`], by `octahedral_encode`.
    pub axis: u32,
    /// See [`LightBounds::cos_spread`] and `cos_emission`, by `cosines_encode`.
    pub cosines: u32,
    /// `LIGHT_NODE_…` bits, and the index of the light, or of the first of two children that stand side by side.
    pub link: u32,
}

const _: () = assert!(size_of::<LightNode>() == 4 * LIGHT_NODE_WORDS as usize);

impl LightNode {
    fn new(bounds: &Bounds, link: u32) -> Self {
        // What the codes lose must not make cones narrower: the axis is exact to 10⁻⁴.
        let spread = (bounds.spread + 2e-4).min(PI);
        Self {
            low: bounds.low.to_array(),
            high: bounds.high.to_array(),
            intensity: bounds.intensity,
            axis: octahedral_encode(vec3(bounds.axis)),
            cosines: cosines_encode(spread.cos(), bounds.emission.cos()),
            link: link | if bounds.two_sided { LIGHT_NODE_TWO_SIDED } else { 0 },
        }
    }

    /// What the node says, for `optics::light_tree::light_importance`.
    #[inline]
    pub fn bounds(&self) -> LightBounds {
        let (low, high) = (vec3(self.low.into()), vec3(self.high.into()));
        light_bounds(low, high, self.intensity, self.axis, self.cosines, self.link)
    }
}

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

/// The lights that have a place, in a tree; empty where there are too few.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    /// Nodes; the first one is the root.
    pub nodes: Vec<LightNode>,
    /// The way from the root to each light, as long as the lights: bit i says which child to take at level i. Of lights that
    /// are not in the tree it leads to another light.
    pub trails: Vec<u32>,
    /// Probability of choosing from the tree rather than among the lights without a place.
    pub probability: f32,
}

impl LightTree {
    /// The tree over `lights`.
    pub fn new(lights: &[LightRecord]) -> Self {
        let mut placed: Vec<Leaf> = (0..).zip(lights).filter_map(|(index, l)| Leaf::new(index, l)).collect();
        if placed.len() < FEWEST_LIGHTS {
            return Self::default();
        }
        let power = |l: &LightRecord| if l.power.is_finite() { f64::from(l.power.max(0.0)) } else { 0.0 };
        let all: f64 = lights.iter().map(power).sum();
        let here: f64 = placed.iter().map(|leaf| power(&lights[leaf.light as usize])).sum();
        let distant = all - here;
        let mut tree = Self {
            nodes: vec![LightNode::default()],
            trails: vec![0; lights.len()],
            // What is infinitely far away has a power that depends on how large the scene is: neither may starve.
            probability: if distant > 1e-9 * all { (here / all).clamp(0.2, 0.8) as f32 } else { 1.0 },
        };
        tree.build(0, &mut placed, 0, 0);
        tree
    }

    /// Whether there is no tree.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Chooses a light for a point of a surface. `None` if no light of the tree can reach it.
    ///
    /// - `p`: the point. `normal`: unit normal on the side that light can reach, or zero if it can reach both.
    /// - `u`: a uniform number in `[0, 1)`; `rest`: another one, for the bits that the choice uses up.
    #[inline]
    pub fn choose(&self, p: Vec3f, normal: Vec3f, u: f32, rest: f32) -> Option<LightChoice> {
        let mut node = self.nodes.first()?;
        let (mut probability, mut u) = (1.0, u);
        while node.link & LIGHT_NODE_LEAF == 0 {
            let [first, second] = self.children(node);
            let branch = light_branch(
                light_importance(first.bounds(), p, normal),
                light_importance(second.bounds(), p, normal),
                u,
            );
            probability *= branch.probability;
            if probability <= 0.0 {
                return None;
            }
            u = branch.remainder;
            node = if branch.second { second } else { first };
        }
        Some(LightChoice {
            index: node.link & LIGHT_NODE_INDEX,
            probability: probability * self.probability,
            remainder: refill(u, probability * self.probability, rest),
        })
    }

    /// Probability with which [`LightTree::choose`] takes light `index`, counted as part of all choices of a light.
    #[inline]
    pub fn probability_of(&self, index: u32, p: Vec3f, normal: Vec3f) -> f32 {
        let Some(mut node) = self.nodes.first() else { return 0.0 };
        let mut trail = self.trails[index as usize];
        let mut probability = self.probability;
        while node.link & LIGHT_NODE_LEAF == 0 {
            let [first, second] = self.children(node);
            let takes_second = trail & 1 == 1;
            probability *= light_branch_probability(
                light_importance(first.bounds(), p, normal),
                light_importance(second.bounds(), p, normal),
                takes_second,
            );
            if probability <= 0.0 {
                return 0.0;
            }
            node = if takes_second { second } else { first };
            trail >>= 1;
        }
        // The trail of a light that is not in the tree leads to another.
        if node.link & LIGHT_NODE_INDEX == index { probability } else { 0.0 }
    }

    /// Whether light `index` is in the tree.
    pub fn contains(&self, index: u32) -> bool {
        let Some(mut node) = self.nodes.first() else { return false };
        let mut trail = self.trails[index as usize];
        while node.link & LIGHT_NODE_LEAF == 0 {
            node = self.children(node)[(trail & 1) as usize];
            trail >>= 1;
        }
        node.link & LIGHT_NODE_INDEX == index
    }

    #[inline]
    fn children(&self, node: &LightNode) -> [&LightNode; 2] {
        let first = (node.link & LIGHT_NODE_INDEX) as usize;
        [&self.nodes[first], &self.nodes[first + 1]]
    }

    /// Bytes in all arrays.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.trails[..])
    }

    /// Writes node `at` and everything below it; `trail`: the way there, of `level` bits.
    fn build(&mut self, at: usize, leaves: &mut [Leaf], trail: u32, level: u32) -> Bounds {
        if let [leaf] = leaves {
            self.trails[leaf.light as usize] = trail;
            self.nodes[at] = LightNode::new(&leaf.bounds, LIGHT_NODE_LEAF | leaf.light);
            return leaf.bounds;
        }
        let levels_needed = leaves.len().next_power_of_two().trailing_zeros();
        let middle = if level + levels_needed >= MOST_LEVELS { None } else { partition(leaves) };
        let middle = middle.unwrap_or_else(|| halve(leaves));
        let first = self.nodes.len();
        self.nodes.extend([LightNode::default(); 2]);
        let (left, right) = leaves.split_at_mut(middle);
        let left = self.build(first, left, trail, level + 1);
        let right = self.build(first + 1, right, trail | 1 << level, level + 1);
        let bounds = left.union(&right);
        self.nodes[at] = LightNode::new(&bounds, first as u32);
        bounds
    }
}

/// A light to be put into the tree.
#[derive(Clone, Copy)]
struct Leaf {
    light: u32,
    bounds: Bounds,
    center: Vec3,
}

impl Leaf {
    /// `None` for lights without a place, and for those that do not shine.
    fn new(light: u32, record: &LightRecord) -> Option<Self> {
        let bounds = Bounds::of(record)?;
        let usable = bounds.low.is_finite()
            && bounds.high.is_finite()
            && bounds.intensity.is_finite()
            && bounds.intensity > 0.0;
        usable.then(|| Self { light, bounds, center: (bounds.low + bounds.high) * 0.5 })
    }
}

/// As [`LightBounds`], with angles in radians.
#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
    intensity: f32,
    axis: Vec3,
    spread: f32,
    emission: f32,
    two_sided: bool,
}

impl Bounds {
    fn of(record: &LightRecord) -> Option<Self> {
        let light = &record.light;
        let position = Vec3::from(light.position.to_array());
        let (edge1, edge2) = (Vec3::from(light.edge1.to_array()), Vec3::from(light.edge2.to_array()));
        let emission = luminance(Vec3::from(light.emission.to_array()));
        let everywhere = Self {
            low: position,
            high: position,
            intensity: emission,
            axis: Vec3::Z,
            spread: PI,
            emission: PI * 0.5,
            two_sided: light.two_sided,
        };
        match light.kind {
            LIGHT_TRIANGLE => {
                let corners = [position, position + edge1, position + edge2];
                let normal = edge1.cross(edge2);
                // Its power knows the mean of its texture.
                let sides = if light.two_sided { 2.0 } else { 1.0 };
                Some(Self {
                    low: corners[0].min(corners[1]).min(corners[2]),
                    high: corners[0].max(corners[1]).max(corners[2]),
                    intensity: record.power / (PI * sides),
                    axis: normal.try_normalize()?,
                    spread: 0.0,
                    ..everywhere
                })
            }
            LIGHT_SPHERE => {
                let radius = Vec3::splat(light.size);
                Some(Self {
                    low: position - radius,
                    high: position + radius,
                    intensity: emission * PI * light.size * light.size,
                    ..everywhere
                })
            }
            LIGHT_POINT => Some(everywhere),
            LIGHT_SPOT => {
                // From [`optics::light::spot_falloff_parameters`]: zero where cos · scale + offset is.
                let cos_outer = (-light.edge2.y / light.edge2.x).clamp(-1.0, 1.0);
                let outer = (cos_outer.acos() + 1e-3).min(PI);
                Some(Self { axis: edge1.try_normalize()?, spread: 0.0, emission: outer, ..everywhere })
            }
            _ => None,
        }
    }

    fn union(&self, other: &Self) -> Self {
        let (axis, spread) = union_of_cones((self.axis, self.spread), (other.axis, other.spread));
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            intensity: self.intensity + other.intensity,
            axis,
            spread,
            emission: self.emission.max(other.emission),
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// How much a group costs: its intensity, times how large it is, times how many directions it shines into.
    fn cost(&self) -> f32 {
        let size = self.high - self.low;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        // A group on a line or at a point has no area; its length must still count.
        self.intensity * (area + 1e-3 * size.length_squared()) * self.solid_angle_measure()
    }

    /// The measure M_Ω of directions, by the cosine beyond the cone (Conty Estévez and Kulla, equation 1).
    fn solid_angle_measure(&self) -> f32 {
        let (sin, cos) = self.spread.sin_cos();
        let outer = (self.spread + self.emission).min(PI);
        2.0 * PI * (1.0 - cos)
            + PI * 0.5
                * (2.0 * outer * sin - (self.spread - 2.0 * outer).cos() - 2.0 * self.spread * sin + cos)
    }
}

/// The narrowest cone around two, each a unit axis and a half angle in radians.
fn union_of_cones(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = wide.0.dot(narrow.0).clamp(-1.0, 1.0).acos();
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let spread = (wide.1 + between + narrow.1) * 0.5;
    let pivot = wide.0.cross(narrow.0);
    if spread >= PI || pivot.length_squared() < 1e-20 {
        return (wide.0, PI);
    }
    let turn = glam::Quat::from_axis_angle(pivot.normalize(), spread - wide.1);
    // What rounding moves the axis by is added to the angle.
    ((turn * wide.0).normalize(), (spread + 1e-5).min(PI))
}

/// Divides the lights so that the two groups cost least; returns how many are in the first. `None` where no plane divides
/// them.
fn partition(leaves: &mut [Leaf]) -> Option<usize> {
    if leaves.len() > MOST_COMPARED {
        return None;
    }
    let low = leaves.iter().fold(Vec3::INFINITY, |low, l| low.min(l.center));
    let high = leaves.iter().fold(Vec3::NEG_INFINITY, |high, l| high.max(l.center));
    let size = high - low;
    let bin = |leaf: &Leaf, axis: usize| {
        (((leaf.center[axis] - low[axis]) / size[axis] * BINS as f32) as usize).min(BINS - 1)
    };
    let longest = size.max_element();
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| size[axis] > 1e-6 * longest) {
        let mut bins: [Option<Bounds>; BINS] = [None; BINS];
        for leaf in leaves.iter() {
            let bin = &mut bins[bin(leaf, axis)];
            *bin = Some(bin.map_or(leaf.bounds, |b| b.union(&leaf.bounds)));
        }
        // Thin groups are worth dividing along their length.
        let thinness = longest / size[axis];
        for (plane, cost) in plane_costs(&bins) {
            let cost = cost * thinness;
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, plane));
            }
        }
    }
    let (_, axis, plane) = best?;
    let mut middle = 0;
    for i in 0..leaves.len() {
        if bin(&leaves[i], axis) < plane {
            leaves.swap(i, middle);
            middle += 1;
        }
    }
    (middle > 0 && middle < leaves.len()).then_some(middle)
}

/// The cost of both sides of each plane that has lights on both.
fn plane_costs(bins: &[Option<Bounds>; BINS]) -> impl Iterator<Item = (usize, f32)> {
    let join = |a: Option<Bounds>, b: Option<Bounds>| match (a, b) {
        (Some(a), Some(b)) => Some(a.union(&b)),
        (a, b) => a.or(b),
    };
    let mut above = [None; BINS];
    let mut sum = None;
    for i in (0..BINS).rev() {
        sum = join(bins[i], sum);
        above[i] = sum;
    }
    let mut below = None;
    (1..BINS).filter_map(move |plane| {
        below = join(below, bins[plane - 1]);
        let (below, above) = (below?, above[plane]?);
        Some((plane, below.cost() + above.cost()))
    })
}

/// Divides the lights into halves along the longest side of the box around them; returns how many are in the first.
fn halve(leaves: &mut [Leaf]) -> usize {
    let low = leaves.iter().fold(Vec3::INFINITY, |low, l| low.min(l.center));
    let high = leaves.iter().fold(Vec3::NEG_INFINITY, |high, l| high.max(l.center));
    let axis = (high - low).max_position();
    let middle = leaves.len() / 2;
    leaves.select_nth_unstable_by(middle, |a, b| a.center[axis].total_cmp(&b.center[axis]));
    middle
}

fn vec3(v: Vec3) -> Vec3f {
    vec3f(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points, spots, spheres and triangles here and there, and the sun.
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
                match i % 5 {
                    0 => LightRecord::point(p, power),
                    1 => LightRecord::spot(p, q.normalize(), power, 0.2, 0.7),
                    2 => LightRecord::sphere(p, 0.2, power, false),
                    3 => LightRecord::triangle([p, p + Vec3::X * 0.3, p + q * 0.1], power, false, 1.0),
                    _ => LightRecord::triangle([p, p + Vec3::Y * 0.3, p + q * 0.1], power, true, 0.5),
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
    fn trails_lead_to_their_lights() {
        for count in [FEWEST_LIGHTS, 100, 10_000] {
            let lights = lights(count);
            let tree = LightTree::new(&lights);
            assert_eq!(tree.nodes.len(), 2 * count - 1);
            assert!((0..count as u32).all(|i| tree.contains(i)), "{count} lights");
            assert!(!tree.contains(count as u32), "the sun has no place");
        }
        assert!(LightTree::new(&lights(FEWEST_LIGHTS - 1)).is_empty());
    }

    /// Equal places and many lights on one spot must not make the tree deeper than trails are long.
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
        let lights = lights(60);
        let tree = LightTree::new(&lights);
        let mut lit = 0;
        for (p, n) in places() {
            let probability: Vec<f64> = (0..61).map(|i| f64::from(tree.probability_of(i, p, n))).collect();
            let sum: f64 = probability.iter().sum();
            let most = f64::from(tree.probability);
            assert!(sum < most + 1e-5, "at {p:?}: {sum}");
            lit += usize::from(sum > 0.4 * most);
            let draws = 20_000;
            let mut seen = vec![0.0f64; 61];
            for i in 0..draws {
                let Some(choice) = tree.choose(p, n, (i as f32 + 0.5) / draws as f32, 0.5) else { continue };
                let expected = tree.probability_of(choice.index, p, n);
                assert!((choice.probability - expected).abs() <= 1e-5 * expected, "{choice:?}, {expected}");
                assert!((0.0..1.0).contains(&choice.remainder));
                seen[choice.index as usize] += f64::from(tree.probability) / f64::from(draws);
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

    /// Near lights are what the tree is for.
    #[test]
    fn near_lights_are_preferred_to_far_ones() {
        let lights: Vec<_> =
            (0..100).map(|i| LightRecord::point(Vec3::new(i as f32, 1.0, 0.0), Vec3::ONE)).collect();
        let tree = LightTree::new(&lights);
        let at = |i: u32| tree.probability_of(i, vec3(Vec3::new(20.0, 0.0, 0.0)), vec3(Vec3::Y));
        assert!(at(20) > 0.2 && at(90) < 1e-3, "{} and {}", at(20), at(90));
    }
}
