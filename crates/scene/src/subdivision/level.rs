//! A level of subdivision: faces as half edges, and the values at their corners.
//!
//! Half edge `h` goes from corner `h` of a face to the next one, counter-clockwise. Its twin goes back along the same
//! edge in the neighbouring face. Values lie in channels: one of positions, and others, such as texture coordinates, that
//! have vertices of their own, since they may differ on both sides of an edge.

use super::cage::{Cage, CageReport, NONE};
use super::description::Scheme;
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::{Add, Mul};

/// What can be averaged.
pub(super) trait Value:
    Copy + Default + Send + Sync + PartialEq + Add<Output = Self> + Mul<f32, Output = Self>
{
}
impl Value for Vec2 {}
impl Value for Vec3 {}
impl Value for Vec4 {}

/// Values at corners, those around a vertex shared.
#[derive(Clone, Debug, Default)]
pub(super) struct Channel<V> {
    /// For each corner its vertex.
    pub of: Vec<u32>,
    /// Values of vertices.
    pub values: Vec<V>,
    /// A corner of each vertex.
    pub first: Vec<u32>,
    /// Half edges across which values differ; empty if there are none.
    pub cut: Vec<bool>,
    /// For each vertex its number among all points of the surface; [`NONE`] where nobody needs it.
    pub ids: Vec<u32>,
}

impl<V: Value> Channel<V> {
    /// Whether values differ on both sides of an edge.
    pub fn is_cut(&self, half: u32) -> bool {
        self.cut.get(half as usize).copied().unwrap_or(false)
    }

    /// The value at a corner.
    pub fn at(&self, corner: u32) -> V {
        self.values[self.of[corner as usize] as usize]
    }

    /// The number of a corner's vertex among all points.
    pub fn id(&self, corner: u32) -> u32 {
        self.ids[self.of[corner as usize] as usize]
    }
}

/// How many corners faces have.
#[derive(Clone, Debug)]
pub(super) enum Sides {
    /// All as many.
    Equal(u32),
    /// Where the corners of each face start, with the end; and the face of each corner.
    Mixed { starts: Vec<u32>, faces: Vec<u32> },
}

/// Faces and what is at their corners.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub sides: Sides,
    /// The twin of each half edge, [`NONE`] at the border.
    pub twins: Vec<u32>,
    /// For how many levels the edge of each half edge stays sharp; empty if none is. Infinite is for ever.
    pub sharp: Vec<f32>,
    /// For how many levels each vertex of the positions stays where it is; empty if none does.
    pub pins: Vec<f32>,
    /// Whether each face is a part of the surface; others are there for the vertices of these.
    pub real: Vec<bool>,
    /// Part of the mesh of each face.
    pub parts: Vec<u32>,
    pub position: Channel<Vec3>,
    pub uvs: [Option<Channel<Vec2>>; 2],
    pub color: Option<Channel<Vec4>>,
    /// Normals, of the linear scheme.
    pub normal: Option<Channel<Vec3>>,
    /// For each corner the number of its normal among all of the surface, [`NONE`] where nobody needs it.
    pub normal_ids: Vec<u32>,
    /// Whether corners of the border with one face are rounded.
    pub round_corners: bool,
}

impl Level {
    /// Level 0 of a cage that was cleaned.
    pub fn new(cage: &Cage, scheme: Scheme, report: &mut CageReport) -> Self {
        let sides = sides(cage);
        let count = cage.positions_of.len();
        let mut level = Self {
            sides,
            twins: vec![NONE; count],
            sharp: Vec::new(),
            pins: Vec::new(),
            real: vec![true; cage.faces()],
            parts: (0..cage.faces()).map(|face| cage.part(face)).collect(),
            position: Channel::default(),
            uvs: [None, None],
            color: None,
            normal: None,
            normal_ids: vec![NONE; count],
            round_corners: cage.round_corners,
        };
        level.find_twins(cage, report);
        level.position = level.channel(&cage.positions_of, &cage.positions, false);
        for set in [0, 1] {
            if !cage.uvs_of[set].is_empty() {
                level.uvs[set] = Some(level.channel(&cage.uvs_of[set], &cage.uvs[set], true));
            }
        }
        if !cage.colors.is_empty() {
            level.color = Some(level.channel(&cage.positions_of, &cage.colors, false));
        }
        level.set_sharpness(cage);
        if scheme == Scheme::Linear {
            level.normal = Some(level.normals_of(cage));
        }
        level
    }

    /// Number of faces.
    pub fn faces(&self) -> u32 {
        self.real.len() as u32
    }

    /// Whether all faces have so many corners.
    pub fn all_have(&self, sides: u32) -> bool {
        matches!(self.sides, Sides::Equal(n) if n == sides)
    }

    /// The corners of a face.
    pub fn corners(&self, face: u32) -> std::ops::Range<u32> {
        match &self.sides {
            Sides::Equal(n) => face * n..face * n + n,
            Sides::Mixed { starts, .. } => starts[face as usize]..starts[face as usize + 1],
        }
    }

    /// The face of a corner.
    pub fn face_of(&self, corner: u32) -> u32 {
        match &self.sides {
            Sides::Equal(4) => corner >> 2,
            Sides::Equal(n) => corner / n,
            Sides::Mixed { faces, .. } => faces[corner as usize],
        }
    }

    /// The next corner of the face, counter-clockwise.
    pub fn next(&self, corner: u32) -> u32 {
        if let Sides::Equal(4) = self.sides {
            return corner & !3 | (corner + 1) & 3;
        }
        let corners = self.corners(self.face_of(corner));
        if corner + 1 == corners.end { corners.start } else { corner + 1 }
    }

