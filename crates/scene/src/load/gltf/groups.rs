//! What is left of the node hierarchy for people: the nodes that objects are below.

use super::document::Document;
use super::nodes::{Hierarchy, NONE};
use crate::{Groups, LoadError};

impl Document<'_> {
    /// Every node that has objects below it, or several of its own, is a group.
    ///
    /// - `carriers`: the node of each instance.
    ///
    /// # Errors
    /// The budget is spent.
    pub fn groups(&self, hierarchy: &Hierarchy, carriers: &[u32]) -> Result<Groups, LoadError> {
        let parents = &hierarchy.parents;
        let mut objects = vec![0u32; parents.len()];
        carriers.iter().for_each(|node| objects[*node as usize] += 1);
        let mut is_group = vec![false; parents.len()];
        // Children come after their parents, so what is below a node is known before the node's turn.
        let mut holds: Vec<bool> = objects.iter().map(|count| *count > 0).collect();
        for node in hierarchy.placed.iter().rev().map(|placed| placed.node as usize) {
            is_group[node] |= objects[node] > 1;
            if holds[node] && parents[node] != NONE {
                let parent = parents[node] as usize;
                (holds[parent], is_group[parent]) = (true, true);
            }
        }
        let mut groups = Groups::default();
        let mut numbers = vec![None; parents.len()];
        for node in hierarchy.placed.iter().map(|placed| placed.node as usize) {
            let parent = numbers.get(parents[node] as usize).copied().flatten();
            numbers[node] = match is_group[node] {
                true => Some(groups.add(self.group_name(node), parent)),
                false => parent,
            };
        }
        for (instance, node) in carriers.iter().enumerate() {
            groups.put(instance as u32, numbers[*node as usize]);
        }
        self.options.budget().take(groups.bytes(), "groups of nodes")?;
        Ok(groups)
    }

    fn group_name(&self, node: usize) -> String {
        let mesh = self.json.nodes[node].mesh.and_then(|mesh| self.json.meshes.get(mesh as usize));
        self.node_name(node as u32, mesh.and_then(|mesh| mesh.name.as_deref()))
    }
}
