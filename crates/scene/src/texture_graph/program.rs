//! From a graph to the records that back ends go through.

use super::kinds::CONSTANT;
use super::{GraphError, GraphInput, Placement, Space, TextureGraph, TextureGraphNode};
use crate::TextureRef;
use glam::Affine3A;
use optics::texture_node::{GRAPH_REGISTERS, SPACE_OBJECT, SPACE_UV0, SPACE_UV1, SPACE_WORLD, TextureNode};
use optics::{Vec4f, vec4f};

/// No register.
const NONE: u32 = u32::MAX;

/// A graph as records: each writes a register, the last one the value of the graph.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// The records; their `texture` counts `images`.
    pub nodes: Vec<TextureNode>,
    /// What nodes show.
    pub images: Vec<TextureRef>,
}

/// Which registers are free while nodes are written.
struct Registers {
    /// The node that wrote each register, if it is still needed.
    used: [bool; GRAPH_REGISTERS as usize],
}

impl Registers {
    fn take(&mut self) -> Result<u32, GraphError> {
        let free = self.used.iter().position(|used| !used).ok_or(GraphError::TooDeep)?;
        self.used[free] = true;
        Ok(free as u32)
    }
}

impl Program {
    /// The program of a graph. `world_to_camera`: for what lies in the space of the camera.
    ///
    /// # Errors
    /// [`GraphError`] where the graph is none.
    pub fn new(graph: &TextureGraph, world_to_camera: Affine3A) -> Result<Self, GraphError> {
        check(graph)?;
        let needed = needed_until(graph);
        let mut program = Self::default();
        let mut registers = Registers { used: [false; GRAPH_REGISTERS as usize] };
        let mut register_of = vec![NONE; graph.nodes.len()];
        for (i, node) in graph.nodes.iter().enumerate() {
            // What nobody takes is not evaluated.
            if needed[i] == 0 {
                continue;
            }
            let mut constants = Vec::new();
            let mut register = |input: Option<&GraphInput>, program: &mut Self| match input {
                None => Ok(NONE),
                Some(GraphInput::Node(n)) => Ok(register_of[*n as usize]),
                Some(GraphInput::Constant(value)) => {
                    let output = registers.take()?;
                    program.nodes.push(constant(*value, output));
                    constants.push(output);
                    Ok(output)
                }
            };
            let [a, b, c] = [0, 1, 2].map(|k| register(node.inputs.get(k), &mut program));
            let offset = register(node.offset.as_ref(), &mut program)?;
            let mut record = record(node, world_to_camera);
            (record.a, record.b, record.c, record.offset) = (a?, b?, c?, offset);
            // A node reads all inputs before it writes, so it may write where one of them was.
            constants.into_iter().for_each(|r| registers.used[r as usize] = false);
            for n in inputs_of(node).filter(|n| needed[*n as usize] == i) {
                registers.used[register_of[n as usize] as usize] = false;
            }
            record.output = registers.take()?;
            register_of[i] = record.output;
            if let Some(image) = node.image {
                record.texture = program.images.len() as u32;
                program.images.push(image);
            }
            program.nodes.push(record);
        }
        Ok(program)
    }
}

impl TextureGraph {
    /// Whether it can be evaluated.
    ///
    /// # Errors
    /// [`GraphError`], which says why not.
    pub fn check(&self) -> Result<(), GraphError> {
        Program::new(self, Affine3A::IDENTITY).map(drop)
    }
}

/// For each node the last one that takes its value: itself plus one for the value of the graph, 0 where nobody does.
fn needed_until(graph: &TextureGraph) -> Vec<usize> {
    let count = graph.nodes.len();
    let mut needed = vec![0; count];
    needed[count - 1] = count;
    for i in (0..count).rev() {
        // Who takes its value comes later, so all is known of it by now.
        if needed[i] == 0 {
            continue;
        }
        for n in inputs_of(&graph.nodes[i]) {
            let place = &mut needed[n as usize];
            *place = (*place).max(i);
        }
    }
    needed
}

/// The nodes that a node takes values of.
fn inputs_of(node: &TextureGraphNode) -> impl Iterator<Item = u32> {
    node.inputs.iter().chain(&node.offset).filter_map(|input| match input {
        GraphInput::Node(n) => Some(*n),
        GraphInput::Constant(_) => None,
    })
}

