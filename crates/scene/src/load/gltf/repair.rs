//! Numbers that cannot be rendered: infinities, NaN, normals without a direction.

use crate::{LoadReport, TriangleMesh};
use glam::{Vec2, Vec3, Vec4};

/// Mends a mesh so that everything in it is finite and normals and tangents have unit length.
pub(super) fn repair(mesh: &mut TriangleMesh, report: &mut LoadReport) {
    drop_infinite_triangles(mesh, report);
    mend_normals(mesh, report);
    mend_tangents(mesh, report);
    let mend_uv = |uvs: &mut Vec<Vec2>| {
        let broken = uvs.iter_mut().filter(|uv| !uv.is_finite());
        broken.map(|uv| *uv = Vec2::ZERO).count()
    };
    if mend_uv(&mut mesh.uv0) + mend_uv(&mut mesh.uv1) > 0 {
        report.repaired("texture coordinates that are not finite were set to (0, 0)");
    }
    let broken = mesh.colors.iter_mut().filter(|c| !c.is_finite() || c.min_element() < 0.0);
    if broken.map(|color| *color = Vec4::ONE).count() > 0 {
        report.repaired("vertex colours that are not finite or negative were set to white");
    }
    let bright = mesh.colors.iter_mut().filter(|c| c.max_element() > 1.0);
    if bright.map(|color| *color = color.min(Vec4::ONE)).count() > 0 {
        report.repaired("vertex colours above 1, which reflect more light than arrives, were set to 1");
    }
}

/// Removes triangles with a vertex that is not finite and clears those vertices.
fn drop_infinite_triangles(mesh: &mut TriangleMesh, report: &mut LoadReport) {
    if mesh.positions.iter().all(|p| p.is_finite()) {
        return;
    }
    let positions = &mesh.positions;
    mesh.indices.retain(|triangle| triangle.iter().all(|i| positions[*i as usize].is_finite()));
    mesh.positions.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = Vec3::ZERO);
    report.repaired("triangles with positions that are not finite were left out");
}

fn mend_normals(mesh: &mut TriangleMesh, report: &mut LoadReport) {
    let mut lost = false;
    for normal in &mut mesh.normals {
        let length = normal.length_squared();
        if (length - 1.0).abs() > 1e-4 || !length.is_finite() {
            *normal = normal.normalize_or_zero();
            lost |= *normal == Vec3::ZERO;
        }
    }
    if !lost {
        return;
    }
    report.repaired("normals without a direction were replaced by those of a face");
    for [a, b, c] in mesh.indices.iter().map(|t| t.map(|i| i as usize)) {
        for vertex in [a, b, c] {
            if mesh.normals[vertex] == Vec3::ZERO {
                let p = &mesh.positions;
                mesh.normals[vertex] = (p[b] - p[a]).cross(p[c] - p[a]).normalize_or_zero();
            }
        }
    }
    // What is left belongs to no triangle, or to triangles without an area.
    mesh.normals.iter_mut().filter(|n| **n == Vec3::ZERO).for_each(|n| *n = Vec3::Y);
}

/// Tangents without a direction lie anywhere in the surface.
fn mend_tangents(mesh: &mut TriangleMesh, report: &mut LoadReport) {
    let mut lost = 0;
    for (tangent, normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
        let direction = tangent.truncate();
        let unit = direction.normalize_or_zero();
        lost += usize::from(unit == Vec3::ZERO);
        let unit = if unit == Vec3::ZERO { normal.any_orthonormal_vector() } else { unit };
        *tangent = unit.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 });
    }
    if lost > 0 {
        report.repaired("tangents without a direction were replaced by arbitrary ones");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_mesh_becomes_finite_and_the_sound_triangle_stays() {
        let mut mesh = TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(f32::NAN, 0.0, 0.0)],
            normals: vec![Vec3::ZERO, Vec3::Z * 3.0, Vec3::splat(f32::INFINITY), Vec3::ZERO],
            tangents: vec![Vec4::ZERO, Vec4::new(2.0, 0.0, 0.0, -0.5), Vec4::NAN, Vec4::X],
            uv0: vec![Vec2::NAN; 4],
            colors: vec![Vec4::splat(-1.0); 4],
            indices: vec![[0, 1, 2], [0, 1, 3]],
            ..Default::default()
        };
        let mut report = LoadReport::default();
        repair(&mut mesh, &mut report);
        assert_eq!(mesh.indices, [[0, 1, 2]]);
        assert_eq!(mesh.normals[..3], [Vec3::Z; 3]);
        assert_eq!(mesh.tangents[1], Vec4::new(1.0, 0.0, 0.0, -1.0));
        assert!(mesh.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-6));
        assert_eq!((mesh.uv0[0], mesh.colors[0]), (Vec2::ZERO, Vec4::ONE));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert_eq!(report.notes.len(), 5);
    }
}
