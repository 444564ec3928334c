//! A tree over the lights that have a place, for choosing one that matters where it is asked for.
//!
//! Source: Conty Estévez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018; costs as in Pharr,
//! Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 12.6.3. Nodes have eight children, of which the groups
//! that are largest are divided first.

use super::light::luminance;
use super::{LightRecord, NONE};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use optics::light::{LIGHT_POINT, LIGHT_RECTANGLE, LIGHT_SPHERE, LIGHT_SPOT, LIGHT_TRIANGLE, Light};
use optics::light_tree::{
    LIGHT_NODE_INDEX, LIGHT_NODE_LEAF, LIGHT_NODE_WIDTH, LIGHT_NODE_WORDS, LightGroup, light_importance,
    light_remainder, light_share, refill,
};
use optics::{Vec3f, vec3f};
use std::f32::consts::PI;

/// With fewer lights the tree is not worth its walk.
pub const FEWEST_LIGHTS: usize = 9;

/// Groups of more lights are divided by place alone: what it costs to look at their directions grows faster than the gain.
const MOST_COMPARED: usize = 4096;

/// Planes between which groups are divided, for each axis.
const BINS: usize = 12;

/// Levels below the root: from there on groups are halved, so that no walk is long.
const MOST_LEVELS: u32 = 32;

/// Children of a node.
const WIDTH: usize = LIGHT_NODE_WIDTH as usize;

/// One number for each child of a node.
type Children<T> = [T; WIDTH];

/// One node, as back ends read it; `LIGHT_NODE_WORDS` words. What is known of its children is kept as it is needed, so that a
/// loop over them has nothing to decode. Children that there are not have no intensity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightNode {
    /// See [`LightGroup::center`]; x of all children, y, z.
    center: [Children<f32>; 3],
    /// See [`LightGroup::radius`].
    radius: Children<f32>,
    /// See [`LightGroup::intensity`].
    intensity: Children<f32>,
    /// See [`LightGroup::axis`].
    axis: [Children<f32>; 3],
    /// See [`LightGroup::cos_spread`].
    cos_spread: Children<f32>,
    /// See [`LightGroup::sin_spread`].
    sin_spread: Children<f32>,
    /// See [`LightGroup::cos_emission`].
    cos_emission: Children<f32>,
    /// See [`LightGroup::back`].
    back: Children<f32>,
    /// `LIGHT_NODE_LEAF` or not, and the index of the light or of the node.
    link: Children<u32>,
    /// Where the node stands: eight times the index of its parent, plus which child of that it is. `NONE`: it is the root.
    place: u32,
}

const _: () = assert!(size_of::<LightNode>() == 4 * LIGHT_NODE_WORDS as usize);

impl LightNode {
    fn set(&mut self, child: usize, group: &LightGroup, link: u32) {
        let (center, axis) = (group.center.to_array(), group.axis.to_array());
        for i in 0..3 {
            self.center[i][child] = center[i];
            self.axis[i][child] = axis[i];
        }
        self.radius[child] = group.radius;
        self.intensity[child] = group.intensity;
        self.cos_spread[child] = group.cos_spread;
        self.sin_spread[child] = group.sin_spread;
        self.cos_emission[child] = group.cos_emission;
        self.back[child] = group.back;
        self.link[child] = link;
    }

    #[inline(always)]
    fn group(&self, child: usize) -> LightGroup {
        LightGroup {
            center: vec3f(self.center[0][child], self.center[1][child], self.center[2][child]),
            radius: self.radius[child],
            intensity: self.intensity[child],
            axis: vec3f(self.axis[0][child], self.axis[1][child], self.axis[2][child]),
            cos_spread: self.cos_spread[child],
            sin_spread: self.sin_spread[child],
            cos_emission: self.cos_emission[child],
            back: self.back[child],
        }
    }

    /// How much each child promises.
    ///
    /// A plain loop: closures would not be compiled for the instruction set of the kernel that this is a part of.
    #[inline(always)]
    fn importances(&self, p: Vec3f, normal: Vec3f) -> Children<f32> {
        let mut importances = [0.0; WIDTH];
        for (child, importance) in importances.iter_mut().enumerate() {
            *importance = light_importance(self.group(child), p, normal);
        }
        importances
    }

    /// Chooses a child; `u` in `[0, 1)`. With probability 0: none promises anything.
    #[inline(always)]
    fn choose(&self, p: Vec3f, normal: Vec3f, u: f32) -> ChosenChild {
        let importances = self.importances(p, normal);
        let mut before = [0.0; WIDTH];
        for i in 1..WIDTH {
            before[i] = before[i - 1] + importances[i - 1];
        }
        let sum = before[WIDTH - 1] + importances[WIDTH - 1];
        let chosen = u * sum;
        // Children that promise nothing end where they begin, so none of them is the last to begin.
        let mut child = 0;
        for begin in &before[1..] {
            child += usize::from(*begin <= chosen);
        }
        ChosenChild {
            link: self.link[child],
            probability: light_share(importances[child], sum),
            remainder: light_remainder(chosen, before[child], importances[child]),
        }
    }
}

