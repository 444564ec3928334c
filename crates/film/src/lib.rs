//! What a render leaves behind: accumulated estimates, auxiliary pictures, image files and error metrics.
//!
//! Start at [`Film`]. A back end adds samples to it, [`Film::to_image`] turns it into a linear [`Image`], and
//! [`ExrFile`] writes it with every layer.
//!
//! Invariant: this crate knows no scene and no back end. Numbers come in, numbers and files go out.
//!
//! Every picture here is row 0 at the top, linear, scene-referred, Rec. 709 primaries unless it says otherwise.

mod aov;
mod exact;
mod film;
mod image;
mod pixel;

pub use aov::{Aov, AovKind, AovSample, NO_ID, UnknownAov};
pub use exact::ExactSum;
pub use film::{AovData, Film, FilmError, MAX_SIDE, Rect};
pub use image::{Image, ImageError};
pub use pixel::PixelStats;
