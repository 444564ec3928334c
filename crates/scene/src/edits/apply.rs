//! From a scene and edits to the edited scene.

use super::tree::Unseen;
use super::{Addition, Edits, EnvironmentRecord, GraphProblem};
use crate::animation::{KeyedObject, Moment};
use crate::{
    Environment, EnvironmentPreset, GroupId, Groups, Image, Instance, InstanceId, Material, MaterialId, Mesh,
    Scene, Shape, Sphere, Texture, TextureGraph, TextureId,
};
use glam::{Affine3A, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files that edits refer to, loaded.
#[derive(Clone, Debug, Default)]
pub struct Resources {
    /// Models, by the path that the edits name.
    pub models: HashMap<PathBuf, Arc<Scene>>,
    /// Environment pictures, by the path that the edits name.
    pub environments: HashMap<PathBuf, Arc<Image>>,
    /// Pictures that take the place of textures, by the path that the edits name.
    pub pictures: HashMap<PathBuf, Arc<Image>>,
}

/// Why edits cannot be applied.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// A material that is not there.
    #[error("there is no material {id}; the scene has {count}")]
    Material {
        /// Its number.
        id: MaterialId,
        /// How many there are.
        count: usize,
    },
    /// An object that is not there.
    #[error("there is no object {id}; the scene has {count}")]
    Object {
        /// Its number.
        id: InstanceId,
        /// How many there are.
        count: usize,
    },
    /// A group that is not there.
    #[error("there is no group {id}; the scene has {count}")]
    Group {
        /// Its number.
        id: GroupId,
        /// How many there are.
        count: usize,
    },
    /// A texture that is not there.
    #[error("there is no texture {id}; the scene has {count}")]
    Texture {
        /// Its number.
        id: TextureId,
        /// How many there are.
        count: usize,
    },
    /// A texture that is an image cannot become a graph.
    #[error("texture {0} is an image and not a graph")]
    NotAGraph(TextureId),
    /// A graph that cannot be evaluated.
    #[error("texture {id}: {problem}")]
    Graph {
        /// The number of the texture.
        id: TextureId,
        /// What is wrong, and in which node.
        problem: GraphProblem,
    },
    /// A file that was not loaded.
    #[error("{0} was not loaded")]
    File(PathBuf),
    /// A number that means nothing.
    #[error("{object}: {problem}")]
    Value {
        /// Of what.
        object: String,
        /// What is wrong.
        problem: String,
    },
}

/// A scene and what is needed to give it other edits: the geometry stands there once, whatever changes.
#[derive(Clone, Debug)]
pub struct Editable {
    pub(super) scene: Scene,
    original: Version,
    /// The original with `added`: what most changes of the edits begin with.
    extended: Version,
    added: Vec<Addition>,
    /// Whether meshes may have another shape than at rest.
    deformed: bool,
}

/// What a scene was at some time. Of meshes and pictures only the number is kept: edits add to them and change none.
#[derive(Clone, Debug)]
struct Version {
    small: Scene,
    meshes: usize,
    images: usize,
}

impl Version {
    fn of(scene: &mut Scene) -> Self {
        let large = (std::mem::take(&mut scene.meshes), std::mem::take(&mut scene.images));
        let small = scene.clone();
        (scene.meshes, scene.images) = large;
        let (meshes, images) = (scene.meshes.len(), scene.images.len());
        Self { small, meshes, images }
    }

    /// Makes a scene that has got more since what it was.
    fn restore(&self, scene: &mut Scene) {
        scene.meshes.truncate(self.meshes);
        scene.images.truncate(self.images);
        scene.textures.clone_from(&self.small.textures);
        scene.materials.clone_from(&self.small.materials);
        scene.instances.clone_from(&self.small.instances);
        scene.groups.clone_from(&self.small.groups);
        scene.lights.clone_from(&self.small.lights);
        scene.cameras.clone_from(&self.small.cameras);
        scene.environment.clone_from(&self.small.environment);
        scene.animations.clone_from(&self.small.animations);
    }
}

impl Editable {
    /// A scene without edits.
    pub fn new(mut scene: Scene) -> Self {
        let original = Version::of(&mut scene);
        Self { scene, extended: original.clone(), original, added: Vec::new(), deformed: false }
    }

    /// The scene with the edits that it was given last.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene before values of what is in it were changed, with what was added, without geometry and pictures.
    pub fn unchanged(&self) -> &Scene {
        &self.extended.small
    }

    /// As [`Editable::scene`], without the rest.
    pub fn into_scene(self) -> Scene {
        self.scene
    }

    /// Gives the scene these edits instead of those that it had, at rest.
    ///
    /// # Errors
    /// See [`EditError`]. The scene then has some of the edits.
    pub fn set(&mut self, edits: &Edits, resources: &Resources) -> Result<(), EditError> {
        self.set_at(edits, resources, &Moment::default())
    }

