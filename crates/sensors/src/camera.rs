//! What an ideal camera would know of each pixel.

use crate::categories::Categories;
use crate::error::SensorError;
use alhazen::{
    Camera, Control, Ray, RayQueries, Scene, camera_frame, depth_along_axis, picture_point, picture_ray,
};
use glam::{DAffine3, DVec2, DVec3, Vec3};
use optics::camera::CameraFrame;

/// Exact values at the centres of a picture's pixels, row by row from the top. Where a pixel's centre sees nothing, numbers
/// are 0 and ids [`GroundTruth::NOTHING`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroundTruth {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Distance along the camera's axis, metres; for a panorama along the ray.
    pub depth: Vec<f32>,
    /// World position, metres.
    pub position: Vec<[f32; 3]>,
    /// Unit shading normal, world space, towards the camera.
    pub normal: Vec<[f32; 3]>,
    /// How far what the pixel shows moves to the next frame: pixels to the right and down. NaN where it gets behind the
    /// camera, and outside of the field of a lens. What is infinitely far away moves as the camera turns. Empty without a next frame.
    pub flow: Vec<[f32; 2]>,
    /// Index of the instance.
    pub instance: Vec<u32>,
    /// Number of the instance's category, from 1; see [`Categories`]. 0 where nothing is seen.
    pub category: Vec<u32>,
    /// Index of the material.
    pub material: Vec<u32>,
}

/// The next frame, for optical flow.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// The camera then.
    pub camera: &'a Camera,
    /// The scene then: the same instances, perhaps elsewhere. `None` if nothing moves but the camera.
    pub scene: Option<&'a Scene>,
}

/// Where a camera is, metres.
fn position(frame: &CameraFrame) -> DVec3 {
    DVec3::from_array(frame.origin.to_array().map(f64::from))
}

/// What one pixel sees.
#[derive(Clone, Copy)]
struct Seen {
    position: [f32; 3],
    normal: [f32; 3],
    instance: u32,
    material: u32,
}

impl GroundTruth {
    /// The id of nothing.
    pub const NOTHING: u32 = u32::MAX;

    /// What `camera` sees of `scene`, over which `queries` were built.
    ///
    /// # Errors
    /// [`SensorError::Setting`] for impossible sizes, [`SensorError::Cancelled`].
    pub fn observe(
        scene: &Scene,
        queries: &RayQueries,
        categories: &Categories,
        camera: &Camera,
        (width, height): (u32, u32),
        next: Option<Motion>,
        control: &Control,
    ) -> Result<Self, SensorError> {
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > 1 << 30 {
            return Err(SensorError::setting("size", format!("{width}×{height}"), "pixels are not possible"));
        }
        let frame = camera_frame(camera, width, height);
        let center = |i: usize| ((i as u32 % width) as f32 + 0.5, (i as u32 / width) as f32 + 0.5);
        let ray = |i: usize| -> Ray {
            let (x, y) = center(i);
            picture_ray(&frame, width, height, x, y)
        };
        let seen = queries.map(pixels as usize, control, ray, |_, point| {
            point.map(|p| Seen {
                position: p.position(),
                normal: p.normal(),
                instance: p.instance(),
                material: p.material(),
            })
        });
        if control.is_cancelled() {
            return Err(SensorError::Cancelled);
        }
        let eye = position(&frame);
        let depth = |s: &Seen| depth_along_axis(&frame, Vec3::from(s.position).as_dvec3() - eye) as f32;
        let flow = next.map(|next| {
            let moves = Moves::new(scene, next.scene);
            let then = camera_frame(next.camera, width, height);
            let flow_of = |(i, s): (usize, &Option<Seen>)| {
                if ray(i).t_max <= 0.0 {
                    // Outside of the lens' field.
                    return [f32::NAN; 2];
                }
                let offset = match s {
                    Some(s) => moves.apply(s.instance, Vec3::from(s.position).as_dvec3()) - position(&then),
                    None => Vec3::from(ray(i).direction).as_dvec3(),
                };
                let (x, y) = center(i);
                let from = DVec2::new(f64::from(x), f64::from(y));
                let to = picture_point(&then, width, height, offset);
                to.map_or([f32::NAN; 2], |to| (to - from).as_vec2().to_array())
            };
            seen.iter().enumerate().map(flow_of).collect()
        });
        let numbers =
            |of: &dyn Fn(&Seen) -> [f32; 3]| seen.iter().map(|s| s.as_ref().map_or([0.0; 3], of)).collect();
        let ids =
            |of: &dyn Fn(&Seen) -> u32, none| seen.iter().map(|s| s.as_ref().map_or(none, of)).collect();
        Ok(Self {
            width,
            height,
            depth: seen.iter().map(|s| s.as_ref().map_or(0.0, depth)).collect(),
            position: numbers(&|s| s.position),
            normal: numbers(&|s| s.normal),
            flow: flow.unwrap_or_default(),
            instance: ids(&|s| s.instance, Self::NOTHING),
            category: ids(&|s| categories.of_instance(s.instance), 0),
            material: ids(&|s| s.material, Self::NOTHING),
        })
    }
}

/// How instances move from one frame to the next.
struct Moves(Vec<Option<DAffine3>>);

impl Moves {
    fn new(now: &Scene, then: Option<&Scene>) -> Self {
        let Some(then) = then else { return Self(Vec::new()) };
        let double = |a: glam::Affine3A| {
            let columns = glam::Mat3::from(a.matrix3).as_dmat3();
            DAffine3::from_mat3_translation(columns, Vec3::from(a.translation).as_dvec3())
        };
        let pairs = now.instances.iter().zip(&then.instances);
        Self(
            pairs
                .map(|(a, b)| {
                    (a.transform != b.transform).then(|| double(b.transform) * double(a.transform).inverse())
                })
                .collect(),
        )
    }

    /// Where a point of an instance will be.
    fn apply(&self, instance: u32, point: DVec3) -> DVec3 {
        let motion = self.0.get(instance as usize).and_then(Option::as_ref);
        motion.map_or(point, |m| m.transform_point3(point))
    }
}