/// A child that was chosen.
struct ChosenChild {
    /// Its link.
    link: u32,
    /// Probability of that.
    probability: f32,
    /// A fresh uniform number in `[0, 1)`.
    remainder: f32,
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
    /// Where each light stands, as long as the lights: eight times the index of its node, plus which child of that it is. `NONE`
    /// for lights that are not in the tree.
    pub places: Vec<u32>,
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
            nodes: Vec::new(),
            places: vec![NONE; lights.len()],
            // What is infinitely far away has a power that depends on how large the scene is: neither may starve.
            probability: if distant > 1e-9 * all { (here / all).clamp(0.2, 0.8) as f32 } else { 1.0 },
        };
        tree.build(&mut placed, NONE, 0);
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
    #[inline(always)]
    pub fn choose(&self, p: Vec3f, normal: Vec3f, u: f32, rest: f32) -> Option<LightChoice> {
        let mut node = self.nodes.first()?;
        let (mut probability, mut u) = (self.probability, u);
        loop {
            let child = node.choose(p, normal, u);
            probability *= child.probability;
            if probability <= 0.0 {
                return None;
            }
            let index = child.link & LIGHT_NODE_INDEX;
            if child.link & LIGHT_NODE_LEAF != 0 {
                let remainder = refill(child.remainder, probability, rest);
                return Some(LightChoice { index, probability, remainder });
            }
            u = child.remainder;
            node = &self.nodes[index as usize];
        }
    }

    /// Probability with which [`LightTree::choose`] takes light `index`, counted as part of all choices of a light.
    #[inline(always)]
    pub fn probability_of(&self, index: u32, p: Vec3f, normal: Vec3f) -> f32 {
        let mut place = self.places[index as usize];
        let mut probability = if place == NONE { 0.0 } else { self.probability };
        while place != NONE {
            let (node, child) = (&self.nodes[place as usize / WIDTH], place as usize % WIDTH);
            let importances = node.importances(p, normal);
            let mut sum = 0.0;
            for importance in importances {
                sum += importance;
            }
            probability *= light_share(importances[child], sum);
            place = node.place;
        }
        probability
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
    /// with n lights there are at most n/2 lowest nodes, and a seventh of that above them.
    pub const fn most_nodes(lights: u64) -> u64 {
        lights.div_ceil(2) * 8 / 7 + 1
    }

    /// Appends a node at `place` and everything below it; `level`: nodes above it. Returns what is known of all its lights.
    fn build(&mut self, leaves: &mut [Leaf], place: u32, level: u32) -> Bounds {
        let at = self.nodes.len();
        self.nodes.push(LightNode { place, ..LightNode::default() });
        let mut all: Option<Bounds> = None;
        for (child, group) in divide(leaves, level).into_iter().enumerate() {
            let place = (at * WIDTH + child) as u32;
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
        // No group is empty.
        all.unwrap_or(leaves[0].bounds)
    }
}

/// Divides lights into as many groups as a node has children. Groups that fit into one node wait until larger ones are divided;
/// among either the one goes first whose lights are brightest and farthest apart.
fn divide(leaves: &mut [Leaf], level: u32) -> Vec<&mut [Leaf]> {
    let mut groups = vec![(extent(leaves), leaves)];
    while groups.len() < WIDTH {
        let divisible = (0..groups.len()).filter(|&i| groups[i].1.len() > 1);
        let next = divisible.max_by(|&a, &b| {
            let size = |i: usize| (groups[i].1.len() > WIDTH, groups[i].0);
            let ((many_a, extent_a), (many_b, extent_b)) = (size(a), size(b));
            many_a.cmp(&many_b).then(extent_a.total_cmp(&extent_b))
        });
        let Some(next) = next else { break };
        let (_, group) = groups.swap_remove(next);
        let levels_needed = group.len().next_power_of_two().trailing_zeros();
        let middle = if level + levels_needed >= MOST_LEVELS { None } else { partition(group) };
        let middle = middle.unwrap_or_else(|| halve(group));
        let (left, right) = group.split_at_mut(middle);
        groups.push((extent(left), left));
        groups.push((extent(right), right));
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// The sum of the lights' intensities times the area of a box around them.
fn extent(leaves: &[Leaf]) -> f32 {
    let low = leaves.iter().fold(Vec3::INFINITY, |low, l| low.min(l.bounds.low));
    let high = leaves.iter().fold(Vec3::NEG_INFINITY, |high, l| high.max(l.bounds.high));
    leaves.iter().map(|l| l.bounds.intensity).sum::<f32>() * area(high - low)
}

/// Area of a box. One on a line or at a point has none; its length must still count.
fn area(size: Vec3) -> f32 {
    2.0 * (size.x * size.y + size.y * size.z + size.z * size.x) + 1e-3 * size.length_squared()
}

/// A light to be put into the tree.
#[derive(Clone, Copy)]
struct Leaf {
    light: u32,
    bounds: Bounds,
    center: Vec3,
    /// Of a sphere around the light, from its centre.
    radius: f32,
}

impl Leaf {
    /// `None` for lights without a place, and for those that do not shine.
    fn new(light: u32, record: &LightRecord) -> Option<Self> {
        let bounds = Bounds::of(record)?;
        let usable = bounds.low.is_finite()
            && bounds.high.is_finite()
            && bounds.intensity.is_finite()
            && bounds.intensity > 0.0;
        let center = (bounds.low + bounds.high) * 0.5;
        let radius = match record.light.kind {
            LIGHT_TRIANGLE | LIGHT_RECTANGLE => {
                corners(&record.light).map(|corner| corner.distance(center)).into_iter().fold(0.0, f32::max)
            }
            LIGHT_SPHERE => record.light.size,
            _ => 0.0,
        };
        usable.then_some(Self { light, bounds, center, radius })
    }
}

/// The corners of a rectangle, or of a triangle, whose last one is there twice.
fn corners(light: &Light) -> [Vec3; 4] {
    let [position, edge1, edge2] =
        [light.position, light.edge1, light.edge2].map(|v| Vec3::from(v.to_array()));
    let fourth = if light.kind == LIGHT_RECTANGLE { edge1 + edge2 } else { edge2 };
    [position, position + edge1, position + edge2, position + fourth]
}

/// Where a group of lights is, and where it shines: as [`LightGroup`], with angles in radians and a box.
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
            LIGHT_TRIANGLE | LIGHT_RECTANGLE => {
                let corners = corners(light);
                let normal = edge1.cross(edge2);
                // Its power knows the mean of its texture.
                let sides = if light.two_sided { 2.0 } else { 1.0 };
                Some(Self {
                    low: corners.into_iter().fold(position, Vec3::min),
                    high: corners.into_iter().fold(position, Vec3::max),
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

    /// What back ends know of the group, whose lights are `leaves`.
    fn group(&self, leaves: &[Leaf]) -> LightGroup {
        let center = (self.low + self.high) * 0.5;
        let radius = leaves.iter().map(|leaf| leaf.center.distance(center) + leaf.radius).fold(0.0, f32::max);
        // Rounding must not make cones narrower, here or where they are used.
        let (sin_spread, cos_spread) = (self.spread + 2e-4).min(PI).sin_cos();
        LightGroup {
            center: vec3(center),
            radius: radius * 1.0001,
            intensity: self.intensity,
            axis: vec3(self.axis),
            cos_spread,
            sin_spread,
            cos_emission: self.emission.cos(),
            back: if self.two_sided { -1.0 } else { 1.0 },
        }
    }

    /// How much a group costs: its intensity, times how large it is, times how many directions it shines into.
    fn cost(&self) -> f32 {
        self.intensity * area(self.high - self.low) * self.solid_angle_measure()
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
    use super::super::rectangles::Rectangle;
    use super::*;

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
                    2 => LightRecord::sphere(p, 0.2, power, false),
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
        for count in [FEWEST_LIGHTS, 100, 10_000] {
            let lights = lights(count);
            let tree = LightTree::new(&lights);
            assert!(
                tree.nodes.len() as u64 <= LightTree::most_nodes(count as u64),
                "{} nodes",
                tree.nodes.len()
            );
            for light in 0..count {
                let place = tree.places[light] as usize;
                let link = tree.nodes[place / WIDTH].link[place % WIDTH];
                assert_eq!(link, LIGHT_NODE_LEAF | light as u32, "of {count} lights");
            }
            for (index, node) in tree.nodes.iter().enumerate().skip(1) {
                let parent = node.place as usize;
                assert_eq!(
                    tree.nodes[parent / WIDTH].link[parent % WIDTH],
                    index as u32,
                    "of {count} lights"
                );
            }
            assert_eq!(tree.nodes[0].place, NONE);
            assert!((0..count as u32).all(|i| tree.contains(i)), "{count} lights");
            assert!(!tree.contains(count as u32), "the sun has no place");
        }
        assert!(LightTree::new(&lights(FEWEST_LIGHTS - 1)).is_empty());
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
