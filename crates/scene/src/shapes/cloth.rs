//! Hanging cloth.

use super::noise::uniform;
use super::patch::{Vertex, add_patch};
use crate::TriangleMesh;
use elementary::{exp, powi, sin};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A curtain that hangs in the x–y plane from y = `size.y` down to y = 0, centred on x = 0; its front faces +Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curtain {
    /// Width and height, metres.
    pub size: Vec2,
    /// Number of folds.
    pub folds: f32,
    /// Amplitude of the folds, metres.
    pub depth: f32,
    /// How far the curtain is drawn together at two fifths of its height, in `[0, 0.9]`.
    pub gather: f32,
    /// Quadrilaterals across and down, at least 1.
    pub divisions: [u32; 2],
    /// Which curtain.
    pub seed: u32,
}

/// One sheet of cloth with smooth normals; render it with a double-sided material.
pub fn curtain(c: &Curtain) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let [columns, rows] = c.divisions.map(|d| d.max(1));
    let phases: Vec<f32> = (0..4).map(|i| TAU * uniform(c.seed, i)).collect();
    let step = 0.5 / columns.max(rows) as f32;
    add_patch(&mut mesh, columns, rows, |i, j| {
        let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
        let across = point(c, &phases, u + step, v) - point(c, &phases, u - step, v);
        let up = point(c, &phases, u, v + step) - point(c, &phases, u, v - step);
        let normal = across.cross(up).normalize_or(Vec3::Z);
        Vertex { position: point(c, &phases, u, v), normal, uv: Vec2::new(u, 1.0 - v) }
    });
    mesh
}

/// The cloth at share `u` of its width and `v` of its height (0 at the bottom).
fn point(c: &Curtain, phases: &[f32], u: f32, v: f32) -> Vec3 {
    let waist = c.gather.clamp(0.0, 0.9) * exp(-powi((v - 0.4) / 0.22, 2));
    let angle = TAU * c.folds * u;
    // Folds are tight at the rail and open, lean and merge a little on the way down.
    let drop = 1.0 - v;
    let main = sin(angle + phases[0] + 1.1 * drop * sin(TAU * u * 1.5 + phases[1]));
    let fine = 0.35 * sin(2.0 * angle + phases[2] + 1.7 * drop) + 0.2 * sin(TAU * 2.3 * u + phases[3]);
    let amplitude = c.depth * (0.55 + 0.45 * drop) * (1.0 + 0.8 * waist);
    let x = (u - 0.5) * c.size.x * (1.0 - waist);
    Vec3::new(x, v * c.size.y, amplitude * (main + fine))
}
