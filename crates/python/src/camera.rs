//! Cameras: by what they look at, or as OpenCV describes them.

use crate::arrays::{Input, affine_rows, output, square, vector};
use crate::errors::bad;
use alhazen::edits::CameraRecord;
use alhazen::{Camera as SceneCamera, Distortion, Projection, Quantity, camera_frame, picture_ray};
use glam::Vec3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

/// A camera in world space (metres, +Y up).
///
/// Make one with `Camera.look_at`, `Camera.orthographic`, `Camera.panorama`, `Camera.with_projection` or
/// `Camera.from_opencv`.
#[pyclass(frozen, module = "alhazen")]
pub struct Camera(pub SceneCamera);

/// A camera without a lens, checked.
fn camera(
    eye: &Bound<PyAny>,
    target: &Bound<PyAny>,
    up: Option<&Bound<PyAny>>,
    projection: Projection,
) -> PyResult<SceneCamera> {
    let (eye, target) = (Vec3::from(vector("eye", eye)?), Vec3::from(vector("target", target)?));
    if eye == target {
        return Err(bad(format!("eye and target are the same point, {eye}")));
    }
    let mut camera = SceneCamera::perspective("python", eye, target, 1.0);
    camera.projection = projection;
    if let Some(up) = up {
        camera.up = vector("up", up)?.into();
    }
    if camera.up == Vec3::ZERO {
        return Err(bad("up: the zero vector has no direction"));
    }
    Ok(camera)
}

/// The coefficients of a lens, from an array of any shape: OpenCV makes rows and columns of them.
pub fn coefficients(distortion: Option<&Bound<PyAny>>) -> PyResult<Vec<f64>> {
    let Some(distortion) = distortion else { return Ok(Vec::new()) };
    Ok(Input::<f64>::new("distortion", distortion)?.numbers()?.to_vec())
}

#[pymethods]
impl Camera {
    /// A perspective camera that looks from a point to a point.
    ///
    /// Parameters
    /// ----------
    /// eye, target : array_like, shape (3,)
    ///     Where the camera is and what it looks at, in metres.
    /// up : array_like, shape (3,), default (0, 1, 0)
    ///     Approximate up direction.
    /// fov_y : float, default 0.8
    ///     Full vertical field of view, in radians, in (0, π).
    /// lens_radius : float, default 0
    ///     Radius of the lens, in metres; 0 is a pinhole.
    /// focus_distance : float, optional
    ///     Distance in focus, in metres; that of the target if not given.
    ///
    /// Returns
    /// -------
    /// Camera
    #[staticmethod]
    #[pyo3(signature = (eye, target, *, up=None, fov_y=0.8, lens_radius=0.0, focus_distance=None))]
    fn look_at(
        eye: &Bound<PyAny>,
        target: &Bound<PyAny>,
        up: Option<&Bound<PyAny>>,
        fov_y: f32,
        lens_radius: f32,
        focus_distance: Option<f32>,
    ) -> PyResult<Self> {
        if !(fov_y > 0.0 && fov_y < std::f32::consts::PI) {
            return Err(bad(format!("fov_y: {fov_y} is not between 0 and π radians")));
        }
        let mut camera = camera(eye, target, up, Projection::Perspective { fov_y })?;
        camera.focus_distance = focus_distance.unwrap_or(camera.focus_distance);
        camera.lens_radius = lens_radius;
        if !(lens_radius >= 0.0 && lens_radius.is_finite()) {
            return Err(bad(format!("lens_radius: {lens_radius} is not a radius in metres")));
        }
        if !(camera.focus_distance > 0.0 && camera.focus_distance.is_finite()) {
            return Err(bad(format!(
                "focus_distance: {} is not a distance in metres",
                camera.focus_distance
            )));
        }
        Ok(Self(camera))
    }

    /// A camera with parallel rays.
    ///
    /// Parameters
    /// ----------
    /// eye, target : array_like, shape (3,)
    ///     Centre of the film and what it looks at, in metres.
    /// height : float
    ///     Height of the picture in the world, in metres.
    /// up : array_like, shape (3,), default (0, 1, 0)
    ///     Approximate up direction.
    #[staticmethod]
    #[pyo3(signature = (eye, target, height, *, up=None))]
    fn orthographic(
        eye: &Bound<PyAny>,
        target: &Bound<PyAny>,
        height: f32,
        up: Option<&Bound<PyAny>>,
    ) -> PyResult<Self> {
        if !(height > 0.0 && height.is_finite()) {
            return Err(bad(format!("height: {height} is not a height in metres")));
        }
        Ok(Self(camera(eye, target, up, Projection::Orthographic { height })?))
    }

