//! What caustics come from: surfaces that mirror or refract sharply, and lights that are hard to find through them.

use super::{BindingRecord, GeometryKind, GeometryRecord, MaterialRecord, ModelTag, SceneTables};
use crate::tables::light::strongest;
use glam::Vec3;
use optics::constants::NONE;
use optics::light::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_RECTANGLE, LIGHT_SPHERE, light_is_flat, light_is_point,
};
use optics::material::{MATERIAL_THIN, SLOT_METALLIC_ROUGHNESS};
use optics::scatter::SHARP_WIDTH;
use optics::vector::{cross, length};

/// Spheres that photons are aimed at, at most.
pub const MOST_TARGETS: usize = 16;

/// The share of all directions below which a light is small: paths rarely find it by chance.
const SMALL_LIGHT: f32 = 0.01;

/// Whether caustics are worth photons, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CausticsAdvice {
    /// Whether they are.
    pub wanted: bool,
    /// The reason, for people.
    pub reason: String,
}

impl SceneTables {
    /// Whether photons find light here that paths hardly do: something mirrors or refracts sharply, and a light is small.
    pub fn caustics_advice(&self) -> CausticsAdvice {
        let advice = |wanted, reason: &str| CausticsAdvice { wanted, reason: reason.into() };
        if self.motion.is_some() {
            return advice(false, "photons know no motion");
        }
        let targets = self.specular_targets();
        if targets.is_empty() {
            return advice(false, "nothing mirrors or refracts sharply");
        }
        let small = self.lights.iter().any(|l| {
            let record = l.light;
            let seen_from = |t: &[f32; 4]| {
                let distance = length(record.position - optics::vec3f(t[0], t[1], t[2])).max(t[3]);
                let area = match record.kind {
                    LIGHT_SPHERE => std::f32::consts::PI * record.size * record.size,
                    LIGHT_RECTANGLE => length(cross(record.edge1, record.edge2)),
                    _ => 0.5 * length(cross(record.edge1, record.edge2)),
                };
                area / (distance * distance)
            };
            let largest = || targets.iter().map(seen_from).fold(0.0, f32::max);
            let surface = light_is_flat(record.kind) || record.kind == LIGHT_SPHERE;
            strongest(record.emission) > 0.0
                && (light_is_point(record.kind)
                    || record.kind == LIGHT_DIRECTIONAL
                    || (surface && largest() < SMALL_LIGHT * 4.0 * std::f32::consts::PI))
        });
        if !small {
            return advice(false, "no light is small");
        }
        advice(true, "a small light and surfaces that mirror or refract it")
    }

    /// Spheres around all surfaces that mirror or refract sharply, world space: centre and radius; at most
    /// [`MOST_TARGETS`]. Together they are as small as halving the largest again and again makes them.
    pub fn specular_targets(&self) -> Vec<[f32; 4]> {
        let all = self.specular_boxes();
        let mut clusters: Vec<Cluster> = Cluster::of(all).into_iter().collect();
        while clusters.len() < MOST_TARGETS {
            let largest =
                (0..clusters.len()).max_by(|a, b| clusters[*a].radius.total_cmp(&clusters[*b].radius));
            let Some(at) = largest.filter(|at| clusters[*at].boxes.len() > 1) else { break };
            let cluster = clusters.swap_remove(at);
            let radius = cluster.radius;
            let halves = cluster.halves();
            clusters.extend(halves);
            if radius <= 0.0 {
                break;
            }
        }
        clusters.iter().map(Cluster::sphere).collect()
    }

    /// World-space boxes of all primitives that mirror or refract sharply.
    fn specular_boxes(&self) -> Vec<[Vec3; 2]> {
        let mut boxes = Vec::new();
        for instance in &self.instances {
            let blas = &self.blas[instance.blas as usize];
            let geometries = &self.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
            let bindings: &[BindingRecord] = &self.bindings[instance.first_binding as usize..];
            let to_world = super::transform::affine(&instance.object_to_world);
            for (geometry, binding) in geometries.iter().zip(bindings) {
                if is_sharp(self, &self.materials[binding.material as usize]) {
                    self.add_boxes(geometry, &to_world, &mut boxes);
                }
            }
        }
        boxes
    }

    fn add_boxes(&self, g: &GeometryRecord, to_world: &glam::Affine3A, boxes: &mut Vec<[Vec3; 2]>) {
        let range = g.first_primitive as usize..(g.first_primitive + g.primitive_count) as usize;
        match g.kind {
            GeometryKind::Triangles => boxes.extend(self.indices[range].iter().map(|corners| {
                let corner =
                    |i: u32| to_world.transform_point3(self.positions[(g.first_vertex + i) as usize].into());
                let [a, b, c] = corners.map(corner);
                [a.min(b).min(c), a.max(b).max(c)]
            })),
            GeometryKind::Spheres => boxes.extend(self.spheres[range].iter().map(|s| {
                let center = to_world.transform_point3(Vec3::new(s[0], s[1], s[2]));
                let rows = to_world.matrix3.transpose();
                let half = s[3] * Vec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
                [center - half, center + half]
            })),
        }
    }
}

