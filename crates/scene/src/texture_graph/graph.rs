//! Graphs of nodes.

use super::kinds::{NodeKind, kind_named};
use super::placement::Placement;
use crate::image::TextureRef;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A graph; its value is that of the last node.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TextureGraph {
    /// The nodes. Each takes values of earlier ones only.
    pub nodes: Vec<TextureGraphNode>,
}

/// A node of a graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureGraphNode {
    /// What it does.
    #[serde(serialize_with = "kind_name", deserialize_with = "named_kind")]
    pub kind: &'static NodeKind,
    /// Its inputs, as many as its kind has.
    pub inputs: Vec<GraphInput>,
    /// Added to its coordinates.
    pub offset: Option<GraphInput>,
    /// Its parameters, as many as its kind has.
    pub parameters: Vec<f32>,
    /// Where its pattern lies.
    pub placement: Placement,
    /// The image of those that show one.
    pub image: Option<TextureRef>,
}

/// What an input takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GraphInput {
    /// One value everywhere, RGBA.
    Constant([f32; 4]),
    /// The value of an earlier node.
    Node(u32),
}

/// Why a graph cannot be evaluated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GraphError {
    /// There is nothing in it.
    #[error("the texture has no nodes")]
    Empty,
    /// Limits keep evaluation short.
    #[error("the texture has {0} nodes, more than {most}", most = TextureGraph::MOST_NODES)]
    TooManyNodes(usize),
    /// It keeps too many values at a time.
    #[error("the texture is nested too deeply: {most} values at a time are the most", most = optics::texture_node::GRAPH_REGISTERS)]
    TooDeep,
    /// A node that no file can describe.
    #[error("node {0} of the texture is broken: {1}")]
    Broken(usize, &'static str),
}

impl TextureGraph {
    /// Limit of what is evaluated at each hit.
    pub const MOST_NODES: usize = 64;

    /// A graph of one node of a kind, with the defaults of the kind.
    pub fn of(kind: &'static NodeKind) -> Self {
        Self { nodes: vec![TextureGraphNode::new(kind)] }
    }

    /// Appends a node; returns what other nodes take of it.
    pub fn push(&mut self, node: TextureGraphNode) -> GraphInput {
        self.nodes.push(node);
        GraphInput::Node(self.nodes.len() as u32 - 1)
    }

    /// Appends a whole graph; returns its value.
    pub fn append(&mut self, other: &Self) -> GraphInput {
        let first = self.nodes.len() as u32;
        let moved = |input: GraphInput| match input {
            GraphInput::Node(i) => GraphInput::Node(i + first),
            constant @ GraphInput::Constant(_) => constant,
        };
        self.nodes.extend(other.nodes.iter().cloned().map(|mut node| {
            node.inputs.iter_mut().for_each(|input| *input = moved(*input));
            node.offset = node.offset.map(moved);
            node
        }));
        GraphInput::Node(self.nodes.len().max(1) as u32 - 1)
    }

    /// The images that it shows.
    pub fn images_mut(&mut self) -> impl Iterator<Item = &mut TextureRef> {
        self.nodes.iter_mut().filter_map(|node| node.image.as_mut())
    }

    /// The kinds of its nodes, each once, in their order: `noise, range, mix`.
    pub fn summary(&self) -> String {
        let mut names: Vec<&str> = Vec::new();
        for node in &self.nodes {
            if !names.contains(&node.kind.name) {
                names.push(node.kind.name);
            }
        }
        names.join(", ")
    }
}

impl TextureGraphNode {
    /// A node with the defaults of its kind.
    pub fn new(kind: &'static NodeKind) -> Self {
        Self {
            kind,
            inputs: kind.inputs.iter().map(|input| GraphInput::Constant(input.default)).collect(),
            offset: None,
            parameters: kind.parameters.iter().map(|p| p.default).collect(),
            placement: Placement::default(),
            image: None,
        }
    }

    /// The same with a parameter set.
    ///
    /// # Panics
    /// If its kind has no such parameter.
    #[must_use]
    pub fn with(mut self, parameter: &str, value: f32) -> Self {
        let place = self.kind.parameters.iter().position(|p| p.name == parameter);
        self.parameters[place.expect("the kind has the parameter")] = value;
        self
    }

    /// The same with its inputs, in the order of its kind.
    #[must_use]
    pub fn taking<const N: usize>(mut self, inputs: [GraphInput; N]) -> Self {
        for (place, input) in self.inputs.iter_mut().zip(inputs) {
            *place = input;
        }
        self
    }
}

impl GraphInput {
    /// A number in all channels.
    pub fn number(x: f32) -> Self {
        Self::Constant([x; 4])
    }

    /// An opaque colour.
    pub fn color([r, g, b]: [f32; 3]) -> Self {
        Self::Constant([r, g, b, 1.0])
    }
}

fn kind_name<S: Serializer>(kind: &&'static NodeKind, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(kind.name)
}

fn named_kind<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static NodeKind, D::Error> {
    let name = String::deserialize(deserializer)?;
    kind_named(&name).ok_or_else(|| serde::de::Error::custom(format!("there is no texture node `{name}`")))
}
