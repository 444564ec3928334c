//! Scenes with a known picture: those of the shared references, and parts to build others from.
//!
//! [`cornell`], [`glass`] and [`spheres`] are, number for number, the scenes that the reference renderings show (the
//! shared data's `make_scenes.py` writes the same as glTF). A test needs no file to render them.

mod assortment;
mod hairy;

use elementary::{atan, cos, sin};
use glam::{Affine3A, DQuat, DVec3, Quat, Vec2, Vec3, Vec4};
use scene::{
    AlphaMode, Camera, Environment, Instance, Material, Mesh, Model, Scene, Shape, Sphere, TriangleMesh,
};

pub use assortment::assortment;
pub use hairy::{blobs_in_a_room, hairy};

/// A Lambertian material.
#[must_use]
pub fn lambert(name: &str, color: [f32; 3]) -> Material {
    Material {
        name: name.into(),
        model: Model::Lambert,
        base_color: Vec3::from(color).extend(1.0),
        ..Material::default()
    }
}

/// A black surface that emits `radiance`.
#[must_use]
pub fn emitter(name: &str, radiance: [f32; 3]) -> Material {
    Material { emission: Vec3::from(radiance), ..lambert(name, [0.0; 3]) }
}

/// A glTF metallic-roughness material.
#[must_use]
pub fn metallic_roughness(name: &str, color: [f32; 3], metallic: f32, roughness: f32) -> Material {
    let base_color = Vec3::from(color).extend(1.0);
    Material { name: name.into(), base_color, metallic, roughness, ..Material::default() }
}

/// Clear glass, smooth where `roughness` is 0.
#[must_use]
pub fn dielectric(name: &str, ior: f32, roughness: f32) -> Material {
    let base_color = Vec4::ONE;
    Material {
        name: name.into(),
        model: Model::Dielectric,
        base_color,
        ior,
        roughness,
        ..Material::default()
    }
}

/// The material with its alpha as coverage.
#[must_use]
pub fn covering(material: Material, alpha: f32) -> Material {
    let base_color = material.base_color.truncate().extend(alpha);
    Material { base_color, alpha_mode: AlphaMode::Blend, ..material }
}

/// Quadrilaterals of two flat triangles each, counter-clockwise seen from their front.
#[must_use]
pub fn quads(corners: &[[[f64; 3]; 4]]) -> TriangleMesh {
    let positions = corners.iter().flatten().map(|p| DVec3::from(*p).as_vec3()).collect();
    let first = (0..corners.len() as u32).map(|i| 4 * i);
    let indices = first.flat_map(|i| [[i, i + 1, i + 2], [i, i + 2, i + 3]]).collect();
    TriangleMesh { positions, indices, ..TriangleMesh::default() }
}

