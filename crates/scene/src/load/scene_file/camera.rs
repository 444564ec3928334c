//! `[[camera]]`: projections, lenses and paths.

use super::Builder;
use super::document::{Context, Entry};
use super::placement::{Keys, View};
use super::values::{direction, positive, within};
use crate::animation::KeyedObject;
use crate::load::LoadError;
use crate::{Camera, CameraPath, Distortion, Projection};
use elementary::{atan, tan};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
struct CameraKeys {
    name: Option<String>,
    projection: String,
    eye: Option<[f64; 3]>,
    target: [f64; 3],
    up: [f32; 3],
    /// Degrees.
    fov: Option<f32>,
    /// Metres.
    height: Option<f32>,
    aspect: Option<f32>,
    f_number: Option<f32>,
    /// Millimetres.
    focal_length: Option<f32>,
    lens_radius: Option<f32>,
    focus_distance: Option<f32>,
    focus: Option<[f64; 3]>,
    orbit: Option<OrbitKeys>,
    /// Intrinsics, in pixels of a picture of `matrix_size`.
    matrix: Option<[[f64; 3]; 3]>,
    matrix_size: Option<[u32; 2]>,
    skew: Option<f32>,
    distortion: Option<Distortion>,
    motion: Vec<CameraMotion>,
}

/// Where the camera is at a moment.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraMotion {
    /// Seconds.
    time: f32,
    eye: [f64; 3],
    target: [f64; 3],
}

