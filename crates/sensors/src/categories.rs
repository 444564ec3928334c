//! What kinds of things there are, for semantic ids.

use alhazen::Scene;
use std::collections::BTreeMap;

/// The category of every instance. Numbers start at 1, as in COCO; 0 is no thing at all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Categories {
    names: Vec<String>,
    of_instance: Vec<u32>,
}

impl Categories {
    /// Instances named in `named` have the category that stands there; all others that of their mesh's name. Numbered in the
    /// order of the instances.
    pub fn new(scene: &Scene, named: &BTreeMap<String, String>) -> Self {
        let mut categories = Self::default();
        for instance in &scene.instances {
            let of_mesh = || scene.meshes.get(instance.mesh as usize).map_or("", |m| m.name.as_str());
            let name = named.get(&instance.name).map_or_else(of_mesh, String::as_str);
            let name = if name.is_empty() { "unnamed" } else { name };
            let known = categories.names.iter().position(|n| n == name);
            let number = known.unwrap_or_else(|| {
                categories.names.push(name.to_owned());
                categories.names.len() - 1
            });
            categories.of_instance.push(number as u32 + 1);
        }
        categories
    }

    /// Number and name of each.
    pub fn list(&self) -> impl Iterator<Item = (u32, &str)> {
        (1..).zip(self.names.iter().map(String::as_str))
    }

    /// The number of an instance's category; 0 for an instance that there is not.
    pub fn of_instance(&self, instance: u32) -> u32 {
        self.of_instance.get(instance as usize).copied().unwrap_or(0)
    }
}
