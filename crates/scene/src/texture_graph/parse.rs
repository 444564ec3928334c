//! Graphs as files describe them: tables of nodes within nodes.
//!
//! A value is a number, a colour, a name, or a table: `{ node = "noise", octaves = 5, space = "object", scale = 3 }`.
//! Keys of a node are its inputs (values), its parameters, `offset` (a value that is added to its coordinates), and where
//! it lies: `space`, `scale`, `rotate` (degrees), `translate`. `{ node = "ramp", input = …, stops = [[0, …], [1, …]] }`
//! becomes ranges and mixes.

use super::kinds::{Parameter, kind_named};
use super::{GraphInput, NodeKind, Placement, PlacementParts, Space, TextureGraph, TextureGraphNode};
use crate::TextureRef;
use glam::Vec3;
use optics::tonemap::srgb_decode_channel;
use toml::{Table, Value};

/// Where a graph's names and images come from.
pub trait GraphSources {
    /// The texture of a name that the file declares; `None` if there is none.
    fn named(&mut self, name: &str) -> Option<TextureGraph>;

    /// The image that a node shows: the name of a file, or a table that says how it is used.
    ///
    /// # Errors
    /// What is wrong with it.
    fn image(&mut self, value: &Value) -> Result<TextureRef, String>;
}

/// The graph of a value; one node of it at least.
///
/// # Errors
/// What is wrong, and in which node.
pub fn parse_graph(value: &Value, sources: &mut dyn GraphSources) -> Result<TextureGraph, String> {
    let mut parser = Parser { graph: TextureGraph::default(), sources };
    if let GraphInput::Constant(c) = parser.value(value)? {
        // A graph ends with a node: what is constant is mixed of itself.
        let mix = kind_named("mix").ok_or("there is no node `mix`")?;
        let c = GraphInput::Constant(c);
        parser.push(TextureGraphNode::new(mix).taking([c, c]))?;
    }
    parser.graph.check().map_err(|error| error.to_string())?;
    Ok(parser.graph)
}

struct Parser<'a> {
    graph: TextureGraph,
    sources: &'a mut dyn GraphSources,
}

