//! Which candidate hits count: alpha masks, coverage, and backs that are not there.

use crate::fetch::surface::{alpha_point, faces_away};
use crate::scene::CpuScene;
use crate::shade::material::coverage;
use accel::{Candidate, HitFilter};
use optics::random::{hash_combine, unit_float};
use scene::tables::GeometryKind;

/// Lets rays through where a surface has holes or shows a back that is culled, and through the boundaries of media, which
/// are no surfaces.
///
/// Partial coverage is decided by a hash of where on the primitive the hit is: two hits that differ in their last bit
/// decide independently, so the pattern is finer than any pixel, costs no transmittance bookkeeping, and is the same for
/// every query of the same ray.
pub(crate) struct AlphaFilter<'a>(pub &'a CpuScene);

impl HitFilter for AlphaFilter<'_> {
    const OPAQUE: bool = false;

    fn accept(&self, candidate: &Candidate) -> bool {
        let records = self.0.records(candidate.instance, candidate.primitive);
        let tables = &*self.0.tables;
        let material = &tables.materials[records.binding.material as usize];
        if material.is_boundary() {
            return false;
        }
        if material.culls_backs() && faces_away(tables, &records, candidate) {
            return false;
        }
        if !material.has_holes() {
            return true;
        }
        let alpha = coverage(tables, material, &alpha_point(tables, &records, material, candidate));
        alpha >= 1.0 || (alpha > 0.0 && hashed_threshold(records.geometry.kind, candidate) < alpha)
    }
}

/// The same for paths that know what they are in: they see the boundaries of media, too.
pub(crate) struct BoundaryFilter<'a>(pub &'a CpuScene);

impl HitFilter for BoundaryFilter<'_> {
    const OPAQUE: bool = false;

    fn accept(&self, candidate: &Candidate) -> bool {
        let records = self.0.records(candidate.instance, candidate.primitive);
        let is_boundary = self.0.tables.materials[records.binding.material as usize].is_boundary();
        is_boundary || AlphaFilter(self.0).accept(candidate)
    }
}

fn hashed_threshold(kind: GeometryKind, c: &Candidate) -> f32 {
    let [a, b] = match kind {
        GeometryKind::Triangles => [c.u, c.v],
        GeometryKind::Spheres => [c.outward[0], c.outward[1]],
    };
    let place = hash_combine(hash_combine(c.instance, c.primitive), a.to_bits());
    unit_float(hash_combine(place, b.to_bits()))
}