impl Default for CameraKeys {
    fn default() -> Self {
        Self {
            name: None,
            projection: "perspective".into(),
            eye: None,
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            fov: None,
            height: None,
            aspect: None,
            f_number: None,
            focal_length: None,
            lens_radius: None,
            focus_distance: None,
            focus: None,
            orbit: None,
            matrix: None,
            matrix_size: None,
            skew: None,
            distortion: None,
            motion: Vec::new(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OrbitKeys {
    #[serde(default)]
    center: [f64; 3],
    radius: f32,
    #[serde(default)]
    height: f32,
    #[serde(default)]
    bob: f32,
    /// Seconds.
    period: f32,
    /// Degrees.
    #[serde(default)]
    start: f32,
}

/// Height of a full-frame sensor, millimetres: relates focal length and field of view.
const SENSOR_HEIGHT: f32 = 24.0;

impl Builder<'_> {
    /// Adds a camera.
    pub(super) fn add_camera(&mut self, entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let mut keys: CameraKeys = entry.read()?;
        let motion = std::mem::take(&mut keys.motion);
        if let Some(first) = motion.first() {
            if keys.eye.is_some() || keys.orbit.is_some() {
                return Err(context
                    .error("`motion` says where the camera is: it excludes `eye`, `target` and `orbit`"));
            }
            (keys.eye, keys.target) = (Some(first.eye), first.target);
        }
        let (camera, view) = camera(keys, self.scene.cameras.len(), &context)?;
        if !motion.is_empty() {
            let object = KeyedObject::Camera(self.scene.cameras.len() as u32);
            let times = motion.iter().map(|key| key.time).collect();
            let worlds =
                motion.iter().map(|key| looking(key, camera.up, &context)).collect::<Result<_, _>>()?;
            self.placement.keys.push((object, Keys { times, worlds }, format!("camera {:?}", camera.name)));
        }
        self.scene.cameras.push(camera);
        self.placement.cameras.push(view);
        Ok(())
    }
}

/// From the space of a camera to the world, at one of its keys.
fn looking(key: &CameraMotion, up: Vec3, c: &Context) -> Result<DAffine3, LoadError> {
    let (eye, target) = (DVec3::from_array(key.eye), DVec3::from_array(key.target));
    let back = (eye - target).try_normalize();
    let axes = back.and_then(|back| {
        let right = up.as_dvec3().cross(back).try_normalize()?;
        Some(DMat3::from_cols(right, back.cross(right), back))
    });
    let axes =
        axes.ok_or_else(|| c.error(format!("at {} s the camera looks nowhere, or along `up`", key.time)))?;
    Ok(DAffine3::from_mat3_translation(axes, eye))
}

/// The camera with everything relative to a point near it, and its place in the world.
fn camera(k: CameraKeys, number: usize, c: &Context) -> Result<(Camera, View), LoadError> {
    let near = match (k.eye, &k.orbit) {
        (Some(_), Some(_)) => return Err(c.error("`eye` and `orbit` exclude each other")),
        (Some(eye), None) => DVec3::from_array(eye),
        (None, Some(orbit)) => DVec3::from_array(orbit.center),
        (None, None) => return Err(c.error("`eye` is missing")),
    };
    let relative = |point: [f64; 3]| (DVec3::from_array(point) - near).as_vec3();
    let target = relative(k.target);
    let path = k.orbit.as_ref().map(|orbit| path(orbit, c)).transpose()?;
    let eye = Vec3::ZERO;
    let projection = projection(&k, c)?;
    let name = k.name.clone().unwrap_or_else(|| format!("camera {}", number + 1));
    let mut camera = Camera { projection, path, ..Camera::perspective(name, eye, target, 1.0) };
    camera.eye = camera.at(0.0).eye;
    camera.up = Vec3::from_array(k.up);
    let axis = direction(target - camera.eye, "target − eye", c)?;
    direction(axis.cross(camera.up), "up × (target − eye)", c)?;
    camera.aspect = k.aspect.map(|a| positive(a, "aspect", c)).transpose()?;
    calibrate(&k, &mut camera, c)?;
    camera.lens_radius = lens_radius(&k, &projection, c)?;
    camera.focus_distance = match (k.focus_distance, k.focus) {
        (Some(_), Some(_)) => return Err(c.error("`focus-distance` and `focus` exclude each other")),
        (Some(distance), None) => positive(distance, "focus-distance", c)?,
        (None, Some(point)) => positive(axis.dot(relative(point) - camera.eye), "distance of `focus`", c)?,
        (None, None) => (target - camera.eye).length(),
    };
    let center = path.is_some().then_some(near);
    Ok((camera, View { eye: near, target: DVec3::from_array(k.target), center }))
}

fn projection(k: &CameraKeys, c: &Context) -> Result<Projection, LoadError> {
    let unknown = || {
        let known = Projection::names();
        c.error(format!("projection {:?} is not known; there are {known}", k.projection))
    };
    let mut projection = Projection::from_name(&k.projection).ok_or_else(unknown)?;
    let is_perspective = projection.is_perspective();
    let mut parameter = projection.parameter_mut();
    let own_key = parameter.as_ref().map(|(parameter, _)| parameter.key);
    for (key, is_meant) in [
        ("fov", k.fov.is_none() || own_key == Some("fov")),
        ("focal-length", k.focal_length.is_none() || is_perspective),
        ("height", k.height.is_none() || own_key == Some("height")),
    ] {
        if !is_meant {
            return Err(c.error(format!("`{key}` has no meaning for this projection")));
        }
    }
    if let Some((parameter, value)) = &mut parameter {
        let given = match (k.fov.or(k.height), k.focal_length) {
            (None, Some(focal)) => {
                Some(2.0 * atan(0.5 * SENSOR_HEIGHT / positive(focal, "focal-length", c)?).to_degrees())
            }
            (given, _) => given,
        };
        let Some(number) = given.or(parameter.default) else {
            let message = format!("a camera that is {} needs `{}`", k.projection, parameter.key);
            return Err(c.error(message));
        };
        let number = within(number, parameter.range, parameter.key, c)?;
        **value = parameter.from_user(number).unwrap_or(**value);
    }
    Ok(projection)
}

/// What calibration says of a perspective camera: intrinsics and the lens.
fn calibrate(k: &CameraKeys, camera: &mut Camera, c: &Context) -> Result<(), LoadError> {
    let keys =
        [("matrix", k.matrix.is_some()), ("skew", k.skew.is_some()), ("distortion", k.distortion.is_some())];
    let is_perspective = camera.projection.is_perspective();
    if let Some((key, _)) = keys.iter().find(|(_, given)| *given && !is_perspective) {
        return Err(c.error(format!("`{key}` has no meaning for this projection")));
    }
    match (k.matrix, k.matrix_size) {
        (None, None) => camera.skew = within(k.skew.unwrap_or(0.0), [-10.0, 10.0], "skew", c)?,
        (Some(_), None) | (None, Some(_)) => {
            return Err(c.error("`matrix` and `matrix-size`, in pixels, belong together"));
        }
        (Some(_), Some(_)) if k.fov.is_some() || k.focal_length.is_some() || k.skew.is_some() => {
            return Err(c.error("`matrix` excludes `fov`, `focal-length` and `skew`"));
        }
        (Some(_), Some(_)) if k.f_number.is_some() => {
            return Err(c.error("`f-number` has no meaning beside `matrix`: give `lens-radius`"));
        }
        (Some(matrix), Some([width, height])) => {
            const LEVEL: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]];
            let calibrated = Camera::from_opencv(matrix, LEVEL, width, height);
            let calibrated = calibrated.map_err(|error| c.error(error.to_string()))?;
            (camera.projection, camera.skew) = (calibrated.projection, calibrated.skew);
            camera.aspect = camera.aspect.or(calibrated.aspect);
        }
    }
    if k.distortion.is_some_and(|d| !d.is_finite()) {
        return Err(c.error("a coefficient of `distortion` is not finite"));
    }
    camera.distortion = k.distortion;
    Ok(())
}

/// Focal length / (2 · f-number), or what the file says.
fn lens_radius(k: &CameraKeys, projection: &Projection, c: &Context) -> Result<f32, LoadError> {
    match (k.lens_radius, k.f_number) {
        (Some(_), Some(_)) => Err(c.error("`lens-radius` and `f-number` exclude each other")),
        (Some(radius), None) => within(radius, [0.0, 1e6], "lens-radius", c),
        (None, None) => Ok(0.0),
        (None, Some(f_number)) => {
            let Projection::Perspective { fov_y } = projection else {
                return Err(c.error("`f-number` has no meaning for this projection"));
            };
            let focal = k.focal_length.unwrap_or(0.5 * SENSOR_HEIGHT / tan(fov_y * 0.5)) * 1e-3;
            Ok(focal / (2.0 * positive(f_number, "f-number", c)?))
        }
    }
}

fn path(k: &OrbitKeys, c: &Context) -> Result<CameraPath, LoadError> {
    Ok(CameraPath::Orbit {
        center: Vec3::ZERO,
        radius: positive(k.radius, "orbit.radius", c)?,
        height: k.height,
        bob: k.bob,
        period: positive(k.period, "orbit.period", c)?,
        start: k.start.to_radians(),
    })
}
