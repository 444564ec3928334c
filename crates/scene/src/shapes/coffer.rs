//! Coffered ceilings and barrel vaults.

use super::patch::{Vertex, add_patch, add_quad};
use crate::TriangleMesh;
use elementary::{asin, cos, sin};
use glam::{Vec2, Vec3};

/// A ceiling or vault of sunken square panels, seen from below; centred on x = 0 and z = 0, its springing at y = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coffers {
    /// Extent across (x) and along (z), metres.
    pub size: Vec2,
    /// Height of the vault above its springing, metres, at most half the width; 0 for a flat ceiling.
    pub rise: f32,
    /// Panels across and along, at least 1.
    pub count: [u32; 2],
    /// How deep the panels are sunken, metres.
    pub depth: f32,
    /// Subdivisions of a panel's side, at least 1; a vault needs a few.
    pub segments: u32,
}

/// Nested frames of a panel: inset as a share of the panel's side, and depth as a share of the whole depth.
const FRAMES: [(f32, f32); 5] = [(0.0, 0.0), (0.13, 0.0), (0.15, 0.45), (0.23, 0.45), (0.25, 1.0)];

/// The underside of the ceiling; an open sheet that faces down and inwards.
pub fn coffers(c: &Coffers) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let [across, along] = c.count.map(|n| n.max(1));
    for i in 0..across {
        for j in 0..along {
            let low = Vec2::new(i as f32 / across as f32, j as f32 / along as f32);
            add_coffer(&mut mesh, c, low, Vec2::new(1.0 / across as f32, 1.0 / along as f32));
        }
    }
    mesh
}

/// One panel: a ring of four sides between each two neighbouring frames, and the panel in the last one.
fn add_coffer(mesh: &mut TriangleMesh, c: &Coffers, low: Vec2, extent: Vec2) {
    let steps = c.segments.max(1);
    // Corners of a frame in the order in which x × z faces down.
    let corner = |inset: f32, k: usize| {
        let (x, z) =
            [(inset, inset), (1.0 - inset, inset), (1.0 - inset, 1.0 - inset), (inset, 1.0 - inset)][k % 4];
        low + extent * Vec2::new(x, z)
    };
    for pair in FRAMES.windows(2) {
        let [(outer, outer_depth), (inner, inner_depth)] = [pair[0], pair[1]];
        for side in 0..4 {
            let at = |i: u32, row: u32| {
                let inset = if row == 0 { outer } else { inner };
                corner(inset, side).lerp(corner(inset, side + 1), i as f32 / steps as f32)
            };
            let depth = |row: u32| c.depth * if row == 0 { outer_depth } else { inner_depth };
            if outer_depth == inner_depth {
                add_patch(mesh, steps, 1, |i, row| {
                    let (position, normal) = surface(c, at(i, row), depth(row));
                    Vertex { position, normal, uv: at(i, row) }
                });
            } else {
                for i in 0..steps {
                    let p = |i, row| surface(c, at(i, row), depth(row)).0;
                    add_quad(mesh, [p(i, 0), p(i + 1, 0), p(i + 1, 1), p(i, 1)]);
                }
            }
        }
    }
    let (inset, depth) = FRAMES[FRAMES.len() - 1];
    add_patch(mesh, steps, steps, |i, j| {
        let share = Vec2::new(i as f32, j as f32) / steps as f32;
        let at = low + extent * (Vec2::splat(inset) + (1.0 - 2.0 * inset) * share);
        let (position, normal) = surface(c, at, c.depth * depth);
        Vertex { position, normal, uv: at }
    });
}

/// Point and inward normal at share `s` of the extent, sunken by `depth`.
fn surface(c: &Coffers, s: Vec2, depth: f32) -> (Vec3, Vec3) {
    let z = (s.y - 0.5) * c.size.y;
    let half = c.size.x * 0.5;
    let rise = c.rise.clamp(0.0, half);
    if rise < 1e-4 * half {
        return (Vec3::new((s.x - 0.5) * c.size.x, depth, z), Vec3::NEG_Y);
    }
    let radius = (half * half + rise * rise) / (2.0 * rise);
    let angle = asin((half / radius).clamp(-1.0, 1.0)) * (2.0 * s.x - 1.0);
    let outward = Vec3::new(sin(angle), cos(angle), 0.0);
    (Vec3::new(0.0, rise - radius, z) + outward * (radius + depth), -outward)
}
