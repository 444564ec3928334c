//! OpenEXR files: colour and auxiliary layers, with settings as text.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::prelude as ex;
use exr::prelude::{ReadChannels as _, ReadLayers as _, WritableImage as _};

use crate::atomic::write_atomically;
use crate::image::ImageError;
use crate::limits;
use crate::{AovData, AovKind, Film, Image, Rect};

mod camera;
mod cryptomatte;
mod picture;
mod primaries;
mod windows;

pub use camera::{ExrCamera, ExrMatrix};
pub use cryptomatte::{CRYPTOMATTE_RANKS, cryptomatte_hash};
pub use picture::{ExrPicture, plain_name};
pub use primaries::Primaries;

/// What the keys of [`ExrFile::metadata`] are called in the file: this, then the key. It keeps them apart from the
/// attributes that the format itself defines.
pub const METADATA_PREFIX: &str = "alhazen:";

/// How floating-point channels are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits: three significant digits, up to 65504. What is beyond is set to ±65504, and their number is noted
    /// in the metadata as `half-clamped`.
    #[default]
    Half,
    /// 32 bits: all that there is.
    Float,
}

/// How an EXR file is compressed. All of these are lossless.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrCompression {
    /// Not at all.
    None,
    /// Run lengths: fast, good for flat pictures.
    Rle,
    /// Deflate in blocks of 16 rows: the most widely supported.
    #[default]
    Zip,
    /// Wavelets: best for noisy pictures.
    Piz,
}

/// The values of one channel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum ExrSamples {
    /// Numbers that are stored with 16 bits.
    Half(Vec<f32>),
    /// Numbers that are stored with 32 bits.
    Float(Vec<f32>),
    /// Whole numbers.
    Uint(Vec<u32>),
}

/// One channel: `R`, `G` or `B` for colour, `layer.channel` for everything else, for example `normal.X`.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrChannel {
    /// Full name.
    pub name: String,
    /// As many values as the file's window has pixels.
    pub samples: ExrSamples,
}

/// The contents of an OpenEXR file: one part with any number of named channels of equal size.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrFile {
    /// Width of the whole picture, in pixels (the display window).
    pub width: u32,
    /// Height of the whole picture, in pixels (the display window).
    pub height: u32,
    /// Left edge of the stored pixels within the whole picture. May be outside in files made by others.
    pub x: i32,
    /// Top edge of the stored pixels within the whole picture.
    pub y: i32,
    /// Number of stored columns (the data window).
    pub data_width: u32,
    /// Number of stored rows (the data window).
    pub data_height: u32,
    /// The channels; the order does not matter.
    pub channels: Vec<ExrChannel>,
    /// Settings as text: see [`METADATA_PREFIX`].
    pub metadata: BTreeMap<String, String>,
    /// Texts under names that other programs have given them, without [`METADATA_PREFIX`].
    pub attributes: BTreeMap<String, String>,
    /// The camera that made the picture, if the file says.
    pub camera: Option<ExrCamera>,
    /// See [`ExrFile::primaries`].
    primaries: Option<Primaries>,
}

impl ExrFile {
    /// A file that stores the part `window` of a picture of `width` × `height` pixels; no channels yet.
    #[must_use]
    pub fn new(width: u32, height: u32, window: Rect) -> Self {
        Self {
            width,
            height,
            x: i32::try_from(window.x).unwrap_or(i32::MAX),
            y: i32::try_from(window.y).unwrap_or(i32::MAX),
            data_width: window.width,
            data_height: window.height,
            channels: Vec::new(),
            metadata: BTreeMap::new(),
            attributes: BTreeMap::new(),
            camera: None,
            primaries: None,
        }
    }

    /// A file with the colour of `image`: channels R, G, B and, if there is a fourth, A.
    #[must_use]
    pub fn from_image(image: &Image, precision: Precision) -> Self {
        let mut file = Self::new(image.width(), image.height(), Rect::full(image.width(), image.height()));
        file.push_colour(image, precision);
        file
    }

