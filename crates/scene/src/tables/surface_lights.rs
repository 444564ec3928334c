//! Lights of surfaces that emit.

use super::light_pictures::mean_of_image;
use super::material::{MATERIAL_CHECKERBOARD_FADES, MATERIAL_EMISSION_TWO_SIDED};
use super::rectangles::{self, Pairing};
use super::transform::{affine, uniform_scale};
use super::{GeometryKind, GeometryRecord, InstanceRecord, LightRecord, MaterialRecord, SceneTables};
use crate::Scene;
use glam::{Affine3A, Vec3};
use optics::Vec3f;
use optics::constants::NONE;
use optics::material::SLOT_EMISSION;
use optics::motion::MotionSegment;

impl SceneTables {
    /// Lights of the emissive geometries of one instance.
    pub(super) fn add_surface_lights(&mut self, scene: &Scene, instance: usize) {
        // What changes shape on its way is no rectangle, and no sphere, all the time.
        let keeps_shapes = self.instance_segments(instance).iter().all(MotionSegment::keeps_shapes);
        let instance = self.instances[instance];
        let blas = self.blas[instance.blas as usize];
        for g in 0..blas.geometry_count {
            let binding = (instance.first_binding + g) as usize;
            let material = self.materials[self.bindings[binding].material as usize];
            if !material.is_emissive() {
                continue;
            }
            let to_world = affine(&instance.object_to_world);
            let geometry = self.geometries[(blas.first_geometry + g) as usize];
            // Holes by vertex colour or by place are not known to a light record: paths find such light by themselves.
            let unknown_holes =
                geometry.first_color != NONE || material.flags & MATERIAL_CHECKERBOARD_FADES != 0;
            let unknown_colors = geometry.first_color != NONE && material.has_graphs();
            if (material.has_holes() && unknown_holes) || unknown_colors {
                continue;
            }
            match geometry.kind {
                GeometryKind::Triangles => {
                    let mean = self.mean_emission_texture(scene, &geometry, binding);
                    self.add_triangle_lights(&geometry, &to_world, binding, keeps_shapes, mean);
                }
                // An ellipsoid cannot be sampled by solid angle: it shines where paths find it by themselves.
                GeometryKind::Spheres => {
                    if let Some(scale) = uniform_scale(&to_world).filter(|_| keeps_shapes) {
                        let mean = self.mean_emission_texture(scene, &geometry, binding);
                        self.add_sphere_lights(&geometry, &instance, scale, binding, mean);
                    }
                }
            }
        }
    }

    /// Lights of a geometry's spheres, which `instance` scales alike in all directions. `mean`: of its emission's texture.
    fn add_sphere_lights(
        &mut self,
        geometry: &GeometryRecord,
        instance: &InstanceRecord,
        scale: f32,
        binding: usize,
        mean: f32,
    ) {
        let bound = self.bindings[binding];
        let material = self.materials[bound.material as usize];
        let emission = Vec3::from(material.emission.to_array());
        let two_sided = material.flags & MATERIAL_EMISSION_TWO_SIDED != 0;
        let to_world = affine(&instance.object_to_world);
        // What is moved into world space has the identity there.
        let to_object = *self.placement(&bound).unwrap_or(&instance.world_to_object);
        self.bindings[binding].first_light = self.primitive_lights.len() as u32;
        for i in 0..geometry.primitive_count {
            let [x, y, z, r] = self.spheres[(geometry.first_primitive + i) as usize];
            let center = to_world.transform_point3(Vec3::new(x, y, z));
            let mut light = LightRecord::sphere(center, r * scale, emission, two_sided, mean);
            if is_textured(&material) {
                light.textured_material = bound.material;
                light.texture_places[..12].copy_from_slice(to_object.as_flattened());
            }
            self.add_primitive_light(light);
        }
    }

    /// Appends the light of the next primitive.
    fn add_primitive_light(&mut self, light: LightRecord) {
        self.primitive_lights.push(self.lights.len() as u32);
        self.lights.push(light);
    }

