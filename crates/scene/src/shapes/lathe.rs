//! Surfaces of revolution: turned profiles, with optional flutes.

use super::patch::{Vertex, add_patch};
use crate::TriangleMesh;
use elementary::{cos, sin};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A profile turned about the y axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Lathe {
    /// (radius, height) pairs, metres, from the bottom up along the outside. Radii are not negative; the surface is
    /// closed if the first and last are 0.
    pub profile: Vec<Vec2>,
    /// Divisions of the circle, at least 3.
    pub segments: u32,
    /// Corners of the profile that turn by more than this angle (radians) stay sharp.
    pub crease_angle: f32,
    /// Grooves along the profile; 0 for none.
    pub flutes: u32,
    /// Depth of the grooves relative to the radius, in `[0, 0.5]`.
    pub flute_depth: f32,
}

impl Lathe {
    /// A smooth turned profile without flutes.
    pub fn new(profile: Vec<Vec2>, segments: u32) -> Self {
        Self { profile, segments, crease_angle: 40f32.to_radians(), flutes: 0, flute_depth: 0.0 }
    }
}

/// A closed cylinder or truncated cone about the y axis, standing on y = 0; a radius of 0 gives a tip.
pub fn cylinder(bottom: f32, top: f32, height: f32, segments: u32) -> TriangleMesh {
    let profile = [(0.0, 0.0), (bottom, 0.0), (top, height), (0.0, height)];
    lathe(&Lathe::new(profile.map(Vec2::from).to_vec(), segments))
}

/// Turns a profile. Texture coordinates: u around, v along the profile from 1 at its start to 0 at its end.
pub fn lathe(l: &Lathe) -> TriangleMesh {
    let mut profile = l.profile.clone();
    profile.dedup();
    let mut mesh = TriangleMesh::default();
    if profile.len() < 2 {
        return mesh;
    }
    let lengths = arc_lengths(&profile);
    let mut start = 0;
    for end in 1..profile.len() {
        if end + 1 == profile.len() || is_crease(&profile, end, l.crease_angle) {
            add_run(&mut mesh, l, &profile, &lengths, start..end + 1);
            start = end;
        }
    }
    mesh
}

/// Length along the profile up to each point, as a share of the whole.
fn arc_lengths(profile: &[Vec2]) -> Vec<f32> {
    let mut lengths = vec![0.0];
    for pair in profile.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + pair[0].distance(pair[1]));
    }
    let total = lengths[lengths.len() - 1].max(f32::MIN_POSITIVE);
    lengths.iter_mut().for_each(|l| *l /= total);
    lengths
}

fn is_crease(profile: &[Vec2], at: usize, angle: f32) -> bool {
    (profile[at] - profile[at - 1]).angle_to(profile[at + 1] - profile[at]).abs() > angle
}

/// Adds the smooth piece of the profile between two creases.
fn add_run(
    mesh: &mut TriangleMesh,
    l: &Lathe,
    profile: &[Vec2],
    lengths: &[f32],
    run: std::ops::Range<usize>,
) {
    let segments = l.segments.max(3);
    let tangent = |j: usize| {
        let (before, after) = (j.max(run.start + 1) - 1, (j + 1).min(run.end - 1));
        (profile[after] - profile[before]).normalize_or(Vec2::Y)
    };
    add_patch(mesh, segments, (run.len() - 1) as u32, |i, row| {
        let j = run.start + row as usize;
        let phi = TAU * (i % segments) as f32 / segments as f32;
        let (groove, groove_slope) = groove(l, phi);
        let (outward, around) = (Vec3::new(sin(phi), 0.0, cos(phi)), Vec3::new(cos(phi), 0.0, -sin(phi)));
        let radius = profile[j].x * groove;
        let along = outward * tangent(j).x * groove + Vec3::Y * tangent(j).y;
        let across = outward * profile[j].x * groove_slope + around * radius;
        let plain = outward * tangent(j).y - Vec3::Y * tangent(j).x;
        let normal = if l.flutes == 0 || radius <= 1e-6 { plain } else { across.cross(along) };
        Vertex {
            position: outward * radius + Vec3::Y * profile[j].y,
            normal: normal.normalize_or(Vec3::Y),
            uv: Vec2::new(i as f32 / segments as f32, 1.0 - lengths[j]),
        }
    });
}

/// Factor of the radius at angle `phi`, and its derivative by the angle.
fn groove(l: &Lathe, phi: f32) -> (f32, f32) {
    if l.flutes == 0 {
        return (1.0, 0.0);
    }
    let half = phi * l.flutes as f32 * 0.5;
    let depth = l.flute_depth.clamp(0.0, 0.5);
    // |sin| gives round grooves with narrow ridges between them.
    let slope = -depth * 0.5 * l.flutes as f32 * cos(half) * sin(half).signum();
    (1.0 - depth * sin(half).abs(), if sin(half).abs() < 1e-4 { 0.0 } else { slope })
}
