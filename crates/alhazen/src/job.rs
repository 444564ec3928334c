//! What picture to make of a scene.

use crate::shutter::open_camera;
use backend::{Integrator, PathSettings, SamplerKind, View, ViewBatch, ViewLayer};
use film::{Aov, Rect};
use glam::{Vec2, Vec3};
use optics::camera::{CameraFrame, camera_ray};
use optics::distortion::no_distortion;
use optics::{vec2f, vec3f};
use post::ToneMapping;
use scene::{Camera, Distortion, Scene, Shutter};

/// A picture of a scene: camera, size, how light is transported, how it is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// The camera.
    pub camera: Camera,
    /// Width of the whole picture in pixels.
    pub width: u32,
    /// Height of the whole picture in pixels.
    pub height: u32,
    /// The part to render; `None` is all of it.
    pub crop: Option<Rect>,
    /// How light is transported.
    pub integrator: Integrator,
    /// Follow glTF 2.0 Appendix B to the letter, without energy compensation.
    pub single_scatter: bool,
    /// How samples are drawn.
    pub sampler: SamplerKind,
    /// Changes the noise.
    pub seed: u32,
    /// Auxiliary layers.
    pub aovs: Vec<Aov>,
    /// How radiance becomes display values.
    pub tone: ToneMapping,
    /// When the shutter is open, around the moment of the picture; `None` shows an instant. The
    /// scene has to move by the same one: see [`Scene::open_shutter`].
    pub shutter: Option<Shutter>,
}

impl Job {
    /// What the scene asks for itself, or good defaults: its first camera, path tracing, 1280 pixels wide in the
    /// camera's aspect.
    pub fn for_scene(scene: &Scene) -> Self {
        let defaults = &scene.defaults;
        let aspect = scene.cameras.first().and_then(|c| c.aspect).filter(|a| a.is_finite() && *a > 0.0);
        let (width, height) = match (defaults.width, defaults.height) {
            (Some(w), Some(h)) => (w, h),
            (Some(w), None) => (w, scaled(w, 1.0 / aspect.unwrap_or(16.0 / 9.0))),
            (None, Some(h)) => (scaled(h, aspect.unwrap_or(16.0 / 9.0)), h),
            (None, None) => match aspect {
                Some(a) if a < 1.0 => (scaled(960, a), 960),
                Some(a) => (1280, scaled(1280, 1.0 / a)),
                None => (1280, 720),
            },
        };
        let own = scene.cameras.first().cloned();
        let camera = own.unwrap_or_else(|| scene.framing_camera(width as f32 / height.max(1) as f32));
        Self::by_camera(scene, camera, width, height)
    }

    /// As [`Job::for_scene`], by a camera and of a size in pixels.
    pub fn by_camera(scene: &Scene, camera: Camera, width: u32, height: u32) -> Self {
        let defaults = &scene.defaults;
        let mut path = PathSettings::default();
        path.max_depth = defaults.max_depth.unwrap_or(path.max_depth);
        path.caustics = defaults.caustics.unwrap_or(path.caustics);
        path.guiding = defaults.guiding.unwrap_or(path.guiding);
        let named = defaults.integrator.as_deref().and_then(Integrator::from_name);
        let integrator = match named {
            None | Some(Integrator::Path(_)) => Integrator::Path(path),
            Some(other) => other,
        };
        let tone = ToneMapping {
            mapper: defaults.tonemap.unwrap_or_default(),
            exposure: defaults.exposure.unwrap_or(1.0),
            saturation: defaults.saturation.unwrap_or(1.0),
        };
        Self {
            camera,
            width,
            height,
            crop: None,
            integrator,
            single_scatter: false,
            sampler: SamplerKind::default(),
            seed: 0,
            aovs: Vec::new(),
            tone,
            shutter: defaults.shutter,
        }
    }

