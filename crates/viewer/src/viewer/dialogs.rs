//! Dialogs that ask for a file: the desktop's own, where it has any, and else ours
//! ([`crate::browser`]). Nothing waits for them.

use crate::browser::Request;
use alhazen::{MaterialId, TextureSlot};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// What a file is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum For {
    /// A scene to open.
    Open,
    /// A model to add.
    Model,
    /// A picture to put around the scene.
    Environment,
    /// A picture for a texture slot of a material.
    Texture(MaterialId, TextureSlot),
    /// A picture to compare with.
    Compare,
    /// The scene is written there.
    Save,
    /// What the window shows is written there.
    Screenshot,
    /// What was rendered is written there.
    Picture,
    /// A picture is rendered into it.
    Render,
    /// A sequence is written there.
    Record,
    /// Measurements are written there.
    Statistics,
}

impl For {
    /// What the user is asked for.
    pub fn request(self) -> Request {
        const SCENES: &[&str] = &["obj", "gltf", "glb", "pbrt", "ply", "stl", "toml"];
        const TEXTURES: &[&str] =
            &["png", "jpg", "jpeg", "webp", "tga", "bmp", "gif", "dds", "ktx2", "exr", "hdr"];
        const PICTURES: &[&str] = &["exr", "png", "hdr"];
        let reads = |title, kind, endings| Request { title, kind, endings, saves_as: None };
        let saves =
            |title, kind, endings, name| Request { saves_as: Some(name), ..reads(title, kind, endings) };
        match self {
            Self::Open => reads("Open a scene", "Scenes", SCENES),
            Self::Model => reads("Add a model", "Scenes", SCENES),
            Self::Environment => reads("Open an environment", "Panoramas", &["hdr", "exr"]),
            Self::Texture(..) => reads("Choose a picture for the texture", "Pictures", TEXTURES),
            Self::Compare => reads("Compare with a picture", "Pictures", PICTURES),
            Self::Save => saves("Save the scene", "Scene files", &["toml"], "scene.toml"),
            Self::Screenshot => saves("Save a screenshot", "PNG", &["png"], "screenshot.png"),
            Self::Picture => saves("Save the picture", "Pictures", PICTURES, "picture.exr"),
            Self::Render => saves("Render to a file", "Pictures", PICTURES, "render.exr"),
            Self::Record => saves("Record a sequence", "Pictures", &["png", "exr"], "frame-####.png"),
            Self::Statistics => saves("Save measurements", "Tables", &["csv", "json"], "statistics.csv"),
        }
    }
}

/// A file that the user will have chosen, or none.
type Answering = std::pin::Pin<Box<dyn Future<Output = Option<rfd::FileHandle>> + Send>>;

/// Nobody closes a dialog sooner than this: the desktop has shown none. It does not say so itself.
const SOONEST: Duration = Duration::from_millis(300);

/// A dialog of the desktop that is open.
pub struct Dialog {
    pub(super) what: For,
    answer: Receiver<Option<PathBuf>>,
    since: Instant,
}

/// What has come of a dialog of the desktop.
pub(super) enum Answer {
    /// The user has not answered yet.
    Open,
    /// The user has chosen a file, or none.
    Closed(Option<PathBuf>),
    /// There is no such dialog on this system.
    Missing,
}

impl Dialog {
    /// Opens a dialog; `wake` is called when the user has answered.
    pub(super) fn show(what: For, wake: impl Fn() + Send + 'static) -> Self {
        let Request { title, kind, endings, saves_as } = what.request();
        let dialog = rfd::AsyncFileDialog::new().set_title(title).add_filter(kind, endings);
        // Some systems want dialogs to be made by the window's thread; waiting may be done by any.
        let future: Answering = match saves_as {
            Some(name) => Box::pin(dialog.set_file_name(name).save_file()),
            None => Box::pin(dialog.pick_file()),
        };
        let (sender, answer) = channel();
        let wait = move || {
            let file = pollster::block_on(future).map(|f| f.path().to_owned());
            let _ = sender.send(file);
            wake();
        };
        // Without a thread the channel is closed, and the dialog counts as missing.
        let _ = std::thread::Builder::new().name("dialog".into()).spawn(wait);
        Self { what, answer, since: Instant::now() }
    }

    /// What has come of it so far.
    pub(super) fn poll(&self) -> Answer {
        match self.answer.try_recv() {
            Err(TryRecvError::Empty) => Answer::Open,
            Ok(None) if self.since.elapsed() < SOONEST => Answer::Missing,
            Ok(file) => Answer::Closed(file),
            Err(TryRecvError::Disconnected) => Answer::Missing,
        }
    }
}
