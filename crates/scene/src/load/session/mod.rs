//! One call of a loader: which files it may read, and how much memory and time it may take.
//!
//! A session begins with the file that the user named and covers everything that this file refers to, whatever the
//! format. `names` judges names as text, `confinement` opens files, `budget` counts, `cost` says what things cost.

mod budget;
#[cfg_attr(target_family = "wasm", path = "no_files.rs")]
mod confinement;
mod cost;
mod listing;
mod names;

pub(crate) use budget::Budget;
pub(crate) use cost::{FLOAT_PIXEL, MATERIAL, PIXEL, TRIANGLE, instance, light};

use super::{LoadError, LoadOptions, Loaded};
use crate::subdivision::{RefineError, Subdivided};
use confinement::Confinement;
use listing::Listings;
use std::path::Path;
use std::sync::Arc;

/// Subdivides the meshes of a scene that was loaded.
fn refine(loaded: &mut Loaded, named: &Path, options: &LoadOptions) -> Result<(), LoadError> {
    const USUAL_HEIGHT: u32 = 720;
    let height = options.picture_height.or(loaded.scene.defaults.height).unwrap_or(USUAL_HEIGHT);
    let take = |bytes: u64| options.budget().take(bytes, "subdivided meshes");
    let done = loaded.scene.refine_within(height, &mut loaded.report, take);
    let done = done.map_err(|error| match error {
        RefineError::Refused(error) => error,
        RefineError::TooMany(mesh, error) => {
            LoadError::malformed(named, format!("mesh {mesh}"), error.to_string())
        }
    })?;
    if done.meshes > 0 {
        let Subdivided { meshes, triangles } = done;
        loaded.report.info(format!("{meshes} meshes were subdivided to {triangles} triangles"));
    }
    Ok(())
}

/// The state of one call of a loader. [`Default`] before it begins; loaders fill it in.
#[derive(Clone, Debug, Default)]
pub struct Session(Option<Arc<State>>);

/// What all loaders of a call share.
#[derive(Debug)]
struct State {
    confinement: Confinement,
    budget: Budget,
    listings: Listings,
}

impl Session {
    /// The budget of the call; without limits outside of one.
    pub(crate) fn budget(&self) -> &Budget {
        static UNLIMITED: Budget = Budget::unlimited();
        self.0.as_ref().map_or(&UNLIMITED, |state| &state.budget)
    }
}

impl LoadOptions {
    /// Runs a loader for the file `named` by the user, or as part of the call that is going on already.
    ///
    /// # Errors
    /// Those of `load`. What went over the budget comes first: it may be why something else is missing.
    pub(crate) fn session<T>(
        &self,
        named: &Path,
        load: impl FnOnce(&LoadOptions) -> Result<T, LoadError>,
    ) -> Result<T, LoadError> {
        if self.session.0.is_some() {
            return load(self);
        }
        let own = self.begin(named);
        let result = load(&own);
        own.budget().outcome()?;
        let is_named = |path: &Path| own.session.0.as_ref().is_some_and(|s| s.confinement.is_named(path));
        result.map_err(|error| error.discreet(is_named))
    }

    /// As [`LoadOptions::session`], for a scene: what its tables will take is counted, too.
    pub(crate) fn scene_session(
        &self,
        named: &Path,
        load: impl FnOnce(&LoadOptions) -> Result<Loaded, LoadError>,
    ) -> Result<Loaded, LoadError> {
        let outermost = self.session.0.is_none();
        self.session(named, |options| {
            let mut loaded = load(options)?;
            if outermost {
                let budget = options.budget();
                refine(&mut loaded, named, options)?;
                let several = loaded.scene.complete_tangents_within(|triangles| {
                    budget.take((triangles as u64).saturating_mul(cost::TANGENTS), "tangents")
                })?;
                if several > 0 {
                    loaded.report.approximated(format!(
                        "{several} meshes have materials whose normal maps are placed differently: tangents are those of one"
                    ));
                }
                options.budget().take(cost::lights(&loaded.scene), "the scene's lights")?;
            }
            Ok(loaded)
        })
    }

    fn begin(&self, named: &Path) -> LoadOptions {
        let state = State {
            confinement: Confinement::new(named, &self.allowed_paths),
            budget: Budget::new(named, self.max_memory, self.max_load_time),
            listings: Listings::default(),
        };
        LoadOptions { session: Session(Some(Arc::new(state))), ..self.clone() }
    }

    /// The budget of the call; without limits outside of one.
    pub(crate) fn budget(&self) -> &Budget {
        self.session.budget()
    }

    /// Allows the file that the user named as the value of a parameter, and its folder.
    pub(crate) fn allow_named(&self, file: &Path) {
        if let Some(state) = &self.session.0 {
            state.confinement.name(file);
        }
    }

    /// Says how messages call the file that the user named, where that is no path to it.
    pub(crate) fn also_called(&self, name: &Path) {
        if let Some(state) = &self.session.0 {
            state.confinement.call(name);
        }
    }

    /// The whole content of a file that the scene names, or that the user did, if the scene may read it.
    ///
    /// # Errors
    /// [`LoadError::Read`], [`LoadError::TooLarge`], [`LoadError::OverBudget`].
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, LoadError> {
        match &self.session.0 {
            Some(state) => {
                if let Some(bytes) = self.given_files.find(path) {
                    return self.copy_given(path, bytes);
                }
                let bytes = state.confinement.read(path, self.max_file_size, &state.budget);
                match bytes {
                    Ok(_) => self.files_read.add(path),
                    Err(_) => self.note_refused(state, path),
                }
                bytes
            }
            None => self.begin(path).read(path),
        }
    }

    /// The content of a file that the program has in memory, as if it were read.
    fn copy_given(&self, path: &Path, bytes: &[u8]) -> Result<Vec<u8>, LoadError> {
        let (size, limit) = (bytes.len() as u64, self.max_file_size);
        if size > limit {
            return Err(LoadError::TooLarge { path: path.to_owned(), what: "the file".into(), size, limit });
        }
        self.budget().take(size, "files")?;
        Ok(bytes.to_vec())
    }

    /// Whether the scene may read a regular file of this name. What it may not read is not there, as far as it can tell.
    pub(crate) fn is_file(&self, path: &Path) -> bool {
        let Some(state) = &self.session.0 else { return false };
        let is_file = self.given_files.find(path).is_some() || state.confinement.is_file(path);
        if !is_file {
            self.note_refused(state, path);
        }
        is_file
    }

    fn note_refused(&self, state: &State, path: &Path) {
        if let Some(file) = state.confinement.elsewhere(path) {
            self.files_refused.add(&file);
        }
    }

    /// The entry of `folder` that is called `name` but for the case of letters; the first one in order of names.
    pub(crate) fn entry_ignoring_case(&self, folder: &Path, name: &str) -> Option<std::path::PathBuf> {
        let state = self.session.0.as_ref()?;
        let canonical = state.confinement.folder(folder)?;
        let entry = state.listings.find(&canonical, name)?;
        Some(folder.join(entry))
    }
}
