//! Textures: images with how they are placed, and graphs. `[textures.NAME]` declares some for all materials.

use super::Builder;
use super::document::{Context, Entry};
use super::values::within;
use crate::load::LoadError;
use crate::load::textures::Neutral;
use crate::texture_graph::{GraphSources, parse_graph};
use crate::{
    ColorSpace, Filter, GraphInput, Material, Sampler, Texture, TextureGraph, TextureGraphNode, TextureRef,
    UvTransform, Wrap, texture_graph,
};
use elementary::sin_cos;
use glam::Vec2;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use toml::{Table, Value};

/// What a material says of a texture.
#[derive(Clone, Debug)]
pub(super) enum TextureValue {
    /// The name of a texture that the file declares, or of an image file.
    Name(String),
    /// An image and how it is placed.
    Image(TextureKeys),
    /// A graph of nodes.
    Graph(Table),
}

impl<'de> Deserialize<'de> for TextureValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Value::deserialize(deserializer)? {
            Value::String(name) => Ok(Self::Name(name)),
            Value::Table(table) if table.contains_key("node") => Ok(Self::Graph(table)),
            Value::Table(table) => {
                TextureKeys::deserialize(table).map(Self::Image).map_err(|e| D::Error::custom(e.message()))
            }
            _ => Err(D::Error::custom("expected the name of an image or texture, or a table")),
        }
    }
}

/// A parameter that is the same everywhere, or a graph.
#[derive(Clone, Debug)]
pub(super) enum ValueOr<T> {
    /// The same everywhere.
    Plain(T),
    /// A graph of nodes.
    Graph(Table),
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for ValueOr<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> serde::de::Visitor<'de> for Visitor<T> {
            type Value = ValueOr<T>;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number, a colour, or a table of a texture node")
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
                T::deserialize(serde::de::value::I64Deserializer::new(number)).map(ValueOr::Plain)
            }
            fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
                T::deserialize(serde::de::value::F64Deserializer::new(number)).map(ValueOr::Plain)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                T::deserialize(serde::de::value::StrDeserializer::new(text)).map(ValueOr::Plain)
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                T::deserialize(serde::de::value::SeqAccessDeserializer::new(seq)).map(ValueOr::Plain)
            }
            fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                Table::deserialize(serde::de::value::MapAccessDeserializer::new(map)).map(ValueOr::Graph)
            }
        }
        deserializer.deserialize_any(Visitor(std::marker::PhantomData))
    }
}

impl<T: Copy> ValueOr<T> {
    /// The value that is the same everywhere.
    pub fn plain(&self) -> Option<T> {
        match self {
            Self::Plain(value) => Some(*value),
            Self::Graph(_) => None,
        }
    }

    /// The graph, if it is one.
    pub fn graph(&self) -> Option<&Table> {
        match self {
            Self::Plain(_) => None,
            Self::Graph(table) => Some(table),
        }
    }
}

/// A texture with how it is placed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct TextureKeys {
    file: String,
    #[serde(default)]
    wrap: WrapName,
    #[serde(default)]
    filter: FilterName,
    #[serde(default)]
    uv_set: u32,
    #[serde(default = "ones")]
    scale: [f32; 2],
    /// Degrees.
    #[serde(default)]
    rotate: f32,
    #[serde(default)]
    offset: [f32; 2],
    /// Of images in graphs: whether bytes are linear numbers; else they are encoded as sRGB.
    #[serde(default)]
    linear: bool,
}

