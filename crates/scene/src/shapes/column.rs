//! Classical columns and balusters.

use super::lathe::{Lathe, lathe};
use super::tube::tube;
use super::{append, cuboid, icosphere, transformed};
use crate::TriangleMesh;
use elementary::{cos, sin};
use glam::{Affine3A, Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// A column on a square plinth, with a moulded base, a fluted shaft and a capital with scrolls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Height with base and capital, metres.
    pub height: f32,
    /// Radius of the shaft at its foot, metres.
    pub radius: f32,
    /// Number of flutes; 0 for a smooth shaft.
    pub flutes: u32,
    /// Divisions around, at least 16.
    pub segments: u32,
}

/// A column that stands on y = 0, built from closed pieces that overlap.
pub fn column(c: &Column) -> TriangleMesh {
    let r = c.radius;
    let segments = c.segments.max(16);
    let mut mesh = box_at(Vec3::new(2.7 * r, 0.35 * r, 2.7 * r), 0.175 * r, 0.03 * r);
    append(&mut mesh, turned(&base_profile(r), 0.35 * r, segments, 0, 1.0));
    let (foot, head) = (1.0 * r, (c.height - 1.15 * r).max(1.5 * r));
    append(&mut mesh, turned(&shaft_profile(r, head - foot), foot, segments, c.flutes, 0.07));
    append(&mut mesh, turned(&capital_profile(r), head, segments, 0, 1.0));
    add_beads(&mut mesh, 0.9 * r, head + 0.12 * r, 0.05 * r);
    add_scrolls(&mut mesh, r, head);
    append(&mut mesh, box_at(Vec3::new(2.5 * r, 0.3 * r, 2.5 * r), c.height - 0.15 * r, 0.04 * r));
    mesh
}

/// A turned baluster that stands on y = 0, with square foot and head.
///
/// `height` and `radius` (that of its belly) in metres.
pub fn baluster(height: f32, radius: f32, segments: u32) -> TriangleMesh {
    let side = 1.9 * radius;
    let block = 0.1 * height;
    let mut mesh = box_at(Vec3::new(side, block, side), 0.5 * block, 0.0);
    append(&mut mesh, box_at(Vec3::new(side, block, side), height - 0.5 * block, 0.0));
    #[rustfmt::skip]
    let shares = [
        (0.0, 0.0), (0.85, 0.0), (0.9, 0.03), (0.85, 0.06), (0.5, 0.09), (0.48, 0.13), (0.72, 0.19), (0.93, 0.26),
        (1.0, 0.34), (0.96, 0.42), (0.8, 0.54), (0.58, 0.68), (0.42, 0.8), (0.4, 0.86), (0.65, 0.89), (0.7, 0.91),
        (0.65, 0.93), (0.45, 0.95), (0.8, 0.98), (0.85, 1.0), (0.0, 1.0),
    ];
    let span = height - 2.0 * block;
    let profile = shares.iter().map(|(x, y)| Vec2::new(x * radius, block + y * span)).collect();
    append(&mut mesh, lathe(&Lathe { crease_angle: 75f32.to_radians(), ..Lathe::new(profile, segments) }));
    mesh
}

fn box_at(size: Vec3, y: f32, bevel: f32) -> TriangleMesh {
    transformed(cuboid(size, bevel, 2), &Affine3A::from_translation(Vec3::Y * y))
}

fn turned(profile: &[Vec2], y: f32, segments: u32, flutes: u32, flute_depth: f32) -> TriangleMesh {
    let profile = profile.iter().map(|p| *p + Vec2::new(0.0, y)).collect();
    lathe(&Lathe { flutes, flute_depth, ..Lathe::new(profile, segments) })
}

/// Two rolls with a hollow between them (an Attic base), 0.7 r high.
fn base_profile(r: f32) -> Vec<Vec2> {
    let mut profile = vec![Vec2::ZERO];
    roll(&mut profile, 1.12 * r, 0.14 * r, 0.14 * r);
    for i in 0..=8 {
        let t = i as f32 / 8.0;
        let hollow = 1.14 - 0.1 * t - 0.09 * sin(t * TAU * 0.5);
        profile.push(Vec2::new(hollow * r, (0.3 + 0.16 * t) * r));
    }
    roll(&mut profile, 1.02 * r, 0.57 * r, 0.09 * r);
    profile.extend([Vec2::new(1.02 * r, 0.7 * r), Vec2::new(0.0, 0.7 * r)]);
    profile
}

/// A half-round bulge of radius `size` on a cylinder of radius `at`, its middle at height `y`.
fn roll(profile: &mut Vec<Vec2>, at: f32, y: f32, size: f32) {
    for i in 0..=10 {
        let angle = -FRAC_PI_2 + FRAC_PI_2 * 2.0 * i as f32 / 10.0;
        profile.push(Vec2::new(at + size * cos(angle), y + size * sin(angle)));
    }
}

/// A shaft that tapers with a slight swelling (entasis).
fn shaft_profile(r: f32, height: f32) -> Vec<Vec2> {
    let mut profile = vec![Vec2::ZERO];
    for i in 0..=20 {
        let t = i as f32 / 20.0;
        profile.push(Vec2::new(r * (1.0 - 0.16 * t * t), t * height));
    }
    profile.push(Vec2::new(0.0, height));
    profile
}

/// Astragal, neck and echinus, 0.85 r high.
fn capital_profile(r: f32) -> Vec<Vec2> {
    let mut profile = vec![Vec2::ZERO];
    roll(&mut profile, 0.84 * r, 0.03 * r, 0.05 * r);
    profile.extend([Vec2::new(0.84 * r, 0.1 * r), Vec2::new(0.84 * r, 0.3 * r)]);
    for i in 0..=12 {
        let angle = FRAC_PI_2 * i as f32 / 12.0;
        profile.push(Vec2::new((0.86 + 0.3 * sin(angle)) * r, (0.84 - 0.5 * cos(angle)) * r));
    }
    profile.extend([Vec2::new(1.16 * r, 0.88 * r), Vec2::new(0.0, 0.88 * r)]);
    profile
}

/// A string of beads around the neck.
fn add_beads(mesh: &mut TriangleMesh, radius: f32, y: f32, size: f32) {
    let count = 32;
    for i in 0..count {
        let phi = TAU * i as f32 / count as f32;
        let at = Vec3::new(radius * sin(phi), y, radius * cos(phi));
        append(mesh, transformed(icosphere(size, 1), &Affine3A::from_translation(at)));
    }
}

/// Four spiral scrolls under the corners of the abacus.
fn add_scrolls(mesh: &mut TriangleMesh, r: f32, head: f32) {
    let path: Vec<Vec3> = (0..56)
        .map(|i| {
            let t = i as f32 / 55.0;
            let angle = FRAC_PI_2 - t * TAU * 2.25;
            let size = 0.34 * r * (1.0 - 0.7 * t);
            Vec3::new(1.3 * r + size * cos(angle), head + 0.5 * r + size * sin(angle), 0.0)
        })
        .collect();
    let scroll = tube(&path, false, 0.06 * r, 10);
    for corner in 0..4 {
        let turn = Affine3A::from_rotation_y(FRAC_PI_4 + FRAC_PI_2 * corner as f32);
        append(mesh, transformed(scroll.clone(), &turn));
    }
}