    /// A file with the film's colour and all its layers. `precision` is for colour; depth, position and texture
    /// coordinates are always stored with 32 bits, ids and counts as whole numbers, the others with 16 bits.
    #[must_use]
    pub fn from_film(film: &Film, precision: Precision) -> Self {
        let mut file = Self::new(film.width(), film.height(), film.window());
        file.push_colour(&film.to_image(), precision);
        file.push_aovs(film);
        file
    }

    /// Adds `image`, which must have the size of the window, as the colour: R, G, B and, if there is a fourth
    /// channel, A.
    pub fn push_colour(&mut self, image: &Image, precision: Precision) {
        if image.channels() >= 4 {
            self.push_layer("", &["R", "G", "B", "A"], image, precision);
        } else {
            self.push_layer("", &["R", "G", "B"], &image.to_rgb(), precision);
        }
    }

    /// Adds all auxiliary layers of `film`, which must have the window of this file, but its mattes, which need names:
    /// [`ExrFile::push_cryptomatte`].
    pub fn push_aovs(&mut self, film: &Film) {
        for &aov in film.aovs() {
            match film.aov(aov) {
                Some(AovData::Float(image)) => {
                    // Means are of numbers up to 1.
                    let is_mean = aov.kind() == AovKind::Mean;
                    let precision = if is_mean { Precision::Half } else { Precision::Float };
                    self.push_layer(aov.name(), aov.channels(), &image, precision);
                }
                Some(AovData::Integer(values)) => self.channels.push(ExrChannel {
                    name: format!("{}.{}", aov.name(), aov.channels()[0]),
                    samples: ExrSamples::Uint(values),
                }),
                Some(AovData::Shares(_)) | None => {}
            }
        }
    }

    /// Adds the first channels of `image`, which must have the size of the window, as `layer.channel` for each
    /// of `channels`; the layer called `""` has no prefix.
    pub fn push_layer(&mut self, layer: &str, channels: &[&str], image: &Image, precision: Precision) {
        for (c, channel) in channels.iter().enumerate().take(image.channels()) {
            let name = if layer.is_empty() { (*channel).to_owned() } else { format!("{layer}.{channel}") };
            let values: Vec<f32> = image.data().iter().skip(c).step_by(image.channels()).copied().collect();
            let samples = match precision {
                Precision::Half => ExrSamples::Half(values),
                Precision::Float => ExrSamples::Float(values),
            };
            self.channels.push(ExrChannel { name, samples });
        }
    }

    /// Sets the setting `key` to `value`.
    #[must_use]
    pub fn with_metadata(mut self, key: impl Into<String>, value: impl Into<String>) -> Self {
        self.metadata.insert(key.into(), value.into());
        self
    }

    /// The channels of the layer called `layer` as a picture, in alphabetical order of their names but with colours
    /// as R, G, B, A. The layer called `""` is all that have no prefix. Whole numbers are rounded to `f32`.
    #[must_use]
    pub fn layer(&self, layer: &str) -> Option<Image> {
        let mut found: Vec<(&str, &ExrSamples)> = self
            .channels
            .iter()
            .filter_map(|c| {
                let (prefix, name) = c.name.rsplit_once('.').unwrap_or(("", &c.name));
                (prefix == layer).then_some((name, &c.samples))
            })
            .collect();
        let rank = |name: &str| "RGBA".find(name).unwrap_or(4);
        found.sort_by_key(|&(name, _)| (rank(name), name));
        self.interleave(&found.into_iter().map(|(_, samples)| samples).collect::<Vec<_>>())
    }

    /// The stored pixels of the picture as the file has them: see [`ExrFile::picture_layer`].
    #[must_use]
    pub fn colour(&self) -> Option<Image> {
        self.picture_layer().map(|(_, image)| image)
    }