/// Whether all light that a material scatters, or a part of it, stays a picture; see [`SHARP_WIDTH`].
fn is_sharp(tables: &SceneTables, m: &MaterialRecord) -> bool {
    let textured = m.textures[SLOT_METALLIC_ROUGHNESS as usize].width != 0;
    let smooth = m.roughness * m.roughness <= SHARP_WIDTH || textured;
    match m.model {
        ModelTag::Mirror => true,
        ModelTag::Dielectric => smooth && !(m.flags & MATERIAL_THIN != 0 && m.ior <= 1.0),
        ModelTag::MetallicRoughness => smooth && (m.metallic > 0.99 || m.transmission > 0.0),
        ModelTag::Layered => {
            let layers = m.layers != NONE && (m.layers as usize) < tables.layers.len();
            layers && smooth && (m.metallic > 0.99 || m.transmission > 0.0)
        }
        _ => false,
    }
}

/// Primitives near each other, and the ball around them.
struct Cluster {
    boxes: Vec<[Vec3; 2]>,
    center: Vec3,
    radius: f32,
}

impl Cluster {
    /// `None` of nothing.
    fn of(boxes: Vec<[Vec3; 2]>) -> Option<Self> {
        let low = boxes.iter().fold(Vec3::INFINITY, |low, b| low.min(b[0]));
        let high = boxes.iter().fold(Vec3::NEG_INFINITY, |high, b| high.max(b[1]));
        if boxes.is_empty() || !(low.is_finite() && high.is_finite()) {
            return None;
        }
        let center = (low + high) * 0.5;
        let farthest = |b: &[Vec3; 2]| (b[0] - center).abs().max((b[1] - center).abs()).length();
        // A box's corners bound what is in it; not more than the box around all.
        let radius = boxes.iter().map(farthest).fold(0.0, f32::max);
        // Rays that graze it are inside for all roundings.
        Some(Self { boxes, center, radius: radius * 1.0001 + 1e-9 })
    }

    /// Two clusters, divided in the middle of the longest side.
    fn halves(mut self) -> impl Iterator<Item = Self> {
        let middle = |b: &[Vec3; 2]| b[0] + b[1];
        let low = self.boxes.iter().fold(Vec3::INFINITY, |low, b| low.min(middle(b)));
        let high = self.boxes.iter().fold(Vec3::NEG_INFINITY, |high, b| high.max(middle(b)));
        let axis = (high - low).max_position();
        let half = self.boxes.len() / 2;
        self.boxes.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        let upper = self.boxes.split_off(half);
        [self.boxes, upper].into_iter().filter_map(Self::of)
    }

    fn sphere(&self) -> [f32; 4] {
        self.center.extend(self.radius).to_array()
    }
}

impl super::LightRecord {
    /// How much light it can send to a ball of unit size, relative to other lights: what photons are dealt out by.
    ///
    /// - `targets`: centres and radii of [`SceneTables::specular_targets`].
    pub fn flux_towards(&self, targets: &[[f32; 4]]) -> f32 {
        let light = &self.light;
        let of = |t: &[f32; 4]| {
            let center = optics::vec3f(t[0], t[1], t[2]);
            if light.kind == LIGHT_DIRECTIONAL || light.kind == LIGHT_ENVIRONMENT {
                return std::f32::consts::PI * t[3] * t[3];
            }
            optics::photons::target_solid_angle(center, t[3], light.position)
        };
        let spread = if light.kind == LIGHT_ENVIRONMENT { 4.0 } else { 1.0 };
        self.strength * spread * targets.iter().map(of).sum::<f32>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Light, LightKind, Material, Mesh, Model, Scene, Shape, Sphere};
    use glam::Affine3A;

    fn balls(material: Material, centers: &[Vec3]) -> Scene {
        let mut scene = Scene { materials: vec![material], ..Scene::default() };
        let ball = |center: &Vec3| Sphere { center: *center, radius: 0.5 };
        let shape = Shape::Spheres(centers.iter().map(ball).collect());
        scene.meshes.push(Mesh::single("balls", shape, 0));
        scene.instances.push(Instance::new("balls", 0, Affine3A::IDENTITY));
        scene
    }

    fn lamp(scene: &mut Scene) {
        let kind = LightKind::Point { position: Vec3::Y * 3.0, intensity: Vec3::ONE };
        scene.lights.push(Light::new("lamp", kind));
    }

    #[test]
    fn targets_hold_all_that_is_specular() {
        let centers = [Vec3::ZERO, Vec3::X * 10.0, Vec3::new(10.0, 1.0, 0.0)];
        let mirror = Material { model: Model::Mirror, ..Material::default() };
        let tables = SceneTables::build(&balls(mirror, &centers));
        let targets = tables.specular_targets();
        assert_eq!(targets.len(), 3);
        for center in centers {
            let around = |t: &&[f32; 4]| center.distance(Vec3::new(t[0], t[1], t[2])) + 0.5 <= t[3];
            assert!(targets.iter().any(|t| around(&t)), "{center}");
        }
        let area: f32 = targets.iter().map(|t| t[3] * t[3]).sum();
        assert!(area < 3.0 * 0.76, "{area}: boxes of balls are no larger");
        let lambert = Material { model: Model::Lambert, ..Material::default() };
        assert!(SceneTables::build(&balls(lambert, &centers)).specular_targets().is_empty());
    }

    #[test]
    fn photons_are_advised_where_a_small_light_meets_a_mirror() {
        let scene = |model, lit: bool| {
            let mut scene = balls(Material { model, ..Material::default() }, &[Vec3::ZERO]);
            if lit {
                lamp(&mut scene);
            }
            SceneTables::build(&scene).caustics_advice()
        };
        assert!(scene(Model::Mirror, true).wanted);
        assert!(!scene(Model::Mirror, false).wanted);
        assert!(!scene(Model::Lambert, true).wanted);
    }
}
