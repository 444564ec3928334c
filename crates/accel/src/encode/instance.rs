//! Instances as shaders read them.

use super::object::EncodedObject;
use crate::aabb::Aabb;
use crate::build::PrimitiveRef;
use crate::bvh::{Instance, InstanceMotions, inverse, motion_bounds};
use bytemuck::{Pod, Zeroable};

/// Bit of [`EncodedInstance::flags`]: object space is world space.
pub const INSTANCE_IDENTITY: u32 = 1;
/// Bit of [`EncodedInstance::flags`]: the primitives are spheres.
pub const INSTANCE_SPHERES: u32 = 2;

/// An instance: what a traversal needs to enter its object.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct EncodedInstance {
    /// Rows of the 3×4 matrix that maps world space to object space.
    pub world_to_object: [[f32; 4]; 3],
    /// The largest magnitude of a coordinate of the object, by axis.
    pub extent: [f32; 3],
    /// Index of the root node, or `u32::MAX` if the object is empty.
    pub root: u32,
    /// Index of the instance in the scene.
    pub index: u32,
    /// [`INSTANCE_IDENTITY`] and [`INSTANCE_SPHERES`].
    pub flags: u32,
    /// Padding.
    pub unused: [u32; 2],
}

impl EncodedInstance {
    /// The record of the world, whose root is that of the top level.
    pub(super) fn world(bounds: Aabb) -> EncodedInstance {
        EncodedInstance {
            world_to_object: Instance::IDENTITY,
            extent: bounds.extent(),
            root: if bounds.is_empty() { u32::MAX } else { 0 },
            index: u32::MAX,
            flags: INSTANCE_IDENTITY,
            unused: [0; 2],
        }
    }

    pub(super) fn is_identity(&self) -> bool {
        self.flags & INSTANCE_IDENTITY != 0
    }
}

/// The records of all instances that can be hit, and references to them.
pub(super) fn encode_instances(
    instances: &[Instance],
    motions: &InstanceMotions,
    objects: &[EncodedObject],
) -> (Vec<PrimitiveRef>, Vec<EncodedInstance>) {
    let mut refs = Vec::with_capacity(instances.len());
    let mut encoded = Vec::with_capacity(instances.len());
    for (index, instance) in (0..).zip(instances) {
        let object = &objects[instance.blas as usize];
        let motion = motions.of(index as usize);
        let is_identity = motion.is_empty() && instance.object_to_world == Instance::IDENTITY;
        let Some(world_to_object) = inverse(&instance.object_to_world) else { continue };
        let bounds = if is_identity {
            object.bounds
        } else if !motion.is_empty() {
            motion_bounds(motion, &object.bounds, |rows| object.tight_bounds.transformed(rows))
        } else {
            object.tight_bounds.transformed(&instance.object_to_world)
        };
        let finite = bounds.min.iter().chain(&bounds.max).all(|c| c.is_finite());
        if instance.mask == 0 || object.bounds.is_empty() || !finite {
            continue;
        }
        refs.push(PrimitiveRef::new(&bounds, encoded.len() as u32, 0));
        let mut flags = 0;
        if is_identity {
            flags |= INSTANCE_IDENTITY;
        }
        if object.has_spheres {
            flags |= INSTANCE_SPHERES;
        }
        let (extent, root) = (object.bounds.extent(), object.root);
        encoded.push(EncodedInstance { world_to_object, extent, root, index, flags, unused: [0; 2] });
    }
    (refs, encoded)
}