    fn interleave(&self, channels: &[&ExrSamples]) -> Option<Image> {
        if channels.is_empty() {
            return None;
        }
        let mut image = Image::black(self.data_width, self.data_height, channels.len());
        for (c, samples) in channels.iter().enumerate() {
            let out = image.data_mut().iter_mut().skip(c).step_by(channels.len());
            match samples {
                ExrSamples::Half(v) | ExrSamples::Float(v) => out.zip(v).for_each(|(o, &v)| *o = v),
                ExrSamples::Uint(v) => out.zip(v).for_each(|(o, &v)| *o = v as f32),
            }
        }
        Some(image)
    }

    /// Writes the file: complete, or not at all (see [`write_atomically`]).
    ///
    /// # Errors
    /// [`ImageError::Write`], or [`ImageError::Encode`] if there is no channel, two have the same name, one does
    /// not have as many values as the window has pixels, or a name is empty, longer than 255 bytes or contains NUL.
    pub fn write(&self, path: &Path, compression: ExrCompression) -> Result<(), ImageError> {
        self.clone().write_once(path, compression)
    }

    /// As [`ExrFile::write`], for a file that is needed no more: without a copy of its channels.
    ///
    /// # Errors
    /// As [`ExrFile::write`].
    pub fn write_once(self, path: &Path, compression: ExrCompression) -> Result<(), ImageError> {
        self.check(path)?;
        let image = self.into_exr(compression);
        write_atomically(path, |writer| image.write().to_buffered(writer).map_err(|e| write_error(path, e)))
    }

    /// The file's bytes, for sending it somewhere.
    ///
    /// # Errors
    /// [`ImageError::Encode`] as for [`ExrFile::write`]; `name` is what the error calls the file.
    pub fn into_bytes(self, name: &Path, compression: ExrCompression) -> Result<Vec<u8>, ImageError> {
        self.check(name)?;
        let mut bytes = Cursor::new(Vec::new());
        self.into_exr(compression).write().to_buffered(&mut bytes).map_err(|e| write_error(name, e))?;
        Ok(bytes.into_inner())
    }

