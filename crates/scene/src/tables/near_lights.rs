//! Whether light is ever sampled from near a flat lamp.
//!
//! Triangles and rectangles that are near are sampled by solid angle, which costs a shader registers whether any point is near or
//! not. Most lamps hang so high that nothing is: then a shader can do without.

use super::transform::affine;
use super::{GeometryKind, GeometryRecord, SceneTables};
use glam::{Affine3A, Vec3};
use optics::light::{LIGHT_RECTANGLE, Light, NEAR_FLAT, RECTANGLE_CENTER, TRIANGLE_CENTER, light_is_flat};
use rayon::prelude::*;

/// Pairs of a lamp and a primitive that are looked at: about a tenth of a second. Of more it is not known.
const MOST_PAIRS: usize = 1 << 24;

/// A share of a lamp's longest edge: what is less than that in front of its plane is in its plane, as the lamp itself is.
const IN_PLANE: f32 = 1e-3;

/// A box in world space.
#[derive(Clone, Copy)]
struct Bounds {
    min: Vec3,
    max: Vec3,
}

impl Bounds {
    fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        let none = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
        points.into_iter().fold(none, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The corner that is furthest in a direction.
    fn furthest(&self, direction: Vec3) -> Vec3 {
        Vec3::select(direction.cmpge(Vec3::ZERO), self.max, self.min)
    }
}

/// Where a flat lamp is near, and shines.
struct Near {
    center: Vec3,
    radius: f32,
    /// Unit normal of the front; zero if the lamp has no area, and so never shines.
    front: Vec3,
    two_sided: bool,
    /// How far from the lamp's plane points are not in it any more.
    in_plane: f32,
}

impl Near {
    fn new(light: &Light) -> Self {
        let [first, edge1, edge2] =
            [light.position, light.edge1, light.edge2].map(|v| Vec3::from(v.to_array()));
        let center = if light.kind == LIGHT_RECTANGLE { RECTANGLE_CENTER } else { TRIANGLE_CENTER };
        let longest2 =
            [edge1, edge2, edge2 - edge1].map(Vec3::length_squared).into_iter().fold(0.0, f32::max);
        Self {
            center: first + (edge1 + edge2) * center,
            // Rays begin a little beside surfaces.
            radius: (NEAR_FLAT * longest2).sqrt() * (1.0 + IN_PLANE),
            front: edge1.cross(edge2).normalize_or_zero(),
            two_sided: light.two_sided,
            in_plane: longest2.sqrt() * IN_PLANE,
        }
    }

    /// Whether a point of a box may be near, on a side that the lamp shines to.
    fn reaches(&self, bounds: &Bounds) -> bool {
        let closest = self.center.clamp(bounds.min, bounds.max);
        let above =
            |direction: Vec3| (bounds.furthest(direction) - self.center).dot(direction) > self.in_plane;
        closest.distance_squared(self.center) < self.radius * self.radius
            && (above(self.front) || (self.two_sided && above(-self.front)))
    }
}

impl SceneTables {
    /// Whether a surface may be so near a flat light that shines on it that this is sampled by solid angle: see
    /// [`optics::light::flat_light_is_near`]. True, too, where nobody knows: in media, and in scenes that are too large to look.
    pub fn surfaces_may_be_near_flat_lights(&self) -> bool {
        let lights = self.lights.iter().map(|l| &l.light).filter(|l| light_is_flat(l.kind));
        let lights: Vec<Near> = lights.map(Near::new).collect();
        if lights.is_empty() {
            return false;
        }
        let primitives: usize = self.placed_geometries().map(|(_, g)| g.primitive_count as usize).sum();
        if self.needs_volumes() || lights.len().saturating_mul(primitives) > MOST_PAIRS {
            return true;
        }
        let near = |bounds: Bounds| lights.iter().any(|light| light.reaches(&bounds));
        self.placed_geometries().any(|(to_world, geometry)| {
            (0..geometry.primitive_count)
                .into_par_iter()
                .any(|i| near(self.bounds_at(&to_world, geometry, i)))
        })
    }

    /// The geometries of all instances, and where they stand.
    fn placed_geometries(&self) -> impl Iterator<Item = (Affine3A, &GeometryRecord)> {
        self.instances.iter().flat_map(|instance| {
            let blas = self.blas[instance.blas as usize];
            let to_world = affine(&instance.object_to_world);
            let geometries = &self.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
            geometries.iter().map(move |geometry| (to_world, geometry))
        })
    }