    /// An equirectangular camera: 360° × 180°, with the target in the centre.
    ///
    /// Parameters
    /// ----------
    /// eye, target : array_like, shape (3,)
    ///     Where the camera is and what its picture's centre shows, in metres.
    /// up : array_like, shape (3,), default (0, 1, 0)
    ///     Approximate up direction.
    #[staticmethod]
    #[pyo3(signature = (eye, target, *, up=None))]
    fn panorama(eye: &Bound<PyAny>, target: &Bound<PyAny>, up: Option<&Bound<PyAny>>) -> PyResult<Self> {
        Ok(Self(camera(eye, target, up, Projection::Panorama)?))
    }

    /// A camera of any projection.
    ///
    /// Parameters
    /// ----------
    /// projection : str
    ///     "perspective", "orthographic", "panorama", "fisheye" or "cubemap". A fisheye's picture is a circle in which
    ///     distances from the centre are angles. A cube map's is six squares side by side, 6:1: right, left, up, down,
    ///     forward, back, as Direct3D, Vulkan and OpenGL have them.
    /// eye, target : array_like, shape (3,)
    ///     Where the camera is and what it looks at, in metres.
    /// up : array_like, shape (3,), default (0, 1, 0)
    ///     Approximate up direction.
    /// fov : float
    ///     Full angle of view in radians: vertical of a perspective (default 45°), of a fisheye that of its circle
    ///     (default π).
    /// height : float
    ///     Height of an orthographic camera's picture, in metres.
    ///
    /// Returns
    /// -------
    /// Camera
    #[staticmethod]
    #[pyo3(signature = (projection, eye, target, *, up=None, **number))]
    fn with_projection(
        projection: &str,
        eye: &Bound<PyAny>,
        target: &Bound<PyAny>,
        up: Option<&Bound<PyAny>>,
        number: Option<&Bound<PyDict>>,
    ) -> PyResult<Self> {
        let unknown = || bad(format!("projection: {projection:?} is none of {}", Projection::names()));
        let mut named = Projection::from_name(projection).ok_or_else(unknown)?;
        let mut given: BTreeMap<String, f32> =
            number.map(|number| number.extract()).transpose()?.unwrap_or_default();
        if let Some((parameter, value)) = named.parameter_mut() {
            match (given.remove(parameter.key), parameter.default) {
                (Some(number), _) => {
                    let user =
                        if parameter.quantity == Quantity::Angle { number.to_degrees() } else { number };
                    let within = parameter.from_user(user).map(|_| number);
                    *value =
                        within.ok_or_else(|| bad(format!("{}: {number} is out of range", parameter.key)))?;
                }
                (None, Some(_)) => {}
                (None, None) => {
                    return Err(bad(format!("a camera that is {projection} needs {}", parameter.key)));
                }
            }
        }
        if let Some(key) = given.keys().next() {
            return Err(bad(format!("{key} has no meaning for a camera that is {projection}")));
        }
        Ok(Self(camera(eye, target, up, named)?))
    }

    /// A calibrated pinhole camera, as OpenCV describes it.
    ///
    /// Camera axes are OpenCV's: x right, y down, z into the picture. Pixel centres are at whole numbers: the centre of the
    /// upper left pixel is (0, 0). The camera keeps its field of view when a picture of another size is rendered.
    ///
    /// Parameters
    /// ----------
    /// matrix : array_like, shape (3, 3)
    ///     Intrinsics ``[[fx, s, cx], [0, fy, cy], [0, 0, 1]]``, in pixels.
    /// pose : array_like, shape (4, 4) or (3, 4)
    ///     Camera to world, a rotation and a translation in metres. It is the inverse of the extrinsics ``[R | t]``.
    /// width, height : int
    ///     Size of the picture that the matrix belongs to, in pixels.
    /// distortion : array_like, optional
    ///     Coefficients of the lens as `cv2.calibrateCamera` returns them: k1, k2, p1, p2, and perhaps k3, and k4, k5, k6. What
    ///     lies outside of the lens' field is black.
    /// fisheye : bool, default False
    ///     Whether they are k1, k2, k3, k4 of `cv2.fisheye.calibrate`.
    #[staticmethod]
    #[pyo3(signature = (matrix, pose, width, height, *, distortion=None, fisheye=false))]
    fn from_opencv(
        matrix: &Bound<PyAny>,
        pose: &Bound<PyAny>,
        width: u32,
        height: u32,
        distortion: Option<&Bound<PyAny>>,
        fisheye: bool,
    ) -> PyResult<Self> {
        let (matrix, pose) = (square("matrix", matrix)?, affine_rows("pose", pose)?);
        let coefficients = coefficients(distortion)?;
        let camera = SceneCamera::from_opencv(matrix, pose, width, height)
            .and_then(|camera| camera.with_opencv_distortion(&coefficients, fisheye));
        camera.map(Self).map_err(|e| bad(e.to_string()))
    }

