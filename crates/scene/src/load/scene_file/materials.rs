//! `[materials.NAME]` and materials in place.

use super::Builder;
use super::document::{Context, Entry};
use super::layers::apply_layer_numbers;
use super::media::{MediumKeys, SubsurfaceKeys, apply_medium};
use super::textures::{TextureValue, ValueOr};
use super::values::{Color, within};
use crate::load::LoadError;
use crate::load::session::MATERIAL;
use crate::load::textures::Neutral;
use crate::{AlphaMode, Checkerboard, ColorSpace, LAYER_NUMBERS, Material, MaterialId, Model, TextureRef};
use glam::{Vec2, Vec3};
use serde::Deserialize;

/// A material's keys but those of [`LAYER_NUMBERS`]; what is absent keeps its value.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub(super) struct MaterialKeys {
    pub name: Option<String>,
    pub model: Option<ModelName>,
    pub base_color: Option<ValueOr<Color>>,
    pub alpha: Option<f32>,
    pub base_color_texture: Option<TextureValue>,
    pub checkerboard: Option<CheckerboardKeys>,
    pub metallic: Option<ValueOr<f32>>,
    pub roughness: Option<ValueOr<f32>>,
    pub metallic_roughness_texture: Option<TextureValue>,
    pub specular: Option<f32>,
    pub ior: Option<f32>,
    pub transmission: Option<ValueOr<f32>>,
    pub transmission_texture: Option<TextureValue>,
    pub thin_walled: Option<bool>,
    pub emission: Option<ValueOr<Color>>,
    pub emission_strength: Option<f32>,
    pub emission_texture: Option<TextureValue>,
    pub emission_two_sided: Option<bool>,
    pub normal_texture: Option<TextureValue>,
    /// Metres, above the surface.
    pub height: Option<ValueOr<f32>>,
    pub normal_scale: Option<f32>,
    pub alpha_mode: Option<AlphaModeName>,
    pub alpha_cutoff: Option<f32>,
    pub double_sided: Option<bool>,
    pub clearcoat_texture: Option<TextureValue>,
    pub clearcoat_roughness_texture: Option<TextureValue>,
    pub clearcoat_normal_texture: Option<TextureValue>,
    pub clearcoat_normal_scale: Option<f32>,
    pub sheen_color: Option<Color>,
    pub sheen_color_texture: Option<TextureValue>,
    pub sheen_roughness_texture: Option<TextureValue>,
    pub specular_texture: Option<TextureValue>,
    pub specular_color: Option<Color>,
    pub specular_color_texture: Option<TextureValue>,
    pub iridescence_texture: Option<TextureValue>,
    /// Nanometres, where the texture is 0 and 1.
    pub iridescence_thickness: Option<[f32; 2]>,
    pub iridescence_thickness_texture: Option<TextureValue>,
    /// Degrees.
    pub anisotropy_rotation: Option<f32>,
    pub anisotropy_texture: Option<TextureValue>,
    pub diffuse_transmission_texture: Option<TextureValue>,
    pub diffuse_transmission_color: Option<Color>,
    pub diffuse_transmission_color_texture: Option<TextureValue>,
    pub attenuation_color: Option<Color>,
    pub attenuation_distance: Option<f32>,
    pub medium: Option<MediumKeys>,
    pub subsurface: Option<SubsurfaceKeys>,
    pub priority: Option<i32>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ModelName {
    MetallicRoughness,
    Lambert,
    Dielectric,
    Mirror,
    Unlit,
    Boundary,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum AlphaModeName {
    Opaque,
    Mask,
    Blend,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CheckerboardKeys {
    colors: [Color; 2],
    #[serde(default = "one")]
    size: f32,
    fade: Option<[f32; 2]>,
}

fn one() -> f32 {
    1.0
}

impl Builder<'_> {
    /// Adds the material `[materials.NAME]`.
    pub(super) fn add_named_material(&mut self, name: String, entry: Entry) -> Result<(), LoadError> {
        let id = self.add_material(entry, &name)?;
        self.materials.insert(name, id);
        Ok(())
    }

    /// Takes the key `material` out of an object's table: the name of a material, or one in place.
    pub(super) fn take_material(&mut self, entry: &mut Entry) -> Result<Option<MaterialId>, LoadError> {
        if let Some(table) = entry.take_table("material") {
            return self.add_material(table, "material").map(Some);
        }
        let Some(name) = entry.take_string("material")? else { return Ok(None) };
        self.named_material(&name, &entry.context()).map(Some)
    }

    /// The material of a name that the file declares.
    pub(super) fn named_material(&self, name: &str, context: &Context) -> Result<MaterialId, LoadError> {
        if let Some(id) = self.materials.get(name) {
            return Ok(*id);
        }
        let mut known: Vec<String> = self.materials.keys().map(|name| format!("`{name}`")).collect();
        known.sort();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        Err(context.error(format!("there is no material `{name}` among [materials]; known are {known}")))
    }

    /// The material of objects that name none.
    pub(super) fn neutral_material(&mut self) -> MaterialId {
        let known = self.materials.get("").copied();
        known.unwrap_or_else(|| {
            let id = self.push_material(Material::default());
            self.materials.insert(String::new(), id);
            id
        })
    }

    fn push_material(&mut self, material: Material) -> MaterialId {
        self.scene.materials.push(material);
        (self.scene.materials.len() - 1) as MaterialId
    }

    fn add_material(&mut self, mut entry: Entry, name: &str) -> Result<MaterialId, LoadError> {
        let context = entry.context();
        let layer_numbers = entry.split(&LAYER_NUMBERS.iter().map(|number| number.name).collect::<Vec<_>>());
        let keys: MaterialKeys = entry.read()?;
        let name = keys.name.clone().unwrap_or_else(|| name.to_owned());
        context.take(MATERIAL + name.len() as u64, "materials")?;
        let mut material = Material { name, ..Default::default() };
        apply_numbers(&keys, &mut material, &context)?;
        apply_emission(&keys, &mut material, &context)?;
        apply_alpha(&keys, &mut material, &context)?;
        self.apply_textures(&keys, &mut material, &context)?;
        apply_layer_numbers(layer_numbers, &mut material.layers)?;
        self.apply_layers(&keys, &mut material, &context)?;
        apply_medium(self, &keys, &mut material, &context)?;
        Ok(self.push_material(material))
    }

    fn apply_textures(&mut self, k: &MaterialKeys, m: &mut Material, c: &Context) -> Result<(), LoadError> {
        use ColorSpace::{Linear, Srgb};
        let white = Neutral::White;
        m.base_color_texture = self.texture(&k.base_color_texture, Srgb, white, c)?;
        m.metallic_roughness_texture = self.texture(&k.metallic_roughness_texture, Linear, white, c)?;
        m.transmission_texture = self.texture(&k.transmission_texture, Linear, white, c)?;
        m.emission_texture = self.texture(&k.emission_texture, Srgb, white, c)?;
        m.normal_texture = self.texture(&k.normal_texture, Linear, Neutral::FlatNormal, c)?;
        self.apply_graphs(k, m, c)
    }
}

impl Builder<'_> {
    /// Parameters that are graphs: their factor is 1, and the graph is their texture.
    fn apply_graphs(&mut self, k: &MaterialKeys, m: &mut Material, c: &Context) -> Result<(), LoadError> {
        let roughness = k.roughness.as_ref().and_then(ValueOr::graph);
        let metallic = k.metallic.as_ref().and_then(ValueOr::graph);
        self.metallic_roughness_graph([roughness, metallic], m, c)?;
        let mut set = |table: Option<&toml::Table>, texture: &mut Option<TextureRef>, key: &str| {
            let Some(table) = table else { return Ok(false) };
            if texture.is_some() {
                return Err(c.error(format!("`{key}` has a texture and a graph")));
            }
            *texture = Some(self.graph(&toml::Value::Table(table.clone()), c)?);
            Ok(true)
        };
        if set(k.base_color.as_ref().and_then(ValueOr::graph), &mut m.base_color_texture, "base-color")? {
            m.base_color = Vec3::ONE.extend(m.base_color.w);
        }
        if set(k.transmission.as_ref().and_then(ValueOr::graph), &mut m.transmission_texture, "transmission")?
        {
            m.transmission = 1.0;
        }
        set(k.emission.as_ref().and_then(ValueOr::graph), &mut m.emission_texture, "emission")?;
        set(k.height.as_ref().and_then(ValueOr::graph), &mut m.normal_texture, "height")?;
        Ok(())
    }
}

