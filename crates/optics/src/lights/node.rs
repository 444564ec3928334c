//! A node of the tree of lights, and the choice among its children.

use crate::light_tree::{
    LIGHT_NODE_INDEX, LIGHT_NODE_WIDTH, LIGHT_NODE_WORDS, LightGroup, NodeImportance, child_choice_add,
    child_choice_none, child_remainder, child_weight, light_importance, light_share, node_importance_add,
    node_importance_zero, node_weight,
};
use bytemuck::NoUninit;
use wgsl_rs::std::{Vec3f, vec3f};

/// Children of a node.
pub const NODE_WIDTH: usize = LIGHT_NODE_WIDTH as usize;

/// One number for each child of a node.
pub type Children<T> = [T; NODE_WIDTH];

/// One node, as back ends read it; `LIGHT_NODE_WORDS` words. What is known of its children is kept as it is needed, so that a
/// loop over them has nothing to decode. Children that there are not have no intensity.
#[derive(Clone, Copy, Debug, Default, PartialEq, NoUninit)]
#[repr(C)]
pub struct LightNode {
    /// See [`LightGroup::center`]; x of all children, y, z.
    center: [Children<f32>; 3],
    /// See [`LightGroup::radius`].
    radius: Children<f32>,
    /// See [`LightGroup::intensity`].
    pub intensity: Children<f32>,
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
    pub link: Children<u32>,
    /// Where the node stands: eight times the index of its parent, plus which child of that it is. `NONE`: it is the root.
    pub place: u32,
}

const _: () = assert!(size_of::<LightNode>() == 4 * LIGHT_NODE_WORDS as usize);

impl LightNode {
    /// A node without children that stands at `place`.
    pub fn at(place: u32) -> Self {
        Self { place, ..Self::default() }
    }

    /// Says what is known of a child, and what it is: `LIGHT_NODE_LEAF` or not, and an index.
    pub fn set(&mut self, child: usize, group: &LightGroup, link: u32) {
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

    /// What is known of a child.
    #[inline(always)]
    pub fn group(&self, child: usize) -> LightGroup {
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

    /// Index of the light that a child is, of a node without nodes below it.
    #[inline(always)]
    pub fn light(&self, child: u32) -> u32 {
        self.link[child as usize] & LIGHT_NODE_INDEX
    }

    /// How much each child promises.
    ///
    /// A plain loop: closures would not be compiled for the instruction set of the kernel that this is a part of.
    #[inline(always)]
    pub fn importances(&self, p: Vec3f, normal: Vec3f) -> (Children<f32>, NodeImportance) {
        let mut importances = [0.0; NODE_WIDTH];
        for (child, importance) in importances.iter_mut().enumerate() {
            *importance = light_importance(self.group(child), p, normal);
        }
        let mut node = node_importance_zero();
        for importance in importances {
            node = node_importance_add(node, importance);
        }
        (importances, node)
    }

    /// Chooses a child; `u` in `[0, 1)`; `defends`: see [`child_weight`]. With probability 0: none promises anything.
    #[inline(always)]
    pub fn choose(&self, p: Vec3f, normal: Vec3f, defends: bool, u: f32) -> ChosenChild {
        let (importances, node) = self.importances(p, normal);
        let sum = node_weight(node, defends);
        let mut choice = child_choice_none();
        for (child, importance) in (0..).zip(importances) {
            choice = child_choice_add(choice, child, child_weight(importance, node, defends), u * sum);
        }
        ChosenChild {
            link: self.link[choice.child as usize],
            probability: light_share(choice.weight, sum),
            remainder: child_remainder(choice, u * sum),
        }
    }
}

/// A child that was chosen.
pub struct ChosenChild {
    /// Its link.
    pub link: u32,
    /// Probability of that.
    pub probability: f32,
    /// A fresh uniform number in `[0, 1)`.
    pub remainder: f32,
}