impl Parser<'_> {
    fn push(&mut self, node: TextureGraphNode) -> Result<GraphInput, String> {
        self.has_room(1)?;
        Ok(self.graph.push(node))
    }

    /// Names may stand for graphs that consist of names: what is too large must not be made.
    fn has_room(&self, more: usize) -> Result<(), String> {
        let count = self.graph.nodes.len() + more;
        let most = TextureGraph::MOST_NODES;
        if count > most {
            return Err(format!("a texture has at most {most} nodes"));
        }
        Ok(())
    }

    fn value(&mut self, value: &Value) -> Result<GraphInput, String> {
        match value {
            Value::Integer(_) | Value::Float(_) => Ok(GraphInput::number(number(value)?)),
            Value::Array(numbers) => match numbers.as_slice() {
                [_, _, _] => Ok(GraphInput::color(vector(value)?.to_array())),
                [r, g, b, a] => Ok(GraphInput::Constant([number(r)?, number(g)?, number(b)?, number(a)?])),
                _ => Err("a colour is three numbers, or four with alpha".into()),
            },
            Value::String(text) if text.starts_with('#') => hex(text).map(GraphInput::color),
            Value::String(name) => {
                if let Some(graph) = self.sources.named(name) {
                    self.has_room(graph.nodes.len())?;
                    return Ok(self.graph.append(&graph));
                }
                self.image_node(value)
            }
            Value::Table(table) if table.contains_key("file") => {
                self.image_node(&Value::Table(table.clone()))
            }
            Value::Table(table) => {
                let name =
                    table.get("node").and_then(Value::as_str).ok_or("a texture needs `node` or `file`")?;
                self.node(name, table).map_err(|why| format!("`{name}`: {why}"))
            }
            _ => Err("a value is a number, a colour, a name or a table".into()),
        }
    }

    fn image_node(&mut self, value: &Value) -> Result<GraphInput, String> {
        let image = self.sources.image(value)?;
        let kind = kind_named("image").ok_or("there is no node `image`")?;
        self.push(TextureGraphNode { image: Some(image), ..TextureGraphNode::new(kind) })
    }

    fn node(&mut self, name: &str, table: &Table) -> Result<GraphInput, String> {
        if name == "ramp" {
            return self.ramp(table);
        }
        let kind = kind_named(name).ok_or("there is no such node")?;
        let mut node = TextureGraphNode::new(kind);
        for (key, value) in table {
            self.key(&mut node, kind, key, value).map_err(|why| format!("`{key}`: {why}"))?;
        }
        if kind.is_placed {
            node.placement = placement(table)?;
        }
        if kind.has_image && node.image.is_none() {
            return Err("it needs `image`".into());
        }
        self.push(node)
    }

    fn key(
        &mut self,
        node: &mut TextureGraphNode,
        kind: &'static NodeKind,
        key: &str,
        value: &Value,
    ) -> Result<(), String> {
        if let Some(i) = kind.inputs.iter().position(|input| input.name == key) {
            node.inputs[i] = self.value(value)?;
        } else if let Some(i) = kind.parameters.iter().position(|p| p.name == key) {
            node.parameters[i] = parameter(&kind.parameters[i], value)?;
        } else if key == "image" && kind.has_image {
            node.image = Some(self.sources.image(value)?);
        } else if key == "offset" && kind.is_placed {
            node.offset = Some(self.value(value)?);
        } else if !(key == "node" || (kind.is_placed && PLACEMENT.contains(&key))) {
            return Err("there is no such key".into());
        }
        Ok(())
    }

    /// Mixes of the stops' values, each where the input goes from one stop to the next.
    fn ramp(&mut self, table: &Table) -> Result<GraphInput, String> {
        const KEYS: [&str; 4] = ["node", "input", "stops", "interpolation"];
        if let Some(key) = table.keys().find(|key| !KEYS.contains(&key.as_str())) {
            return Err(format!("`{key}`: there is no such key"));
        }
        let range = kind_named("range").ok_or("there is no node `range`")?;
        let mix = kind_named("mix").ok_or("there is no node `mix`")?;
        let interpolation = table.get("interpolation").map(|value| {
            let kind = range.parameters.iter().find(|p| p.name == "interpolation").ok_or("no such key")?;
            parameter(kind, value)
        });
        let interpolation = interpolation.transpose()?.unwrap_or(0.0);
        let stops = table.get("stops").and_then(Value::as_array).ok_or("it needs `stops`")?;
        let input = self.value(table.get("input").ok_or("it needs `input`")?)?;
        let mut last: Option<(f32, GraphInput)> = None;
        for stop in stops {
            let Some([at, value]) = stop.as_array().map(Vec::as_slice) else {
                return Err("a stop is a place and a value: `[0.5, \"#a05020\"]`".into());
            };
            let (at, value) = (number(at)?, self.value(value)?);
            let sum = match last {
                None => value,
                Some((before, _)) if at <= before => return Err("the places of stops must grow".into()),
                Some((before, sum)) => {
                    // A step is where the stop is.
                    let from = if interpolation == 2.0 { at - (at - before) * 1e-3 } else { before };
                    let part = TextureGraphNode::new(range).with("from-low", from).with("from-high", at);
                    let part = part.with("interpolation", interpolation).taking([input]);
                    let part = self.push(part)?;
                    self.push(TextureGraphNode::new(mix).taking([sum, value, part]))?
                }
            };
            last = Some((at, sum));
        }
        last.map(|(_, sum)| sum).ok_or_else(|| "it needs a stop at least".into())
    }
}

/// Keys that say where a pattern lies.
const PLACEMENT: [&str; 4] = ["space", "scale", "rotate", "translate"];

fn placement(table: &Table) -> Result<Placement, String> {
    let about = |key: &str, why: String| format!("`{key}`: {why}");
    let space = match table.get("space") {
        None => Space::default(),
        Some(value) => {
            let space = value.as_str().and_then(Space::named);
            space.ok_or("`space` is uv, uv1, object, world or camera")?
        }
    };
    let vector_or = |key: &str, default: Vec3| match table.get(key) {
        None => Ok(default),
        Some(value) if value.is_array() => vector(value).map_err(|why| about(key, why)),
        Some(value) => number(value).map(Vec3::splat).map_err(|why| about(key, why)),
    };
    let scale = vector_or("scale", Vec3::ONE)?;
    let translate = vector_or("translate", Vec3::ZERO)?;
    let rotate = match table.get("rotate") {
        // One angle turns what lies in a plane.
        Some(value) if !value.is_array() => {
            Vec3::new(0.0, 0.0, number(value).map_err(|why| about("rotate", why))?)
        }
        _ => vector_or("rotate", Vec3::ZERO)?,
    };
    Ok(Placement { space, map: PlacementParts { scale, rotate, translate }.map() })
}

fn parameter(p: &Parameter, value: &Value) -> Result<f32, String> {
    if !p.choices.is_empty() {
        let name = match value {
            Value::String(text) => text.clone(),
            Value::Boolean(on) => on.to_string(),
            _ => String::new(),
        };
        let place = p.choices.iter().position(|choice| *choice == name);
        return place.map(|i| i as f32).ok_or_else(|| format!("it is one of {}", p.choices.join(", ")));
    }
    let [low, high] = p.range;
    let value = number(value)?;
    if !(low..=high).contains(&value) {
        return Err(format!("it must be from {low} to {high}, it is {value}"));
    }
    Ok(value)
}

