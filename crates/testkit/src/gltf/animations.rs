//! Animations of nodes, and of what pointers name.

use super::File;
use super::data::Holds;
use serde_json::{Value, json};

/// Properties with the kind and width of their keyframes.
const PATHS: [(&str, &str, usize); 4] =
    [("translation", "VEC3", 3), ("rotation", "VEC4", 4), ("scale", "VEC3", 3), ("weights", "SCALAR", 1)];

const POINTERS: [(&str, &str, usize); 4] = [
    ("/nodes/0/translation", "VEC3", 3),
    ("/materials/0/pbrMetallicRoughness/baseColorFactor", "VEC4", 4),
    ("/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", 1),
    ("/cameras/0/perspective/yfov", "SCALAR", 1),
];

impl File<'_, '_> {
    /// Animations of a scene of `count` nodes.
    pub(super) fn add_animations(&mut self, count: usize) {
        if !self.choices.once_in(3) {
            return;
        }
        let (mut channels, mut samplers): (Vec<Value>, Vec<Value>) = (Vec::new(), Vec::new());
        for number in 0..1 + self.choices.below(3) {
            let points = self.choices.once_in(4);
            let (path, kind, width) = self.choices.one_of(if points { &POINTERS } else { &PATHS });
            let target = if points {
                json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": path } } })
            } else {
                json!({ "node": self.choices.index(count), "path": path })
            };
            samplers.push(self.keyframes(kind, width));
            channels.push(json!({ "sampler": number, "target": target }));
        }
        self.animations.push(json!({ "channels": channels, "samplers": samplers }));
    }

    fn keyframes(&mut self, kind: &str, width: usize) -> Value {
        let count = 1 + self.choices.below(4);
        let mut time = 0.0f32;
        let mut times = Vec::new();
        for _ in 0..count {
            times.extend(time.to_le_bytes());
            // Times that do not grow are wrong; a file may have them all the same.
            time += if self.choices.once_in(16) { self.choices.number() as f32 } else { 0.5 };
        }
        let view = self.add_view(&times, None);
        self.accessors
            .push(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": "SCALAR" }));
        let input = self.accessors.len() - 1;
        let interpolation = self.choices.one_of(&["LINEAR", "STEP", "CUBICSPLINE", "LINEAR"]);
        let values = count * if interpolation == "CUBICSPLINE" { 3 } else { 1 };
        let output = self.add_accessor(kind, width, values, Holds::Numbers);
        json!({ "input": input, "output": output, "interpolation": interpolation })
    }
}
