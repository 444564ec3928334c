//! Environments that a graph makes while a scene is loaded.

use super::{Program, TabulationError, TextureGraph, evaluate};
use crate::{Image, Pixels};
use glam::Affine3A;
use optics::sky::equirect_to_direction;
use optics::texture_point::{TexturePoint, texture_point_at};
use optics::{Vec2f, Vec3f, Vec4f, vec2f, vec4f};
use rayon::prelude::*;
use std::f32::consts::PI;

/// The value of a graph in a unit `direction`, as on a sphere of radius 1.
///
/// - `uv`: both sets of texture coordinates. `width`: of the footprint, radians.
pub(super) fn value_by_direction(program: &Program, direction: Vec3f, uv: Vec2f, width: f32) -> Vec4f {
    let ones = vec4f(1.0, 1.0, 1.0, 1.0);
    let point = TexturePoint {
        position: direction,
        world: direction,
        normal: direction,
        width,
        uv_density: vec2f(0.5 / PI, 0.5 / PI),
        ..texture_point_at(vec4f(uv.x, uv.y, uv.x, uv.y), ones)
    };
    evaluate(&program.nodes, &point, |_, _| ones, false)
}

impl TextureGraph {
    /// Rows of an environment's picture that is made for a scene.
    pub const PANORAMA_HEIGHT: u32 = 1024;

    /// The equirectangular picture of an environment that has the graph's colours, negative ones as 0. Its centre column is
    /// towards −Z. It is `2 · height` pixels wide.
    ///
    /// Object, world and camera space have the unit direction for a position; texture coordinates go from 0 to 1 over the
    /// picture, v downwards. Patterns are filtered over a pixel at the horizon.
    ///
    /// # Errors
    /// See [`TabulationError`].
    pub fn panorama(&self, height: u32) -> Result<Image, TabulationError> {
        let program = Program::new(self, Affine3A::IDENTITY)?;
        let width = height.saturating_mul(2);
        program.check_size([width, height, 1])?;
        let color = |x: u32, y: u32| {
            let uv = vec2f((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            let direction = equirect_to_direction(uv, 0.0);
            let value = value_by_direction(&program, direction, uv, PI / height as f32);
            [value.x, value.y, value.z].map(|c| c.max(0.0))
        };
        let rows = (0..height).into_par_iter().flat_map_iter(|y| (0..width).map(move |x| (x, y)));
        let pixels = Pixels::Rgb32F(rows.map(|(x, y)| color(x, y)).collect());
        Ok(Image { name: "environment".into(), width, height, pixels })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Placement, Space, TextureGraphNode, kind_named};
    use super::*;

    #[test]
    fn a_panorama_has_the_graphs_colours_by_direction() {
        let placement = Placement { space: Space::World, map: Affine3A::IDENTITY };
        let node = TextureGraphNode::new(kind_named("coordinates").expect("a kind"));
        let graph = TextureGraph { nodes: vec![TextureGraphNode { placement, ..node }] };
        let image = graph.panorama(2).expect("a picture");
        assert_eq!((image.width, image.height), (4, 2));
        let Pixels::Rgb32F(pixels) = image.pixels else { panic!("floating point") };
        // Directions at 45 degrees above and below the horizon: x and z are ± 0.5, negative ones black.
        let expected = |x: f32, y: f32, z: f32| [x, y, z].map(|c| (c * 0.5).max(0.0));
        let up = 2f32.sqrt();
        let rows = [up, -up]
            .map(|y| [(-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)].map(|(x, z)| expected(x, y, z)));
        for (found, expected) in pixels.iter().zip(rows.as_flattened()) {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {expected:?}");
        }
        assert!(matches!(graph.panorama(1 << 20), Err(TabulationError::TooLarge { .. })));
        let image = TextureGraph::of(kind_named("image").expect("a kind"));
        assert!(image.panorama(2).is_err());
    }
}
