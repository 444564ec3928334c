//! Wall panels with an arched opening.

use super::append;
use super::patch::{Vertex, add_patch, add_quad};
use super::tube::tube;
use crate::TriangleMesh;
use elementary::{atan2, sin_cos};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// A wall panel with an arched opening that reaches down to the floor. It stands on y = 0, centred on x = 0, z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arch {
    /// Width (x), height (y) and thickness (z) of the panel, metres.
    pub size: Vec3,
    /// Width of the opening, metres; clamped to 98 % of the panel's.
    pub opening: f32,
    /// Height at which the curve starts, metres.
    pub spring: f32,
    /// Height of the curve above `spring`, metres; half the opening gives a round arch.
    pub rise: f32,
    /// Segments of the curve, at least 4.
    pub segments: u32,
    /// Radius of a round moulding along the opening on both faces, metres; 0 for none.
    pub moulding: f32,
}

/// A closed panel; mouldings are separate closed tubes that touch it.
pub fn arch(a: &Arch) -> TriangleMesh {
    let (half, height, depth) = (a.size.x.abs() * 0.5, a.size.y.abs(), a.size.z.abs() * 0.5);
    let reach = (a.opening.abs() * 0.5).min(half * 0.98);
    let rise = a.rise.abs().min(height * 0.98);
    let spring = a.spring.clamp(0.0, height * 0.98 - rise.min(height * 0.98));
    let (inner, outer) = outlines(half, height, reach, spring, rise, a.segments.max(4));
    let mut mesh = TriangleMesh::default();
    add_faces(&mut mesh, &inner, &outer, half, height, depth);
    add_soffit(&mut mesh, &inner, depth);
    add_outside(&mut mesh, &inner, &outer, depth);
    if a.moulding > 0.0 {
        for z in [-depth, depth] {
            let path: Vec<Vec3> = inner.iter().map(|p| p.extend(z)).collect();
            append(&mut mesh, tube(&path, false, a.moulding, 12));
        }
    }
    mesh
}

/// The opening's outline from its lower left to its lower right corner, and for each point its partner on the
/// panel's border; the border's corners are among them.
fn outlines(
    half: f32,
    height: f32,
    reach: f32,
    spring: f32,
    rise: f32,
    segments: u32,
) -> (Vec<Vec2>, Vec<Vec2>) {
    let corner = atan2(height - spring, half);
    let mut angles: Vec<f32> = (0..=segments).map(|i| PI * (1.0 - i as f32 / segments as f32)).collect();
    angles.retain(|a| (a - corner).abs() > 1e-3 && (a - (PI - corner)).abs() > 1e-3);
    angles.extend([corner, PI - corner]);
    angles.sort_by(|a, b| b.total_cmp(a));
    let mut pairs = vec![(Vec2::new(-reach, 0.0), Vec2::new(-half, 0.0))];
    for angle in angles {
        let (sin, cos) = sin_cos(angle);
        let border = if angle > PI - corner {
            Vec2::new(-half, spring + half * sin / -cos)
        } else if angle < corner {
            Vec2::new(half, spring + half * sin / cos)
        } else if angle == corner || angle == PI - corner {
            Vec2::new(half * cos.signum(), height)
        } else {
            Vec2::new((height - spring) * cos / sin, height)
        };
        pairs.push((Vec2::new(reach * cos, spring + rise * sin), border));
    }
    pairs.push((Vec2::new(reach, 0.0), Vec2::new(half, 0.0)));
    pairs.dedup();
    pairs.into_iter().unzip()
}

/// The front (+z) and back faces.
fn add_faces(mesh: &mut TriangleMesh, inner: &[Vec2], outer: &[Vec2], half: f32, height: f32, depth: f32) {
    let last = inner.len() - 1;
    for (z, normal) in [(depth, Vec3::Z), (-depth, Vec3::NEG_Z)] {
        add_patch(mesh, last as u32, 1, |i, row| {
            let k = if z > 0.0 { i as usize } else { last - i as usize };
            let p = if row == 0 { inner[k] } else { outer[k] };
            let u = (p.x / half.max(f32::MIN_POSITIVE) * normal.z + 1.0) * 0.5;
            Vertex {
                position: p.extend(z),
                normal,
                uv: Vec2::new(u, 1.0 - p.y / height.max(f32::MIN_POSITIVE)),
            }
        });
    }
}

/// The inside of the opening, smooth along the curve.
fn add_soffit(mesh: &mut TriangleMesh, inner: &[Vec2], depth: f32) {
    let last = inner.len() - 1;
    add_patch(mesh, last as u32, 1, |i, row| {
        let k = i as usize;
        // The straight jambs and the curve meet with a common tangent, so one smooth run is right.
        let along = (inner[(k + 1).min(last)] - inner[k.max(1) - 1]).normalize_or(Vec2::X);
        let z = if row == 0 { -depth } else { depth };
        let uv = Vec2::new(i as f32 / last as f32, row as f32);
        Vertex { position: inner[k].extend(z), normal: Vec3::new(along.y, -along.x, 0.0), uv }
    });
}

/// The sides and the top of the panel, and the soles of its two feet.
fn add_outside(mesh: &mut TriangleMesh, inner: &[Vec2], outer: &[Vec2], depth: f32) {
    for pair in outer.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        add_quad(mesh, [a.extend(depth), b.extend(depth), b.extend(-depth), a.extend(-depth)]);
    }
    let last = inner.len() - 1;
    for (left, right) in [(outer[0], inner[0]), (inner[last], outer[last])] {
        let corners = [left.extend(-depth), right.extend(-depth), right.extend(depth), left.extend(depth)];
        add_quad(mesh, corners);
    }
}
