//! Subdivision surfaces and displacement.

use super::Scene;
use crate::errors::bad;
use crate::material::add_texture;
use alhazen::subdivision::{Cage, Displacement, DisplacementSpace, Rate, Refinement, Scheme};
use alhazen::{ColorSpace, LoadReport, Shape};
use pyo3::prelude::*;

#[pymethods]
impl Scene {
    /// Makes a mesh a smooth surface, a displaced one, or both: its triangles take the place of those of the mesh.
    ///
    /// Parameters
    /// ----------
    /// mesh : int
    ///     What `add_mesh` returned. Vertices in the same position are one.
    /// scheme : "catmull-clark", "loop" or "linear", default "catmull-clark"
    ///     "linear" leaves faces where they are, for displacement alone.
    /// levels : int, optional
    ///     How often faces are split; 2 if nothing else is said.
    /// edge_length, edge_pixels : float, optional
    ///     Faces are split until no edge is longer, in units of the object or in pixels of a picture that the first camera
    ///     takes.
    /// max_levels : int, default 8
    ///     Faces are not split more often by these.
    /// height : int, default 720
    ///     Height of that picture.
    /// polygons : sequence of sequences of int, optional
    ///     Faces of any number of corners, as indices of the mesh's vertices. Without them two triangles that follow each
    ///     other and lie in a plane are a quadrilateral.
    /// crease_angle : float, optional
    ///     Edges whose faces meet at more than this angle (degrees) stay sharp.
    /// creases : sequence of (int, int, float), optional
    ///     Edges, by two vertices, and for how many levels they stay sharp; from 10 on for ever.
    /// corners : sequence of (int, float), optional
    ///     Vertices that stay where they are, and for how many levels.
    /// displacement : array_like or dict, optional
    ///     A picture, whose bytes are linear, or a texture that is computed.
    /// scale, midlevel : float, default 1 and 0
    ///     The surface moves by `scale * (value - midlevel)`.
    /// space : "normal", "tangent" or "object", default "normal"
    ///     Whether red is a height along the normal, or RGB a vector.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     What had to be mended.
    #[pyo3(signature = (
        mesh, *, scheme="catmull-clark", levels=None, edge_length=None, edge_pixels=None, max_levels=8, height=720,
        polygons=None, crease_angle=None, creases=Vec::new(), corners=Vec::new(), displacement=None, scale=1.0,
        midlevel=0.0, space="normal",
    ))]
    fn subdivide(
        &self,
        py: Python,
        mesh: u32,
        scheme: &str,
        levels: Option<u32>,
        edge_length: Option<f32>,
        edge_pixels: Option<f32>,
        max_levels: u32,
        height: u32,
        polygons: Option<Vec<Vec<u32>>>,
        crease_angle: Option<f32>,
        creases: Vec<(u32, u32, f32)>,
        corners: Vec<(u32, f32)>,
        displacement: Option<&Bound<PyAny>>,
        scale: f32,
        midlevel: f32,
        space: &str,
    ) -> PyResult<Vec<String>> {
        let scheme = Scheme::named(scheme)
            .ok_or_else(|| bad(format!("scheme: `{scheme}` is none of catmull-clark, loop and linear")))?;
        let space = DisplacementSpace::named(space)
            .ok_or_else(|| bad(format!("space: `{space}` is none of normal, tangent and object")))?;
        let rate = rate(levels, edge_length, edge_pixels, max_levels)?;
        self.change(py, |scene| {
            let known = scene.meshes.get(mesh as usize);
            let known = known.ok_or_else(|| bad(format!("mesh: {mesh} of only {}", scene.meshes.len())))?;
            let mut refinement = Refinement::of_mesh(mesh, known, true)
                .ok_or_else(|| bad(format!("mesh: {mesh} has no triangles")))?;
            let [part] = &known.parts[..] else { return Err(bad(format!("mesh: {mesh} has several parts"))) };
            let Shape::Triangles(old) = &part.shape else {
                return Err(bad(format!("mesh: {mesh} has no triangles")));
            };
            let count = old.positions.len() as u32;
            let place = |name: &str, vertex: u32| {
                if vertex < count {
                    Ok(vertex)
                } else {
                    Err(bad(format!("{name}: {vertex} of only {count}")))
                }
            };
            if let Some(polygons) = polygons {
                refinement.cage = Cage {
                    positions: old.positions.clone(),
                    colors: old.colors.clone(),
                    uvs: [old.uv0.clone(), old.uv1.clone()],
                    materials: vec![part.material],
                    ..Cage::default()
                };
                let cage = &mut refinement.cage;
                for polygon in polygons {
                    for vertex in polygon {
                        cage.positions_of.push(place("polygons", vertex)?);
                    }
                    cage.ends.push(cage.positions_of.len() as u32);
                }
                for set in 0..2 {
                    if !cage.uvs[set].is_empty() {
                        cage.uvs_of[set].clone_from(&cage.positions_of);
                    }
                }
            }
            // A cage of triangles has one position for vertices that share it.
            let cage = &mut refinement.cage;
            let found = |vertex: u32| {
                let position = old.positions[vertex as usize];
                cage.positions.iter().position(|p| *p == position).map(|place| place as u32)
            };
            let mut sharp = Vec::new();
            for (a, b, sharpness) in creases {
                let ends = (found(place("creases", a)?), found(place("creases", b)?));
                if let (Some(a), Some(b)) = ends {
                    sharp.push(([a, b], sharpness));
                }
            }
            let mut pinned = Vec::new();
            for (vertex, sharpness) in corners {
                pinned.extend(found(place("corners", vertex)?).map(|vertex| (vertex, sharpness)));
            }
            (cage.creases, cage.corners) = (sharp, pinned);
            if let Some(angle) = crease_angle {
                cage.crease_by_angle(angle.to_radians(), Cage::ENDLESS);
            }
            (refinement.scheme, refinement.rate) = (scheme, rate);
            if let Some(picture) = displacement {
                let texture = add_texture(scene, "displacement", picture, ColorSpace::Linear)?;
                refinement.displacement = Some(Displacement { texture, scale, midlevel, space });
            }
            scene.refinements = vec![refinement];
            let mut report = LoadReport::default();
            scene.refine(height, &mut report).map_err(|error| bad(error.to_string()))?;
            Ok(report.notes.into_iter().map(|note| note.message).collect())
        })
    }
}

fn rate(
    levels: Option<u32>,
    edge_length: Option<f32>,
    edge_pixels: Option<f32>,
    max_levels: u32,
) -> PyResult<Rate> {
    let most_levels = Rate::MOST_LEVELS;
    if levels.unwrap_or(0).max(max_levels) > most_levels {
        return Err(bad(format!("levels, max_levels: {most_levels} are the most")));
    }
    let positive = |name: &str, most: f32| {
        if most > 0.0 { Ok(most) } else { Err(bad(format!("{name}: {most} is not positive"))) }
    };
    match (levels, edge_length, edge_pixels) {
        (levels, None, None) => Ok(Rate::Levels(levels.unwrap_or(2))),
        (None, Some(most), None) => {
            Ok(Rate::Length { most: positive("edge_length", most)?, levels: max_levels })
        }
        (None, None, Some(most)) => {
            Ok(Rate::Pixels { most: positive("edge_pixels", most)?, levels: max_levels })
        }
        _ => Err(bad("levels, edge_length and edge_pixels exclude each other")),
    }
}
