//! `[[model]]`: other files placed in the scene.

use super::document::{Context, Entry};
use super::inclusion::canonical;
use super::objects::Object;
use super::placement::{View, move_media};
use super::subdivision::SurfaceKeys;
use super::template::Template;
use super::values::positive;
use super::{Builder, Value, load_included};
use crate::animation::KeyedObject;
use crate::load::session::{instance, light};
use crate::load::{LoadError, LoadOptions, Loaded};
use crate::origin::double;
use crate::{Animation, Environment, Group, Instance, MaterialId, Scene};
use glam::{Affine3A, DAffine3, DVec3, Vec3};
use serde::Deserialize;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The keys of a model beside those of every object.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct ModelKeys {
    file: String,
    /// The longest side after scaling, metres; the model then stands on y = 0, centred.
    fit: Option<f32>,
    /// Whether the file's lights come along.
    #[serde(default = "yes")]
    lights: bool,
    /// Whether the file's cameras come along, after the scene's own.
    #[serde(default)]
    cameras: bool,
    /// Materials of this scene by the name of the material in the file that they replace.
    #[serde(default)]
    materials: BTreeMap<String, String>,
    /// Parameters of an included scene file.
    #[serde(default)]
    parameters: BTreeMap<String, Value>,
}

fn yes() -> bool {
    true
}

