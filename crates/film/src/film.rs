//! The film: one estimate per pixel and the auxiliary layers that were asked for.

use crate::{Aov, AovKind, AovSample, AovSums, ExactSum, Image, NO_ID, PixelStats, Rect};
use id_counts::IdCounts;
pub use id_counts::IdShares;
use rayon::prelude::*;

/// The largest width or height of a film or an image file, in pixels.
pub const MAX_SIDE: u32 = 65_536;

/// The largest number of pixels of a film.
const MAX_PIXELS: u64 = 1 << 30;

/// Why a film could not be made or merged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// Neither side may be zero or above [`MAX_SIDE`], and the number of pixels is limited to 2³⁰.
    #[error(
        "a film of {width}×{height} pixels is not possible: each side must be 1 to {MAX_SIDE}, \
             with at most {MAX_PIXELS} pixels"
    )]
    Size {
        /// Width that was asked for.
        width: u32,
        /// Height that was asked for.
        height: u32,
    },
    /// The window is empty or reaches beyond the picture.
    #[error("the window {window:?} is empty or does not lie within {width}×{height} pixels")]
    Window {
        /// The window that was asked for.
        window: Rect,
        /// Width of the whole picture.
        width: u32,
        /// Height of the whole picture.
        height: u32,
    },
    /// There is not enough memory for the film.
    #[error("not enough memory for a film of {pixels} pixels")]
    Memory {
        /// Number of pixels of the window.
        pixels: usize,
    },
    /// The films to be merged are parts of pictures of different sizes.
    #[error("cannot merge a film of {other:?} pixels into one of {this:?}")]
    SizeMismatch {
        /// Width and height of the film that was to grow.
        this: (u32, u32),
        /// Width and height of the film that was to be added.
        other: (u32, u32),
    },
    /// The film to be added covers pixels that the other does not have.
    #[error("cannot merge a film of {other:?} into one of only {this:?}")]
    WindowMismatch {
        /// Window of the film that was to grow.
        this: Rect,
        /// Window of the film that was to be added.
        other: Rect,
    },
    /// The films have different auxiliary layers.
    #[error("cannot merge a film with layers {other:?} into one with {this:?}")]
    AovMismatch {
        /// Layers of the film that was to grow.
        this: Vec<Aov>,
        /// Layers of the film that was to be added.
        other: Vec<Aov>,
    },
}

/// One stored auxiliary layer: `channels × width × height` numbers, a pixel's channels together.
#[derive(Clone, Debug, PartialEq)]
enum Layer {
    Mean(Vec<ExactSum>),
    /// [`UNSET`] where sample 0 has not come yet.
    First(Vec<f32>),
    /// [`NO_ID`] where sample 0 has not come yet or hit nothing.
    FirstId(Vec<u32>),
    /// A pixel's samples by what they saw.
    Shares(Vec<IdCounts>),
    Derived,
}

/// Marks a value that has not come yet. No sample can have it, and unlike NaN it equals itself.
const UNSET: f32 = f32::INFINITY;

/// The values of an auxiliary layer.
#[derive(Clone, Debug, PartialEq)]
pub enum AovData {
    /// As many channels as [`Aov::channels`] has.
    Float(Image),
    /// One whole number a pixel, row by row from the top.
    Integer(Vec<u32>),
    /// The ids that a pixel shows, in their order, and what share of its samples each has; row by row from the top. Samples
    /// that hit nothing are no one's share.
    Shares(Vec<IdShares>),
}

/// What a render has learned so far: for each pixel the sums from which mean and standard error follow
/// ([`PixelStats`]), and the auxiliary layers that were asked for.
///
/// A film covers a *window* of a picture: all of it, a crop, or a tile. Splitting a render into films by tile or by
/// range of samples, and merging them in any order, gives the same bits as one film made whole, as long as every
/// sample is added once.
///
/// A back end typically makes a small film per tile with [`Film::tile`], fills it without locks, and merges it.
/// A pixel takes 112 bytes, plus 16 a channel for mean layers, 32 for a matte (more where it shows several things) and 4 a
/// channel for the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    window: Rect,
    pixels: Vec<PixelStats>,
    aovs: Vec<Aov>,
    layers: Vec<Layer>,
    /// Samples per pixel in the mean layers and mattes; empty when there are none.
    aov_counts: Vec<u32>,
    invalid_aovs: u64,
}

impl Film {
    /// An empty film for a whole picture, without auxiliary layers.
    ///
    /// # Errors
    /// [`FilmError::Size`] or [`FilmError::Memory`].
    pub fn new(width: u32, height: u32) -> Result<Self, FilmError> {
        Self::with_window(width, height, Rect::full(width, height), &[])
    }

