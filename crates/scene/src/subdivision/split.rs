//! From one level to the next.
//!
//! Faces become quadrilaterals, one for each of their corners, or triangles four triangles. Which half edge of a child
//! is the twin of which follows from the half edges of its parent. Where only some faces are split, children are made at
//! all corners around their vertices, so that the rings of all vertices of children of these faces are complete.

use super::cage::NONE;
use super::description::Scheme;
use super::level::{Channel, Level, Sides, Value};
use super::masks::{Vertex, edge_point, face_point, fade};
use rayon::prelude::*;

/// Which children there are.
pub(super) struct Children {
    /// Whether faces become triangles, four each; otherwise quadrilaterals.
    triangles: bool,
    /// For each vertex of the positions whether all that is around it is split.
    near: Vec<bool>,
    /// For each corner the child there, or [`NONE`].
    pub at: Vec<u32>,
    /// For each triangle its child in the middle, or [`NONE`].
    middle: Vec<u32>,
    count: u32,
}

impl Children {
    /// The children of a level of which all faces are split that are `chosen`.
    pub fn new(level: &Level, scheme: Scheme, chosen: &[bool]) -> Self {
        let triangles = scheme != Scheme::CatmullClark && level.all_have(3);
        let mut near = vec![false; level.position.values.len()];
        for face in (0..level.faces()).filter(|face| chosen[*face as usize]) {
            level.corners(face).for_each(|c| near[level.position.of[c as usize] as usize] = true);
        }
        let mut children = Self {
            triangles,
            near,
            at: vec![NONE; level.twins.len()],
            middle: vec![NONE; if triangles { level.faces() as usize } else { 0 }],
            count: 0,
        };
        for face in 0..level.faces() {
            let mut corners = 0;
            for corner in
                level.corners(face).filter(|c| children.near[level.position.of[*c as usize] as usize])
            {
                children.at[corner as usize] = children.count;
                children.count += 1;
                corners += 1;
            }
            if triangles && corners >= 2 {
                children.middle[face as usize] = children.count;
                children.count += 1;
            }
        }
        children
    }

    /// Number of children.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The corner of the next level at the middle of a half edge, on the side of its face; the child must be there.
    pub fn middle_of_edge(&self, half: u32) -> u32 {
        self.at[half as usize] * self.sides() + 1
    }

    /// The corner of the next level in the middle of a face that becomes quadrilaterals and has this corner.
    pub fn middle_of_face(&self, corner: u32) -> u32 {
        self.at[corner as usize] * 4 + 2
    }

    fn sides(&self) -> u32 {
        if self.triangles { 3 } else { 4 }
    }

    fn is_near(&self, level: &Level, corner: u32) -> bool {
        self.near[level.position.of[corner as usize] as usize]
    }

    /// The next level. `active`: the faces whose children are a part of the surface.
    pub fn level(&self, level: &Level, scheme: Scheme, active: &[bool]) -> Level {
        let sides = self.sides();
        let count = self.count as usize;
        let mut next = Level {
            sides: Sides::Equal(sides),
            twins: vec![NONE; count * sides as usize],
            sharp: self.by_half_edge(level, &level.sharp, fade),
            pins: Vec::new(),
            real: vec![false; count],
            parts: vec![0; count],
            position: self.channel(level, &level.position, scheme),
            uvs: level.uvs.each_ref().map(|uv| uv.as_ref().map(|uv| self.channel(level, uv, scheme))),
            color: level.color.as_ref().map(|color| self.channel(level, color, scheme)),
            normal: level.normal.as_ref().map(|normal| self.channel(level, normal, scheme)),
            normal_ids: vec![NONE; count * sides as usize],
            round_corners: level.round_corners,
        };
        for corner in 0..level.twins.len() as u32 {
            let child = self.at[corner as usize];
            if child == NONE {
                continue;
            }
            let face = level.face_of(corner) as usize;
            next.real[child as usize] = active[face];
            next.parts[child as usize] = level.parts[face];
            next.normal_ids[(child * sides) as usize] = level.normal_ids[corner as usize];
            self.twins_at(level, corner, &mut next.twins);
        }
        for face in 0..self.middle.len() as u32 {
            let middle = self.middle[face as usize];
            if middle != NONE {
                next.real[middle as usize] = active[face as usize];
                next.parts[middle as usize] = level.parts[face as usize];
                for (j, corner) in level.corners(face).enumerate() {
                    let child = self.at[level.next(corner) as usize];
                    next.twins[middle as usize * 3 + j] = if child == NONE { NONE } else { child * 3 + 1 };
                }
            }
        }
        if level.pins.iter().any(|pin| *pin > 1.0) {
            next.pins = vec![0.0; next.position.values.len()];
            let kept = (0..level.pins.len()).filter(|vertex| self.near[*vertex]);
            kept.enumerate().for_each(|(new, old)| next.pins[new] = fade(level.pins[old]));
        }
        next
    }

    /// The twins of the half edges of the child at a corner.
    fn twins_at(&self, level: &Level, corner: u32, twins: &mut [u32]) {
        let sides = self.sides();
        let first = (self.at[corner as usize] * sides) as usize;
        let half = |corner: u32, side: u32| match self.at[corner as usize] {
            NONE => NONE,
            child => child * sides + side,
        };
        let before = level.previous(corner);
        if let Some(twin) = level.twin(corner) {
            twins[first] = half(level.next(twin), sides - 1);
        }
        if let Some(twin) = level.twin(before) {
            twins[first + sides as usize - 1] = half(twin, 0);
        }
        if !self.triangles {
            twins[first + 1] = half(level.next(corner), 2);
            twins[first + 2] = half(before, 1);
            return;
        }
        let face = level.face_of(corner);
        let middle = self.middle[face as usize];
        if middle != NONE {
            twins[first + 1] = middle * 3 + (before - level.corners(face).start);
        }
    }

