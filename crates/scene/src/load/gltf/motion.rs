//! What of a file moves in any of its animations. Everything else is loaded as if there were none.

use super::animations::{FileClip, FileTarget, NodeValue};
use super::document::Document;
use super::nodes::Hierarchy;

/// Which nodes move, and which meshes change their shape.
#[derive(Default)]
pub(super) struct Motion {
    /// The node or an ancestor moves or is not always shown. Empty: none.
    moves: Vec<bool>,
    /// The weights of the node's morph targets change. Empty: none.
    morphs: Vec<bool>,
}

impl Motion {
    pub fn new(document: &Document<'_>, clips: &[FileClip], hierarchy: &Hierarchy) -> Self {
        if clips.is_empty() {
            return Self::default();
        }
        let nodes = &document.json.nodes;
        let mut motion = Self { moves: vec![false; nodes.len()], morphs: vec![false; nodes.len()] };
        for channel in clips.iter().flat_map(|clip| &clip.channels) {
            match channel.target {
                FileTarget::Node(node, NodeValue::Weights(_)) => motion.morphs[node as usize] = true,
                FileTarget::Node(node, _) => motion.moves[node as usize] = true,
                FileTarget::Mesh(mesh, _) => {
                    let users = nodes.iter().map(|n| n.mesh == Some(mesh) && n.weights.is_none());
                    motion.morphs.iter_mut().zip(users).for_each(|(morphs, uses)| *morphs |= uses);
                }
                FileTarget::Material(..) | FileTarget::Light(..) | FileTarget::Camera(..) => {}
            }
        }
        for index in &hierarchy.order {
            let parent = hierarchy.nodes[*index as usize].parent;
            motion.moves[*index as usize] |= parent.is_some_and(|p| motion.moves[p as usize]);
        }
        motion
    }

    /// Whether the node is not always where it is at rest.
    pub fn moves(&self, node: u32) -> bool {
        self.moves.get(node as usize).copied().unwrap_or(false)
    }

    /// Whether the node's mesh changes its shape by morph targets.
    pub fn morphs(&self, node: u32) -> bool {
        self.morphs.get(node as usize).copied().unwrap_or(false)
    }
}
