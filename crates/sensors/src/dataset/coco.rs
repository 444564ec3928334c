//! Annotations as COCO has them (<https://cocodataset.org/#format-data>), with poses and three-dimensional boxes added.

use super::Poses;
use crate::boxes::object_box;
use crate::camera::GroundTruth;
use crate::categories::Categories;
use alhazen::Scene;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Annotations of all pictures.
pub(super) struct Annotations {
    images: Vec<Value>,
    annotations: Vec<Value>,
    categories: Vec<Value>,
}

/// The pixels of one object.
struct Mask {
    /// Numbers of the pixels, column by column as COCO counts them, ascending.
    pixels: Vec<u32>,
    left: u32,
    top: u32,
    right: u32,
    bottom: u32,
}

impl Annotations {
    pub fn new(categories: &Categories) -> Self {
        let category = |(id, name): (u32, &str)| json!({ "id": id, "name": name, "supercategory": "" });
        Self {
            images: Vec::new(),
            annotations: Vec::new(),
            categories: categories.list().map(category).collect(),
        }
    }

    pub fn count(&self) -> usize {
        self.annotations.len()
    }

    /// Adds a picture and what is seen in it. Poses and boxes are written in the world of the
    /// scene's file.
    pub fn add(
        &mut self,
        scene: &Scene,
        categories: &Categories,
        poses: &Poses,
        number: usize,
        truth: &GroundTruth,
        [png, exr]: [&PathBuf; 2],
    ) {
        let slashes = |path: &PathBuf| path.to_string_lossy().replace('\\', "/");
        self.images.push(json!({
            "id": number, "width": truth.width, "height": truth.height,
            "file_name": slashes(png), "layers": slashes(exr),
            "camera": {
                "matrix": poses.matrix,
                "distortion": poses.distortion,
                "fisheye": poses.fisheye,
                "pose": in_world(scene, &poses.poses[number]),
            },
        }));
        for (instance, mask) in masks(truth) {
            let (width, height) = (mask.right - mask.left + 1, mask.bottom - mask.top + 1);
            let found = object_box(scene, instance as usize);
            let name = scene.instances.get(instance as usize).map(|i| i.name.as_str());
            self.annotations.push(json!({
                "id": self.annotations.len() + 1,
                "image_id": number,
                "category_id": categories.of_instance(instance),
                "bbox": [mask.left, mask.top, width, height],
                "area": mask.pixels.len(),
                "segmentation": {
                    "counts": run_lengths(&mask.pixels, truth.width * truth.height),
                    "size": [truth.height, truth.width],
                },
                "iscrowd": 0,
                "instance": instance,
                "name": name,
                "box3d": found.map(|b| json!({
                    "center": scene.to_world(b.center).to_array(),
                    "half_axes": b.half_axes.map(|a| a.to_array()),
                    "size": b.size().to_array(),
                })),
            }));
        }
    }

    pub fn to_json(&self) -> String {
        let all = json!({
            "info": { "description": "made with Alhazen", "version": env!("CARGO_PKG_VERSION") },
            "images": self.images, "annotations": self.annotations, "categories": self.categories,
        });
        format!("{all}\n")
    }
}

/// A pose relative to the scene's origin as one in the world of the scene's file.
fn in_world(scene: &Scene, pose: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let mut world = *pose;
    for (row, offset) in world.iter_mut().zip(scene.origin.to_array()) {
        row[3] += offset;
    }
    world
}

/// The pixels of each instance that is seen, in the order of the instances.
fn masks(truth: &GroundTruth) -> BTreeMap<u32, Mask> {
    let mut masks: BTreeMap<u32, Mask> = BTreeMap::new();
    for x in 0..truth.width {
        for y in 0..truth.height {
            let instance = truth.instance[(y * truth.width + x) as usize];
            if instance == GroundTruth::NOTHING {
                continue;
            }
            let new = || Mask { pixels: Vec::new(), left: x, top: y, right: x, bottom: y };
            let mask = masks.entry(instance).or_insert_with(new);
            mask.pixels.push(x * truth.height + y);
            mask.right = x;
            (mask.top, mask.bottom) = (mask.top.min(y), mask.bottom.max(y));
        }
    }
    masks
}

/// COCO's run-length encoding of a mask: lengths of runs outside and inside, in turns, the first outside.
///
/// - `pixels`: numbers of the pixels inside, ascending; `total`: number of pixels of the picture.
pub fn run_lengths(pixels: &[u32], total: u32) -> Vec<u32> {
    let mut counts = Vec::new();
    let mut end = 0;
    for run in pixels.chunk_by(|a, b| *b == a + 1) {
        counts.extend([run[0] - end, run.len() as u32]);
        end = run[0] + run.len() as u32;
    }
    if end < total {
        counts.push(total - end);
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_alternate_and_start_outside() {
        assert_eq!(run_lengths(&[], 6), [6]);
        assert_eq!(run_lengths(&[0, 1, 4], 6), [0, 2, 2, 1, 1]);
        assert_eq!(run_lengths(&[2, 3, 5], 6), [2, 2, 1, 1]);
        assert_eq!(run_lengths(&[0, 1, 2], 3), [0, 3]);
    }

    #[test]
    fn masks_go_column_by_column() {
        let n = GroundTruth::NOTHING;
        let truth =
            GroundTruth { width: 3, height: 2, instance: vec![n, 4, 4, n, 4, 7], ..GroundTruth::default() };
        let masks = masks(&truth);
        let of = |i: u32| &masks[&i];
        assert_eq!((masks.len(), &of(4).pixels[..], &of(7).pixels[..]), (2, &[2, 3, 4][..], &[5][..]));
        assert_eq!([of(4).left, of(4).top, of(4).right, of(4).bottom], [1, 0, 2, 1]);
    }
}
