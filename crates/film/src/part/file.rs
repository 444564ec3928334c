//! Parts as OpenEXR files: exact sums in channels of whole numbers, everything else as text, and a checksum over all.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

use super::{Part, PartError};
use crate::{
    Aov, Block, Coverage, ExrCompression, ExrFile, ExrSamples, Film, METADATA_PREFIX, Precision, Rect,
};

/// The format of the files. Another number is another meaning of channels or metadata.
const VERSION: &str = "1";

/// Sums of noisy samples hardly become smaller: deflate takes ten times as long as run lengths to save a fifth more.
const COMPRESSION: ExrCompression = ExrCompression::Rle;

/// Keys of the metadata that only parts have.
const VERSION_KEY: &str = "part.format";
const WHOLE: &str = "part.whole";
const COVERED: &str = "part.covered";
const LAYERS: &str = "part.layers";
const INVALID_AOVS: &str = "part.invalid-layer-values";
const BACKENDS: &str = "part.backends";
const RENDER_TIME: &str = "part.render-nanoseconds";
const CHECKSUM: &str = "part.checksum";
/// Goes before the names of [`Part::identity`].
const IDENTITY: &str = "part.identity.";

impl Part {
    /// Writes the part: complete, or not at all.
    ///
    /// The file is an OpenEXR file that other programs can show: R, G and B are the means so far. The exact sums are in
    /// further channels ([`Film::to_channels`]).
    ///
    /// # Errors
    /// [`PartError::File`].
    pub fn write(&self, path: &Path) -> Result<(), PartError> {
        Ok(self.to_exr().write_once(path, COMPRESSION)?)
    }

    /// Whether the file at `path` looks like a part, by its header alone; `false` if it cannot be read.
    pub fn is_at(path: &Path) -> bool {
        /// Headers list names of materials and instances, so they can be long.
        const LONGEST_HEADER: u64 = 4 << 20;
        let key = format!("{METADATA_PREFIX}{VERSION_KEY}\0");
        let mut header = Vec::new();
        let read = File::open(path).and_then(|file| file.take(LONGEST_HEADER).read_to_end(&mut header));
        read.is_ok() && header.windows(key.len()).any(|window| window == key.as_bytes())
    }

    /// Reads a part and checks that it is what was written.
    ///
    /// # Errors
    /// [`PartError::File`], [`PartError::NotAPart`], [`PartError::Version`] or [`PartError::Damaged`].
    pub fn read(path: &Path) -> Result<Self, PartError> {
        Self::from_exr(path, &ExrFile::read(path)?)
    }

    /// The bytes of the file that [`Part::write`] writes, for sending a part to another process.
    ///
    /// # Errors
    /// [`PartError::File`] if the part cannot be encoded.
    pub fn to_bytes(&self) -> Result<Vec<u8>, PartError> {
        Ok(self.to_exr().into_bytes(Path::new("part"), COMPRESSION)?)
    }

    /// The inverse of [`Part::to_bytes`]; `name` is what errors call the part.
    ///
    /// # Errors
    /// As [`Part::read`].
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, PartError> {
        let path = Path::new(name);
        Self::from_exr(path, &ExrFile::from_bytes(path, bytes)?)
    }

    pub(super) fn to_exr(&self) -> ExrFile {
        let film = self.film();
        let mut file = ExrFile::new(film.width(), film.height(), film.window());
        file.push_colour(&film.to_image(), Precision::Float);
        file.channels.extend(film.to_channels());
        file.metadata.clone_from(&self.metadata);
        file.metadata.extend(self.identity.iter().map(|(k, v)| (format!("{IDENTITY}{k}"), v.clone())));
        let layers: Vec<&str> = film.aovs().iter().map(|a| a.name()).collect();
        let backends: Vec<&str> = self.backends.iter().map(String::as_str).collect();
        let facts = [
            (VERSION_KEY, VERSION.to_owned()),
            (WHOLE, self.whole().to_text()),
            (COVERED, self.covered().to_text()),
            (LAYERS, layers.join(",")),
            (INVALID_AOVS, film.invalid_aovs().to_string()),
            (BACKENDS, backends.join(",")),
            (RENDER_TIME, u64::try_from(self.render_time.as_nanos()).unwrap_or(u64::MAX).to_string()),
        ];
        file.metadata.extend(facts.map(|(key, value)| (key.to_owned(), value)));
        let checksum = checksum(&file);
        file.with_metadata(CHECKSUM, checksum)
    }

