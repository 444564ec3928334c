//! Extensions that lie on the base of a material: coats, fibres, films, grain, and light that shines through.

use super::json::{self, MaterialExtensions};
use super::materials::Converter;
use crate::load::textures::Neutral;
use crate::{
    Anisotropy, Clearcoat, ColorSpace, DiffuseTransmission, Interior, Iridescence, Layers, Material, Sheen,
};
use glam::Vec3;

impl Converter<'_, '_, '_> {
    /// Everything that the base does not have.
    pub(super) fn layers(&mut self, source: &MaterialExtensions, material: &mut Material) {
        let layers = &mut material.layers;
        if let Some(clearcoat) = &source.clearcoat {
            layers.clearcoat = self.clearcoat(clearcoat);
        }
        if let Some(sheen) = &source.sheen {
            layers.sheen = self.sheen(sheen);
        }
        if let Some(iridescence) = &source.iridescence {
            layers.iridescence = self.iridescence(iridescence);
        }
        if let Some(anisotropy) = &source.anisotropy {
            layers.anisotropy = self.anisotropy(anisotropy);
        }
        if let Some(through) = &source.diffuse_transmission {
            layers.diffuse_transmission = self.diffuse_transmission(through);
        }
        if layers.clearcoat.strength > 0.0 && material.emission.max_element() > 0.0 {
            self.report.approximated("a clear coat does not dim the light that is emitted below it");
        }
        let refracts = material.transmission > 0.0 && !material.thin_walled;
        if let Some(dispersion) = source.dispersion.as_ref().filter(|_| refracts) {
            layers.dispersion = self.factors().finite(dispersion.dispersion, 0.0, "dispersion").max(0.0);
        }
    }

    fn clearcoat(&mut self, source: &json::Clearcoat) -> Clearcoat {
        let strength = self.factors().unit(source.clearcoat_factor, 0.0, "clearcoat");
        if strength == 0.0 {
            return Clearcoat::default(); // its textures have no effect and are not read
        }
        let normal = &source.clearcoat_normal_texture;
        let scale = normal.as_ref().and_then(|t| t.scale);
        Clearcoat {
            strength,
            texture: self.data_texture(&source.clearcoat_texture),
            roughness: self.factors().unit(source.clearcoat_roughness_factor, 0.0, "clearcoat roughness"),
            roughness_texture: self.data_texture(&source.clearcoat_roughness_texture),
            normal_texture: self.texture(normal, ColorSpace::Linear, Neutral::FlatNormal),
            normal_scale: self.factors().finite(scale, 1.0, "clearcoat normal texture scale"),
        }
    }

    fn sheen(&mut self, source: &json::Sheen) -> Sheen {
        let color = self.color(source.sheen_color_factor, Vec3::ZERO, "sheen colour");
        if color == Vec3::ZERO {
            return Sheen::default();
        }
        Sheen {
            color,
            color_texture: self.color_texture(&source.sheen_color_texture),
            roughness: self.factors().unit(source.sheen_roughness_factor, 0.0, "sheen roughness"),
            roughness_texture: self.data_texture(&source.sheen_roughness_texture),
        }
    }

    fn iridescence(&mut self, source: &json::Iridescence) -> Iridescence {
        let strength = self.factors().unit(source.iridescence_factor, 0.0, "iridescence");
        if strength == 0.0 {
            return Iridescence::default();
        }
        let mut f = self.factors();
        let ior =
            f.within(source.iridescence_ior, 1.3, [1.0, Iridescence::MOST_IOR], "film's index of refraction");
        let thickness = [0.0, Iridescence::MOST_THICKNESS];
        let least = f.within(source.iridescence_thickness_minimum, 100.0, thickness, "film's thickness");
        let most = f.within(source.iridescence_thickness_maximum, 400.0, thickness, "film's thickness");
        Iridescence {
            strength,
            texture: self.data_texture(&source.iridescence_texture),
            ior,
            thickness: [least, most],
            thickness_texture: self.data_texture(&source.iridescence_thickness_texture),
        }
    }

    fn anisotropy(&mut self, source: &json::Anisotropy) -> Anisotropy {
        let strength = self.factors().unit(source.anisotropy_strength, 0.0, "anisotropy");
        if strength == 0.0 {
            return Anisotropy::default();
        }
        Anisotropy {
            strength,
            rotation: self.factors().finite(source.anisotropy_rotation, 0.0, "rotation of the anisotropy"),
            texture: self.data_texture(&source.anisotropy_texture),
        }
    }

    fn diffuse_transmission(&mut self, source: &json::DiffuseTransmission) -> DiffuseTransmission {
        let strength = self.factors().unit(source.diffuse_transmission_factor, 0.0, "diffuse transmission");
        if strength == 0.0 {
            return DiffuseTransmission::default();
        }
        let color = source.diffuse_transmission_color_factor;
        DiffuseTransmission {
            strength,
            texture: self.data_texture(&source.diffuse_transmission_texture),
            color: self.color(color, Vec3::ONE, "diffuse transmission colour"),
            color_texture: self.color_texture(&source.diffuse_transmission_color_texture),
        }
    }

    /// `KHR_materials_specular` and `KHR_materials_ior`.
    pub(super) fn specular_and_ior(&mut self, extensions: &MaterialExtensions, material: &mut Material) {
        if let Some(specular) = &extensions.specular {
            material.specular = self.factors().unit(specular.specular_factor, 1.0, "specular");
            let color = Vec3::from(specular.specular_color_factor.unwrap_or([1.0; 3]));
            if color.is_finite() && color.min_element() >= 0.0 {
                material.layers.specular_color = color;
            } else {
                self.report.repaired("a specular colour that is negative or not finite was set to white");
            }
            if material.specular > 0.0 {
                material.layers.specular_texture = self.data_texture(&specular.specular_texture);
                material.layers.specular_color_texture = self.color_texture(&specular.specular_color_texture);
            } else {
                // Nothing is reflected, so its colour does not matter.
                material.layers.specular_color = Vec3::ONE;
            }
        }
        let Some(ior) = extensions.ior.as_ref().and_then(|i| i.ior) else { return };
        if ior == 0.0 {
            material.layers.specular_is_reflectance = true;
            return;
        }
        material.ior = self.factors().finite(Some(ior), 1.5, "index of refraction");
        if material.ior < 1.0 {
            self.report.repaired("an index of refraction below 1 was set to 1");
            material.ior = 1.0;
        }
    }

    /// `KHR_materials_volume`: what is inside of a body that light is refracted into.
    pub(super) fn interior(&mut self, volume: &json::Volume) -> Interior {
        let distance = volume.attenuation_distance.unwrap_or(f32::INFINITY);
        if distance.is_nan() || distance <= 0.0 {
            self.report.repaired("an attenuation distance that is not positive was taken as infinite");
            return Interior::default();
        }
        Interior {
            attenuation_color: self.color(volume.attenuation_color, Vec3::ONE, "attenuation colour"),
            attenuation_distance: distance,
        }
    }

    /// `KHR_materials_pbrSpecularGlossiness`: a dielectric that reflects the specular colour, whatever its index of
    /// refraction, and dims what is below by it.
    pub(super) fn specular_glossiness(&mut self, source: &json::SpecularGlossiness, material: &mut Material) {
        material.base_color = self.factors().color(source.diffuse_factor, "diffuse");
        material.base_color_texture = self.color_texture(&source.diffuse_texture);
        material.metallic = 0.0;
        material.roughness = 1.0 - self.factors().unit(source.glossiness_factor, 1.0, "glossiness");
        let texture = self.color_texture(&source.specular_glossiness_texture);
        material.layers = Layers {
            specular_color: self.color(source.specular_factor, Vec3::ONE, "specular"),
            specular_color_texture: texture,
            glossiness: texture.is_some(),
            specular_is_reflectance: true,
            ..Layers::default()
        };
    }

    /// A colour without alpha, each channel in `[0, 1]`.
    fn color(&mut self, value: Option<[f32; 3]>, default: Vec3, what: &str) -> Vec3 {
        let Some([r, g, b]) = value else { return default };
        self.factors().color(Some([r, g, b, 1.0]), what).truncate()
    }
}
