//! The picture that a file is about: which of its layers, in which colours, and where it lies.

use super::primaries::{Primaries, to_rec709};
use super::{ExrChannel, ExrFile};
use crate::{Image, ImageError, Rect, limits};
use std::path::Path;

/// The picture of a file, as it is to be used.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrPicture {
    /// Linear colour with Rec. 709 primaries, with alpha if the file has it. As large as the display window; black, and of
    /// alpha 0, where the file stores nothing.
    pub image: Image,
    /// Name of the layer that it comes from; empty for the one without a name.
    pub layer: String,
    /// What people should know of how it was found, in whole sentences without a full stop.
    pub notes: Vec<String>,
}

/// Names of the picture itself, as [`plain_name`] has them: Blender's `Combined`, Houdini's `C`, and what others call it.
const BEAUTY: &[&str] = &[
    "combined",
    "beauty",
    "rgba",
    "rgb",
    "color",
    "colour",
    "image",
    "radiance",
    "root",
    "final",
    "composite",
    "c",
    "ci",
];

/// The last part of a layer's name, without what is a matter of taste: `ViewLayer.Denoising Albedo`
/// is `denoisingalbedo`.
#[must_use]
pub fn plain_name(layer: &str) -> String {
    plain(layer.rsplit('.').next().unwrap_or_default())
}

fn plain(part: &str) -> String {
    part.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect()
}

impl ExrChannel {
    /// Layer and channel of the full name: what is before and behind the last dot.
    #[must_use]
    pub fn split(&self) -> (&str, &str) {
        self.name.rsplit_once('.').unwrap_or(("", &self.name))
    }
}

impl ExrFile {
    /// Names of layers in order of appearance; the one without a name is `""`.
    #[must_use]
    pub fn layer_names(&self) -> Vec<&str> {
        let mut names = Vec::new();
        for (layer, _) in self.channels.iter().map(ExrChannel::split) {
            if !names.contains(&layer) {
                names.push(layer);
            }
        }
        names
    }

    /// The first layer that is called by one of `wanted`, the first of these first, and that is `usable`. Names are compared as
    /// [`plain_name`] has them; where none fits so, any part between dots counts.
    pub fn layer_called(&self, wanted: &[&str], usable: impl Fn(&str) -> bool) -> Option<&str> {
        let names: Vec<&str> = self.layer_names().into_iter().filter(|name| usable(name)).collect();
        let by = |fits: &dyn Fn(&str, &str) -> bool| {
            wanted.iter().find_map(|wanted| names.iter().copied().find(|name| fits(name, wanted)))
        };
        by(&|name, wanted| plain_name(name) == wanted)
            .or_else(|| by(&|name, wanted| name.split('.').any(|part| plain(part) == wanted)))
    }

    /// The stored pixels of a layer: the channels of three names, in any case, and a fourth if there is one. `None` if one
    /// of the three is missing.
    #[must_use]
    pub fn channels_of(&self, layer: &str, names: [&str; 3], fourth: &str) -> Option<Image> {
        let find = |name: &str| {
            let of =
                |c: &&ExrChannel| c.split().0 == layer && is_called(c.split().1, name) && !name.is_empty();
            self.channels.iter().find(of).map(|c| &c.samples)
        };
        let [first, second, third] = names.map(find);
        let found: Vec<_> = [first?, second?, third?].into_iter().chain(find(fourth)).collect();
        self.interleave(&found)
    }

    /// The stored pixels of a layer's colour as the file has them: red, green, blue and, if there is one, alpha.
    #[must_use]
    pub fn colours(&self, layer: &str) -> Option<Image> {
        self.channels_of(layer, ["R", "G", "B"], "A")
    }

    /// The layer that is the picture and its stored pixels as the file has them: what is without a layer, what programs call
    /// the picture, or the first layer with colours; else luminance, or the only channel, as grey.
    #[must_use]
    pub fn picture_layer(&self) -> Option<(String, Image)> {
        let of = |layer: &str| Some((layer.to_owned(), self.colours(layer)?));
        let names = self.layer_names();
        let has_colours = |layer: &str| self.has_colours(layer);
        let first = || {
            // Shares of ids are no colours, though they are called so.
            let is_matte = |name: &str| plain_name(name).starts_with("crypto");
            names
                .iter()
                .copied()
                .filter(|n| !is_matte(n))
                .find_map(of)
                .or_else(|| names.iter().copied().find_map(of))
        };
        of("").or_else(|| of(self.layer_called(BEAUTY, has_colours)?)).or_else(first).or_else(|| self.grey())
    }

