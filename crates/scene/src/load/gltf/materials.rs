//! Materials in use, each once, and what they need of the meshes.

use super::document::Document;
use super::extensions::unsupported;
use super::factors::Factors;
use super::instances::Job;
use super::json::{self, MetallicRoughness, TextureInfo};
use super::textures::Textures;
use crate::load::textures::Neutral;
use crate::{
    AlphaMode, ColorSpace, Image, LoadError, LoadReport, Material, MaterialId, Model, Pixels, Texture,
    TextureRef, UvTransform,
};
use glam::{Vec3, Vec4};

/// A material's number in the scene and what it needs of the meshes that it covers.
#[derive(Clone, Copy)]
pub(super) struct Use {
    pub material: MaterialId,
    /// Which of the file's sets of texture coordinates become the mesh's two.
    pub uv_sets: [u32; 2],
    /// Which of the mesh's two sets textures read.
    pub textured: [bool; 2],
    /// Which of the mesh's two sets tangents follow, and how it is transformed before; see
    /// [`Material::tangent_coordinates`].
    pub tangents: Option<(u32, UvTransform)>,
}

/// Materials in use.
pub(super) struct Materials {
    pub list: Vec<Material>,
    /// For each material of the file, and last for primitives without one.
    uses: Vec<Option<Use>>,
}

impl Materials {
    /// Where a material of the file is in [`Materials::list`], if it is in use.
    pub fn number(&self, material: u32) -> Option<MaterialId> {
        self.uses.get(material as usize).copied().flatten().map(|usage| usage.material)
    }

    /// The use of a primitive's material, which must be in a mesh that was given to [`Document::materials`].
    pub fn get(&self, material: Option<u32>) -> Use {
        let fallback = self.uses.len() - 1;
        let index = material.map_or(fallback, |m| (m as usize).min(fallback));
        self.uses[index].unwrap_or(Use { material: 0, uv_sets: [0, 1], textured: [false; 2], tangents: None })
    }
}

impl<'a> Document<'a> {
    /// Converts the materials of the meshes that are in use, in file order.
    ///
    /// # Errors
    /// A primitive's material does not exist.
    pub fn materials<'d>(
        &'d self,
        jobs: &[Job],
        textures: &mut Textures<'d>,
        report: &mut LoadReport,
    ) -> Result<Materials, LoadError> {
        let sources = &self.json.materials;
        let mut used = vec![false; sources.len() + 1];
        for job in jobs {
            for (index, primitive) in self.json.meshes[job.mesh as usize].primitives.iter().enumerate() {
                let material =
                    primitive.material.filter(|m| !self.options.lenient || (*m as usize) < sources.len());
                let Some(material) = material else {
                    used[sources.len()] = true;
                    continue;
                };
                *used[..sources.len()].get_mut(material as usize).ok_or_else(|| {
                    let object = format!("mesh {}, primitive {index}", job.mesh);
                    self.malformed(object, format!("has material {material} of only {}", sources.len()))
                })? = true;
            }
        }
        let default = json::Material::default();
        let mut materials = Materials { list: Vec::new(), uses: vec![None; sources.len() + 1] };
        for index in (0..used.len()).filter(|i| used[*i]) {
            let (source, name) = match sources.get(index) {
                Some(source) => (source, source.name.clone().unwrap_or_else(|| format!("material {index}"))),
                None => (&default, "default".into()),
            };
            let mut converter = Converter { document: self, textures, report };
            let (mut material, normal_scale) = converter.convert(source);
            material.name = name;
            material.normal_scale = normal_scale;
            let mut usage = assign_uv_sets(&mut material, report);
            usage.material = materials.list.len() as MaterialId;
            materials.uses[index] = Some(usage);
            materials.list.push(material);
        }
        Ok(materials)
    }
}