    /// The corner of the face before.
    pub fn previous(&self, corner: u32) -> u32 {
        if let Sides::Equal(4) = self.sides {
            return corner & !3 | (corner + 3) & 3;
        }
        let corners = self.corners(self.face_of(corner));
        if corner == corners.start { corners.end - 1 } else { corner - 1 }
    }

    /// The twin of a half edge, if there is one.
    pub fn twin(&self, half: u32) -> Option<u32> {
        let twin = self.twins[half as usize];
        (twin != NONE).then_some(twin)
    }

    /// For how many levels the edge of a half edge stays sharp.
    pub fn sharpness(&self, half: u32) -> f32 {
        self.sharp.get(half as usize).copied().unwrap_or(0.0)
    }

    /// For how many levels the vertex of a corner stays where it is.
    pub fn pin(&self, corner: u32) -> f32 {
        if self.pins.is_empty() { 0.0 } else { self.pins[self.position.of[corner as usize] as usize] }
    }

    fn find_twins(&mut self, cage: &Cage, report: &mut CageReport) {
        let count = cage.positions_of.len() as u32;
        let edge = |half: u32| {
            let a = cage.positions_of[half as usize];
            let b = cage.positions_of[self.next(half) as usize];
            (a.min(b), a.max(b), half)
        };
        let mut edges: Vec<(u32, u32, u32)> = (0..count).into_par_iter().map(edge).collect();
        edges.par_sort_unstable();
        for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match group {
                [_] => {}
                [(.., a), (.., b)] if cage.positions_of[*a as usize] != cage.positions_of[*b as usize] => {
                    self.twins[*a as usize] = *b;
                    self.twins[*b as usize] = *a;
                }
                _ => report.cut_edges += 1,
            }
        }
    }

    /// The channel of values that corners have.
    ///
    /// - `seams`: whether values may differ at an edge of two faces.
    fn channel<V: Value>(&self, of: &[u32], values: &[V], seams: bool) -> Channel<V> {
        let at = |corner: u32| values[of[corner as usize] as usize];
        let mut channel = Channel::default();
        if seams {
            let differs = |half: u32| {
                self.twin(half)
                    .is_some_and(|twin| at(half) != at(self.next(twin)) || at(self.next(half)) != at(twin))
            };
            channel.cut = (0..of.len() as u32).map(differs).collect();
            if !channel.cut.contains(&true) {
                channel.cut = Vec::new();
            }
        }
        channel.of = vec![NONE; of.len()];
        let mut ring = Vec::new();
        for corner in 0..of.len() as u32 {
            if channel.of[corner as usize] != NONE {
                continue;
            }
            let vertex = channel.values.len() as u32;
            self.ring(&channel, corner, &mut ring);
            ring.iter().for_each(|c| channel.of[*c as usize] = vertex);
            channel.values.push(at(corner));
            channel.first.push(corner);
        }
        channel.ids = vec![NONE; channel.values.len()];
        channel
    }

    fn set_sharpness(&mut self, cage: &Cage) {
        let endless = |s: f32| if s >= Cage::ENDLESS { f32::INFINITY } else { s.max(0.0) };
        if !cage.creases.is_empty() {
            let known: HashMap<[u32; 2], f32> =
                cage.creases.iter().map(|([a, b], s)| ([*a.min(b), *a.max(b)], endless(*s))).collect();
            let sharpness = |half: u32| {
                let a = cage.positions_of[half as usize];
                let b = cage.positions_of[self.next(half) as usize];
                known.get(&[a.min(b), a.max(b)]).copied().unwrap_or(0.0)
            };
            self.sharp = (0..self.twins.len() as u32).map(sharpness).collect();
        }
        if !cage.corners.is_empty() {
            let known: HashMap<u32, f32> = cage.corners.iter().map(|(v, s)| (*v, endless(*s))).collect();
            let pin = |corner: &u32| {
                let place = cage.positions_of[*corner as usize];
                known.get(&place).copied().unwrap_or(0.0)
            };
            self.pins = self.position.first.iter().map(pin).collect();
        }
    }

    /// The channel of the cage's normals; means of the faces around where there are none.
    fn normals_of(&self, cage: &Cage) -> Channel<Vec3> {
        if !cage.normals_of.is_empty() {
            return self.channel(&cage.normals_of, &cage.normals, true);
        }
        let faces: Vec<Vec3> = (0..self.faces())
            .map(|face| {
                let corners: Vec<Vec3> = self.corners(face).map(|c| self.position.at(c)).collect();
                super::cage::newell(&corners)
            })
            .collect();
        let mut ring = Vec::new();
        let mut at_corners = vec![Vec3::ZERO; self.twins.len()];
        for corner in 0..self.twins.len() as u32 {
            self.sector(corner, &mut ring);
            let sum: Vec3 = ring.iter().map(|c| faces[self.face_of(*c) as usize]).sum();
            at_corners[corner as usize] = sum.normalize_or_zero();
            // The same bits at all corners of a sector, which begin their sums elsewhere.
            at_corners[corner as usize] = at_corners[ring.iter().copied().min().unwrap_or(corner) as usize];
        }
        let of: Vec<u32> = (0..at_corners.len() as u32).collect();
        self.channel(&of, &at_corners, true)
    }
}

fn sides(cage: &Cage) -> Sides {
    let size = |face: usize| cage.face(face).len() as u32;
    let first = if cage.faces() == 0 { 3 } else { size(0) };
    if (0..cage.faces()).all(|face| size(face) == first) {
        return Sides::Equal(first);
    }
    let starts: Vec<u32> = [0].into_iter().chain(cage.ends.iter().copied()).collect();
    let faces = (0..cage.faces()).flat_map(|face| cage.face(face).map(move |_| face as u32)).collect();
    Sides::Mixed { starts, faces }
}
