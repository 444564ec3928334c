//! `[[camera]]`: projections, lenses and paths.

use super::Builder;
use super::document::{Context, Entry};
use super::placement::View;
use super::values::{direction, positive, within};
use crate::load::LoadError;
use crate::{Camera, CameraPath, Distortion, Projection};
use glam::{DVec3, Vec3};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
struct CameraKeys {
    name: Option<String>,
    projection: ProjectionName,
    eye: Option<[f64; 3]>,
    target: [f64; 3],
    up: [f32; 3],
    /// Degrees.
    fov: Option<f32>,
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
}

impl Default for CameraKeys {
    fn default() -> Self {
        Self {
            name: None,
            projection: ProjectionName::Perspective,
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
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ProjectionName {
    Perspective,
    Orthographic,
    Panorama,
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
        let (camera, view) = camera(entry.read()?, self.scene.cameras.len(), &context)?;
        self.scene.cameras.push(camera);
        self.placement.cameras.push(view);
        Ok(())
    }
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
    let only = |key: &str, given: bool, name: ProjectionName| {
        if given && k.projection != name {
            return Err(c.error(format!("`{key}` has no meaning for this projection")));
        }
        Ok(())
    };
    only("fov", k.fov.is_some(), ProjectionName::Perspective)?;
    only("focal-length", k.focal_length.is_some(), ProjectionName::Perspective)?;
    only("height", k.height.is_some(), ProjectionName::Orthographic)?;
    Ok(match k.projection {
        ProjectionName::Panorama => Projection::Panorama,
        ProjectionName::Orthographic => {
            let height = k.height.ok_or_else(|| c.error("an orthographic camera needs `height`"))?;
            Projection::Orthographic { height: positive(height, "height", c)? }
        }
        ProjectionName::Perspective => {
            let fov = match (k.fov, k.focal_length) {
                (Some(fov), _) => fov,
                (None, Some(focal)) => {
                    2.0 * (0.5 * SENSOR_HEIGHT / positive(focal, "focal-length", c)?).atan().to_degrees()
                }
                (None, None) => 45.0,
            };
            Projection::Perspective { fov_y: within(fov, [0.01, 179.0], "fov", c)?.to_radians() }
        }
    })
}

/// What calibration says of a perspective camera: intrinsics and the lens.
fn calibrate(k: &CameraKeys, camera: &mut Camera, c: &Context) -> Result<(), LoadError> {
    let keys =
        [("matrix", k.matrix.is_some()), ("skew", k.skew.is_some()), ("distortion", k.distortion.is_some())];
    if let Some((key, _)) =
        keys.iter().find(|(_, given)| *given && k.projection != ProjectionName::Perspective)
    {
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
            let focal = k.focal_length.unwrap_or(0.5 * SENSOR_HEIGHT / (fov_y * 0.5).tan()) * 1e-3;
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
