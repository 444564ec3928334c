//! From a cage to triangles, level by level.
//!
//! A level has the faces that are a part of the surface and may be split, and around them those that are there only for the
//! rings of their vertices. Of the first kind, faces that are not split are done: they become triangles. Points of the
//! surface get numbers when they first belong to such a face, and their place on the limit then, which is the same on
//! all levels. So it does not matter from which side, or how deep, a point is reached.

use super::cage::{Cage, CageReport, NONE};
use super::description::Scheme;
use super::displacement::{Displacer, SurfacePoint};
use super::level::{Channel, Level, Value};
use super::masks::limit;
use super::normals::limit_normal;
use super::output::{Corner, Middle, Output};
use super::rate::{PixelScale, Rate};
use super::split::Children;
use crate::TriangleMesh;
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// Why a surface cannot be cut into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TessellationError {
    /// There would be more triangles than the limit.
    #[error("subdivision makes {faces} faces at level {level}; {most} are the most")]
    TooMany {
        /// Faces of the level.
        faces: u64,
        /// Number of the level.
        level: u32,
        /// The limit.
        most: u64,
    },
}

/// Triangles of a subdivided cage.
#[derive(Clone, Debug)]
pub struct Tessellation {
    /// A mesh for each part of the cage; parts without faces have none.
    pub parts: Vec<TriangleMesh>,
    /// What had to be mended.
    pub report: CageReport,
    /// Whether faces would have been split further if there were more levels.
    pub is_coarse: bool,
}

/// Faces of a level at most: what 32 bits can number, by their corners.
const MOST_FACES: u64 = 1 << 29;
/// Bytes of a face on a level, and of its two triangles until they are rendered.
const BYTES_OF_FACE: u64 = 500;

/// Cuts a surface into triangles.
///
/// - `pixels`: how large the object is in the picture, for [`Rate::Pixels`].
/// - `take`: hears how many bytes the next level takes, and may refuse.
///
/// # Errors
/// [`TessellationError`], and what `take` says.
pub(super) fn tessellate_within<E: From<TessellationError>>(
    cage: &Cage,
    scheme: Scheme,
    rate: Rate,
    pixels: Option<&PixelScale>,
    displacer: Option<&Displacer>,
    mut take: impl FnMut(u64) -> Result<(), E>,
) -> Result<Tessellation, E> {
    let mut report = CageReport::default();
    let cage = cage.cleaned(scheme, &mut report);
    let mut level = Level::new(&cage, scheme, &mut report);
    let mut surface = Surface {
        scheme,
        rate,
        pixels,
        displacer,
        output: Output::new(cage.materials.len()),
        unsettled: Unsettled::default(),
        is_coarse: false,
    };
    let mut middles = Vec::new();
    let mut patches = Vec::new();
    let mut number = 0;
    loop {
        let can_end = level.all_have(4) || scheme != Scheme::CatmullClark && level.all_have(3);
        if can_end {
            surface.settle(&mut level, &patches);
        }
        surface.connect(&level, &middles, &patches);
        let active = surface.active(&level, number, can_end);
        if !active.contains(&true) {
            surface.finish(&level, &active);
            break;
        }
        let mut chosen = active.clone();
        patches = surface.finish(&level, &active);
        // The middle of a face beside split ones is found as if that were split, too.
        patches.iter().for_each(|patch| chosen[patch.face as usize] = patch.corner != NONE);
        let children = Children::new(&level, scheme, &chosen);
        let faces = u64::from(children.count());
        if faces > MOST_FACES {
            let error = TessellationError::TooMany { faces, level: number + 1, most: MOST_FACES };
            return Err(error.into());
        }
        take(faces * BYTES_OF_FACE)?;
        middles = if can_end { surface.middles(&level, &active, &children) } else { Vec::new() };
        for patch in patches.iter_mut().filter(|patch| patch.corner != NONE) {
            patch.corner = children.middle_of_face(patch.corner);
        }
        level = children.level(&level, scheme, &active);
        number += 1;
    }
    surface.output.patch();
    let is_coarse = surface.is_coarse;
    let parts = surface.output.meshes(displacer.is_some());
    Ok(Tessellation { parts, report, is_coarse })
}

/// Cuts a surface into triangles, without displacement and without a limit of memory.
///
/// - `pixels`: how large the object is in the picture, for [`Rate::Pixels`].
///
/// # Errors
/// [`TessellationError`].
pub fn tessellate(
    cage: &Cage,
    scheme: Scheme,
    rate: Rate,
    pixels: Option<&PixelScale>,
) -> Result<Tessellation, TessellationError> {
    tessellate_within(cage, scheme, rate, pixels, None, |_| Ok(()))
}

