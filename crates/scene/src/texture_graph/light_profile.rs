//! Lamps whose intensity depends on direction as a graph says.

use super::panorama::value_by_direction;
use super::{Program, TabulationError, TextureGraph};
use crate::LightProfile;
use glam::Affine3A;
use optics::math::cos_sin_turns;
use optics::{vec2f, vec3f};
use rayon::prelude::*;
use std::f32::consts::PI;

impl TextureGraph {
    /// Vertical angles of a profile that a graph makes: half a degree apart.
    pub const PROFILE_ROWS: u32 = 361;

    /// The profile that has the graph's red channel as intensity, W/sr, 0 where that is negative.
    ///
    /// Object, world and camera space have the unit direction for a position, as if the lamp were aimed straight down: y is
    /// upwards. Texture coordinates go from 0 to 1 around the axis and, v, from where the lamp is aimed to its back. Patterns
    /// are filtered over a cell of the table.
    ///
    /// # Errors
    /// See [`TabulationError`].
    pub fn light_profile(&self) -> Result<LightProfile, TabulationError> {
        let program = Program::new(self, Affine3A::IDENTITY)?;
        let (rows, columns) = (Self::PROFILE_ROWS, 2 * (Self::PROFILE_ROWS - 1));
        program.check_size([rows, columns, 1])?;
        let intensity = |row: u32, column: u32| {
            let uv = vec2f(column as f32 / columns as f32, row as f32 / (rows - 1) as f32);
            let (around, down) = (cos_sin_turns(uv.x), cos_sin_turns(0.5 * uv.y));
            // Horizontal angles grow anticlockwise as seen from above.
            let direction = vec3f(down.y * around.x, -down.x, -down.y * around.y);
            value_by_direction(&program, direction, uv, PI / (rows - 1) as f32).x.max(0.0)
        };
        let cells =
            (0..rows).into_par_iter().flat_map_iter(|row| (0..columns).map(move |column| (row, column)));
        let values: Vec<f32> = cells.map(|(row, column)| intensity(row, column)).collect();
        let peak = values.iter().copied().fold(0.0, f32::max);
        let shares = values.iter().map(|v| if peak > 0.0 { v / peak } else { 0.0 }).collect();
        LightProfile::new(rows, columns, shares, peak).ok_or(TabulationError::NotFinite)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{GraphInput, Placement, Space, TextureGraphNode, kind_named};
    use super::*;

    #[test]
    fn a_profile_has_the_graphs_red_by_direction() {
        let placement = Placement { space: Space::World, map: Affine3A::IDENTITY };
        let node = |name: &str| TextureGraphNode::new(kind_named(name).expect("a kind"));
        // Three times the direction's x.
        let mut graph = TextureGraph { nodes: vec![TextureGraphNode { placement, ..node("coordinates") }] };
        graph.push(node("multiply").taking([GraphInput::Node(0), GraphInput::Constant([3.0; 4])]));
        let profile = graph.light_profile().expect("a profile");
        assert!((profile.peak() - 3.0).abs() < 1e-5, "{}", profile.peak());
        let (rows, columns) = (profile.rows() as usize, profile.columns() as usize);
        let at = |row: usize, column: usize| profile.values()[row * columns + column];
        assert!(at(0, 0) < 1e-6 && (at(rows / 2, 0) - 1.0).abs() < 1e-6 && at(rows / 2, columns / 2) == 0.0);
        assert!((at(rows / 2, columns / 6) - 0.5).abs() < 1e-4, "{}", at(rows / 2, columns / 6));
        // ∫ max(x, 0) over all directions is π.
        assert!((profile.integral(|_| 1.0) - PI).abs() < 1e-3, "{}", profile.integral(|_| 1.0));
    }
}
