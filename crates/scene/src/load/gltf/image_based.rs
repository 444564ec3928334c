//! Image-based lights (`EXT_lights_image_based`): the scene's environment, as pictures on the faces of a cube.
//!
//! The file also has blurred copies of the pictures and coefficients of irradiance, for renderers that do not trace rays. Both follow from
//! the sharp pictures and are not used.

use super::document::Document;
use super::json;
use super::textures;
use crate::load::cube_map::{self, Face};
use crate::load::textures::{Neutral, TextureLoader};
use crate::{Environment, Image, ImageId, LoadError, LoadReport, Pixels};
use glam::Quat;
use optics::tonemap::srgb_decode_channel;

impl Document<'_> {
    /// The environment of the scene and its picture, which will be image `number`; `None` if it has no image-based light.
    ///
    /// # Errors
    /// A light or an image that does not exist, and a light that has not six sharp pictures.
    pub fn image_based_light(
        &self,
        scene: Option<&json::Scene>,
        number: ImageId,
        report: &mut LoadReport,
    ) -> Result<Option<(Environment, Image)>, LoadError> {
        let Some(reference) = scene.and_then(|s| s.extensions.image_based.as_ref()) else { return Ok(None) };
        let lights = self.json.extensions.image_based.as_ref().map(|l| &l.lights[..]).unwrap_or_default();
        let light = self.get(lights, reference.light, "image-based light")?;
        let faces = self.faces(light, reference.light, report)?;
        let intensity = light.intensity.unwrap_or(1.0);
        let intensity = if intensity.is_finite() && intensity >= 0.0 {
            intensity
        } else {
            report.repaired("the intensity of an image-based light is not a number ≥ 0: it is taken as 1");
            1.0
        };
        let rotation = Quat::from_array(light.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
        let rotation = if rotation.is_finite() && rotation.length_squared() > 1e-12 {
            rotation.normalize()
        } else {
            report.repaired("the rotation of an image-based light is no quaternion: it is not turned");
            Quat::IDENTITY
        };
        let name = light.name.as_deref().filter(|n| !n.is_empty()).unwrap_or("image-based light");
        let image = cube_map::equirectangular(name, &faces, rotation);
        Ok(Some((Environment::Image { image: number, rotation: 0.0, intensity }, image)))
    }

    /// The pictures of the sharpest level.
    fn faces(
        &self,
        light: &json::ImageBasedLight,
        number: u32,
        report: &mut LoadReport,
    ) -> Result<[Face; 6], LoadError> {
        let level = light.specular_images.first().map(Vec::as_slice).unwrap_or_default();
        let numbers = <[u32; 6]>::try_from(level).map_err(|_| {
            let message = format!("the first level has {} images, a cube has 6", level.len());
            self.malformed(format!("image-based light {number}"), message)
        })?;
        let mut loader = TextureLoader::new(self.options, 0);
        let mut order = Vec::new();
        for image in numbers {
            self.get(&self.json.images, image, "image")?;
            // Images that are used twice are decoded once.
            order.extend(textures::add(self, &mut loader, image, Neutral::Black));
        }
        let mut notes = LoadReport::default();
        let images = loader.finish(&mut notes);
        report.bytes_read += notes.bytes_read;
        notes.notes.into_iter().for_each(|note| report.note(note.severity, note.message));
        let size = (images[0].width, images[0].height);
        if images.iter().any(|i| (i.width, i.height) != size || i.width != i.height) {
            report.repaired(
                "the pictures of an image-based light are not squares of one size: they are stretched",
            );
        }
        // One picture may be that of all faces, each of which has numbers of its own; and they become another picture.
        let pixels =
            order.iter().map(|&i| u64::from(images[i as usize].width) * u64::from(images[i as usize].height));
        let radiance = size_of::<[f32; 3]>() as u64;
        self.options
            .budget()
            .take(pixels.sum::<u64>().saturating_mul(2 * radiance), "images of the environment")?;
        Ok(std::array::from_fn(|i| face(&images[order[i] as usize])))
    }
}

/// The radiance of a picture: of eight bits, sRGB divided by alpha (RGBD), which is 1 where a file has no alpha.
///
/// The extension does not say which transfer function RGBD has; this is the one of its first implementation.
fn face(image: &Image) -> Face {
    let linear = |v: u8| srgb_decode_channel(f32::from(v) / 255.0);
    let pixels = match &image.pixels {
        Pixels::Rgb32F(_) | Pixels::Rgba32F(_) => image.pixels.clone().into_linear(),
        Pixels::Rgba8(pixels) => {
            // Alpha 0 would be infinitely bright; the least that can be written is 1.
            let radiance =
                |[r, g, b, d]: &[u8; 4]| [*r, *g, *b].map(|v| linear(v) * 255.0 / f32::from((*d).max(1)));
            pixels.iter().map(radiance).collect()
        }
    };
    Face { width: image.width, height: image.height, pixels }
}
