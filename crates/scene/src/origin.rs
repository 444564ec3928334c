//! Scenes far from their file's origin: positions are stored relative to a point near them.
//!
//! An `f32` has 24 bits. Five thousand kilometres from the origin, as in UTM coordinates, neighbouring numbers are half a
//! metre apart. Loaders therefore compose transforms in `f64` and subtract [`Scene::origin`] before they round to `f32`.
//! In the same way, vertices far from the origin of their mesh are stored relative to an anchor, and the mesh's instances
//! carry the anchor. Scenes and meshes that are not far are stored as they are.

use crate::{LoadReport, Mesh, Scene, Shape};
use elementary::{log10, pow};
use glam::{Affine3A, DAffine3, DVec3, Vec3};

/// A box is far away if its middle is more than this many times its diagonal from the origin.
const FAR: f64 = 32.0;

/// A box in `f64` that grows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bounds(Option<(DVec3, DVec3)>);

impl Bounds {
    /// Bounds of points that are finite.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        let mut bounds = Self::default();
        points.into_iter().for_each(|point| bounds.add(point));
        bounds
    }

    /// Takes in a point; one that is not finite is left out.
    pub fn add(&mut self, point: DVec3) {
        if point.is_finite() {
            let (low, high) = self.0.unwrap_or((point, point));
            self.0 = Some((low.min(point), high.max(point)));
        }
    }

    /// Takes in a box that stands in the world.
    pub fn add_box(&mut self, world: &DAffine3, low: DVec3, high: DVec3) {
        for corner in 0..8u32 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            self.add(world.transform_point3(DVec3::new(pick(0), pick(1), pick(2))));
        }
    }

    /// The corners; `None` for a box without points.
    pub fn corners(&self) -> Option<(DVec3, DVec3)> {
        self.0
    }

    /// The point that what is in the box should be stored relative to: zero unless the box is far away.
    ///
    /// Its coordinates are round decimal numbers of about the box's size, so that they read well.
    pub fn anchor(&self) -> DVec3 {
        let Some((low, high)) = self.0 else { return DVec3::ZERO };
        let (center, size) = (0.5 * low + 0.5 * high, (high - low).length());
        let distance = center.abs().max_element();
        if !(size.is_finite() && distance > FAR * size) {
            return DVec3::ZERO;
        }
        // A single point has no size; a millionth of its distance is as good.
        let unit = pow(10f64, log10(size.max(1e-6 * distance)).floor());
        let anchor = (center / unit).round() * unit;
        if anchor.is_finite() { anchor } else { DVec3::ZERO }
    }
}

/// A transform to the world as the scene stores it.
pub(crate) fn stored(world: &DAffine3, origin: DVec3) -> Affine3A {
    DAffine3 { matrix3: world.matrix3, translation: world.translation - origin }.as_affine3a()
}

/// A transform in `f64`.
pub(crate) fn double(transform: &Affine3A) -> DAffine3 {
    DAffine3 {
        matrix3: glam::Mat3::from(transform.matrix3).as_dmat3(),
        translation: Vec3::from(transform.translation).as_dvec3(),
    }
}

/// In single precision. What is beyond its range lies at its end.
pub(crate) fn rounded(point: DVec3) -> Vec3 {
    const END: DVec3 = DVec3::splat(f32::MAX as f64);
    point.clamp(-END, END).as_vec3()
}

/// Points relative to their anchor, which is zero unless they are far away.
pub(crate) fn anchored(points: &[DVec3]) -> (Vec<Vec3>, DVec3) {
    let anchor = Bounds::of(points.iter().copied()).anchor();
    (points.iter().map(|point| rounded(*point - anchor)).collect(), anchor)
}

/// Moves points to their place relative to `anchor`.
pub(crate) fn subtract(points: &mut [Vec3], anchor: DVec3) {
    if anchor != DVec3::ZERO {
        points.iter_mut().for_each(|point| *point = rounded(point.as_dvec3() - anchor));
    }
}

impl Mesh {
    /// The anchor of the mesh's bounds: zero unless it is far from its own origin.
    pub(crate) fn anchor(&self) -> DVec3 {
        let bounds = self.bounds().map(|(low, high)| [low.as_dvec3(), high.as_dvec3()]);
        Bounds::of(bounds.into_iter().flatten()).anchor()
    }

