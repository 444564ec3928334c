//! Meshes of a scene that are subdivided once all of it is loaded: displacement needs images, edges in pixels a camera.

use super::cage::CageReport;
use super::displacement::Displacer;
use super::rate::{PixelScale, Rate};
use super::refinement::Refinement;
use super::surface::{Tessellation, TessellationError, tessellate_within};
use crate::{LoadReport, Part, Scene, Shape};
use glam::{Affine3A, Vec3};

/// What became of a scene's refinements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Subdivided {
    /// Meshes that were subdivided.
    pub meshes: usize,
    /// Triangles that they have now.
    pub triangles: u64,
}

/// Why the meshes of a scene were not subdivided.
#[derive(Debug)]
pub(crate) enum RefineError<E> {
    /// A mesh of this name has too many faces.
    TooMany(String, TessellationError),
    /// What the caller said.
    Refused(E),
}

impl<E> From<TessellationError> for RefineError<E> {
    fn from(error: TessellationError) -> Self {
        Self::TooMany(String::new(), error)
    }
}

impl Scene {
    /// Subdivides and displaces all meshes that are to be, as a picture of `height` pixels by the first camera needs it.
    /// What had to be mended is in the report.
    ///
    /// # Errors
    /// [`TessellationError`].
    pub fn refine(&mut self, height: u32, report: &mut LoadReport) -> Result<Subdivided, TessellationError> {
        self.refine_within(height, report, |_| Ok::<_, std::convert::Infallible>(())).map_err(|error| {
            match error {
                RefineError::TooMany(_, error) => error,
                RefineError::Refused(never) => match never {},
            }
        })
    }

    /// As [`Scene::refine`]; `take` hears how many bytes are needed next, and may refuse.
    pub(crate) fn refine_within<E>(
        &mut self,
        height: u32,
        report: &mut LoadReport,
        mut take: impl FnMut(u64) -> Result<(), E>,
    ) -> Result<Subdivided, RefineError<E>> {
        let mut done = Subdivided::default();
        for refinement in std::mem::take(&mut self.refinements) {
            let Some(mesh) = self.meshes.get(refinement.mesh as usize) else { continue };
            let name = mesh.name.clone();
            let deforms = |a: &crate::Animation| a.deformations.iter().any(|d| d.mesh == refinement.mesh);
            if self.animations.iter().any(deforms) {
                report.ignored(format!("mesh {name}: it deforms, so it is not subdivided"));
                continue;
            }
            let made =
                self.tessellated(&refinement, height, |bytes| take(bytes).map_err(RefineError::Refused));
            let made = made.map_err(|error| match error {
                RefineError::TooMany(_, error) => RefineError::TooMany(name.clone(), error),
                refused => refused,
            })?;
            note(&name, &made, &refinement, report);
            done.meshes += 1;
            done.triangles += made.parts.iter().map(|mesh| mesh.indices.len() as u64).sum::<u64>();
            let parts = &mut self.meshes[refinement.mesh as usize].parts;
            for (number, triangles) in made.parts.into_iter().enumerate() {
                let shape = Shape::Triangles(triangles);
                match parts.get_mut(number) {
                    // Spheres of a mesh are no part of its cage.
                    Some(part) if matches!(part.shape, Shape::Triangles(_)) => part.shape = shape,
                    Some(_) => {}
                    None => {
                        let material = refinement.cage.materials.get(number).copied().unwrap_or(0);
                        parts.push(Part { shape, material });
                    }
                }
            }
        }
        Ok(done)
    }

    fn tessellated<E>(
        &self,
        refinement: &Refinement,
        height: u32,
        take: impl FnMut(u64) -> Result<(), RefineError<E>>,
    ) -> Result<Tessellation, RefineError<E>> {
        let Refinement { mesh, cage, scheme, rate, displacement } = refinement;
        let places: Vec<Affine3A> =
            self.instances.iter().filter(|i| i.mesh == *mesh && i.visible).map(|i| i.transform).collect();
        let first = places.first().copied().unwrap_or(Affine3A::IDENTITY);
        let displacer = displacement.map(|displacement| Displacer::new(self, displacement, first));
        let pixels = matches!(rate, Rate::Pixels { .. }).then(|| {
            let camera = self.cameras.first().cloned().unwrap_or_else(|| self.default_camera());
            let finite = || cage.positions.iter().filter(|p| p.is_finite());
            let low = finite().copied().reduce(Vec3::min).unwrap_or(Vec3::ZERO);
            let high = finite().copied().reduce(Vec3::max).unwrap_or(Vec3::ZERO);
            PixelScale::new(&camera, height, &places, [low, high])
        });
        tessellate_within(cage, *scheme, *rate, pixels.as_ref(), displacer.as_ref(), take)
    }
}

/// Says what had to be mended in a mesh.
fn note(name: &str, made: &Tessellation, refinement: &Refinement, report: &mut LoadReport) {
    let CageReport { broken_faces, cut_edges, triangulated } = made.report;
    if broken_faces > 0 {
        report.repaired(format!("mesh {name}: {broken_faces} broken faces are not subdivided and left out"));
    }
    if cut_edges > 0 {
        report.repaired(format!(
            "mesh {name}: {cut_edges} edges of more than two faces, or of two that are wound against each other, \
             are taken for borders"
        ));
    }
    if triangulated > 0 {
        report.approximated(format!(
            "mesh {name}: {triangulated} polygons became triangles for the scheme `loop`"
        ));
    }
    if made.is_coarse {
        let levels = refinement.rate.levels();
        report.approximated(format!(
            "mesh {name}: edges are still too long after {levels} levels of subdivision"
        ));
    }
}
