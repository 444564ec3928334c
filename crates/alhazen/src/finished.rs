//! Pictures in files, ours or other renderers': finding their layers, denoising them, showing them.

use crate::denoise::{DenoiseFilmError, Denoised, Denoiser};
use crate::metadata::tone_in;
use crate::output::{Encoding, Format, OutputError};
use film::{ExrChannel, ExrFile, Image, ImageError, Part, plain_name};
use post::{NoisyPicture, ToneMapping};
use std::path::{Path, PathBuf};

/// A finished picture, with the layers of its file.
#[derive(Clone, Debug)]
pub struct FinishedPicture {
    path: PathBuf,
    /// Linear colour with three or four channels: of an EXR file what it stores, with its primaries.
    stored: Image,
    /// The same as it is to be seen: see [`film::ExrPicture::image`].
    colour: Image,
    /// Name of the layer that the colour comes from; empty for the one without a name.
    layer: String,
    /// See [`film::ExrPicture::notes`].
    notes: Vec<String>,
    /// Where it comes from an EXR file.
    file: Option<ExrFile>,
}

/// Which layers guide a denoiser. `None` is found by the names that renderers give them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerNames {
    /// What of white light the first surface reflects.
    pub albedo: Option<String>,
    /// The first surface's normal.
    pub normal: Option<String>,
}

/// What was found to guide a denoiser, for people.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Guides {
    /// The layer of albedo, if there is one.
    pub albedo: Option<String>,
    /// The layer of normals, if there is one.
    pub normal: Option<String>,
    /// Whether the file knows how noisy each pixel is; otherwise that is estimated from the
    /// picture.
    pub has_errors: bool,
    /// Values that were NaN or infinite, and are taken as 0.
    pub invalid: usize,
}

/// Why a picture could not be opened or denoised.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FinishedError {
    /// It cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It is only a part of a picture.
    #[error("{}: a part of a picture or a checkpoint; `alhazen merge` makes a picture of it", path.display())]
    IsPart {
        /// The file.
        path: PathBuf,
    },
    /// There is no such layer.
    #[error("{}: there is no layer `{name}`; there are: {known}", path.display())]
    NoLayer {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        name: String,
        /// The layers that there are.
        known: String,
    },
    /// It cannot be denoised.
    #[error(transparent)]
    Denoise(#[from] DenoiseFilmError),
}

/// Names of albedo: ours and pbrt's, Blender's for denoising, its diffuse pass, Mitsuba's usual
/// ones.
const ALBEDO: &[&str] =
    &["albedo", "denoisingalbedo", "diffcol", "diffusecolor", "basecolor", "alb", "diffusealbedo"];
/// Names of shading normals, then geometric ones: ours and Blender's for denoising, ours, pbrt's `Ns`
/// and `N`, Mitsuba's.
const NORMAL: &[&str] = &[
    "denoisingnormal",
    "normal",
    "ns",
    "shnormal",
    "shadingnormal",
    "normals",
    "nn",
    "n",
    "geometricnormal",
    "geonormal",
];

fn vectors(file: &ExrFile, layer: &str) -> Option<Image> {
    file.channels_of(layer, ["X", "Y", "Z"], "").or_else(|| file.channels_of(layer, ["R", "G", "B"], ""))
}

/// The layer called `name`, as it is written or as [`plain_name`] has it.
fn layer_called<'a>(file: &'a ExrFile, name: &str) -> Option<&'a str> {
    file.layer_names().into_iter().find(|l| *l == name || plain_name(l) == plain_name(name))
}

impl FinishedPicture {
    /// Opens a file: EXR with any layers, HDR, PNG or JPEG (the last two are decoded to linear
    /// light).
    ///
    /// `layer` is the layer to take. Without it, an EXR file's picture is that of
    /// [`film::ExrFile::picture`].
    ///
    /// # Errors
    /// See [`FinishedError`].
    pub fn open(path: &Path, layer: Option<&str>) -> Result<Self, FinishedError> {
        if Part::is_at(path) {
            return Err(FinishedError::IsPart { path: path.to_owned() });
        }
        let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        if !is_exr {
            let colour = Image::open(path)?;
            let (path, stored) = (path.to_owned(), colour.clone());
            return Ok(Self { path, stored, colour, layer: String::new(), notes: Vec::new(), file: None });
        }
        let file = ExrFile::read(path)?;
        let picture = match layer {
            Some(name) => {
                let found = layer_called(&file, name);
                let found = found.and_then(|l| Some((l.to_owned(), file.colours(l)?)));
                found.ok_or_else(|| no_layer(path, &file, name))?
            }
            None => {
                let no_colour = || {
                    let found = file.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
                    ImageError::NoColour { path: path.to_owned(), found }
                };
                file.picture_layer().ok_or_else(no_colour)?
            }
        };
        let notes = if layer.is_none() { file.picture(path)?.notes } else { Vec::new() };
        let (layer, stored) = picture;
        let colour = file.on_display(path, &file.as_rec709(&stored))?;
        Ok(Self { path: path.to_owned(), stored, colour, layer, notes, file: Some(file) })
    }

