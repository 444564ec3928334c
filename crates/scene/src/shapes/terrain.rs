//! Generated landscapes.

use super::noise::gradient_noise;
use super::patch::{Vertex, add_patch};
use crate::TriangleMesh;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// A landscape of fractal noise over a square in the x–z plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terrain {
    /// Extent along x and z, metres.
    pub size: Vec2,
    /// Quadrilaterals along x and z, at least 1.
    pub divisions: [u32; 2],
    /// Height of the largest hills above and below 0, metres.
    pub height: f32,
    /// Size of the largest hills, metres, positive.
    pub feature: f32,
    /// Height of each octave relative to the one before, in `[0, 1]`: 0.5 is natural, more is rougher.
    pub roughness: f32,
    /// Number of octaves, in `[1, 12]`.
    pub octaves: u32,
    /// Which landscape.
    pub seed: u32,
}

/// Heights on a grid, facing +Y, with smooth normals.
pub fn terrain(t: &Terrain) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let [columns, rows] = t.divisions.map(|d| d.max(1));
    let step = t.size / Vec2::new(columns as f32, rows as f32);
    // Slopes need the neighbours' heights, beyond the border too: each is computed once, rows on all cores.
    let place = |i: i64, j: i64| {
        let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
        Vec2::new((u - 0.5) * t.size.x, (0.5 - v) * t.size.y)
    };
    let row = |j: i64| (-1..=i64::from(columns) + 1).map(move |i| height(t, place(i, j)));
    let heights: Vec<f32> = (-1..=i64::from(rows) + 1).into_par_iter().flat_map_iter(row).collect();
    let at = |i: i64, j: i64| heights[((j + 1) * (i64::from(columns) + 3) + i + 1) as usize];
    add_patch(&mut mesh, columns, rows, |i, j| {
        let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
        let (i, j) = (i64::from(i), i64::from(j));
        let p = place(i, j);
        let slope_x = at(i + 1, j) - at(i - 1, j);
        let slope_z = at(i, j - 1) - at(i, j + 1); // rows go towards −z
        Vertex {
            position: Vec3::new(p.x, at(i, j), p.y),
            normal: Vec3::new(-slope_x / (2.0 * step.x), 1.0, -slope_z / (2.0 * step.y)).normalize(),
            uv: Vec2::new(u, 1.0 - v),
        }
    });
    mesh
}

fn height(t: &Terrain, p: Vec2) -> f32 {
    let mut q = p / t.feature.max(1e-6);
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..t.octaves.clamp(1, 12) {
        sum += weight * gradient_noise(q, t.seed.wrapping_add(octave));
        total += weight;
        weight *= t.roughness;
        q = q * 2.0 + Vec2::splat(17.31);
    }
    t.height * sum / total
}