/// Maps the file's sets of texture coordinates to the two that meshes have.
fn assign_uv_sets(material: &mut Material, report: &mut LoadReport) -> Use {
    let mut sets: Vec<u32> = material.textures_mut().iter().filter_map(|t| t.map(|t| t.uv_set)).collect();
    sets.sort_unstable();
    sets.dedup();
    let uv_sets = match sets[..] {
        [.., last] if last < 2 => [0, 1],
        [] => [0, 1],
        [only] => [only, 1],
        [first, second, ..] => [first, second],
    };
    let mut textured = [false; 2];
    for texture in material.textures_mut() {
        let Some(reference) = texture else { continue };
        match uv_sets.iter().position(|s| *s == reference.uv_set) {
            Some(slot) => {
                reference.uv_set = slot as u32;
                textured[slot] = true;
            }
            None => {
                report.ignored(
                    "a material uses more than two sets of texture coordinates: a texture is left out",
                );
                *texture = None;
            }
        }
    }
    Use { material: 0, uv_sets, textured, tangents: material.tangent_coordinates() }
}

/// Converts one material.
pub(super) struct Converter<'c, 'd, 'a> {
    document: &'d Document<'a>,
    textures: &'c mut Textures<'d>,
    pub report: &'c mut LoadReport,
}

impl<'d> Converter<'_, 'd, '_> {
    /// The material without its name, and the scale of its normal map.
    fn convert(&mut self, source: &json::Material) -> (Material, f32) {
        let mut material =
            Material { metallic: 1.0, roughness: 1.0, base_color: Vec4::ONE, ..Material::default() };
        match (&source.pbr_metallic_roughness, &source.extensions.specular_glossiness) {
            (Some(pbr), other) if other.is_none() || !pbr.is_empty() => {
                if other.is_some() {
                    self.report.info(
                        "of materials with KHR_materials_pbrSpecularGlossiness, the metallic-roughness copy is used",
                    );
                }
                self.metallic_roughness(pbr, &mut material);
            }
            (_, Some(specular)) => self.specular_glossiness(specular, &mut material),
            (_, None) => {}
        }
        self.surface(source, &mut material);
        self.specular_and_ior(&source.extensions, &mut material);
        self.transmission(&source.extensions, &mut material);
        self.layers(&source.extensions, &mut material);
        choose_model(source, &mut material);
        for name in source.extensions.others.keys() {
            self.report.ignored(unsupported(name));
        }
        let scale = source.normal_texture.as_ref().and_then(|t| t.scale);
        (material, scale.map_or(1.0, |s| self.factors().finite(Some(s), 1.0, "normal texture scale")))
    }

    pub(super) fn factors(&mut self) -> Factors<'_> {
        Factors { report: self.report }
    }

    pub(super) fn color_texture(&mut self, info: &Option<TextureInfo>) -> Option<TextureRef> {
        self.texture(info, ColorSpace::Srgb, Neutral::White)
    }

    pub(super) fn data_texture(&mut self, info: &Option<TextureInfo>) -> Option<TextureRef> {
        self.texture(info, ColorSpace::Linear, Neutral::White)
    }

    pub(super) fn texture(
        &mut self,
        info: &Option<TextureInfo>,
        space: ColorSpace,
        neutral: Neutral,
    ) -> Option<TextureRef> {
        let info = info.as_ref()?;
        self.textures.reference(self.document, info, space, neutral, self.report)
    }

    fn metallic_roughness(&mut self, pbr: &MetallicRoughness, material: &mut Material) {
        material.base_color = self.factors().color(pbr.base_color_factor, "base colour");
        material.base_color_texture = self.color_texture(&pbr.base_color_texture);
        material.metallic = self.factors().unit(pbr.metallic_factor, 1.0, "metallic");
        material.roughness = self.factors().unit(pbr.roughness_factor, 1.0, "roughness");
        material.metallic_roughness_texture = self.data_texture(&pbr.metallic_roughness_texture);
    }

    /// Emission, normal map, alpha and sides.
    fn surface(&mut self, source: &json::Material, material: &mut Material) {
        let strength = source.extensions.emissive_strength.as_ref().and_then(|e| e.emissive_strength);
        let range = [0.0, Material::MOST_EMISSIVE_STRENGTH];
        let strength = self.factors().within(strength, 1.0, range, "emissive strength");
        let factor = Vec3::from(source.emissive_factor.unwrap_or_default()) * strength;
        let sound = factor.is_finite() && factor.min_element() >= 0.0;
        if !sound {
            self.report.repaired("an emission that is negative or not finite was switched off");
        }
        material.emission = if sound { factor } else { Vec3::ZERO };
        if material.is_emissive() {
            material.emission_texture = self.color_texture(&source.emissive_texture);
        }
        material.emission_two_sided = source.double_sided;
        material.normal_texture =
            self.texture(&source.normal_texture, ColorSpace::Linear, Neutral::FlatNormal);
        material.double_sided = source.double_sided;
        material.alpha_mode = match source.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask(self.factors().finite(source.alpha_cutoff, 0.5, "alpha cutoff")),
            Some("BLEND") => AlphaMode::Blend,
            Some(_) => {
                self.report.repaired("an unknown alpha mode was taken as OPAQUE");
                AlphaMode::Opaque
            }
        };
    }

    fn transmission(&mut self, extensions: &json::MaterialExtensions, material: &mut Material) {
        if let Some(transmission) = &extensions.transmission {
            material.transmission =
                self.factors().unit(transmission.transmission_factor, 0.0, "transmission");
        }
        if material.transmission == 0.0 {
            return; // without it, a volume has no effect either
        }
        let texture = extensions.transmission.as_ref().map(|t| &t.transmission_texture);
        material.transmission_texture = texture.and_then(|t| self.data_texture(t));
        let volume = extensions.volume.as_ref().filter(|v| v.thickness_factor.is_some_and(|t| t > 0.0));
        material.thin_walled = volume.is_none();
        let Some(volume) = volume else { return };
        material.interior = self.interior(volume);
    }
}

