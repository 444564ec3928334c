//! Data sets: for each pose a picture, a file of exact layers, and annotations as COCO has them.
//!
//! A folder gets `images/000000.png` (as people see it), `layers/000000.exr` (colour, depth, normals, position, flow to the next
//! pose, ids) and `annotations.json`. The last is written last: a folder that has it is complete.

mod coco;
mod poses;

pub use coco::run_lengths;
pub use poses::Poses;

use crate::camera::{GroundTruth, Motion};
use crate::categories::Categories;
use crate::error::SensorError;
use alhazen::{
    Camera, Control, ExrChannel, ExrCompression, ExrFile, ExrSamples, Film, Image, ImageError, Job, Limits,
    Precision, RayQueries, Rect, Renderer, Scene, SceneTables, prove_writable, write_atomically,
};
use coco::Annotations;
use glam::Affine3A;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What to make a data set of.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// The scene.
    pub scene: Scene,
    /// Where the camera is for each picture.
    pub poses: Poses,
    /// Categories by instance name; all others are called as their mesh is.
    pub categories: BTreeMap<String, String>,
    /// Integrator, seed and tone mapping of the pictures; camera, size and layers come from the poses.
    pub job: Job,
    /// When a picture is done.
    pub limits: Limits,
}

/// What [`Dataset::export`] wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Pictures.
    pub images: usize,
    /// Annotated objects in all pictures.
    pub annotations: usize,
}

impl Dataset {
    /// All files that [`Dataset::export`] writes into `folder`, of a data set with so many poses.
    pub fn files(folder: &Path, poses: usize) -> impl Iterator<Item = PathBuf> {
        let pair = |number| [picture_name(number), layers_name(number)];
        let names = (0..poses).flat_map(pair).chain([ANNOTATIONS.into()]);
        names.map(|name| folder.join(name))
    }

    /// Writes the data set into `folder`, which is made if need be. `after_image` hears of each picture that is done.
    ///
    /// # Errors
    /// See [`SensorError`]. Pictures that were finished stay.
    pub fn export(
        &self,
        folder: &Path,
        renderer: &mut Renderer,
        control: &Control,
        mut after_image: impl FnMut(usize),
    ) -> Result<Exported, SensorError> {
        for part in ["images", "layers"] {
            let path = folder.join(part);
            std::fs::create_dir_all(&path)
                .map_err(|source| SensorError::Folder { path: path.clone(), source })?;
        }
        // Before hours are spent on what cannot be written.
        Self::files(folder, 1).try_for_each(|path| prove_writable(&path))?;
        let cameras = self.poses.cameras()?;
        let categories = Categories::new(&self.scene, &self.categories);
        let mut annotations = Annotations::new(&categories);
        let mut scene = self.moved(0)?;
        let mut queries = RayQueries::new(SceneTables::build(&scene), None)?;
        renderer.load(&scene)?;
        for (number, camera) in cameras.iter().enumerate() {
            // The picture before counts as the next for the last: every flow has somewhere to go.
            let next_number = if number + 1 < cameras.len() { number + 1 } else { number.saturating_sub(1) };
            let next_scene = self.moved(next_number)?;
            let next = Motion { camera: &cameras[next_number], scene: Some(&next_scene) };
            if number > 0 && !self.poses.moves.is_empty() {
                queries = RayQueries::new(SceneTables::build(&scene), None)?;
                renderer.update(&scene)?;
            }
            let size = (self.poses.width, self.poses.height);
            let truth =
                GroundTruth::observe(&scene, &queries, &categories, camera, size, Some(next), control)?;
            let film = self.picture(renderer, camera, control)?;
            let (png, exr) = (picture_name(number), layers_name(number));
            alhazen::output::write(&folder.join(&png), film, &self.job.tone, &BTreeMap::new())?;
            layers(film, &truth).write(&folder.join(&exr), ExrCompression::Zip)?;
            annotations.add(&scene, &categories, &self.poses, number, &truth, [&png, &exr]);
            after_image(number);
            scene = if number + 1 < cameras.len() { next_scene } else { scene };
        }
        let text = annotations.to_json();
        let path = folder.join(ANNOTATIONS);
        let failed = |source| ImageError::Write { path: path.clone(), source };
        write_atomically(&path, |writer| writer.write_all(text.as_bytes()).map_err(failed))?;
        Ok(Exported { images: cameras.len(), annotations: annotations.count() })
    }

    /// The scene with its instances where they are at a pose.
    fn moved(&self, pose: usize) -> Result<Scene, SensorError> {
        let mut scene = self.scene.clone();
        for (name, transforms) in &self.poses.moves {
            let transform = transforms.get(pose).map(affine);
            let instance = scene.instances.iter_mut().find(|i| i.name == *name);
            let (Some(transform), Some(instance)) = (transform, instance) else {
                return Err(SensorError::setting(
                    "moves",
                    name,
                    "is not the name of an instance with a matrix for each pose",
                ));
            };
            instance.transform = transform;
            instance.dynamic = true;
        }
        Ok(scene)
    }

    fn picture<'r>(
        &self,
        renderer: &'r mut Renderer,
        camera: &Camera,
        control: &Control,
    ) -> Result<&'r Film, SensorError> {
        let (width, height) = (self.poses.width, self.poses.height);
        let job =
            Job { camera: camera.clone(), width, height, crop: None, aovs: Vec::new(), ..self.job.clone() };
        renderer.restart();
        let summary = renderer.render(&job, &self.limits, control)?;
        if summary.cancelled {
            return Err(SensorError::Cancelled);
        }
        renderer.film()?.ok_or(SensorError::Cancelled)
    }
}

const ANNOTATIONS: &str = "annotations.json";

fn picture_name(number: usize) -> PathBuf {
    format!("images/{number:06}.png").into()
}

fn layers_name(number: usize) -> PathBuf {
    format!("layers/{number:06}.exr").into()
}

/// Colour and exact layers as one file.
fn layers(film: &Film, truth: &GroundTruth) -> ExrFile {
    let (width, height) = (truth.width, truth.height);
    let mut file = ExrFile::new(width, height, Rect::full(width, height));
    file.push_colour(&film.to_image(), Precision::Half);
    let mut push = |layer: &str, channels: &[&str], values: &[f32]| {
        // Arrays of one row for each pixel always have the picture's shape.
        if let Ok(image) = Image::from_data(width, height, channels.len(), values.to_vec()) {
            file.push_layer(layer, channels, &image, Precision::Float);
        }
    };
    push("depth", &["Z"], &truth.depth);
    push("position", &["X", "Y", "Z"], truth.position.as_flattened());
    push("normal", &["X", "Y", "Z"], truth.normal.as_flattened());
    push("flow", &["X", "Y"], truth.flow.as_flattened());
    for (name, ids) in
        [("instance", &truth.instance), ("category", &truth.category), ("material", &truth.material)]
    {
        let samples = ExrSamples::Uint(ids.clone());
        file.channels.push(ExrChannel { name: format!("{name}.I"), samples });
    }
    file
}

/// Rows of a matrix as the map that scenes know.
fn affine(rows: &[[f64; 4]; 4]) -> Affine3A {
    let [x, y, z, _] = rows.map(|row| row.map(|v| v as f32));
    let column = |i: usize| glam::Vec3::new(x[i], y[i], z[i]);
    Affine3A::from_mat3_translation(glam::Mat3::from_cols(column(0), column(1), column(2)), column(3))
}
