//! The node hierarchy, flattened: world transforms of all nodes, and which of them are in the scene.

use super::document::Document;
use super::json::{Node, Scene};
use crate::animation;
use crate::{LoadError, LoadReport};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// A node that is part of the scene.
#[derive(Clone, Copy)]
pub(super) struct VisitedNode {
    /// Index of the node.
    pub node: u32,
    /// Neither the node nor an ancestor is switched off.
    pub visible: bool,
}

/// All nodes in world space.
pub(super) struct Hierarchy {
    /// What `worlds` is relative to.
    pub origin: DVec3,
    /// Node to world, for every node of the file: joints need not be in the scene.
    pub worlds: Vec<DAffine3>,
    /// Every node as animations move it; empty where nothing is animated.
    pub nodes: Vec<animation::Node>,
    /// The parent of every node; [`NONE`] where there is none.
    pub parents: Vec<u32>,
    /// All nodes, parents before children.
    pub order: Vec<u32>,
    /// The nodes of the scene, parents before children, children in file order.
    pub placed: Vec<VisitedNode>,
}

/// Objects that nodes carry, each with its number in the file and what moves it.
pub(super) struct Carried<O, C> {
    pub objects: Vec<O>,
    pub carriers: Vec<(u32, C)>,
}

/// No node.
pub(super) const NONE: u32 = u32::MAX;

impl Document<'_> {
    /// The scene that is shown: the default one, or else the first. `None`: all root nodes.
    ///
    /// # Errors
    /// The default scene does not exist.
    pub fn shown_scene(&self, report: &mut LoadReport) -> Result<Option<&Scene>, LoadError> {
        let scenes = &self.json.scenes;
        let index = self.json.scene.unwrap_or(0);
        if scenes.len() > 1 {
            report.info(format!("the file has {} scenes, only number {index} is shown", scenes.len()));
        }
        match self.json.scene {
            Some(index) if !self.options.lenient => self.get(scenes, index, "scene").map(Some),
            _ => Ok(scenes.get(index as usize).or(scenes.first())),
        }
    }

    /// Flattens the hierarchy.
    ///
    /// # Errors
    /// A node that does not exist, has two parents or is its own ancestor.
    pub fn hierarchy(&self, scene: Option<&Scene>, report: &mut LoadReport) -> Result<Hierarchy, LoadError> {
        let parents = self.parents(report)?;
        let (worlds, order) = self.worlds(&parents, report)?;
        let mut nodes = Vec::new();
        if !self.json.animations.is_empty() {
            let all = self.json.nodes.iter().zip(&parents);
            nodes.extend(all.map(|(node, parent)| own_frame(node, *parent, &mut LoadReport::default())));
        }
        let all_roots: Vec<u32>;
        let roots = match scene {
            Some(scene) => &scene.nodes[..],
            None => {
                all_roots = (0..parents.len() as u32).filter(|i| parents[*i as usize] == NONE).collect();
                &all_roots
            }
        };
        let placed = self.placed(roots, &parents, report)?;
        Ok(Hierarchy { origin: DVec3::ZERO, worlds, nodes, parents, order, placed })
    }

    fn parents(&self, report: &mut LoadReport) -> Result<Vec<u32>, LoadError> {
        let nodes = &self.json.nodes;
        let mut parents = vec![NONE; nodes.len()];
        for (index, node) in nodes.iter().enumerate() {
            for child in node.children.iter() {
                self.get(nodes, *child, "node")?;
                let parent = &mut parents[*child as usize];
                if *parent == NONE {
                    *parent = index as u32;
                } else if self.options.lenient {
                    report.repaired("a node is a child of two others: only the first counts");
                } else {
                    let message = format!("is a child of node {parent} and again of node {index}");
                    return Err(self.malformed(format!("node {child}"), message));
                }
            }
        }
        Ok(parents)
    }

    /// The worlds of all nodes, and their indices, parents before children.
    fn worlds(
        &self,
        parents: &[u32],
        report: &mut LoadReport,
    ) -> Result<(Vec<DAffine3>, Vec<u32>), LoadError> {
        let nodes = &self.json.nodes;
        let mut worlds = vec![DAffine3::IDENTITY; nodes.len()];
        let mut order = Vec::with_capacity(nodes.len());
        let mut reached = vec![false; nodes.len()];
        let mut stack: Vec<u32> = (0..nodes.len() as u32).filter(|i| parents[*i as usize] == NONE).collect();
        while let Some(index) = stack.pop() {
            let node = &nodes[index as usize];
            let parent = parents[index as usize];
            let base = if parent == NONE { DAffine3::IDENTITY } else { worlds[parent as usize] };
            worlds[index as usize] = base * own_frame(node, parent, report).local();
            reached[index as usize] = true;
            order.push(index);
            stack.extend(own_children(node, index, parents).filter(|c| !reached[*c as usize]));
        }
        match reached.iter().position(|r| !r) {
            Some(index) => {
                Err(self.malformed(format!("node {index}"), "is its own ancestor or below such a node"))
            }
            None => Ok((worlds, order)),
        }
    }

    fn placed(
        &self,
        roots: &[u32],
        parents: &[u32],
        report: &mut LoadReport,
    ) -> Result<Vec<VisitedNode>, LoadError> {
        let nodes = &self.json.nodes;
        let mut seen = vec![false; nodes.len()];
        let mut placed = Vec::new();
        let mut stack = Vec::new();
        for root in roots.iter().rev() {
            self.get(nodes, *root, "node")?;
            if parents[*root as usize] != NONE {
                report.repaired("the scene lists a node that is a child of another");
            }
            stack.push(VisitedNode { node: *root, visible: true });
        }
        while let Some(VisitedNode { node: index, visible }) = stack.pop() {
            if std::mem::replace(&mut seen[index as usize], true) {
                report.repaired("the scene lists a node twice");
                continue;
            }
            let node = &nodes[index as usize];
            let own = node.extensions.visibility.as_ref().and_then(|v| v.visible).unwrap_or(true);
            let here = VisitedNode { node: index, visible: visible && own };
            placed.push(here);
            let children = own_children(node, index, parents);
            stack.extend(children.rev().map(|node| VisitedNode { node, ..here }));
        }
        Ok(placed)
    }

    /// The node's name, its object's, or its number.
    pub fn node_name(&self, index: u32, object: Option<&str>) -> String {
        let own = self.json.nodes[index as usize].name.as_deref().filter(|n| !n.is_empty());
        own.or(object.filter(|n| !n.is_empty())).map_or_else(|| format!("node {index}"), str::to_owned)
    }
}

