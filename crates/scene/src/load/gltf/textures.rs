//! Textures: images, samplers and coordinate transforms.

use super::document::Document;
use super::json::{self, TextureInfo, TextureTransform};
use super::uri::{self, Target};
use crate::animation::TextureMotion;
use crate::load::textures::{Neutral, TextureLoader};
use crate::{
    ColorSpace, Filter, Image, ImageId, LoadReport, Sampler, Texture, TextureId, TextureRef, UvTransform,
    Wrap,
};
use glam::Vec2;
use std::collections::HashMap;

/// Textures and images in use, each once.
pub(super) struct Textures<'d> {
    pub textures: Vec<Texture>,
    loader: TextureLoader<'d>,
    images: HashMap<(u32, Neutral), ImageId>,
    /// By the file's number, the stand-in and whether it is sRGB.
    numbers: HashMap<(u32, Neutral, bool), TextureId>,
}

impl<'d> Textures<'d> {
    pub fn new(document: &'d Document<'_>) -> Self {
        let loader = TextureLoader::new(document.options, 0);
        Self { textures: Vec::new(), loader, images: HashMap::new(), numbers: HashMap::new() }
    }

    /// Decodes the images, in parallel.
    pub fn decode(self, report: &mut LoadReport) -> (Vec<Texture>, Vec<Image>) {
        (self.textures, self.loader.finish(report))
    }

    /// A material's reference to a texture; its set of coordinates is the file's number. `None` if there is no such
    /// texture, which is noted.
    pub fn reference(
        &mut self,
        document: &'d Document<'_>,
        info: &TextureInfo,
        color_space: ColorSpace,
        neutral: Neutral,
        report: &mut LoadReport,
    ) -> Option<TextureRef> {
        let json = &document.json;
        let Some(source) = json.textures.get(info.index as usize) else {
            report.repaired("a material's texture does not exist: left out");
            return None;
        };
        let Some(image) = self.source(document, info.index, source, neutral, report) else {
            report.repaired("a texture has no image: left out");
            return None;
        };
        let sampler = source.sampler.map_or(Sampler::default(), |index| {
            let found = json.samplers.get(index as usize);
            if found.is_none() {
                report.repaired("a texture's sampler does not exist: it repeats and is filtered");
            }
            found.map_or(Sampler::default(), |s| sampler(s, report))
        });
        let next = self.textures.len() as TextureId;
        let texture =
            *self.numbers.entry((info.index, neutral, color_space == ColorSpace::Srgb)).or_insert(next);
        if texture == next {
            self.textures.push(Texture::image(image, sampler, color_space));
        }
        let transform = info.extensions.transform.as_ref();
        let uv_set = transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        let transform = transform.map_or(UvTransform::default(), |t| uv_transform(t, report));
        Some(TextureRef { texture, uv_set, transform })
    }

    /// The image of a texture, or of the extension that replaces it.
    fn source(
        &mut self,
        document: &'d Document<'_>,
        index: u32,
        texture: &json::Texture,
        neutral: Neutral,
        report: &mut LoadReport,
    ) -> Option<ImageId> {
        let webp = texture.extensions.webp.as_ref().and_then(|w| w.source);
        let blocks = [
            ("MSFT_texture_dds", &texture.extensions.dds),
            ("KHR_texture_basisu", &texture.extensions.basisu),
        ];
        let blocks = blocks.into_iter().find_map(|(name, e)| Some((name, e.as_ref()?.source?)));
        let other = texture.extensions.others.keys().next().map(String::as_str);
        if let Some(image) = webp.or(texture.source) {
            // Blocks have lost what the plain image has kept.
            let other = other.or(blocks.map(|(name, _)| name));
            if let Some(name) = other {
                report.info(format!("of textures with {name}, the plain image is used"));
            }
            return self.image(document, image, neutral);
        }
        if let Some((_, image)) = blocks {
            return self.image(document, image, neutral);
        }
        let reason = format!("needs the extension {}, which is not supported yet", other?);
        Some(self.loader.missing(&format!("texture {index}"), reason, neutral))
    }