    /// An empty film for the part `window` of a picture of `width` × `height` pixels, with the layers `aovs`
    /// (doubles are ignored).
    ///
    /// # Errors
    /// [`FilmError::Size`], [`FilmError::Window`] or [`FilmError::Memory`].
    pub fn with_window(width: u32, height: u32, window: Rect, aovs: &[Aov]) -> Result<Self, FilmError> {
        let sides = 1..=MAX_SIDE;
        if !sides.contains(&width)
            || !sides.contains(&height)
            || u64::from(width) * u64::from(height) > MAX_PIXELS
        {
            return Err(FilmError::Size { width, height });
        }
        if window.area() == 0 || !Rect::full(width, height).contains_rect(&window) {
            return Err(FilmError::Window { window, width, height });
        }
        let mut unique = Vec::new();
        for &aov in aovs {
            if !unique.contains(&aov) {
                unique.push(aov);
            }
        }
        let area = window.area();
        let layers = unique
            .iter()
            .map(|aov| {
                let n = area * aov.channels().len();
                Ok(match aov.kind() {
                    AovKind::Mean => Layer::Mean(filled(n, ExactSum::ZERO, area)?),
                    AovKind::First => Layer::First(filled(n, UNSET, area)?),
                    AovKind::FirstId => Layer::FirstId(filled(n, NO_ID, area)?),
                    AovKind::Shares => Layer::Shares(filled(area, IdCounts::default(), area)?),
                    AovKind::Derived => Layer::Derived,
                })
            })
            .collect::<Result<Vec<_>, FilmError>>()?;
        let is_counted = unique.iter().any(|a| matches!(a.kind(), AovKind::Mean | AovKind::Shares));
        Ok(Self {
            width,
            height,
            window,
            pixels: filled(area, PixelStats::default(), area)?,
            aovs: unique,
            layers,
            aov_counts: filled(if is_counted { area } else { 0 }, 0, area)?,
            invalid_aovs: 0,
        })
    }

    /// An empty film for the part `window` of the same picture, with the same layers.
    ///
    /// # Errors
    /// [`FilmError::Window`] or [`FilmError::Memory`].
    pub fn tile(&self, window: Rect) -> Result<Self, FilmError> {
        Self::with_window(self.width, self.height, window, &self.aovs)
    }

    /// Width of the whole picture, in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of the whole picture, in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The part of the picture that this film covers.
    #[must_use]
    pub fn window(&self) -> Rect {
        self.window
    }

    /// The auxiliary layers that a back end should fill, and those that follow from the colour.
    #[must_use]
    pub fn aovs(&self) -> &[Aov] {
        &self.aovs
    }

    /// Whether [`Film::add_aovs`] would keep anything.
    #[must_use]
    pub fn wants_aovs(&self) -> bool {
        self.aovs.iter().any(|a| a.kind() != AovKind::Derived)
    }

    /// Forgets all samples; size, window and layers stay.
    pub fn clear(&mut self) {
        // Films are large: one thread writes slower than memory takes it.
        self.pixels.par_chunks_mut(1 << 14).for_each(|pixels| pixels.fill(PixelStats::default()));
        self.aov_counts.fill(0);
        self.invalid_aovs = 0;
        for layer in &mut self.layers {
            match layer {
                Layer::Mean(sums) => sums.fill(ExactSum::ZERO),
                Layer::First(values) => values.fill(UNSET),
                Layer::FirstId(ids) => ids.fill(NO_ID),
                Layer::Shares(pixels) => pixels.fill(IdCounts::default()),
                Layer::Derived => {}
            }
        }
    }

    /// The estimates of the window's pixels, row by row from the top.
    #[must_use]
    pub fn pixels(&self) -> &[PixelStats] {
        &self.pixels
    }

    /// As [`Film::pixels`], to add samples in place.
    #[must_use]
    pub fn pixels_mut(&mut self) -> &mut [PixelStats] {
        &mut self.pixels
    }

