//! Files for pbrt-v3, whose directives look alike and mean other things.

use crate::LoadError;

/// What is said of such a file.
pub(super) const NOTE: &str = "the file is written for pbrt-v3, of which only what pbrt-v4 has, too, is read: \
                               `pbrt --upgrade` makes pbrt-v4 of it";

/// What pbrt-v4 has under another name or not at all.
const ONLY_3: [&str; 16] = [
    "Film \"image\"",
    "Material \"matte\"",
    "Material \"plastic\"",
    "Material \"uber\"",
    "Material \"substrate\"",
    "Material \"translucent\"",
    "Material \"glass\"",
    "Material \"mirror\"",
    "Material \"metal\"",
    "Material \"disney\"",
    "\"string type\" \"matte\"",
    "\"point P\"",
    "\"string mapname\"",
    "SurfaceIntegrator \"",
    "VolumeIntegrator \"",
    "Renderer \"",
];

/// Whether a scene is written for pbrt-v3 (or older).
pub(super) fn is_3(text: &[u8]) -> bool {
    ONLY_3.iter().any(|words| memchr::memmem::find(text, words.as_bytes()).is_some())
}

/// The error with what is behind it.
pub(super) fn explain(error: LoadError) -> LoadError {
    match error {
        LoadError::Malformed { path, object, message } => {
            LoadError::Malformed { path, object, message: format!("{message}; {NOTE}") }
        }
        other => other,
    }
}