    /// As [`FinishedPicture::open`], but of a picture that has been denoised before, takes what it
    /// was before.
    ///
    /// # Errors
    /// See [`FinishedError`].
    pub fn open_noisy(path: &Path, layer: Option<&str>) -> Result<Self, FinishedError> {
        let mut picture = Self::open(path, layer)?;
        let noisy = picture.file.as_ref().filter(|_| layer.is_none()).and_then(|file| file.colours(NOISY));
        if let Some(noisy) = noisy {
            picture.stored = with_alpha(&noisy.to_rgb(), &picture.stored);
            picture.colour = picture.shown(&picture.stored)?;
            picture.layer = NOISY.to_owned();
            picture.notes = vec![format!("the layer `{NOISY}` is taken: the picture before it was denoised")];
        }
        Ok(picture)
    }

    /// Linear colour with Rec. 709 primaries, with alpha if the file has it; as large as the display
    /// window of an EXR file.
    pub fn colour(&self) -> &Image {
        &self.colour
    }

    /// What people should know of how the picture was found in its file, such as its layer among
    /// several.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Colours as the file stores them, as they are to be seen.
    fn shown(&self, stored: &Image) -> Result<Image, ImageError> {
        match &self.file {
            Some(file) => file.on_display(&self.path, &file.as_rec709(stored)),
            None => Ok(stored.clone()),
        }
    }

    /// The layer that the colour comes from; empty if that has no name.
    pub fn layer(&self) -> &str {
        &self.layer
    }

    /// How the picture is to be shown, if its file says so: files of ours do.
    pub fn tone(&self) -> Option<ToneMapping> {
        self.file.as_ref().and_then(|file| tone_in(&file.metadata))
    }

    /// Removes the noise, guided by what layers of albedo and normals there are.
    ///
    /// # Errors
    /// See [`FinishedError`].
    pub fn denoise(
        &self,
        denoiser: Denoiser,
        names: &LayerNames,
    ) -> Result<(Denoised, Guides), FinishedError> {
        let mut guides = Guides::default();
        let (width, height) = (self.stored.width(), self.stored.height());
        let mut clean = |image: Image| {
            guides.invalid += image.data().iter().filter(|v| !v.is_finite()).count();
            image.map(|v| if v.is_finite() { v } else { 0.0 })
        };
        let colour = clean(self.stored.to_rgb());
        let albedo = self.guide(&names.albedo, ALBEDO, ExrFile::colours)?;
        let normal = self.guide(&names.normal, NORMAL, vectors)?;
        let [albedo_image, normal_image] = [&albedo, &normal].map(|guide| match guide {
            Some((_, image)) => clean(image.to_rgb()),
            None => Image::black(width, height, 3),
        });
        let errors = self.file.as_ref().and_then(|file| file.colours(film::Aov::StandardError.name()));
        (guides.albedo, guides.normal) = (albedo.map(|g| g.0), normal.map(|g| g.0));
        guides.has_errors = errors.is_some();
        let variance = errors.map(|errors| errors.to_rgb().map(|e| if e.is_finite() { e * e } else { 0.0 }));
        let noisy = NoisyPicture { colour, variance, albedo: albedo_image, normal: normal_image };
        Ok((denoiser.run_on(&noisy)?, guides))
    }

    /// A guide's layer and its name: the one that was asked for, or one that is called as renderers
    /// call it.
    fn guide(
        &self,
        asked: &Option<String>,
        known: &[&str],
        read: fn(&ExrFile, &str) -> Option<Image>,
    ) -> Result<Option<(String, Image)>, FinishedError> {
        let Some(file) = &self.file else {
            return match asked {
                Some(name) => Err(no_layer(
                    &self.path,
                    &ExrFile::from_image(&self.stored, film::Precision::Float),
                    name,
                )),
                None => Ok(None),
            };
        };
        let found = match asked {
            Some(name) => layer_called(file, name),
            None => file.layer_called(known, |layer| read(file, layer).is_some()),
        };
        let guide = found.and_then(|layer| Some((layer.to_owned(), read(file, layer)?)));
        match (guide, asked) {
            (None, Some(name)) => Err(no_layer(&self.path, file, name)),
            (guide, _) => Ok(guide),
        }
    }

