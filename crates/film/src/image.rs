//! Linear pictures in memory.

use std::path::{Path, PathBuf};

/// A picture of `width × height` pixels, row 0 at the top, with interleaved `f32` channels.
///
/// With three channels it is linear RGB with Rec. 709 primaries, scene-referred; with four, alpha (linear coverage in
/// `[0, 1]`) comes last. Other numbers of channels are data whose owner knows what they mean. There is at least one
/// channel; a side may be zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    channels: usize,
    data: Vec<f32>,
}

/// Why an image could not be made, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The number of values does not fit the size.
    #[error("an image of {width}×{height} pixels with {channels} channels cannot hold {values} values")]
    Shape {
        /// Width, in pixels.
        width: u32,
        /// Height, in pixels.
        height: u32,
        /// Number of channels.
        channels: usize,
        /// Number of values that were given.
        values: usize,
    },
    /// The file cannot be opened or read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// What is there is no file, and is not replaced by one.
    #[error("cannot write {}: it is {what}", path.display())]
    NotAFile {
        /// The place.
        path: PathBuf,
        /// What is there.
        what: &'static str,
    },
    /// The file must not be replaced.
    #[error("cannot write {}: {reason}, which would be lost", path.display())]
    Protected {
        /// The file.
        path: PathBuf,
        /// Why it is protected.
        reason: String,
    },
    /// The contents are damaged, or of a kind that is not supported.
    #[error("cannot decode {}: {reason}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The picture cannot be expressed in the file's format.
    #[error("cannot encode {}: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The header promises more pixels than is allowed, or than a file of this length can hold.
    #[error("{}: {width}×{height} pixels with {channels} channels are too many", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Width, in pixels.
        width: u64,
        /// Height, in pixels.
        height: u64,
        /// Number of channels.
        channels: u64,
    },
    /// The file's name or contents belong to no known image format.
    #[error("{}: unknown image format; known are exr, hdr, png and jpeg", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// An EXR file without a colour layer.
    #[error("{}: no colour channels (R, G, B or Y) among: {found}", path.display())]
    NoColour {
        /// The file.
        path: PathBuf,
        /// The names of the channels that it has.
        found: String,
    },
}

impl ImageError {
    /// The file that the error is about, if any.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Shape { .. } => None,
            Self::Read { path, .. }
            | Self::Write { path, .. }
            | Self::NotAFile { path, .. }
            | Self::Protected { path, .. }
            | Self::Decode { path, .. }
            | Self::Encode { path, .. }
            | Self::TooLarge { path, .. }
            | Self::UnknownFormat { path }
            | Self::NoColour { path, .. } => Some(path),
        }
    }
}

impl Image {
    /// A picture of zeros. `channels` zero counts as one.
    #[must_use]
    pub fn black(width: u32, height: u32, channels: usize) -> Self {
        let channels = channels.max(1);
        Self { width, height, channels, data: vec![0.0; width as usize * height as usize * channels] }
    }

    /// A picture from its values: row by row from the top, a pixel's channels together.
    ///
    /// # Errors
    /// [`ImageError::Shape`] if there are not `width × height × channels` values, or no channel.
    pub fn from_data(width: u32, height: u32, channels: usize, data: Vec<f32>) -> Result<Self, ImageError> {
        let expected = (width as usize * height as usize).checked_mul(channels);
        if channels == 0 || expected != Some(data.len()) {
            return Err(ImageError::Shape { width, height, channels, values: data.len() });
        }
        Ok(Self { width, height, channels, data })
    }

    /// An RGB picture from a function of column and row.
    #[must_use]
    pub fn from_fn(width: u32, height: u32, mut rgb: impl FnMut(u32, u32) -> [f32; 3]) -> Self {
        let mut image = Self::black(width, height, 3);
        let columns = width.max(1) as usize;
        for (i, out) in image.data.chunks_exact_mut(3).enumerate() {
            out.copy_from_slice(&rgb((i % columns) as u32, (i / columns) as u32));
        }
        image
    }