/// A face that is not split, beside one that is.
struct Patch {
    face: u32,
    part: u32,
    /// Vertices of its corners.
    vertices: Vec<u32>,
    /// Of a quadrilateral: first a corner of it, then the one of the next level in its middle.
    corner: u32,
}

/// The middle of a half edge whose other side is not split: a corner of the next level, and the vertices at its ends.
struct SplitEdge {
    corner: u32,
    ends: [u32; 2],
}

/// Which points do not lie on the limit yet, since they are on creases that become smooth.
#[derive(Default)]
struct Unsettled {
    points: Vec<bool>,
    colors: Vec<bool>,
    uvs: [Vec<bool>; 2],
    normals: Vec<bool>,
}

struct Surface<'a> {
    scheme: Scheme,
    rate: Rate,
    pixels: Option<&'a PixelScale>,
    displacer: Option<&'a Displacer<'a>>,
    output: Output,
    unsettled: Unsettled,
    is_coarse: bool,
}

impl Surface<'_> {
    /// Finds the limits of all that is new on a level.
    fn settle(&mut self, level: &mut Level, patches: &[Patch]) {
        let mut corners: Vec<u32> =
            (0..level.faces()).filter(|f| level.real[*f as usize]).flat_map(|f| level.corners(f)).collect();
        corners.extend(patches.iter().map(|patch| patch.corner).filter(|corner| *corner != NONE));
        let points = &mut self.output.points;
        let scheme = self.scheme;
        let fresh = number(&mut level.position, &corners, &mut points.limits, &mut self.unsettled.points);
        let (limits, unsettled) = (&mut points.limits, &mut self.unsettled.points);
        settle(level, &level.position, scheme, &fresh, limits, unsettled);
        for set in [0, 1] {
            let (limits, unsettled) = (&mut points.uvs[set], &mut self.unsettled.uvs[set]);
            let fresh = level.uvs[set].as_mut().map(|uv| number(uv, &corners, limits, unsettled));
            if let (Some(fresh), Some(uv)) = (fresh, &level.uvs[set]) {
                settle(level, uv, scheme, &fresh, limits, unsettled);
            }
        }
        let (limits, unsettled) = (&mut points.colors, &mut self.unsettled.colors);
        let colored = level.color.as_mut().map(|color| number(color, &corners, limits, unsettled));
        if let (Some(fresh), Some(color)) = (colored, &level.color) {
            settle(level, color, scheme, &fresh, limits, unsettled);
        }
        self.settle_normals(level, &corners);
        self.displace(level, &fresh);
    }

    fn settle_normals(&mut self, level: &mut Level, corners: &[u32]) {
        let scheme = self.scheme;
        let normals = &mut self.output.points.normals;
        if let Some(mut normal) = level.normal.take() {
            let fresh = number(&mut normal, corners, normals, &mut self.unsettled.normals);
            fresh.iter().for_each(|c| normals[normal.id(*c) as usize] = normal.at(*c).normalize_or_zero());
            corners.iter().for_each(|c| level.normal_ids[*c as usize] = normal.id(*c));
            level.normal = Some(normal);
            return;
        }
        let mut ring = Vec::new();
        let mut fresh = Vec::new();
        for corner in corners {
            let id = level.normal_ids[*corner as usize];
            if id == NONE {
                level.sector(*corner, &mut ring);
                let new = normals.len() as u32;
                normals.push(Vec3::ZERO);
                ring.iter().for_each(|c| level.normal_ids[*c as usize] = new);
                self.unsettled.normals.push(level.changes_at(*corner, &mut ring));
                fresh.push(*corner);
            } else if self.unsettled.normals[id as usize] {
                self.unsettled.normals[id as usize] = level.changes_at(*corner, &mut ring);
                fresh.push(*corner);
            }
        }
        let level = &*level;
        let found: Vec<Vec3> = fresh
            .par_iter()
            .map_init(Vec::new, |ring, corner| limit_normal(level, scheme, *corner, ring))
            .collect();
        for (corner, normal) in fresh.iter().zip(found) {
            normals[level.normal_ids[*corner as usize] as usize] = normal;
        }
    }

    /// Moves points, each by the mean of what displacement says on all sides of seams.
    fn displace(&mut self, level: &Level, fresh: &[u32]) {
        let points = &mut self.output.points;
        points.positions.resize(points.limits.len(), Vec3::ZERO);
        let Some(displacer) = self.displacer else {
            fresh.iter().for_each(|c| {
                let id = level.position.id(*c) as usize;
                points.positions[id] = points.limits[id];
            });
            return;
        };
        let shared = &*points;
        let moved: Vec<Vec3> = fresh
            .par_iter()
            .map_init(Vec::new, |ring, corner| {
                let limit = shared.limits[level.position.id(*corner) as usize];
                level.ring(&level.position, *corner, ring);
                let mut normals: Vec<u32> = ring.iter().map(|c| level.normal_ids[*c as usize]).collect();
                normals.sort_unstable();
                normals.dedup();
                let known = normals.iter().filter(|id| **id != NONE);
                let normal: Vec3 = known.map(|id| shared.normals[*id as usize]).sum();
                let side = |corner: u32| {
                    let uv = |set: usize| level.uvs[set].as_ref().map_or(NONE, |uv| uv.id(corner));
                    [uv(0), uv(1)]
                };
                let mut sides: Vec<([u32; 2], u32)> = ring.iter().map(|c| (side(*c), *c)).collect();
                sides.sort_unstable();
                sides.dedup_by_key(|side| side.0);
                // On sides that are not a part of the surface coordinates may have no number.
                let is_known = |set: usize, id: u32| level.uvs[set].is_none() || id != NONE;
                sides.retain(|(ids, _)| is_known(0, ids[0]) && is_known(1, ids[1]));
                let offset: Vec3 = sides
                    .iter()
                    .map(|(ids, corner)| {
                        let uv = |set: usize| {
                            let uvs = &shared.uvs[set];
                            uvs.get(ids[set] as usize).copied().unwrap_or(Vec2::ZERO)
                        };
                        displacer.offset(&SurfacePoint {
                            position: limit,
                            normal: normal.normalize_or_zero(),
                            uvs: [uv(0), uv(1)],
                            color: level.color.as_ref().map_or(Vec4::ONE, |color| {
                                shared.colors.get(color.id(*corner) as usize).copied().unwrap_or(Vec4::ONE)
                            }),
                            tangent: level.tangent(ring, ids[0], normal.normalize_or_zero()),
                        })
                    })
                    .sum();
                limit + offset / sides.len().max(1) as f32
            })
            .collect();
        for (corner, position) in fresh.iter().zip(moved) {
            points.positions[level.position.id(*corner) as usize] = position;
        }
    }

    /// Notes the middles of edges and of patched faces, whose vertices are on the level that follows them.
    fn connect(&mut self, level: &Level, middles: &[SplitEdge], patches: &[Patch]) {
        for edge in middles {
            let vertex = self.output.vertex(corner_at(level, edge.corner));
            self.output.add_middle(Middle { vertex, ends: edge.ends });
        }
        for patch in patches {
            let middle = match patch.corner {
                NONE => NONE,
                corner => self.output.vertex(corner_at(level, corner)),
            };
            self.output.add_patched(patch.part, &patch.vertices, middle);
        }
    }

    /// The faces that are split.
    fn active(&mut self, level: &Level, number: u32, can_end: bool) -> Vec<bool> {
        if !can_end {
            return level.real.clone();
        }
        if let Rate::Levels(levels) = self.rate {
            let again = number < levels.min(Rate::MOST_LEVELS);
            return level.real.iter().map(|real| *real && again).collect();
        }
        let points = &self.output.points;
        let is_long = |half: u32| {
            let (a, b) = (level.position.id(half), level.position.id(level.next(half)));
            // Both sides of an edge take its ends in the same order.
            let ends = [a.min(b), a.max(b)].map(|id| points.positions[id as usize]);
            let straight = [a.min(b), a.max(b)].map(|id| points.limits[id as usize]);
            self.is_long(ends) || self.displacer.is_some() && self.is_long(straight)
        };
        let wanted: Vec<bool> = (0..level.faces())
            .into_par_iter()
            .map(|face| level.real[face as usize] && level.corners(face).any(is_long))
            .collect();
        if number >= self.rate.levels() {
            self.is_coarse |= wanted.contains(&true);
            return vec![false; wanted.len()];
        }
        let mut active = wanted;
        if level.all_have(3) && self.scheme != Scheme::CatmullClark {
            promote(level, &mut active);
        }
        active
    }

    fn is_long(&self, [a, b]: [Vec3; 2]) -> bool {
        match (self.rate, self.pixels) {
            (Rate::Length { most, .. }, _) => a.distance_squared(b) > most * most,
            (Rate::Pixels { most, .. }, Some(scale)) => scale.pixels(a, b) > most,
            _ => false,
        }
    }

    /// Makes triangles of the faces that are not split, and returns those that are beside split ones.
    fn finish(&mut self, level: &Level, active: &[bool]) -> Vec<Patch> {
        let mut patches = Vec::new();
        let mut vertices = Vec::new();
        for face in (0..level.faces()).filter(|f| level.real[*f as usize] && !active[*f as usize]) {
            vertices.clear();
            vertices.extend(level.corners(face).map(|c| self.output.vertex(corner_at(level, c))));
            let is_split =
                |half: u32| level.twin(half).is_some_and(|twin| active[level.face_of(twin) as usize]);
            let part = level.parts[face as usize];
            if level.corners(face).any(is_split) {
                let corner = if vertices.len() == 4 { level.corners(face).start } else { NONE };
                patches.push(Patch { face, part, vertices: vertices.clone(), corner });
            } else {
                self.output.add(part, &vertices);
            }
        }
        patches
    }

    /// The edges of split faces whose other side is not.
    fn middles(&mut self, level: &Level, active: &[bool], children: &Children) -> Vec<SplitEdge> {
        let mut edges = Vec::new();
        for face in (0..level.faces()).filter(|f| active[*f as usize]) {
            for half in level.corners(face) {
                let other = level.twin(half).map(|twin| level.face_of(twin));
                if other.is_some_and(|other| !active[other as usize]) {
                    let ends = [half, level.next(half)].map(|c| self.output.vertex(corner_at(level, c)));
                    edges.push(SplitEdge { corner: children.middle_of_edge(half), ends });
                }
            }
        }
        edges
    }
}

