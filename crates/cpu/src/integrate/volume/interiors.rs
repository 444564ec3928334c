//! What paths are inside of, by the records of materials and media: what the optics' `interiors` decides on.

use crate::fetch::filter::BoundaryFilter;
use crate::fetch::surface::Surface;
use crate::scene::{CpuScene, vec3};
use accel::Ray;
use optics::Vec3f;
use optics::interiors::{
    Interiors, MOST_AROUND_CAMERA, interiors_along, interiors_cross, interiors_current, interiors_hide,
    interiors_leave, interiors_nothing, surroundings_direction, surroundings_past, surroundings_unknown,
};
use optics::volume::{Medium, below_height, ior_across, vacuum};
use scene::tables::{MaterialRecord, NONE, SceneTables};

/// A part of a ray that lies in one medium.
#[derive(Clone, Copy)]
pub(crate) struct Segment {
    /// Where its density is 1.
    pub medium: Medium,
    /// Index into the tables' grids of its density, or `NONE`: 1 everywhere.
    pub grid: u32,
    /// Whether that is the inside of what looks like a surface.
    pub subsurface: bool,
    /// Whether light gets out of it without being bent.
    pub open: bool,
    /// Where it begins and ends, metres along the ray.
    pub start: f32,
    pub end: f32,
}

/// What a point is inside of at `time` of the shutter: the bodies whose backs are seen from it,
/// looking up.
pub(crate) fn interiors_around(scene: &CpuScene, point: Vec3f, time: f32) -> Interiors {
    let tables = &*scene.tables;
    if !tables.has_bodies() {
        return interiors_nothing();
    }
    let mut surroundings = surroundings_unknown();
    let mut ray = Ray::new(point.to_array(), surroundings_direction().to_array());
    for _ in 0..MOST_AROUND_CAMERA {
        let hit = scene.tlas.closest_at(&ray, time, &BoundaryFilter(scene));
        if hit.is_miss() {
            break;
        }
        let surface = Surface::new(scene, &ray, &hit, time);
        let material = &tables.materials[surface.material as usize];
        if material.is_body() {
            surroundings =
                surroundings_past(surroundings, surface.material, material.priority, surface.front);
        }
        ray.origin = surface.ray_origin(false).to_array();
    }
    surroundings.around
}

/// Whether light goes straight on: through the boundary of a medium, or the surface of a body that another one hides.
pub(crate) fn passes(tables: &SceneTables, surface: &Surface, inside: Interiors) -> bool {
    let material = &tables.materials[surface.material as usize];
    let hidden = || interiors_hide(inside, material.priority);
    material.is_boundary() || (tables.nested && material.is_body() && hidden())
}

/// After crossing the surface of a body from the side that is seen.
pub(crate) fn crossed(inside: Interiors, tables: &SceneTables, surface: &Surface) -> Interiors {
    let priority = tables.materials[surface.material as usize].priority;
    interiors_cross(inside, surface.material, priority, surface.front)
}

/// The index of refraction of the body at `surface` over that of what is around it.
pub(crate) fn relative_ior(inside: Interiors, tables: &SceneTables, surface: &Surface) -> f32 {
    let around = if surface.front { inside } else { interiors_leave(inside, surface.material) };
    let ior = |m: u32| tables.materials.get(m as usize).map_or(1.0, |m| m.ior);
    ior_across(ior(surface.material), ior(interiors_current(around)))
}

/// The index of refraction of what a ray is in on its way to a surface; 1 in vacuum.
///
/// - `surface`: where the ray ends, if that is a surface.
pub(crate) fn ior_along(inside: Interiors, tables: &SceneTables, surface: &Surface) -> f32 {
    let seen = !surface.front && tables.materials[surface.material as usize].is_body();
    let material = interiors_along(inside, if seen { surface.material } else { NONE });
    tables.materials.get(material as usize).map_or(1.0, |m| m.ior)
}

/// The part of a ray that is in a medium, if any.
///
/// - `end`: length of the ray, metres. `surface`: where it ends, if that is a surface.
pub(crate) fn segment(
    inside: Interiors,
    tables: &SceneTables,
    ray: &Ray,
    end: f32,
    surface: Option<&Surface>,
) -> Option<Segment> {
    let seen = surface.filter(|s| !s.front && tables.materials[s.material as usize].is_body());
    let material = interiors_along(inside, seen.map_or(NONE, |s| s.material));
    if let Some(record) = tables.materials.get(material as usize) {
        let of_medium = tables.media.get(record.medium as usize);
        let subsurface = of_medium.is_some_and(|m| m.subsurface);
        let (grid, open) = (of_medium.map_or(NONE, |m| m.grid), record.is_boundary());
        let segment = |medium| Segment { medium, grid, subsurface, open, start: 0.0, end };
        return medium_in(tables, record).map(segment);
    }
    if tables.fog.medium == NONE {
        return None;
    }
    let part = below_height(ray.origin[1], ray.direction[1], tables.fog.top, end);
    let medium = medium_at(tables, tables.fog.medium);
    let (start, end) = (part.x, part.y);
    let grid = tables.media[tables.fog.medium as usize].grid;
    (end > start).then_some(Segment { medium, grid, subsurface: false, open: true, start, end })
}

/// What is inside of a body of a material; `None` if it does nothing to light.
fn medium_in(tables: &SceneTables, material: &MaterialRecord) -> Option<Medium> {
    if material.medium != NONE {
        return Some(medium_at(tables, material.medium));
    }
    let absorbing = || Medium { absorption: material.absorption, ..vacuum() };
    material.absorbs().then(absorbing)
}

fn medium_at(tables: &SceneTables, index: u32) -> Medium {
    let record = &tables.media[index as usize];
    Medium {
        absorption: vec3(record.absorption),
        scattering: vec3(record.scattering),
        emission: vec3(record.emission),
        anisotropy: record.anisotropy,
    }
}