    /// Lights of a geometry's triangles, of which two may be one rectangle if `may_pair`.
    fn add_triangle_lights(
        &mut self,
        geometry: &GeometryRecord,
        to_world: &Affine3A,
        binding: usize,
        may_pair: bool,
        mean: f32,
    ) {
        let material = self.materials[self.bindings[binding].material as usize];
        let first_light = self.primitive_lights.len() as u32;
        self.bindings[binding].first_light = first_light;
        // A texture has coordinates at three corners.
        let parts = if is_textured(&material) || !may_pair {
            vec![Pairing::Alone; geometry.primitive_count as usize]
        } else {
            rectangles::pair(self, geometry, to_world)
        };
        for (i, part) in (0..).zip(parts) {
            match part {
                Pairing::Alone => {
                    let light = self.triangle_light(geometry, i, to_world, binding, mean);
                    self.add_primitive_light(light);
                }
                Pairing::Rectangle(rectangle) => {
                    let emission = Vec3::from(material.emission.to_array());
                    let two_sided = material.flags & MATERIAL_EMISSION_TWO_SIDED != 0;
                    self.add_primitive_light(LightRecord::rectangle(&rectangle, emission, two_sided));
                }
                Pairing::HalfOf(other) => {
                    let light = self.primitive_lights[(first_light + other) as usize];
                    self.primitive_lights.push(light);
                }
            }
        }
    }

    /// The light of triangle `i` of a geometry. `mean`: of its emission's texture.
    fn triangle_light(
        &self,
        geometry: &GeometryRecord,
        i: u32,
        to_world: &Affine3A,
        binding: usize,
        mean: f32,
    ) -> LightRecord {
        let index = self.bindings[binding].material;
        let material = &self.materials[index as usize];
        let mut corners = self.indices[(geometry.first_primitive + i) as usize];
        if to_world.matrix3.determinant() < 0.0 {
            corners.swap(1, 2);
        }
        let vertex = |c: u32| {
            to_world.transform_point3(Vec3::from(self.positions[(geometry.first_vertex + c) as usize]))
        };
        let two_sided = material.flags & MATERIAL_EMISSION_TWO_SIDED != 0;
        let emission = Vec3::from(material.emission.to_array());
        let mut light = LightRecord::triangle(corners.map(vertex), emission, two_sided, mean);
        if is_textured(material) {
            light.textured_material = index;
            let uv = |set: &[[f32; 2]], first: u32, c: u32| {
                if first == NONE { [0.0; 2] } else { set[(first + c) as usize] }
            };
            let places = [
                corners.map(|c| uv(&self.uv0, geometry.first_uv0, c)),
                corners.map(|c| uv(&self.uv1, geometry.first_uv1, c)),
            ];
            light.texture_places[..12].copy_from_slice(places.as_flattened().as_flattened());
            let corner = |c: u32| Vec3f::from_array(self.positions[(geometry.first_vertex + c) as usize]);
            let in_object = corners.map(|c| self.in_object(binding, corner(c)).to_array());
            light.texture_places[12..].copy_from_slice(in_object.as_flattened());
        }
        light
    }

    /// Mean of the strongest channel of a binding's emission texture; 1 without one.
    fn mean_emission_texture(&self, scene: &Scene, geometry: &GeometryRecord, binding: usize) -> f32 {
        let emission = self.materials[self.bindings[binding].material as usize].texture(SLOT_EMISSION);
        if !emission.is_some() {
            return 1.0;
        }
        if emission.is_graph() {
            return self.mean_of_graph(emission, geometry, binding).max(1e-3);
        }
        let texture = scene.textures[emission.image as usize].as_image();
        texture.and_then(|t| scene.images.get(t.image as usize)).map_or(1.0, mean_of_image)
    }
}

/// Whether emission differs from place to place, or has holes.
fn is_textured(material: &MaterialRecord) -> bool {
    material.texture(SLOT_EMISSION).is_some() || material.has_holes()
}

#[cfg(test)]
mod tests {
    use crate::Scene;
    use crate::tables::{Changes, NONE, SceneTables};
    use crate::{Instance, Material, Mesh, Part, Shape, TextureRef, TriangleMesh};
    use glam::{Affine3A, Quat, Vec3};
    use optics::light::{LIGHT_RECTANGLE, LIGHT_TRIANGLE};