/// Gives numbers to the vertices of corners that have none; returns a corner of each, and of those that are not settled.
fn number<V: Value>(
    channel: &mut Channel<V>,
    corners: &[u32],
    limits: &mut Vec<V>,
    unsettled: &mut Vec<bool>,
) -> Vec<u32> {
    let mut fresh = Vec::new();
    for corner in corners {
        let id = &mut channel.ids[channel.of[*corner as usize] as usize];
        if *id == NONE {
            *id = limits.len() as u32;
            limits.push(V::default());
            unsettled.push(false);
            fresh.push(*corner);
        } else if unsettled[*id as usize] {
            unsettled[*id as usize] = false;
            fresh.push(*corner);
        }
    }
    fresh
}

/// Finds the limits at corners.
fn settle<V: Value>(
    level: &Level,
    channel: &Channel<V>,
    scheme: Scheme,
    fresh: &[u32],
    limits: &mut [V],
    unsettled: &mut [bool],
) {
    let found: Vec<(V, bool)> = fresh
        .par_iter()
        .map_init(Vec::new, |ring, corner| limit(level, channel, scheme, *corner, ring))
        .collect();
    for (corner, (value, changes)) in fresh.iter().zip(found) {
        let id = channel.id(*corner) as usize;
        (limits[id], unsettled[id]) = (value, changes);
    }
}