/// An axis-parallel box from `low` to `high` whose front is outside.
#[must_use]
pub fn cuboid(low: [f64; 3], high: [f64; 3]) -> TriangleMesh {
    let pick =
        |bits: usize| std::array::from_fn(|axis| if bits >> axis & 1 == 0 { low[axis] } else { high[axis] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    quads(&sides.map(|side| side.map(pick)))
}

/// The mesh turned inside out: its front becomes its back.
#[must_use]
pub fn flipped(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.indices.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    mesh
}

/// The square from −1 to 1 in x and z at `y`, facing up, with texture coordinates and normals.
#[must_use]
pub fn ground(y: f32, half_size: f32) -> TriangleMesh {
    let corner = |x: f32, z: f32| Vec3::new(x * half_size, y, z * half_size);
    TriangleMesh {
        positions: vec![corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)],
        normals: vec![Vec3::Y; 4],
        uv0: vec![Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    }
}

/// The unit sphere of `around` × `rings` quadrilaterals with smooth normals.
#[must_use]
pub fn uv_sphere(around: u32, rings: u32) -> TriangleMesh {
    use std::f64::consts::{PI, TAU};
    let vertex = |i: u32, j: u32| {
        let (theta, phi) = (PI * f64::from(i) / f64::from(rings), TAU * f64::from(j) / f64::from(around));
        DVec3::new(sin(theta) * cos(phi), cos(theta), -sin(theta) * sin(phi)).as_vec3()
    };
    let positions: Vec<Vec3> = (0..=rings).flat_map(|i| (0..=around).map(move |j| vertex(i, j))).collect();
    let mut indices = Vec::new();
    for i in 0..rings {
        for a in (0..around).map(|j| i * (around + 1) + j) {
            let b = a + around + 1;
            if i > 0 {
                indices.push([a, b, a + 1]);
            }
            if i < rings - 1 {
                indices.push([a + 1, b, b + 1]);
            }
        }
    }
    TriangleMesh { normals: positions.clone(), positions, indices, ..TriangleMesh::default() }
}

/// An analytic sphere.
#[must_use]
pub fn sphere(center: [f32; 3], radius: f32) -> Shape {
    Shape::Spheres(vec![Sphere { center: Vec3::from(center), radius }])
}

/// What a [`Scene`] is built from piece by piece.
pub trait Build {
    /// Adds a material; returns its index.
    fn add_material(&mut self, material: Material) -> u32;
    /// Adds a shape of one material, placed by `transform`; returns the index of its mesh.
    fn add_shape(&mut self, name: &str, shape: Shape, material: u32, transform: Affine3A) -> u32;

    /// Adds triangles of one material where they are.
    fn add_mesh(&mut self, name: &str, mesh: TriangleMesh, material: u32) -> u32 {
        self.add_shape(name, Shape::Triangles(mesh), material, Affine3A::IDENTITY)
    }
}

impl Build for Scene {
    fn add_material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    fn add_shape(&mut self, name: &str, shape: Shape, material: u32, transform: Affine3A) -> u32 {
        let mesh = self.meshes.len() as u32;
        self.meshes.push(Mesh::single(name, shape, material));
        self.instances.push(Instance::new(name, mesh, transform));
        mesh
    }
}

/// The Cornell box with its measured reflectances, in units of 10 cm: two blocks and a light in the ceiling.
#[must_use]
pub fn cornell() -> Scene {
    let mut scene = cornell_walls("cornell");
    let white = 0;
    let short = mm(&[
        [[130., 165., 65.], [82., 165., 225.], [240., 165., 272.], [290., 165., 114.]],
        [[290., 0., 114.], [290., 165., 114.], [240., 165., 272.], [240., 0., 272.]],
        [[130., 0., 65.], [130., 165., 65.], [290., 165., 114.], [290., 0., 114.]],
        [[82., 0., 225.], [82., 165., 225.], [130., 165., 65.], [130., 0., 65.]],
        [[240., 0., 272.], [240., 165., 272.], [82., 165., 225.], [82., 0., 225.]],
    ]);
    let tall = mm(&[
        [[423., 330., 247.], [265., 330., 296.], [314., 330., 456.], [472., 330., 406.]],
        [[423., 0., 247.], [423., 330., 247.], [472., 330., 406.], [472., 0., 406.]],
        [[472., 0., 406.], [472., 330., 406.], [314., 330., 456.], [314., 0., 456.]],
        [[314., 0., 456.], [314., 330., 456.], [265., 330., 296.], [265., 0., 296.]],
        [[265., 0., 296.], [265., 330., 296.], [423., 330., 247.], [423., 0., 247.]],
    ]);
    scene.add_mesh("short", short, white);
    scene.add_mesh("tall", tall, white);
    scene
}

/// The Cornell box with a sphere and a box of glass.
#[must_use]
pub fn glass() -> Scene {
    let mut scene = cornell_walls("glass");
    let glass = scene.add_material(dielectric("glass", 1.5, 0.0));
    let place = |scale: f64, turn: DQuat, at: [f64; 3]| {
        let (scale, turn, at) = (DVec3::splat(scale), turn, DVec3::from(at));
        Affine3A::from_scale_rotation_translation(scale.as_vec3(), as_quat(turn), at.as_vec3())
    };
    let ball = Shape::Triangles(uv_sphere(256, 128));
    scene.add_shape("sphere", ball, glass, place(0.95, DQuat::IDENTITY, [3.75, 0.96, 3.6]));
    let turn = DQuat::from_rotation_y(17f64.to_radians());
    let block = Shape::Triangles(cuboid([-1.0; 3], [1.0; 3]));
    scene.add_shape("box", block, glass, place(0.8, turn, [1.75, 0.81, 1.75]));
    scene
}

/// Fifteen spheres of three metallic-roughness materials with five roughnesses each, on a floor under a white sky.
#[must_use]
pub fn spheres() -> Scene {
    let mut scene = Scene { name: "spheres".into(), ..Scene::default() };
    scene.environment = Environment::Constant(Vec3::ONE);
    let rows = [
        ("gold", [1.0, 0.766, 0.336], 1.0),
        ("red plastic", [0.6, 0.05, 0.03], 0.0),
        ("half", [0.4, 0.5, 0.8], 0.5),
    ];
    for (row, (name, color, metallic)) in rows.into_iter().enumerate() {
        for (i, roughness) in [0.1, 0.25, 0.5, 0.75, 1.0].into_iter().enumerate() {
            let name = format!("{name} {roughness}");
            let material = scene.add_material(metallic_roughness(&name, color, metallic, roughness));
            let at = DVec3::new((i as f64 - 2.0) * 2.3, 1.0, (row as f64 - 1.0) * -2.3);
            let ball = Shape::Triangles(uv_sphere(128, 64));
            scene.add_shape(&name, ball, material, Affine3A::from_translation(at.as_vec3()));
        }
    }
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", square(20.0, 0.0), floor);
    scene.cameras.push(camera([0.0, 9.0, 13.0], [0.0, 0.4, 0.0], 38.0));
    scene
}

/// A square in x and z from `-half_size` to `half_size` at `y`, facing up.
fn square(half_size: f64, y: f64) -> TriangleMesh {
    let s = half_size;
    quads(&[[[-s, y, -s], [-s, y, s], [s, y, s], [s, y, -s]]])
}

/// A pinhole camera; `fov_y` in degrees.
#[must_use]
pub fn camera(eye: [f64; 3], target: [f64; 3], fov_y: f64) -> Camera {
    let point = |p: [f64; 3]| DVec3::from(p).as_vec3();
    Camera::perspective("camera", point(eye), point(target), fov_y.to_radians() as f32)
}

/// The empty Cornell box: floor, ceiling around the light, light, back, right and left wall. Material 0 is white.
fn cornell_walls(name: &str) -> Scene {
    let mut scene = Scene { name: name.into(), ..Scene::default() };
    let white = scene.add_material(lambert("white", [0.725, 0.71, 0.68]));
    let red = scene.add_material(lambert("red", [0.63, 0.065, 0.05]));
    let green = scene.add_material(lambert("green", [0.14, 0.45, 0.091]));
    let light = Material { emission: Vec3::new(17.0, 12.0, 4.0), ..lambert("light", [0.78; 3]) };
    let light = scene.add_material(light);
    let (x0, x1, z0, z1, h) = (213., 343., 227., 332., 548.8);
    let ceiling = [
        [[556., h, 0.], [556., h, z0], [0., h, z0], [0., h, 0.]],
        [[556., h, z1], [556., h, 559.2], [0., h, 559.2], [0., h, z1]],
        [[556., h, z0], [556., h, z1], [x1, h, z1], [x1, h, z0]],
        [[x0, h, z0], [x0, h, z1], [0., h, z1], [0., h, z0]],
    ];
    let walls = [
        ("floor", [[552.8, 0., 0.], [0., 0., 0.], [0., 0., 559.2], [549.6, 0., 559.2]], white),
        ("light", [[x1, h, z0], [x1, h, z1], [x0, h, z1], [x0, h, z0]], light),
        ("back", [[549.6, 0., 559.2], [0., 0., 559.2], [0., h, 559.2], [556., h, 559.2]], white),
        ("right", [[0., 0., 559.2], [0., 0., 0.], [0., h, 0.], [0., h, 559.2]], green),
        ("left", [[552.8, 0., 0.], [549.6, 0., 559.2], [556., h, 559.2], [556., h, 0.]], red),
    ];
    for (name, corners, material) in walls {
        scene.add_mesh(name, mm(&[corners]), material);
    }
    scene.add_mesh("ceiling", mm(&ceiling), white);
    let fov = 2.0 * atan(0.0125f64 / 0.035).to_degrees();
    scene.cameras.push(camera([2.78, 2.73, -8.0], [2.78, 2.73, 0.0], fov));
    scene
}

/// Corners in millimetres as the measurements have them.
fn mm(corners: &[[[f64; 3]; 4]]) -> TriangleMesh {
    quads(&corners.iter().map(|quad| quad.map(|p| p.map(|c| c * 0.01))).collect::<Vec<_>>())
}

fn as_quat(q: DQuat) -> Quat {
    Quat::from_xyzw(q.x as f32, q.y as f32, q.z as f32, q.w as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_have_the_triangles_that_the_references_say() {
        assert_eq!(cornell().instanced_triangles(), 38);
        assert_eq!(glass().instanced_triangles(), 65_054);
        assert_eq!(spheres().instanced_triangles(), 241_922);
    }

    #[test]
    fn spheres_and_boxes_face_outwards() {
        for mesh in [uv_sphere(16, 8), cuboid([-1.0; 3], [1.0; 3])] {
            for t in &mesh.indices {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{a} {b} {c}");
            }
        }
    }
}
