//! Texture graphs that a caller describes as dictionaries.

use crate::errors::bad;
use crate::material::add_texture;
use alhazen::texture_graph::{GraphSources, parse_graph};
use alhazen::{ColorSpace, Scene, Texture, TextureGraph, TextureRef};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};
use toml::{Table, Value};

/// The key of images that have been added to the scene already.
const ADDED: &str = "added";

/// So deep may dictionaries lie in each other.
const DEEPEST: usize = 64;

/// The graph of a dictionary; pictures in it are added to the scene. `name`: of the argument, for messages.
pub fn graph(scene: &mut Scene, name: &'static str, graph: &Bound<PyDict>) -> PyResult<TextureGraph> {
    let value = value(scene, name, graph.as_any(), DEEPEST)?;
    parse_graph(&value, &mut Images).map_err(|why| bad(format!("{name}: {why}")))
}

/// As [`graph`], added as a texture.
pub fn add_graph(scene: &mut Scene, name: &'static str, described: &Bound<PyDict>) -> PyResult<TextureRef> {
    let graph = graph(scene, name, described)?;
    scene.textures.push(Texture::Graph(graph));
    Ok(TextureRef::new(scene.textures.len() as u32 - 1))
}

/// What graphs show has been added while dictionaries were read.
struct Images;

impl GraphSources for Images {
    fn named(&mut self, _: &str) -> Option<TextureGraph> {
        None
    }

    fn image(&mut self, value: &Value) -> Result<TextureRef, String> {
        let added = value.get(ADDED).and_then(Value::as_integer).and_then(|i| u32::try_from(i).ok());
        added
            .map(TextureRef::new)
            .ok_or_else(|| "an image is an array of shape (height, width, 3 or 4)".into())
    }
}

/// A value as scene files write it. Arrays that are pictures are added to the scene; `_` in keys is `-` in files.
fn value(scene: &mut Scene, name: &'static str, object: &Bound<PyAny>, depth: usize) -> PyResult<Value> {
    if depth == 0 {
        return Err(bad(format!("{name}: dictionaries are nested too deeply")));
    }
    if let Ok(text) = object.cast::<PyString>() {
        return Ok(Value::String(text.extract()?));
    }
    if let Ok(entries) = object.cast::<PyDict>() {
        let mut table = Table::new();
        for (key, entry) in entries {
            let key: String = key.extract()?;
            table.insert(key.replace('_', "-"), value(scene, name, &entry, depth - 1)?);
        }
        return Ok(Value::Table(table));
    }
    if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        let entries = object.try_iter()?.map(|entry| value(scene, name, &entry?, depth - 1));
        return Ok(Value::Array(entries.collect::<PyResult<_>>()?));
    }
    let dimensions: usize = object.getattr("ndim").and_then(|n| n.extract()).unwrap_or(0);
    match dimensions {
        0 => {}
        1 => return value(scene, name, &object.call_method0("tolist")?, depth - 1),
        _ => {
            let added = add_texture(scene, name, object, ColorSpace::Srgb)?;
            let entry = (ADDED.to_owned(), Value::Integer(i64::from(added.texture)));
            return Ok(Value::Table(Table::from_iter([entry])));
        }
    }
    if let Ok(on) = object.extract::<bool>() {
        return Ok(Value::Boolean(on));
    }
    let number: f64 = object
        .extract()
        .map_err(|_| bad(format!("{name}: a value is a number, a colour, a text or a dict")))?;
    Ok(Value::Float(number))
}
