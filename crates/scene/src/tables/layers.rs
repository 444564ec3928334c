//! Records of what lies on the base of layered materials.

use super::material::Range;
use super::scene_tables::{LayerTextures, SceneTables};
use crate::{Iridescence, Material};
use elementary::sin_cos;
use optics::layers::{
    LAYER_ANISOTROPY, LAYER_COAT_NORMAL, LAYERS_ANISOTROPY, LAYERS_COAT_NORMAL, LAYERS_GLOSSINESS,
    LayersRecord,
};
use optics::{vec2f, vec3f};

impl SceneTables {
    /// The records of a material's layers. The tables have their textures already.
    pub(super) fn layers_record(&self, material: &Material) -> (LayersRecord, LayerTextures) {
        let l = &material.layers;
        let (coat, sheen, film) = (&l.clearcoat, &l.sheen, &l.iridescence);
        let (grain, through) = (&l.anisotropy, &l.diffuse_transmission);
        // By `LAYER_…`.
        let textures = [
            &coat.texture,
            &coat.roughness_texture,
            &coat.normal_texture,
            &sheen.color_texture,
            &sheen.roughness_texture,
            &film.texture,
            &film.thickness_texture,
            &grain.texture,
            &through.texture,
            &through.color_texture,
            &l.specular_texture,
            &l.specular_color_texture,
        ]
        .map(|texture| self.texture_use(texture, Range::Shares));
        let mut flags = 0;
        let mut set = |bit: u32, on: bool| flags |= if on { bit } else { 0 };
        set(LAYERS_GLOSSINESS, l.glossiness);
        set(LAYERS_COAT_NORMAL, textures[LAYER_COAT_NORMAL as usize].is_some());
        set(LAYERS_ANISOTROPY, textures[LAYER_ANISOTROPY as usize].is_some());
        let rgb = |c: glam::Vec3| vec3f(c.x, c.y, c.z);
        let (sin, cos) = sin_cos(grain.rotation);
        let [thin, thick] = film.thickness.map(|t| t.clamp(0.0, Iridescence::MOST_THICKNESS));
        let record = LayersRecord {
            specular_color: rgb(l.specular_color),
            reflectance_ior: if l.specular_is_reflectance { 0.0 } else { material.ior.max(1.0) },
            sheen_color: rgb(sheen.color),
            sheen_roughness: sheen.roughness,
            diffuse_transmission_color: rgb(through.color),
            diffuse_transmission: through.strength,
            film_thickness: vec2f(thin, thick),
            anisotropy_direction: vec2f(cos, sin),
            anisotropy: grain.strength,
            coat: coat.strength,
            coat_roughness: coat.roughness,
            coat_normal_scale: coat.normal_scale,
            dispersion: l.dispersion,
            iridescence: film.strength,
            film_ior: film.ior.clamp(1.0, Iridescence::MOST_IOR),
            diffuse_roughness: l.diffuse_roughness,
            flags,
            padding0: 0,
            padding1: 0,
            padding2: 0,
        };
        (record, textures)
    }
}
