//! glTF 2.0: `.gltf` with its buffers and images, and `.glb`.
//!
//! The data flow, one file each: `container` (the two parts of a .glb) → `json` (typed, unknown fields skipped) →
//! `extensions` (what is required) → `nodes` (hierarchy flattened) → `groups` (what it leaves for people) → `origin` (what it is stored relative to) → `instances` (which meshes stand where) →
//! `variants` (which materials primitives have) → `materials`, `layers` and `textures` (only those in use) → `meshes` (in parallel, next to the images). `buffers` and
//! `accessor` read numbers, `document` holds what all of them need, and the limits. `animations` reads keyframes, `motion`
//! finds what they move, `binding` says what that is in the scene.
//!
//! What nothing in the shown scene uses is not read: an error in it goes unnoticed.

mod accessor;
mod animations;
mod binding;
mod buffers;
mod cameras;
mod container;
mod document;
mod draco;
mod extensions;
mod factors;
mod groups;
mod image_based;
mod instances;
mod integers;
mod json;
mod layers;
mod lights;
mod materials;
mod meshes;
mod motion;
mod nodes;
mod open_volumes;
mod origin;
mod photometric;
mod pointers;
mod pose;
mod repair;
mod textures;
mod topology;
mod uri;
mod variants;

use super::{LoadError, LoadOptions, Loaded, text};
use crate::animation::AnimatedInstance;
use crate::origin::subtract;
use crate::{Instance, LoadReport, Mesh, Scene};
use binding::Made;
use document::Document;
pub use extensions::{EXTENSIONS, Extension, ExtensionStatus};
use glam::{DAffine3, DVec3};
use instances::{Carrier, Job, Pose};
use meshes::JobDeformation;
use motion::Motion;
use std::borrow::Cow;
use std::path::Path;
use std::sync::atomic::Ordering;
use textures::Textures;

/// Loads a file and the buffers and images that it refers to.
///
/// Shown is the default scene, or else the first, in the pose that nodes and weights describe. Animations are played by
/// [`crate::Scene::set_time`].
///
/// # Errors
/// [`LoadError`]; each names the file and the object. With [`LoadOptions::lenient`], broken primitives and unknown
/// required extensions are left out and reported.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| load_bytes(path, &options.read(path)?, options))
}

/// Loads a file that is in memory already; `path` is where other files are looked for and what messages say.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(path: &Path, file: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| load_bytes_within(path, file, options))
}

fn load_bytes_within(path: &Path, file: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut report = LoadReport { bytes_read: file.len() as u64, ..LoadReport::default() };
    let container = container::split(path, file, &mut report)?;
    let mended: Vec<u8>;
    let text = text::decoded(path, container.json)?;
    if matches!(text, Cow::Owned(_)) {
        report.repaired("the JSON is UTF-16 instead of UTF-8");
    }
    let mut json = match serde_json::from_slice(&text) {
        Ok(json) => json,
        Err(error) => {
            let malformed = || LoadError::malformed(path, "JSON", error.to_string());
            mended = integers::mend(&text).filter(|_| error.is_data()).ok_or_else(malformed)?;
            serde_json::from_slice(&mended)
                .inspect(|_| report.repaired("integers are written as fractions"))
                .map_err(|_| malformed())?
        }
    };
    variants::choose(path, options, &mut json, &mut report)?;
    let document = Document::new(path, options, json, container.binary, file.len() as u64);
    document.check_version(&mut report)?;
    document.check_extensions(&mut report)?;
    let scene = convert(&document, &mut report)?;
    report.bytes_read += document.buffers.extra_bytes.load(Ordering::Relaxed);
    Ok(Loaded { scene, report })
}

