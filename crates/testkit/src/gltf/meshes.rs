//! Meshes: primitives of all modes, attributes of all kinds, morph targets.

use super::File;
use super::data::Holds;
use serde_json::{Map, Value, json};

/// Vertices of a primitive at most.
const MOST_VERTICES: usize = 24;

impl File<'_, '_> {
    pub(super) fn add_meshes(&mut self) {
        for _ in 0..1 + self.choices.below(3) {
            let count = 1 + self.choices.below(3);
            let primitives: Vec<Value> = (0..count).map(|_| self.primitive()).collect();
            let mut mesh = json!({ "primitives": primitives });
            if self.choices.once_in(4) {
                mesh["weights"] = json!(self.numbers::<2>());
            }
            self.meshes.push(mesh);
        }
    }

    fn primitive(&mut self) -> Value {
        let vertices = 3 + self.choices.below(MOST_VERTICES - 2);
        let mut attributes = Map::new();
        let mut add = |file: &mut Self, name: &str, kind: &str, width, holds| {
            // One in a few lists is shorter or longer than the others.
            let count = if file.choices.once_in(64) { file.choices.below(30) } else { vertices };
            let accessor = match file.accessors.len() {
                made if made > 0 && file.choices.once_in(64) => file.choices.index(made),
                _ => file.add_accessor(kind, width, count, holds),
            };
            attributes.insert(name.into(), json!(accessor));
        };
        if !self.choices.once_in(64) {
            add(self, "POSITION", "VEC3", 3, Holds::Numbers);
        }
        let optional = [
            ("NORMAL", "VEC3", 3, Holds::Numbers),
            ("TANGENT", "VEC4", 4, Holds::Numbers),
            ("TEXCOORD_0", "VEC2", 2, Holds::Numbers),
            ("TEXCOORD_1", "VEC2", 2, Holds::Shares),
            ("COLOR_0", "VEC4", 4, Holds::Shares),
            ("JOINTS_0", "VEC4", 4, Holds::Below(4)),
            ("WEIGHTS_0", "VEC4", 4, Holds::Shares),
        ];
        for (name, kind, width, holds) in optional {
            if self.choices.once_in(2) {
                add(self, name, kind, width, holds);
            }
        }
        let mut primitive = json!({ "attributes": attributes });
        if self.choices.once_in(2) {
            let count = 3 * (1 + self.choices.below(12)) + usize::from(self.choices.once_in(32));
            primitive["indices"] = json!(self.add_accessor("SCALAR", 1, count, Holds::Below(vertices)));
        }
        if self.choices.once_in(6) {
            primitive["mode"] = json!(self.choices.one_of(&[4, 5, 6, 0, 1, 2, 3, 9]));
        }
        if !self.choices.once_in(4) {
            primitive["material"] = json!(self.choices.index(self.materials.len()));
            if self.materials.is_empty()
                && let Some(fields) = primitive.as_object_mut()
            {
                fields.remove("material");
            }
        }
        if self.choices.once_in(16) {
            self.compress(&mut primitive, vertices);
        }
        if self.choices.once_in(6) {
            let targets: Vec<Value> =
                (0..1 + self.choices.below(3)).map(|_| self.morph_target(vertices)).collect();
            primitive["targets"] = json!(targets);
        }
        primitive
    }

    /// Positions by a stream that begins as Draco's do.
    fn compress(&mut self, primitive: &mut Value, vertices: usize) {
        let mut stream = b"DRACO\x02\x02".to_vec();
        stream.extend([self.choices.below(2) as u8, self.choices.below(2) as u8, 0, 0]);
        for _ in 0..self.choices.below(200) {
            stream.push(self.choices.byte());
        }
        let view = self.add_view(&stream, None);
        self.accessors.push(json!({ "componentType": 5126, "count": vertices, "type": "VEC3" }));
        primitive["attributes"]["POSITION"] = json!(self.accessors.len() - 1);
        primitive["extensions"] = json!({ "KHR_draco_mesh_compression":
            { "bufferView": view, "attributes": { "POSITION": self.choices.below(3) } } });
    }

    fn morph_target(&mut self, vertices: usize) -> Value {
        let mut target = Map::new();
        for name in ["POSITION", "NORMAL", "TANGENT"] {
            if !self.choices.once_in(3) {
                target.insert(name.into(), json!(self.add_accessor("VEC3", 3, vertices, Holds::Numbers)));
            }
        }
        Value::Object(target)
    }
}
