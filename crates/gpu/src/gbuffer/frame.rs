//! What the passes of a frame are told: projection, sample, clusters. One uniform for all of them.

use super::items::{DrawClass, Items};
use super::projection::{Picture, Projection};
use bytemuck::{Pod, Zeroable};
use elementary::log2;
use optics::Vec2f;
use optics::camera::CameraFrame;
use optics::random::{sample_2d, sampler_new};

/// Pixels of a cluster's side.
pub const TILE: u32 = 64;
/// Slices of clusters along the view.
pub const SLICES: u32 = 24;
/// The scene's far end over where the second slice begins.
const DEPTH_RATIO: f32 = 256.0;
/// The scene's far end over where the rasteriser begins to see. Reversed depth costs no precision for that.
const NEAR_RATIO: f32 = 1e7;
/// How far a parallel view reaches over the scene's far end, for what moves out of the scene.
const REACH_RATIO: f32 = 16.0;

/// See `shaders/hybrid_frame.wgsl` for the fields.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct HybridFrame {
    pub(super) clip_from_world: [[f32; 4]; 4],
    pub(super) previous_clip_from_world: [[f32; 4]; 4],
    pub(super) eye: [f32; 3],
    pub(super) sample: u32,
    pub(super) previous_eye: [f32; 3],
    pub(super) item_count: u32,
    pub(super) axis: [f32; 3],
    pub(super) clustered: u32,
    pub(super) jitter: [f32; 2],
    pub(super) lens: [f32; 2],
    pub(super) clusters: [u32; 3],
    pub(super) light_words: u32,
    pub(super) class_first: [[u32; 4]; 2],
    pub(super) tile: u32,
    pub(super) cluster_near: f32,
    pub(super) cluster_growth: f32,
    pub(super) padding: u32,
}

/// What decides a frame, as far as its uniform goes.
#[derive(Clone, Copy, Debug)]
pub struct FrameInput {
    /// The camera now.
    pub camera: CameraFrame,
    /// The camera of the frame before.
    pub previous_camera: CameraFrame,
    /// The window.
    pub picture: Picture,
    /// `SAMPLER_…` of the optics.
    pub sampler: u32,
    /// Index of the sample: where in the pixel and on the lens all rays of the frame go through.
    pub sample: u32,
    /// Changes the noise.
    pub seed: u32,
    /// World-space centre and radius of a sphere around the scene.
    pub bounding_sphere: [f32; 4],
    /// Whether lights count only within their reach.
    pub culls_lights: bool,
}

/// Random numbers by pairs, as in `shaders/film.wgsl`.
const PAIR_FILM: u32 = 0;
const PAIR_LENS: u32 = 1;

/// Clusters of a window, to the right and downwards.
pub fn tiles(window: [u32; 2]) -> [u32; 2] {
    window.map(|n| n.div_ceil(TILE))
}

impl HybridFrame {
    /// The uniform of a frame. `light_words`: words of a cluster's mask. Returns it and whether a rasteriser can draw the view.
    pub fn new(input: &FrameInput, items: &Items, light_words: u32) -> (Self, bool) {
        let place = sampler_new(input.sampler, 0, 0, 0, input.sample, input.seed);
        let (jitter, lens) = (sample_2d(place, PAIR_FILM), sample_2d(place, PAIR_LENS));
        let reach = reach(&input.camera, input.bounding_sphere);
        let project = |camera: &CameraFrame| {
            let near = reach / NEAR_RATIO;
            Projection::new(camera, &input.picture, jitter, lens, near, reach * REACH_RATIO)
        };
        let projection = project(&input.camera);
        let [across, down] = tiles(input.picture.window_size);
        let cluster_near = reach / DEPTH_RATIO;
        let mut class_first = [[0; 4]; 2];
        for class in DrawClass::ALL {
            class_first[class as usize / 4][class as usize % 4] = items.class_first[class as usize];
        }
        let mut frame = Self {
            sample: input.sample,
            item_count: items.items.len() as u32,
            clustered: u32::from(input.culls_lights && projection.is_some()),
            jitter: pair(jitter),
            lens: pair(lens),
            clusters: [across, down, SLICES],
            light_words,
            class_first,
            tile: TILE,
            cluster_near,
            cluster_growth: log2(DEPTH_RATIO) / (SLICES - 1) as f32,
            ..Self::default()
        };
        if let Some(now) = projection {
            let before = project(&input.previous_camera).unwrap_or(now);
            (frame.clip_from_world, frame.eye, frame.axis) = (now.clip_from_world, now.eye, now.axis);
            (frame.previous_clip_from_world, frame.previous_eye) = (before.clip_from_world, before.eye);
        }
        (frame, projection.is_some())
    }
}

/// Distance from the camera to the far end of the scene, metres, positive.
fn reach(camera: &CameraFrame, [x, y, z, radius]: [f32; 4]) -> f32 {
    let to_center = glam::Vec3::new(x - camera.origin.x, y - camera.origin.y, z - camera.origin.z);
    let reach = to_center.length() + radius;
    if reach.is_finite() && reach > 0.0 { reach } else { 1.0 }
}

fn pair(v: Vec2f) -> [f32; 2] {
    [v.x, v.y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{assert_layout, constant};
    use crate::shader::check;

    #[test]
    fn layouts_match_the_shader() {
        use super::super::items::{HybridItem, HybridPart, PRIMITIVE_BITS};
        let module = check::module("hybrid_resolve");
        assert_layout!(
            module,
            HybridFrame {
                clip_from_world,
                previous_clip_from_world,
                eye,
                sample,
                previous_eye,
                item_count,
                axis,
                clustered,
                jitter,
                lens,
                clusters,
                light_words,
                class_first,
                tile,
                cluster_near,
                cluster_growth,
                padding,
            }
        );
        assert_layout!(
            module,
            HybridPart { low, geometry, high, first, count, padding0, padding1, padding2 }
        );
        assert_layout!(module, HybridItem { instance, part });
        assert_eq!(constant(&module, "PRIMITIVE_BITS"), PRIMITIVE_BITS);
        let film = check::module("film");
        assert_eq!((constant(&film, "PAIR_FILM"), constant(&film, "PAIR_LENS")), (PAIR_FILM, PAIR_LENS));
    }
}
