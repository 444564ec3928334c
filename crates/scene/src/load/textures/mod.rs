//! Images of all loaders: collected while a file is read, decoded together at the end, on all cores.

mod dds;
mod decode;
mod error;
mod float;
mod ktx2;
mod meaning;
mod size_limits;
mod storage;

use decode::decode_as;
use meaning::Meaning;

pub use decode::decode;
pub use error::TextureError;

use super::{LoadError, LoadOptions};
use crate::{Image, ImageId, LoadReport, Pixels};
use glam::{Vec3, Vec4};
use optics::tonemap::srgb_decode_channel;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What stands in for an image that is missing or broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Neutral {
    /// Opaque white, which leaves the factor it is multiplied with alone.
    White,
    /// The flat tangent-space normal (0, 0, 1).
    FlatNormal,
    /// Opaque black, for what shines.
    Black,
}

impl Neutral {
    /// The single RGBA pixel.
    pub fn pixel(self) -> [u8; 4] {
        match self {
            Neutral::White => [255; 4],
            Neutral::FlatNormal => [128, 128, 255, 255],
            Neutral::Black => [0, 0, 0, 255],
        }
    }

    /// A 1×1 image.
    pub fn image(self, name: impl Into<String>) -> Image {
        Image { name: name.into(), width: 1, height: 1, pixels: Pixels::Rgba8(vec![self.pixel()]) }
    }
}

/// Loads one picture, as materials have them: eight bits a channel as they are stored, or linear
/// floating point.
///
/// # Errors
/// [`LoadError::Read`] and [`LoadError::TooLarge`]; [`LoadError::Malformed`] if it cannot be decoded.
pub fn load_picture(path: &Path, options: &LoadOptions, report: &mut LoadReport) -> Result<Image, LoadError> {
    options.session(path, |options| {
        let bytes = options.read(path)?;
        report.bytes_read += bytes.len() as u64;
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let image = decode(&name, &bytes, options, report);
        image.map_err(|error| LoadError::malformed(path, "picture", error.to_string()))
    })
}

/// Collects the images that a file refers to and decodes all of them at the end, in parallel.
///
/// Ids are given out in the order of first use, starting at `first`, so that they do not depend on which thread
/// finished first. A file that is used twice is decoded once.
pub struct TextureLoader<'a> {
    options: &'a LoadOptions,
    first: ImageId,
    sources: Vec<Source<'a>>,
    files: HashMap<(PathBuf, Neutral), ImageId>,
    blobs: HashMap<(usize, usize, Neutral), ImageId>,
}

struct Source<'a> {
    name: String,
    neutral: Neutral,
    data: Data<'a>,
}

enum Data<'a> {
    File(PathBuf),
    Bytes(Cow<'a, [u8]>),
    Missing(String),
}

impl<'a> TextureLoader<'a> {
    /// An empty collection whose first image will be number `first`: the length of the [`crate::Scene::images`] that
    /// the result of [`TextureLoader::finish`] is appended to.
    pub fn new(options: &'a LoadOptions, first: ImageId) -> Self {
        Self { options, first, sources: Vec::new(), files: HashMap::new(), blobs: HashMap::new() }
    }

    /// An image file. It is not opened before [`TextureLoader::finish`].
    pub fn file(&mut self, path: &Path, neutral: Neutral) -> ImageId {
        let key = (path.to_owned(), neutral);
        if let Some(known) = self.files.get(&key) {
            return *known;
        }
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let id = self.push(Source { name, neutral, data: Data::File(path.to_owned()) });
        self.files.insert(key, id);
        id
    }

    /// An image file's content that is in memory already. Its format is recognised by its first bytes; `name` is for
    /// messages and, as TGA files have no signature, for telling those by their ending.
    ///
    /// The same borrowed slice given twice is decoded once.
    pub fn bytes(&mut self, name: &str, bytes: impl Into<Cow<'a, [u8]>>, neutral: Neutral) -> ImageId {
        let bytes = bytes.into();
        let key = match &bytes {
            Cow::Borrowed(slice) => Some((slice.as_ptr() as usize, slice.len(), neutral)),
            Cow::Owned(_) => None, // may be freed and its address used again
        };
        if let Some(known) = key.and_then(|key| self.blobs.get(&key)) {
            return *known;
        }
        let id = self.push(Source { name: name.into(), neutral, data: Data::Bytes(bytes) });
        if let Some(key) = key {
            self.blobs.insert(key, id);
        }
        id
    }

