//! Checks that a tree is well-formed.

use crate::aabb::Aabb;
use crate::layout::{ChildRef, EMPTY, LEAF, MAX_DEPTH, Node, WIDTH, leaf_index};

/// Checks a tree over leaves with these bounds: every reference is valid, every node and leaf is
/// reached once, and every box contains what is below it.
pub(crate) fn validate_tree(nodes: &[Node], root: ChildRef, leaves: &[Aabb]) -> Result<(), String> {
    let mut seen_nodes = vec![false; nodes.len()];
    let mut seen_leaves = vec![false; leaves.len()];
    let everything = Aabb { min: [f32::NEG_INFINITY; 3], max: [f32::INFINITY; 3] };
    let mut open = vec![(root, everything, 1)];
    while let Some((child, bounds, depth)) = open.pop() {
        if child == EMPTY {
            continue;
        }
        let is_leaf = child & LEAF != 0;
        let index = if is_leaf { leaf_index(child) } else { child as usize };
        let seen = if is_leaf { &mut seen_leaves } else { &mut seen_nodes };
        match seen.get_mut(index) {
            None => return Err(format!("reference {child:#x} is out of range")),
            Some(true) => return Err(format!("reference {child:#x} occurs twice")),
            Some(first) => *first = true,
        }
        if is_leaf {
            if !leaves[index].is_empty() && !bounds.contains(&leaves[index]) {
                return Err(format!(
                    "leaf {index} is not inside its box: {:?} not in {bounds:?}",
                    leaves[index]
                ));
            }
            continue;
        }
        if depth > MAX_DEPTH {
            return Err(format!("node {index} is at depth {depth}"));
        }
        for slot in 0..WIDTH {
            let b = nodes[index].bounds(slot);
            let child = nodes[index].children[slot];
            if child != EMPTY && !b.is_empty() && !bounds.contains(&b) {
                return Err(format!("child {slot} of node {index} is not inside its box"));
            }
            if child == EMPTY && !b.is_empty() {
                return Err(format!("unused child {slot} of node {index} has a box"));
            }
            open.push((child, b, depth + 1));
        }
    }
    if !seen_nodes.iter().chain(&seen_leaves).all(|&seen| seen) {
        return Err("some nodes or leaves are unreachable".into());
    }
    Ok(())
}
