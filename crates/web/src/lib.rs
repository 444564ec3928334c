//! The renderer in a web page: what the page's worker calls.
//!
//! [`Session`] is a scene, a camera and a picture in progress, without a browser: tests run it as any other code. In
//! browsers, `bindings` hands it to JavaScript. The page itself is in `page/` (docs/web.md).
//!
//! The CPU back end renders, as everywhere: the samples of `alhazen render --backend cpu`, but for the rounding of rays.

#![forbid(unsafe_code)]

#[cfg(target_family = "wasm")]
mod bindings;
mod explanation;
mod picture;
mod progressive;
mod session;
mod settings;

pub use explanation::Explanation;
pub use picture::Shown;
pub use progressive::Progressive;
pub use session::{Gesture, Opened, Session, SessionError, scenes};
pub use settings::{Setting, SettingError};