    /// As [`Editable::set`], at a moment. What the scene was before has no influence on what it becomes.
    ///
    /// # Errors
    /// As [`Editable::set`].
    pub fn set_at(&mut self, edits: &Edits, resources: &Resources, moment: &Moment) -> Result<(), EditError> {
        if std::mem::take(&mut self.deformed) {
            self.scene.rest_meshes();
        }
        self.set_at_rest(edits, resources)?;
        self.deformed = moment.time.is_some();
        self.scene.set_moment(moment);
        Ok(())
    }

    fn set_at_rest(&mut self, edits: &Edits, resources: &Resources) -> Result<(), EditError> {
        if self.added == edits.additions {
            self.extended.restore(&mut self.scene);
        } else {
            self.extend(&edits.additions, resources)?;
        }
        self.edit_textures(edits)?;
        self.edit_materials(edits)?;
        self.edit_slots(edits, resources)?;
        self.edit_objects(edits)?;
        self.edit_groups(edits)?;
        self.hold_still(edits);
        if let Some(lights) = &edits.lights {
            self.scene.lights = lights.iter().map(crate::Light::valid).collect();
        }
        if let Some(cameras) = &edits.cameras {
            self.scene.cameras = cameras.iter().map(super::CameraRecord::camera).collect();
        }
        match &edits.environment {
            Some(environment) => self.set_environment(environment, resources),
            None => Ok(()),
        }
    }

    /// Gives the original these additions.
    fn extend(&mut self, additions: &[Addition], resources: &Resources) -> Result<(), EditError> {
        self.original.restore(&mut self.scene);
        self.added.clear();
        self.extended = self.original.clone();
        for addition in additions {
            self.add(addition, resources)?;
        }
        self.added = additions.to_vec();
        self.extended = Version::of(&mut self.scene);
        Ok(())
    }

    /// What was put somewhere stays there, and what was given a value keeps it, whatever the scene's animations say.
    fn hold_still(&mut self, edits: &Edits) {
        let edited = |id: u32| edits.objects.get(&id);
        let unseen = Unseen::of(edits, &self.scene.groups);
        let is_unseen = |id: u32| unseen.as_ref().is_some_and(|unseen| unseen.holds(id));
        for animation in &mut self.scene.animations {
            animation.instances.retain(|i| edited(i.instance).is_none_or(|o| o.transform.is_none()));
            animation.keyed.retain(|k| match k.object {
                KeyedObject::Instance(i) => edited(i).is_none_or(|o| o.transform.is_none()),
                KeyedObject::Camera(_) => edits.cameras.is_none(),
            });
            for instance in &mut animation.instances {
                if let Some(object) = edited(instance.instance) {
                    instance.hidden = object.removed || object.visible.map_or(instance.hidden, |v| !v);
                }
                instance.hidden |= is_unseen(instance.instance);
            }
            animation.materials.retain(|m| !edits.materials.contains_key(&m.material));
            if edits.lights.is_some() {
                animation.lights.clear();
            }
            if edits.cameras.is_some() {
                animation.cameras.clear();
            }
        }
    }

    fn add(&mut self, addition: &Addition, resources: &Resources) -> Result<(), EditError> {
        match addition {
            Addition::Model { file } => {
                let model = resources.models.get(file).ok_or_else(|| EditError::File(file.clone()))?;
                let mut model = Scene::clone(model);
                model.cameras.clear();
                model.animations.iter_mut().for_each(|a| a.cameras.clear());
                group_model(&mut model, file);
                self.scene.merge(model);
            }
            Addition::Copy { of } => {
                let mut copy = self.instance(*of)?.clone();
                copy.name += " copy";
                let group = self.scene.groups.of(*of);
                let number = self.scene.instances.len() as InstanceId;
                if group.is_some() {
                    Arc::make_mut(&mut self.scene.groups).put(number, group);
                }
                self.scene.instances.push(copy);
            }
            Addition::Material { of } => {
                let mut copy = self.material(*of)?.clone();
                copy.name += " copy";
                self.scene.materials.push(copy);
            }
            Addition::Lamp { radius, radiance } => self.add_lamp(*radius, Vec3::from_array(*radiance))?,
        }
        Ok(())
    }