    /// A quad and a triangle beside it, in one mesh.
    fn panes() -> TriangleMesh {
        TriangleMesh {
            positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0], [3.0, 0.0]]
                .map(|[x, y]| Vec3::new(x, y, 0.0))
                .to_vec(),
            indices: vec![[1, 4, 2], [0, 1, 2], [0, 2, 3]],
            ..TriangleMesh::default()
        }
    }

    fn emitter() -> Material {
        Material { emission: Vec3::new(1.0, 2.0, 3.0), ..Material::default() }
    }

    /// The panes of one material at some places.
    fn scene(material: Material, places: &[Affine3A]) -> Scene {
        let mesh = Mesh::single("panes", Shape::Triangles(panes()), 0);
        let at = |place: &Affine3A| Instance { dynamic: true, ..Instance::new("panes", 0, *place) };
        Scene {
            materials: vec![material],
            meshes: vec![mesh],
            instances: places.iter().map(at).collect(),
            ..Scene::default()
        }
    }

    fn kinds(tables: &SceneTables) -> Vec<u32> {
        tables.lights.iter().map(|l| l.light.kind).collect()
    }

    #[test]
    fn both_halves_lead_to_one_light_of_their_power() {
        let skew = Affine3A::from_scale(Vec3::new(1.0, 3.0, 1.0)) * Affine3A::from_rotation_z(0.5);
        let turned = Affine3A::from_quat(Quat::from_rotation_x(1.0));
        let tables = SceneTables::build(&scene(emitter(), &[Affine3A::IDENTITY, turned, skew]));
        let (flat, whole) = (LIGHT_TRIANGLE, LIGHT_RECTANGLE);
        assert_eq!(kinds(&tables), [flat, whole, flat, whole, flat, flat, flat]);
        assert_eq!(tables.primitive_lights, [0, 1, 1, 2, 3, 3, 4, 5, 6]);
        let lights = |instance: usize| {
            let binding = tables.bindings[tables.instances[instance].first_binding as usize];
            [0, 1, 2].map(|primitive| tables.light_of(&binding, primitive))
        };
        assert_eq!([lights(0), lights(1), lights(2)], [[0, 1, 1], [2, 3, 3], [4, 5, 6]]);
        // Twice the area of the triangle beside it; two triangles elsewhere.
        let power = |i: usize| tables.lights[i].power;
        assert!((power(1) / power(0) - 1.0).abs() < 1e-5 && (power(3) / power(1) - 1.0).abs() < 1e-5);
        let dark = SceneTables::build(&scene(Material::default(), &[Affine3A::IDENTITY]));
        assert!(dark.lights.is_empty() && dark.primitive_lights.is_empty());
        assert_eq!(dark.light_of(&dark.bindings[0], 1), NONE);
    }

    /// Emission that differs from place to place has coordinates at three corners.
    #[test]
    fn textured_emitters_stay_triangles() {
        let pixels = crate::Pixels::Rgba8(vec![[255, 128, 0, 255]; 4]);
        let textured = Material { emission_texture: Some(TextureRef::new(0)), ..emitter() };
        let mut scene = scene(textured, &[Affine3A::IDENTITY]);
        scene.images.push(crate::Image { name: String::new(), width: 2, height: 2, pixels });
        let (sampler, color_space) = (crate::Sampler::default(), crate::ColorSpace::Srgb);
        scene.textures.push(crate::Texture::image(0, sampler, color_space));
        let tables = SceneTables::build(&scene);
        assert_eq!(kinds(&tables), [LIGHT_TRIANGLE; 3]);
        assert_eq!(tables.primitive_lights, [0, 1, 2]);
    }

    /// Halves in two parts of a mesh may get different materials at any time.
    #[test]
    fn halves_in_two_parts_stay_triangles() {
        let mut scene = scene(emitter(), &[Affine3A::IDENTITY]);
        let part = |i: usize| Part {
            shape: Shape::Triangles(TriangleMesh { indices: vec![panes().indices[i]], ..panes() }),
            material: 0,
        };
        scene.meshes = vec![Mesh { parts: vec![part(1), part(2)], ..scene.meshes[0].clone() }];
        assert_eq!(kinds(&SceneTables::build(&scene)), [LIGHT_TRIANGLE; 2]);
    }

    /// A rectangle that is skewed is two lights: updates say that lights changed.
    #[test]
    fn changes_of_pairs_are_changes_of_lights() {
        let before = SceneTables::build(&scene(emitter(), &[Affine3A::IDENTITY]));
        let skew = Affine3A::from_mat3(glam::Mat3::from_cols(Vec3::X, Vec3::new(0.5, 1.0, 0.0), Vec3::Z));
        let after = SceneTables::build(&scene(emitter(), &[skew]));
        let changes = Changes::between(&before, &after).expect("the same mesh");
        assert!(changes.lights && changes.transforms && !changes.vertices, "{changes:?}");
        assert_eq!((kinds(&before).len(), kinds(&after).len()), (2, 3));
    }
}
