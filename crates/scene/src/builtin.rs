//! Scenes that are part of the program: scene files of the folder `scenes`, which need no file at run time.

use crate::load::scene_file::{self, Parameter, Parameters};
use crate::{LoadError, LoadOptions, Loaded};
use std::path::Path;
use web_time::Instant;

/// Name and text of every built-in scene; the first is what is rendered when nothing is named.
const SCENES: [(&str, &str); 11] = [
    ("three-spheres", include_str!("../../../scenes/three-spheres.toml")),
    ("cornell", include_str!("../../../scenes/cornell.toml")),
    ("material-grid", include_str!("../../../scenes/material-grid.toml")),
    ("textures", include_str!("../../../scenes/textures.toml")),
    ("glass", include_str!("../../../scenes/glass.toml")),
    ("model", include_str!("../../../scenes/model.toml")),
    ("lights", include_str!("../../../scenes/lights.toml")),
    ("layers", include_str!("../../../scenes/layers.toml")),
    ("lanterns", include_str!("../../../scenes/lanterns.toml")),
    ("offices", include_str!("../../../scenes/offices.toml")),
    ("atrium", include_str!("../../../scenes/atrium.toml")),
];

/// Name of the scene that is rendered when nothing is named.
pub const DEFAULT: &str = SCENES[0].0;

/// A scene that is part of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Builtin {
    /// Name, as the command line takes it.
    pub name: &'static str,
    /// What it shows, in a line.
    pub about: String,
    /// What its user may set.
    pub parameters: Vec<Parameter>,
}

/// All built-in scenes, the default one first.
///
/// A scene file that could not be read would be missing; a test sees to it that none is.
pub fn list() -> Vec<Builtin> {
    let describe = |(name, text): &(&'static str, &'static str)| {
        let description = scene_file::describe(text, Path::new(name)).ok()?;
        Some(Builtin { name, about: description.about, parameters: description.parameters })
    };
    SCENES.iter().filter_map(describe).collect()
}

/// The text of a built-in scene, as an example for scene files; `None` if there is no such scene.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// Loads a built-in scene. Files named by parameters are searched relative to the current folder.
///
/// # Errors
/// [`LoadError::UnknownScene`] if there is none of this name, [`LoadError::Malformed`] if a parameter is unknown or out
/// of range, and whatever loading a model named by a parameter returns.
pub fn load(name: &str, parameters: &Parameters, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let start = Instant::now();
    let text = text(name).ok_or_else(|| {
        let known = SCENES.map(|(name, _)| name).join(", ");
        LoadError::UnknownScene { name: name.to_owned(), known }
    })?;
    let mut loaded = scene_file::parse(text, Path::new(name), Path::new(""), parameters, options)?;
    options.choose_surface_rules(&mut loaded.scene);
    loaded.report.elapsed = start.elapsed();
    Ok(loaded)
}