    /// The estimate of pixel (`x`, `y`) of the whole picture, or `None` outside the window.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> Option<&PixelStats> {
        self.index(x, y).map(|i| &self.pixels[i])
    }

    /// Adds one colour sample (linear RGB radiance) to pixel (`x`, `y`) of the whole picture.
    ///
    /// Returns `false` when the sample was dropped and counted as invalid (see [`PixelStats::add`]).
    ///
    /// # Panics
    /// If the pixel lies outside the window.
    #[inline]
    pub fn add(&mut self, x: u32, y: u32, rgb: [f32; 3]) -> bool {
        let i = self.index_in_window(x, y);
        self.pixels[i].add(rgb)
    }

    /// Adds the samples in `stats` to pixel (`x`, `y`) of the whole picture.
    ///
    /// # Panics
    /// If the pixel lies outside the window.
    #[inline]
    pub fn add_stats(&mut self, x: u32, y: u32, stats: &PixelStats) {
        let i = self.index_in_window(x, y);
        self.pixels[i].merge(stats);
    }

    /// Adds what sample number `sample` of pixel (`x`, `y`) saw to the auxiliary layers. Call it once for every
    /// sample, those that hit nothing included; layers of kind [`AovKind::First`] use sample 0 only.
    ///
    /// Values that are not finite are dropped and counted, see [`Film::invalid_aovs`].
    ///
    /// # Panics
    /// If the pixel lies outside the window.
    pub fn add_aovs(&mut self, x: u32, y: u32, sample: u64, values: &AovSample) {
        let i = self.index_in_window(x, y);
        if let Some(count) = self.aov_counts.get_mut(i) {
            *count += 1;
        }
        for (&aov, layer) in self.aovs.iter().zip(&mut self.layers) {
            let channels = values.values(aov);
            let invalid = channels
                .iter()
                .any(|v| v.abs().partial_cmp(&PixelStats::MAX_SAMPLE).is_none_or(|o| o.is_gt()));
            if invalid {
                self.invalid_aovs += 1;
                continue;
            }
            let at = i * aov.channels().len();
            match layer {
                Layer::Mean(sums) => {
                    for (sum, &v) in sums[at..].iter_mut().zip(channels) {
                        *sum += ExactSum::from_f64(f64::from(v));
                    }
                }
                Layer::First(stored) if sample == 0 => {
                    stored[at..at + channels.len()].copy_from_slice(channels)
                }
                Layer::FirstId(ids) if sample == 0 => ids[i] = values.id(aov).unwrap_or(NO_ID),
                Layer::Shares(pixels) => {
                    if let Some(id) = values.id(aov).filter(|&id| id != NO_ID) {
                        pixels[i].add(id, 1);
                    }
                }
                Layer::First(_) | Layer::FirstId(_) | Layer::Derived => {}
            }
        }
    }

    /// Adds samples of which only the sums are known to the auxiliary layers of pixel (`x`, `y`) of the whole picture.
    ///
    /// Sums that are not finite are dropped and counted, see [`Film::invalid_aovs`]. Of mattes no sums are known: who has
    /// only these cannot fill them.
    ///
    /// # Panics
    /// If the pixel lies outside the window.
    pub fn add_aov_sums(&mut self, x: u32, y: u32, sums: &AovSums) {
        let i = self.index_in_window(x, y);
        if let Some(count) = self.aov_counts.get_mut(i) {
            *count += sums.count;
        }
        for (&aov, layer) in self.aovs.iter().zip(&mut self.layers) {
            let at = i * aov.channels().len();
            match (layer, sums.sums(aov), &sums.first) {
                (Layer::Mean(stored), Some(added), _) => {
                    if added.iter().all(|v| v.is_finite()) {
                        let stored = stored[at..].iter_mut().zip(added);
                        stored.for_each(|(sum, &v)| *sum += ExactSum::from_f64(v));
                    } else {
                        self.invalid_aovs += u64::from(sums.count);
                    }
                }
                (Layer::First(stored), _, Some(first)) => {
                    let channels = first.values(aov);
                    if channels.iter().all(|v| v.abs() <= PixelStats::MAX_SAMPLE) {
                        stored[at..at + channels.len()].copy_from_slice(channels);
                    } else {
                        self.invalid_aovs += 1;
                    }
                }
                (Layer::FirstId(ids), _, Some(first)) => ids[i] = first.id(aov).unwrap_or(NO_ID),
                (
                    Layer::Mean(_) | Layer::First(_) | Layer::FirstId(_) | Layer::Shares(_) | Layer::Derived,
                    _,
                    _,
                ) => {}
            }
        }
    }

    /// Counts auxiliary values as invalid that something else has already dropped.
    pub fn add_invalid_aovs(&mut self, count: u64) {
        self.invalid_aovs += count;
    }

    /// Adds the samples of `other`, whose window must lie within this film's.
    ///
    /// The order of merges does not matter. Samples that are in both are counted twice: who splits a render must
    /// split it into parts that have no sample in common.
    ///
    /// # Errors
    /// [`FilmError::SizeMismatch`], [`FilmError::WindowMismatch`] or [`FilmError::AovMismatch`]; the film is then
    /// unchanged.
    pub fn merge(&mut self, other: &Self) -> Result<(), FilmError> {
        let sizes = [(self.width, self.height), (other.width, other.height)];
        if sizes[0] != sizes[1] {
            return Err(FilmError::SizeMismatch { this: sizes[0], other: sizes[1] });
        }
        if !self.window.contains_rect(&other.window) {
            return Err(FilmError::WindowMismatch { this: self.window, other: other.window });
        }
        if self.aovs != other.aovs {
            return Err(FilmError::AovMismatch { this: self.aovs.clone(), other: other.aovs.clone() });
        }
        self.invalid_aovs += other.invalid_aovs;
        let width = other.window.width as usize;
        for row in 0..other.window.height {
            let to = self.index_in_window(other.window.x, other.window.y + row);
            let from = row as usize * width;
            let pixels = &other.pixels[from..from + width];
            self.pixels[to..to + width].iter_mut().zip(pixels).for_each(|(a, b)| a.merge(b));
            if !self.aov_counts.is_empty() {
                let counts = &other.aov_counts[from..from + width];
                self.aov_counts[to..to + width].iter_mut().zip(counts).for_each(|(a, b)| *a += b);
            }
            for ((aov, layer), added) in self.aovs.iter().zip(&mut self.layers).zip(&other.layers) {
                let n = if aov.kind() == AovKind::Shares { 1 } else { aov.channels().len() };
                layer.merge_run(to * n, added, from * n, width * n);
            }
        }
        Ok(())
    }

    /// The number of samples that were dropped as NaN, infinite or absurdly large.
    #[must_use]
    pub fn invalid_samples(&self) -> u64 {
        self.pixels.iter().map(PixelStats::invalid).sum()
    }

    /// The number of auxiliary values (one a layer and sample) that were dropped as NaN, infinite or absurdly large.
    #[must_use]
    pub fn invalid_aovs(&self) -> u64 {
        self.invalid_aovs
    }

    /// The number of valid samples of all pixels together.
    #[must_use]
    pub fn total_samples(&self) -> u64 {
        self.pixels.iter().map(PixelStats::count).sum()
    }

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        let w = &self.window;
        w.contains(x, y).then(|| (y - w.y) as usize * w.width as usize + (x - w.x) as usize)
    }

    #[inline]
    fn index_in_window(&self, x: u32, y: u32) -> usize {
        let Some(i) = self.index(x, y) else { panic!("pixel ({x}, {y}) lies outside {:?}", self.window) };
        i
    }
}

