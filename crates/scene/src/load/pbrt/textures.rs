//! Textures: images, and procedural ones as graphs.

use super::Builder;
use super::parameters::{Parameters, Spectrum};
use crate::load::textures::Neutral;
use crate::texture_graph::{NodeKind, Placement, Space, kind_named};
use crate::{
    ColorSpace, Filter, GraphInput, Material, Sampler, Texture, TextureGraph, TextureGraphNode, TextureId,
    TextureRef, UvTransform, Wrap,
};
use elementary::powi;
use glam::{Affine3A, DMat4, Mat3, Mat4, Vec2, Vec3};

/// What a texture stands for: a factor, and an image multiplied into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Value {
    pub factor: Vec3,
    pub image: Option<TextureRef>,
}

impl Value {
    fn constant(factor: Vec3) -> Self {
        Self { factor, image: None }
    }
}

/// The colours of pbrt's marble: control points of a spline.
/// Source: pbrt-v4, `MarbleTexture::Evaluate`.
const MARBLE: [[f32; 3]; 9] = [
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.5, 0.5, 0.5],
    [0.6, 0.59, 0.58],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.2, 0.2, 0.33],
    [0.58, 0.58, 0.6],
];

/// The colour of marble at `t` in `[0, 1]`.
fn marble(t: f32) -> [f32; 3] {
    const SEGMENTS: usize = 6;
    let first = ((t * SEGMENTS as f32) as usize).min(SEGMENTS - 1);
    let u = t * SEGMENTS as f32 - first as f32;
    let weights = [powi(1.0 - u, 3), 3.0 * u * powi(1.0 - u, 2), 3.0 * u * u * (1.0 - u), powi(u, 3)];
    std::array::from_fn(|k| {
        1.5 * weights.iter().zip(&MARBLE[first..]).map(|(w, color)| w * color[k]).sum::<f32>()
    })
}

/// A kind that the table of kinds has.
fn kind(name: &str) -> &'static NodeKind {
    kind_named(name).unwrap_or(&crate::texture_graph::KINDS[0])
}

fn node(name: &str) -> TextureGraphNode {
    TextureGraphNode::new(kind(name))
}

