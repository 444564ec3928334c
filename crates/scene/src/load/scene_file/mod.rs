//! Scene files: small TOML files that place models, shapes, lights and cameras.
//!
//! `docs/scene-files.md` describes the format for its users; this folder follows its sections. A file becomes a tree
//! of values whose place in the text is known (`document`), parameters are filled in (`parameters`), and each
//! table is then read by the module of its kind, so that every error names the line, the object and the key.

mod camera;
mod document;
mod edited;
mod environment;
mod layers;
mod lights;
mod materials;
mod media;
mod models;
mod objects;
mod parameters;
mod placement;
mod repeat;
mod shapes;
mod textures;
mod values;

pub use edited::{Edited, open_edited};
pub use parameters::{Parameter, Value};

use super::session::Session;
use super::{LoadError, LoadOptions, Loaded};
use crate::load::textures::TextureLoader;
use crate::{LightProfile, LoadReport, Material, MaterialId, RenderDefaults, Scene};
use document::{Document, Entry};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Values for a scene's parameters, by name, as text: what a command line gives.
pub type Parameters = BTreeMap<String, String>;

/// Scene files may refer to scene files this deep.
const MAX_DEPTH: usize = 8;
/// Instances that one scene file may place, repeats and included files counted.
const MAX_INSTANCES: usize = 4_000_000;
/// Triangles that the shapes of one scene file may have together, included files counted.
const MAX_TRIANGLES: usize = 100_000_000;
/// Files that one scene file may load, included files counted.
const MAX_FILES: usize = 10_000;

/// Loads a scene file with the defaults of its parameters.
///
/// # Errors
/// See [`load_with_parameters`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    load_with_parameters(path, &Parameters::new(), options)
}

/// Loads a scene file. Files that it names are searched relative to its folder.
///
/// # Errors
/// [`LoadError::Read`], [`LoadError::TooLarge`], and [`LoadError::Malformed`], which names line, object and key: for
/// what is not TOML, unknown keys, values out of range, unknown parameters, and files that include each other.
/// Whatever the loaders of its models return.
pub fn load_with_parameters(
    path: &Path,
    parameters: &Parameters,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| {
        let folder = path.parent().unwrap_or(Path::new(""));
        allow_files_of(parameters, folder, options);
        load_nested(path, parameters, options, &mut Budget::default(), &[])
    })
}

/// Reads a scene file from text.
///
/// - `path`: how messages name it; a relative path that need not exist.
/// - `folder`: where the files that it names are searched.
///
/// # Errors
/// See [`load_with_parameters`].
pub fn parse(
    text: &str,
    path: &Path,
    folder: &Path,
    parameters: &Parameters,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    options.scene_session(&folder.join(path), |options| {
        options.also_called(path);
        allow_files_of(parameters, folder, options);
        build(text, Place { path, folder, stack: &[] }, parameters, options, &mut Budget::default())
    })
}

/// Files that the user names by a parameter may be anywhere.
fn allow_files_of(parameters: &Parameters, folder: &Path, options: &LoadOptions) {
    let named = parameters.values().filter(|value| !value.is_empty()).map(|value| folder.join(value));
    named.filter(|file| file.is_file()).for_each(|file| options.allow_named(&file));
}

/// Name, description and parameters of a scene file, without loading what it refers to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    /// The scene's name; empty if the file has none.
    pub name: String,
    /// What the scene shows, in a line.
    pub about: String,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

/// Reads name, description and parameters of a scene file.
///
/// # Errors
/// [`LoadError::Malformed`] for what is not TOML or has malformed parameters.
pub fn describe(text: &str, path: &Path) -> Result<Description, LoadError> {
    let session = Session::default();
    let mut document = Document::parse(text, path, &session)?;
    let parameters = parameters::declared(&mut document)?;
    let name = document.take_string("name")?.unwrap_or_default();
    let about = document.take_string("about")?.unwrap_or_default();
    Ok(Description { name, about, parameters })
}

/// What is left of the limits on a scene file and everything that it includes.
struct Budget {
    instances: usize,
    triangles: usize,
    files: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self { instances: MAX_INSTANCES, triangles: MAX_TRIANGLES, files: MAX_FILES }
    }
}

/// Where a scene file is, and which files it was included from.
#[derive(Clone, Copy)]
struct Place<'a> {
    path: &'a Path,
    folder: &'a Path,
    stack: &'a [PathBuf],
}