/// Simpler models where the material is one of their cases.
fn choose_model(source: &json::Material, material: &mut Material) {
    let extensions = &source.extensions;
    let metal = material.metallic > 0.0;
    let clear = material.transmission == 1.0 && material.transmission_texture.is_none();
    let layered = material.layers.are_present();
    material.model = if extensions.unlit.is_some() {
        Model::Unlit
    } else if clear && !metal {
        Model::Dielectric
    } else if !metal && material.specular == 0.0 && material.transmission == 0.0 && !layered {
        Model::Lambert
    } else {
        Model::MetallicRoughness
    };
}

/// Recognises glass whose metalness is switched off by a texture, not by the factor: its default is 1.
pub(super) fn settle_models(materials: &mut [Material], textures: &[Texture], images: &[Image]) {
    let never_metal = |reference: TextureRef| {
        let image = textures.get(reference.texture as usize).and_then(|t| t.as_image());
        let image = image.and_then(|t| images.get(t.image as usize));
        image.is_some_and(|image| match &image.pixels {
            Pixels::Rgba8(pixels) => pixels.iter().all(|p| p[2] == 0),
            floats => (0..floats.len()).all(|i| floats.stored(i)[2] <= 0.0),
        })
    };
    for material in materials {
        let clear = material.transmission == 1.0 && material.transmission_texture.is_none();
        if clear
            && material.model == Model::MetallicRoughness
            && material.metallic_roughness_texture.is_some_and(never_metal)
        {
            material.metallic = 0.0;
            material.model = Model::Dielectric;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn high_sets_of_coordinates_take_the_free_places() {
        let reference = |uv_set| Some(TextureRef { uv_set, ..TextureRef::new(0) });
        let mut material = Material {
            base_color_texture: reference(3),
            normal_texture: reference(1),
            ..Material::default()
        };
        let usage = assign_uv_sets(&mut material, &mut LoadReport::default());
        assert_eq!((usage.uv_sets, usage.tangents.map(|t| t.0)), ([1, 3], Some(0)));
        assert_eq!(material.base_color_texture.map(|t| t.uv_set), Some(1));

        let mut report = LoadReport::default();
        material.base_color_texture = reference(3);
        material.normal_texture = reference(0);
        material.emission_texture = reference(4);
        let usage = assign_uv_sets(&mut material, &mut report);
        assert_eq!((usage.uv_sets, report.notes.len()), ([0, 3], 1));
        assert!(material.emission_texture.is_none());
    }
}
