//! Materials as files describe them: a model, its parameters and the textures that modulate them.

use crate::image::{TextureRef, UvTransform};
use crate::layers::Layers;
use crate::medium::Medium;
use crate::subsurface::Subsurface;
use elementary::log;
use glam::{Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Which scattering model a material uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// glTF 2.0 metallic-roughness (Appendix B), with `transmission` mixing in a dielectric.
    #[default]
    MetallicRoughness,
    /// Ideal diffuse reflection of `base_color`.
    Lambert,
    /// Clear or rough dielectric boundary of index `ior`, tinted by `base_color`; smooth where `roughness` is 0.
    Dielectric,
    /// Ideal specular reflection of `base_color`.
    Mirror,
    /// Not lit: shows `base_color` as if it were emitted (`KHR_materials_unlit`), reflects nothing.
    Unlit,
    /// No surface at all, only the end of [`Material::medium`]: light passes straight through. Index-matched, in other words.
    Boundary,
}

/// How the alpha channel of the base colour is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Surfaces exist where alpha ≥ the cutoff.
    Mask(f32),
    /// Alpha is coverage: light passes straight through with probability 1 − alpha.
    Blend,
}

/// A procedural checkerboard in the object's x–z plane that replaces the base colour, box-filtered over the ray's
/// footprint, and optionally fades to transparent with the distance from the object's origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkerboard {
    /// Linear colours of the even and odd squares.
    pub colors: [Vec3; 2],
    /// Side of a square, in object units.
    pub size: f32,
    /// Distances from the object's origin between which coverage falls from 1 to 0; `None`: no fading.
    pub fade: Option<Vec2>,
}

/// The medium inside of a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interior {
    /// What is left of white light after `attenuation_distance`, linear, in `[0, 1]`.
    pub attenuation_color: Vec3,
    /// Metres; infinite: nothing is absorbed.
    pub attenuation_distance: f32,
}

impl Default for Interior {
    fn default() -> Self {
        Self { attenuation_color: Vec3::ONE, attenuation_distance: f32::INFINITY }
    }
}

impl Interior {
    /// The absorption coefficient, m⁻¹: light falls to exp(−σ d) of itself over a distance d. At most
    /// [`Interior::MOST_ABSORBING`], which is black at any scale.
    pub fn absorption(&self) -> Vec3 {
        if !(self.attenuation_distance.is_finite() && self.attenuation_distance > 0.0) {
            return Vec3::ZERO;
        }
        let of = |c: f32| (-log(c.clamp(1e-20, 1.0)) / self.attenuation_distance).min(Self::MOST_ABSORBING);
        Vec3::new(of(self.attenuation_color.x), of(self.attenuation_color.y), of(self.attenuation_color.z))
    }

    /// m⁻¹.
    pub const MOST_ABSORBING: f32 = 1e9;
}

/// A material: its model, factors, and textures multiplied into them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Material {
    /// Name from the file, for messages and overrides.
    pub name: String,
    /// The scattering model.
    pub model: Model,
    /// Linear base colour and alpha, each in `[0, 1]`.
    pub base_color: Vec4,
    /// sRGB texture multiplied into `base_color` (alpha is linear).
    pub base_color_texture: Option<TextureRef>,
    /// Procedural pattern in place of a base colour texture.
    pub checkerboard: Option<Checkerboard>,
    /// Metalness in `[0, 1]`.
    pub metallic: f32,
    /// Perceptual roughness in `[0, 1]`; GGX width alpha is its square.
    pub roughness: f32,
    /// Linear texture: roughness in G, metalness in B.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Strength of the dielectric specular reflection, in `[0, 1]` (`KHR_materials_specular`).
    pub specular: f32,
    /// Index of refraction, ≥ 1; 1.5 unless a file says otherwise.
    pub ior: f32,
    /// Share of light that is refracted instead of diffusely reflected, in `[0, 1]`.
    pub transmission: f32,
    /// Linear texture: transmission in R.
    pub transmission_texture: Option<TextureRef>,
    /// An infinitely thin wall: transmitted light goes straight on instead of being refracted.
    pub thin_walled: bool,
    /// Emitted radiance, linear, W·sr⁻¹·m⁻². Surfaces emit on their front only unless `emission_two_sided` is set.
    pub emission: Vec3,
    /// sRGB texture multiplied into `emission`.
    pub emission_texture: Option<TextureRef>,
    /// Whether both sides emit.
    pub emission_two_sided: bool,
    /// Tangent-space normal map (linear).
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// What lies on the base, and what else it does than reflect, refract and shine: nothing by default.
    pub layers: Layers,
    /// What is inside of a body that light is refracted into: vacuum by default.
    pub interior: Interior,
    /// What scatters light inside of the body; its absorption is added to that of `interior`.
    pub medium: Option<Medium>,
    /// Of [`Model::Dielectric`]: the inside scatters light so often that `base_color` comes out of it. It takes the place of
    /// `medium`, and the surface has no tint.
    pub subsurface: Option<Subsurface>,
    /// Which body is there where bodies overlap: the one of the highest priority, 0 if it has none. As soon as one material of
    /// a scene has a priority, bodies refract by what is on both of their sides; else by their own index against vacuum.
    pub priority: Option<i32>,
    /// Use of the alpha channel.
    pub alpha_mode: AlphaMode,
    /// Whether the surface is meant to be seen from both sides. The back of a single-sided one is drawn and blocks light all
    /// the same, unless [`crate::RenderDefaults::cull_backs`] says otherwise.
    pub double_sided: bool,
}

