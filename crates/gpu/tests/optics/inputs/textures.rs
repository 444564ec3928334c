//! Texture graphs: points, nodes, and what patterns are made of.

use super::*;
use optics::constants::NONE;
use optics::noise::Fractal;
use optics::patterns::Bricks;
use optics::texture_node::TextureNode;
use optics::texture_point::TexturePoint;
use optics::{Vec4f, vec4f};
use scene::texture_graph::{KINDS, NodeKind, Program, TextureGraph};

/// A place in a pattern, some cells from the origin.
pub fn pattern_point(i: &mut Inputs) -> Vec3f {
    let mut at = || i.between(-20.0, 20.0);
    vec3f(at(), at(), at())
}

/// A corner of a cell.
pub fn lattice_point(i: &mut Inputs) -> Vec3f {
    let mut at = || i.below(40) as f32 - 20.0;
    vec3f(at(), at(), at())
}

/// 0 or 1.
pub fn flag_number(i: &mut Inputs) -> u32 {
    i.below(2) as u32
}

pub fn gradient_kind(i: &mut Inputs) -> u32 {
    i.below(6) as u32
}

pub fn kelvin(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1e6]).unwrap_or_else(|| i.between(1500.0, 26_000.0))
}

pub fn fractal(i: &mut Inputs) -> Fractal {
    Fractal {
        kind: axis(i),
        octaves: i.between(1.0, 6.0),
        lacunarity: i.between(1.5, 2.5),
        gain: share(i),
        turbulent: flag(i),
        seed: bits(i),
    }
}

pub fn bricks(i: &mut Inputs) -> Bricks {
    let (width, height) = (i.between(0.2, 2.0), i.between(0.2, 2.0));
    Bricks { width, height, mortar: i.between(0.0, 0.1), shift: share(i), seed: bits(i) }
}

pub fn texture_point(i: &mut Inputs) -> TexturePoint {
    TexturePoint {
        coords: vec4f(i.between(-3.0, 3.0), i.between(-3.0, 3.0), share(i), share(i)),
        color: texel4(i),
        position: point(i),
        width: share(i),
        world: far_point(i),
        object_density: share(i),
        normal: direction(i),
        uv_density: share2(i),
    }
}

/// Any operation that there is.
pub fn node_operation(i: &mut Inputs) -> u32 {
    KINDS[i.below(KINDS.len() as u64) as usize].operation
}

/// A node of any kind with parameters that it may have.
pub fn texture_node(i: &mut Inputs) -> TextureNode {
    let kind = &KINDS[i.below(KINDS.len() as u64) as usize];
    node_of(i, kind)
}

pub fn noise_node(i: &mut Inputs) -> TextureNode {
    node_of(i, kind("noise"))
}

pub fn voronoi_node(i: &mut Inputs) -> TextureNode {
    node_of(i, kind("voronoi"))
}

fn kind(name: &str) -> &'static NodeKind {
    scene::texture_graph::kind_named(name).expect("a kind")
}

/// A record as the renderer makes it, with random parameters and another map of coordinates.
fn node_of(i: &mut Inputs, kind: &'static NodeKind) -> TextureNode {
    let mut graph = TextureGraph::of(kind);
    let node = &mut graph.nodes[0];
    for (value, parameter) in node.parameters.iter_mut().zip(kind.parameters) {
        let [low, high] = parameter.range;
        *value = match parameter.choices.len() as u64 {
            0 => i.between(low.max(-2.0), high.min(4.0)),
            choices => i.below(choices) as f32,
        };
    }
    if kind.has_image {
        node.image = Some(scene::TextureRef::new(0));
    }
    let program = Program::new(&graph, glam::Affine3A::IDENTITY).expect("a node");
    let mut record = *program.nodes.last().expect("a node");
    (record.a, record.b, record.c, record.offset) = (NONE, NONE, NONE, NONE);
    let mut row = || -> Vec4f {
        vec4f(i.between(-2.0, 2.0), i.between(-2.0, 2.0), i.between(-2.0, 2.0), i.between(-1.0, 1.0))
    };
    (record.row_x, record.row_y, record.row_z) = (row(), row(), row());
    record.space = i.below(4) as u32;
    record
}