    fn image(&mut self, document: &'d Document<'_>, index: u32, neutral: Neutral) -> Option<ImageId> {
        if let Some(known) = self.images.get(&(index, neutral)) {
            return Some(*known);
        }
        let id = add(document, &mut self.loader, index, neutral)?;
        self.images.insert((index, neutral), id);
        Some(id)
    }
}

/// Adds image `index` of the file to those that are decoded. `None` if there is no such image.
pub(super) fn add<'d>(
    document: &'d Document<'_>,
    loader: &mut TextureLoader<'d>,
    index: u32,
    neutral: Neutral,
) -> Option<ImageId> {
    let image = document.json.images.get(index as usize)?;
    let name = image.name.as_deref().filter(|n| !n.is_empty());
    let name = name.map_or_else(|| format!("image {index}"), str::to_owned);
    Some(match (&image.uri, image.buffer_view) {
        (Some(uri), _) => match uri::resolve(document.path, &uri.0, document.options) {
            Ok(Target::Data(bytes)) => loader.bytes(&name, bytes, neutral),
            Ok(Target::File(path)) => loader.file(&path, neutral),
            Err(reason) => loader.missing(&name, reason, neutral),
        },
        (None, Some(view)) => match document.view(view) {
            Ok((bytes, _)) => loader.bytes(&name, bytes, neutral),
            Err(error) => loader.missing(&name, error.to_string(), neutral),
        },
        (None, None) => loader.missing(&name, "has neither a URI nor a buffer view", neutral),
    })
}

fn sampler(source: &json::Sampler, report: &mut LoadReport) -> Sampler {
    let mut wrap = |mode: Option<u32>| match mode {
        None | Some(10497) => Wrap::Repeat,
        Some(33071) => Wrap::ClampToEdge,
        Some(33648) => Wrap::MirroredRepeat,
        Some(_) => {
            report.repaired("an unknown wrapping mode was taken as repeat");
            Wrap::Repeat
        }
    };
    let filter = if source.mag_filter == Some(9728) { Filter::Nearest } else { Filter::Linear };
    Sampler { wrap_u: wrap(source.wrap_s), wrap_v: wrap(source.wrap_t), filter }
}

fn uv_transform(source: &TextureTransform, report: &mut LoadReport) -> UvTransform {
    let motion = texture_motion(Some(source));
    let transform = UvTransform::new(motion.offset, motion.rotation, motion.scale);
    let UvTransform { rows, offset } = transform;
    if !(rows[0].is_finite() && rows[1].is_finite() && offset.is_finite()) {
        report.repaired("a texture transform is not finite: left out");
        return UvTransform::default();
    }
    transform
}

/// The parts of `KHR_texture_transform`.
pub(super) fn texture_motion(source: Option<&TextureTransform>) -> TextureMotion {
    let Some(source) = source else { return TextureMotion::default() };
    TextureMotion {
        offset: Vec2::from(source.offset.unwrap_or_default()),
        rotation: source.rotation.unwrap_or(0.0),
        scale: Vec2::from(source.scale.unwrap_or([1.0; 2])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The extension's own example: the lower left quadrant, turned.
    #[test]
    fn the_example_of_the_specification_stays_in_its_quadrant() {
        let source = TextureTransform {
            offset: Some([0.0, 1.0]),
            rotation: Some(std::f32::consts::FRAC_PI_2),
            scale: Some([0.5, 0.5]),
            tex_coord: None,
        };
        let transform = uv_transform(&source, &mut LoadReport::default());
        for corner in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(Vec2::from) {
            let [x, y] = transform.rows.map(|row| row.dot(corner));
            let uv = Vec2::new(x, y) + transform.offset;
            assert!(uv.cmpge(Vec2::new(-1e-6, 0.5 - 1e-6)).all(), "{corner} → {uv}");
            assert!(uv.cmple(Vec2::new(0.5 + 1e-6, 1.0 + 1e-6)).all(), "{corner} → {uv}");
        }
    }
}
