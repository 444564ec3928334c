//! What a path is inside of.
//!
//! Bodies may overlap: where they do, the one of the highest priority is there, and surfaces of others are not.
//! Source: Schmidt and Budge, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002.

use crate::filter::BoundaryFilter;
use crate::scene::{CpuScene, vec3};
use crate::surface::Surface;
use accel::Ray;
use optics::Vec3f;
use optics::volume::{Medium, below_height, vacuum};
use scene::tables::{MaterialRecord, NONE, SceneTables};

/// Bodies that are remembered; those entered beyond that count as parts of these.
const MOST: usize = 4;

/// Surfaces that are looked through to find out what a camera stands in.
const MOST_AROUND_CAMERA: usize = 1024;

/// The bodies that a point is inside of, by their materials, in the order in which a path has entered them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interiors {
    materials: [u32; MOST],
    count: usize,
}

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

impl Interiors {
    /// Inside of nothing.
    pub const NOTHING: Self = Self { materials: [NONE; MOST], count: 0 };

    /// What a point is inside of: the bodies whose backs are seen from it, looking up.
    pub fn around(scene: &CpuScene, point: Vec3f) -> Self {
        let mut around = Self::NOTHING;
        if !scene.tables.materials.iter().any(MaterialRecord::is_body) {
            return around;
        }
        // Not quite up: vertical walls should not be seen edge-on.
        let direction = [0.0108, 0.999_9, 0.0089];
        let length = f32::sqrt(direction.iter().map(|x| x * x).sum());
        let mut ray = Ray::new(point.to_array(), direction.map(|x| x / length));
        let (mut passed, mut left) = (Vec::new(), Vec::new());
        for _ in 0..MOST_AROUND_CAMERA {
            let hit = scene.tlas.closest(&ray, &BoundaryFilter(scene));
            if hit.is_miss() {
                break;
            }
            let surface = Surface::new(scene, &ray, &hit);
            if scene.tables.materials[surface.material as usize].is_body() {
                if surface.front {
                    passed.push(surface.material);
                } else if let Some(i) = passed.iter().rposition(|&m| m == surface.material) {
                    passed.remove(i);
                } else {
                    left.push(surface.material);
                }
            }
            ray.origin = surface.ray_origin(false).to_array();
        }
        left.iter().rev().for_each(|&material| around.enter(material));
        around
    }

    /// After crossing the surface of a body from the side that is seen.
    pub fn crossed(mut self, surface: &Surface) -> Self {
        if surface.front {
            self.enter(surface.material);
        } else {
            self.leave(surface.material);
        }
        self
    }

    /// Whether the surface of a body is inside of another one of higher priority, and so is not there.
    pub fn hide(&self, tables: &SceneTables, surface: &Surface) -> bool {
        let priority = |m: u32| tables.materials[m as usize].priority;
        self.entered().iter().any(|&m| priority(m) > priority(surface.material))
    }

    /// The index of refraction of the body at `surface` over that of what is around it.
    pub fn relative_ior(&self, tables: &SceneTables, surface: &Surface) -> f32 {
        let mut around = *self;
        if !surface.front {
            around.leave(surface.material);
        }
        let ior = |m: u32| tables.materials[m as usize].ior;
        ior(surface.material) / around.current(tables).map_or(1.0, ior)
    }

    /// The body that counts: the one of the highest priority, and among equals the one entered last.
    fn current(&self, tables: &SceneTables) -> Option<u32> {
        self.entered().iter().copied().max_by_key(|&m| tables.materials[m as usize].priority)
    }

    fn enter(&mut self, material: u32) {
        if self.count < MOST {
            self.materials[self.count] = material;
            self.count += 1;
        }
    }

    fn leave(&mut self, material: u32) {
        if let Some(i) = self.entered().iter().rposition(|&m| m == material) {
            self.materials.copy_within(i + 1..self.count, i);
            self.count -= 1;
        }
    }

    fn entered(&self) -> &[u32] {
        &self.materials[..self.count]
    }

    /// The part of a ray that is in a medium, if any.
    ///
    /// - `end`: length of the ray, metres. `surface`: where it ends, if that is a surface.
    pub fn segment(
        &self,
        tables: &SceneTables,
        ray: &Ray,
        end: f32,
        surface: Option<&Surface>,
    ) -> Option<Segment> {
        // A body whose back is seen is around the ray, also where its front is missing.
        let seen = surface.filter(|s| !s.front && tables.materials[s.material as usize].is_body());
        let unknown = seen.map(|s| s.material).filter(|m| !self.entered().contains(m));
        if let Some(material) = unknown.or(self.current(tables)) {
            let record = &tables.materials[material as usize];
            let of_medium = tables.media.get(record.medium as usize);
            let subsurface = of_medium.is_some_and(|m| m.subsurface);
            let (grid, open) = (of_medium.map_or(NONE, |m| m.grid), record.is_boundary());
            let segment = |medium| Segment { medium, grid, subsurface, open, start: 0.0, end };
            return inside(tables, record).map(segment);
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
}

/// What is inside of a body of a material; `None` if it does nothing to light.
fn inside(tables: &SceneTables, material: &MaterialRecord) -> Option<Medium> {
    if material.medium != NONE {
        return Some(medium_at(tables, material.medium));
    }
    let absorbing = || Medium { absorption: vec3(material.absorption), ..vacuum() };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_left_in_any_order_and_too_many_are_forgotten() {
        let mut i = Interiors::NOTHING;
        [7, 8, 7].iter().for_each(|&m| i.enter(m));
        i.leave(8);
        assert_eq!(i.entered(), [7, 7]);
        i.leave(7);
        i.leave(3);
        assert_eq!(i.entered(), [7]);
        [1, 2, 3, 4, 5].iter().for_each(|&m| i.enter(m));
        assert_eq!(i.entered(), [7, 1, 2, 3]);
        [5, 4, 3, 2, 1, 7].iter().for_each(|&m| i.leave(m));
        assert!(i.entered().is_empty());
    }
}
