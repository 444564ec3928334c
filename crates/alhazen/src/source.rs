//! Where a scene comes from: a file or the built-in list.

use scene::load::scene_file::Parameters;
use scene::{LoadError, LoadOptions, Loaded};
use std::path::PathBuf;

/// A file, or a built-in scene by name, with parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// What was named.
    pub place: Place,
    /// Parameters of scene files and built-in scenes.
    pub parameters: Parameters,
}

/// A file or a built-in scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A file of any known format.
    File(PathBuf),
    /// One of [`scene::builtin::list`].
    Builtin(String),
}

impl Source {
    /// A built-in scene if `name` is the name of one and no file is called so, else a file.
    pub fn parse(name: &str) -> Self {
        let is_builtin = scene::builtin::text(name).is_some() && !PathBuf::from(name).is_file();
        let place = if is_builtin { Place::Builtin(name.into()) } else { Place::File(name.into()) };
        Self { place, parameters: Parameters::default() }
    }

    /// Loads the scene.
    ///
    /// # Errors
    /// See [`LoadError`]. Parameters for a file that takes none are an error.
    pub fn load(&self, options: &LoadOptions) -> Result<Loaded, LoadError> {
        match &self.place {
            Place::Builtin(name) => scene::builtin::load(name, &self.parameters, options),
            Place::File(path) if self.parameters.is_empty() => scene::load::load(path, options),
            Place::File(path) => {
                let is_scene_file = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
                if !is_scene_file {
                    return Err(LoadError::malformed(path, "parameters", "only scene files and built-in scenes take them"));
                }
                scene::load::scene_file::load_with_parameters(path, &self.parameters, options)
            }
        }
    }
}