    /// Width, in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height, in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Number of channels, at least one.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// All values: row by row from the top, a pixel's channels together.
    #[must_use]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// As [`Image::data`], to change them in place.
    #[must_use]
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// All values, taken out of the picture.
    #[must_use]
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// The channels of the pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// If the pixel lies outside the picture.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> &[f32] {
        assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) lies outside {}×{}",
            self.width,
            self.height
        );
        let start = (y as usize * self.width as usize + x as usize) * self.channels;
        &self.data[start..start + self.channels]
    }

    /// The first three channels of the pixel in column `x` and row `y`; with one or two channels, the first three
    /// times.
    ///
    /// # Panics
    /// If the pixel lies outside the picture.
    #[must_use]
    pub fn rgb(&self, x: u32, y: u32) -> [f32; 3] {
        as_rgb(self.pixel(x, y))
    }

    /// The picture with three channels (see [`Image::rgb`]).
    #[must_use]
    pub fn to_rgb(&self) -> Self {
        if self.channels == 3 {
            return self.clone();
        }
        let data = self.data.chunks_exact(self.channels).flat_map(as_rgb).collect();
        Self { width: self.width, height: self.height, channels: 3, data }
    }

    /// The part of the picture of `width × height` pixels whose top left pixel is (`x`, `y`); what reaches beyond the
    /// picture is cut off.
    #[must_use]
    pub fn crop(&self, x: u32, y: u32, width: u32, height: u32) -> Self {
        let (x, y) = (x.min(self.width), y.min(self.height));
        let (width, height) = (width.min(self.width - x), height.min(self.height - y));
        let mut data = Vec::with_capacity(width as usize * height as usize * self.channels);
        for row in y..y + height {
            let start = (row as usize * self.width as usize + x as usize) * self.channels;
            data.extend_from_slice(&self.data[start..start + width as usize * self.channels]);
        }
        Self { width, height, channels: self.channels, data }
    }

    /// The picture with `f` applied to every value.
    #[must_use]
    pub fn map(&self, f: impl FnMut(f32) -> f32) -> Self {
        Self { data: self.data.iter().copied().map(f).collect(), ..*self }
    }

    /// The mean of each channel over all pixels; zeros for an empty picture.
    #[must_use]
    pub fn mean(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.channels];
        for pixel in self.data.chunks_exact(self.channels) {
            sums.iter_mut().zip(pixel).for_each(|(s, &v)| *s += f64::from(v));
        }
        let pixels = (self.data.len() / self.channels).max(1) as f64;
        sums.iter().map(|s| s / pixels).collect()
    }
}

fn as_rgb(pixel: &[f32]) -> [f32; 3] {
    match *pixel {
        [r, g, b, ..] => [r, g, b],
        [v, ..] => [v; 3],
        [] => [0.0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_run_down_and_columns_to_the_right() {
        let image = Image::from_fn(3, 2, |x, y| [x as f32, y as f32, 9.0]);
        assert_eq!(image.pixel(2, 1), [2.0, 1.0, 9.0]);
        assert_eq!(image.data()[..6], [0.0, 0.0, 9.0, 1.0, 0.0, 9.0]);
        assert_eq!(image.mean(), [1.0, 0.5, 9.0]);
    }

    #[test]
    fn crops_are_cut_off_at_the_border() {
        let image = Image::from_fn(4, 3, |x, y| [x as f32, y as f32, 0.0]);
        let crop = image.crop(2, 1, 10, 1);
        assert_eq!((crop.width(), crop.height()), (2, 1));
        assert_eq!(crop.data(), [2.0, 1.0, 0.0, 3.0, 1.0, 0.0]);
        assert!(image.crop(9, 9, u32::MAX, u32::MAX).data().is_empty());
    }

    #[test]
    fn wrong_numbers_of_values_are_errors() {
        assert!(Image::from_data(2, 2, 3, vec![0.0; 11]).is_err());
        assert!(Image::from_data(2, 2, 0, vec![]).is_err());
        assert!(Image::from_data(u32::MAX, u32::MAX, usize::MAX, vec![]).is_err());
        assert!(Image::from_data(2, 2, 1, vec![0.5; 4]).unwrap().to_rgb().data().iter().all(|&v| v == 0.5));
    }
}
