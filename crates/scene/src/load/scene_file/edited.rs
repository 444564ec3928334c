//! `[base]` and `[edits]`: a scene that is another one with changes on top, as programs write it.

use super::document::Document;
use super::inclusion::{Budget, Place};
use super::{Parameters, Value, load_included, read_text};
use crate::edits::{Editable, Edits, Resources};
use crate::load::{LoadError, LoadOptions, Loaded};
use crate::load::{environment, textures};
use crate::{LoadReport, RenderDefaults, Scene, builtin};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Keys of `[base]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
struct BaseKeys {
    file: Option<PathBuf>,
    builtin: Option<String>,
    parameters: BTreeMap<String, Value>,
}

/// A scene file with a base, its parts apart.
#[derive(Clone, Debug)]
pub struct Edited {
    /// The scene that was edited. It has the render defaults and the name of the file, if that has any.
    pub base: Scene,
    /// The base's file; `None` if it is a built-in scene.
    pub base_file: Option<PathBuf>,
    /// The base's name if it is a built-in scene.
    pub base_builtin: Option<String>,
    /// The base's parameters.
    pub base_parameters: Parameters,
    /// What was changed. Paths are as the system finds them.
    pub edits: Edits,
    /// The files that the edits refer to.
    pub resources: Resources,
    /// What was noticed.
    pub report: LoadReport,
}

impl Edited {
    /// The edited scene.
    pub(super) fn apply(self, path: &Path) -> Result<Loaded, LoadError> {
        let mut scene = Editable::new(self.base);
        scene
            .set(&self.edits, &self.resources)
            .map_err(|error| LoadError::malformed(path, "edits", error.to_string()))?;
        Ok(Loaded { scene: scene.into_scene(), report: self.report })
    }
}

/// Loads the parts of a scene file that has a `[base]`; `None` for other files.
///
/// # Errors
/// As [`super::load_with_parameters`].
pub fn open_edited(path: &Path, options: &LoadOptions) -> Result<Option<Edited>, LoadError> {
    options.session(path, |options| open_edited_within(path, options))
}

fn open_edited_within(path: &Path, options: &LoadOptions) -> Result<Option<Edited>, LoadError> {
    let text = read_text(path, options)?;
    let mut document = Document::parse(&text, path, &options.session)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    document.check_numbers()?;
    read(&mut document, Place { path, folder, stack: &[] }, options, &mut Budget::default())
}

/// Reads the whole document if it has a `[base]`.
pub(super) fn read(
    document: &mut Document,
    place: Place,
    options: &LoadOptions,
    budget: &mut Budget,
) -> Result<Option<Edited>, LoadError> {
    let Some(base) = document.take_table("base")? else { return Ok(None) };
    let context = base.context();
    let keys: BaseKeys = base.read()?;
    let mut report = LoadReport::default();
    let base_file = keys.file.as_ref().map(|file| place.folder.join(file));
    let loaded = match (&base_file, &keys.builtin) {
        (Some(file), None) => load_included(file, &keys.parameters, place, options, budget, &context)?,
        (None, Some(name)) => builtin::load(name, &text_of(&keys.parameters), options)?,
        _ => return Err(context.error("`base` needs one of `file` and `builtin`")),
    };
    let mut base = loaded.scene;
    let label = base_file.as_deref().and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned());
    report.absorb(label.as_deref().or(keys.builtin.as_deref()).unwrap_or("base"), loaded.report);
    if let Some(name) = document.take_string("name")? {
        base.name = name;
    }
    document.take_string("about")?;
    if let Some(render) = document.take_table("render")? {
        base.defaults = render.read::<RenderDefaults>()?;
    }
    let edits = document.take_table("edits")?.map(|entry| entry.read::<Edits>()).transpose()?;
    let mut edits = edits.unwrap_or_default();
    edits.for_each_path(|path| *path = place.folder.join(&*path));
    document.expect_empty(&["name", "about", "base", "render", "edits"])?;
    let mut resources = Resources::default();
    for file in edits.models() {
        let model = load_included(file, &BTreeMap::new(), place, options, budget, &context)?;
        report.absorb(&file.file_name().unwrap_or_default().to_string_lossy(), model.report);
        resources.models.insert(file.to_owned(), Arc::new(model.scene));
    }
    if let Some(file) = edits.environment_file() {
        let image = environment::load(file, options, &mut report)?;
        resources.environments.insert(file.to_owned(), Arc::new(image));
    }
    for file in edits.pictures() {
        let image = textures::load_picture(file, options, &mut report)?;
        resources.pictures.insert(file.to_owned(), Arc::new(image));
    }
    let base_parameters = text_of(&keys.parameters);
    Ok(Some(Edited {
        base,
        base_file,
        base_builtin: keys.builtin,
        base_parameters,
        edits,
        resources,
        report,
    }))
}

fn text_of(parameters: &BTreeMap<String, Value>) -> Parameters {
    parameters.iter().map(|(name, value)| (name.clone(), value.to_string())).collect()
}