fn ones() -> [f32; 2] {
    [1.0, 1.0]
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum WrapName {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FilterName {
    #[default]
    Linear,
    Nearest,
}

impl TextureKeys {
    fn sampler(&self) -> Sampler {
        let wrap = match self.wrap {
            WrapName::Repeat => Wrap::Repeat,
            WrapName::Mirror => Wrap::MirroredRepeat,
            WrapName::Clamp => Wrap::ClampToEdge,
        };
        let filter = match self.filter {
            FilterName::Linear => Filter::Linear,
            FilterName::Nearest => Filter::Nearest,
        };
        Sampler { wrap_u: wrap, wrap_v: wrap, filter }
    }

    /// Scale, then rotation, then offset, as in `KHR_texture_transform`.
    fn transform(&self) -> UvTransform {
        let (sin, cos) = sin_cos(self.rotate.to_radians());
        let [x, y] = self.scale;
        UvTransform {
            rows: [Vec2::new(cos * x, sin * y), Vec2::new(-sin * x, cos * y)],
            offset: self.offset.into(),
        }
    }
}

/// A graph's names and images, which the builder has.
struct Sources<'b, 'a> {
    builder: &'b mut Builder<'a>,
    /// Names that are being looked up: a texture that consists of itself has no end.
    looked_up: Vec<String>,
    /// What went wrong within a named texture.
    failed: Option<String>,
}

impl GraphSources for Sources<'_, '_> {
    fn named(&mut self, name: &str) -> Option<TextureGraph> {
        let value = self.builder.named_textures.get(name)?.clone();
        if self.looked_up.iter().any(|known| known == name) {
            self.failed.get_or_insert_with(|| format!("the texture `{name}` consists of itself"));
            return None;
        }
        // A graph has at least a node for each name, so deeper ones would be refused in the end.
        if self.looked_up.len() >= TextureGraph::MOST_NODES {
            self.failed.get_or_insert_with(|| format!("the texture `{name}` is nested too deeply"));
            return None;
        }
        self.looked_up.push(name.to_owned());
        let graph = parse_graph(&value, self);
        self.looked_up.pop();
        graph
            .map_err(|why| self.failed.get_or_insert_with(|| format!("texture `{name}`: {why}")).clone())
            .ok()
    }

    fn image(&mut self, value: &Value) -> Result<TextureRef, String> {
        if let Some(why) = self.failed.take() {
            return Err(why);
        }
        let keys = match value {
            Value::String(file) => TextureKeys { linear: false, ..TextureKeys::of_file(file) },
            Value::Table(table) => {
                TextureKeys::deserialize(table.clone()).map_err(|error| error.message().to_owned())?
            }
            _ => return Err("an image is the name of a file, or a table".into()),
        };
        let space = if keys.linear { ColorSpace::Linear } else { ColorSpace::Srgb };
        if keys.uv_set > 1 {
            return Err("`uv-set` is 0 or 1".into());
        }
        Ok(self.builder.image_texture(&keys, space, Neutral::White))
    }
}

impl TextureKeys {
    fn of_file(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            wrap: WrapName::default(),
            filter: FilterName::default(),
            uv_set: 0,
            scale: ones(),
            rotate: 0.0,
            offset: [0.0; 2],
            linear: false,
        }
    }
}

impl Builder<'_> {
    /// Remembers `[textures.NAME]`; it is read where a material names it.
    pub(super) fn add_named_texture(&mut self, name: String, entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let value = Value::Table(entry.read()?);
        self.named_textures.insert(name.clone(), value.clone());
        // What is wrong with it is said even if nobody uses it; names that come later are checked where it is used.
        context.take(512, "textures")
    }

    /// Checks all declared textures.
    pub(super) fn check_named_textures(&mut self) -> Result<(), LoadError> {
        let mut names: Vec<String> = self.named_textures.keys().cloned().collect();
        names.sort_unstable();
        for name in names {
            let about = format!("texture `{name}`");
            self.parse_graph(&Value::String(name))
                .map_err(|why| LoadError::malformed(self.place.path, about.clone(), why))?;
        }
        Ok(())
    }

    /// The graph of a value.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn parse_graph(&mut self, value: &Value) -> Result<TextureGraph, String> {
        let mut sources = Sources { builder: self, looked_up: Vec::new(), failed: None };
        let graph = parse_graph(value, &mut sources);
        match sources.failed {
            Some(why) => Err(why),
            None => graph,
        }
    }

    /// The texture of a graph.
    pub(super) fn graph(&mut self, value: &Value, context: &Context) -> Result<TextureRef, LoadError> {
        let graph = self.parse_graph(value).map_err(|why| context.error(why))?;
        self.add_graph(graph, context)
    }

    fn add_graph(&mut self, graph: TextureGraph, context: &Context) -> Result<TextureRef, LoadError> {
        context.take(graph.nodes.len() as u64 * 512, "textures")?;
        graph.check().map_err(|why| context.error(why.to_string()))?;
        self.scene.textures.push(Texture::Graph(graph));
        Ok(TextureRef::new(self.scene.textures.len() as u32 - 1))
    }

    /// A texture of a material: an image, a graph, or one that the file declares.
    pub(super) fn texture(
        &mut self,
        value: &Option<TextureValue>,
        color_space: ColorSpace,
        neutral: Neutral,
        context: &Context,
    ) -> Result<Option<TextureRef>, LoadError> {
        let texture = match value {
            None => return Ok(None),
            Some(TextureValue::Name(name)) if self.named_textures.contains_key(name) => {
                self.graph(&Value::String(name.clone()), context)?
            }
            Some(TextureValue::Name(file)) => {
                self.image_texture(&TextureKeys::of_file(file), color_space, neutral)
            }
            Some(TextureValue::Image(keys)) => {
                within(keys.uv_set, [0, 1], "uv-set", context)?;
                self.image_texture(keys, color_space, neutral)
            }
            Some(TextureValue::Graph(table)) => self.graph(&Value::Table(table.clone()), context)?,
        };
        Ok(Some(texture))
    }

    fn image_texture(&mut self, keys: &TextureKeys, color_space: ColorSpace, neutral: Neutral) -> TextureRef {
        let image = self.images.file(&self.place.folder.join(&keys.file), neutral);
        self.textures.push(self.scene.textures.len());
        self.scene.textures.push(Texture::image(image, keys.sampler(), color_space));
        let texture = (self.scene.textures.len() - 1) as u32;
        TextureRef { texture, uv_set: keys.uv_set, transform: keys.transform() }
    }

    /// Puts graphs of roughness and metalness, each of which may be a number, into their one texture.
    pub(super) fn metallic_roughness_graph(
        &mut self,
        [roughness, metallic]: [Option<&Table>; 2],
        material: &mut Material,
        context: &Context,
    ) -> Result<(), LoadError> {
        if roughness.is_none() && metallic.is_none() {
            return Ok(());
        }
        if material.metallic_roughness_texture.is_some() {
            return Err(
                context.error("`metallic-roughness-texture` and a graph of one of both exclude each other")
            );
        }
        let mut graph = TextureGraph::default();
        let mut part = |builder: &mut Self, table: Option<&Table>, factor: &mut f32| {
            let Some(table) = table else { return Ok(GraphInput::number(1.0)) };
            *factor = 1.0;
            let parsed =
                builder.parse_graph(&Value::Table(table.clone())).map_err(|why| context.error(why))?;
            Ok::<_, LoadError>(graph.append(&parsed))
        };
        let green = part(self, roughness, &mut material.roughness)?;
        let blue = part(self, metallic, &mut material.metallic)?;
        let combine = texture_graph::kind_named("combine").ok_or_else(|| context.error("no such node"))?;
        graph.push(TextureGraphNode::new(combine).taking([GraphInput::number(1.0), green, blue]));
        material.metallic_roughness_texture = Some(self.add_graph(graph, context)?);
        Ok(())
    }
}