/// A scene that is being put together.
struct Builder<'a> {
    place: Place<'a>,
    options: &'a LoadOptions,
    budget: &'a mut Budget,
    scene: Scene,
    placement: placement::Placement,
    report: LoadReport,
    materials: HashMap<String, MaterialId>,
    /// Images of the file's own materials; they get their place in the scene at the end.
    images: TextureLoader<'a>,
    /// The file's own images in [`Scene::textures`].
    textures: Vec<usize>,
    /// What `[textures.NAME]` declares.
    named_textures: HashMap<String, toml::Value>,
    models: HashMap<PathBuf, models::Template>,
    /// Photometric files: many lamps share one.
    profiles: HashMap<PathBuf, Arc<LightProfile>>,
}

fn load_nested(
    path: &Path,
    parameters: &Parameters,
    options: &LoadOptions,
    budget: &mut Budget,
    stack: &[PathBuf],
) -> Result<Loaded, LoadError> {
    let text = read_text(path, options)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut loaded = build(&text, Place { path, folder, stack }, parameters, options, budget)?;
    loaded.report.bytes_read += text.len() as u64;
    Ok(loaded)
}

fn read_text(path: &Path, options: &LoadOptions) -> Result<String, LoadError> {
    let bytes = options.read(path)?;
    String::from_utf8(super::text::decoded(path, &bytes)?.into_owned()).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|b| **b == b'\n').count();
        LoadError::malformed(path, format!("line {line}"), "the text is not UTF-8")
    })
}

fn build(
    text: &str,
    place: Place,
    parameters: &Parameters,
    options: &LoadOptions,
    budget: &mut Budget,
) -> Result<Loaded, LoadError> {
    let mut document = Document::parse(text, place.path, &options.session)?;
    let declared = parameters::declared(&mut document)?;
    let values = parameters::values(&declared, parameters, place.path)?;
    let literals = parameters::literals(&values);
    document.substitute(&parameters::to_toml(&values, &literals))?;
    document.check_numbers()?;
    if let Some(edited) = edited::read(&mut document, place, options, budget)? {
        return edited.apply(place.path);
    }
    let mut builder = Builder {
        place,
        options,
        budget,
        scene: Scene::default(),
        placement: placement::Placement::default(),
        report: LoadReport::default(),
        materials: HashMap::new(),
        images: TextureLoader::new(options, 0),
        textures: Vec::new(),
        named_textures: HashMap::new(),
        models: HashMap::new(),
        profiles: HashMap::new(),
    };
    builder.read(&mut document)?;
    Ok(builder.finish())
}

impl Builder<'_> {
    /// Reads every section; what is left over is unknown.
    fn read(&mut self, document: &mut Document) -> Result<(), LoadError> {
        self.scene.name = document.take_string("name")?.unwrap_or_default();
        document.take_string("about")?;
        if let Some(render) = document.take_table("render")? {
            self.scene.defaults = render.read::<RenderDefaults>()?;
        }
        for (name, entry) in document.take_named("textures")? {
            self.add_named_texture(name, entry)?;
        }
        self.check_named_textures()?;
        for (name, entry) in document.take_named("materials")? {
            self.add_named_material(name, entry)?;
        }
        self.each(document, "shape", Self::add_shape)?;
        let emits = self.scene.materials.iter().any(Material::is_emissive);
        self.each(document, "model", Self::add_model)?;
        let of_models = self.scene.lights.len();
        self.each(document, "light", Self::add_light)?;
        self.scene.declares_light |= emits || self.scene.lights.len() > of_models;
        self.each(document, "camera", Self::add_camera)?;
        if let Some(environment) = document.take_table("environment")? {
            self.set_environment(environment)?;
            self.scene.declares_light = true;
        }
        if let Some(fog) = document.take_table("fog")? {
            self.set_fog(fog)?;
        }
        document.expect_empty(&[
            "name",
            "about",
            "parameters",
            "render",
            "textures",
            "materials",
            "shape",
            "model",
            "light",
            "camera",
            "environment",
            "fog",
        ])
    }

    fn each(
        &mut self,
        document: &mut Document,
        section: &str,
        add: fn(&mut Self, Entry) -> Result<(), LoadError>,
    ) -> Result<(), LoadError> {
        document.take_list(section)?.into_iter().try_for_each(|entry| add(self, entry))
    }

    /// Decodes the file's own images and gives them their place.
    fn finish(mut self) -> Loaded {
        let offset = self.scene.images.len() as u32;
        for texture in self.textures {
            self.scene.textures[texture].shift_references(offset, 0);
        }
        self.scene.images.extend(self.images.finish(&mut self.report));
        self.placement.settle(&mut self.scene, &mut self.report);
        Loaded { scene: self.scene, report: self.report }
    }
}
