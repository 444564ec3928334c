//! Boxes around everything in the scene that shines.
//!
//! The last segment of a path counts only if it finds light. Where it meets none of these boxes no surface at its end shines, so
//! that nobody has to know what is there: at most, whether it leaves the scene.

use super::transform::affine;
use super::{GeometryKind, GeometryRecord, InstanceRecord, SceneTables};
use glam::{Affine3A, Vec3};
use optics::motion::MotionSegment;

/// How many boxes there may be: few, since each ray is compared with all of them.
pub const MOST_BOXES: usize = 8;

/// Parts of a geometry that are told apart.
const MOST_PARTS: usize = 64;

/// By what share of the scene's extent boxes are larger than what is in them: rounding on the way along a ray stays far below.
const ROOM: f32 = 1e-5;

/// The lowest and the highest corner of a box in world space, metres.
pub type EmitterBox = [[f32; 3]; 2];

#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    fn joined(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn with(self, point: Vec3) -> Self {
        self.joined(Self { low: point, high: point })
    }

    fn of(parts: &[Self]) -> Self {
        parts.iter().fold(Self::EMPTY, |all, part| all.joined(*part))
    }

    /// Of what has these bounds in its own space, during a motion.
    fn during(self, motion: &[MotionSegment]) -> Self {
        let corner = |i: u32| {
            let pick = |a: usize| if i >> a & 1 == 0 { self.low[a] } else { self.high[a] };
            Vec3::new(pick(0), pick(1), pick(2))
        };
        let poses = SceneTables::poses(motion, self.low, self.high);
        poses.iter().fold(Self::EMPTY, |all, (pose, room)| {
            let placed = (0..8).fold(Self::EMPTY, |b, i| b.with(pose.transform_point3(corner(i))));
            all.joined(Self { low: placed.low - *room, high: placed.high + *room })
        })
    }

    fn center(&self) -> Vec3 {
        (self.low + self.high) * 0.5
    }

    /// Half of the surface: how likely a ray is to meet the box.
    fn half_area(&self) -> f32 {
        let size = self.high - self.low;
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

impl SceneTables {
    /// Finds `emitter_boxes`. The scene's bounding sphere is known.
    pub(super) fn add_emitter_boxes(&mut self) {
        let mut parts = Vec::new();
        for (index, instance) in self.instances.iter().enumerate() {
            self.add_emitters(instance, self.instance_segments(index), &mut parts);
        }
        let [x, y, z, radius] = self.bounding_sphere;
        let room = Vec3::splat(ROOM * (Vec3::new(x, y, z).abs().max_element() + radius));
        let padded = |b: Bounds| [(b.low - room).to_array(), (b.high + room).to_array()];
        self.emitter_boxes = groups(parts).into_iter().map(padded).collect();
    }

    /// Appends the bounds of what shines in an instance.
    fn add_emitters(&self, instance: &InstanceRecord, motion: &[MotionSegment], parts: &mut Vec<Bounds>) {
        let blas = self.blas[instance.blas as usize];
        // Of what moves, boxes are first found in its own space.
        let to_world = if motion.is_empty() { affine(&instance.object_to_world) } else { Affine3A::IDENTITY };
        for g in 0..blas.geometry_count {
            let binding = self.bindings[(instance.first_binding + g) as usize];
            if self.materials[binding.material as usize].shines() {
                let geometry = &self.geometries[(blas.first_geometry + g) as usize];
                let count = geometry.primitive_count as usize;
                let primitives: Vec<u32> = (0..geometry.primitive_count).collect();
                // Primitives that follow each other are near each other, mostly.
                for part in primitives.chunks(count.div_ceil(MOST_PARTS).max(1)) {
                    let bounds = part.iter().map(|&i| self.primitive_bounds(geometry, i, &to_world));
                    let bounds = bounds.fold(Bounds::EMPTY, Bounds::joined);
                    let bounds = if motion.is_empty() { bounds } else { bounds.during(motion) };
                    // Nothing is hit that is not finite.
                    if bounds.low.is_finite() && bounds.high.is_finite() {
                        parts.push(bounds);
                    }
                }
            }
        }
    }

    /// World-space bounds of primitive `i` of a geometry; empty if it is not finite.
    fn primitive_bounds(&self, geometry: &GeometryRecord, i: u32, to_world: &Affine3A) -> Bounds {
        let index = (geometry.first_primitive + i) as usize;
        let points: Vec<Vec3> = match geometry.kind {
            GeometryKind::Triangles => {
                let vertex = |corner: u32| self.positions[(geometry.first_vertex + corner) as usize];
                self.indices[index].iter().map(|&corner| Vec3::from(vertex(corner))).collect()
            }
            GeometryKind::Spheres => {
                let [x, y, z, radius] = self.spheres[index];
                let side = |bits: u32, bit: u32| if bits & bit == 0 { -radius } else { radius };
                let corner = |i: u32| Vec3::new(x + side(i, 1), y + side(i, 2), z + side(i, 4));
                (0..8).map(corner).collect()
            }
        };
        let bounds = points.iter().fold(Bounds::EMPTY, |b, p| b.with(to_world.transform_point3(*p)));
        if bounds.low.is_finite() && bounds.high.is_finite() { bounds } else { Bounds::EMPTY }
    }
}

/// Boxes around all `parts`. The group that gains most surface by it is divided, until there are enough.
fn groups(parts: Vec<Bounds>) -> Vec<Bounds> {
    if parts.is_empty() {
        return Vec::new();
    }
    let mut divided = vec![Group::new(parts)];
    while divided.len() < MOST_BOXES {
        let gains = |a: &&mut Group, b: &&mut Group| a.gain.total_cmp(&b.gain);
        let Some(group) = divided.iter_mut().max_by(gains).filter(|g| g.gain > 0.0) else { break };
        let rest = group.parts.split_off(group.first_of_rest);
        *group = Group::new(std::mem::take(&mut group.parts));
        divided.push(Group::new(rest));
    }
    divided.iter().map(|g| Bounds::of(&g.parts)).collect()
}

/// Parts that share a box, in order along its longest axis.
struct Group {
    parts: Vec<Bounds>,
    /// Where the group is best divided, and how much smaller the surface of both boxes is than that of the one.
    first_of_rest: usize,
    gain: f32,
}

impl Group {
    fn new(mut parts: Vec<Bounds>) -> Self {
        let centers = parts.iter().fold(Bounds::EMPTY, |b, part| b.with(part.center()));
        let size = centers.high - centers.low;
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        parts.sort_by(|a, b| a.center()[axis].total_cmp(&b.center()[axis]));
        // Areas of the boxes around all parts from each one on.
        let mut behind = vec![0.0; parts.len()];
        let mut bounds = Bounds::EMPTY;
        for (i, part) in parts.iter().enumerate().rev() {
            bounds = bounds.joined(*part);
            behind[i] = bounds.half_area();
        }
        let whole = bounds.half_area();
        let (mut first_of_rest, mut gain) = (0, 0.0);
        let mut before = Bounds::EMPTY;
        for i in 1..parts.len() {
            before = before.joined(parts[i - 1]);
            let saved = whole - before.half_area() - behind[i];
            if saved > gain {
                (first_of_rest, gain) = (i, saved);
            }
        }
        Self { parts, first_of_rest, gain }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Material, Mesh, Model, Scene, Shape, Sphere};

    /// A scene of shining spheres at the given places, of radius `r`, and a dark one.
    fn lamps(centers: &[Vec3], r: f32) -> Scene {
        let lamps = centers.iter().map(|&center| Sphere { center, radius: r }).collect();
        let dark = vec![Sphere { center: Vec3::splat(50.0), radius: 9.0 }];
        Scene {
            materials: vec![Material::default(), Material { emission: Vec3::ONE, ..Material::default() }],
            meshes: vec![
                Mesh::single("lamps", Shape::Spheres(lamps), 1),
                Mesh::single("dark", Shape::Spheres(dark), 0),
            ],
            instances: vec![at(0, Affine3A::IDENTITY), at(1, Affine3A::IDENTITY)],
            ..Scene::default()
        }
    }

    fn at(mesh: u32, transform: Affine3A) -> Instance {
        Instance::new("lamp", mesh, transform)
    }

    fn holds([low, high]: &EmitterBox, center: Vec3, r: f32) -> bool {
        (0..3).all(|a| low[a] <= center[a] - r && center[a] + r <= high[a])
    }

    #[test]
    fn every_lamp_is_in_a_box_and_nothing_else() {
        let far_apart: Vec<Vec3> = (0..5).map(|i| Vec3::new(i as f32 * 20.0, 0.0, (i % 2) as f32)).collect();
        // A thousand lamps close together gain nothing by more boxes than one.
        let block: Vec<Vec3> =
            (0..1000).map(|i| Vec3::new((i % 10) as f32, (i / 100) as f32, (i / 10 % 10) as f32)).collect();
        let row: Vec<Vec3> = (0..100).map(|i| Vec3::new(0.0, i as f32 * 20.0, 0.0)).collect();
        for (centers, count) in [(&far_apart, 5), (&block, 1), (&row, MOST_BOXES)] {
            let boxes = SceneTables::build(&lamps(centers, 0.2)).emitter_boxes;
            assert_eq!(boxes.len(), count, "{boxes:?}");
            for &center in centers {
                assert!(boxes.iter().any(|b| holds(b, center, 0.2)), "{center}");
            }
            assert!(!boxes.iter().any(|b| holds(b, Vec3::splat(50.0), 0.0)));
        }
        let boxes = SceneTables::build(&lamps(&far_apart, 0.2)).emitter_boxes;
        let volume = |[low, high]: &EmitterBox| (0..3).map(|a| high[a] - low[a]).product::<f32>();
        assert!(boxes.iter().all(|b| (volume(b) / 0.4f32.powi(3) - 1.0).abs() < 0.05), "{boxes:?}");
    }

    #[test]
    fn without_lamps_there_are_no_boxes_and_instances_move_theirs() {
        assert!(SceneTables::build(&lamps(&[], 1.0)).emitter_boxes.is_empty());
        let mut scene = lamps(&[Vec3::ZERO], 1.0);
        scene.instances[0] =
            at(0, Affine3A::from_scale(Vec3::new(1.0, 3.0, 1.0)) * Affine3A::from_rotation_y(0.5));
        scene.instances.push(at(0, Affine3A::from_translation(Vec3::X * 10.0)));
        let boxes = SceneTables::build(&scene).emitter_boxes;
        assert_eq!(boxes.len(), 2, "{boxes:?}");
        let top = Vec3::new(0.0, 3.0, 0.0);
        assert!(
            boxes.iter().any(|b| holds(b, top, 0.0)) && boxes.iter().any(|b| holds(b, Vec3::X * 10.0, 1.0))
        );
    }

    #[test]
    fn surfaces_without_shading_shine() {
        let mut scene = lamps(&[Vec3::ZERO], 1.0);
        scene.materials[0].model = Model::Unlit;
        assert_eq!(SceneTables::build(&scene).emitter_boxes.len(), 2);
    }
}
