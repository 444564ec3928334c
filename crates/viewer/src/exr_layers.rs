//! Layers and channels of EXR files: which a file has, and what they look like.

use alhazen::{ExrFile, ExrSamples, Image, ImageError};
use std::path::Path;

/// Which layer of a file is shown, and whether only one of its channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LayerChoice {
    /// Number of the layer; see [`ExrLayers::names`].
    pub layer: usize,
    /// Number of the channel that is shown as grey; `None` shows them as a colour.
    pub channel: Option<usize>,
}

/// A layer of a file.
#[derive(Clone, Debug)]
struct Layer {
    name: String,
    /// Names of its channels, as the file orders colours: R, G, B, A first, then by the alphabet.
    channels: Vec<String>,
}

/// What an EXR file has.
#[derive(Debug)]
pub struct ExrLayers {
    file: ExrFile,
    /// The picture itself comes first.
    layers: Vec<Layer>,
    /// The picture itself, with Rec. 709 primaries.
    picture: Image,
}

impl ExrLayers {
    /// Reads a file.
    ///
    /// # Errors
    /// As [`ExrFile::read`], and [`ImageError::NoColour`] for files that have no picture at all.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let file = ExrFile::read(path)?;
        let main = file.picture(path)?;
        let mut names: Vec<String> = file.layer_names().into_iter().map(str::to_owned).collect();
        names.sort_by_key(|name| *name != main.layer);
        let layer = |name: String| {
            let mut channels: Vec<String> = file
                .channels
                .iter()
                .filter(|channel| channel.split().0 == name)
                .map(|channel| channel.split().1.to_owned())
                .collect();
            let rank = |name: &str| "RGBA".find(name).unwrap_or(4);
            channels.sort_by(|a, b| (rank(a), a).cmp(&(rank(b), b)));
            Layer { name, channels }
        };
        let layers = names.into_iter().map(layer).collect();
        Ok(Self { picture: main.image.to_rgb(), layers, file })
    }

    /// Whether there is anything to choose.
    pub fn has_choice(&self) -> bool {
        self.layers.len() > 1 || self.layers.iter().any(|layer| layer.channels.len() > 1)
    }

    /// The picture itself, as the default choice shows it.
    pub fn picture(&self) -> &Image {
        &self.picture
    }

    /// Names of the layers; the one without a name is that of the picture.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.layers.iter().map(|layer| if layer.name.is_empty() { "picture" } else { &layer.name })
    }

    /// Names of the channels of a layer.
    pub fn channels(&self, layer: usize) -> &[String] {
        self.layers.get(layer).map_or(&[], |layer| &layer.channels)
    }

    /// What a choice looks like: three channels, as large as the whole picture, 0 where the file stores nothing. `None` for
    /// what the file does not have.
    pub fn image(&self, choice: LayerChoice) -> Option<Image> {
        if choice == LayerChoice::default() {
            return Some(self.picture.clone());
        }
        let layer = self.layers.get(choice.layer)?;
        let chosen: Vec<&String> = match choice.channel {
            Some(channel) => vec![layer.channels.get(channel)?; 3],
            // One channel is grey, two have no third one.
            None if layer.channels.len() == 1 => vec![&layer.channels[0]; 3],
            None => layer.channels.iter().take(3).collect(),
        };
        let mut image = Image::black(self.file.width, self.file.height, 3);
        for (place, channel) in chosen.into_iter().enumerate() {
            let samples = self.file.channels.iter().find(|c| c.split() == (&layer.name, channel))?;
            self.put(&samples.samples, place, &mut image);
        }
        Some(image)
    }

    /// Writes stored values into a channel of the whole picture.
    fn put(&self, samples: &ExrSamples, channel: usize, image: &mut Image) {
        let file = &self.file;
        let value = |i: usize| match samples {
            ExrSamples::Half(values) | ExrSamples::Float(values) => values.get(i).copied(),
            ExrSamples::Uint(values) => values.get(i).map(|value| *value as f32),
        };
        let (width, height) = (file.width as usize, i64::from(file.height));
        for i in 0..file.data_width as usize * file.data_height as usize {
            let x = i64::from(file.x) + (i % file.data_width as usize) as i64;
            let y = i64::from(file.y) + (i / file.data_width as usize) as i64;
            if (0..width as i64).contains(&x) && (0..height).contains(&y) {
                image.data_mut()[(y as usize * width + x as usize) * 3 + channel] = value(i).unwrap_or(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::{ExrChannel, ExrCompression, Rect};

    #[test]
    fn layers_and_channels_are_listed_and_lie_where_they_are_stored() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("layers.exr");
        let mut file = ExrFile::new(4, 3, Rect { x: 1, y: 1, width: 2, height: 1 });
        let channels = [("depth.Z", 7.0), ("normal.X", 0.1), ("normal.Y", 0.2), ("normal.Z", 0.3)];
        let colours = [("B", 0.75), ("G", 0.5), ("R", 0.25)];
        for (name, value) in channels.into_iter().chain(colours) {
            let samples = ExrSamples::Float(vec![value, value * 2.0]);
            file.channels.push(ExrChannel { name: name.into(), samples });
        }
        file.write(&path, ExrCompression::None).expect("written");
        let layers = ExrLayers::read(&path).expect("a picture");
        assert_eq!(layers.names().collect::<Vec<_>>(), ["picture", "depth", "normal"]);
        assert_eq!(
            (layers.channels(0), layers.has_choice()),
            (&["R", "G", "B"].map(str::to_owned)[..], true)
        );
        let at = |layer: usize, channel: Option<usize>| {
            let image = layers.image(LayerChoice { layer, channel }).expect("it is there");
            assert_eq!((image.width(), image.height(), image.rgb(0, 0)), (4, 3, [0.0; 3]));
            image.rgb(2, 1)
        };
        assert_eq!(at(0, None), [0.5, 1.0, 1.5]);
        assert_eq!(at(0, Some(1)), [1.0; 3]);
        assert_eq!(at(1, None), [14.0; 3], "one channel is grey");
        assert_eq!(at(2, None), [0.2, 0.4, 0.6]);
        assert_eq!(at(2, Some(2)), [0.6; 3]);
        assert!(layers.image(LayerChoice { layer: 3, channel: None }).is_none());
        assert!(layers.image(LayerChoice { layer: 1, channel: Some(1) }).is_none());
    }
}