    /// An image that the file names but that cannot be found in it; `reason` says why.
    pub fn missing(&mut self, name: &str, reason: impl Into<String>, neutral: Neutral) -> ImageId {
        self.push(Source { name: name.into(), neutral, data: Data::Missing(reason.into()) })
    }

    /// Number of images collected so far.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Whether nothing was collected.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Decodes everything. Image `first + i` is the i-th of the result.
    ///
    /// What is missing or broken becomes a 1×1 image of its [`Neutral`] colour and a note in the report.
    pub fn finish(self, report: &mut LoadReport) -> Vec<Image> {
        let options = self.options;
        let decoded: Vec<(Image, LoadReport)> =
            self.sources.into_par_iter().map(|source| source.decode(options)).collect();
        let images = decoded.into_iter().map(|(image, notes)| {
            report.absorb(&format!("texture {}", image.name), notes);
            image
        });
        images.collect()
    }

    fn push(&mut self, source: Source<'a>) -> ImageId {
        self.sources.push(source);
        self.first + (self.sources.len() - 1) as ImageId
    }
}

impl Source<'_> {
    fn decode(self, options: &LoadOptions) -> (Image, LoadReport) {
        let mut report = LoadReport::default();
        let meaning = if self.neutral == Neutral::FlatNormal { Meaning::Data } else { Meaning::Color };
        let decode = |bytes: &[u8], report: &mut LoadReport| {
            decode_as(meaning, &self.name, bytes, options, report).map_err(|e| e.to_string())
        };
        let image = match self.data {
            Data::File(path) => match options.read(&path) {
                Ok(bytes) => {
                    report.bytes_read += bytes.len() as u64;
                    decode(&bytes, &mut report)
                }
                Err(LoadError::Read { source, .. }) => Err(format!("cannot be read ({source})")),
                Err(error) => Err(error.to_string()),
            },
            Data::Bytes(bytes) => decode(&bytes, &mut report),
            Data::Missing(reason) => Err(reason),
        };
        let image = image.unwrap_or_else(|reason| {
            report.repaired(format!("{reason}; replaced by a neutral colour"));
            report.missing_images += 1;
            self.neutral.image(self.name)
        });
        let (beyond, largest) = beyond_half(&image.pixels);
        if beyond > 0 {
            report.approximated(format!(
                "{beyond} values above {largest} were set to that: textures are half floats"
            ));
        }
        (image, report)
    }
}

/// How many numbers are beyond the largest half float, and that.
fn beyond_half(pixels: &Pixels) -> (usize, f32) {
    let largest = exr::prelude::f16::MAX.to_f32();
    let count = |values: &[f32]| values.iter().filter(|v| **v > largest).count();
    let beyond = match pixels {
        Pixels::Rgba8(_) => 0,
        Pixels::Rgb32F(pixels) => count(pixels.as_flattened()),
        Pixels::Rgba32F(pixels) => count(pixels.as_flattened()),
    };
    (beyond, largest)
}

/// Linear vertex colours from those of a file, which are sRGB if `encoded`, each in `[0, 1]`.
///
/// If one is above 1, all are taken to be sRGB that counts up to 255, except white, which files without colours for some
/// vertices have there. Everything is clamped to `[0, 1]`.
pub(crate) fn vertex_colors(mut colors: Vec<Vec4>, encoded: bool, report: &mut LoadReport) -> Vec<Vec4> {
    let high = colors.iter().map(|c| c.truncate().max_element()).fold(0.0, f32::max);
    if high > 1.0 {
        report.repaired("vertex colours above 1 are taken for sRGB that counts up to 255");
        let white = |c: &Vec4| c.truncate() == Vec3::ONE;
        colors.iter_mut().filter(|c| !white(c)).for_each(|c| *c = (c.truncate() / 255.0).extend(c.w));
    }
    colors.par_iter_mut().for_each(|c| {
        *c = c.clamp(Vec4::ZERO, Vec4::ONE);
        if encoded || high > 1.0 {
            *c = Vec3::from(c.truncate().to_array().map(srgb_decode_channel)).extend(c.w);
        }
    });
    colors
}