    /// Luminance as grey, of the layer without a name first, or a channel that is the only one.
    fn grey(&self) -> Option<(String, Image)> {
        let is_luminance = |c: &&ExrChannel| c.split().1.eq_ignore_ascii_case("Y");
        let plain = self.channels.iter().find(|c| c.split().0.is_empty() && is_luminance(c));
        let only = || match &self.channels[..] {
            [only] if is_called(only.split().1, "R") => Some(only),
            _ => None,
        };
        let channel = plain.or_else(|| self.channels.iter().find(is_luminance)).or_else(only)?;
        let image = self.interleave(&[&channel.samples; 3])?;
        Some((channel.split().0.to_owned(), image))
    }

    fn has_colours(&self, layer: &str) -> bool {
        let has =
            |name: &str| self.channels.iter().any(|c| c.split().0 == layer && is_called(c.split().1, name));
        has("R") && has("G") && has("B")
    }

    /// The picture that the file is about.
    ///
    /// - `path`: what errors call the file.
    ///
    /// # Errors
    /// [`ImageError::NoColour`]; [`ImageError::TooLarge`] if the display window is out of all proportion to what is stored.
    pub fn picture(&self, path: &Path) -> Result<ExrPicture, ImageError> {
        let no_colour = || ImageError::NoColour {
            path: path.to_owned(),
            found: self.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", "),
        };
        let (layer, stored) = self.picture_layer().ok_or_else(no_colour)?;
        let mut notes = Vec::new();
        let quoted = |name: &str| {
            if name.is_empty() {
                "the layer without a name".to_owned()
            } else {
                format!("the layer `{name}`")
            }
        };
        let others = self.layer_names().into_iter().filter(|name| *name != layer && self.has_colours(name));
        let others: Vec<_> = others.map(quoted).collect();
        if !others.is_empty() {
            notes.push(format!("{} is the picture; there are also {}", quoted(&layer), others.join(", ")));
        }
        if self.primaries.is_some() {
            notes.push("colours are converted from the file's primaries to Rec. 709".to_owned());
        }
        if !self.covers_display() {
            notes.push(format!(
                "{} × {} of {} × {} pixels are stored: what is outside is black",
                self.data_width, self.data_height, self.width, self.height
            ));
        }
        let image = self.on_display(path, &self.as_rec709(&stored))?;
        Ok(ExrPicture { image, layer, notes })
    }

    /// Stored colours with Rec. 709 primaries. White stays white.
    #[must_use]
    pub fn as_rec709(&self, stored: &Image) -> Image {
        let Some(matrix) = self.primaries.as_ref().and_then(to_rec709) else { return stored.clone() };
        let mut converted = stored.clone();
        let channels = converted.channels();
        for pixel in converted.data_mut().chunks_exact_mut(channels).filter(|pixel| pixel.len() >= 3) {
            let rgb = [pixel[0], pixel[1], pixel[2]].map(f64::from);
            for (row, value) in matrix.iter().zip(pixel) {
                *value = (row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]) as f32;
            }
        }
        converted
    }

    /// Stored pixels where they belong in the whole picture, which is zero elsewhere.
    ///
    /// # Errors
    /// [`ImageError::TooLarge`] if the display window is out of all proportion to what is stored.
    pub fn on_display(&self, path: &Path, stored: &Image) -> Result<Image, ImageError> {
        if self.x == 0 && self.y == 0 && (self.data_width, self.data_height) == (self.width, self.height) {
            return Ok(stored.clone());
        }
        let (width, height, channels) = (u64::from(self.width), u64::from(self.height), stored.channels());
        let allowed = limits::decoded_bytes(size_of_val(stored.data()) as u64);
        if limits::bytes(width, height, channels as u64).is_none_or(|bytes| bytes > allowed) {
            let channels = channels as u64;
            return Err(ImageError::TooLarge { path: path.to_owned(), width, height, channels });
        }
        let mut display = Image::black(self.width, self.height, channels);
        let seen = self.stored_on_display();
        let row_length = seen.width as usize * channels;
        for y in seen.y..seen.y + seen.height {
            let from_row = (i64::from(y) - i64::from(self.y)) as usize;
            let from_column = (i64::from(seen.x) - i64::from(self.x)) as usize;
            let from = (from_row * self.data_width as usize + from_column) * channels;
            let to = (y as usize * self.width as usize + seen.x as usize) * channels;
            display.data_mut()[to..to + row_length].copy_from_slice(&stored.data()[from..from + row_length]);
        }
        Ok(display)
    }

    /// The part of the display window that is stored.
    fn stored_on_display(&self) -> Rect {
        let span = |at: i32, stored: u32, display: u32| {
            let (low, high) = (i64::from(at), i64::from(at) + i64::from(stored));
            let (low, high) = (low.clamp(0, display.into()), high.clamp(0, display.into()));
            (low as u32, (high - low) as u32) // within the display
        };
        let (x, width) = span(self.x, self.data_width, self.width);
        let (y, height) = span(self.y, self.data_height, self.height);
        Rect { x, y, width, height }
    }

    fn covers_display(&self) -> bool {
        let seen = self.stored_on_display();
        (seen.width, seen.height) == (self.width, self.height)
    }

    /// The same file for numbers that are no colours: they are used as they are.
    #[must_use]
    pub fn without_primaries(self) -> Self {
        Self { primaries: None, ..self }
    }

    /// The same file, whose colours are by other primaries than those of Rec. 709.
    #[must_use]
    pub fn with_primaries(self, primaries: Primaries) -> Self {
        Self { primaries: Some(primaries), ..self }
    }

    /// The primaries of colours, where they are not Rec. 709: of red, green, blue and white, CIE x and y.
    #[must_use]
    pub fn primaries(&self) -> Option<&Primaries> {
        self.primaries.as_ref()
    }
}

