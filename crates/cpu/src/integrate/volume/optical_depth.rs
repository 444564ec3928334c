//! How much light a straight way through a medium loses, without random numbers: what a laser's
//! beam needs.

use super::grid::density;
use super::interiors::Segment;
use crate::scene::vec3;
use accel::Ray;
use optics::Vec3f;
use optics::intersect::intersect_box;
use optics::vec3f;
use optics::volume::medium_extinction;
use scene::tables::{GridRecord, SceneTables};

/// The integral of the extinction coefficient over a segment of a ray.
pub(crate) fn optical_depth(tables: &SceneTables, ray: &Ray, segment: &Segment) -> Vec3f {
    let extinction = medium_extinction(segment.medium);
    match tables.grids.get(segment.grid as usize) {
        None => extinction * (segment.end - segment.start),
        Some(grid) => extinction * density_along(tables, grid, ray, segment.start, segment.end),
    }
}

/// The integral of a grid's density over a part of a ray, metres.
///
/// Between two planes through centres of cells, the density along a line is a polynomial of degree
/// three, which Simpson's rule integrates exactly.
fn density_along(tables: &SceneTables, grid: &GridRecord, ray: &Ray, start: f32, end: f32) -> f32 {
    let inverse = ray.direction.map(|d| 1.0 / d);
    let inside = intersect_box(
        vec3(ray.origin),
        vec3f(inverse[0], inverse[1], inverse[2]),
        vec3(grid.low),
        vec3(grid.high),
        start,
        end,
    );
    let at = |t: f32| density(tables, grid, vec3(ray.origin) + vec3(ray.direction) * t);
    let (mut t, mut sum) = (inside.near, 0.0);
    while t < inside.far {
        let next = next_plane(grid, ray, t).min(inside.far);
        sum += (next - t) / 6.0 * (at(t) + 4.0 * at(0.5 * (t + next)) + at(next));
        t = next;
    }
    sum
}

/// Where a ray meets the next plane through centres of cells behind `t`, metres; always behind `t`.
fn next_plane(grid: &GridRecord, ray: &Ray, t: f32) -> f32 {
    /// Planes nearer than this, in cells, have been met.
    const MET: f32 = 1e-3;
    let mut next = f32::INFINITY;
    for axis in 0..3 {
        let cells_per_metre = grid.size[axis] as f32 / (grid.high[axis] - grid.low[axis]);
        let speed = ray.direction[axis] * cells_per_metre;
        if speed == 0.0 {
            continue;
        }
        let place = (ray.origin[axis] + ray.direction[axis] * t - grid.low[axis]) * cells_per_metre - 0.5;
        let plane = if speed > 0.0 { (place + MET).floor() + 1.0 } else { (place - MET).ceil() - 1.0 };
        next = next.min(t + (plane - place) / speed);
    }
    // Rounding must not stop the way.
    next.max(t + t.abs() * 1e-6).max(f32::from_bits(t.to_bits() + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Density 1 + x over a cube of ten cells a side: linear, so also what lies between centres is
    /// known.
    #[test]
    fn the_density_along_a_line_is_integrated() {
        let n = 10;
        let center = |i: u32| (i as f32 + 0.5) / n as f32;
        let densities = (0..n * n * n).map(|i| 1.0 + center(i % n)).collect();
        let tables = SceneTables { densities, ..SceneTables::default() };
        let grid = GridRecord { first: 0, size: [n; 3], low: [0.0; 3], high: [1.0; 3], largest: 2.0 };
        let along = |origin: [f32; 3], direction: [f32; 3]| {
            density_along(&tables, &grid, &Ray::new(origin, direction), 0.0, 100.0)
        };
        // Across x at x = 0.3.
        assert!((along([0.3, 0.4, -2.0], [0.0, 0.0, 1.0]) - 1.3).abs() < 1e-5);
        // Along x both ways: the mean is 1.5, also with the constant ends.
        assert!((along([-1.0, 0.4, 0.6], [1.0, 0.0, 0.0]) - 1.5).abs() < 1e-4);
        assert!((along([3.0, 0.4, 0.6], [-1.0, 0.0, 0.0]) - 1.5).abs() < 1e-4);
        // Diagonally.
        let d = 1.0 / 3.0f32.sqrt();
        assert!((along([0.0; 3], [d; 3]) - 1.5 * 3.0f32.sqrt()).abs() < 1e-4);
        assert_eq!(along([0.0, 2.0, 0.0], [1.0, 0.0, 0.0]), 0.0);
    }
}
