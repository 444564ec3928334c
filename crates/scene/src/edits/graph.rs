//! Graphs of textures as edits keep them: names of nodes, inputs and parameters with all their values.
//!
//! Nodes stand in a list and take values of earlier ones by their number, so that what is read is bit for bit what was
//! written. What a record leaves out is as the kind of the node has it.

use crate::texture_graph::{
    GraphError, GraphInput, Parameter, Placement, Space, TextureGraph, TextureGraphNode, kind_named,
};
use crate::{TextureId, TextureRef, image::UvTransform};
use glam::{Affine3A, Vec2};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// As [`TextureGraph`]; its value is that of the last node.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct GraphRecord {
    /// The nodes.
    pub nodes: Vec<NodeRecord>,
}

/// As [`TextureGraphNode`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct NodeRecord {
    /// The name of its kind.
    pub node: String,
    /// What its inputs take, by their names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub inputs: BTreeMap<String, InputRecord>,
    /// Added to its coordinates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<InputRecord>,
    /// Its parameters, by their names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, ParameterRecord>,
    /// Where its pattern lies; `None` is on the first set of texture coordinates as they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement: Option<PlacementRecord>,
    /// The image of those that show one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<ShownRecord>,
}

/// As [`GraphInput`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "an input is a number, a colour of four numbers, or { node = N }")]
pub enum InputRecord {
    /// A number in all channels.
    Number(f32),
    /// Linear RGB and alpha.
    Color([f32; 4]),
    /// The value of an earlier node.
    Node {
        /// Its number; the first is 0.
        node: u32,
    },
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a parameter is a number or a name")]
pub enum ParameterRecord {
    /// A number.
    Number(f32),
    /// One of the choices that the parameter has.
    Choice(String),
}

/// As [`Placement`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct PlacementRecord {
    /// The name of its space.
    pub space: String,
    /// From coordinates of the space to those of the pattern: the three columns of the matrix, then the translation.
    pub map: [f32; 12],
}

/// As [`TextureRef`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ShownRecord {
    /// The number of the texture, which is an image.
    pub texture: TextureId,
    /// Which set of texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// Rows of the matrix that is applied to the coordinates.
    pub rows: [[f32; 2]; 2],
    /// Added afterwards.
    pub offset: [f32; 2],
}

/// Why a record is not a graph.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GraphProblem {
    /// A node is not one.
    #[error("node {number} (`{kind}`): {problem}")]
    Node {
        /// Its number; the first is 0.
        number: usize,
        /// What it is said to be.
        kind: String,
        /// What is wrong.
        problem: String,
    },
    /// The nodes are no graph.
    #[error(transparent)]
    Graph(#[from] GraphError),
}

impl From<&TextureGraph> for GraphRecord {
    fn from(graph: &TextureGraph) -> Self {
        Self { nodes: graph.nodes.iter().map(NodeRecord::from).collect() }
    }
}

impl GraphRecord {
    /// The graph, which can be evaluated if the images are there that it shows.
    ///
    /// # Errors
    /// [`GraphProblem`], which names the node.
    pub fn graph(&self) -> Result<TextureGraph, GraphProblem> {
        let node = |(number, record): (usize, &NodeRecord)| {
            let kind = record.node.clone();
            record.node().map_err(|problem| GraphProblem::Node { number, kind, problem })
        };
        let nodes = self.nodes.iter().enumerate().map(node).collect::<Result<_, _>>()?;
        let graph = TextureGraph { nodes };
        graph.check()?;
        Ok(graph)
    }
}

impl From<&TextureGraphNode> for NodeRecord {
    fn from(node: &TextureGraphNode) -> Self {
        let inputs = node.kind.inputs.iter().zip(&node.inputs);
        let parameters = node.kind.parameters.iter().zip(&node.parameters);
        Self {
            node: node.kind.name.into(),
            inputs: inputs.map(|(kind, input)| (kind.name.into(), InputRecord::from(*input))).collect(),
            offset: node.offset.map(InputRecord::from),
            parameters: parameters.map(|(p, v)| (p.name.into(), ParameterRecord::of(p, *v))).collect(),
            placement: (node.placement != Placement::default()).then(|| PlacementRecord {
                space: node.placement.space.name().into(),
                map: node.placement.map.to_cols_array(),
            }),
            image: node.image.map(|shown| ShownRecord {
                texture: shown.texture,
                uv_set: shown.uv_set,
                rows: shown.transform.rows.map(Vec2::into),
                offset: shown.transform.offset.into(),
            }),
        }
    }
}

