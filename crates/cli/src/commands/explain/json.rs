//! Paths for programs.

use super::Explained;
use alhazen::VertexPlace;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// All samples as they were recorded, their mean, and the names of the instances and materials that they meet.
pub fn of(explained: &Explained) -> serde_json::Result<Value> {
    let (mut instances, mut materials) = (BTreeMap::new(), BTreeMap::new());
    let paths = explained.samples.iter().flat_map(|sample| &sample.paths);
    for vertex in paths.flat_map(|path| &path.vertices) {
        if let VertexPlace::Surface(surface) = vertex.place {
            instances.insert(surface.instance, explained.instance(surface.instance));
            materials.insert(surface.material, explained.material(surface.material));
        }
    }
    let samples = serde_json::to_value(&explained.samples)?;
    Ok(
        json!({ "mean": explained.mean(), "instances": instances, "materials": materials, "samples": samples }),
    )
}
