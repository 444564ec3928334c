//! The values of nodes, where a host computes them.

use super::program::record;
use super::{GraphError, GraphInput, TextureGraph};
use crate::TextureRef;
use glam::{Affine3A, Vec2};
use optics::texture_node::{
    GRAPH_REGISTERS, NODE_IMAGE, NODE_TRIPLANAR, TextureNode, evaluate_node, graph_value, node_coordinates,
    triplanar_coords,
};
use optics::texture_point::{TexturePoint, texture_point_at};
use optics::{Vec4f, vec3f, vec4f};

/// The value of a node at a point.
///
/// - `inputs`, `offset`: the values that it takes, zeros without one.
/// - `image`: the texel of its image at both sets of texture coordinates.
#[inline]
fn node_value(
    node: &TextureNode,
    point: &TexturePoint,
    inputs: [Vec4f; 3],
    offset: Vec4f,
    image: impl Fn(Vec4f) -> Vec4f,
) -> Vec4f {
    let [mut a, mut b, mut c] = inputs;
    if node.operation == NODE_IMAGE {
        a = image(point.coords);
    } else if node.operation == NODE_TRIPLANAR {
        let at = node_coordinates(*node, *point, offset);
        [a, b, c] = [0, 1, 2].map(|axis| image(triplanar_coords(at, axis)));
    }
    evaluate_node(*node, *point, a, b, c, offset)
}

/// The value of the last of the nodes of a program at a point.
///
/// - `image`: the texel of a node's image, by its number, at both sets of texture coordinates.
/// - `shares`: see [`graph_value`].
pub fn evaluate(
    nodes: &[TextureNode],
    point: &TexturePoint,
    image: impl Fn(u32, Vec4f) -> Vec4f,
    shares: bool,
) -> Vec4f {
    let zeros = vec4f(0.0, 0.0, 0.0, 0.0);
    let mut registers = [zeros; GRAPH_REGISTERS as usize];
    let mut value = zeros;
    for node in nodes {
        let input = |register: u32| registers.get(register as usize).copied().unwrap_or(zeros);
        let inputs = [node.a, node.b, node.c].map(input);
        value = node_value(node, point, inputs, input(node.offset), |coords| image(node.texture, coords));
        registers[node.output as usize] = value;
    }
    graph_value(value, shares)
}

impl TextureGraph {
    /// Values of each node over a square of `side` × `side` points, row 0 at the top, for people to look at. Both sets of
    /// texture coordinates go from 0 to 1, v downwards; so do x and y, upwards, of all other spaces, on a surface that
    /// faces z and has white vertices. Patterns are means over the distance between points.
    ///
    /// - `image`: RGBA of the texture that a node shows, at transformed texture coordinates.
    ///
    /// # Errors
    /// As [`TextureGraph::check`].
    pub fn node_values(
        &self,
        side: u32,
        image: impl Fn(&TextureRef, Vec2) -> [f32; 4],
    ) -> Result<Vec<Vec<[f32; 4]>>, GraphError> {
        self.check()?;
        let records: Vec<_> = self.nodes.iter().map(|node| record(node, Affine3A::IDENTITY)).collect();
        let mut all = vec![Vec::with_capacity((side * side) as usize); self.nodes.len()];
        for i in 0..side * side {
            let share = |pixel: u32| (pixel as f32 + 0.5) / side as f32;
            let values =
                self.values_at(&records, &point(share(i % side), share(i / side), 1.0 / side as f32), &image);
            all.iter_mut().zip(values).for_each(|(of_node, value)| of_node.push(value.to_array()));
        }
        Ok(all)
    }

    /// The value of each node at a point. `records`: the nodes; of a graph that has been checked.
    fn values_at(
        &self,
        records: &[TextureNode],
        point: &TexturePoint,
        image: &impl Fn(&TextureRef, Vec2) -> [f32; 4],
    ) -> Vec<Vec4f> {
        let zeros = vec4f(0.0, 0.0, 0.0, 0.0);
        let mut values: Vec<Vec4f> = Vec::with_capacity(records.len());
        for (node, record) in self.nodes.iter().zip(records) {
            let input = |input: Option<&GraphInput>| match input {
                None => zeros,
                Some(GraphInput::Constant(value)) => Vec4f::from_array(*value),
                Some(GraphInput::Node(n)) => values.get(*n as usize).copied().unwrap_or(zeros),
            };
            let texel = |coords: Vec4f| match &node.image {
                None => zeros,
                Some(shown) => {
                    let [u0, v0, u1, v1] = coords.to_array();
                    let uv = if shown.uv_set == 0 { Vec2::new(u0, v0) } else { Vec2::new(u1, v1) };
                    Vec4f::from_array(image(shown, shown.transform.apply(uv)))
                }
            };
            let inputs = [0, 1, 2].map(|k| input(node.inputs.get(k)));
            let value = node_value(record, point, inputs, input(node.offset.as_ref()), texel);
            values.push(value);
        }
        values
    }
}

/// A point of a square whose corners are at 0 and 1 in every space.
/// `width`: of its footprint.
fn point(u: f32, v: f32, width: f32) -> TexturePoint {
    let position = vec3f(u, 1.0 - v, 0.0);
    TexturePoint {
        position,
        world: position,
        width,
        normal: vec3f(0.0, 0.0, 1.0),
        ..texture_point_at(vec4f(u, v, u, v), vec4f(1.0, 1.0, 1.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Placement, Space, TextureGraphNode, kind_named};
    use super::*;

    fn node(name: &str) -> TextureGraphNode {
        TextureGraphNode::new(kind_named(name).expect("a kind"))
    }

    #[test]
    fn each_node_has_its_values() {
        let mut graph = TextureGraph::of(kind_named("coordinates").unwrap());
        let place = Placement { space: Space::Object, map: Affine3A::IDENTITY };
        graph.push(TextureGraphNode { placement: place, ..node("coordinates") });
        graph.push(node("invert").taking([GraphInput::Node(0)]));
        let values = graph.node_values(2, |_, _| [1.0; 4]).expect("a graph");
        assert_eq!(values[0][1], [0.75, 0.25, 0.0, 1.0]);
        assert_eq!(values[1][1], [0.75, 0.75, 0.0, 1.0], "y of objects is upwards");
        assert_eq!(values[2][1], [0.25, 0.75, 1.0, 0.0]);
    }

    #[test]
    fn images_are_asked_for() {
        let mut graph = TextureGraph::default();
        graph.push(TextureGraphNode { image: Some(TextureRef::new(7)), ..node("image") });
        let values = graph.node_values(1, |shown, uv| [shown.texture as f32, uv.x, uv.y, 1.0]);
        assert_eq!(values.expect("a graph")[0][0], [7.0, 0.5, 0.5, 1.0]);
        assert_eq!(TextureGraph::default().node_values(1, |_, _| [0.0; 4]), Err(GraphError::Empty));
    }
}
