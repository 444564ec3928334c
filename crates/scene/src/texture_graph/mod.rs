//! Textures that are computed: small graphs of nodes, evaluated by the optics at every hit.

mod density;
mod evaluate;
mod graph;
mod kinds;
mod light_profile;
mod panorama;
mod parse;
mod placement;
mod program;

pub use density::TabulationError;
pub use evaluate::evaluate;
pub use graph::{GraphError, GraphInput, TextureGraph, TextureGraphNode};
pub use kinds::{InputKind, KINDS, NodeKind, Parameter, kind_named};
pub use parse::{GraphSources, parse_graph};
pub use placement::{Placement, PlacementParts, Space};
pub use program::Program;