fn check(graph: &TextureGraph) -> Result<(), GraphError> {
    let count = graph.nodes.len();
    if count == 0 {
        return Err(GraphError::Empty);
    }
    if count > TextureGraph::MOST_NODES {
        return Err(GraphError::TooManyNodes(count));
    }
    for (i, node) in graph.nodes.iter().enumerate() {
        let broken = |why| Err(GraphError::Broken(i, why));
        if node.inputs.len() != node.kind.inputs.len() || node.parameters.len() != node.kind.parameters.len()
        {
            return broken("its inputs or parameters are not those of its kind");
        }
        if inputs_of(node).any(|n| n as usize >= i) {
            return broken("it takes the value of a later node");
        }
        let within = |(value, parameter): (&f32, &super::Parameter)| {
            let [low, high] = parameter.range;
            (low..=high).contains(value)
        };
        if !node.parameters.iter().zip(node.kind.parameters).all(within) {
            return broken("a parameter is out of its range");
        }
        if node.kind.has_image != node.image.is_some() {
            return broken("it has no image, or one that it does not show");
        }
        if !node.placement.map.is_finite() {
            return broken("it is placed where nothing can be");
        }
    }
    Ok(())
}

fn constant([r, g, b, a]: [f32; 4], output: u32) -> TextureNode {
    let node = TextureGraphNode { parameters: vec![r, g, b, a], ..TextureGraphNode::new(&CONSTANT) };
    TextureNode { output, ..record(&node, Affine3A::IDENTITY) }
}

/// The record of a node without its registers and its image.
pub(super) fn record(node: &TextureGraphNode, world_to_camera: Affine3A) -> TextureNode {
    let Placement { space, map } = node.placement;
    let map = if space == Space::Camera { map * world_to_camera } else { map };
    let rows = glam::Mat4::from(map).transpose();
    let row = |i: usize| Vec4f::from_array(rows.col(i).to_array());
    let length = |i: usize| rows.col(i).truncate().length();
    let parameter = |i: usize| node.parameters.get(i).copied().unwrap_or(0.0);
    let four = |i: usize| vec4f(parameter(i), parameter(i + 1), parameter(i + 2), parameter(i + 3));
    TextureNode {
        row_x: row(0),
        row_y: row(1),
        row_z: row(2),
        low: four(0),
        high: four(4),
        operation: node.kind.operation,
        space: match space {
            Space::Uv => SPACE_UV0,
            Space::Uv1 => SPACE_UV1,
            Space::Object => SPACE_OBJECT,
            Space::World | Space::Camera => SPACE_WORLD,
        },
        output: 0,
        texture: 0,
        a: NONE,
        b: NONE,
        c: NONE,
        offset: NONE,
        scale: length(0).max(length(1)).max(length(2)),
        padding0: 0,
        padding1: 0,
        padding2: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::kind_named;
    use super::*;

    fn node(name: &str) -> TextureGraphNode {
        TextureGraphNode::new(kind_named(name).expect("a kind"))
    }

    /// A sum of `n` numbers, folded from the right, so that all are kept until the end.
    fn deep(n: u32) -> TextureGraph {
        let mut graph = TextureGraph::default();
        let noises: Vec<GraphInput> = (0..n).map(|_| graph.push(node("noise"))).collect();
        let mut sum = GraphInput::number(0.0);
        for noise in noises {
            sum = graph.push(node("add").taking([noise, sum]));
        }
        graph
    }

    #[test]
    fn registers_are_used_again() {
        let mut chain = TextureGraph::of(kind_named("noise").unwrap());
        for _ in 0..40 {
            let last = GraphInput::Node(chain.nodes.len() as u32 - 1);
            chain.push(node("mix").taking([last, GraphInput::number(0.3), GraphInput::number(0.1)]));
        }
        let program = Program::new(&chain, Affine3A::IDENTITY).expect("a chain");
        assert_eq!(program.nodes.len(), 1 + 3 * 40);
        assert!(program.nodes.iter().all(|n| n.output < 3), "three values at a time");
    }

    #[test]
    fn what_is_too_much_is_refused() {
        assert!(deep(14).check().is_ok());
        assert_eq!(deep(20).check(), Err(GraphError::TooDeep));
        assert_eq!(deep(40).check(), Err(GraphError::TooManyNodes(80)));
        assert_eq!(TextureGraph::default().check(), Err(GraphError::Empty));
        let looped = TextureGraph { nodes: vec![node("invert").taking([GraphInput::Node(0)])] };
        assert!(matches!(looped.check(), Err(GraphError::Broken(0, _))));
        let wide =
            TextureGraph { nodes: vec![TextureGraphNode { parameters: vec![9.0], ..node("gradient") }] };
        assert!(matches!(wide.check(), Err(GraphError::Broken(0, _))));
        let without = TextureGraph::of(kind_named("image").unwrap());
        assert!(matches!(without.check(), Err(GraphError::Broken(0, _))));
    }

    #[test]
    fn what_nobody_takes_is_not_evaluated() {
        let mut graph = TextureGraph::of(kind_named("voronoi").unwrap());
        graph.push(node("noise"));
        let program = Program::new(&graph, Affine3A::IDENTITY).expect("a graph");
        assert_eq!(program.nodes.len(), 1);
    }
}