impl Builder<'_> {
    /// Adds a model and its copies.
    pub(super) fn add_model(&mut self, mut entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let Some(object) = self.take_object(&mut entry)? else { return Ok(()) };
        let replacement = self.take_material(&mut entry)?;
        let surface = SurfaceKeys::take(&mut entry)?;
        let keys: ModelKeys = entry.read()?;
        if keys.file.is_empty() {
            return Err(context.error("`file` is empty"));
        }
        let path = self.place.folder.join(&keys.file);
        let key = cache_key(&path, &keys, &surface);
        let template = match self.models.remove(&key) {
            Some(known) => known,
            None => self.include(&path, &keys, &surface, &context)?,
        };
        let result = self.place_model(&object, &template, &keys, replacement, &context);
        self.models.insert(key, template);
        result
    }

    /// Loads a file and puts its meshes and materials into the scene, but none of its objects.
    fn include(
        &mut self,
        path: &Path,
        keys: &ModelKeys,
        surface: &SurfaceKeys,
        context: &Context,
    ) -> Result<Template, LoadError> {
        let options = LoadOptions { keep_polygons: !surface.is_empty(), ..self.options.clone() };
        let Loaded { mut scene, report } =
            load_included(path, &keys.parameters, self.place, &options, self.budget, context)?;
        if !surface.is_empty() {
            for mesh in 0..scene.meshes.len() {
                surface.refine(&mut scene, mesh as u32, false, context)?;
            }
        }
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        self.report.absorb(&name, report);
        if !keys.cameras {
            scene.cameras.clear();
            scene.animations.iter_mut().for_each(|a| a.cameras.clear());
        }
        if !keys.lights {
            scene.lights.clear();
            scene.animations.iter_mut().for_each(|a| a.lights.clear());
        }
        let environment = std::mem::take(&mut scene.environment);
        let groups = std::mem::take(&mut scene.groups);
        let bounds = scene.bounds();
        let origin = std::mem::take(&mut scene.origin);
        move_media(&mut scene, origin);
        self.placement.cameras.extend(scene.cameras.iter().map(|camera| View::of(camera, origin)));
        if let Some(fog) = scene.fog.take() {
            self.report.info(format!("{name} brings fog, unless the scene has [fog] of its own"));
            self.scene.fog.get_or_insert(fog);
        }
        self.scene.declares_light |= scene.declares_light;
        if !std::mem::take(&mut scene.portals).is_empty() {
            self.report.info(format!("{name} has portals, which count only where it is rendered by itself"));
        }
        let first = self.scene.refinements.len();
        let merged = self.scene.merge(scene);
        self.displace(surface, first, context)?;
        self.take_environment(environment, merged.images.start as u32, &name);
        let instances = self.scene.instances.split_off(merged.instances.start);
        let lights = self.scene.lights.split_off(merged.lights.start);
        let mut animations = self.scene.animations.split_off(merged.animations.start);
        for animation in &mut animations {
            animation.instances.iter_mut().for_each(|i| i.instance -= merged.instances.start as u32);
            animation.lights.iter_mut().for_each(|l| l.light -= merged.lights.start as u32);
            animation.keyed.iter_mut().for_each(|k| k.renumber(|i| i - merged.instances.start as u32));
        }
        let to_world = DAffine3::from_translation(origin);
        Ok(Template { instances, groups, lights, animations, bounds, to_world })
    }

    /// The environment of a model becomes the scene's, unless it gets one of its own.
    fn take_environment(&mut self, environment: Environment, first_image: u32, name: &str) {
        if environment == Environment::Black {
            return;
        }
        let environment = match environment {
            Environment::Image { image, rotation, intensity } => {
                Environment::Image { image: image + first_image, rotation, intensity }
            }
            other => other,
        };
        self.report
            .info(format!("{name} brings an environment, which the scene's own [environment] replaces"));
        if self.scene.environment == Environment::Black {
            self.scene.environment = environment;
        }
    }

    /// Places the copies of a model.
    fn place_model(
        &mut self,
        object: &Object,
        template: &Template,
        keys: &ModelKeys,
        replacement: Option<MaterialId>,
        context: &Context,
    ) -> Result<(), LoadError> {
        if !object.motion.is_empty() && !template.animations.is_empty() {
            return Err(context.error("`motion` is for models that do not move by themselves"));
        }
        if !object.motion.is_empty() && !template.lights.is_empty() {
            self.report.approximated(format!("{}: its lights do not move with it", keys.file));
        }
        let fit = self.fit(template, keys, context)?;
        let overrides = self.overrides(template, keys, replacement, context)?;
        self.spend_instances(template.instances.len().saturating_mul(object.copies.len()), context)?;
        self.take_copies(template, &overrides, object.copies.len() as u64)?;
        self.group_copies(object, template, &keys.file);
        for (number, copy) in object.copies.iter().enumerate() {
            self.options.budget().check_time()?;
            let motion = object.transform(copy) * fit;
            let world = |transform: &Affine3A| motion * double(transform);
            self.place_animations(template, &motion, !object.visible, number == 0);
            for (instance, materials) in template.instances.iter().zip(&overrides) {
                if let Some(keys) = object.keys(copy, &(fit * double(&instance.transform))) {
                    let number = self.scene.instances.len() as u32;
                    self.placement.keys.push((KeyedObject::Instance(number), keys, instance.name.clone()));
                }
                self.placement.instances.push(world(&instance.transform));
                let mut instance = instance.clone();
                instance.visible &= object.visible;
                instance.dynamic |= object.dynamic;
                if materials.is_some() {
                    instance.materials.clone_from(materials);
                }
                self.scene.instances.push(instance);
            }
            self.scene.lights.extend(template.lights.iter().cloned());
            self.placement.lights.extend(template.lights.iter().map(|_| motion));
        }
        Ok(())
    }

    /// Makes the groups of the copies of a model, which are placed next: one for each, and one for
    /// all of several.
    fn group_copies(&mut self, object: &Object, template: &Template, file: &str) {
        let file = Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
        let (count, copies) = (template.instances.len(), object.copies.len());
        let name = object.name.as_deref().unwrap_or(&file);
        let first = self.scene.instances.len();
        let groups = Arc::make_mut(&mut self.scene.groups);
        let all = (copies > 1).then(|| groups.add(name, None));
        for copy in 0..copies {
            let own = (count > 1).then(|| groups.add(object.copy_name(&file, copy), all));
            groups.append(&template.groups, (first + copy * count) as u32, count, own.or(all));
        }
    }

    /// Takes what `copies` of a model need out of the budget.
    fn take_copies(
        &self,
        template: &Template,
        overrides: &[Option<Vec<MaterialId>>],
        copies: u64,
    ) -> Result<(), LoadError> {
        let own = |m: &Option<Vec<MaterialId>>| m.as_ref().map_or(0, |m| size_of_val(&m[..]) as u64);
        let instances: u64 = template
            .instances
            .iter()
            .zip(overrides)
            .map(|(i, materials)| instance(i.name.len()) + own(&i.materials).max(own(materials)))
            .sum();
        let lights: u64 = template.lights.iter().map(|l| light(l.name.len())).sum();
        let moving = |a: &Animation| {
            (size_of::<Animation>() + size_of_val(&a.instances[..]) + size_of_val(&a.lights[..])) as u64
        };
        let animations: u64 = template.animations.iter().map(moving).sum();
        let groups = template.groups.bytes() + size_of::<Group>() as u64;
        let budget = self.options.budget();
        budget.take(groups.saturating_mul(copies), "groups of models")?;
        budget.take(instances.saturating_mul(copies), "instances of models")?;
        budget.take(lights.saturating_mul(copies), "lights of models")?;
        budget.take(animations.saturating_mul(copies), "animations of models")
    }

    /// Animates the copy of a model that is placed next, by `motion`. What copies share is moved with the first.
    fn place_animations(&mut self, template: &Template, motion: &DAffine3, hidden: bool, is_first: bool) {
        let (instances, lights) = (self.scene.instances.len() as u32, self.scene.lights.len() as u32);
        for mut animation in template.animations.iter().cloned() {
            for instance in &mut animation.instances {
                instance.instance += instances;
                instance.root = *motion * instance.root;
                instance.hidden |= hidden;
            }
            for light in &mut animation.lights {
                light.light += lights;
                light.root = *motion * light.root;
            }
            for keyed in &mut animation.keyed {
                keyed.renumber(|i| i + instances);
                keyed.shift(&motion.as_affine3a());
            }
            if !is_first {
                animation.keyed.retain(|k| matches!(k.object, KeyedObject::Instance(_)));
                animation.deformations.clear();
                animation.materials.clear();
                animation.cameras.clear();
            }
            self.scene.animations.push(animation);
        }
    }

    /// From what the template is relative to to the object: scaled to the size asked for and stood on the ground, if `fit` is given.
    fn fit(&self, template: &Template, keys: &ModelKeys, context: &Context) -> Result<DAffine3, LoadError> {
        let Some(fit) = keys.fit else { return Ok(template.to_world) };
        positive(fit, "fit", context)?;
        let Some((low, high)) = template.bounds else { return Ok(template.to_world) };
        let extent = (high - low).max_element();
        if !(extent.is_finite() && extent > 0.0) {
            return Err(context.error(format!("`fit` cannot scale a model whose size is {extent}")));
        }
        let foot = Vec3::new((low.x + high.x) * 0.5, low.y, (low.z + high.z) * 0.5);
        let scale = DVec3::splat(f64::from(fit) / f64::from(extent));
        Ok(DAffine3::from_scale(scale) * DAffine3::from_translation(-foot.as_dvec3()))
    }

    /// The materials of each instance, where they are replaced.
    fn overrides(
        &mut self,
        template: &Template,
        keys: &ModelKeys,
        replacement: Option<MaterialId>,
        context: &Context,
    ) -> Result<Vec<Option<Vec<MaterialId>>>, LoadError> {
        let mut by_name = HashMap::new();
        for (old, new) in &keys.materials {
            by_name.insert(old.as_str(), self.named_material(new, context)?);
        }
        if by_name.is_empty() && replacement.is_none() {
            return Ok(vec![None; template.instances.len()]);
        }
        let mut used = Vec::new();
        let overrides = template.instances.iter().map(|instance| {
            let replace = |id: &MaterialId| {
                let name = self.scene.materials.get(*id as usize).map_or("", |m| m.name.as_str());
                let named = by_name.get(name).copied();
                if named.is_some() && !used.contains(&name) {
                    used.push(name);
                }
                named.or(replacement).unwrap_or(*id)
            };
            Some(own_materials(&self.scene, instance).iter().map(replace).collect())
        });
        let overrides: Vec<_> = overrides.collect();
        for name in by_name.keys().filter(|name| !used.contains(name)) {
            self.report.ignored(format!("{}: it has no material `{name}` to replace", keys.file));
        }
        Ok(overrides)
    }
}

/// The material of each part of an instance.
fn own_materials(scene: &Scene, instance: &Instance) -> Vec<MaterialId> {
    if let Some(materials) = &instance.materials {
        return materials.clone();
    }
    let mesh = scene.meshes.get(instance.mesh as usize);
    mesh.map(|mesh| mesh.parts.iter().map(|part| part.material).collect()).unwrap_or_default()
}

/// Models that are equal in everything that loading depends on are loaded once.
fn cache_key(path: &Path, keys: &ModelKeys, surface: &SurfaceKeys) -> PathBuf {
    let mut key = canonical(path).into_os_string();
    key.push(format!("\0{}{}{:?}{surface:?}", keys.lights, keys.cameras, keys.parameters));
    key.into()
}