    /// A box around primitive `i` of a geometry that stands at `to_world`.
    fn bounds_at(&self, to_world: &Affine3A, geometry: &GeometryRecord, i: u32) -> Bounds {
        let primitive = (geometry.first_primitive + i) as usize;
        match geometry.kind {
            GeometryKind::Triangles => {
                let vertex =
                    |corner: u32| Vec3::from(self.positions[(geometry.first_vertex + corner) as usize]);
                Bounds::of(self.indices[primitive].map(|corner| to_world.transform_point3(vertex(corner))))
            }
            GeometryKind::Spheres => {
                let [x, y, z, radius] = self.spheres[primitive];
                let center = to_world.transform_point3(Vec3::new(x, y, z));
                // An ellipsoid reaches as far along an axis as that axis of the matrix' rows is long.
                let rows = to_world.matrix3.transpose();
                let reach = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.length() * radius);
                Bounds { min: center - Vec3::from(reach), max: center + Vec3::from(reach) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Fog, Instance, Material, Medium, Mesh, Scene, Shape, Sphere, TriangleMesh};

    /// A square of 2 m in the plane y = 0 that shines upwards: its diagonal is 2.83 m, so it is near up to 2 m.
    fn lamp(material: Material) -> Scene {
        let mesh = TriangleMesh {
            positions: [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]]
                .map(|[x, z]| Vec3::new(x, 0.0, z))
                .to_vec(),
            indices: vec![[0, 1, 2], [0, 2, 3]],
            ..TriangleMesh::default()
        };
        let mut scene = Scene { materials: vec![material, Material::default()], ..Scene::default() };
        scene.meshes.push(Mesh::single("lamp", Shape::Triangles(mesh), 0));
        scene.instances.push(Instance::new("lamp", 0, Affine3A::IDENTITY));
        scene
    }

    fn emitter() -> Material {
        Material { emission: Vec3::ONE, ..Material::default() }
    }

    /// Whether the lamp is near something of some shape.
    fn is_near(mut scene: Scene, shape: Shape, place: Affine3A) -> bool {
        let mesh = scene.meshes.len() as u32;
        scene.meshes.push(Mesh::single("other", shape, 1));
        scene.instances.push(Instance::new("other", mesh, place));
        let near = SceneTables::build(&scene).surfaces_may_be_near_flat_lights();
        // As an instance in a space of its own.
        scene.instances[1].dynamic = true;
        assert_eq!(SceneTables::build(&scene).surfaces_may_be_near_flat_lights(), near);
        near
    }

    fn sheet() -> Shape {
        let positions = vec![Vec3::ZERO, Vec3::Z * 0.1, Vec3::X * 0.1];
        Shape::Triangles(TriangleMesh { positions, indices: vec![[0, 1, 2]], ..TriangleMesh::default() })
    }

    #[test]
    fn a_lamp_is_near_what_is_in_front_of_it() {
        let at = |x, y, z| is_near(lamp(emitter()), sheet(), Affine3A::from_translation(Vec3::new(x, y, z)));
        assert!(at(0.0, 1.9, 0.0) && at(0.0, 0.1, 0.0) && at(-1.4, 1.3, 0.0));
        assert!(!at(0.0, 2.1, 0.0) && !at(-1.5, 1.5, 0.0) && !at(2.1, 0.1, 0.0));
        // Behind it, and in its plane.
        assert!(!at(0.0, -0.5, 0.0) && !at(1.0, 0.0, 0.0));
    }

    #[test]
    fn a_lamp_of_two_sides_is_near_on_both() {
        let two_sided = || lamp(Material { emission_two_sided: true, ..emitter() });
        let at = |y: f32| is_near(two_sided(), sheet(), Affine3A::from_translation(Vec3::Y * y));
        assert!(at(0.5) && at(-0.5) && !at(0.0) && !at(-2.1));
    }

    #[test]
    fn lamps_are_near_spheres_however_they_are_stretched() {
        let ball = || Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius: 0.5 }]);
        let at = |scale: Vec3| {
            let place = Affine3A::from_translation(Vec3::Y * 3.0) * Affine3A::from_scale(scale);
            is_near(lamp(emitter()), ball(), place)
        };
        assert!(
            !at(Vec3::ONE)
                && !at(Vec3::new(3.0, 1.0, 3.0))
                && at(Vec3::new(1.0, 2.5, 1.0))
                && at(Vec3::splat(2.5))
        );
    }

    #[test]
    fn what_is_not_known_may_be_near() {
        let known = |scene: &Scene| !SceneTables::build(scene).surfaces_may_be_near_flat_lights();
        assert!(known(&Scene::default()) && known(&lamp(emitter())) && known(&lamp(Material::default())));
        let fog =
            Some(Fog { medium: Medium { scattering: Vec3::ONE, ..Medium::default() }, top: f32::INFINITY });
        assert!(!known(&Scene { fog, ..lamp(emitter()) }), "light is scattered anywhere");
        let lamps = |count: usize| {
            let mut scene = lamp(emitter());
            let instance =
                |i| Instance::new("lamp", 0, Affine3A::from_translation(Vec3::X * 10.0 * i as f32));
            scene.instances = (0..count).map(instance).collect();
            scene
        };
        assert!(known(&lamps(100)));
        // Two triangles each.
        assert!(!known(&lamps(1 + (MOST_PAIRS / 2).isqrt())), "too many to look at");
    }
}
