//! Puts a scene together, section by section.

use super::document::{Document, Entry};
use super::inclusion::{Budget, Place};
use super::placement::Placement;
use super::template::Template;
use crate::load::textures::TextureLoader;
use crate::load::{LoadError, LoadOptions, Loaded};
use crate::{LightProfile, LoadReport, Material, MaterialId, RenderDefaults, Scene};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A scene that is being put together.
pub(super) struct Builder<'a> {
    pub place: Place<'a>,
    pub options: &'a LoadOptions,
    pub budget: &'a mut Budget,
    pub scene: Scene,
    pub placement: Placement,
    pub report: LoadReport,
    pub materials: HashMap<String, MaterialId>,
    /// Images of the file's own materials; they get their place in the scene at the end.
    pub images: TextureLoader<'a>,
    /// The file's own images in [`Scene::textures`].
    pub textures: Vec<usize>,
    /// What `[textures.NAME]` declares.
    pub named_textures: HashMap<String, toml::Value>,
    pub models: HashMap<PathBuf, Template>,
    /// Photometric files: many lamps share one.
    pub profiles: HashMap<PathBuf, Arc<LightProfile>>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(place: Place<'a>, options: &'a LoadOptions, budget: &'a mut Budget) -> Self {
        Self {
            place,
            options,
            budget,
            scene: Scene::default(),
            placement: Placement::default(),
            report: LoadReport::default(),
            materials: HashMap::new(),
            images: TextureLoader::new(options, 0),
            textures: Vec::new(),
            named_textures: HashMap::new(),
            models: HashMap::new(),
            profiles: HashMap::new(),
        }
    }

    /// Reads every section; what is left over is unknown.
    pub(super) fn read(&mut self, document: &mut Document) -> Result<(), LoadError> {
        self.scene.name = document.take_string("name")?.unwrap_or_default();
        document.take_string("about")?;
        if let Some(render) = document.take_table("render")? {
            self.scene.defaults = render.read::<RenderDefaults>()?;
        }
        for (name, entry) in document.take_named("textures")? {
            self.add_named_texture(name, entry)?;
        }
        self.check_named_textures()?;
        for (name, entry) in document.take_named("materials")? {
            self.add_named_material(name, entry)?;
        }
        self.each(document, "shape", Self::add_shape)?;
        let emits = self.scene.materials.iter().any(Material::is_emissive);
        self.each(document, "model", Self::add_model)?;
        let of_models = self.scene.lights.len();
        self.each(document, "light", Self::add_light)?;
        self.scene.declares_light |= emits || self.scene.lights.len() > of_models;
        self.each(document, "camera", Self::add_camera)?;
        if let Some(environment) = document.take_table("environment")? {
            self.set_environment(environment)?;
            self.scene.declares_light = true;
        }
        if let Some(fog) = document.take_table("fog")? {
            self.set_fog(fog)?;
        }
        document.expect_empty(&[
            "name",
            "about",
            "parameters",
            "render",
            "textures",
            "materials",
            "shape",
            "model",
            "light",
            "camera",
            "environment",
            "fog",
        ])
    }

    fn each(
        &mut self,
        document: &mut Document,
        section: &str,
        add: fn(&mut Self, Entry) -> Result<(), LoadError>,
    ) -> Result<(), LoadError> {
        document.take_list(section)?.into_iter().try_for_each(|entry| add(self, entry))
    }

    /// Decodes the file's own images and gives them their place.
    pub(super) fn finish(mut self) -> Loaded {
        let offset = self.scene.images.len() as u32;
        for texture in self.textures {
            self.scene.textures[texture].shift_references(offset, 0);
        }
        self.scene.images.extend(self.images.finish(&mut self.report));
        self.placement.settle(&mut self.scene, &mut self.report);
        Loaded { scene: self.scene, report: self.report }
    }
}
