//! Meshes that are to have a volume (`KHR_materials_volume`) but do not enclose one.
//!
//! Light that enters a body has to leave it again. Through a single pane it would only enter: it would stay inside, be
//! absorbed on all of its way, and be as dim as what is seen from within glass. Such a pane is a thin wall.

use crate::{LoadReport, Material, MaterialId, Mesh, Shape, TriangleMesh};
use glam::Vec3;
use std::collections::HashMap;

/// Gives thin-walled materials to the parts of open meshes that light would enter. Materials are copied: closed meshes may
/// use them, too.
pub(super) fn mend(meshes: &mut [Mesh], materials: &mut Vec<Material>, report: &mut LoadReport) {
    let mut thin: HashMap<MaterialId, MaterialId> = HashMap::new();
    for mesh in meshes {
        let refracts =
            |material: MaterialId| materials.get(material as usize).is_some_and(Material::refracts_into_body);
        if !mesh.parts.iter().any(|part| refracts(part.material)) || !is_open(mesh) {
            continue;
        }
        report.approximated(format!(
            "mesh `{}` has a volume but is open: it is treated as a thin wall",
            mesh.name
        ));
        for part in &mut mesh.parts {
            let own = part.material;
            if materials.get(own as usize).is_some_and(Material::refracts_into_body) {
                part.material = *thin.entry(own).or_insert_with(|| {
                    let sheet = Material { thin_walled: true, ..materials[own as usize].clone() };
                    materials.push(sheet);
                    materials.len() as MaterialId - 1
                });
            }
        }
    }
}

/// Whether all parts of a mesh together leave open more than a small part of a surface: the square of the length of its
/// border is more than twice its area. A pane has 16 times its area, half a sphere 6 times; a bottle without a bottom stays a
/// body.
fn is_open(mesh: &Mesh) -> bool {
    let parts = || {
        mesh.parts.iter().filter_map(|part| match &part.shape {
            Shape::Triangles(triangles) => Some(triangles),
            Shape::Spheres(_) => None,
        })
    };
    let Some((low, high)) = mesh.bounds() else { return false };
    // Rounding may part vertices along seams.
    let step = (high - low).max_element() * 1e-5;
    if !(step.is_finite() && step > 0.0) {
        return false;
    }
    let mut border: HashMap<([i64; 3], [i64; 3]), f32> = HashMap::new();
    let mut area = 0.0;
    for [a, b, c] in parts().flat_map(corners) {
        area += 0.5 * (b - a).cross(c - a).length();
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let place = |p: Vec3| ((p - low) / step).round().to_array().map(|x| x as i64);
            let (from_place, to_place) = (place(from), place(to));
            // An edge that is run along both ways is inside of the surface.
            if from_place != to_place && border.remove(&(to_place, from_place)).is_none() {
                border.insert((from_place, to_place), from.distance(to));
            }
        }
    }
    let length: f32 = border.values().sum();
    length * length > 2.0 * area
}

/// The corners of all triangles that are finite.
fn corners(mesh: &TriangleMesh) -> impl Iterator<Item = [Vec3; 3]> {
    let triangle = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
    mesh.indices.iter().map(triangle).filter(|t| t.iter().all(|p| p.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Model, Part, shapes};
    use glam::Vec2;

    fn glass() -> Material {
        Material { model: Model::Dielectric, ..Material::default() }
    }

    /// What becomes of meshes that all have the first material.
    fn mended(shapes: Vec<TriangleMesh>) -> (Vec<bool>, usize) {
        let mut materials = vec![glass()];
        let mut meshes: Vec<Mesh> =
            shapes.into_iter().map(|s| Mesh::single("pane", Shape::Triangles(s), 0)).collect();
        let mut report = LoadReport::default();
        mend(&mut meshes, &mut materials, &mut report);
        let thin = |m: &Mesh| materials[m.parts[0].material as usize].thin_walled;
        (meshes.iter().map(thin).collect(), report.notes.len())
    }

    #[test]
    fn panes_are_thin_and_bodies_stay_bodies() {
        let pane = || shapes::rectangle(Vec2::new(2.0, 1.0));
        let mut cup = shapes::uv_sphere(1.0, 32, 16);
        cup.indices.retain(|t| t.iter().all(|i| cup.positions[*i as usize].y < 0.01));
        let mut pierced = shapes::uv_sphere(1.0, 32, 16);
        pierced.indices.truncate(pierced.indices.len() - 2);
        let (thin, notes) = mended(vec![pane(), shapes::uv_sphere(1.0, 32, 16), cup, pierced, pane()]);
        assert_eq!(thin, [true, false, true, false, true]);
        assert_eq!(notes, 1, "one note for meshes of one name");
    }

    /// Two halves that close each other are a body; the material of a closed mesh stays what it is.
    #[test]
    fn parts_close_each_other() {
        let sphere = shapes::uv_sphere(1.0, 16, 8);
        let half = |upper: bool| {
            let mut half = sphere.clone();
            half.indices.retain(|t| {
                let middle: f32 = t.iter().map(|i| sphere.positions[*i as usize].y).sum();
                (middle > 0.0) == upper
            });
            Part { shape: Shape::Triangles(half), material: 0 }
        };
        let mut meshes = vec![Mesh { name: "ball".into(), parts: vec![half(false), half(true)] }];
        let mut materials = vec![glass()];
        let mut report = LoadReport::default();
        mend(&mut meshes, &mut materials, &mut report);
        assert!(materials.len() == 1 && report.notes.is_empty(), "{report:?}");
    }
}
