//! Normals of the limit: the cross product of two tangents, which are weighted sums of what is around a vertex.
//!
//! Masks of smooth vertices are those of Halstead, Kass and DeRose (1993) and of Loop (1987); of creases and borders those
//! of Biermann, Levin and Zorin ("Piecewise Smooth Subdivision Surfaces with Normal Control", 2000) and Hoppe et al.
//! ("Piecewise Smooth Surface Reconstruction", 1994), as OpenSubdiv has them.

use super::description::Scheme;
use super::level::Level;
use super::rings::Extent;
use elementary::{cos, sin};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// The unit normal of the limit at a corner, on its side of creases; zero where there is none. A crease that becomes
/// smooth on a later level counts as smooth.
pub(super) fn limit_normal(level: &Level, scheme: Scheme, corner: u32, ring: &mut Vec<u32>) -> Vec3 {
    let extent = level.sector(corner, ring);
    let around = Around::new(level, ring, extent);
    let faces = around.faces();
    let is_corner = level.pin(corner) == f32::INFINITY
        || extent == Extent::Open && !is_crease(level, corner, &mut Vec::new());
    let tangents = match (scheme, extent, is_corner) {
        (Scheme::Linear, ..) | (_, Extent::Closed | Extent::Slit, true) => None,
        (Scheme::CatmullClark, Extent::Closed | Extent::Slit, _) => Some(around.smooth_quads()),
        (Scheme::Loop, Extent::Closed | Extent::Slit, _) => Some(around.smooth_triangles()),
        (_, Extent::Open, true) => Some(around.corner()),
        (Scheme::CatmullClark, Extent::Open, false) => Some(around.crease_quads()),
        (Scheme::Loop, Extent::Open, false) => Some(around.crease_triangles()),
    };
    let normal = tangents.and_then(|[along, across]| along.cross(across).try_normalize());
    match normal {
        // Tangents of a corner that is wider than half a turn have the other orientation.
        Some(normal) if extent == Extent::Open && normal.dot(faces) < 0.0 && is_corner => -normal,
        Some(normal) => normal,
        None => faces.normalize_or_zero(),
    }
}

/// Whether just two edges of a vertex stay sharp for ever.
fn is_crease(level: &Level, corner: u32, ring: &mut Vec<u32>) -> bool {
    let closed = level.ring(&level.position, corner, ring);
    let inner = ring.iter().skip(usize::from(!closed));
    let sharp = inner.filter(|c| level.sharpness(**c) == f32::INFINITY).count();
    let lone = !closed && ring.len() == 1 && !level.round_corners;
    !lone && sharp + if closed { 0 } else { 2 } == 2
}

/// What is around a vertex, counter-clockwise from an edge, relative to the vertex.
struct Around {
    /// At the other ends of the edges. The last one is that of the edge which ends an open sector.
    ends: Vec<Vec3>,
    /// At the corner opposite to the vertex of each face.
    opposite: Vec<Vec3>,
}

impl Around {
    fn new(level: &Level, ring: &[u32], extent: Extent) -> Self {
        let own = level.position.at(ring[0]);
        let at = |corner: u32| level.position.at(corner) - own;
        let mut ends: Vec<Vec3> = ring.iter().map(|c| at(level.next(*c))).collect();
        if let (Extent::Open, Some(last)) = (extent, ring.last()) {
            ends.push(at(level.previous(*last)));
        }
        let opposite = ring.iter().map(|c| at(level.next(level.next(*c)))).collect();
        Self { ends, opposite }
    }

    /// Sum of the normals of the faces, each by its area.
    fn faces(&self) -> Vec3 {
        let count = self.ends.len();
        let face = |(i, opposite): (usize, &Vec3)| {
            let (a, c) = (self.ends[i], self.ends[(i + 1) % count]);
            // Of a triangle the opposite corner is the end of the next edge.
            a.cross(*opposite) + opposite.cross(c)
        };
        self.opposite.iter().enumerate().map(face).sum()
    }

    fn smooth_quads(&self) -> [Vec3; 2] {
        let n = self.ends.len() as f32;
        let step = TAU / n;
        let weight = 1.0 + cos(step) + cos(PI / n) * (2.0 * (9.0 + cos(step))).sqrt();
        let tangent = |wave: fn(f32) -> f32| {
            let sum = |(i, (end, opposite)): (usize, (&Vec3, &Vec3))| {
                let (now, next) = (wave(step * i as f32), wave(step * (i as f32 + 1.0)));
                *end * (weight * now) + *opposite * (now + next)
            };
            self.ends.iter().zip(&self.opposite).enumerate().map(sum).sum::<Vec3>()
        };
        [tangent(cos), tangent(sin)]
    }

    fn smooth_triangles(&self) -> [Vec3; 2] {
        let step = TAU / self.ends.len() as f32;
        let tangent = |wave: fn(f32) -> f32| {
            self.ends.iter().enumerate().map(|(i, end)| *end * wave(step * i as f32)).sum::<Vec3>()
        };
        [tangent(cos), tangent(sin)]
    }

    /// The first and the last edge, for the vertex itself is at zero.
    fn outer(&self) -> [Vec3; 2] {
        [self.ends[0], self.ends[self.ends.len() - 1]]
    }

    fn corner(&self) -> [Vec3; 2] {
        self.outer()
    }

    fn crease_quads(&self) -> [Vec3; 2] {
        let [first, last] = self.outer();
        let along = first - last;
        let faces = self.opposite.len();
        if faces == 1 {
            return [along, first + last];
        }
        let step = PI / faces as f32;
        let ratio = (cos(step) + 1.0) / sin(step);
        let mut across = (first + last) * (-ratio * (1.0 + 2.0 * cos(step)));
        for i in 0..faces {
            let (now, next) = (sin(step * i as f32), sin(step * (i as f32 + 1.0)));
            across += self.ends[i] * (4.0 * now) + self.opposite[i] * (now + next);
        }
        [along, across]
    }

    fn crease_triangles(&self) -> [Vec3; 2] {
        let [first, last] = self.outer();
        let faces = self.opposite.len();
        let inner: Vec3 = self.ends[1..faces].iter().copied().sum();
        let across = match faces {
            1 => first + last,
            2 => inner,
            3 => inner * 2.0 - first - last,
            _ => {
                let step = PI / faces as f32;
                let wave = |i: usize| self.ends[i] * sin(step * i as f32);
                (1..faces).map(wave).sum::<Vec3>() * (2.0 - 2.0 * cos(step)) - (first + last) * sin(step)
            }
        };
        [first - last, across]
    }
}