    pub(super) fn from_exr(path: &Path, file: &ExrFile) -> Result<Self, PartError> {
        let damaged = |reason: String| PartError::Damaged { path: path.to_owned(), reason };
        let fact = |key: &str| {
            let missing = || damaged(format!("its header has no `{key}`"));
            file.metadata.get(key).map(String::as_str).ok_or_else(missing)
        };
        match file.metadata.get(VERSION_KEY).map(String::as_str) {
            Some(VERSION) => {}
            Some(other) => {
                let found = other.to_owned();
                return Err(PartError::Version { path: path.to_owned(), found, known: VERSION });
            }
            None => return Err(PartError::NotAPart { path: path.to_owned() }),
        }
        if fact(CHECKSUM)? != checksum(file) {
            return Err(damaged("its checksum is not that of its contents".into()));
        }
        let whole: Block = parsed(fact(WHOLE)?).map_err(damaged)?;
        let covered: Coverage = parsed(fact(COVERED)?).map_err(damaged)?;
        let film = read_film(file, fact(LAYERS)?, fact(INVALID_AOVS)?).map_err(damaged)?;
        let mut part = Self::new(film, covered, whole).map_err(|e| damaged(e.to_string()))?;
        part.render_time = Duration::from_nanos(parsed(fact(RENDER_TIME)?).map_err(damaged)?);
        part.backends = names(fact(BACKENDS)?).map(str::to_owned).collect();
        for (key, value) in &file.metadata {
            if let Some(key) = key.strip_prefix(IDENTITY) {
                part.identity.insert(key.to_owned(), value.clone());
            } else if !key.starts_with("part.") {
                part.metadata.insert(key.clone(), value.clone());
            }
        }
        Ok(part)
    }
}

fn names(list: &str) -> impl Iterator<Item = &str> {
    list.split(',').filter(|name| !name.is_empty())
}

fn parsed<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|e: T::Err| format!("its header says `{text}`: {e}"))
}

fn read_film(file: &ExrFile, layers: &str, invalid_aovs: &str) -> Result<Film, String> {
    let aovs: Vec<Aov> = names(layers).map(parsed).collect::<Result<_, _>>()?;
    let side = |v: i32| u32::try_from(v).map_err(|_| format!("its pixels are at ({}, {})", file.x, file.y));
    let window =
        Rect { x: side(file.x)?, y: side(file.y)?, width: file.data_width, height: file.data_height };
    let film = Film::with_window(file.width, file.height, window, &aovs);
    let mut film = film.map_err(|e| e.to_string())?;
    film.set_channels(&file.channels).map_err(|name| format!("its channel `{name}` is missing or wrong"))?;
    film.add_invalid_aovs(parsed(invalid_aovs)?);
    Ok(film)
}

/// A hash of everything in the file but the checksum itself.
fn checksum(file: &ExrFile) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut text = |t: &str| {
        hasher.update(&(t.len() as u64).to_le_bytes());
        hasher.update(t.as_bytes());
    };
    text(&format!("{:?}", (file.width, file.height, file.x, file.y, file.data_width, file.data_height)));
    for (key, value) in file.metadata.iter().filter(|(key, _)| *key != CHECKSUM) {
        text(key);
        text(value);
    }
    let by_name: BTreeMap<&str, &ExrSamples> = file.channels.iter().map(|c| (&*c.name, &c.samples)).collect();
    for (name, samples) in by_name {
        hasher.update(name.as_bytes());
        match samples {
            ExrSamples::Half(values) | ExrSamples::Float(values) => {
                hasher.update(bytemuck::cast_slice(values));
            }
            ExrSamples::Uint(values) => {
                hasher.update(bytemuck::cast_slice(values));
            }
        }
    }
    hasher.finalize().to_hex().to_string()
}