fn convert(document: &Document<'_>, report: &mut LoadReport) -> Result<Scene, LoadError> {
    let source = document.shown_scene(report)?;
    let mut hierarchy = document.hierarchy(source, report)?;
    hierarchy.set_origin(document.origin(&hierarchy));
    let clips = document.clips(report);
    let motion = Motion::new(document, &clips, &hierarchy);
    let placement = document.placement(&hierarchy, &motion, report)?;
    let mut textures = Textures::new(document);
    let mut materials = document.materials(&placement.jobs, &mut textures, report)?;
    let mut texture_notes = LoadReport::default();
    let ((textures, mut images), built) = rayon::join(
        || textures.decode(&mut texture_notes),
        || document.build_meshes(&placement.jobs, hierarchy.origin, |m| materials.get(m), report),
    );
    let (mut meshes, mut deformations) = built?;
    let anchors = settle_meshes(&mut meshes, &placement.jobs, &mut deformations);
    let mut kept = Kept::new(meshes, placement.instances, &placement.carriers, &anchors);
    let origin = hierarchy.origin;
    let groups = document.groups(&hierarchy, &kept.nodes)?;
    materials::settle_models(&mut materials.list, &textures, &images);
    open_volumes::mend(&mut kept.meshes, &mut materials.list, report);
    report.bytes_read += texture_notes.bytes_read;
    texture_notes.notes.into_iter().for_each(|note| report.note(note.severity, note.message));
    let mut lights = document.lights(&hierarchy, &motion, report)?;
    document.photometric_lights(&hierarchy, &motion, &mut lights, report)?;
    let cameras = document.cameras(&hierarchy, report)?;
    let mut environment = lights::environment(source, report);
    if let Some((light, image)) = document.image_based_light(source, images.len() as u32, report)? {
        environment = light;
        images.push(image);
    }
    let made = Made {
        jobs: &placement.jobs,
        meshes: &kept.numbers,
        instances: kept.moving,
        deformations,
        materials: &materials,
        cameras: cameras.carriers,
        lights: lights.carriers,
    };
    let animation = document.animation(&clips, hierarchy, &motion, made, report)?;
    let mut scene = Scene {
        meshes: kept.meshes,
        instances: kept.instances,
        groups: groups.into(),
        materials: materials.list,
        textures,
        images,
        lights: lights.objects,
        cameras: cameras.objects,
        environment,
        animations: animation.into_iter().collect(),
        ..Scene::default()
    };
    scene.set_origin(origin, report);
    Ok(scene)
}

/// Stores meshes that instances carry relative to their anchors, and returns those.
fn settle_meshes(meshes: &mut [Mesh], jobs: &[Job], deformations: &mut [JobDeformation]) -> Vec<DVec3> {
    let carried = |(mesh, job): (&mut Mesh, &Job)| {
        let anchor = if matches!(job.pose, Pose::Rest) { mesh.anchor() } else { DVec3::ZERO };
        mesh.subtract(anchor);
        anchor
    };
    let anchors: Vec<DVec3> = meshes.iter_mut().zip(jobs).map(carried).collect();
    for moving in deformations {
        subtract(&mut moving.deformation.rest.positions, anchors[moving.job]);
    }
    anchors
}

/// Meshes that have anything to show, and their instances.
struct Kept {
    meshes: Vec<Mesh>,
    instances: Vec<Instance>,
    /// The node of each instance.
    nodes: Vec<u32>,
    /// Of each mesh that was built: its number among those kept.
    numbers: Vec<Option<u32>>,
    /// The instances that move.
    moving: Vec<AnimatedInstance>,
}

impl Kept {
    /// Removes meshes without parts, and their instances.
    ///
    /// - `anchors`: of each mesh what its vertices are relative to.
    fn new(meshes: Vec<Mesh>, instances: Vec<Instance>, carriers: &[Carrier], anchors: &[DVec3]) -> Self {
        let mut count = 0;
        let numbers = meshes.iter().map(|mesh| {
            let number = (!mesh.parts.is_empty()).then_some(count);
            count += u32::from(number.is_some());
            number
        });
        let numbers: Vec<Option<u32>> = numbers.collect();
        let mut kept = Vec::with_capacity(instances.len());
        let (mut nodes, mut moving) = (Vec::with_capacity(instances.len()), Vec::new());
        for (mut instance, carrier) in instances.into_iter().zip(carriers) {
            let Some(number) = numbers[instance.mesh as usize] else { continue };
            let anchor = DAffine3::from_translation(anchors[instance.mesh as usize]);
            instance.mesh = number;
            instance.transform = (carrier.world * anchor).as_affine3a();
            if carrier.moving {
                moving.push(AnimatedInstance {
                    instance: kept.len() as u32,
                    node: carrier.node,
                    local: carrier.local.map(|local| local * anchor),
                    hidden: false,
                    root: DAffine3::IDENTITY,
                });
            }
            kept.push(instance);
            nodes.push(carrier.node);
        }
        let meshes = meshes.into_iter().filter(|m| !m.parts.is_empty()).collect();
        Self { meshes, instances: kept, nodes, numbers, moving }
    }
}