impl NodeRecord {
    fn node(&self) -> Result<TextureGraphNode, String> {
        let kind = kind_named(&self.node).ok_or("there is no such node")?;
        let mut node = TextureGraphNode::new(kind);
        for (name, record) in &self.inputs {
            let place = kind.inputs.iter().position(|input| input.name == name);
            let place = place.ok_or_else(|| format!("there is no input `{name}`"))?;
            node.inputs[place] = record.input().map_err(|why| format!("`{name}`: {why}"))?;
        }
        for (name, record) in &self.parameters {
            let place = kind.parameters.iter().position(|p| p.name == name);
            let place = place.ok_or_else(|| format!("there is no parameter `{name}`"))?;
            let value = record.value(&kind.parameters[place]);
            node.parameters[place] = value.map_err(|why| format!("`{name}`: {why}"))?;
        }
        if !kind.is_placed && (self.offset.is_some() || self.placement.is_some()) {
            return Err("it has no coordinates that could be placed".into());
        }
        node.offset = self.offset.map(|record| record.input()).transpose()?;
        if let Some(placement) = &self.placement {
            node.placement = placement.placement()?;
        }
        node.image = self.image.map(ShownRecord::shown).transpose()?;
        Ok(node)
    }
}

impl From<GraphInput> for InputRecord {
    fn from(input: GraphInput) -> Self {
        match input {
            GraphInput::Node(node) => Self::Node { node },
            GraphInput::Constant([r, rest @ ..]) if rest.iter().all(|c| c.to_bits() == r.to_bits()) => {
                Self::Number(r)
            }
            GraphInput::Constant(color) => Self::Color(color),
        }
    }
}

impl InputRecord {
    fn input(self) -> Result<GraphInput, String> {
        /// As scene files have it.
        const MOST: f32 = 1e18;
        let color = match self {
            Self::Node { node } => return Ok(GraphInput::Node(node)),
            Self::Number(number) => [number; 4],
            Self::Color(color) => color,
        };
        match color.iter().find(|c| c.is_nan() || c.abs() > MOST) {
            Some(c) => Err(format!("{c} is too large, or no number")),
            None => Ok(GraphInput::Constant(color)),
        }
    }
}

impl ParameterRecord {
    fn of(parameter: &Parameter, value: f32) -> Self {
        match parameter.choices.get(value as usize) {
            Some(choice) if value.fract() == 0.0 => Self::Choice((*choice).into()),
            _ => Self::Number(value),
        }
    }

    fn value(&self, parameter: &Parameter) -> Result<f32, String> {
        let [low, high] = parameter.range;
        match self {
            Self::Choice(name) => {
                let place = parameter.choices.iter().position(|choice| choice == name);
                place.map(|i| i as f32).ok_or_else(|| match parameter.choices {
                    [] => "it must be a number".into(),
                    choices => format!("it is one of {}", choices.join(", ")),
                })
            }
            Self::Number(value) if (low..=high).contains(value) => Ok(*value),
            Self::Number(value) => Err(format!("it must be from {low} to {high}, it is {value}")),
        }
    }
}

impl PlacementRecord {
    fn placement(&self) -> Result<Placement, String> {
        let space = Space::named(&self.space);
        let space = space.ok_or_else(|| format!("there is no space `{}`", self.space))?;
        if !self.map.iter().all(|v| v.is_finite()) {
            return Err("its `map` is not finite".into());
        }
        Ok(Placement { space, map: Affine3A::from_cols_array(&self.map) })
    }
}

impl ShownRecord {
    fn shown(self) -> Result<TextureRef, String> {
        if self.uv_set > 1 {
            return Err(format!("`uv-set` must be 0 or 1, it is {}", self.uv_set));
        }
        if !self.rows.iter().flatten().chain(&self.offset).all(|v| v.is_finite()) {
            return Err("its image is placed where nothing can be".into());
        }
        let transform = UvTransform { rows: self.rows.map(Vec2::from), offset: self.offset.into() };
        Ok(TextureRef { texture: self.texture, uv_set: self.uv_set, transform })
    }
}