    /// What a back end needs to know of this, with the camera as it is at `time` seconds, or while
    /// the shutter is open around it.
    pub fn view(&self, time: f32) -> View {
        let size = [self.width, self.height];
        let (camera, shutter) = open_camera(&self.camera, self.shutter.as_ref(), time, size);
        View {
            camera,
            width: self.width,
            height: self.height,
            window: self.crop.unwrap_or(Rect::full(self.width, self.height)),
            integrator: self.integrator,
            single_scatter: self.single_scatter,
            sampler: self.sampler,
            seed: self.seed,
            first_sample: 0,
            aovs: self.aovs.clone(),
            shutter,
        }
    }
}

impl Job {
    /// As many pictures as there are cameras, all as this job says but for its own camera, window and layers.
    ///
    /// - `cameras`: at time 0. `next`: for [`ViewLayer::Flow`](backend::ViewLayer::Flow), that of each one's next picture.
    /// - `samples`: of each pixel, if colours are wanted.
    pub fn views(
        &self,
        cameras: &[Camera],
        next: &[Camera],
        layers: Vec<ViewLayer>,
        samples: u32,
    ) -> ViewBatch {
        let frames = |cameras: &[Camera]| {
            cameras.iter().map(|camera| camera_frame(&camera.at(0.0), self.width, self.height)).collect()
        };
        // What moves is shown as it is in the middle of the shutter.
        let view = View { shutter: None, ..self.view(0.0) };
        ViewBatch { view, cameras: frames(cameras), next: frames(next), layers, samples }
    }
}

/// Extents along an axis, in metres, of the scenes that a camera is found for: smaller ones are lost in the camera's
/// rounding, and of larger ones products of lengths overflow.
const EXTENTS: std::ops::RangeInclusive<f32> = 1.0e-6..=4.0e9;

/// No camera can be found for a scene that has none.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the scene is {extent:e} m large and has no camera; one is found for scenes of {:e} m to {:e} m: give eye and target, or \
     scale the scene",
    EXTENTS.start(),
    EXTENTS.end()
)]
pub struct NoCamera {
    /// The scene's extent along its longest side, metres.
    pub extent: f32,
}

/// Whether [`Scene::default_camera`] sees the scene: it has a camera of its own, or a size that one can be found for.
///
/// # Errors
/// [`NoCamera`].
pub fn check_default_camera(scene: &Scene) -> Result<(), NoCamera> {
    let Some((low, high)) = scene.bounds().filter(|_| scene.cameras.is_empty()) else { return Ok(()) };
    let extent = (high - low).max_element();
    // A point is as good as nothing: there is nothing to see.
    if extent == 0.0 || EXTENTS.contains(&extent) { Ok(()) } else { Err(NoCamera { extent }) }
}

fn scaled(side: u32, factor: f32) -> u32 {
    ((side as f32 * factor).round() as u32).max(1)
}

/// A camera ready to make rays for a picture of `width` × `height` pixels.
pub fn camera_frame(camera: &Camera, width: u32, height: u32) -> CameraFrame {
    let axis = (camera.target - camera.eye).try_normalize().unwrap_or(-Vec3::Z);
    // Looking straight along `up`, any other direction will do.
    let side = axis.cross(camera.up).try_normalize();
    let right = side.or_else(|| axis.cross(Vec3::Z).try_normalize()).unwrap_or(Vec3::X);
    let up = right.cross(axis);
    let aspect = width as f32 / height as f32;
    let half_size = camera.projection.half_size(aspect);
    // Where the axis does not meet the picture's centre, the vector to the centre is not the axis.
    let shift = (Vec2::ONE - 2.0 * camera.projection.center()) * half_size;
    let forward = if shift == Vec2::ZERO { axis } else { axis + right * shift.x - up * shift.y };
    let vector = |v: Vec3| vec3f(v.x, v.y, v.z);
    CameraFrame {
        kind: camera.projection.camera_kind(),
        origin: vector(camera.eye),
        right: vector(right),
        up: vector(up),
        forward: vector(forward),
        half_size: vec2f(half_size.x, half_size.y),
        lens_radius: camera.lens_radius,
        focus_distance: camera.focus_distance,
        distortion: distortion(camera),
    }
}

