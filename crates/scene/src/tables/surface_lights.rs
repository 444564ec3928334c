//! Lights of surfaces that emit.

use super::build::{affine, uniform_scale};
use super::light::luminance;
use super::material::{MATERIAL_CHECKERBOARD_FADES, MATERIAL_EMISSION_TWO_SIDED};
use super::rectangles::{self, Part};
use super::{GeometryKind, GeometryRecord, LightRecord, MaterialRecord, NONE, SceneTables};
use crate::{Pixels, Scene};
use glam::{Affine3A, Vec3};

impl SceneTables {
    /// Lights of the emissive geometries of one instance.
    pub(super) fn add_surface_lights(&mut self, scene: &Scene, instance: usize) {
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
            if material.has_alpha() && unknown_holes {
                continue;
            }
            match geometry.kind {
                GeometryKind::Triangles => {
                    let mean = self.mean_emission_texture(scene, binding);
                    self.add_triangle_lights(&geometry, &to_world, binding, mean);
                }
                // An ellipsoid cannot be sampled by solid angle: it shines where paths find it by themselves.
                GeometryKind::Spheres => {
                    if let Some(scale) = uniform_scale(&to_world) {
                        self.bindings[binding].first_light = self.primitive_lights.len() as u32;
                        for i in 0..geometry.primitive_count {
                            let [x, y, z, r] = self.spheres[(geometry.first_primitive + i) as usize];
                            let center = to_world.transform_point3(Vec3::new(x, y, z));
                            let emission = Vec3::from(material.emission);
                            let two_sided = material.flags & MATERIAL_EMISSION_TWO_SIDED != 0;
                            self.add_primitive_light(LightRecord::sphere(
                                center,
                                r * scale,
                                emission,
                                two_sided,
                            ));
                        }
                    }
                }
            }
        }
    }

    /// Appends the light of the next primitive.
    fn add_primitive_light(&mut self, light: LightRecord) {
        self.primitive_lights.push(self.lights.len() as u32);
        self.lights.push(light);
    }

    /// Lights of a geometry's triangles, of which two may be one rectangle.
    fn add_triangle_lights(
        &mut self,
        geometry: &GeometryRecord,
        to_world: &Affine3A,
        binding: usize,
        mean: f32,
    ) {
        let material = self.materials[self.bindings[binding].material as usize];
        let first_light = self.primitive_lights.len() as u32;
        self.bindings[binding].first_light = first_light;
        // A texture has coordinates at three corners.
        let parts = if is_textured(&material) {
            vec![Part::Alone; geometry.primitive_count as usize]
        } else {
            rectangles::pair(self, geometry, to_world)
        };
        for (i, part) in (0..).zip(parts) {
            match part {
                Part::Alone => {
                    let light = self.triangle_light(geometry, i, to_world, binding, mean);
                    self.add_primitive_light(light);
                }
                Part::Rectangle(rectangle) => {
                    let emission = Vec3::from(material.emission);
                    let two_sided = material.flags & MATERIAL_EMISSION_TWO_SIDED != 0;
                    self.add_primitive_light(LightRecord::rectangle(&rectangle, emission, two_sided));
                }
                Part::HalfOf(other) => {
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
        let emission = Vec3::from(material.emission);
        let mut light = LightRecord::triangle(corners.map(vertex), emission, two_sided, mean);
        if is_textured(material) {
            light.textured_material = index;
            let uv = |set: &[[f32; 2]], first: u32, c: u32| {
                if first == NONE { [0.0; 2] } else { set[(first + c) as usize] }
            };
            light.uv[0] = corners.map(|c| uv(&self.uv0, geometry.first_uv0, c));
            light.uv[1] = corners.map(|c| uv(&self.uv1, geometry.first_uv1, c));
        }
        light
    }

    /// Mean luminance of a binding's emission texture; 1 without one.
    fn mean_emission_texture(&self, scene: &Scene, binding: usize) -> f32 {
        let slot = self.materials[self.bindings[binding].material as usize].emission_slot;
        if slot == NONE {
            return 1.0;
        }
        let texture = &scene.textures[self.texture_slots[slot as usize].texture as usize];
        let Some(image) = scene.images.get(texture.image as usize) else { return 1.0 };
        let decode = |b: u8| optics::tonemap::srgb_decode_channel(f32::from(b) / 255.0);
        let sum: f64 = match &image.pixels {
            Pixels::Rgba8(pixels) => {
                let color = |p: &[u8; 4]| Vec3::new(decode(p[0]), decode(p[1]), decode(p[2]));
                pixels.iter().map(|p| f64::from(luminance(color(p)))).sum()
            }
            Pixels::Rgb32F(pixels) => pixels.iter().map(|p| f64::from(luminance(Vec3::from(*p)))).sum(),
        };
        // Never zero: a dim texture must still be found.
        ((sum / (f64::from(image.width) * f64::from(image.height))) as f32).max(1e-3)
    }
}

/// Whether emission differs from place to place, or has holes.
fn is_textured(material: &MaterialRecord) -> bool {
    material.emission_slot != NONE || material.has_alpha()
}
