//! The textures of the materials in use: which files, how they are sampled, what they are packed into.

use super::images::{self, Channel, Coverage, Recipe};
use super::mtl::{Map, MtlMaterial, MtlTexture};
use crate::load::LoadOptions;
use crate::load::textures::{Neutral, TextureLoader, find_file};
use crate::{
    AlphaMode, ColorSpace, Image, ImageId, LoadReport, Material, Model, Pixels, Sampler, Scene, Texture,
    TextureRef, UvTransform, Wrap,
};
use glam::Vec2;
use rayon::prelude::*;
use std::path::Path;

/// Collects textures of materials, then decodes and attaches them.
pub(super) struct Textures<'a> {
    options: &'a LoadOptions,
    loader: TextureLoader<'a>,
    recipes: Vec<Recipe>,
    wanted: Vec<Wanted>,
    /// Materials (by index) whose specular strength is multiplied by the mean of an image.
    specular: Vec<(usize, ImageId)>,
}

/// A texture that a material will have.
struct Wanted {
    material: usize,
    target: Target,
    recipe: usize,
    map: Map,
}

#[derive(Clone, Copy, PartialEq)]
enum Target {
    BaseColor,
    Emission,
    MetallicRoughness,
    Normal,
}

impl<'a> Textures<'a> {
    pub(super) fn new(options: &'a LoadOptions) -> Self {
        let loader = TextureLoader::new(options, 0);
        Self { options, loader, recipes: Vec::new(), wanted: Vec::new(), specular: Vec::new() }
    }

    /// Adds the textures of a material, which will be number `index`. File names are relative to the `folders`, tried
    /// in order.
    pub(super) fn add(&mut self, index: usize, mtl: &MtlMaterial, model: Model, folders: &[&Path]) {
        let map = |slot: MtlTexture| mtl.maps.get(&slot);
        self.base_color(index, map(MtlTexture::Diffuse), map(MtlTexture::Dissolve), folders);
        if let Some(map) = map(MtlTexture::Emission) {
            let image = self.image(map, Neutral::White, folders);
            self.want(index, Target::Emission, Recipe::Plain(image), map);
        }
        if let Some(map) = map(MtlTexture::Normal) {
            let image = self.image(map, Neutral::FlatNormal, folders);
            self.want(index, Target::Normal, Recipe::Plain(image), map);
        } else if let Some(map) = map(MtlTexture::Bump) {
            let bump = self.image(map, Neutral::FlatNormal, folders);
            self.want(index, Target::Normal, Recipe::Normal { bump, strength: map.bump }, map);
        }
        if model == Model::MetallicRoughness {
            self.metallic_roughness(index, mtl, folders);
            if let Some(map) = map(MtlTexture::Specular) {
                let image = self.image(map, Neutral::White, folders);
                self.specular.push((index, image));
            }
        }
    }

    fn base_color(&mut self, index: usize, color: Option<&Map>, opacity: Option<&Map>, folders: &[&Path]) {
        let color_image = color.map(|map| self.image(map, Neutral::White, folders));
        if let Some(opacity) = opacity {
            let image = self.image(opacity, Neutral::White, folders);
            let channel = channel(opacity, Channel::AlphaOrLuminance);
            let recipe = Recipe::Opacity { color: color_image, opacity: (image, channel) };
            self.want(index, Target::BaseColor, recipe, color.unwrap_or(opacity));
        } else if let (Some(map), Some(image)) = (color, color_image) {
            self.want(index, Target::BaseColor, Recipe::Plain(image), map);
        }
    }

    fn metallic_roughness(&mut self, index: usize, mtl: &MtlMaterial, folders: &[&Path]) {
        // The packed maps hold roughness and metalness in these components.
        for (slot, roughness, metallic) in
            [(MtlTexture::OcclusionRoughnessMetallic, 1, 2), (MtlTexture::RoughnessMetallicOcclusion, 0, 1)]
        {
            if let Some(map) = mtl.maps.get(&slot) {
                let image = self.image(map, Neutral::White, folders);
                let source = |component| Some((image, Channel::Component(component)));
                let recipe =
                    Recipe::MetallicRoughness { roughness: source(roughness), metallic: source(metallic) };
                return self.want(index, Target::MetallicRoughness, recipe, map);
            }
        }
        let (roughness, metallic) =
            (mtl.maps.get(&MtlTexture::Roughness), mtl.maps.get(&MtlTexture::Metallic));
        let Some(map) = roughness.or(metallic) else { return };
        let mut source = |map: Option<&Map>| {
            map.map(|m| (self.image(m, Neutral::White, folders), channel(m, Channel::Luminance)))
        };
        let recipe = Recipe::MetallicRoughness { roughness: source(roughness), metallic: source(metallic) };
        self.want(index, Target::MetallicRoughness, recipe, map);
    }

    fn image(&mut self, map: &Map, neutral: Neutral, folders: &[&Path]) -> ImageId {
        let find = |name: &str| folders.iter().find_map(|folder| find_file(folder, name, self.options));
        let whole = Some(&map.whole).filter(|whole| **whole != map.file);
        match whole.and_then(|whole| find(whole)).or_else(|| find(&map.file)) {
            Some(path) => self.loader.file(&path, neutral),
            None => self.loader.missing(&map.file, "the file does not exist", neutral),
        }
    }