    /// What half edges have, for those of the children; nothing if none has any.
    fn by_half_edge<T: Copy + Default + PartialEq>(
        &self,
        level: &Level,
        of: &[T],
        next: impl Fn(T) -> T,
    ) -> Vec<T> {
        if of.is_empty() {
            return Vec::new();
        }
        let sides = self.sides() as usize;
        let mut all = vec![T::default(); self.count as usize * sides];
        for corner in (0..of.len() as u32).filter(|c| self.at[*c as usize] != NONE) {
            let first = self.at[corner as usize] as usize * sides;
            all[first] = next(of[corner as usize]);
            all[first + sides - 1] = next(of[level.previous(corner) as usize]);
        }
        if all.iter().all(|value| *value == T::default()) { Vec::new() } else { all }
    }

    /// A channel on the next level.
    fn channel<V: Value>(&self, level: &Level, channel: &Channel<V>, scheme: Scheme) -> Channel<V> {
        let halves = level.twins.len() as u32;
        let faces: Vec<V> = if self.triangles {
            Vec::new()
        } else {
            (0..level.faces()).into_par_iter().map(|face| face_point(level, channel, face)).collect()
        };
        let vertices: Vec<u32> = (0..channel.values.len() as u32)
            .filter(|vertex| self.is_near(level, channel.first[*vertex as usize]))
            .collect();
        let mut values: Vec<V> = vertices
            .par_iter()
            .map_init(Vec::new, |ring, vertex| {
                let closed = level.ring(channel, channel.first[*vertex as usize], ring);
                let around = Vertex::new(level, channel, ring, closed);
                let points = || {
                    let face = |c: &u32| faces[level.face_of(*c) as usize];
                    ring.iter().map(face).fold(V::default(), |sum, point| sum + point)
                };
                around.refined(scheme, points)
            })
            .collect();
        let twin = |half: u32| level.twin(half).filter(|_| !channel.is_cut(half));
        let edges: Vec<u32> = (0..halves)
            .filter(|half| {
                (self.is_near(level, *half) || self.is_near(level, level.next(*half)))
                    && twin(*half).is_none_or(|twin| *half < twin)
            })
            .collect();
        values.par_extend(edges.par_iter().map(|half| {
            let ends = channel.at(*half) + channel.at(level.next(*half));
            let Some(twin) = twin(*half) else { return ends * 0.5 };
            let others = || {
                if scheme == Scheme::Loop {
                    let opposite = |half: u32| channel.at(level.previous(half));
                    return opposite(*half) + opposite(twin);
                }
                let point = |half: u32| faces[level.face_of(half) as usize];
                point(*half) + point(twin)
            };
            edge_point(scheme, ends, level.sharpness(*half), others)
        }));
        let mut of_vertex = vec![NONE; channel.values.len()];
        vertices.iter().zip(0u32..).for_each(|(vertex, new)| of_vertex[*vertex as usize] = new);
        let mut of_edge = vec![NONE; halves as usize];
        for (half, new) in edges.iter().zip(vertices.len() as u32..) {
            of_edge[*half as usize] = new;
            if let Some(twin) = twin(*half) {
                of_edge[twin as usize] = new;
            }
        }
        let mut of_face = vec![NONE; faces.len()];
        for (face, point) in faces.iter().enumerate() {
            if level.corners(face as u32).any(|c| self.is_near(level, c)) {
                of_face[face] = values.len() as u32;
                values.push(*point);
            }
        }
        let mut ids = vec![NONE; values.len()];
        vertices.iter().zip(&mut ids).for_each(|(old, new)| *new = channel.ids[*old as usize]);
        let of = self.corners(level, &channel.of, &of_vertex, &of_edge, &of_face);
        let mut first = vec![NONE; values.len()];
        of.iter().zip(0u32..).for_each(|(vertex, corner)| first[*vertex as usize] = corner);
        let cut = self.by_half_edge(level, &channel.cut, |cut| cut);
        Channel { of, values, first, cut, ids }
    }

    /// The vertices at the corners of all children.
    fn corners(
        &self,
        level: &Level,
        of: &[u32],
        of_vertex: &[u32],
        of_edge: &[u32],
        of_face: &[u32],
    ) -> Vec<u32> {
        let sides = self.sides() as usize;
        let mut corners = vec![NONE; self.count as usize * sides];
        for corner in (0..level.twins.len() as u32).filter(|c| self.at[*c as usize] != NONE) {
            let first = self.at[corner as usize] as usize * sides;
            corners[first] = of_vertex[of[corner as usize] as usize];
            corners[first + 1] = of_edge[corner as usize];
            corners[first + sides - 1] = of_edge[level.previous(corner) as usize];
            if !self.triangles {
                corners[first + 2] = of_face[level.face_of(corner) as usize];
            }
        }
        for (face, middle) in self.middle.iter().enumerate().filter(|(_, middle)| **middle != NONE) {
            for (j, corner) in level.corners(face as u32).enumerate() {
                corners[*middle as usize * 3 + j] = of_edge[corner as usize];
            }
        }
        corners
    }
}
