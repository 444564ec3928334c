//! Three-dimensional boxes around instances.

use alhazen::Scene;
use glam::Vec3;

/// A box around an instance, in world space: the box of its mesh, moved as the instance is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBox {
    /// Its centre, metres.
    pub center: Vec3,
    /// From the centre to the middles of three faces, metres. Perpendicular to each other unless the instance is sheared.
    pub half_axes: [Vec3; 3],
}

impl ObjectBox {
    /// Its corners, metres; bit `k` of a corner's number says on which side it is along axis `k`.
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let along = |k: usize| if i >> k & 1 == 0 { -self.half_axes[k] } else { self.half_axes[k] };
            self.center + along(0) + along(1) + along(2)
        })
    }

    /// Full extents along its axes, metres.
    pub fn size(&self) -> Vec3 {
        Vec3::from(self.half_axes.map(|a| 2.0 * a.length()))
    }
}

/// The box around instance number `instance`; `None` if there is no such instance, or nothing in it.
pub fn object_box(scene: &Scene, instance: usize) -> Option<ObjectBox> {
    let instance = scene.instances.get(instance)?;
    let (low, high) = scene.meshes.get(instance.mesh as usize)?.bounds()?;
    let half = (high - low) * 0.5;
    let axis = |k: usize| {
        let mut axis = Vec3::ZERO;
        axis[k] = half[k];
        instance.transform.transform_vector3(axis)
    };
    Some(ObjectBox {
        center: instance.transform.transform_point3((low + high) * 0.5),
        half_axes: [axis(0), axis(1), axis(2)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::{Instance, Mesh, Shape, Sphere};
    use glam::{Affine3A, Quat};

    #[test]
    fn boxes_turn_with_their_instances() {
        let mut scene = Scene::default();
        let ball = Shape::Spheres(vec![Sphere { center: Vec3::new(1.0, 0.0, 0.0), radius: 0.5 }]);
        scene.meshes.push(Mesh::single("ball", ball, 0));
        let turn = Affine3A::from_scale_rotation_translation(
            Vec3::new(2.0, 1.0, 1.0),
            Quat::from_rotation_z(std::f32::consts::FRAC_PI_2),
            Vec3::new(0.0, 0.0, 5.0),
        );
        scene.instances.push(Instance::new("ball", 0, turn));
        let found = object_box(&scene, 0).expect("a box");
        assert!(found.center.distance(Vec3::new(0.0, 2.0, 5.0)) < 1e-6, "{found:?}");
        assert!(found.size().distance(Vec3::new(2.0, 1.0, 1.0)) < 1e-6);
        assert!(found.half_axes[0].distance(Vec3::Y) < 1e-6, "the long axis turned from x to y");
        let [low, high] =
            [Vec3::min, Vec3::max].map(|f| found.corners().into_iter().reduce(f).expect("eight"));
        assert!(
            low.distance(Vec3::new(-0.5, 1.0, 4.5)) < 1e-6 && high.distance(Vec3::new(0.5, 3.0, 5.5)) < 1e-6
        );
        assert_eq!(object_box(&scene, 1), None);
    }
}