impl Builder<'_> {
    /// A colour or a texture.
    pub(super) fn value(&mut self, p: &Parameters, name: &str, default: Vec3) -> Value {
        match p.spectrum(name) {
            None => Value::constant(default),
            Some(Spectrum::Color(color)) => Value::constant(color),
            Some(Spectrum::Named(spectrum)) => {
                self.report.approximated(format!("{}: the spectrum {spectrum} is not evaluated", p.place));
                Value::constant(default)
            }
            Some(Spectrum::Texture(texture)) => match self.named_textures.get(&texture) {
                Some(value) => *value,
                None => {
                    self.report.repaired(format!("{}: there is no texture `{texture}`", p.place));
                    Value::constant(default)
                }
            },
        }
    }

    /// Reads `Texture NAME`.
    pub(super) fn add_texture(&mut self, name: String, value_type: &str, class: &str, p: &Parameters) {
        let scale = |p: &Parameters| p.number_or("scale", 1.0);
        let value = match class {
            "constant" => self.value(p, "value", Vec3::ONE),
            "imagemap" => match p.text("filename") {
                Some(file) => self.image_map(file, value_type, scale(p), p),
                None => Value::constant(Vec3::ONE),
            },
            "scale" => {
                let (a, b) = (self.value(p, "tex", Vec3::ONE), self.value(p, "scale", Vec3::ONE));
                if a.image.is_some() && b.image.is_some() {
                    return self.multiplied(name, a, b);
                }
                Value { factor: a.factor * b.factor, image: a.image.or(b.image) }
            }
            other => self.procedural(other, p).unwrap_or_else(|| {
                self.report.approximated(format!("{}: the texture {other} is taken as grey", p.place));
                Value::constant(Vec3::splat(0.5))
            }),
        };
        self.named_textures.insert(name, value);
    }

    fn image_map(&mut self, file: &str, value_type: &str, scale: f32, p: &Parameters) -> Value {
        let path = self.parser.resolve(&p.place, file);
        let image = self.images.file(&path, Neutral::White);
        let linear = value_type == "float" || p.text("encoding").is_some_and(|e| e == "linear");
        let space = if linear { ColorSpace::Linear } else { ColorSpace::Srgb };
        if p.truth("invert").unwrap_or(false) {
            self.report.ignored(format!("{}: the picture is not inverted", p.place));
        }
        let wrap = match p.text("wrap") {
            None | Some("repeat") => Wrap::Repeat,
            Some("clamp") => Wrap::ClampToEdge,
            Some(other) => {
                self.report.approximated(format!("{}: wrapping {other} is taken as clamp", p.place));
                Wrap::ClampToEdge
            }
        };
        let _ = (p.text("filter"), p.number("maxanisotropy"));
        if p.text("mapping").is_some_and(|m| m != "uv") {
            self.report.approximated(format!("{}: textures are placed by their coordinates", p.place));
        }
        let texture = self.texture(image, space, wrap);
        let named = |name: &str, default| p.number_or(name, default);
        // v grows upwards in pbrt: v' = 1 − (sv · (1 − v) + dv).
        let (su, sv, du, dv) =
            (named("uscale", 1.0), named("vscale", 1.0), named("udelta", 0.0), named("vdelta", 0.0));
        let transform = UvTransform {
            rows: [Vec2::new(su, 0.0), Vec2::new(0.0, sv)],
            offset: Vec2::new(du, 1.0 - sv - dv),
        };
        let image = TextureRef { transform, ..TextureRef::new(texture) };
        Value { factor: Vec3::splat(scale), image: Some(image) }
    }

    /// The texture of an image, each once.
    pub(super) fn texture(&mut self, image: u32, color_space: ColorSpace, wrap: Wrap) -> TextureId {
        let sampler = Sampler { wrap_u: wrap, wrap_v: wrap, filter: Filter::Linear };
        let texture = Texture::image(image, sampler, color_space);
        let known = self.textures.iter().position(|t| *t == texture);
        let number = known.unwrap_or_else(|| {
            self.textures.push(texture);
            self.textures.len() - 1
        });
        number as TextureId
    }

    /// A texture that pbrt computes; `None` if it is no known one.
    fn procedural(&mut self, class: &str, p: &Parameters) -> Option<Value> {
        let mut graph = TextureGraph::default();
        let (one, zero) = (Vec3::ONE, Vec3::ZERO);
        match class {
            "mix" | "directionmix" => {
                let (first, second) = (self.value(p, "tex1", zero), self.value(p, "tex2", one));
                let (a, b) = (self.input(&mut graph, first), self.input(&mut graph, second));
                let inputs = if class == "mix" {
                    let amount = self.value(p, "amount", Vec3::splat(0.5));
                    [a, b, self.input(&mut graph, amount)]
                } else {
                    let [x, y, z] = p.vector("dir").unwrap_or(Vec3::Y).to_array();
                    [b, a, graph.push(node("facing").with("x", x).with("y", y).with("z", z))]
                };
                graph.push(node("mix").taking(inputs));
            }
            "checkerboard" => {
                let (first, second) = (self.value(p, "tex1", one), self.value(p, "tex2", zero));
                let (a, b) = (self.input(&mut graph, first), self.input(&mut graph, second));
                let solid = p.number("dimension") == Some(3.0);
                let placement = if solid { self.solid_placement(1.0) } else { flat_placement(p) };
                let cells = if solid { 1.0 } else { 0.0 };
                let board = node("checkerboard").with("cells", cells).taking([a, b]);
                graph.push(TextureGraphNode { placement, ..board });
            }
            "dots" => {
                let (first, second) = (self.value(p, "inside", one), self.value(p, "outside", zero));
                let (a, b) = (self.input(&mut graph, first), self.input(&mut graph, second));
                graph.push(TextureGraphNode { placement: flat_placement(p), ..node("dots").taking([a, b]) });
            }
            "fbm" | "wrinkled" => {
                let noise = self.noise(p, 1.0, class == "wrinkled", p.number_or("octaves", 8.0));
                graph.push(noise);
            }
            "windy" => {
                let strength = self.noise(p, 0.1, false, 3.0);
                let waves = self.noise(p, 1.0, false, 6.0);
                let (strength, waves) = (graph.push(strength), graph.push(waves));
                let strength = graph.push(node("magnitude").taking([strength]));
                graph.push(node("multiply").taking([strength, waves]));
            }
            "marble" => self.marble(&mut graph, p),
            _ => return None,
        }
        let _ = p.text("mapping");
        self.add_graph(graph)
    }

    /// Sums of octaves as pbrt has them: not divided by their amplitudes.
    fn noise(&self, p: &Parameters, scale: f32, turbulent: bool, octaves: f32) -> TextureGraphNode {
        let (octaves, gain) = (octaves.clamp(1.0, 16.0), p.number_or("roughness", 0.5).clamp(0.0, 1.0));
        let sum: f32 = (0..octaves.ceil() as i32).map(|i| powi(gain, i)).sum();
        let noise = node("noise").with("octaves", octaves).with("gain", gain).with("high", sum);
        let noise = noise.with("low", if turbulent { 0.0 } else { -sum });
        let noise = noise.with("turbulence", if turbulent { 1.0 } else { 0.0 }).with("lacunarity", 1.99);
        TextureGraphNode { placement: self.solid_placement(scale), ..noise }
    }

    fn marble(&self, graph: &mut TextureGraph, p: &Parameters) {
        let scale = p.number_or("scale", 1.0);
        let variation = p.number_or("variation", 0.2);
        let mut noise = self.noise(p, scale, false, p.number_or("octaves", 8.0));
        let turns = variation / std::f32::consts::TAU;
        for (value, name) in noise.parameters.iter_mut().zip(noise.kind.parameters) {
            *value *= if matches!(name.name, "low" | "high") { turns } else { 1.0 };
        }
        let noise = graph.push(noise);
        let along = self.solid_placement(scale / std::f32::consts::TAU);
        // Bands run along x there and along y here.
        let exchanged = Mat3::from_cols(Vec3::Y, Vec3::X, Vec3::Z);
        let placement = Placement { map: Affine3A::from_mat3(exchanged) * along.map, ..along };
        let wave = TextureGraphNode { placement, offset: Some(noise), ..node("wave") };
        let wave = graph.push(wave);
        const STOPS: usize = 12;
        let mut sum = GraphInput::color(marble(0.0));
        for i in 0..STOPS {
            let (from, to) = (i as f32 / STOPS as f32, (i + 1) as f32 / STOPS as f32);
            let part = node("range").with("from-low", from).with("from-high", to).taking([wave]);
            let part = graph.push(part);
            sum = graph.push(node("mix").taking([sum, GraphInput::color(marble(to)), part]));
        }
    }

    /// The space in which a solid texture is defined.
    fn solid_placement(&self, scale: f32) -> Placement {
        let to_world = self.mirror * self.state.transform;
        let map = Mat4::from_scale(Vec3::splat(scale)) * DMat4::from(to_world.inverse()).as_mat4();
        Placement { space: Space::World, map: Affine3A::from_mat4(map) }
    }

    /// What a graph takes of a value.
    fn input(&self, graph: &mut TextureGraph, value: Value) -> GraphInput {
        let factor = GraphInput::color(value.factor.to_array());
        let Some(shown) = value.image else { return factor };
        let input = match self.textures.get(shown.texture as usize) {
            Some(Texture::Graph(other)) => graph.append(other),
            _ => graph.push(TextureGraphNode { image: Some(shown), ..node("image") }),
        };
        if value.factor == Vec3::ONE { input } else { graph.push(node("multiply").taking([input, factor])) }
    }

    /// A value whose factor is in its texture, as what counts heights needs it; `None` if it is the same everywhere.
    pub(super) fn graph_of(&mut self, value: Value) -> Option<TextureRef> {
        value.image?;
        let mut graph = TextureGraph::default();
        self.input(&mut graph, value);
        self.add_graph(graph).and_then(|value| value.image)
    }

    /// A graph as a texture. `None`, with a note, if it is too large.
    fn add_graph(&mut self, graph: TextureGraph) -> Option<Value> {
        if let Err(why) = graph.check() {
            self.report.approximated(format!("a texture is left out: {why}"));
            return None;
        }
        self.textures.push(Texture::Graph(graph));
        let texture = TextureRef::new(self.textures.len() as u32 - 1);
        Some(Value { factor: Vec3::ONE, image: Some(texture) })
    }

    fn multiplied(&mut self, name: String, a: Value, b: Value) {
        let mut graph = TextureGraph::default();
        let inputs = [self.input(&mut graph, a), self.input(&mut graph, b)];
        graph.push(node("multiply").taking(inputs));
        let product = self.add_graph(graph).unwrap_or(a);
        self.named_textures.insert(name, product);
    }

    /// A texture of roughness, of which pbrt takes the square root unless `remaproughness` says otherwise.
    pub(super) fn set_roughness_texture(&mut self, material: &mut Material, p: &Parameters) {
        if p.texture("roughness").is_none() {
            return;
        }
        let value = self.value(p, "roughness", Vec3::ZERO);
        let mut graph = TextureGraph::default();
        let input = self.input(&mut graph, value);
        let remapped = p.truth("remaproughness").unwrap_or(true);
        // Perceptual roughness is the root of the width.
        let exponent = GraphInput::number(if remapped { 0.25 } else { 0.5 });
        let roughness = graph.push(node("power").taking([input, exponent]));
        let one = GraphInput::number(1.0);
        graph.push(node("combine").taking([one, roughness, one]));
        if let Some(made) = self.add_graph(graph) {
            material.metallic_roughness_texture = made.image;
            material.roughness = 1.0;
        }
    }
}

/// Where a pattern of texture coordinates lies: v grows upwards in pbrt.
fn flat_placement(p: &Parameters) -> Placement {
    let named = |name: &str, default| p.number_or(name, default);
    let (su, sv) = (named("uscale", 1.0), named("vscale", 1.0));
    let (du, dv) = (named("udelta", 0.0), named("vdelta", 0.0));
    let map = Mat3::from_diagonal(Vec3::new(su, -sv, 1.0));
    Placement { space: Space::Uv, map: Affine3A::from_mat3_translation(map, Vec3::new(du, sv + dv, 0.0)) }
}

#[cfg(test)]
mod tests {
    use super::marble;

    #[test]
    fn marble_goes_through_the_ends_of_its_spline() {
        assert_eq!(marble(0.0), [0.58, 0.58, 0.6].map(|c| 1.5 * c));
        let end = marble(1.0);
        assert!((end[0] - 1.5 * 0.58).abs() < 1e-5, "{end:?}");
    }
}
