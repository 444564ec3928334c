//! The scene that is open: where it came from, what was changed of it, and all of it that panels show.

use crate::history::History;
use crate::thumbnails::thumbnail;
use alhazen::edits::{EditError, Editable, EditedFile, Edits, Resources};
use alhazen::{
    Animation, LoadReport, Mesh, MeshPart, Moment, Place, RenderDefaults, Scene, Shape, Source, TriangleMesh,
};
use glam::Vec3;
use std::path::Path;

/// How many there are of what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Triangles stored.
    pub triangles: usize,
    /// Triangles in the world, instances counted.
    pub instanced_triangles: u64,
    /// Meshes.
    pub meshes: usize,
    /// Pictures.
    pub images: usize,
}

/// A scene that is open. Geometry and pictures are with the render thread: here are names, numbers, bounds and thumbnails.
pub struct Document {
    /// Where it came from.
    pub source: Source,
    /// Which of the scenes that were opened it is.
    pub generation: u64,
    /// What was noticed while loading.
    pub report: LoadReport,
    /// How many there are of what.
    pub counts: Counts,
    /// What its file says about rendering.
    pub defaults: RenderDefaults,
    /// Files that the edits refer to, complete.
    pub resources: Resources,
    /// As `resources`, without geometry.
    outlines: Resources,
    base: Base,
    /// Widths and heights of the images of the scene without edits.
    image_sizes: Vec<[u32; 2]>,
    outline: Editable,
    edits: History<Edits>,
    moment: Moment,
    /// The edits that are in the file.
    saved: Edits,
}

/// What edits are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// The scene without edits.
    pub source: Source,
    /// The edits that it came with.
    pub edits: Edits,
}

impl Document {
    /// A scene that was just loaded.
    pub fn new(
        source: Source,
        base: Base,
        scene: &Scene,
        resources: Resources,
        report: LoadReport,
        generation: u64,
    ) -> Self {
        let counts = Counts {
            triangles: scene.unique_triangles(),
            instanced_triangles: scene.instanced_triangles(),
            meshes: scene.meshes.len(),
            images: scene.images.len(),
        };
        let edits = base.edits.clone();
        let mut document = Self {
            source,
            generation,
            report,
            counts,
            defaults: scene.defaults.clone(),
            outlines: outlines_of(&resources),
            resources,
            image_sizes: sizes_of(scene).collect(),
            outline: Editable::new(outline(scene)),
            edits: History::new(edits.clone()),
            moment: Moment::default(),
            saved: edits,
            base,
        };
        // The loader has applied the same edits to the same scene.
        let _ = document.follow();
        document
    }

    /// The scene as it is now, without what is large: meshes have only their bounds, images are thumbnails.
    pub fn scene(&self) -> &Scene {
        self.outline.scene()
    }

    /// The scene before values were changed.
    pub fn unchanged(&self) -> &Scene {
        self.outline.unchanged()
    }

    /// What was changed.
    pub fn edits(&self) -> &Edits {
        self.edits.now()
    }

    /// Whether there is something to save.
    pub fn is_changed(&self) -> bool {
        *self.edits.now() != self.saved
    }

    /// Whether the file is a scene with edits on top, as programs write it.
    pub fn is_edited_file(&self) -> bool {
        self.base.source != self.source
    }

    /// Changes the scene; see [`History::change`].
    ///
    /// # Errors
    /// For edits that the scene cannot have; nothing is changed then.
    pub fn edit(&mut self, what: &str, time: f64, change: impl FnOnce(&mut Edits)) -> Result<(), EditError> {
        let before = self.edits.clone();
        self.edits.change(what, time, change);
        self.follow().inspect_err(|_| {
            self.edits = before;
            let _ = self.follow();
        })
    }

    /// See [`History::set_gesture`].
    pub fn set_gesture(&mut self, gesture: Option<u64>) {
        self.edits.set_gesture(gesture);
    }

    /// Takes a step back.
    pub fn undo(&mut self) -> bool {
        self.edits.undo() && self.follow().is_ok()
    }

    /// Takes back what a drag has changed that was given up.
    pub fn abandon(&mut self) -> bool {
        self.edits.abandon() && self.follow().is_ok()
    }

