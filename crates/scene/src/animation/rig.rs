//! A hierarchy of nodes that carry objects, and skins whose joints are nodes.

use glam::{DAffine3, DQuat, DVec3};

/// A node: a frame of reference in its parent's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Index of the parent.
    pub parent: Option<u32>,
    /// Position in the parent's frame, metres.
    pub translation: DVec3,
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Along the node's own axes.
    pub scale: DVec3,
    /// Replaces the three above where the file gave a matrix. Such a node cannot be animated.
    pub matrix: Option<DAffine3>,
    /// Whether the node and everything below it is shown.
    pub visible: bool,
}

impl Default for Node {
    fn default() -> Self {
        Self {
            parent: None,
            translation: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            scale: DVec3::ONE,
            matrix: None,
            visible: true,
        }
    }
}

impl Node {
    /// Node to parent.
    pub fn local(&self) -> DAffine3 {
        self.matrix.unwrap_or_else(|| {
            DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
        })
    }
}

/// A hierarchy in its rest pose.
#[derive(Clone, Debug, Default)]
pub struct Rig {
    /// The point of the file's world that the nodes' places are relative to: what the scene of the file alone has as
    /// [`crate::Scene::origin`].
    pub origin: DVec3,
    /// All nodes.
    pub nodes: Vec<Node>,
    /// Their indices, parents before children. What is left out stays at the origin.
    pub order: Vec<u32>,
    /// Sets of joints.
    pub skins: Vec<Skin>,
    /// Weights of morph targets, one list for each node that has them.
    pub weights: Vec<Vec<f32>>,
}

/// Where a node is in the world, and whether it is shown there.
#[derive(Clone, Copy, Debug)]
pub struct NodePose {
    /// Node to world.
    pub world: DAffine3,
    /// The node and all its ancestors are shown.
    pub visible: bool,
}

impl Rig {
    /// From the file's world to what the nodes' places are relative to.
    pub fn root(&self) -> DAffine3 {
        DAffine3::from_translation(-self.origin)
    }

    /// Places all `nodes`, which are this rig's in some pose.
    pub fn place(&self, nodes: &[Node]) -> Vec<NodePose> {
        let root = self.root();
        let mut placed = vec![NodePose { world: root, visible: true }; nodes.len()];
        for index in &self.order {
            let node = &nodes[*index as usize];
            let own = NodePose { world: node.local(), visible: node.visible };
            placed[*index as usize] = match node.parent.map(|p| placed[p as usize]) {
                Some(parent) => {
                    NodePose { world: parent.world * own.world, visible: parent.visible && own.visible }
                }
                None => NodePose { world: root * own.world, ..own },
            };
        }
        placed
    }
}

/// The joints of a skin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// Indices of the joints' nodes.
    pub joints: Vec<u32>,
    /// From the mesh's space to each joint's, in the pose in which the mesh was made.
    pub inverse_bind: Vec<DAffine3>,
}

impl Skin {
    /// From the mesh's space to the world, for each joint. `world` gives a node's place.
    pub fn matrices(&self, world: impl Fn(u32) -> DAffine3) -> Vec<DAffine3> {
        let joints = self.joints.iter().zip(&self.inverse_bind);
        joints.map(|(joint, inverse)| world(*joint) * *inverse).collect()
    }
}
