//! Reads the scene descriptions beside the shared reference pictures of the Ignis project, as far as our features go.

use crate::scenes::{Build, dielectric, lambert};
use glam::{Affine3A, Mat3, Vec3};
use scene::{Camera, Environment, Light, LightKind, LoadOptions, Material, Model, Scene, Shape, Sphere};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A scene and the longest path that its description asks for, as it counts.
pub struct IgnisScene {
    /// The scene.
    pub scene: Scene,
    /// `max_depth` of the technique.
    pub max_depth: u32,
}

/// Objects by name; what comes later replaces what came before.
#[derive(Default)]
struct Description {
    shapes: BTreeMap<String, (PathBuf, Value)>,
    bsdfs: BTreeMap<String, Value>,
    entities: BTreeMap<String, Value>,
    lights: BTreeMap<String, Value>,
    camera: Value,
    max_depth: u32,
}

/// Reads a description and what it refers to.
///
/// # Panics
/// On anything that it does not know: a test must not compare a scene of which it has left something out.
#[must_use]
pub fn load_ignis(path: &Path) -> IgnisScene {
    let mut description = Description::default();
    description.read(path);
    description.build(path)
}

impl Description {
    fn read(&mut self, path: &Path) {
        let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let json: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let folder = path.parent().unwrap_or(Path::new("."));
        for external in list(&json["externals"]) {
            self.read(&folder.join(text_of(&external["filename"])));
        }
        for shape in list(&json["shapes"]) {
            self.shapes.insert(text_of(&shape["name"]), (folder.to_owned(), shape.clone()));
        }
        for bsdf in list(&json["bsdfs"]) {
            self.bsdfs.insert(text_of(&bsdf["name"]), bsdf.clone());
        }
        let named = |e: &Value| (text_of(&e["name"]), e.clone());
        self.entities.extend(list(&json["entities"]).iter().map(named));
        self.lights.extend(list(&json["lights"]).iter().map(named));
        if json["camera"].is_object() {
            self.camera = json["camera"].clone();
        }
        if let Some(depth) = json["technique"]["max_depth"].as_u64() {
            self.max_depth = depth as u32;
        }
    }

    fn build(&self, path: &Path) -> IgnisScene {
        let mut scene = Scene { name: path.display().to_string(), ..Scene::default() };
        for entity in self.entities.values() {
            let bsdf = &self.bsdfs[&text_of(&entity["bsdf"])];
            let mut material = material(bsdf);
            let is_here = |l: &&Value| l["type"] == "area" && l["entity"] == entity["name"];
            for light in self.lights.values().filter(is_here) {
                material.emission += color(&light["radiance"]);
            }
            let material = scene.add_material(material);
            let (folder, shape) = &self.shapes[&text_of(&entity["shape"])];
            let place = transform(&entity["transform"]) * transform(&shape["transform"]);
            for surface in surfaces(folder, shape) {
                scene.add_shape(&text_of(&entity["name"]), surface, material, place);
            }
        }
        for light in self.lights.values() {
            match light["type"].as_str() {
                Some("area") => {}
                Some("point") => scene.lights.push(Light::new(
                    text_of(&light["name"]),
                    LightKind::Point {
                        position: color(&light["position"]),
                        intensity: color(&light["intensity"]),
                    },
                )),
                Some("constant") => scene.environment = Environment::Constant(color(&light["radiance"])),
                other => panic!("{}: light {other:?} is not known", path.display()),
            }
        }
        scene.cameras.push(camera(&self.camera));
        IgnisScene { scene, max_depth: self.max_depth }
    }
}

fn material(bsdf: &Value) -> Material {
    match bsdf["type"].as_str() {
        Some("diffuse") => lambert("diffuse", color(&bsdf["reflectance"]).to_array()),
        Some("mirror") => Material { model: Model::Mirror, ..lambert("mirror", [1.0; 3]) },
        Some("dielectric") => {
            let thin_walled = bsdf["thin"].as_bool() == Some(true);
            Material { thin_walled, ..dielectric("glass", number(&bsdf["int_ior"]), 0.0) }
        }
        other => panic!("bsdf {other:?} is not known"),
    }
}

fn surfaces(folder: &Path, shape: &Value) -> Vec<Shape> {
    let radius = shape["radius"].as_f64().unwrap_or(1.0) as f32;
    match shape["type"].as_str() {
        Some("sphere") => vec![Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius }])],
        Some("icosphere") => vec![Shape::Triangles(scene::shapes::icosphere(radius, 4))],
        Some("obj" | "ply") => {
            let path = folder.join(text_of(&shape["filename"]));
            let loaded = scene::load::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
            let parts = loaded.scene.meshes.into_iter().flat_map(|m| m.parts);
            parts.map(|part| part.shape).collect()
        }
        other => panic!("shape {other:?} is not known"),
    }
}

fn camera(json: &Value) -> Camera {
    assert_eq!(json["type"], "perspective");
    let fov = number(&json["fov"]).to_radians();
    let look = &json["transform"][0]["lookat"];
    let (eye, axis, up) = if look.is_object() {
        (color(&look["origin"]), color(&look["direction"]), color(&look["up"]))
    } else {
        let to_world = transform(&json["transform"]);
        (to_world.translation.into(), to_world.matrix3.z_axis.into(), to_world.matrix3.y_axis.into())
    };
    Camera { up, ..Camera::perspective("camera", eye, eye + axis, fov) }
}

/// Sixteen numbers row by row, a uniform scale, or nothing.
fn transform(json: &Value) -> Affine3A {
    if let Some(scale) = json["scale"].as_f64() {
        return Affine3A::from_scale(Vec3::splat(scale as f32));
    }
    let m: Vec<f32> = list(json).iter().map(number).collect();
    match m.len() {
        0 => Affine3A::IDENTITY,
        16 => {
            let column = |i: usize| Vec3::new(m[i], m[i + 4], m[i + 8]);
            Affine3A::from_mat3_translation(Mat3::from_cols(column(0), column(1), column(2)), column(3))
        }
        n => panic!("a transform of {n} numbers"),
    }
}

fn list(json: &Value) -> &[Value] {
    json.as_array().map_or(&[], Vec::as_slice)
}

fn text_of(json: &Value) -> String {
    json.as_str().unwrap_or_else(|| panic!("{json} is not a text")).into()
}

fn number(json: &Value) -> f32 {
    json.as_f64().unwrap_or_else(|| panic!("{json} is not a number")) as f32
}

/// Three numbers, or one for all.
fn color(json: &Value) -> Vec3 {
    match list(json) {
        [] => Vec3::splat(number(json)),
        [r, g, b] => Vec3::new(number(r), number(g), number(b)),
        _ => panic!("{json} is no colour"),
    }
}