    /// Makes a step again.
    pub fn redo(&mut self) -> bool {
        self.edits.redo() && self.follow().is_ok()
    }

    /// Whether there are steps to take back, and to make again.
    pub fn can_undo_redo(&self) -> (bool, bool) {
        (self.edits.can_undo(), self.edits.can_redo())
    }

    fn follow(&mut self) -> Result<(), EditError> {
        self.outline.set_at(self.edits.now(), &self.outlines, &self.moment)
    }

    /// The moment that the scene is shown at.
    pub fn moment(&self) -> &Moment {
        &self.moment
    }

    /// Brings the scene to another moment. Its edits stay.
    ///
    /// # Errors
    /// For edits that the scene cannot have.
    pub fn set_moment(&mut self, moment: Moment) -> Result<(), EditError> {
        self.moment = moment;
        self.follow()
    }

    /// What can be played: names of clips, or numbers of those without a name.
    pub fn clips(&self) -> Vec<String> {
        let mut names = Vec::new();
        for (number, clip) in self.scene().animations.iter().flat_map(|a| a.clips.iter().enumerate()) {
            let name = if clip.name.is_empty() { number.to_string() } else { clip.name.clone() };
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Takes files that edits will refer to.
    pub fn add_resources(&mut self, resources: Resources) {
        let outlines = outlines_of(&resources);
        self.outlines.models.extend(outlines.models);
        self.outlines.environments.extend(outlines.environments);
        self.outlines.pictures.extend(outlines.pictures);
        self.resources.models.extend(resources.models);
        self.resources.environments.extend(resources.environments);
        self.resources.pictures.extend(resources.pictures);
    }

    /// Width and height of an image of the scene, pixels.
    pub fn image_size(&self, image: u32) -> Option<[u32; 2]> {
        // What models bring comes after, in the order of their additions.
        let added = self.edits().models().filter_map(|file| self.resources.models.get(file));
        let added = added.flat_map(|model| sizes_of(model));
        let pictures = self.edits().pictures().filter_map(|file| self.resources.pictures.get(file));
        let pictures = pictures.map(|picture| [picture.width, picture.height]);
        self.image_sizes.iter().copied().chain(added).chain(pictures).nth(image as usize)
    }

    /// World bounds of an object.
    pub fn bounds_of(&self, instance: u32) -> Option<(Vec3, Vec3)> {
        let scene = self.scene();
        let instance = scene.instances.get(instance as usize)?;
        let alone = Scene {
            meshes: vec![scene.meshes.get(instance.mesh as usize)?.clone()],
            instances: vec![alhazen::Instance { mesh: 0, visible: true, ..instance.clone() }],
            ..Scene::default()
        };
        alone.bounds()
    }

    /// The material that an object's first part has.
    pub fn material_of(&self, instance: u32) -> Option<u32> {
        let scene = self.scene();
        let instance = scene.instances.get(instance as usize)?;
        let own = || scene.meshes.get(instance.mesh as usize)?.parts.first().map(|p| p.material);
        match &instance.materials {
            Some(materials) => materials.first().copied(),
            None => own(),
        }
    }

    /// The scene as a file for `path`, with `edits` and with what it says about rendering.
    ///
    /// # Errors
    /// For paths that cannot be written.
    pub fn text(
        &self,
        path: &Path,
        edits: Edits,
        render: RenderDefaults,
    ) -> Result<String, alhazen::edits::WriteError> {
        let (file, builtin) = match &self.base.source.place {
            Place::File(file) => (Some(file.clone()), None),
            Place::Builtin(name) => (None, Some(name.clone())),
        };
        let parameters = self.base.source.parameters.clone();
        let name = self.scene().name.clone();
        let file = EditedFile { name, file, builtin, parameters, render, edits };
        let folder = path.parent().unwrap_or(Path::new(""));
        file.to_text(folder)
    }

    /// The edits are in the file now.
    pub fn mark_saved(&mut self) {
        self.saved = self.edits.now().clone();
    }
}

/// Widths and heights of the images of a scene.
fn sizes_of(scene: &Scene) -> impl Iterator<Item = [u32; 2]> {
    scene.images.iter().map(|image| [image.width, image.height])
}

/// A scene without what is large: meshes have two vertices, the corners of their bounds; images are thumbnails.
pub fn outline(scene: &Scene) -> Scene {
    let part = |part: &MeshPart| {
        let corners = part.shape.bounds().map_or(Vec::new(), |(low, high)| vec![low, high]);
        let shape = Shape::Triangles(TriangleMesh { positions: corners, ..TriangleMesh::default() });
        MeshPart { shape, material: part.material }
    };
    let mesh = |mesh: &Mesh| Mesh { name: mesh.name.clone(), parts: mesh.parts.iter().map(part).collect() };
    Scene {
        name: scene.name.clone(),
        origin: scene.origin,
        meshes: scene.meshes.iter().map(mesh).collect(),
        instances: scene.instances.clone(),
        groups: scene.groups.clone(),
        materials: scene.materials.clone(),
        textures: scene.textures.clone(),
        images: scene.images.iter().map(thumbnail).collect(),
        lights: scene.lights.clone(),
        cameras: scene.cameras.clone(),
        environment: scene.environment.clone(),
        portals: scene.portals.clone(),
        fog: scene.fog.clone(),
        declares_light: scene.declares_light,
        defaults: scene.defaults.clone(),
        animations: scene.animations.iter().map(without_vertices).collect(),
        motion: None,
        refinements: Vec::new(),
    }
}

/// Movements of all but vertices, which are not there.
fn without_vertices(animation: &Animation) -> Animation {
    Animation { deformations: Vec::new(), ..animation.clone() }
}

fn outlines_of(resources: &Resources) -> Resources {
    let models = resources.models.iter().map(|(path, scene)| (path.clone(), outline(scene).into()));
    let environments =
        resources.environments.iter().map(|(path, image)| (path.clone(), thumbnail(image).into()));
    let pictures = resources.pictures.iter().map(|(path, image)| (path.clone(), thumbnail(image).into()));
    Resources { models: models.collect(), environments: environments.collect(), pictures: pictures.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::LoadOptions;

    fn open(name: &str) -> Document {
        let source = Source::parse(name);
        let loaded = source.load(&LoadOptions::default()).expect("built in");
        let base = Base { source: source.clone(), edits: Edits::default() };
        Document::new(source, base, &loaded.scene, Resources::default(), loaded.report, 1)
    }

    #[test]
    fn outlines_have_the_bounds_of_the_scene() {
        let scene = Source::parse("three-spheres").load(&LoadOptions::default()).expect("built in").scene;
        assert_eq!(outline(&scene).bounds(), scene.bounds());
        assert_eq!(outline(&scene).unique_triangles(), 0);
    }

    #[test]
    fn edits_are_seen_and_taken_back() {
        let mut document = open("cornell");
        let record =
            alhazen::edits::MaterialRecord { roughness: 0.125, ..(&document.scene().materials[0]).into() };
        document.edit("material", 0.0, |e| drop(e.materials.insert(0, record))).expect("valid");
        assert_eq!(document.scene().materials[0].roughness, 0.125);
        assert!(document.is_changed() && document.can_undo_redo() == (true, false));
        assert!(document.undo() && document.scene().materials[0].roughness != 0.125);
        assert!(!document.is_changed());
    }

    #[test]
    fn impossible_edits_change_nothing() {
        let mut document = open("cornell");
        let before = document.edits().clone();
        let result = document.edit("object", 0.0, |e| e.object(9999).removed = true);
        assert!(matches!(result, Err(EditError::Object { id: 9999, .. })));
        assert_eq!(*document.edits(), before);
        assert!(!document.can_undo_redo().0);
    }

    #[test]
    fn objects_have_bounds_in_the_world() {
        let mut document = open("three-spheres");
        let (low, _) = document.bounds_of(0).expect("there");
        let moved = glam::Affine3A::from_translation(Vec3::new(0.0, 10.0, 0.0));
        let transform = moved * document.scene().instances[0].transform;
        document.edit("move", 0.0, |e| e.object(0).set_transform(&transform)).expect("valid");
        let (after, _) = document.bounds_of(0).expect("there");
        assert!((after - low).distance(Vec3::new(0.0, 10.0, 0.0)) < 1e-4);
    }
}
