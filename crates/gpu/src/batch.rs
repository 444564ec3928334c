//! Batches: what a dispatch works on, some pixels of the window and some samples of each.

/// A part of a pass: some pixels of the window and some samples of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// Which pixels.
    pub pixels: BatchPixels,
    /// First sample. Portions have a first sample each, to which this is added.
    pub first_sample: u32,
    /// Number of samples.
    pub sample_count: u32,
}

/// The pixels of a [`Batch`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BatchPixels {
    /// Rows, counted from the window's top.
    Rows {
        /// The first.
        first: u32,
        /// How many.
        count: u32,
    },
    /// Portions of the pixels' samples ([`FilmBuffers::set_shares`](crate::film::FilmBuffers::set_shares)). Once they are made, [`FilmBuffers::gather`](crate::film::FilmBuffers::gather) adds them to their
    /// pixels.
    Portions {
        /// The first.
        first: u32,
        /// How many: at most [`FilmBuffers::most_portions`](crate::film::FilmBuffers::most_portions).
        count: u32,
        /// Samples of each.
        samples: u32,
    },
}

impl Batch {
    /// Number of pixels, or of portions, in a window of `width` pixels.
    pub fn pixel_count(&self, width: u32) -> u32 {
        match self.pixels {
            BatchPixels::Rows { count, .. } => width * count,
            BatchPixels::Portions { count, .. } => count,
        }
    }
}
