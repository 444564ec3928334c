//! Polygons of an object as they are in the file, for subdivision.

use super::build::{PartPlan, Source};
use super::parse::MISSING;
use crate::subdivision::Cage;
use glam::Vec2;
use std::collections::HashMap;

/// The cage of a mesh whose parts are `parts`. Normals of the file are left out: those of the smooth surface take their
/// place. Faces that refer to positions which do not exist are left out.
pub(super) fn cage(parts: &[&PartPlan], source: &Source) -> Cage {
    let data = source.data;
    let mut cage = Cage { materials: parts.iter().map(|part| part.material).collect(), ..Cage::default() };
    let has_uv = parts.iter().any(|part| part.corners(data).any(|c| c[1] != MISSING));
    let mut places: HashMap<i32, u32> = HashMap::new();
    let mut coordinates: HashMap<i32, u32> = HashMap::new();
    for (number, part) in parts.iter().enumerate() {
        for run in &part.runs {
            let faces = &data.chunks[run.chunk as usize];
            for face in run.faces.clone() {
                let corners = faces.face(face);
                if corners.iter().any(|c| c[0] < 0 || c[0] as usize >= data.positions.len()) {
                    continue;
                }
                for [v, t, _] in corners {
                    let place = *places.entry(*v).or_insert(cage.positions.len() as u32);
                    if place as usize == cage.positions.len() {
                        cage.positions.push(data.positions[*v as usize]);
                        cage.numbers.push(*v as u32);
                        cage.colors.extend(source.colors.get(*v as usize));
                    }
                    cage.positions_of.push(place);
                    if has_uv {
                        let known = *coordinates.entry(*t).or_insert(cage.uvs[0].len() as u32);
                        if known as usize == cage.uvs[0].len() {
                            let uv = usize::try_from(*t).ok().and_then(|t| data.uvs.get(t));
                            cage.uvs[0].push(uv.copied().unwrap_or(Vec2::ZERO));
                        }
                        cage.uvs_of[0].push(known);
                    }
                }
                cage.ends.push(cage.positions_of.len() as u32);
                cage.parts.push(number as u32);
            }
        }
    }
    cage
}
