//! Nodes: hierarchies, cameras, lights, instancing, skins.

use super::File;
use super::data::Holds;
use serde_json::{Value, json};

impl File<'_, '_> {
    /// Makes nodes with all that hangs on them; how many.
    pub(super) fn add_nodes(&mut self) -> usize {
        self.add_cameras_and_lights();
        let count = 1 + self.choices.below(8);
        for number in 0..count {
            let node = self.node(number, count);
            self.nodes.push(node);
        }
        count
    }

    /// A node of the finished list.
    pub(super) fn node_index(&mut self) -> u32 {
        self.choices.index(self.nodes.len())
    }

    fn add_cameras_and_lights(&mut self) {
        if self.choices.once_in(2) {
            let [yfov, aspect] = [0.2 + 2.0 * self.share(), 0.5 + self.share()];
            self.cameras.push(json!({ "type": "perspective",
                "perspective": { "yfov": yfov, "aspectRatio": aspect, "znear": 0.1 } }));
        }
        if self.choices.once_in(6) {
            let [x, y] = self.numbers();
            self.cameras
                .push(json!({ "type": "orthographic", "orthographic": { "xmag": x, "ymag": y, "znear": 0, "zfar": 9 } }));
        }
        for _ in 0..self.choices.below(3) {
            let kind = self.choices.one_of(&["point", "spot", "directional"]);
            let mut light = json!({ "type": kind, "color": self.shares::<3>(), "intensity": self.choices.size().min(1e6) });
            if kind == "spot" {
                let [inner, outer] = self.shares();
                light["spot"] = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
            }
            if self.choices.once_in(6) {
                light["range"] = json!(self.choices.number());
            }
            self.lights.push(light);
        }
    }

    fn node(&mut self, number: usize, count: usize) -> Value {
        let mut node = json!({ "name": format!("node {number}") });
        // Children come later in the list; once in a while not, which may make a cycle.
        if number + 1 < count && self.choices.once_in(3) {
            let child = number as u32 + 1 + self.choices.index(count - number - 1);
            node["children"] = json!([child]);
        } else if self.choices.once_in(64) {
            node["children"] = json!([self.choices.index(count)]);
        }
        if self.choices.once_in(8) {
            let matrix: [f64; 16] = std::array::from_fn(|i| match (i, self.choices.once_in(6)) {
                (0 | 5 | 10 | 15, false) => 1.0,
                (_, false) => 0.0,
                (_, true) => self.choices.number(),
            });
            node["matrix"] = json!(matrix);
        } else {
            self.place(&mut node);
        }
        if !self.choices.once_in(4) {
            node["mesh"] = json!(self.choices.index(self.meshes.len()));
        }
        if self.choices.once_in(6) {
            node["skin"] = json!(self.choices.index(1));
        }
        if self.choices.once_in(8) {
            node["weights"] = json!(self.numbers::<2>());
        }
        if !self.cameras.is_empty() && self.choices.once_in(2) {
            node["camera"] = json!(self.choices.index(self.cameras.len()));
        }
        self.add_extensions(&mut node);
        node
    }

    fn place(&mut self, node: &mut Value) {
        if self.choices.once_in(2) {
            node["translation"] = json!(self.numbers::<3>());
        }
        if self.choices.once_in(3) {
            node["rotation"] = json!(self.numbers::<4>());
        }
        if self.choices.once_in(3) {
            node["scale"] = json!(self.numbers::<3>());
        }
    }

    fn add_extensions(&mut self, node: &mut Value) {
        if !self.lights.is_empty() && self.choices.once_in(2) {
            let light = self.choices.index(self.lights.len());
            node["extensions"]["KHR_lights_punctual"] = json!({ "light": light });
        }
        if self.choices.once_in(10) {
            let count = 1 + self.choices.below(6);
            let translation = self.add_accessor("VEC3", 3, count, Holds::Numbers);
            let mut attributes = json!({ "TRANSLATION": translation });
            if self.choices.once_in(2) {
                attributes["ROTATION"] = json!(self.add_accessor("VEC4", 4, count, Holds::Numbers));
            }
            if self.choices.once_in(2) {
                attributes["SCALE"] = json!(self.add_accessor("VEC3", 3, count, Holds::Numbers));
            }
            node["extensions"]["EXT_mesh_gpu_instancing"] = json!({ "attributes": attributes });
        }
        if self.choices.once_in(16) {
            node["extensions"]["KHR_node_visibility"] = json!({ "visible": self.choices.once_in(2) });
        }
    }

    /// The skin that nodes name, for some files.
    pub(super) fn add_skins(&mut self, count: usize) {
        if self.choices.once_in(4) {
            return;
        }
        let joints: Vec<u32> = (0..4).map(|_| self.choices.index(count)).collect();
        let mut skin = json!({ "joints": joints });
        if self.choices.once_in(2) {
            skin["inverseBindMatrices"] = json!(self.add_accessor("MAT4", 16, 4, Holds::Numbers));
        }
        self.skins.push(skin);
    }
}