    fn want(&mut self, material: usize, target: Target, recipe: Recipe, map: &Map) {
        let known = self.recipes.iter().position(|r| *r == recipe);
        let recipe = known.unwrap_or_else(|| {
            self.recipes.push(recipe);
            self.recipes.len() - 1
        });
        self.wanted.push(Wanted { material, target, recipe, map: map.clone() });
    }

    /// Decodes everything and gives the scene's materials their textures.
    pub(super) fn attach(self, scene: &mut Scene, report: &mut LoadReport) {
        let mut decoded = self.loader.finish(report);
        for (material, image) in &self.specular {
            let material = &mut scene.materials[*material];
            material.specular *= images::mean_color(&decoded[*image as usize]).max_element().min(1.0);
            report.approximated(format!("material {}: map_Ks is replaced by its mean", material.name));
        }
        let is_normals: Vec<bool> = self.recipes.par_iter().map(|r| holds_normals(r, &decoded)).collect();
        scene.images = make_all(&self.recipes, &mut decoded, report);
        for wanted in &self.wanted {
            let image = wanted.recipe as ImageId;
            let texture = add_texture(scene, image, wanted.target, &wanted.map);
            let uses_alpha = matches!(self.recipes[wanted.recipe], Recipe::Opacity { .. });
            let coverage = uses_alpha.then(|| images::coverage(&scene.images[wanted.recipe]));
            let material = &mut scene.materials[wanted.material];
            match wanted.target {
                Target::BaseColor => {
                    material.base_color_texture = Some(texture);
                    if let Some(coverage) = coverage {
                        set_alpha_mode(material, coverage);
                    }
                }
                Target::Emission => material.emission_texture = Some(texture),
                Target::MetallicRoughness => material.metallic_roughness_texture = Some(texture),
                Target::Normal => {
                    material.normal_texture = Some(texture);
                    if is_normals[wanted.recipe] {
                        material.normal_scale = wanted.map.bump;
                    }
                }
            }
        }
    }
}

fn holds_normals(recipe: &Recipe, decoded: &[Image]) -> bool {
    match recipe {
        Recipe::Normal { bump, .. } => images::looks_like_normals(&decoded[*bump as usize]),
        _ => true,
    }
}

/// Makes the image of each recipe; plain ones are moved, not copied.
fn make_all(recipes: &[Recipe], decoded: &mut [Image], report: &mut LoadReport) -> Vec<Image> {
    let sources = &*decoded;
    let mut made: Vec<(Option<Image>, LoadReport)> = recipes
        .par_iter()
        .map(|recipe| {
            let mut notes = LoadReport::default();
            let image = match recipe {
                Recipe::Plain(_) => None,
                _ => Some(images::make(recipe, sources, &mut notes)),
            };
            (image, notes)
        })
        .collect();
    let images = recipes.iter().zip(&mut made).map(|(recipe, (image, notes))| {
        for note in notes.notes.drain(..) {
            report.note(note.severity, note.message);
        }
        match recipe {
            Recipe::Plain(id) => {
                let empty =
                    Image { name: String::new(), width: 0, height: 0, pixels: Pixels::Rgba8(Vec::new()) };
                std::mem::replace(&mut decoded[*id as usize], empty)
            }
            _ => image.take().unwrap_or_else(|| Neutral::White.image("")),
        }
    });
    images.collect()
}

fn channel(map: &Map, default: Channel) -> Channel {
    match map.channel {
        Some(b'r') => Channel::Component(0),
        Some(b'g') => Channel::Component(1),
        Some(b'b') => Channel::Component(2),
        Some(b'm') => Channel::Component(3),
        Some(b'l') => Channel::Luminance,
        _ => default,
    }
}

fn set_alpha_mode(material: &mut Material, coverage: Coverage) {
    material.alpha_mode = match coverage {
        Coverage::Opaque if material.base_color.w >= 1.0 => AlphaMode::Opaque,
        Coverage::Cutout if material.base_color.w >= 1.0 => AlphaMode::Mask(0.5),
        _ => AlphaMode::Blend,
    };
}

fn add_texture(scene: &mut Scene, image: ImageId, target: Target, map: &Map) -> TextureRef {
    let wrap = if map.clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
    let srgb = match target {
        Target::BaseColor | Target::Emission => map.srgb.unwrap_or(true),
        Target::MetallicRoughness | Target::Normal => false,
    };
    let color_space = if srgb { ColorSpace::Srgb } else { ColorSpace::Linear };
    let sampler = Sampler { wrap_u: wrap, wrap_v: wrap, ..Default::default() };
    let texture = Texture::image(image, sampler, color_space);
    let index = scene.textures.iter().position(|t| *t == texture).unwrap_or_else(|| {
        scene.textures.push(texture);
        scene.textures.len() - 1
    });
    // The file's v axis points up: v' = 1 − (scale · (1 − v) + offset).
    let transform = UvTransform {
        rows: [Vec2::new(map.scale.x, 0.0), Vec2::new(0.0, map.scale.y)],
        offset: Vec2::new(map.offset.x, 1.0 - map.scale.y - map.offset.y),
    };
    TextureRef { texture: index as u32, uv_set: 0, transform }
}
