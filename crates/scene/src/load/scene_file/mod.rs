//! Scene files: small TOML files that place models, shapes, lights and cameras.
//!
//! `docs/scene-files.md` describes the format for its users; this folder follows its sections. A file becomes a tree
//! of values whose place in the text is known (`document`), parameters are filled in (`parameters`), and each
//! table is then read by the module of its kind, so that every error names the line, the object and the key.

mod builder;
mod camera;
mod document;
mod edited;
mod environment;
mod inclusion;
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
mod subdivision;
mod template;
mod textures;
mod values;

pub use edited::{Edited, open_edited};
pub use parameters::{Parameter, Parameters, Value};

use super::session::Session;
use super::{LoadError, LoadOptions, Loaded};
use builder::Builder;
use document::{Context, Document};
use inclusion::{Budget, MAX_DEPTH, MAX_FILES, Place, canonical};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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

/// Loads a file that the scene file at `place` refers to.
fn load_included(
    path: &Path,
    parameters: &BTreeMap<String, Value>,
    place: Place,
    options: &LoadOptions,
    budget: &mut Budget,
    context: &Context,
) -> Result<Loaded, LoadError> {
    let left = budget.files.checked_sub(1);
    budget.files =
        left.ok_or_else(|| context.error(format!("the scene refers to more than {MAX_FILES} files")))?;
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        if !parameters.is_empty() {
            return Err(context.error("`parameters` are for scene files only"));
        }
        return super::load(path, options);
    }
    let mut stack = place.stack.to_vec();
    stack.push(canonical(place.path));
    if stack.contains(&canonical(path)) {
        return Err(context.error(format!("{} includes itself", path.display())));
    }
    if stack.len() > MAX_DEPTH {
        return Err(context.error(format!("scene files include each other more than {MAX_DEPTH} deep")));
    }
    let parameters: Parameters =
        parameters.iter().map(|(name, value)| (name.clone(), value.to_string())).collect();
    load_nested(path, &parameters, options, budget, &stack)
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
    let mut builder = Builder::new(place, options, budget);
    builder.read(&mut document)?;
    Ok(builder.finish())
}