fn apply_numbers(k: &MaterialKeys, m: &mut Material, c: &Context) -> Result<(), LoadError> {
    let unit = |value: Option<f32>, into: &mut f32, key: &str| {
        if let Some(value) = value {
            *into = within(value, [0.0, 1.0], key, c)?;
        }
        Ok::<(), LoadError>(())
    };
    unit(k.metallic.as_ref().and_then(ValueOr::plain), &mut m.metallic, "metallic")?;
    unit(k.roughness.as_ref().and_then(ValueOr::plain), &mut m.roughness, "roughness")?;
    unit(k.specular, &mut m.specular, "specular")?;
    unit(k.transmission.as_ref().and_then(ValueOr::plain), &mut m.transmission, "transmission")?;
    unit(k.alpha, &mut m.base_color.w, "alpha")?;
    m.ior = within(k.ior.unwrap_or(m.ior), [1.0, 10.0], "ior", c)?;
    m.normal_scale = k.normal_scale.unwrap_or(m.normal_scale);
    m.thin_walled = k.thin_walled.unwrap_or(m.thin_walled);
    m.double_sided = k.double_sided.unwrap_or(m.double_sided);
    m.model = match k.model {
        None | Some(ModelName::MetallicRoughness) => Model::MetallicRoughness,
        Some(ModelName::Lambert) => Model::Lambert,
        Some(ModelName::Dielectric) => Model::Dielectric,
        Some(ModelName::Mirror) => Model::Mirror,
        Some(ModelName::Unlit) => Model::Unlit,
        Some(ModelName::Boundary) => Model::Boundary,
    };
    if matches!(m.model, Model::Dielectric | Model::Mirror) {
        // Clear unless the file says otherwise: the defaults are made for metallic-roughness.
        m.base_color = Vec3::ONE.extend(m.base_color.w);
        // Light is found through a rough surface only, so what is meant to be lit inside has one.
        let smooth = if k.subsurface.is_some() { 0.4 } else { 0.0 };
        m.roughness = k.roughness.as_ref().and_then(ValueOr::plain).unwrap_or(smooth);
    }
    if let Some(Color(color)) = k.base_color.as_ref().and_then(ValueOr::plain) {
        within(color.max_element(), [0.0, 1.0], "base-color", c)?;
        m.base_color = color.extend(m.base_color.w);
    }
    if let Some(board) = &k.checkerboard {
        let size = super::values::positive(board.size, "checkerboard.size", c)?;
        let fade = board.fade.map(Vec2::from_array);
        if let Some(fade) = fade.filter(|f| f.x < 0.0 || f.y <= f.x) {
            return Err(
                c.error(format!("`checkerboard.fade` must be two increasing distances, it is {fade}"))
            );
        }
        m.checkerboard = Some(Checkerboard { colors: board.colors.map(|color| color.0), size, fade });
    }
    Ok(())
}

