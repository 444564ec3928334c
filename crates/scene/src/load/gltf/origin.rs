//! Where the scene of a file is, before it is built: files in geographic coordinates are far from their origin.

use super::document::Document;
use super::json::{Accessor, Primitive};
use super::nodes::Hierarchy;
use crate::origin::Bounds;
use glam::{DAffine3, DVec3};

/// The component type of floating point numbers.
const FLOAT: u32 = 5126;

impl Document<'_> {
    /// The point that the scene should be stored relative to, from the bounds that its accessors declare. A file that
    /// declares wrong ones gets a worse point, and the same picture.
    pub fn origin(&self, hierarchy: &Hierarchy) -> DVec3 {
        let mut bounds = Bounds::default();
        for placed in &hierarchy.placed {
            let node = &self.json.nodes[placed.node as usize];
            let Some(mesh) = node.mesh.and_then(|mesh| self.json.meshes.get(mesh as usize)) else { continue };
            let world = hierarchy.worlds[placed.node as usize];
            let skin = node.skin.and_then(|skin| self.skin(skin).ok());
            let worlds = match (skin, &node.extensions.instancing) {
                (Some(skin), _) => skin.matrices(|joint| hierarchy.worlds[joint as usize]),
                (None, Some(instancing)) => {
                    let transforms = self.instance_transforms(instancing, placed.node).unwrap_or_default();
                    transforms.into_iter().map(|transform| world * transform).collect()
                }
                (None, None) => vec![world],
            };
            let mut own = Bounds::default();
            mesh.primitives.iter().for_each(|primitive| self.add_declared(primitive, &mut own));
            let (low, high) = own.corners().unwrap_or_default();
            worlds.iter().for_each(|world: &DAffine3| bounds.add_box(world, low, high));
        }
        bounds.anchor()
    }

    /// Adds the bounds that the accessor of a primitive's positions declares.
    fn add_declared(&self, primitive: &Primitive, bounds: &mut Bounds) {
        let accessor = primitive.attributes.get("POSITION");
        let accessor = accessor.and_then(|index| self.json.accessors.get(*index as usize));
        let declared = |a: &Accessor| Some([a.min.0?, a.max.0?].map(DVec3::from_array));
        let Some(corners) = accessor.and_then(declared) else { return };
        // Integers that stand for fractions are at most 1.
        let fractions = accessor.is_some_and(|a| a.normalized && a.component_type != FLOAT);
        for corner in corners {
            bounds.add(if fractions { corner.clamp(-DVec3::ONE, DVec3::ONE) } else { corner });
        }
    }
}

impl Hierarchy {
    /// Makes the places of all nodes relative to `origin`.
    pub fn set_origin(&mut self, origin: DVec3) {
        self.origin = origin;
        if origin != DVec3::ZERO {
            self.worlds.iter_mut().for_each(|world| world.translation -= origin);
        }
    }
}
