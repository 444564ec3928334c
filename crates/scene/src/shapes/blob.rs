//! Blobs: spheres displaced by smooth seeded waves, as stand-ins for sculptures, stones and scanned models.

use super::noise::{uniform, unit_vector};
use super::sphere::{direction_uv, unit_icosphere};
use crate::TriangleMesh;
use elementary::{powi, sin};
use glam::Vec3;

/// A sphere displaced along its normals by seeded sine waves in four octaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blob {
    /// Radius before displacement, metres.
    pub radius: f32,
    /// Subdivision level as in [`super::icosphere`], at most 9.
    pub level: u32,
    /// Strength of the displacement relative to the radius; 0.15 is lively, 0.4 is wild.
    pub amplitude: f32,
    /// Share of fine detail, in `[0, 1]`.
    pub detail: f32,
    /// Which blob.
    pub seed: u32,
}

/// Waves in each octave.
const WAVES: u32 = 8;

/// A closed displaced sphere around the origin, with smooth normals.
pub fn blob(b: &Blob) -> TriangleMesh {
    let (directions, indices) = unit_icosphere(b.level);
    let waves = waves(b);
    let radius_at = |n: Vec3| {
        let sum: f32 = waves.iter().map(|(k, phase, weight)| weight * sin(k.dot(n) + phase)).sum();
        b.radius * (1.0 + b.amplitude * sum).max(0.05)
    };
    let positions: Vec<Vec3> = directions.iter().map(|n| *n * radius_at(*n)).collect();
    let normals = smooth_normals(&positions, &indices);
    let uv0 = directions.iter().map(|n| direction_uv(*n)).collect();
    TriangleMesh { positions, normals, uv0, indices, ..Default::default() }
}

/// Wave vector, phase and weight of each wave.
fn waves(b: &Blob) -> Vec<(Vec3, f32, f32)> {
    let mut waves = Vec::new();
    for (octave, frequency) in [2.6f32, 6.0, 14.0, 36.0].into_iter().enumerate() {
        let weight = powi(b.detail.clamp(0.0, 1.0), octave as i32) / (WAVES as f32).sqrt();
        for wave in 0..WAVES {
            let index = octave as u32 * WAVES + wave;
            let phase = std::f32::consts::TAU * uniform(b.seed ^ 0x5bd1, index);
            waves.push((unit_vector(b.seed, index) * frequency, phase, weight));
        }
    }
    waves
}

/// Area-weighted vertex normals.
pub(super) fn smooth_normals(positions: &[Vec3], indices: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in indices {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        let weighted = (b - a).cross(c - a);
        triangle.iter().for_each(|i| normals[*i as usize] += weighted);
    }
    normals.iter().zip(positions).map(|(n, p)| n.try_normalize().unwrap_or(p.normalize_or(Vec3::Y))).collect()
}
