//! Densities of media that a graph makes while a scene is loaded.

use super::{GraphError, Program, TextureGraph, evaluate};
use crate::DensityGrid;
use glam::{Affine3A, Vec3};
use optics::texture_point::{TexturePoint, texture_point_at};
use optics::{Vec3f, vec4f};
use rayon::prelude::*;

/// Why a graph cannot be evaluated at all points of a grid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TabulationError {
    /// It cannot be evaluated.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// Images lie on surfaces.
    #[error("it cannot show an image")]
    Image,
    /// Evaluating it would take too long.
    #[error("{cells} cells of {nodes} nodes are too many: {most} of one node are the most", most = TextureGraph::MOST_CELLS)]
    TooLarge {
        /// Cells of the grid.
        cells: u64,
        /// Nodes that are evaluated in each.
        nodes: usize,
    },
    /// Values that are not finite.
    #[error("its values are not all finite")]
    NotFinite,
    /// Nothing is between the bounds, or there are no cells.
    #[error(
        "the bounds must be two corners, the second one above the first along each axis, and each size 1 or more"
    )]
    Bounds,
}

impl Program {
    /// Whether its nodes can be evaluated at so many points, without a surface.
    ///
    /// # Errors
    /// [`TabulationError::Image`], [`TabulationError::TooLarge`].
    pub(super) fn check_size(&self, size: [u32; 3]) -> Result<(), TabulationError> {
        if !self.images.is_empty() {
            return Err(TabulationError::Image);
        }
        let cells = size.iter().map(|&n| u64::from(n)).fold(1, u64::saturating_mul);
        let nodes = self.nodes.len();
        if cells.saturating_mul(nodes as u64) > TextureGraph::MOST_CELLS {
            return Err(TabulationError::TooLarge { cells, nodes });
        }
        Ok(())
    }
}

impl TextureGraph {
    /// Limit of cells times nodes of a grid: some seconds of evaluation.
    pub const MOST_CELLS: u64 = 1 << 26;

    /// The densities that a graph has at the centres of a grid's cells: its red channel, 0 where that is negative.
    ///
    /// Object, world and camera space are all world space; texture coordinates go from 0 to 1 along x and y. Patterns are
    /// filtered over a cell.
    ///
    /// # Errors
    /// See [`TabulationError`].
    pub fn density(&self, size: [u32; 3], bounds: [Vec3; 2]) -> Result<DensityGrid, TabulationError> {
        let program = Program::new(self, Affine3A::IDENTITY)?;
        program.check_size(size)?;
        let [low, high] = bounds;
        let [columns, rows, slices] = size;
        let cell = (high - low) / Vec3::new(columns as f32, rows as f32, slices as f32);
        let value = |x: u32, y: u32, z: u32| {
            let center = low + cell * (Vec3::new(x as f32, y as f32, z as f32) + 0.5);
            let share = (center - low) / (high - low);
            let ones = vec4f(1.0, 1.0, 1.0, 1.0);
            let place = Vec3f::from_array(center.to_array());
            let point = TexturePoint {
                position: place,
                world: place,
                width: cell.max_element(),
                ..texture_point_at(vec4f(share.x, share.y, share.x, share.y), ones)
            };
            evaluate(&program.nodes, &point, |_, _| ones, false).x.max(0.0)
        };
        let row = |i: u32| (0..columns).map(move |x| (x, i % rows.max(1), i / rows.max(1)));
        let all = (0..rows.saturating_mul(slices)).into_par_iter().flat_map_iter(row);
        let values = all.map(|(x, y, z)| value(x, y, z)).collect();
        DensityGrid::new(size, bounds, values).ok_or(TabulationError::Bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Placement, Space, TextureGraphNode, kind_named};
    use super::*;

    fn gradient(space: Space) -> TextureGraph {
        let placement = Placement { space, ..Placement::default() };
        let node = TextureGraphNode::new(kind_named("gradient").expect("a kind"));
        TextureGraph { nodes: vec![TextureGraphNode { placement, ..node }] }
    }

    #[test]
    fn densities_are_the_graphs_values_at_centres() {
        let bounds = [Vec3::new(0.0, -1.0, 2.0), Vec3::new(0.5, 1.0, 3.0)];
        let grid = gradient(Space::World).density([2, 1, 2], bounds).expect("a density");
        assert_eq!((grid.size(), grid.bounds()), ([2, 1, 2], bounds));
        assert_eq!(grid.values(), [0.125, 0.375, 0.125, 0.375]);
        let grid = gradient(Space::Uv).density([2, 1, 1], bounds).expect("a density");
        assert_eq!(grid.values(), [0.25, 0.75]);
    }

    #[test]
    fn what_is_no_density_is_refused() {
        let cube = [Vec3::ZERO, Vec3::ONE];
        let none = gradient(Space::World).density([0, 1, 1], cube);
        assert_eq!(none, Err(TabulationError::Bounds));
        let large = gradient(Space::World).density([1024; 3], cube);
        assert!(matches!(large, Err(TabulationError::TooLarge { .. })));
        let flat = gradient(Space::World).density([2, 2, 2], [Vec3::ZERO, Vec3::X]);
        assert_eq!(flat, Err(TabulationError::Bounds));
        assert_eq!(
            TextureGraph::default().density([1, 1, 1], cube),
            Err(TabulationError::Graph(GraphError::Empty))
        );
        let node = TextureGraphNode::new(kind_named("image").expect("a kind"));
        let image = Some(crate::TextureRef::new(0));
        let shown = TextureGraph { nodes: vec![TextureGraphNode { image, ..node }] };
        assert_eq!(shown.density([1, 1, 1], cube), Err(TabulationError::Image));
    }
}