/// Splits triangles of which two edges or more are split: of the others one is, which makes a fan.
fn promote(level: &Level, active: &mut [bool]) {
    let mut todo: Vec<u32> = (0..level.faces()).filter(|face| active[*face as usize]).collect();
    while let Some(face) = todo.pop() {
        for half in level.corners(face) {
            let Some(other) = level.twin(half).map(|twin| level.face_of(twin)) else { continue };
            if active[other as usize] || !level.real[other as usize] {
                continue;
            }
            let is_split =
                |half: &u32| level.twin(*half).is_some_and(|twin| active[level.face_of(twin) as usize]);
            if level.corners(other).filter(is_split).count() >= 2 {
                active[other as usize] = true;
                todo.push(other);
            }
        }
    }
}

/// What is at a corner of a face of the surface.
fn corner_at(level: &Level, corner: u32) -> Corner {
    Corner {
        point: level.position.id(corner),
        uvs: level.uvs.each_ref().map(|uv| uv.as_ref().map_or(NONE, |uv| uv.id(corner))),
        normal: level.normal_ids[corner as usize],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_asked_for_before_it_is_used() {
        let cage = Cage::from_triangles(&[(&crate::shapes::cuboid(Vec3::ONE, 0.0, 1), 0)], true);
        let mut asked = Vec::new();
        let stop = |bytes: u64| {
            asked.push(bytes);
            if bytes > 1 << 20 { Err(Stop) } else { Ok(()) }
        };
        #[derive(Debug, PartialEq)]
        struct Stop;
        impl From<TessellationError> for Stop {
            fn from(_: TessellationError) -> Self {
                Self
            }
        }
        let made = tessellate_within(&cage, Scheme::CatmullClark, Rate::Levels(12), None, None, stop);
        assert_eq!(made.err(), Some(Stop));
        assert_eq!(asked.len(), 5, "{asked:?}");
    }
}