    /// Where the camera is: float32, shape (3,), metres.
    #[getter]
    fn eye<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        output(py, self.0.eye.to_array().to_vec(), &[3])
    }

    /// A point that it looks at: float32, shape (3,), metres.
    #[getter]
    fn target<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        output(py, self.0.target.to_array().to_vec(), &[3])
    }

    /// The name that a file gave it.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Rays through the centres of all pixels.
    ///
    /// Parameters
    /// ----------
    /// width, height : int
    ///     Size of the picture in pixels.
    ///
    /// Returns
    /// -------
    /// origins, directions : ndarray, float32, shape (height, width, 3)
    ///     World space, metres; directions have unit length. Row 0 is at the top. Outside of the field of a lens, rays start
    ///     beyond everything and hit nothing.
    fn rays<'py>(&self, py: Python<'py>, width: u32, height: u32) -> PyResult<[Bound<'py, PyAny>; 2]> {
        if width == 0 || height == 0 || u64::from(width) * u64::from(height) > 1 << 30 {
            return Err(bad(format!("a picture of {width}×{height} pixels is not possible")));
        }
        let frame = camera_frame(&self.0, width, height);
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x as f32 + 0.5, y as f32 + 0.5)));
        let rays = pixels.map(|(x, y)| picture_ray(&frame, width, height, x, y));
        let (origins, directions): (Vec<_>, Vec<_>) = rays.map(|r| (r.origin, r.direction)).unzip();
        let shape = [height as usize, width as usize, 3];
        Ok([output(py, origins.into_flattened(), &shape)?, output(py, directions.into_flattened(), &shape)?])
    }

    #[staticmethod]
    fn _unpickle(text: &str) -> PyResult<Self> {
        let record: CameraRecord = serde_json::from_str(text).map_err(|e| bad(format!("camera: {e}")))?;
        Ok(Self(record.camera()))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let text = serde_json::to_string(&CameraRecord::from(&self.0)).map_err(|e| bad(e.to_string()))?;
        Ok((py.get_type::<Self>().getattr("_unpickle")?, (text,)))
    }

    fn __copy__(&self) -> Self {
        Self(self.0.clone())
    }

    fn __deepcopy__(&self, _memo: &Bound<PyAny>) -> Self {
        self.__copy__()
    }

    fn __repr__(&self) -> String {
        let c = &self.0;
        let places = format!("eye={}, target={}, up={}", c.eye, c.target, c.up);
        let lens = if c.lens_radius > 0.0 {
            format!(", lens_radius={}, focus_distance={}", c.lens_radius, c.focus_distance)
        } else {
            String::new()
        };
        match c.projection {
            Projection::Perspective { fov_y } => format!("Camera.look_at({places}, fov_y={fov_y}{lens})"),
            Projection::Orthographic { height } => format!("Camera.orthographic({places}, height={height})"),
            Projection::Panorama => format!("Camera.panorama({places})"),
            Projection::Intrinsics { focal, center } => {
                let lens = match c.distortion {
                    Some(Distortion::BrownConrady { k, p }) => format!(", k={k:?}, p={p:?}"),
                    Some(Distortion::Fisheye { k }) => format!(", fisheye k={k:?}"),
                    None => String::new(),
                };
                format!("<Camera.from_opencv: {places}, focal={focal}, center={center}{lens}>")
            }
            other => {
                let number =
                    other.parameter().map(|(parameter, value)| format!(", {}={value}", parameter.key));
                let number = number.unwrap_or_default();
                format!("Camera.with_projection(\"{}\", {places}{number})", other.name())
            }
        }
    }
}
