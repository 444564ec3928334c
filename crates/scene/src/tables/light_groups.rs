//! How lights are divided into the groups that are a node's children.
//!
//! Costs are those of Conty Estévez and Kulla 2018 as in Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition,
//! section 12.6.3. Nodes have eight children, of which the groups that are largest are divided first.

use super::light_bounds::{Bounds, Leaf, area};
use glam::Vec3;
use optics::light_node::NODE_WIDTH;

/// Levels below the root: from there on groups are halved, so that no walk is long.
const MOST_LEVELS: u32 = 32;

/// Planes between which groups are divided, for each axis.
const BINS: usize = 12;

/// Groups of more lights are divided by place alone: what it costs to look at their directions grows faster than the gain.
const MOST_COMPARED: usize = 4096;

/// Divides lights into as many groups as a node has children. Groups that fit into one node wait until larger ones are divided;
/// among either the one goes first whose lights are brightest and farthest apart.
pub(super) fn divide(leaves: &mut [Leaf], level: u32) -> Vec<&mut [Leaf]> {
    let mut groups = vec![(extent(leaves), leaves)];
    while groups.len() < NODE_WIDTH {
        let divisible = (0..groups.len()).filter(|&i| groups[i].1.len() > 1);
        let next = divisible.max_by(|&a, &b| {
            let size = |i: usize| (groups[i].1.len() > NODE_WIDTH, groups[i].0);
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
