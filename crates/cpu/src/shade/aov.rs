//! What a camera ray sees first: auxiliary layers, and the integrator that shows nothing else.

use crate::fetch::surface::Surface;
use crate::shade::closures::surface_albedo;
use film::AovSample;
use optics::Vec3f;
use optics::vector::dot;
use scene::tables::{MaterialRecord, SceneTables};

/// The auxiliary values of a first hit, which guides denoisers, too, unless the path that goes on from there finds what does, at `distance` metres along the ray.
pub(crate) fn aov_sample(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    distance: f32,
    footprint: f32,
) -> AovSample {
    let albedo = surface_albedo(tables, material, s, footprint);
    AovSample {
        depth: distance,
        position: s.position.to_array(),
        normal: s.shading_normal.to_array(),
        geometric_normal: s.normal.to_array(),
        uv: [s.coords.x, s.coords.y],
        albedo: albedo.to_array(),
        denoising_albedo: albedo.to_array(),
        denoising_normal: s.shading_normal.to_array(),
        material_id: s.material,
        instance_id: s.object,
        primitive_id: s.primitive,
    }
}

/// The surface's colour under a light at the camera: the picture of the `aov` integrator.
pub(crate) fn headlight(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    footprint: f32,
) -> Vec3f {
    surface_albedo(tables, material, s, footprint) * optics::camera::headlight(dot(s.wo, s.shading_normal))
}