/// How a perspective camera's lens differs from a pinhole.
fn distortion(camera: &Camera) -> optics::distortion::Distortion {
    use optics::distortion::Distortion as Lens;
    if !camera.projection.is_perspective() {
        return no_distortion();
    }
    match camera.distortion {
        Some(Distortion::BrownConrady { k, p }) => Lens::brown_conrady(k, p, camera.skew),
        Some(Distortion::Fisheye { k }) => Lens::fisheye(k, camera.skew),
        None if camera.skew != 0.0 => Lens::brown_conrady([0.0; 6], [0.0; 2], camera.skew),
        None => no_distortion(),
    }
}

/// The ray through the point (`x`, `y`) of a picture of `width` × `height` pixels; pixel centres are at halves. Unit
/// direction. Where the camera has a lens, the ray goes through its centre. Outside of a lens' field the ray has no length.
pub fn picture_ray(frame: &CameraFrame, width: u32, height: u32, x: f32, y: f32) -> accel::Ray {
    let pinhole = CameraFrame { lens_radius: 0.0, ..*frame };
    let film = vec2f(x / width as f32, y / height as f32);
    let ray = camera_ray(pinhole, film, vec2f(0.0, 0.0));
    let whole = accel::Ray::new(ray.origin.to_array(), ray.direction.to_array());
    if ray.weight > 0.0 { whole } else { accel::Ray { t_max: 0.0, ..whole } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::Projection;

    #[test]
    fn frames_are_orthonormal_even_when_looking_straight_down() {
        for target in [Vec3::new(0.0, -1.0, 0.0), Vec3::new(3.0, 1.0, -2.0), Vec3::ZERO] {
            let camera = Camera::perspective("c", Vec3::ZERO, target, 1.0);
            let f = camera_frame(&camera, 200, 100);
            let [r, u, w] = [f.right, f.up, f.forward].map(|v| Vec3::from(v.to_array()));
            assert!(r.dot(u).abs() < 1e-6 && u.dot(w).abs() < 1e-6 && r.dot(w).abs() < 1e-6, "{f:?}");
            assert!((r.cross(u).dot(-w) - 1.0).abs() < 1e-5, "{f:?}");
            assert!((f.half_size.x / f.half_size.y - 2.0).abs() < 1e-6);
        }
    }

    #[test]
    fn intrinsics_map_directions_to_the_pixels_of_a_calibrated_camera() {
        let (width, height) = (640, 480);
        let (fx, fy, cx, cy) = (500.0, 520.0, 300.25, 250.5);
        let mut camera = Camera::perspective("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 2.0), 1.0);
        camera.projection = Projection::Intrinsics {
            focal: Vec2::new(fx / width as f32, fy / height as f32),
            center: Vec2::new(cx / width as f32, cy / height as f32),
        };
        let frame = camera_frame(&camera, width, height);
        for (x, y) in [(0.5, 0.5), (639.5, 100.5), (300.25, 250.5), (17.5, 479.5)] {
            let [dx, dy, dz] = picture_ray(&frame, width, height, x, y).direction;
            // Looking along -Z, the picture's y runs down.
            let (u, v) = (fx * dx / -dz + cx, fy * -dy / -dz + cy);
            assert!((u - x).abs() < 1e-3 && (v - y).abs() < 1e-3, "({x}, {y}) came back as ({u}, {v})");
        }
    }

    #[test]
    fn lenses_show_points_where_opencv_does() {
        // cv2.projectPoints and cv2.fisheye.projectPoints by their formulas, in double precision.
        let (width, height) = (640, 480);
        let (fx, fy, cx, cy, skew) = (400.0f64, 410.0f64, 310.0f64, 250.0f64, 6.0f64);
        let matrix = [[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]];
        let pose = [[1.0, 0.0, 0.0, 1.0], [0.0, -1.0, 0.0, 2.0], [0.0, 0.0, -1.0, 3.0]];
        let pinhole = Camera::from_opencv(matrix, pose, width, height).expect("a camera");
        let c = [-0.28, 0.11, 0.0012, -0.0007, -0.02, 0.01, 0.02, -0.003];
        let f = [-0.03, 0.01, -0.004, 0.0005];
        for (coefficients, fisheye) in [(&c[..], false), (&f[..], true), (&[][..], false)] {
            let camera = pinhole.clone().with_opencv_distortion(coefficients, fisheye).expect("a lens");
            let frame = camera_frame(&camera, width, height);
            for (x, y) in [(0.0f64, 0.0f64), (0.3, 0.2), (-0.6, 0.45), (0.5, -0.5)] {
                let r2 = x * x + y * y;
                let (u, v) = if coefficients.is_empty() {
                    (x, y)
                } else if fisheye {
                    let theta = r2.sqrt().atan();
                    let t2 = theta * theta;
                    let bent = theta * (1.0 + t2 * (f[0] + t2 * (f[1] + t2 * (f[2] + t2 * f[3]))));
                    let scale = if r2 > 0.0 { bent / r2.sqrt() } else { 1.0 };
                    (x * scale, y * scale)
                } else {
                    let above = 1.0 + r2 * (c[0] + r2 * (c[1] + r2 * c[4]));
                    let below = 1.0 + r2 * (c[5] + r2 * (c[6] + r2 * c[7]));
                    (
                        x * above / below + 2.0 * c[2] * x * y + c[3] * (r2 + 2.0 * x * x),
                        y * above / below + c[2] * (r2 + 2.0 * y * y) + 2.0 * c[3] * x * y,
                    )
                };
                // OpenCV counts pixels from their centres.
                let (px, py) = (fx * u + skew * v + cx + 0.5, fy * v + cy + 0.5);
                let ray = picture_ray(&frame, width, height, px as f32, py as f32);
                let direction = Vec3::from(ray.direction);
                let expected = Vec3::new(x as f32, -y as f32, -1.0).normalize();
                assert!(direction.distance(expected) < 1e-5, "({x}, {y}): {direction} instead of {expected}");
            }
        }
    }

    #[test]
    fn scenes_of_impossible_sizes_get_no_camera() {
        for (size, found) in [(1e20, false), (1e-20, false), (f32::MAX, false), (1e-5, true), (1e9, true)] {
            let sphere = scene::Sphere { center: Vec3::ZERO, radius: size / 2.0 };
            let mesh = scene::Mesh::single("s", scene::Shape::Spheres(vec![sphere]), 0);
            let instances = vec![scene::Instance::new("s", 0, glam::Affine3A::IDENTITY)];
            let mut scene = Scene { meshes: vec![mesh], instances, ..Scene::default() };
            assert_eq!(check_default_camera(&scene).is_ok(), found, "{size}");
            scene.cameras.push(Camera::perspective("c", Vec3::ZERO, Vec3::Z, 1.0));
            assert_eq!(check_default_camera(&scene), Ok(()));
        }
        assert_eq!(check_default_camera(&Scene::default()), Ok(()));
    }

    #[test]
    fn the_size_follows_the_aspect() {
        let mut scene = Scene::default();
        assert_eq!((Job::for_scene(&scene).width, Job::for_scene(&scene).height), (1280, 720));
        let mut camera = Camera::perspective("c", Vec3::ZERO, Vec3::Z, 1.0);
        camera.aspect = Some(2.0);
        scene.cameras.push(camera);
        assert_eq!(Job::for_scene(&scene).height, 640);
        scene.defaults.height = Some(100);
        assert_eq!(Job::for_scene(&scene).width, 200);
    }
}
