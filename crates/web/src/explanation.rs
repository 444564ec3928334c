//! What a sample of a pixel did, for a page that draws it.

use alhazen::{PathLineKind, SampleRecord, Scene, VertexPlace, View, path_lines};
use serde::Serialize;
use std::collections::BTreeMap;

/// A sample, the names of what it met, and its lines in the picture.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// What it did: `docs/explain.md` names the fields.
    pub sample: SampleRecord,
    /// Names of the instances that its paths met.
    pub instances: BTreeMap<u32, String>,
    /// Names of their materials.
    pub materials: BTreeMap<u32, String>,
    /// Its lines, path by path, in the order in which they came to be.
    pub lines: Vec<Line>,
}

/// A line as the picture shows it.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// What it is.
    pub kind: PathLineKind,
    /// Index of its path, and of the vertex that it belongs to.
    pub path: usize,
    /// See [`alhazen::PathLine::vertex`].
    pub vertex: usize,
    /// See [`alhazen::PathLine::throughput`].
    pub throughput: f32,
    /// Pieces from x, y to x, y; pixels from the upper left corner.
    pub pieces: Vec<[f64; 4]>,
}

impl Explanation {
    /// Of a sample of a view.
    pub(crate) fn new(scene: &Scene, view: &View, sample: SampleRecord) -> Self {
        let (mut instances, mut materials) = (BTreeMap::new(), BTreeMap::new());
        for vertex in sample.paths.iter().flat_map(|path| &path.vertices) {
            if let VertexPlace::Surface(surface) = vertex.place {
                let instance = scene.instances.get(surface.instance as usize);
                instances.insert(surface.instance, instance.map_or_else(String::new, |i| i.name.clone()));
                let material = scene.materials.get(surface.material as usize);
                materials.insert(surface.material, material.map_or_else(String::new, |m| m.name.clone()));
            }
        }
        let lines = sample.paths.iter().enumerate().flat_map(|(path, record)| {
            path_lines(record).into_iter().map(move |line| Line {
                kind: line.kind,
                path,
                vertex: line.vertex,
                throughput: line.throughput,
                pieces: line.in_picture(view).iter().map(|[a, b]| [a.x, a.y, b.x, b.y]).collect(),
            })
        });
        let lines = lines.collect();
        Self { sample, instances, materials, lines }
    }
}
