//! Keys of materials about what lies on the base, and about what is inside of bodies.

use super::Builder;
use super::document::{Context, Entry};
use super::materials::MaterialKeys;
use super::values::{Color, positive, within};
use crate::load::LoadError;
use crate::load::textures::Neutral;
use crate::{ColorSpace, Interior, Iridescence, LAYER_NUMBERS, Layers, Material};
use glam::Vec3;
use std::collections::BTreeMap;

impl Builder<'_> {
    /// Layers and interior of a material.
    pub(super) fn apply_layers(
        &mut self,
        k: &MaterialKeys,
        m: &mut Material,
        c: &Context,
    ) -> Result<(), LoadError> {
        apply_numbers(k, &mut m.layers, c)?;
        apply_colors(k, &mut m.layers, c)?;
        self.apply_layer_textures(k, &mut m.layers, c)?;
        if let Some(distance) = k.attenuation_distance {
            let color = k.attenuation_color.map_or(Vec3::ONE, |color| color.0);
            within(color.max_element(), [0.0, 1.0], "attenuation-color", c)?;
            m.interior = Interior {
                attenuation_color: color,
                attenuation_distance: positive(distance, "attenuation-distance", c)?,
            };
        } else if k.attenuation_color.is_some() {
            return Err(c.error("`attenuation-color` needs `attenuation-distance`"));
        }
        Ok(())
    }

    fn apply_layer_textures(
        &mut self,
        k: &MaterialKeys,
        l: &mut Layers,
        c: &Context,
    ) -> Result<(), LoadError> {
        use ColorSpace::{Linear, Srgb};
        let white = Neutral::White;
        l.clearcoat.texture = self.texture(&k.clearcoat_texture, Linear, white, c)?;
        l.clearcoat.roughness_texture = self.texture(&k.clearcoat_roughness_texture, Linear, white, c)?;
        l.clearcoat.normal_texture =
            self.texture(&k.clearcoat_normal_texture, Linear, Neutral::FlatNormal, c)?;
        l.sheen.color_texture = self.texture(&k.sheen_color_texture, Srgb, white, c)?;
        l.sheen.roughness_texture = self.texture(&k.sheen_roughness_texture, Linear, white, c)?;
        l.specular_texture = self.texture(&k.specular_texture, Linear, white, c)?;
        l.specular_color_texture = self.texture(&k.specular_color_texture, Srgb, white, c)?;
        l.iridescence.texture = self.texture(&k.iridescence_texture, Linear, white, c)?;
        l.iridescence.thickness_texture = self.texture(&k.iridescence_thickness_texture, Linear, white, c)?;
        l.anisotropy.texture = self.texture(&k.anisotropy_texture, Linear, white, c)?;
        let through = &mut l.diffuse_transmission;
        through.texture = self.texture(&k.diffuse_transmission_texture, Linear, white, c)?;
        through.color_texture = self.texture(&k.diffuse_transmission_color_texture, Srgb, white, c)?;
        Ok(())
    }
}

/// The keys of [`LAYER_NUMBERS`] that the file has.
pub(super) fn apply_layer_numbers(entry: Entry, layers: &mut Layers) -> Result<(), LoadError> {
    let context = entry.context();
    let values: BTreeMap<String, f32> = entry.read()?;
    for number in LAYER_NUMBERS {
        if let Some(value) = values.get(number.name) {
            *(number.of)(layers) = within(*value, number.range, number.name, &context)?;
        }
    }
    Ok(())
}

/// Numbers that have a unit or no bounds.
fn apply_numbers(k: &MaterialKeys, l: &mut Layers, c: &Context) -> Result<(), LoadError> {
    l.clearcoat.normal_scale = k.clearcoat_normal_scale.unwrap_or(1.0);
    if let Some([least, most]) = k.iridescence_thickness {
        let nanometres = |x: f32| within(x, [0.0, Iridescence::MOST_THICKNESS], "iridescence-thickness", c);
        l.iridescence.thickness = [nanometres(least)?, nanometres(most)?];
    }
    l.anisotropy.rotation = k.anisotropy_rotation.unwrap_or(0.0).to_radians();
    Ok(())
}

fn apply_colors(k: &MaterialKeys, l: &mut Layers, c: &Context) -> Result<(), LoadError> {
    let color = |value: Option<Color>, into: &mut Vec3, most: f32, key: &str| {
        if let Some(Color(color)) = value {
            within(color.max_element(), [0.0, most], key, c)?;
            *into = color;
        }
        Ok::<(), LoadError>(())
    };
    color(k.sheen_color, &mut l.sheen.color, 1.0, "sheen-color")?;
    color(k.specular_color, &mut l.specular_color, 1e3, "specular-color")?;
    let through = &mut l.diffuse_transmission.color;
    color(k.diffuse_transmission_color, through, 1.0, "diffuse-transmission-color")
}