impl Layer {
    /// Merges `n` numbers of `other`, from index `from` on, into this layer, from index `to` on.
    fn merge_run(&mut self, to: usize, other: &Self, from: usize, n: usize) {
        match (self, other) {
            (Self::Mean(a), Self::Mean(b)) => {
                a[to..to + n].iter_mut().zip(&b[from..from + n]).for_each(|(a, b)| *a += *b);
            }
            (Self::First(a), Self::First(b)) => {
                let pairs = a[to..to + n].iter_mut().zip(&b[from..from + n]);
                pairs.filter(|(a, _)| **a == UNSET).for_each(|(a, b)| *a = *b);
            }
            (Self::FirstId(a), Self::FirstId(b)) => {
                let pairs = a[to..to + n].iter_mut().zip(&b[from..from + n]);
                pairs.filter(|(a, _)| **a == NO_ID).for_each(|(a, b)| *a = *b);
            }
            (Self::Shares(a), Self::Shares(b)) => {
                a[to..to + n].iter_mut().zip(&b[from..from + n]).for_each(|(a, b)| a.merge(b));
            }
            // Layers come from equal lists of AOVs, so the kinds are equal, and derived ones have nothing to add.
            (Self::Mean(_) | Self::First(_) | Self::FirstId(_) | Self::Shares(_) | Self::Derived, _) => {}
        }
    }
}

/// A vector of `n` equal values, or an error instead of an abort when memory is short.
///
/// All threads write it: the first touch of a page of memory is what takes time.
fn filled<T: Clone + Send + Sync>(n: usize, value: T, pixels: usize) -> Result<Vec<T>, FilmError> {
    let mut vec = Vec::new();
    vec.try_reserve_exact(n).map_err(|_| FilmError::Memory { pixels })?;
    vec.par_extend(rayon::iter::repeat_n(value, n));
    Ok(vec)
}

mod estimates;
mod id_counts;
mod state;
#[cfg(test)]
mod tests;