    fn check(&self, path: &Path) -> Result<(), ImageError> {
        let encode = |reason: String| Err(ImageError::Encode { path: path.to_owned(), reason });
        let pixels = self.data_width as usize * self.data_height as usize;
        if self.channels.is_empty() || pixels == 0 {
            return encode("there is nothing to write".into());
        }
        let mut names: Vec<&str> = self.channels.iter().map(|c| c.name.as_str()).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return encode(format!("two channels are called `{}`", pair[0]));
        }
        let longest_key = 255 - METADATA_PREFIX.len();
        let keys = self.metadata.keys().map(|k| (k.as_str(), longest_key));
        let names = names.into_iter().chain(self.attributes.keys().map(String::as_str));
        for (name, limit) in names.map(|n| (n, 255)).chain(keys) {
            if name.is_empty() || name.len() > limit || name.contains('\0') {
                return encode(format!("`{name}` cannot be a name in an EXR file"));
            }
        }
        for channel in &self.channels {
            let n = match &channel.samples {
                ExrSamples::Half(v) | ExrSamples::Float(v) => v.len(),
                ExrSamples::Uint(v) => v.len(),
            };
            if n != pixels {
                return encode(format!("channel `{}` has {n} values for {pixels} pixels", channel.name));
            }
        }
        Ok(())
    }

    fn into_exr(self, compression: ExrCompression) -> ex::Image<ex::Layer<ex::AnyChannels<ex::FlatSamples>>> {
        let mut clamped = 0_u64;
        let channels = self
            .channels
            .into_iter()
            .map(|channel| {
                let samples = match channel.samples {
                    ExrSamples::Half(v) => {
                        ex::FlatSamples::F16(v.iter().map(|&v| to_half(v, &mut clamped)).collect())
                    }
                    ExrSamples::Float(v) => ex::FlatSamples::F32(v),
                    ExrSamples::Uint(v) => ex::FlatSamples::U32(v),
                };
                ex::AnyChannel::new(text(&channel.name), samples)
            })
            .collect();

        let mut attributes = ex::LayerAttributes::default().with_position(ex::Vec2(self.x, self.y));
        attributes.software_name = Some(text("Alhazen"));
        if let Some(camera) = &self.camera {
            camera.put(&mut attributes);
        }
        for (key, value) in &self.metadata {
            let key = text(&format!("{METADATA_PREFIX}{key}"));
            attributes.other.insert(key, ex::AttributeValue::Text(text(value)));
        }
        for (key, value) in &self.attributes {
            attributes.other.insert(text(key), ex::AttributeValue::Text(text(value)));
        }
        if clamped > 0 {
            let key = text(&format!("{METADATA_PREFIX}half-clamped"));
            attributes.other.insert(key, ex::AttributeValue::Text(text(&clamped.to_string())));
        }
        let encoding = ex::Encoding {
            compression: match compression {
                ExrCompression::None => ex::Compression::Uncompressed,
                ExrCompression::Rle => ex::Compression::RLE,
                ExrCompression::Zip => ex::Compression::ZIP16,
                ExrCompression::Piz => ex::Compression::PIZ,
            },
            blocks: ex::Blocks::ScanLines,
            line_order: ex::LineOrder::Increasing,
        };
        let size = (self.data_width as usize, self.data_height as usize);
        let layer = ex::Layer::new(size, attributes, encoding, ex::AnyChannels::sort(channels));
        let mut shared = ex::ImageAttributes::with_size((self.width as usize, self.height as usize));
        shared.chromaticities = Some(primaries::attribute(self.primaries.as_ref()));
        ex::Image::new(shared, layer)
    }

    /// Reads a file: all parts, with all their channels, zero where a part stores nothing and another does. A part's name goes
    /// before its channels' names, as in `part.channel`, unless they begin so already. Memory is limited by the length of the
    /// file.
    ///
    /// # Errors
    /// [`ImageError::Read`], [`ImageError::TooLarge`], or [`ImageError::Decode`] for damaged files, deep data,
    /// subsampled channels and DWA compression.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let read_error = |source| ImageError::Read { path: path.to_owned(), source };
        let file = File::open(path).map_err(read_error)?;
        let length = file.metadata().map_err(read_error)?.len();
        Self::decode(path, BufReader::new(file), length)
    }

    /// The file whose bytes these are; `name` is what errors call it.
    ///
    /// # Errors
    /// As [`ExrFile::read`].
    pub fn from_bytes(name: &Path, bytes: &[u8]) -> Result<Self, ImageError> {
        Self::decode(name, Cursor::new(bytes), bytes.len() as u64)
    }

    fn decode(path: &Path, reader: impl Read + Seek, length: u64) -> Result<Self, ImageError> {
        let decode_error = |reason: String| ImageError::Decode { path: path.to_owned(), reason };
        // The decoder is careful, but a damaged file has made it panic before; on one thread that can be caught.
        let decoded = catch_unwind(AssertUnwindSafe(|| {
            let chunks = exr::block::read(reader, false).map_err(|e| from_exr(path, e))?;
            check_headers(path, chunks.headers(), length)?;
            ex::read()
                .no_deep_data()
                .largest_resolution_level()
                .all_channels()
                .all_layers()
                .all_attributes()
                .non_parallel()
                .from_chunks(chunks)
                .map_err(|e| from_exr(path, e))
        }));
        let image = decoded.map_err(|_| decode_error("the file is damaged".into()))??;
        let Some(first) = image.layer_data.first() else {
            return Err(decode_error("the file is empty".into()));
        };

        let side = |v: usize| u32::try_from(v).unwrap_or(u32::MAX); // limited by `check_headers`
        let window = windows::around(path, &image.layer_data, length)?;
        let mut result = Self {
            width: side(image.attributes.display_window.size.0),
            height: side(image.attributes.display_window.size.1),
            x: window.x,
            y: window.y,
            data_width: side(window.width),
            data_height: side(window.height),
            channels: Vec::new(),
            metadata: BTreeMap::new(),
            attributes: BTreeMap::new(),
            camera: ExrCamera::of(&first.attributes),
            primaries: primaries::named(image.attributes.chromaticities),
        };
        for (key, value) in &first.attributes.other {
            let ex::AttributeValue::Text(value) = value else { continue };
            match string(key).strip_prefix(METADATA_PREFIX) {
                Some(key) => result.metadata.insert(key.to_owned(), string(value)),
                None => result.attributes.insert(string(key), string(value)),
            };
        }
        for layer in image.layer_data {
            result.take_channels(layer, window);
        }
        Ok(result)
    }

    /// Adds the channels of a layer, named after it, placed in a window around all layers.
    fn take_channels(&mut self, layer: ex::Layer<ex::AnyChannels<ex::FlatSamples>>, window: windows::Window) {
        let stored = windows::Window::of(&layer);
        let prefix = layer.attributes.layer_name.as_ref().map(string).filter(|name| !name.is_empty());
        for channel in layer.channel_data.list {
            let name = string(&channel.name);
            let is_whole = |prefix: &&String| !name.starts_with(&format!("{prefix}."));
            let prefix = prefix.as_ref().filter(is_whole);
            let name = prefix.map_or(name.clone(), |prefix| format!("{prefix}.{name}"));
            let samples = match channel.sample_data {
                ex::FlatSamples::F16(v) => {
                    let v = v.into_iter().map(ex::f16::to_f32).collect();
                    ExrSamples::Half(windows::placed(v, stored, window))
                }
                ex::FlatSamples::F32(v) => ExrSamples::Float(windows::placed(v, stored, window)),
                ex::FlatSamples::U32(v) => ExrSamples::Uint(windows::placed(v, stored, window)),
            };
            self.channels.push(ExrChannel { name, samples });
        }
    }
}

