//! Dialogs that ask for a file. They are the desktop's own, and nothing waits for them.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, channel};

/// What a file is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum For {
    /// A scene to open.
    Open,
    /// A model to add.
    Model,
    /// A picture to put around the scene.
    Environment,
    /// A picture to compare with.
    Compare,
    /// The scene is written there.
    Save,
    /// What the window shows is written there.
    Screenshot,
    /// What was rendered is written there.
    Picture,
    /// A sequence is written there.
    Record,
    /// Measurements are written there.
    Statistics,
}

/// A file that the user will have chosen, or none.
type Answering = std::pin::Pin<Box<dyn Future<Output = Option<rfd::FileHandle>> + Send>>;

/// A dialog that is open.
pub struct Dialog {
    pub(super) what: For,
    pub(super) answer: Receiver<Option<PathBuf>>,
}

impl Dialog {
    /// Opens a dialog; `wake` is called when the user has answered.
    pub(super) fn show(what: For, wake: impl Fn() + Send + 'static) -> Self {
        let models = ["obj", "gltf", "glb", "pbrt", "ply", "stl", "toml"];
        let dialog = rfd::AsyncFileDialog::new();
        let (dialog, saves) = match what {
            For::Open | For::Model => (dialog.add_filter("Scenes", &models), false),
            For::Environment => (dialog.add_filter("Panoramas", &["hdr", "exr"]), false),
            For::Compare => (dialog.add_filter("Pictures", &["exr", "png", "hdr"]), false),
            For::Save => (dialog.add_filter("Scene files", &["toml"]).set_file_name("scene.toml"), true),
            For::Screenshot => (dialog.add_filter("PNG", &["png"]).set_file_name("screenshot.png"), true),
            For::Picture => {
                (dialog.add_filter("Pictures", &["exr", "png", "hdr"]).set_file_name("picture.exr"), true)
            }
            For::Record => {
                (dialog.add_filter("Pictures", &["png", "exr"]).set_file_name("frame-####.png"), true)
            }
            For::Statistics => {
                (dialog.add_filter("Tables", &["csv", "json"]).set_file_name("statistics.csv"), true)
            }
        };
        // Some systems want dialogs to be made by the window's thread; waiting may be done by any.
        let future: Answering =
            if saves { Box::pin(dialog.save_file()) } else { Box::pin(dialog.pick_file()) };
        let (sender, answer) = channel();
        let wait = move || {
            let file = pollster::block_on(future).map(|f| f.path().to_owned());
            let _ = sender.send(file);
            wake();
        };
        if let Err(error) = std::thread::Builder::new().name("dialog".into()).spawn(wait) {
            eprintln!("cannot wait for a dialog: {error}");
        }
        Self { what, answer }
    }
}
