//! Where a scene comes from: a file or the built-in list.

use crate::memory::available_memory_bytes;
use crate::sandbox;
use scene::load::scene_file::Parameters;
use scene::{LoadError, LoadOptions, Loaded};
use std::fmt;
use std::path::{Path, PathBuf};

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

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::File(path) => path.display().fmt(f),
            Place::Builtin(name) => name.fmt(f),
        }
    }
}

impl Source {
    /// A file if one is called `name` or if it looks like a file's name; else a built-in scene, which
    /// [`Source::load`] may not know.
    pub fn parse(name: &str) -> Self {
        let looks_like_a_file = name.contains(['.', '/', '\\']);
        let is_builtin = !looks_like_a_file && !PathBuf::from(name).is_file();
        let place = if is_builtin { Place::Builtin(name.into()) } else { Place::File(name.into()) };
        Self { place, parameters: Parameters::default() }
    }

    /// A file, whatever its name looks like.
    pub fn parse_file(path: &Path) -> Self {
        Self { place: Place::File(path.to_owned()), parameters: Parameters::default() }
    }

    /// Loads the scene.
    ///
    /// # Errors
    /// See [`LoadError`]. Parameters for a file that takes none are an error.
    ///
    /// Without a limit of its own the scene may take three quarters of the memory that is free. A scene that is
    /// [`LoadOptions::untrusted`] is loaded in a sandbox where the system has one.
    pub fn load(&self, options: &LoadOptions) -> Result<Loaded, LoadError> {
        let mut options = options.clone();
        if options.max_memory == u64::MAX {
            options.max_memory = available_memory_bytes().map_or(u64::MAX, |free| free / 4 * 3);
        }
        if options.untrusted {
            return sandbox::run(&self.folders(&options), || self.load_here(&options));
        }
        self.load_here(&options)
    }

    /// The folders that the scene may read.
    fn folders(&self, options: &LoadOptions) -> Vec<PathBuf> {
        let folder = |file: &Path| match file.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let mut folders = options.allowed_paths.clone();
        let base = match &self.place {
            Place::File(path) => {
                folders.push(folder(path));
                // The file may be a link; the user named it all the same.
                folders.extend(path.canonicalize().ok().map(|path| folder(&path)));
                folder(path)
            }
            Place::Builtin(_) => PathBuf::new(),
        };
        let named = self.parameters.values().filter(|v| !v.is_empty()).map(|value| base.join(value));
        folders.extend(named.filter(|file| file.is_file()).map(|file| folder(&file)));
        folders
    }

    fn load_here(&self, options: &LoadOptions) -> Result<Loaded, LoadError> {
        match &self.place {
            Place::Builtin(name) => scene::builtin::load(name, &self.parameters, options),
            Place::File(path) if self.parameters.is_empty() => scene::load::load(path, options),
            Place::File(path) => {
                let is_scene_file = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
                if !is_scene_file {
                    return Err(LoadError::malformed(
                        path,
                        "parameters",
                        "only scene files and built-in scenes take them",
                    ));
                }
                scene::load::scene_file::load_with_parameters(path, &self.parameters, options)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_scenes_and_names_with_an_ending_are_files() {
        assert_eq!(Source::parse("cornell").place, Place::Builtin("cornell".into()));
        assert_eq!(Source::parse("a/cornell").place, Place::File("a/cornell".into()));
        assert_eq!(Source::parse("cornell.obj").place, Place::File("cornell.obj".into()));
        let unknown = Source::parse("cornel").load(&LoadOptions::default());
        assert!(matches!(unknown, Err(LoadError::UnknownScene { .. })));
    }
}
