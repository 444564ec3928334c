//! What a render leaves behind: accumulated estimates, auxiliary pictures, image files and error metrics.
//!
//! Start at [`Film`]. A back end adds samples to it, [`Film::to_image`] turns it into a linear [`Image`], and
//! [`ExrFile`] writes it with every layer. [`metrics`] says how far two images are apart.
//!
//! Invariant: this crate knows no scene and no back end. Numbers come in, numbers and files go out.
//!
//! Every picture here is row 0 at the top, linear, scene-referred, Rec. 709 primaries unless it says otherwise.

#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the standard library"))]
#![forbid(unsafe_code)]

mod allocation;
mod aov;
mod atomic;
mod coverage;
mod exact;
mod exr_file;
mod file_name;
mod files;
mod film;
mod flip;
mod image;
mod limits;
mod merge;
pub mod metrics;
mod part;
mod pixel;
mod rect;
mod srgb;

pub use allocation::Allocation;
pub use aov::{Aov, AovKind, AovSample, AovSums, NO_ID, UnknownAov};
pub use atomic::{ProtectedFiles, prove_writable, remove_temporaries, write_atomically};
pub use coverage::{Block, Coverage, UnknownBlock};
pub use exact::ExactSum;
pub use exr_file::{
    CRYPTOMATTE_RANKS, ExrCamera, ExrChannel, ExrCompression, ExrFile, ExrMatrix, ExrPicture, ExrSamples,
    METADATA_PREFIX, Precision, Primaries, cryptomatte_hash, plain_name,
};
pub use files::write_png;
pub use film::{AovData, Film, FilmError, IdShares, MAX_SIDE};
pub use image::{Image, ImageError};
pub use merge::Merger;
pub use part::{Part, PartError};
pub use pixel::PixelStats;
pub use rect::Rect;
pub use srgb::{linear_to_srgb, srgb_to_linear, to_u8};
