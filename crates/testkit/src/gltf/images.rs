//! Pictures of a few pixels and what reads them.

use super::File;
use serde_json::{Value, json};
use std::io::Cursor;

impl File<'_, '_> {
    pub(super) fn add_textures(&mut self) {
        for _ in 0..self.choices.below(4) {
            let image = self.picture();
            let view = self.add_view(&image, None);
            self.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
        }
        if self.images.is_empty() {
            return;
        }
        for _ in 0..1 + self.choices.below(4) {
            let source = self.choices.index(self.images.len());
            let texture = match self.choices.below(12) {
                0 => json!({ "extensions": { "KHR_texture_basisu": { "source": source } } }),
                1 => json!({ "extensions": { "EXT_texture_webp": { "source": source } }, "source": source }),
                _ => json!({ "source": source }),
            };
            self.textures.push(texture);
        }
    }

    /// A file of one of the formats that textures have; sometimes cut off or with a byte changed.
    fn picture(&mut self) -> Vec<u8> {
        let (width, height) = (1 + self.choices.below(5) as u32, 1 + self.choices.below(5) as u32);
        let format = self.choices.one_of(&[
            image::ImageFormat::Png,
            image::ImageFormat::Png,
            image::ImageFormat::Jpeg,
            image::ImageFormat::WebP,
        ]);
        let has_alpha = format != image::ImageFormat::Jpeg && self.choices.once_in(2);
        let pixels =
            (0..width * height * if has_alpha { 4 } else { 3 }).map(|_| self.choices.byte()).collect();
        let image = if has_alpha {
            image::RgbaImage::from_raw(width, height, pixels).map(image::DynamicImage::from)
        } else {
            image::RgbImage::from_raw(width, height, pixels).map(image::DynamicImage::from)
        };
        let mut file = Vec::new();
        // There are as many pixels as the sizes say, and memory can be written to.
        let written = image.map(|image| image.write_to(&mut Cursor::new(&mut file), format));
        assert!(matches!(written, Some(Ok(()))), "{written:?}");
        if self.choices.once_in(16) {
            let place = self.choices.below(file.len());
            file[place] = self.choices.byte();
        }
        if self.choices.once_in(32) {
            file.truncate(self.choices.below(file.len()));
        }
        file
    }

    /// A use of a texture, if there are any.
    pub(super) fn texture_use(&mut self) -> Option<Value> {
        if self.textures.is_empty() || self.choices.once_in(2) {
            return None;
        }
        let mut texture = json!({ "index": self.choices.index(self.textures.len()) });
        if self.choices.once_in(6) {
            texture["texCoord"] = json!(self.choices.below(3));
        }
        if self.choices.once_in(4) {
            let (offset, scale): ([f64; 2], [f64; 2]) = (self.numbers(), self.numbers());
            let rotation = self.choices.number();
            texture["extensions"] = json!({ "KHR_texture_transform":
                { "offset": offset, "scale": scale, "rotation": rotation } });
        }
        if self.choices.once_in(8) {
            texture["scale"] = json!(self.choices.number());
        }
        Some(texture)
    }
}
