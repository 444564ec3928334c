//! What a path did as lines, for pictures of it.

use crate::projection::picture_point;
use backend::View;
use cpu::{LightVisibility, PathRecord, VertexPlace, VertexRecord};
use glam::{DVec2, DVec3};
use serde::Serialize;

/// How far paths are drawn that leave the scene, as a multiple of their length until then.
const OUTWARDS: f64 = 2.0;
/// Lines are drawn in so many pieces: cameras may bend them.
const PIECES: u32 = 64;

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathLineKind {
    /// The path goes there.
    Segment,
    /// A light that was sampled, and is seen from the vertex.
    ToLight,
    /// A light that was sampled, and is not.
    Occluded,
}

/// A line from one point of the scene to another, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathLine {
    /// What it is.
    pub kind: PathLineKind,
    /// Index of the vertex that it comes to, or that the light was sampled from.
    pub vertex: usize,
    /// Where it begins.
    pub from: DVec3,
    /// Where it ends.
    pub to: DVec3,
    /// How much light it can carry: the largest component of the throughput at its vertex.
    pub throughput: f32,
}

/// The lines of a path, in the order in which they came to be. The first segment is left out: it is a point of the picture.
pub fn path_lines(path: &PathRecord) -> Vec<PathLine> {
    let mut lines = Vec::new();
    let mut from = vector(path.origin);
    let mut length = 0.0;
    for (index, vertex) in path.vertices.iter().enumerate() {
        let throughput = vertex.throughput.into_iter().fold(0.0, f32::max);
        let line = |kind, from, to| PathLine { kind, vertex: index, from, to, throughput };
        let to = match &vertex.place {
            VertexPlace::Surface(surface) => vector(surface.position),
            VertexPlace::Distant => from + vector(vertex.direction) * (OUTWARDS * f64::max(length, 1.0)),
        };
        if index > 0 {
            lines.push(line(PathLineKind::Segment, from, to));
        }
        length += (to - from).length();
        lines.extend(light_line(vertex, to, length).map(|(kind, end)| line(kind, to, end)));
        from = to;
    }
    lines
}

/// What the line to a vertex's light sample is, and where it ends; `None` without a sample that could be seen.
fn light_line(vertex: &VertexRecord, from: DVec3, length: f64) -> Option<(PathLineKind, DVec3)> {
    let sample = vertex.light_sample.as_ref()?;
    let kind = match sample.visibility {
        LightVisibility::Visible => PathLineKind::ToLight,
        LightVisibility::Occluded => PathLineKind::Occluded,
        LightVisibility::Behind | LightVisibility::Dark => return None,
    };
    let distance = f64::from(sample.distance);
    let distance = if distance.is_finite() { distance } else { OUTWARDS * length };
    Some((kind, from + vector(sample.direction) * distance))
}

impl PathLine {
    /// The line as a picture shows it: pieces from point to point, in pixels from the upper left corner. What the camera does
    /// not see is left out.
    pub fn in_picture(&self, view: &View) -> Vec<[DVec2; 2]> {
        let origin = vector(view.camera.origin.to_array());
        let point = |i: u32| {
            let at = self.from.lerp(self.to, f64::from(i) / f64::from(PIECES));
            picture_point(&view.camera, view.width, view.height, at - origin)
        };
        (0..PIECES).filter_map(|i| Some([point(i)?, point(i + 1)?])).collect()
    }
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}
