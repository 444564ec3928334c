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
use optics::math::max_component;
use optics::random::{PixelSampler, hash_combine, unit_float};
use optics::volume::{collide, diluted, medium_extinction, ratio_tracking_factor};
use scene::tables::{GridRecord, SceneTables};

/// Tentative collisions along the diagonal of a grid that shines, at least.
const FEWEST_COLLISIONS: f32 = 16.0;
/// Transmittances that are less than this share are left to chance: a ray ends or counts more.
const LITTLE: f32 = 0.05;

/// The grid of a medium, and the extinction that paths are given in it, m⁻¹: what the densest cell has in its densest channel.
struct Grid<'a> {
    record: &'a GridRecord,
    majorant: f32,
}

/// What a [`Stream`] is for.
pub(super) const STREAM_PATH: u32 = 0;
pub(super) const STREAM_SHADOW: u32 = 1;

/// Uniform numbers without end, the same ones for the same segment of the same sample.
pub(super) struct Stream(u32);

impl Stream {
    pub fn new(sampler: &PixelSampler, segment: u32, purpose: u32) -> Self {
        let of_sample = hash_combine(hash_combine(sampler.scramble, sampler.index), segment);
        Self(hash_combine(of_sample, purpose))
    }

    pub fn next(&mut self) -> f32 {
        self.0 = hash_combine(self.0, 0x6d2b_79f5);
        unit_float(self.0)
    }

    /// Metres to the next collision in a medium of this extinction.
    fn step(&mut self, majorant: f32) -> f32 {
        -(1.0 - self.next()).ln() / majorant
    }
}

impl VolumeTracer<'_> {
    /// Follows a path through a grid's medium. Returns how far along the ray it scatters, and the medium there.
    pub(super) fn track(&mut self, path: &mut VolumePath, segment: &Segment) -> Option<(f32, Segment)> {
        let tables = &*self.scene.tables;
        let grid = Grid::of(tables, segment)?;
        let mut stream = Stream::new(&path.sampler, path.segments, STREAM_PATH);
        let (start, end) = within(&path.ray, grid.record, segment)?;
        let mut t = start;
        loop {
            t += stream.step(grid.majorant);
            if t.is_nan() || t >= end {
                return None;
            }
            let here = diluted(segment.medium, density(tables, grid.record, at(&path.ray, t)));
            self.radiance += path.state.throughput * here.emission * (1.0 / grid.majorant);
            let c = collide(here, grid.majorant, path.state.throughput, stream.next());
            path.state.throughput *= c.weight;
            if c.scattered {
                return Some((t, Segment { medium: here, ..*segment }));
            }
            if max_component(path.state.throughput) <= 0.0 {
                return None;
            }
        }
    }

    /// An estimate of the transmittance of a grid's medium.
    pub(super) fn ratio_track(&self, ray: &Ray, segment: &Segment, stream: &mut Stream) -> Vec3f {
        let tables = &*self.scene.tables;
        let mut left = WHITE;
        let Some(grid) = Grid::of(tables, segment) else { return left };
        let Some((start, end)) = within(ray, grid.record, segment) else { return left };
        let mut t = start;
        loop {
            t += stream.step(grid.majorant);
            if t.is_nan() || t >= end {
                return left;
            }
            let here = diluted(segment.medium, density(tables, grid.record, at(ray, t)));
            left *= ratio_tracking_factor(medium_extinction(here), grid.majorant);
            let most = max_component(left);
            if most < LITTLE {
                if stream.next() >= most {
                    return BLACK;
                }
                left *= 1.0 / most;
            }
        }
    }
}

impl<'a> Grid<'a> {
    /// The grid of a segment's medium; `None` if it is empty.
    fn of(tables: &'a SceneTables, segment: &Segment) -> Option<Self> {
        let record = tables.grids.get(segment.grid as usize)?;
        let mut most = max_component(medium_extinction(segment.medium));
        if max_component(segment.medium.emission) > 0.0 {
            // What shines must be met to be seen: some times on the way through, however thin it is.
            let size = f32::hypot(record.high[0] - record.low[0], record.high[1] - record.low[1])
                .hypot(record.high[2] - record.low[2]);
            most = most.max(FEWEST_COLLISIONS / (size * record.largest));
        }
        let majorant = most * record.largest;
        (majorant > 0.0 && majorant.is_finite()).then_some(Self { record, majorant })
    }
}

fn at(ray: &Ray, t: f32) -> Vec3f {
    vec3(ray.origin) + vec3(ray.direction) * t
}

/// The part of a segment within the bounds of a grid.
fn within(ray: &Ray, grid: &GridRecord, segment: &Segment) -> Option<(f32, f32)> {
    let (mut start, mut end) = (segment.start, segment.end);
    for axis in 0..3 {
        let [a, b] = [grid.low[axis], grid.high[axis]].map(|x| (x - ray.origin[axis]) / ray.direction[axis]);
        // A ray along the face of a slab gives NaN, which bounds nothing.
        start = start.max(a.min(b));
        end = end.min(a.max(b));
    }
    (end > start).then_some((start, end))
}

/// The density at a point of a grid: trilinear between the centres of cells, constant from there to the bounds.
fn density(tables: &SceneTables, grid: &GridRecord, p: Vec3f) -> f32 {
    let place = |axis: usize, x: f32| {
        let n = grid.size[axis];
        let scaled = (x - grid.low[axis]) / (grid.high[axis] - grid.low[axis]) * n as f32 - 0.5;
        let inside = scaled.clamp(0.0, (n - 1) as f32);
        let cell = (inside as u32).min(n.saturating_sub(2));
        (cell, (cell + 1).min(n - 1), inside - cell as f32)
    };
    let [(x0, x1, u), (y0, y1, v), (z0, z1, w)] = [place(0, p.x), place(1, p.y), place(2, p.z)];
    let value = |x: u32, y: u32, z: u32| {
        let index = (z as usize * grid.size[1] as usize + y as usize) * grid.size[0] as usize + x as usize;
        tables.densities[grid.first as usize + index]
    };
    let along_x = |y: u32, z: u32| value(x0, y, z) * (1.0 - u) + value(x1, y, z) * u;
    let along_y = |z: u32| along_x(y0, z) * (1.0 - v) + along_x(y1, z) * v;
    along_y(z0) * (1.0 - w) + along_y(z1) * w
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