/// Finds a file that another one names: as written, with `\` as separator, or with the wrong case.
///
/// `name` is taken relative to `base`, the folder of the file that names it. If it does not exist there, the bare file
/// name is looked for in `base`, as files made on another machine often hold its absolute paths. Returns `None` if
/// nothing fits.
///
/// Only files that the scene may read are found, see [`LoadOptions::allowed_paths`].
pub(crate) fn find_file(base: &Path, name: &str, options: &LoadOptions) -> Option<PathBuf> {
    let name = name.trim();
    if name.is_empty() {
        return None;
    }
    let slashes = name.replace('\\', "/");
    let bare = slashes.rsplit('/').next().unwrap_or(&slashes);
    let exact = [name, slashes.as_str(), bare].into_iter().map(|n| base.join(n)).find(|p| options.is_file(p));
    exact
        .or_else(|| find_ignoring_case(base, &slashes, options))
        .or_else(|| find_ignoring_case(base, bare, options))
}

/// The file `name` below `base` with the letters of its components in any case.
fn find_ignoring_case(base: &Path, name: &str, options: &LoadOptions) -> Option<PathBuf> {
    let mut path = if name.starts_with('/') { PathBuf::from("/") } else { base.to_owned() };
    for component in name.split('/').filter(|c| !c.is_empty() && *c != ".") {
        let as_written = path.join(component);
        path =
            if as_written.exists() { as_written } else { options.entry_ignoring_case(&path, component)? };
    }
    options.is_file(&path).then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(color: [u8; 4]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let image = ::image::RgbaImage::from_pixel(2, 2, ::image::Rgba(color));
        image.write_to(&mut std::io::Cursor::new(&mut bytes), ::image::ImageFormat::Png).unwrap();
        bytes
    }

    #[test]
    fn ids_follow_first_use_and_equal_sources_are_shared() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("red.png");
        std::fs::write(&path, png([255, 0, 0, 255])).unwrap();
        let blob = png([0, 255, 0, 255]);
        let options = LoadOptions::default();
        let mut loader = TextureLoader::new(&options, 5);
        assert_eq!(loader.file(&path, Neutral::White), 5);
        assert_eq!(loader.bytes("green", &blob[..], Neutral::White), 6);
        assert_eq!(loader.file(&path, Neutral::White), 5);
        assert_eq!(loader.bytes("green", &blob[..], Neutral::White), 6);
        assert_eq!(loader.file(&folder.path().join("none.png"), Neutral::FlatNormal), 7);
        assert_eq!(loader.missing("lost", "names buffer 9", Neutral::White), 8);

        let mut report = LoadReport::default();
        let images = loader.finish(&mut report);
        let first_pixels: Vec<_> = images
            .iter()
            .map(|i| match &i.pixels {
                Pixels::Rgba8(p) => p[0],
                _ => panic!("a float image"),
            })
            .collect();
        assert_eq!(first_pixels, [[255, 0, 0, 255], [0, 255, 0, 255], [128, 128, 255, 255], [255; 4]]);
        assert_eq!(report.notes.len(), 2);
        assert!(report.notes[0].message.starts_with("texture none.png: cannot be read"), "{report:?}");
        assert_eq!(report.notes[1].message, "texture lost: names buffer 9; replaced by a neutral colour");
    }

    #[test]
    fn files_are_found_despite_separators_case_and_foreign_folders() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("Tex")).unwrap();
        let inner = folder.path().join("Tex").join("Wood.PNG");
        let outer = folder.path().join("stone.png");
        std::fs::write(&inner, b"x").unwrap();
        std::fs::write(&outer, b"x").unwrap();
        for (name, expected) in [
            ("Tex/Wood.PNG", Some(&inner)),
            ("Tex\\Wood.PNG", Some(&inner)),
            (".\\tex\\wood.png", Some(&inner)),
            ("C:\\Users\\me\\stone.png", Some(&outer)),
            ("/home/me/Stone.png", Some(&outer)),
            ("Tex", None),
            ("", None),
            ("../nowhere.png", None),
        ] {
            let scene = folder.path().join("scene.obj");
            let found = LoadOptions::default()
                .session(&scene, |options| Ok(find_file(folder.path(), name, options)))
                .expect("nothing is over the budget");
            let same = match (&found, expected) {
                (Some(a), Some(b)) => a.canonicalize().unwrap() == b.canonicalize().unwrap(),
                (None, None) => true,
                _ => false,
            };
            assert!(same, "{name}: {found:?}");
        }
    }
}