/// Refuses what would need more memory than the file can account for, before anything is allocated.
fn check_headers(path: &Path, headers: &[exr::meta::header::Header], length: u64) -> Result<(), ImageError> {
    let mut budget = limits::decoded_bytes(length);
    let channels: usize = headers.iter().map(|header| header.channels.list.len()).sum();
    if channels > limits::MAX_CHANNELS {
        let reason = format!("{channels} channels are more than {}", limits::MAX_CHANNELS);
        return Err(ImageError::Decode { path: path.to_owned(), reason });
    }
    for header in headers {
        let (width, height) = (header.layer_size.0 as u64, header.layer_size.1 as u64);
        let channels = header.channels.list.len() as u64;
        let bytes = limits::bytes(width, height, channels);
        if bytes.is_none_or(|bytes| bytes > budget) {
            return Err(ImageError::TooLarge { path: path.to_owned(), width, height, channels });
        }
        budget -= bytes.unwrap_or(0);
        if header.channels.list.iter().any(|c| c.sampling != ex::Vec2(1, 1)) {
            let reason = "subsampled channels are not supported".into();
            return Err(ImageError::Decode { path: path.to_owned(), reason });
        }
    }
    Ok(())
}

fn write_error(path: &Path, error: ex::Error) -> ImageError {
    match error {
        ex::Error::Io(source) => ImageError::Write { path: path.to_owned(), source },
        other => ImageError::Encode { path: path.to_owned(), reason: other.to_string() },
    }
}

fn from_exr(path: &Path, error: ex::Error) -> ImageError {
    match error {
        ex::Error::Io(source) => ImageError::Read { path: path.to_owned(), source },
        other => ImageError::Decode { path: path.to_owned(), reason: other.to_string() },
    }
}

fn to_half(value: f32, clamped: &mut u64) -> ex::f16 {
    let half = ex::f16::from_f32(value);
    if half.is_infinite() {
        *clamped += 1;
        return if value > 0.0 { ex::f16::MAX } else { ex::f16::MIN };
    }
    half
}

/// The file stores bytes; ours are UTF-8.
fn text(s: &str) -> ex::Text {
    ex::Text::from_slice_unchecked(s.as_bytes())
}

fn string(text: &ex::Text) -> String {
    String::from_utf8_lossy(text.bytes()).into_owned()
}

#[cfg(test)]
mod tests;