/// The children that count this node as their parent.
fn own_children<'n>(
    node: &'n Node,
    index: u32,
    parents: &'n [u32],
) -> impl DoubleEndedIterator<Item = u32> + 'n {
    node.children.iter().copied().filter(move |child| parents[*child as usize] == index)
}

/// The node as animations move it.
fn own_frame(node: &Node, parent: u32, report: &mut LoadReport) -> animation::Node {
    let parent = (parent != NONE).then_some(parent);
    let visible = node.extensions.visibility.as_ref().and_then(|v| v.visible).unwrap_or(true);
    if let Some(m) = &node.matrix {
        if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
            report.repaired("a node's matrix is not affine: its last row is taken as (0, 0, 0, 1)");
        }
        let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
        let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
        let matrix = Some(DAffine3 { matrix3, translation: column(3) });
        return animation::Node { parent, matrix, visible, ..animation::Node::default() };
    }
    animation::Node {
        parent,
        translation: node.translation.map_or(DVec3::ZERO, DVec3::from_array),
        rotation: node.rotation.map_or(DQuat::IDENTITY, |r| unit(DQuat::from_array(r), report)),
        scale: node.scale.map_or(DVec3::ONE, DVec3::from_array),
        matrix: None,
        visible,
    }
}

/// The rotation without its scale.
pub(super) fn unit(rotation: DQuat, report: &mut LoadReport) -> DQuat {
    let length = rotation.length();
    if !(length - 1.0).abs().le(&0.02) {
        report.repaired("a rotation is not a unit quaternion");
    }
    if length.is_finite() && length > 0.0 { rotation / length } else { DQuat::IDENTITY }
}