    fn add_lamp(&mut self, radius: f32, radiance: Vec3) -> Result<(), EditError> {
        let positive = radius > 0.0 && radius.is_finite();
        if !(positive && radiance.is_finite() && radiance.min_element() >= 0.0) {
            let problem = format!("radius {radius} and radiance {radiance} must be positive");
            return Err(EditError::Value { object: "a lamp".into(), problem });
        }
        let material = self.scene.materials.len() as MaterialId;
        self.scene.materials.push(Material {
            name: "lamp".into(),
            emission: radiance,
            ..Material::default()
        });
        let mesh = self.scene.meshes.len() as u32;
        let sphere = Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius }]);
        self.scene.meshes.push(Mesh::single("lamp", sphere, material));
        let instance = Instance { dynamic: true, ..Instance::new("lamp", mesh, Affine3A::IDENTITY) };
        self.scene.instances.push(instance);
        Ok(())
    }

    fn instance(&self, id: InstanceId) -> Result<&Instance, EditError> {
        let count = self.scene.instances.len();
        self.scene.instances.get(id as usize).ok_or(EditError::Object { id, count })
    }

    pub(super) fn material(&self, id: MaterialId) -> Result<&Material, EditError> {
        let count = self.scene.materials.len();
        self.scene.materials.get(id as usize).ok_or(EditError::Material { id, count })
    }

    fn edit_materials(&mut self, edits: &Edits) -> Result<(), EditError> {
        for (id, record) in &edits.materials {
            self.material(*id)?;
            if let Some(problem) = record.problem() {
                return Err(EditError::Value { object: format!("material {id}"), problem });
            }
            record.apply(&mut self.scene.materials[*id as usize]);
        }
        Ok(())
    }

    fn edit_textures(&mut self, edits: &Edits) -> Result<(), EditError> {
        let count = self.scene.textures.len();
        for (&id, record) in &edits.textures {
            match self.scene.textures.get(id as usize) {
                None => return Err(EditError::Texture { id, count }),
                Some(Texture::Image(_)) => return Err(EditError::NotAGraph(id)),
                Some(Texture::Graph(_)) => {}
            }
            let graph = record.graph().and_then(|graph| self.with_images(graph));
            let graph = graph.map_err(|problem| EditError::Graph { id, problem })?;
            self.scene.textures[id as usize] = Texture::Graph(graph);
        }
        Ok(())
    }

    /// The graph, if what it shows is there and an image.
    fn with_images(&self, graph: TextureGraph) -> Result<TextureGraph, GraphProblem> {
        for (number, node) in graph.nodes.iter().enumerate() {
            let Some(shown) = node.image else { continue };
            let problem = match self.scene.textures.get(shown.texture as usize) {
                Some(Texture::Image(_)) => continue,
                Some(Texture::Graph(_)) => {
                    format!("texture {} is a graph, and it shows images", shown.texture)
                }
                None => format!("there is no texture {}", shown.texture),
            };
            return Err(GraphProblem::Node { number, kind: node.kind.name.into(), problem });
        }
        Ok(graph)
    }

    fn edit_objects(&mut self, edits: &Edits) -> Result<(), EditError> {
        for (id, edit) in &edits.objects {
            let mesh = self.instance(*id)?.mesh;
            if let Some(material) = edit.material {
                self.material(material)?;
            }
            let parts = self.scene.meshes.get(mesh as usize).map_or(0, |m| m.parts.len());
            let instance = &mut self.scene.instances[*id as usize];
            if let Some(name) = &edit.name {
                instance.name.clone_from(name);
            }
            if let Some(transform) = &edit.transform {
                if !transform.iter().all(|v| v.is_finite()) {
                    let problem = format!("the transform {transform:?} is not finite");
                    return Err(EditError::Value { object: format!("object {id}"), problem });
                }
                instance.transform = Affine3A::from_cols_array(transform);
                // It will move again: the geometry must not be built anew each time.
                instance.dynamic = true;
            }
            instance.visible = edit.visible.unwrap_or(instance.visible) && !edit.removed;
            if let Some(material) = edit.material {
                instance.materials = Some(vec![material; parts]);
            }
        }
        Ok(())
    }

    fn set_environment(
        &mut self,
        environment: &EnvironmentRecord,
        resources: &Resources,
    ) -> Result<(), EditError> {
        self.scene.environment = match environment {
            // Not `Environment::Black`: scenes that say nothing may get daylight.
            EnvironmentRecord::Black => Environment::Constant(Vec3::ZERO),
            EnvironmentRecord::Constant { radiance } => Environment::Constant((*radiance).into()),
            EnvironmentRecord::Sky(sky) => Environment::Sky(sky.sky()),
            EnvironmentRecord::Daylight(daylight) => Environment::Daylight(daylight.daylight()),
            EnvironmentRecord::Own { rotation, intensity } => {
                let Environment::Image { image, .. } = self.original.small.environment else {
                    let problem = "the scene has no picture of its own around it".into();
                    return Err(EditError::Value { object: "environment".into(), problem });
                };
                Environment::Image { image, rotation: *rotation, intensity: *intensity }
            }
            EnvironmentRecord::Studio { rotation, intensity } => {
                EnvironmentPreset::Studio.put_around(&mut self.scene, *rotation, *intensity);
                return Ok(());
            }
            EnvironmentRecord::File { file, rotation, intensity } => {
                let image = self.add_environment(file, resources)?;
                Environment::Image { image, rotation: *rotation, intensity: *intensity }
            }
        };
        Ok(())
    }

    fn add_environment(&mut self, file: &Path, resources: &Resources) -> Result<u32, EditError> {
        let image = resources.environments.get(file).ok_or_else(|| EditError::File(file.to_owned()))?;
        self.scene.images.push(Image::clone(image));
        Ok(self.scene.images.len() as u32 - 1)
    }
}

/// Puts all objects of a model into one group, named as its file, if there are several.
fn group_model(model: &mut Scene, file: &Path) {
    if model.instances.len() < 2 {
        return;
    }
    let mut groups = Groups::default();
    let all = groups.add(file.file_stem().unwrap_or_default().to_string_lossy(), None);
    groups.append(&model.groups, 0, model.instances.len(), Some(all));
    model.groups = Arc::new(groups);
}
