//! Random glTF files that get past the parser: every object is of the right kind, and what refers to others mostly finds them.
//!
//! Changed bytes of a real file rarely get deeper than the first check. Here the structure is right, and numbers, counts,
//! indices and combinations of features are what is random. The order is that of dependencies: `data` makes accessors in
//! buffers, `images` pictures, `materials` what uses them, `meshes` what uses all that, `nodes` puts it into a scene.

mod animations;
mod data;
mod images;
mod materials;
mod meshes;
mod nodes;

use crate::Choices;
use serde_json::{Map, Value, json};

/// A file that is being made.
struct File<'a, 'b> {
    choices: &'a mut Choices<'b>,
    /// The binary part.
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
    textures: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    skins: Vec<Value>,
    animations: Vec<Value>,
    nodes: Vec<Value>,
}

/// A binary glTF file (`.glb`) that nothing but `choices` decides about. It names no other file.
pub fn random_glb(choices: &mut Choices<'_>) -> Vec<u8> {
    let mut file = File {
        choices,
        binary: Vec::new(),
        views: Vec::new(),
        accessors: Vec::new(),
        images: Vec::new(),
        textures: Vec::new(),
        materials: Vec::new(),
        meshes: Vec::new(),
        cameras: Vec::new(),
        lights: Vec::new(),
        skins: Vec::new(),
        animations: Vec::new(),
        nodes: Vec::new(),
    };
    file.add_textures();
    file.add_materials();
    file.add_meshes();
    let count = file.add_nodes();
    file.add_skins(count);
    file.add_animations(count);
    let json = file.json();
    container(json.to_string().as_bytes(), &file.binary)
}

impl File<'_, '_> {
    fn json(&mut self) -> Value {
        let roots: Vec<u32> = (0..1 + self.choices.below(4)).map(|_| self.node_index()).collect();
        let all = [
            ("bufferViews", &self.views),
            ("accessors", &self.accessors),
            ("images", &self.images),
            ("textures", &self.textures),
            ("materials", &self.materials),
            ("meshes", &self.meshes),
            ("cameras", &self.cameras),
            ("skins", &self.skins),
            ("animations", &self.animations),
            ("nodes", &self.nodes),
        ];
        let mut json = Map::new();
        for (name, list) in all.into_iter().filter(|(_, list)| !list.is_empty()) {
            json.insert(name.into(), Value::Array(list.clone()));
        }
        json.insert("asset".into(), json!({ "version": "2.0" }));
        json.insert("scene".into(), json!(0));
        json.insert("scenes".into(), json!([{ "nodes": roots }]));
        json.insert("buffers".into(), json!([{ "byteLength": self.binary.len() }]));
        json.insert("extensions".into(), json!({ "KHR_lights_punctual": { "lights": self.lights } }));
        Value::Object(json)
    }

    /// Three numbers for JSON.
    fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.choices.number())
    }

    /// Numbers of `[0, 1]`, now and then others.
    fn shares<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.share())
    }

    fn share(&mut self) -> f64 {
        if self.choices.once_in(32) { self.choices.number() } else { self.choices.share() }
    }
}

/// The two parts of a binary file in one.
fn container(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let padded = |part: &[u8], with: u8| {
        let mut part = part.to_vec();
        part.resize(part.len().next_multiple_of(4), with);
        part
    };
    let (json, binary) = (padded(json, b' '), padded(binary, 0));
    let length = (28 + json.len() + binary.len()) as u32;
    let mut file = [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes()].concat();
    for (kind, part) in [(b"JSON", json), (b"BIN\0", binary)] {
        file.extend((part.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(part);
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::LoadOptions;
    use std::path::Path;

    /// The generator is of use only if most of its files are drawn; and only if some are not.
    #[test]
    fn most_files_load_and_some_do_not() {
        let options = LoadOptions { lenient: true, ..LoadOptions::default() };
        let load = |seed| {
            let file = random_glb(&mut Choices::from_seed(seed));
            scene::load::gltf::load_bytes(Path::new("random.glb"), &file, &options)
        };
        let loaded: Vec<_> = (0..200).filter_map(|seed| load(seed).ok()).collect();
        assert!((100..200).contains(&loaded.len()), "{} of 200", loaded.len());
        let have = |what: fn(&scene::Scene) -> bool| loaded.iter().filter(|l| what(&l.scene)).count();
        let features = [
            ("images", have(|s| !s.images.is_empty())),
            ("lights", have(|s| !s.lights.is_empty())),
            ("cameras", have(|s| !s.cameras.is_empty())),
            ("animations", have(|s| !s.animations.is_empty())),
            ("transmission", have(|s| s.materials.iter().any(|m| m.transmission > 0.0))),
            ("emission", have(|s| s.materials.iter().any(|m| m.emission.max_element() > 0.0))),
        ];
        assert!(features.iter().all(|(_, count)| *count >= 10), "{features:?}");
    }

    #[test]
    fn equal_choices_make_equal_files() {
        let made = |seed| random_glb(&mut Choices::from_seed(seed));
        assert!(made(5) == made(5) && made(5) != made(6));
        assert!(random_glb(&mut Choices::from_bytes(&[])).starts_with(b"glTF"));
    }
}