    /// Writes a denoised picture. An EXR file gets all other layers of the file that it comes from,
    /// and the picture as it was as the layer `noisy`.
    ///
    /// # Errors
    /// See [`OutputError`].
    pub fn write_denoised(
        &self,
        denoised: &Denoised,
        path: &Path,
        tone: &ToneMapping,
        encoding: &Encoding,
    ) -> Result<(), OutputError> {
        if Format::of(path)? != Format::Exr {
            return write_image(path, &self.shown(&denoised.picture)?, tone, encoding);
        }
        let plain = || ExrFile::from_image(&self.stored, encoding.exr_precision);
        let mut file = self.file.clone().unwrap_or_else(plain);
        let is_picture = |c: &ExrChannel| {
            self.layer != NOISY
                && c.split().0 == self.layer
                && "RGBA".contains(&c.split().1.to_ascii_uppercase())
        };
        let is_plain = |c: &ExrChannel| c.split().0.is_empty() && "RGBA".contains(c.split().1);
        file.channels.retain(|c| !(is_picture(c) || is_plain(c)));
        file.push_colour(&with_alpha(&denoised.picture, &self.stored), encoding.exr_precision);
        if !file.layer_names().contains(&NOISY) {
            file.push_layer(NOISY, &["R", "G", "B"], &self.stored.to_rgb(), encoding.exr_precision);
        }
        file.metadata.insert("denoiser".into(), denoised.by.clone());
        file.write(path, encoding.exr_compression)?;
        Ok(())
    }
}

/// The layer of a denoised picture as it was.
const NOISY: &str = "noisy";

fn no_layer(path: &Path, file: &ExrFile, name: &str) -> FinishedError {
    let shown = |l: &str| if l.is_empty() { "(without a name)".to_owned() } else { l.to_owned() };
    let known = file.layer_names().into_iter().map(shown).collect::<Vec<_>>().join(", ");
    FinishedError::NoLayer { path: path.to_owned(), name: name.to_owned(), known }
}

/// A picture with the alpha of another of the same size, if that has some.
fn with_alpha(picture: &Image, other: &Image) -> Image {
    if other.channels() < 4 {
        return picture.clone();
    }
    let mut both = other.clone();
    let pixels = both.data_mut().chunks_exact_mut(4).zip(picture.data().chunks_exact(3));
    pixels.for_each(|(out, rgb)| out[..3].copy_from_slice(rgb));
    both
}