    /// Stores the mesh relative to `anchor`.
    pub(crate) fn subtract(&mut self, anchor: DVec3) {
        for part in &mut self.parts {
            match &mut part.shape {
                Shape::Triangles(mesh) => subtract(&mut mesh.positions, anchor),
                Shape::Spheres(spheres) => {
                    for sphere in spheres {
                        sphere.center = rounded(sphere.center.as_dvec3() - anchor);
                    }
                }
            }
        }
    }
}

impl Scene {
    /// A position of the scene in the world of its file, metres.
    #[must_use]
    pub fn to_world(&self, position: Vec3) -> DVec3 {
        self.origin + position.as_dvec3()
    }

    /// A position in the world of the scene's file as the scene stores it.
    #[must_use]
    pub fn from_world(&self, position: DVec3) -> Vec3 {
        (position - self.origin).as_vec3()
    }

    /// Stores a scene of meshes that stand where they were made relative to their anchors, and sets the origin.
    ///
    /// - `anchor`: what the meshes are relative to already.
    pub(crate) fn settle_meshes(&mut self, anchor: DVec3, report: &mut LoadReport) {
        let mut bounds = Bounds::default();
        let refinements = &mut self.refinements;
        let anchors: Vec<DVec3> = self
            .meshes
            .iter_mut()
            .enumerate()
            .map(|(number, mesh)| {
                let own = mesh.anchor();
                mesh.subtract(own);
                let own_cages = refinements.iter_mut().filter(|r| r.mesh as usize == number);
                own_cages.for_each(|refinement| subtract(&mut refinement.cage.positions, own));
                if let Some((low, high)) = mesh.bounds() {
                    let world = DAffine3::from_translation(anchor + own);
                    bounds.add_box(&world, low.as_dvec3(), high.as_dvec3());
                }
                anchor + own
            })
            .collect();
        self.set_origin(bounds.anchor(), report);
        for instance in &mut self.instances {
            let anchor = anchors.get(instance.mesh as usize).copied().unwrap_or_default();
            instance.transform = stored(&DAffine3::from_translation(anchor), self.origin);
        }
    }

    /// Sets the origin of a scene whose positions are relative to it already, and says so.
    pub(crate) fn set_origin(&mut self, origin: DVec3, report: &mut LoadReport) {
        self.origin = origin;
        if origin != DVec3::ZERO {
            let DVec3 { x, y, z } = origin;
            report.info(format!(
                "the scene is far from the origin of its coordinates: it is stored relative to ({x} {y} {z})"
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn only_what_is_far_for_its_size_has_an_anchor() {
        let around = |center: DVec3, size: f64| Bounds::of([center - size, center + size]).anchor();
        assert_eq!(around(dvec3(0.0, 3.0, 0.0), 1.0), DVec3::ZERO);
        assert_eq!(around(dvec3(5e5, 100.0, -4.6e6), 1e6), DVec3::ZERO, "a country");
        assert_eq!(around(dvec3(500_000.2, 100.1, -4_599_999.7), 1.0), dvec3(500_000.0, 100.0, -4_600_000.0));
        assert_eq!(around(dvec3(500_123.0, 100.0, -4_612_345.0), 400.0), dvec3(5e5, 0.0, -4_612_000.0));
        assert_eq!(Bounds::default().anchor(), DVec3::ZERO);
        let point = around(dvec3(1e6, 0.0, 0.0), 0.0);
        assert!((point.x - 1e6).abs() < 1.0, "{point}");
        assert!(Bounds::of([dvec3(f64::NAN, 0.0, 0.0), DVec3::ONE * 1e300]).anchor().is_finite());
    }

    #[test]
    fn what_is_far_keeps_its_shape() {
        let corners = [dvec3(5e5, 100.0, -4.6e6), dvec3(5e5 + 0.125, 100.01, -4.6e6 + 0.3)];
        let (points, anchor) = anchored(&corners);
        let side = (points[1] - points[0]).as_dvec3();
        assert!((side - (corners[1] - corners[0])).length() < 1e-7, "{side}");
        assert!((points[0].as_dvec3() + anchor - corners[0]).length() < 1e-7);
    }
}
