//! The interactive window: a scene that can be looked at and changed while it is rendered.
//!
//! Three kinds of threads work together. The window's thread draws panels and shows pictures; it never waits. The render
//! thread owns the renderer ([`worker`]). Loading ([`loading`]) and ray queries ([`queries`]) have threads of their own. All
//! state that is not the window's is in [`viewer`] and can be tested without one.

#![forbid(unsafe_code)]
#![allow(clippy::disallowed_methods, reason = "what is on screen; pictures get numbers that the user chose")]

pub mod analysis;
pub mod browser;
pub mod clock;
pub mod document;
pub mod exr_layers;
pub mod gizmo;
pub mod history;
pub mod integrators;
pub mod loading;
pub mod node_previews;
pub mod numbers;
pub mod outliner;
pub mod panels;
pub mod presets;
pub mod queries;
pub mod remaining;
pub mod render_settings;
pub mod settings;
pub mod smoke;
pub mod statistics;
mod text_file;
pub mod thumbnails;
pub mod viewer;
pub mod viewport;
pub mod watch;
mod window;
pub mod worker;

pub use window::{Options, PlainWindow, SurfaceError, ViewerError, run};

/// Whether there is a display that a window could be opened on.
pub fn has_display() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    if cfg!(any(windows, target_os = "macos")) {
        // Who comes from afar sees no window.
        return !set("SSH_CONNECTION");
    }
    set("WAYLAND_DISPLAY") || set("WAYLAND_SOCKET") || set("DISPLAY")
}