fn apply_emission(k: &MaterialKeys, m: &mut Material, c: &Context) -> Result<(), LoadError> {
    let strength = within(k.emission_strength.unwrap_or(1.0), [0.0, 1e9], "emission-strength", c)?;
    if k.emission_strength.is_some() && k.emission.is_none() && k.emission_texture.is_none() {
        return Err(c.error("`emission-strength` needs `emission`"));
    }
    // A texture alone is multiplied into white.
    let is_graph = k.emission.as_ref().is_some_and(|value| value.graph().is_some());
    let plain = if k.emission_texture.is_some() || is_graph { Vec3::ONE } else { Vec3::ZERO };
    m.emission = k.emission.as_ref().and_then(ValueOr::plain).map_or(plain, |color| color.0) * strength;
    m.emission_two_sided = k.emission_two_sided.unwrap_or(false);
    Ok(())
}

fn apply_alpha(k: &MaterialKeys, m: &mut Material, c: &Context) -> Result<(), LoadError> {
    let cutoff = within(k.alpha_cutoff.unwrap_or(0.5), [0.0, 1.0], "alpha-cutoff", c)?;
    m.alpha_mode = match k.alpha_mode {
        None | Some(AlphaModeName::Opaque) => AlphaMode::Opaque,
        Some(AlphaModeName::Mask) => AlphaMode::Mask(cutoff),
        Some(AlphaModeName::Blend) => AlphaMode::Blend,
    };
    if k.alpha_cutoff.is_some() && !matches!(m.alpha_mode, AlphaMode::Mask(_)) {
        return Err(c.error("`alpha-cutoff` needs `alpha-mode = \"mask\"`"));
    }
    if m.base_color.w < 1.0 && k.alpha_mode.is_none() {
        return Err(c.error("`alpha` needs `alpha-mode`"));
    }
    Ok(())
}
