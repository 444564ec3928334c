//! Media whose density is a grid: distances by delta tracking, transmittance by ratio tracking.
//!
//! A path goes as if the medium were as dense everywhere as it is at most, and decides at each collision whether it met
//! anything. Sources: Woodcock et al. 1965; Kutz, Habel, Li and Novák, "Spectral and Decomposition Tracking for Rendering
//! Heterogeneous Volumes", SIGGRAPH 2017; Novák, Selle and Jarosz, "Residual Ratio Tracking", SIGGRAPH Asia 2014.

use super::interiors::Segment;
use super::{BLACK, VolumePath, VolumeTracer, WHITE};
use crate::scene::vec3;
use accel::Ray;
use optics::Vec3f;
use optics::intersect::intersect_box;
use optics::math::max_component;
use optics::random::unit_float;
use optics::vec3f;
use optics::vector::length;
use optics::volume::{
    LITTLE_LIGHT, MOST_COLLISIONS, STREAM_PATH, collide, collision_distance, diluted, grid_majorant,
    grid_mix, grid_place, medium_extinction, ratio_tracking_factor, stream_next, stream_start,
};
use scene::tables::{GridRecord, SceneTables};

/// The grid of a medium, and the extinction that paths are given in it, m⁻¹.
struct Grid<'a> {
    record: &'a GridRecord,
    majorant: f32,
}

/// The next number of a stream.
fn next(stream: &mut u32) -> f32 {
    *stream = stream_next(*stream);
    unit_float(*stream)
}

impl VolumeTracer<'_> {
    /// Follows a path through a grid's medium. Returns how far along the ray it scatters, and the medium there.
    pub(super) fn track(&mut self, path: &mut VolumePath, segment: &Segment) -> Option<(f32, Segment)> {
        let tables = &*self.scene.tables;
        let grid = Grid::of(tables, segment)?;
        let mut stream = stream_start(path.sampler, path.segments, STREAM_PATH);
        let (start, end) = within(&path.ray, grid.record, segment)?;
        let mut t = start;
        for _ in 0..MOST_COLLISIONS {
            t += collision_distance(grid.majorant, next(&mut stream));
            if t >= end {
                return None;
            }
            let here = diluted(segment.medium, density(tables, grid.record, at(&path.ray, t)));
            self.radiance += path.state.throughput * here.emission * (1.0 / grid.majorant);
            let c = collide(here, grid.majorant, path.state.throughput, next(&mut stream));
            path.state.throughput *= c.weight;
            if c.scattered {
                return Some((t, Segment { medium: here, ..*segment }));
            }
            if max_component(path.state.throughput) <= 0.0 {
                return None;
            }
        }
        None
    }

    /// An estimate of the transmittance of a grid's medium. `stream`: state of a stream of random numbers.
    pub(super) fn ratio_track(&self, ray: &Ray, segment: &Segment, stream: &mut u32) -> Vec3f {
        let tables = &*self.scene.tables;
        let mut left = WHITE;
        let Some(grid) = Grid::of(tables, segment) else { return left };
        let Some((start, end)) = within(ray, grid.record, segment) else { return left };
        let mut t = start;
        for _ in 0..MOST_COLLISIONS {
            t += collision_distance(grid.majorant, next(stream));
            if t >= end {
                return left;
            }
            let here = diluted(segment.medium, density(tables, grid.record, at(ray, t)));
            left *= ratio_tracking_factor(medium_extinction(here), grid.majorant);
            let most = max_component(left);
            if most < LITTLE_LIGHT {
                if next(stream) >= most {
                    return BLACK;
                }
                left *= 1.0 / most;
            }
        }
        left
    }
}

impl<'a> Grid<'a> {
    /// The grid of a segment's medium; `None` if it is empty.
    fn of(tables: &'a SceneTables, segment: &Segment) -> Option<Self> {
        let record = tables.grids.get(segment.grid as usize)?;
        let diagonal = length(vec3(record.high) - vec3(record.low));
        let majorant = grid_majorant(segment.medium, record.largest, diagonal);
        (majorant > 0.0 && majorant.is_finite()).then_some(Self { record, majorant })
    }
}

fn at(ray: &Ray, t: f32) -> Vec3f {
    vec3(ray.origin) + vec3(ray.direction) * t
}

/// The part of a segment within the bounds of a grid.
fn within(ray: &Ray, grid: &GridRecord, segment: &Segment) -> Option<(f32, f32)> {
    let direction = ray.direction;
    let inverse = vec3f(1.0 / direction[0], 1.0 / direction[1], 1.0 / direction[2]);
    let (low, high) = (vec3(grid.low), vec3(grid.high));
    let part = intersect_box(vec3(ray.origin), inverse, low, high, segment.start, segment.end);
    (part.far > part.near).then_some((part.near, part.far))
}

/// The density at a point of a grid: trilinear between the centres of cells, constant from there to the bounds.
pub(super) fn density(tables: &SceneTables, grid: &GridRecord, p: Vec3f) -> f32 {
    let x = grid_place(p.x, grid.low[0], grid.high[0], grid.size[0]);
    let y = grid_place(p.y, grid.low[1], grid.high[1], grid.size[1]);
    let z = grid_place(p.z, grid.low[2], grid.high[2], grid.size[2]);
    let value = |x: u32, y: u32, z: u32| {
        let index = (z as usize * grid.size[1] as usize + y as usize) * grid.size[0] as usize + x as usize;
        tables.densities[grid.first as usize + index]
    };
    let along_x = |y: u32, z: u32| grid_mix(x, value(x.cell, y, z), value(x.next, y, z));
    let along_y = |z: u32| grid_mix(y, along_x(y.cell, z), along_x(y.next, z));
    grid_mix(z, along_y(z.cell), along_y(z.next))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_are_interpolated_between_centres() {
        let tables = SceneTables { densities: vec![9.0, 1.0, 3.0, 5.0, 7.0], ..SceneTables::default() };
        let grid =
            GridRecord { first: 1, size: [2, 2, 1], low: [0.0; 3], high: [2.0, 2.0, 1.0], largest: 7.0 };
        for (p, expected) in [
            ([0.5, 0.5, 0.5], 1.0),
            ([1.5, 0.5, 0.1], 3.0),
            ([1.0, 0.5, 0.9], 2.0),
            ([1.0, 1.0, 0.5], 4.0),
            ([0.0, 0.0, 0.0], 1.0),
            ([2.0, 2.0, 1.0], 7.0),
        ] {
            assert_eq!(density(&tables, &grid, vec3(p)), expected, "{p:?}");
        }
    }
}
