//! Loading files in the background.

use crate::document::Base;
use alhazen::edits::{Edits, EnvironmentRecord, Resources, open_edited};
use alhazen::{
    Environment, FilesRead, LoadError, LoadOptions, LoadReport, MaterialId, Place, Scene, Source,
    TextureSlot, add_daylight_if_dark,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// What is loaded for what.
#[derive(Clone, Debug, PartialEq)]
pub enum Job {
    /// A scene to be opened.
    Open(Source),
    /// A model that is added to the scene.
    Model(PathBuf),
    /// A picture that is put around the scene.
    Environment(PathBuf),
    /// A picture that takes the place of a material's texture.
    Picture(PathBuf, MaterialId, TextureSlot),
}

impl std::fmt::Display for Job {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Open(source) => source.fmt(f),
            Self::Model(path) | Self::Environment(path) | Self::Picture(path, ..) => path.display().fmt(f),
        }
    }
}

/// What came of it.
pub enum Loaded {
    /// A scene to open.
    Scene(Box<Opened>),
    /// Files that edits will refer to.
    Resources(Resources, LoadReport),
}

/// A scene without its edits, and these.
pub struct Opened {
    /// It.
    pub scene: Scene,
    /// What its edits are made of.
    pub base: Base,
    /// Files that the edits refer to.
    pub resources: Resources,
    /// What was noticed.
    pub report: LoadReport,
}

/// A file that is being loaded by a thread of its own. Dropping this gives it up: the thread ends by itself, and nobody
/// takes what it has made.
pub struct Loading {
    /// What is being loaded.
    pub job: Job,
    /// Files elsewhere that it was refused, as far as it has come.
    pub refused: FilesRead,
    since: Instant,
    result: Receiver<Result<Loaded, LoadError>>,
}

impl Loading {
    /// Begins to load; `wake` is called when it is done.
    pub fn start(job: Job, options: LoadOptions, wake: impl FnOnce() + Send + 'static) -> Self {
        let (sender, result) = channel();
        let of_thread = job.clone();
        let refused = FilesRead::default();
        let options = LoadOptions { files_refused: refused.clone(), ..options };
        let work = move || {
            // Who has given up does not listen.
            let _ = sender.send(load(&of_thread, &options));
            wake();
        };
        if let Err(error) = std::thread::Builder::new().name("load".into()).spawn(work) {
            eprintln!("cannot start a thread to load with: {error}");
        }
        Self { job, refused, since: Instant::now(), result }
    }

    /// How long it has taken so far.
    pub fn elapsed(&self) -> Duration {
        self.since.elapsed()
    }

    /// The result, once there is one. A loader that ended without a result counts as a file that is no good.
    pub fn poll(&self) -> Option<Result<Loaded, LoadError>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(LoadError::malformed(
                Path::new(&self.job.to_string()),
                "file",
                "the loader ended without a result",
            ))),
        }
    }
}

fn load(job: &Job, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let start = Instant::now();
    match job {
        Job::Open(source) => {
            let mut opened = open(source, options)?;
            opened.report.elapsed = start.elapsed();
            Ok(Loaded::Scene(Box::new(opened)))
        }
        Job::Model(path) => {
            let loaded = Source::parse_file(path).load(options)?;
            let mut resources = Resources::default();
            resources.models.insert(path.clone(), Arc::new(loaded.scene));
            Ok(Loaded::Resources(resources, loaded.report))
        }
        Job::Picture(path, ..) => {
            let mut report = LoadReport::default();
            let image = alhazen::load_picture(path, options, &mut report)?;
            let mut resources = Resources::default();
            resources.pictures.insert(path.clone(), Arc::new(image));
            Ok(Loaded::Resources(resources, report))
        }
        Job::Environment(path) => {
            let mut report = LoadReport::default();
            let image = alhazen::load_environment(path, options, &mut report)?;
            let mut resources = Resources::default();
            resources.environments.insert(path.clone(), Arc::new(image));
            Ok(Loaded::Resources(resources, report))
        }
    }
}

fn open(source: &Source, options: &LoadOptions) -> Result<Opened, LoadError> {
    if let Some(edited) = edited(source, options)? {
        let place = match (edited.base_file, edited.base_builtin) {
            (Some(file), _) => Place::File(file),
            (None, name) => Place::Builtin(name.unwrap_or_default()),
        };
        let base = Base { source: Source { place, parameters: edited.base_parameters }, edits: edited.edits };
        let (scene, resources) = (edited.base, edited.resources);
        return Ok(Opened { scene, base, resources, report: edited.report });
    }
    let mut loaded = source.load(options)?;
    let mut edits = Edits::default();
    // As `alhazen render` does, or nothing would be seen; as an edit, so that it can be changed and is saved.
    if add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None) {
        edits.environment = Some(EnvironmentRecord::from(&loaded.scene.environment));
        loaded.scene.environment = Environment::Black;
    }
    let base = Base { source: source.clone(), edits };
    Ok(Opened { scene: loaded.scene, base, resources: Resources::default(), report: loaded.report })
}

/// The parts of a scene file that has a base; `None` for everything else.
fn edited(source: &Source, options: &LoadOptions) -> Result<Option<alhazen::edits::Edited>, LoadError> {
    match &source.place {
        Place::File(path) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) => {
            // Parameters are for what the file declares, and one with a base declares none.
            if source.parameters.is_empty() { open_edited(path, options) } else { Ok(None) }
        }
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait(loading: &Loading) -> Result<Loaded, LoadError> {
        for _ in 0..600 {
            if let Some(finished) = loading.poll() {
                return finished;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("{} does not load", loading.job)
    }

    #[test]
    fn scenes_and_errors_come_back() {
        let load = |name: &str| Loading::start(Job::Open(Source::parse(name)), LoadOptions::default(), || {});
        let Ok(Loaded::Scene(opened)) = wait(&load("cornell")) else { panic!("built in") };
        assert!(!opened.scene.instances.is_empty() && opened.base.edits.is_empty());
        assert!(wait(&load("no/such/file.obj")).is_err());
    }

    #[test]
    fn dark_scenes_get_daylight_as_an_edit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("dark.obj");
        std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
        let job = Job::Open(Source::parse(&path.to_string_lossy()));
        let loading = Loading::start(job, LoadOptions::default(), || {});
        let Ok(Loaded::Scene(opened)) = wait(&loading) else { panic!("a triangle") };
        assert_eq!(opened.scene.environment, Environment::Black);
        assert!(matches!(opened.base.edits.environment, Some(EnvironmentRecord::Sky(_))));
    }

    #[test]
    fn who_gives_up_is_not_disturbed() {
        let (sender, woken) = channel();
        let job = Job::Open(Source::parse("cornell"));
        drop(Loading::start(job, LoadOptions::default(), move || {
            let _ = sender.send(());
        }));
        woken.recv_timeout(Duration::from_secs(30)).expect("the thread ends by itself");
    }
}