/// Writes linear colour in any format but that of layers: tone mapped as PNG and JPEG, as it is as
/// HDR and EXR.
///
/// # Errors
/// See [`OutputError`].
pub fn write_image(
    path: &Path,
    colour: &Image,
    tone: &ToneMapping,
    encoding: &Encoding,
) -> Result<(), OutputError> {
    match Format::of(path)? {
        Format::Png if encoding.png16 => tone.apply(colour).write_png16_encoded(path)?,
        Format::Png => tone.apply(colour).write_png_encoded(path)?,
        Format::Jpeg => tone.apply(colour).write_jpeg_encoded(path)?,
        Format::Hdr => colour.write_hdr(path)?,
        Format::Exr => {
            ExrFile::from_image(colour, encoding.exr_precision).write(path, encoding.exr_compression)?
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use film::{Precision, Rect};

    fn file(layers: &[(&str, [&str; 3], f32)]) -> ExrFile {
        let mut file = ExrFile::new(4, 3, Rect::full(4, 3));
        for (layer, channels, value) in layers {
            file.push_layer(layer, channels, &Image::from_fn(4, 3, |_, _| [*value; 3]), Precision::Float);
        }
        file
    }

    const RGB: [&str; 3] = ["R", "G", "B"];
    const XYZ: [&str; 3] = ["X", "Y", "Z"];

    #[test]
    fn layers_are_found_by_the_names_of_other_renderers() {
        let blender = file(&[
            ("ViewLayer.AO", RGB, 1.0),
            ("ViewLayer.Combined", RGB, 2.0),
            ("ViewLayer.Denoising Albedo", RGB, 3.0),
            ("ViewLayer.DiffCol", RGB, 4.0),
            ("ViewLayer.Denoising Normal", XYZ, 5.0),
        ]);
        let pbrt =
            file(&[("", RGB, 2.0), ("Albedo", RGB, 3.0), ("N", XYZ, 4.0), ("Ns", XYZ, 5.0), ("P", XYZ, 6.0)]);
        let mitsuba = file(&[("<root>", RGB, 2.0), ("albedo", RGB, 3.0), ("sh_normal", XYZ, 5.0)]);
        let ours = file(&[("", RGB, 2.0), ("noisy", RGB, 1.0), ("albedo", RGB, 3.0), ("normal", XYZ, 5.0)]);
        for (name, file) in [("Blender", blender), ("pbrt", pbrt), ("Mitsuba", mitsuba), ("Alhazen", ours)] {
            let value = |image: Option<Image>| image.expect(name).rgb(1, 1)[0];
            assert_eq!(file.picture_layer().expect(name).1.rgb(0, 0), [2.0; 3], "{name}");
            assert_eq!(
                value(file.layer_called(ALBEDO, |_| true).and_then(|l| file.colours(l))),
                3.0,
                "{name}"
            );
            assert_eq!(
                value(file.layer_called(NORMAL, |_| true).and_then(|l| vectors(&file, l))),
                5.0,
                "{name}"
            );
        }
    }

    /// A window within a larger picture, in other primaries: what is shown is the whole in Rec. 709.
    #[test]
    fn windows_and_primaries_are_those_of_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("crop.exr");
        let mut made = ExrFile::new(6, 5, Rect { x: 1, y: 2, width: 4, height: 3 });
        made.push_colour(&Image::from_fn(4, 3, |_, _| [0.5; 3]), Precision::Float);
        made.write(&path, film::ExrCompression::Zip).expect("written");
        let picture = FinishedPicture::open(&path, None).expect("opened");
        assert_eq!((picture.colour().width(), picture.colour().height()), (6, 5));
        assert_eq!([0, 1].map(|x| picture.colour().rgb(x, 2)[0]), [0.0, 0.5]);
        assert_eq!(picture.notes().len(), 1);
        let (denoised, _) = picture.denoise(Denoiser::Network, &LayerNames::default()).expect("denoised");
        let (again, flat) = (folder.path().join("out.exr"), folder.path().join("out.png"));
        let encoding = Encoding::default();
        for to in [&again, &flat] {
            picture.write_denoised(&denoised, to, &ToneMapping::default(), &encoding).expect("written");
        }
        let file = ExrFile::read(&again).expect("read");
        assert_eq!((file.width, file.data_width, file.x), (6, 4, 1));
        assert_eq!(Image::open(&flat).expect("opened").width(), 6);
    }

    #[test]
    fn layers_can_be_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        let made = file(&[("", RGB, 1.0), ("light.left", RGB, 2.0)]);
        made.write(&path, film::ExrCompression::Zip).expect("written");
        let of = |layer| FinishedPicture::open(&path, layer).map(|p| p.colour().rgb(0, 0)[0]);
        assert_eq!((of(None).expect("it"), of(Some("light.left")).expect("it")), (1.0, 2.0));
        let error = of(Some("right")).expect_err("missing").to_string();
        assert!(error.contains("`right`") && error.contains("light.left"), "{error}");
    }

    #[test]
    fn other_layers_stay_and_alpha_too() {
        let folder = tempfile::tempdir().expect("a folder");
        let (from, to) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
        let mut made = file(&[("View.Combined", RGB, 0.5), ("View.Depth", ["Z", "", ""], 7.0)]);
        made.channels.retain(|c| !c.name.ends_with('.'));
        made.push_layer(
            "View.Combined",
            &["", "", "", "A"],
            &Image::from_data(4, 3, 4, vec![0.25; 48]).expect("fits"),
            Precision::Float,
        );
        made.channels.retain(|c| !c.name.ends_with('.'));
        made.write(&from, film::ExrCompression::Zip).expect("written");
        let picture = FinishedPicture::open(&from, None).expect("opened");
        assert_eq!(picture.layer(), "View.Combined");
        let (denoised, guides) =
            picture.denoise(Denoiser::Network, &LayerNames::default()).expect("denoised");
        assert_eq!(guides, Guides::default());
        let encoding = Encoding::default();
        picture.write_denoised(&denoised, &to, &ToneMapping::default(), &encoding).expect("written");
        let file = ExrFile::read(&to).expect("read");
        let mut names: Vec<_> = file.channels.iter().map(|c| c.name.as_str()).collect();
        names.sort_unstable();
        assert_eq!(names, ["A", "B", "G", "R", "View.Depth.Z", "noisy.B", "noisy.G", "noisy.R"]);
        let colour = file.colour().expect("colour");
        assert!(
            (colour.pixel(2, 1)[0] - 0.5).abs() < 1e-3 && colour.pixel(2, 1)[3] == 0.25,
            "{:?}",
            colour.pixel(2, 1)
        );
        assert!(file.metadata["denoiser"].contains("network"));
    }
}