fn number(value: &Value) -> Result<f32, String> {
    let number = match value {
        Value::Integer(i) => *i as f32,
        Value::Float(f) => *f as f32,
        _ => return Err("it must be a number".into()),
    };
    if number.abs() <= 1e18 { Ok(number) } else { Err(format!("{number} is too large, or no number")) }
}

fn vector(value: &Value) -> Result<Vec3, String> {
    match value.as_array().map(Vec::as_slice) {
        Some([x, y, z]) => Ok(Vec3::new(number(x)?, number(y)?, number(z)?)),
        Some([x, y]) => Ok(Vec3::new(number(x)?, number(y)?, 1.0)),
        _ => Err("it must be three numbers".into()),
    }
}

/// A colour as `#rrggbb`, encoded as sRGB.
fn hex(text: &str) -> Result<[f32; 3], String> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()));
    let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let number = number.ok_or_else(|| format!("`{text}` is not a colour like \"#rrggbb\""))?;
    Ok([16, 8, 0].map(|shift| srgb_decode_channel((number >> shift & 255) as f32 / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One texture by name, and any image.
    struct Sources;

    impl GraphSources for Sources {
        fn named(&mut self, name: &str) -> Option<TextureGraph> {
            (name == "rust").then(|| TextureGraph::of(kind_named("noise").unwrap()))
        }

        fn image(&mut self, _: &Value) -> Result<TextureRef, String> {
            Ok(TextureRef::new(3))
        }
    }

    fn parsed(text: &str) -> Result<TextureGraph, String> {
        let table: Table = toml::from_str(&format!("texture = {text}")).expect("TOML");
        parse_graph(&table["texture"], &mut Sources)
    }

    #[test]
    fn nodes_within_nodes_become_a_list() {
        let graph = parsed(
            r##"{ node = "mix", a = "#ffffff", b = "rust", factor = { node = "noise", kind = "simplex",
                 octaves = 3, space = "object", scale = [2, 2, 1], offset = { file = "a.png" } } }"##,
        )
        .expect("a graph");
        let names: Vec<_> = graph.nodes.iter().map(|n| n.kind.name).collect();
        assert_eq!(names, ["noise", "image", "noise", "mix"]);
        let noise = &graph.nodes[2];
        assert_eq!((noise.parameters[0], noise.parameters[1]), (2.0, 3.0));
        assert_eq!(noise.offset, Some(GraphInput::Node(1)));
        assert_eq!(noise.placement.map.transform_point3(Vec3::ONE), Vec3::new(2.0, 2.0, 1.0));
        assert_eq!(graph.nodes[3].inputs[0], GraphInput::color([1.0; 3]));
        assert_eq!(graph.nodes[3].inputs[2], GraphInput::Node(2));
    }

    #[test]
    fn ramps_are_mixes() {
        let text =
            r##"{ node = "ramp", input = "rust", stops = [[0, 0.1], [0.5, "#808080"], [1, [1, 0, 0]]] }"##;
        let graph = parsed(text).expect("a ramp");
        let names: Vec<_> = graph.nodes.iter().map(|n| n.kind.name).collect();
        assert_eq!(names, ["noise", "range", "mix", "range", "mix"]);
    }

    #[test]
    fn mistakes_are_named_with_their_node_and_key() {
        for (text, words) in [
            (r#"{ node = "nois" }"#, "`nois`: there is no such node"),
            (r#"{ node = "noise", octave = 3 }"#, "`noise`: `octave`: there is no such key"),
            (r#"{ node = "noise", octaves = 99 }"#, "`octaves`: it must be from 1 to 16, it is 99"),
            (r#"{ node = "noise", kind = "pink" }"#, "it is one of value, perlin, simplex"),
            (r#"{ node = "mix", a = { node = "wave", space = "moon" } }"#, "`mix`: `a`: `wave`: `space` is"),
            (r#"{ node = "triplanar" }"#, "it needs `image`"),
            (r#"{ node = "ramp", input = 1, stops = [[1, 0], [0, 1]] }"#, "the places of stops must grow"),
            (r#"{ node = "invert", scale = 2 }"#, "there is no such key"),
            (r#"{ nod = 1 }"#, "needs `node` or `file`"),
            ("[1, 2]", "a colour is three numbers"),
            (r##""#12345""##, "is not a colour"),
        ] {
            let error = parsed(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    /// Names that stand for names do not grow without bound.
    #[test]
    fn textures_have_an_end() {
        let mut text = r#""rust""#.to_owned();
        for _ in 0..7 {
            text = format!(r#"{{ node = "add", a = {text}, b = {text} }}"#);
        }
        assert!(parsed(&text).expect_err("too many").contains("at most 64 nodes"));
    }
}
