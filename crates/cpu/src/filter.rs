//! Which candidate hits count: alpha masks and coverage.

use crate::material::coverage;
use crate::scene::CpuScene;
use crate::surface::alpha_inputs;
use accel::HitFilter;
use optics::random::{hash_combine, unit_float};
use scene::tables::GeometryKind;

/// Lets rays through where a surface has holes, and through the boundaries of media, which are no surfaces.
///
/// Partial coverage is decided by a hash of the hit's barycentrics: two hits that differ in their last bit decide
/// independently, so the pattern is finer than any pixel, costs no transmittance bookkeeping, and is the same for
/// every query of the same ray. Spheres have no texture coordinates at this point and always count.
pub(crate) struct AlphaFilter<'a>(pub &'a CpuScene);

impl HitFilter for AlphaFilter<'_> {
    const OPAQUE: bool = false;

    fn accept(&self, instance: u32, primitive: u32, u: f32, v: f32) -> bool {
        let records = self.0.records(instance, primitive);
        let tables = &*self.0.tables;
        let material = &tables.materials[records.binding.material as usize];
        if material.is_boundary() {
            return false;
        }
        if !material.has_alpha() || records.geometry.kind == GeometryKind::Spheres {
            return true;
        }
        let alpha = coverage(tables, material, alpha_inputs(tables, &records, u, v));
        alpha >= 1.0 || (alpha > 0.0 && hashed_threshold(instance, primitive, u, v) < alpha)
    }
}

/// The same for paths that know what they are in: they see the boundaries of media, too.
pub(crate) struct BoundaryFilter<'a>(pub &'a CpuScene);

impl HitFilter for BoundaryFilter<'_> {
    const OPAQUE: bool = false;

    fn accept(&self, instance: u32, primitive: u32, u: f32, v: f32) -> bool {
        let records = self.0.records(instance, primitive);
        let is_boundary = self.0.tables.materials[records.binding.material as usize].is_boundary();
        is_boundary || AlphaFilter(self.0).accept(instance, primitive, u, v)
    }
}

fn hashed_threshold(instance: u32, primitive: u32, u: f32, v: f32) -> f32 {
    let place = hash_combine(hash_combine(instance, primitive), u.to_bits());
    unit_float(hash_combine(place, v.to_bits()))
}
