//! Edits as a scene file: the base that they are made of, and what was changed.

use super::Edits;
use crate::RenderDefaults;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// What a file with edits says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EditedFile {
    /// The scene's name.
    pub name: String,
    /// The file of the scene that was edited; `None` for a built-in scene.
    pub file: Option<PathBuf>,
    /// The name of the built-in scene that was edited.
    pub builtin: Option<String>,
    /// Parameters of the scene that was edited.
    pub parameters: BTreeMap<String, String>,
    /// How it wants to be rendered.
    pub render: RenderDefaults,
    /// What was changed.
    pub edits: Edits,
}

#[derive(Serialize)]
struct Text<'a> {
    name: &'a str,
    base: BaseText<'a>,
    render: &'a RenderDefaults,
    #[serde(skip_serializing_if = "Edits::is_empty")]
    edits: &'a Edits,
}

#[derive(Serialize)]
struct BaseText<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    builtin: Option<&'a str>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    parameters: &'a BTreeMap<String, String>,
}

/// Why edits cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("the edits cannot be written as text")]
pub struct WriteError(#[from] toml::ser::Error);

impl EditedFile {
    /// The text of a file that will stand in `folder`: paths are relative to it where that is possible without going up.
    ///
    /// # Errors
    /// For paths that are not Unicode.
    pub fn to_text(&self, folder: &Path) -> Result<String, WriteError> {
        let mut edits = self.edits.clone();
        edits.for_each_path(|path| *path = relative(path, folder));
        let text = Text {
            name: &self.name,
            base: BaseText {
                file: self.file.as_ref().map(|file| relative(file, folder)),
                builtin: self.builtin.as_deref(),
                parameters: &self.parameters,
            },
            render: &self.render,
            edits: &edits,
        };
        let head = "# Written by Alhazen: a scene and what was changed of it. Angles are in radians, lengths in metres.\n";
        Ok(format!("{head}{}", toml::to_string(&text)?))
    }
}

/// `path` as seen from `folder`, if it is below; else the whole path.
fn relative(path: &Path, folder: &Path) -> PathBuf {
    let absolute = |p: &Path| {
        let p = if p.as_os_str().is_empty() { Path::new(".") } else { p };
        p.canonicalize().or_else(|_| std::path::absolute(p)).unwrap_or_else(|_| p.to_owned())
    };
    let (path, folder) = (absolute(path), absolute(folder));
    match path.strip_prefix(&folder) {
        // Forward slashes are understood everywhere.
        Ok(below) => below
            .components()
            .filter_map(|c| if let Component::Normal(c) = c { Some(c.to_string_lossy()) } else { None })
            .collect::<Vec<_>>()
            .join("/")
            .into(),
        Err(_) => path,
    }
}
