//! What there is in a scene that costs time wherever rays arrive, and that most scenes do not have.
//!
//! Back ends that make their kernels for a scene leave out the rest.

use super::{
    BindingRecord, GeometryKind, GeometryRecord, MATERIAL_SMOOTH_TERMINATOR, MaterialRecord, SceneTables,
};
use optics::constants::NONE;

impl SceneTables {
    /// Whether any material absorbs light inside of bodies.
    pub fn has_absorption(&self) -> bool {
        self.materials.iter().any(MaterialRecord::absorbs)
    }

    /// Whether any mesh gathers light where the smooth surface would be that its normals stand for.
    pub fn has_smooth_terminators(&self) -> bool {
        self.any_geometry(|geometry, material| {
            geometry.first_normal != NONE && material.flags & MATERIAL_SMOOTH_TERMINATOR != 0
        })
    }

    /// Whether any sphere has holes, or backs that are not there.
    pub fn has_sphere_holes(&self) -> bool {
        self.any_geometry(|geometry, material| geometry.kind == GeometryKind::Spheres && material.has_alpha())
    }

    /// Whether any surface cannot be seen from behind.
    pub fn culls_backs(&self) -> bool {
        self.materials.iter().any(MaterialRecord::culls_backs)
    }

    /// Whether coordinates of spheres' textures are turned where tangents follow them.
    pub fn turns_tangents(&self) -> bool {
        self.materials.iter().any(|m| m.tangent_turn != 0.0)
    }

    /// Whether texels of any texture are half floats.
    pub fn has_half_texels(&self) -> bool {
        self.textures.iter().any(super::TextureUse::is_half)
    }

    /// Whether any texture is a graph.
    pub fn has_graphs(&self) -> bool {
        self.materials.iter().any(MaterialRecord::has_graphs)
    }

    /// Whether there is anything between surfaces that scatters light or shines.
    pub fn has_media(&self) -> bool {
        !self.media.is_empty()
    }

    /// Whether there is anything that light gets into: paths and cameras may be inside.
    pub fn has_bodies(&self) -> bool {
        self.materials.iter().any(MaterialRecord::is_body)
    }

    /// Whether there are ends of media that are no surfaces.
    pub fn has_boundaries(&self) -> bool {
        self.materials.iter().any(MaterialRecord::is_boundary)
    }

    /// Whether paths have to know what they are in: there are media, bodies that overlap, or surfaces that are none.
    pub fn needs_volumes(&self) -> bool {
        self.has_media() || self.nested || self.has_boundaries()
    }

    /// Whether something that belongs to a geometry and a material holds for any instance.
    fn any_geometry(&self, holds: impl Fn(&GeometryRecord, &MaterialRecord) -> bool) -> bool {
        self.instances.iter().any(|instance| {
            let blas = &self.blas[instance.blas as usize];
            let geometries = &self.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
            let bindings = &self.bindings[instance.first_binding as usize..];
            let material = |b: &BindingRecord| &self.materials[b.material as usize];
            geometries.iter().zip(bindings).any(|(geometry, binding)| holds(geometry, material(binding)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{RenderDefaults, ShadowTerminator};
    use crate::{AlphaMode, Instance, Material, Mesh, Scene, Shape, Sphere, TriangleMesh};
    use glam::{Affine3A, Vec3};

    fn holed() -> Material {
        Material { alpha_mode: AlphaMode::Blend, base_color: glam::Vec4::splat(0.5), ..Material::default() }
    }

    fn plate(normals: Vec<Vec3>) -> Shape {
        let positions = vec![Vec3::ZERO, Vec3::Z, Vec3::X];
        Shape::Triangles(TriangleMesh {
            positions,
            normals,
            indices: vec![[0, 1, 2]],
            ..TriangleMesh::default()
        })
    }

    /// A ball and a plate, each with a material of its own, of which the second one may move.
    fn tables(ball: Material, normals: Vec<Vec3>, plate_is: Material, dynamic: bool) -> SceneTables {
        let sphere = Shape::Spheres(vec![Sphere { center: Vec3::ONE, radius: 1.0 }]);
        let mut scene = Scene { materials: vec![ball, plate_is], ..Scene::default() };
        for (mesh, (name, shape)) in (0..).zip([("ball", sphere), ("plate", plate(normals))]) {
            scene.meshes.push(Mesh::single(name, shape, mesh));
            let instance = Instance::new(name, mesh, Affine3A::IDENTITY);
            scene.instances.push(Instance { dynamic: dynamic && mesh == 1, ..instance });
        }
        scene.defaults =
            RenderDefaults { shadow_terminator: Some(ShadowTerminator::Smooth), ..RenderDefaults::default() };
        SceneTables::build(&scene)
    }

    #[test]
    fn holes_of_plates_are_none_of_spheres() {
        for dynamic in [false, true] {
            let of_plate = tables(Material::default(), Vec::new(), holed(), dynamic);
            assert!(of_plate.has_alpha && !of_plate.has_sphere_holes());
            let of_ball = tables(holed(), Vec::new(), Material::default(), dynamic);
            assert!(of_ball.has_alpha && of_ball.has_sphere_holes());
        }
    }

    #[test]
    fn terminators_need_normals_and_a_material_of_the_same_geometry() {
        let glass = || Material { transmission: 1.0, ..Material::default() };
        let tilted = || vec![Vec3::new(0.3, 1.0, 0.0).normalize(), Vec3::Y, Vec3::Y];
        for dynamic in [false, true] {
            let of = |normals, material| tables(Material::default(), normals, material, dynamic);
            assert!(of(tilted(), Material::default()).has_smooth_terminators());
            assert!(!of(vec![Vec3::Y; 3], Material::default()).has_smooth_terminators(), "it is flat");
            assert!(!of(Vec::new(), Material::default()).has_smooth_terminators(), "there are no normals");
            assert!(!of(tilted(), glass()).has_smooth_terminators(), "only the ball's material asks for one");
        }
    }
}