/// Whether a channel is `name` (`R`, `G`, `B`, `A`, or anything else), in any case or written out.
fn is_called(channel: &str, name: &str) -> bool {
    let long = match name {
        "R" => "red",
        "G" => "green",
        "B" => "blue",
        "A" => "alpha",
        _ => name,
    };
    channel.eq_ignore_ascii_case(name) || channel.eq_ignore_ascii_case(long)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ExrCompression, Precision};

    const RGB: [&str; 3] = ["R", "G", "B"];

    fn file(layers: &[(&str, [&str; 3], f32)]) -> ExrFile {
        let mut file = ExrFile::new(4, 3, Rect::full(4, 3));
        for (layer, channels, value) in layers {
            file.push_layer(layer, channels, &Image::from_fn(4, 3, |_, _| [*value; 3]), Precision::Float);
        }
        file
    }

    fn picture(file: &ExrFile) -> ExrPicture {
        file.picture(Path::new("a.exr")).expect("a picture")
    }

    #[test]
    fn the_beauty_is_taken_and_named() {
        let rgba = |name| file(&[("AO", RGB, 1.0), (name, RGB, 2.0), ("Z", RGB, 3.0)]);
        for name in
            ["", "ViewLayer.Combined", "Beauty", "rgba.main", "RGB", "C", "<root>", "View Layer.final"]
        {
            let found = picture(&rgba(name));
            assert_eq!((found.image.rgb(1, 1), found.layer.as_str()), ([2.0; 3], name));
            let [note] = &found.notes[..] else { panic!("{:?}", found.notes) };
            assert!(note.contains("`AO`") && note.contains("`Z`") && note.contains(name), "{note}");
        }
        let alone = picture(&file(&[("normal", ["X", "Y", "Z"], 1.0), ("", RGB, 2.0)]));
        assert_eq!((alone.image.rgb(0, 0), alone.notes.len()), ([2.0; 3], 0), "normals are no colours");
        let neither = picture(&file(&[("crypto00", ["r", "g", "b"], 1.0), ("emit", RGB, 2.0)]));
        assert_eq!((neither.layer.as_str(), neither.notes.len()), ("emit", 1));
        let written_out = picture(&file(&[("", ["red", "green", "blue"], 2.0), ("albedo", RGB, 1.0)]));
        assert_eq!(written_out.image.rgb(0, 0), [2.0; 3]);
        let mut single = file(&[("", ["R", "", ""], 0.5)]);
        single.channels.truncate(1);
        assert_eq!(picture(&single).image.rgb(2, 2), [0.5; 3], "a single channel is grey");
        single.channels[0].name = "Z".into();
        assert!(matches!(single.picture(Path::new("a.exr")), Err(ImageError::NoColour { .. })));
    }

    #[test]
    fn what_is_not_stored_is_black_and_what_is_outside_is_cut_off() {
        let mut inside = ExrFile::new(4, 3, Rect { x: 1, y: 1, width: 2, height: 1 });
        inside.push_colour(&Image::from_fn(2, 1, |x, _| [1.0 + x as f32; 3]), Precision::Float);
        let found = picture(&inside);
        assert_eq!((found.image.width(), found.image.height(), found.notes.len()), (4, 3, 1));
        assert_eq!([0, 1, 2, 3].map(|x| found.image.rgb(x, 1)[0]), [0.0, 1.0, 2.0, 0.0]);
        assert_eq!(found.image.rgb(1, 0), [0.0; 3]);
        // Two columns more on the left and one more row above than the display shows.
        let mut larger = ExrFile::new(2, 2, Rect::full(5, 4));
        (larger.x, larger.y) = (-2, -1);
        larger.push_colour(&Image::from_fn(5, 4, |x, y| [(10 * y + x) as f32; 3]), Precision::Float);
        let found = picture(&larger);
        let values = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| found.image.rgb(x, y)[0]);
        assert_eq!((values, found.notes.len()), ([12.0, 13.0, 22.0, 23.0], 0));
        // Nothing of it is on the display.
        larger.x = 7;
        assert_eq!(picture(&larger).image.mean(), Image::black(2, 2, 3).mean());
        larger.width = 60_000;
        larger.height = 60_000;
        assert!(matches!(larger.picture(Path::new("a.exr")), Err(ImageError::TooLarge { .. })));
    }

    /// Display P3 and Rec. 2020 have the white of Rec. 709, ACES has another.
    #[test]
    fn other_primaries_become_those_of_rec_709() {
        let p3 = [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06], [0.3127, 0.329]];
        let rec2020 = [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046], [0.3127, 0.329]];
        let aces = [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], [0.32168, 0.33767]];
        // Published matrices; that of ACES is with Bradford's adaptation.
        let expected =
            [[1.22494, -0.04206, -0.01964], [1.66049, -0.12455, -0.01815], [2.52169, -0.27648, -0.01538]];
        for (primaries, red) in [p3, rec2020, aces].into_iter().zip(expected) {
            let mut file = file(&[("", RGB, 1.0)]);
            file.primaries = Some(primaries);
            let found = picture(&file);
            let white = found.image.rgb(0, 0);
            assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-3), "{white:?}");
            assert_eq!(found.notes.len(), 1);
            for channel in file.channels.iter_mut().filter(|c| c.name != "R") {
                channel.samples = crate::ExrSamples::Float(vec![0.0; 12]);
            }
            let of_red = picture(&file).image.rgb(0, 0);
            let close = of_red.iter().zip(red).all(|(a, b)| (a - b).abs() < 2e-3);
            assert!(close, "{of_red:?} for {red:?}");
        }
    }

    #[test]
    fn primaries_survive_a_file() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("a.exr");
        let mut wide = file(&[("", RGB, 1.0)]);
        assert_eq!(wide.primaries(), None);
        wide.primaries = Some([[0.708, 0.292], [0.17, 0.797], [0.131, 0.046], [0.3127, 0.329]]);
        wide.write(&path, ExrCompression::Zip).expect("written");
        let back = ExrFile::read(&path).expect("read");
        assert_eq!(back.primaries(), wide.primaries());
        wide.primaries = None;
        wide.write(&path, ExrCompression::Zip).expect("written");
        assert_eq!(ExrFile::read(&path).expect("read").primaries(), None, "Rec. 709 needs no conversion");
    }
}