impl Default for Material {
    /// Neutral grey, half rough, non-metallic.
    fn default() -> Self {
        Self {
            name: "default".into(),
            model: Model::MetallicRoughness,
            base_color: Vec4::new(0.8, 0.8, 0.8, 1.0),
            base_color_texture: None,
            checkerboard: None,
            metallic: 0.0,
            roughness: 0.5,
            metallic_roughness_texture: None,
            specular: 1.0,
            ior: 1.5,
            transmission: 0.0,
            transmission_texture: None,
            thin_walled: false,
            emission: Vec3::ZERO,
            emission_texture: None,
            emission_two_sided: false,
            normal_texture: None,
            normal_scale: 1.0,
            layers: Layers::default(),
            interior: Interior::default(),
            medium: None,
            subsurface: None,
            priority: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

impl Material {
    /// What files may multiply emission by; films hold samples up to a thousand times that.
    pub const MOST_EMISSIVE_STRENGTH: f32 = 1e9;

    /// Whether light passes through the surface into a body behind it.
    pub fn refracts_into_body(&self) -> bool {
        let refracts = match self.model {
            Model::Dielectric | Model::Boundary => true,
            Model::MetallicRoughness => {
                self.transmission > 0.0
                    || (self.medium.is_some() && self.layers.diffuse_transmission.strength > 0.0)
            }
            Model::Lambert | Model::Mirror | Model::Unlit => false,
        };
        refracts && !self.thin_walled
    }

    /// Whether light may pass through the surface, into a body or through a sheet; holes do not count.
    pub fn transmits(&self) -> bool {
        match self.model {
            Model::Dielectric | Model::Boundary => true,
            Model::MetallicRoughness => {
                self.transmission > 0.0 || self.layers.diffuse_transmission.strength > 0.0
            }
            Model::Lambert | Model::Mirror | Model::Unlit => false,
        }
    }

    /// Whether [`crate::RenderDefaults::cull_backs`] leaves out the back: the surface is single-sided, does not emit there,
    /// and is not the boundary of a body that light passes through.
    pub fn may_lose_backs(&self) -> bool {
        let shines_both_ways = self.emission_two_sided && self.is_emissive();
        !(self.double_sided || shines_both_ways || self.refracts_into_body())
    }

    /// The coordinates that tangents follow, if shading needs them: those that the normal map is looked up by, or else what
    /// else has a direction. The set (0 or 1), and how it is transformed.
    pub fn tangent_coordinates(&self) -> Option<(u32, UvTransform)> {
        let of = |texture: Option<TextureRef>| texture.map(|t| (t.uv_set, t.transform));
        let layers = &self.layers;
        let others = || {
            let coat = of(layers.clearcoat.normal_texture).filter(|_| layers.clearcoat.strength > 0.0);
            coat.or(of(layers.anisotropy.texture)).unwrap_or_default()
        };
        of(self.normal_texture).or_else(|| layers.need_tangents().then(others))
    }

    /// All textures that it may have.
    pub fn textures_mut(&mut self) -> [&mut Option<TextureRef>; 17] {
        let l = &mut self.layers;
        [
            &mut self.base_color_texture,
            &mut self.normal_texture,
            &mut self.metallic_roughness_texture,
            &mut self.emission_texture,
            &mut self.transmission_texture,
            &mut l.clearcoat.texture,
            &mut l.clearcoat.roughness_texture,
            &mut l.clearcoat.normal_texture,
            &mut l.sheen.color_texture,
            &mut l.sheen.roughness_texture,
            &mut l.iridescence.texture,
            &mut l.iridescence.thickness_texture,
            &mut l.anisotropy.texture,
            &mut l.diffuse_transmission.texture,
            &mut l.diffuse_transmission.color_texture,
            &mut l.specular_texture,
            &mut l.specular_color_texture,
        ]
    }

    /// Whether the surface emits light anywhere.
    pub fn is_emissive(&self) -> bool {
        self.emission.max_element() > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `KHR_materials_volume`: after the attenuation distance, white light has the attenuation colour.
    #[test]
    fn absorption_leaves_the_attenuation_color_after_its_distance() {
        let color = Vec3::new(0.5, 0.1, 1.0);
        let interior = Interior { attenuation_color: color, attenuation_distance: 0.25 };
        let left = (-interior.absorption() * 0.25).exp();
        assert!((left - color).length() < 1e-6, "{left}");
        assert_eq!(Interior::default().absorption(), Vec3::ZERO);
        let black = Interior { attenuation_color: Vec3::ZERO, attenuation_distance: 1e-30 };
        assert_eq!(black.absorption(), Vec3::splat(Interior::MOST_ABSORBING));
    }

    #[test]
    fn layers_that_do_nothing_are_not_there() {
        assert!(!Layers::default().are_present());
        let sheen = crate::Sheen { color: Vec3::splat(0.1), ..crate::Sheen::default() };
        assert!(Layers { sheen, ..Layers::default() }.are_present());
    }
}
