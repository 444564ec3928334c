//! Light in a scene: lamps, the environment, portals, fog.

use super::Scene;
use crate::arrays::{Input, vector};
use crate::errors::bad;
use crate::light::{color, directional, point, spot};
use crate::material::{add_texture, environment_image};
use crate::medium::{Medium, fog, portal};
use crate::texture_graph::graph;
use alhazen::{ColorSpace, Environment, Light, LightKind, SceneImage as Image, TextureGraph};
use glam::Vec3;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The picture of an environment that a texture graph describes.
fn painted(described: &Bound<PyDict>) -> PyResult<Image> {
    let graph = graph(&mut alhazen::Scene::default(), "radiance", described)?;
    graph.panorama(TextureGraph::PANORAMA_HEIGHT).map_err(|why| bad(format!("radiance: {why}")))
}

impl Scene {
    fn add_light(&self, py: Python, kind: LightKind, name: String) -> PyResult<u32> {
        self.change(py, |scene| {
            scene.lights.push(Light::new(name, kind));
            Ok(scene.lights.len() as u32 - 1)
        })
    }
}

#[pymethods]
impl Scene {
    /// Adds a light that shines in all directions from a point.
    ///
    /// Parameters
    /// ----------
    /// position : array_like, shape (3,)
    ///     Metres.
    /// intensity : float or array_like, shape (3,)
    ///     Radiant intensity, linear RGB, W/sr.
    /// name : str, default ""
    #[pyo3(signature = (position, intensity, *, name=String::new()))]
    fn add_point_light(
        &self,
        py: Python,
        position: &Bound<PyAny>,
        intensity: &Bound<PyAny>,
        name: String,
    ) -> PyResult<u32> {
        self.add_light(py, point(position, intensity)?, name)
    }

    /// Adds a light that shines into a cone.
    ///
    /// Parameters
    /// ----------
    /// position, direction : array_like, shape (3,)
    ///     Where it is, in metres, and where it shines.
    /// intensity : float or array_like, shape (3,)
    ///     Radiant intensity on the axis, linear RGB, W/sr.
    /// inner_angle, outer_angle : float
    ///     Angles from the axis between which the intensity falls to zero, radians, at most π/2.
    /// name : str, default ""
    #[pyo3(signature = (position, direction, intensity, *, inner_angle=0.0, outer_angle=0.5, name=String::new()))]
    fn add_spot_light(
        &self,
        py: Python,
        position: &Bound<PyAny>,
        direction: &Bound<PyAny>,
        intensity: &Bound<PyAny>,
        inner_angle: f32,
        outer_angle: f32,
        name: String,
    ) -> PyResult<u32> {
        self.add_light(py, spot(position, direction, intensity, inner_angle, outer_angle)?, name)
    }

    /// Adds a point that throws a picture: a slide projector, or a pattern of structured light.
    ///
    /// Parameters
    /// ----------
    /// position, direction : array_like, shape (3,)
    ///     Where it is, in metres, and where the picture's centre is thrown.
    /// picture : array_like of shape (height, width, 3 or 4), or dict
    ///     Row 0 at the top, bytes (sRGB) or linear floats; or a texture graph, whose picture is square.
    /// intensity : float or array_like, shape (3,)
    ///     Radiant intensity where the picture is white, linear RGB, W/sr.
    /// field_of_view : float, default 0.5
    ///     Full angle of the picture's shorter side, radians, in (0, π).
    /// up : array_like, shape (3,), default (0, 1, 0)
    ///     Towards the picture's top.
    /// name : str, default ""
    #[pyo3(signature = (position, direction, picture, intensity, *, field_of_view=0.5, up=None, name=String::new()))]
    fn add_projector(
        &self,
        py: Python,
        position: &Bound<PyAny>,
        direction: &Bound<PyAny>,
        picture: &Bound<PyAny>,
        intensity: &Bound<PyAny>,
        field_of_view: f32,
        up: Option<&Bound<PyAny>>,
        name: String,
    ) -> PyResult<u32> {
        let position = Vec3::from(vector("position", position)?);
        let direction = Vec3::from(vector("direction", direction)?).normalize_or_zero();
        let up = up.map_or(Ok([0.0, 1.0, 0.0]), |up| vector("up", up))?;
        let up = Vec3::from(up).normalize_or_zero();
        if direction.cross(up).length() <= 1e-3 {
            return Err(bad("direction, up: they must not be zero or along each other"));
        }
        if !(field_of_view > 0.0 && field_of_view < std::f32::consts::PI) {
            return Err(bad(format!("field_of_view: {field_of_view} is not between 0 and π radians")));
        }
        let intensity = color("intensity", intensity)?;
        self.change(py, |scene| {
            let picture = add_texture(scene, "picture", picture, ColorSpace::Srgb)?;
            let kind = LightKind::Projector { position, direction, up, intensity, field_of_view, picture };
            scene.lights.push(Light::new(name, kind));
            Ok(scene.lights.len() as u32 - 1)
        })
    }

    /// Adds a light that is infinitely far away.
    ///
    /// Parameters
    /// ----------
    /// direction : array_like, shape (3,)
    ///     Where the light travels.
    /// irradiance : float or array_like, shape (3,)
    ///     On a surface that faces the light, linear RGB, W/m².
    /// angular_diameter : float, default 0
    ///     Full angle under which the source is seen, radians; 0 gives hard shadows.
    /// name : str, default ""
    #[pyo3(signature = (direction, irradiance, *, angular_diameter=0.0, name=String::new()))]
    fn add_directional_light(
        &self,
        py: Python,
        direction: &Bound<PyAny>,
        irradiance: &Bound<PyAny>,
        angular_diameter: f32,
        name: String,
    ) -> PyResult<u32> {
        self.add_light(py, directional(direction, irradiance, angular_diameter)?, name)
    }

    /// Replaces the light from outside.
    ///
    /// Parameters
    /// ----------
    /// radiance : float, or array_like of shape (3,) or (height, width, 3), or dict, or None
    ///     The same linear radiance everywhere; or an equirectangular picture of it, row 0 at the top, whose centre column is
    ///     seen towards -Z; or a texture graph by direction, evaluated at 2048 × 1024 pixels; or darkness.
    /// rotation : float, default 0
    ///     Turns a picture about +Y, counter-clockwise seen from above, radians.
    /// intensity : float, default 1
    ///     Multiplied into a picture.
    #[pyo3(signature = (radiance, *, rotation=0.0, intensity=1.0))]
    fn set_environment(
        &self,
        py: Python,
        radiance: Option<&Bound<PyAny>>,
        rotation: f32,
        intensity: f32,
    ) -> PyResult<()> {
        if !(rotation.is_finite() && intensity >= 0.0 && intensity.is_finite()) {
            return Err(bad(format!(
                "rotation {rotation} and intensity {intensity} are not an angle and a factor"
            )));
        }
        let is_picture = |r: &Bound<PyAny>| Input::<f32>::new("radiance", r).map(|a| a.shape().len() == 3);
        let picture = match radiance {
            Some(r) if let Ok(described) = r.cast::<PyDict>() => Some(painted(described)?),
            Some(r) if is_picture(r)? => Some(environment_image(r)?),
            _ => None,
        };
        let constant = radiance.filter(|_| picture.is_none()).map(|r| color("radiance", r)).transpose()?;
        self.change(py, |scene| {
            scene.environment = match (picture, constant) {
                (Some(picture), _) => {
                    scene.images.push(picture);
                    let image = scene.images.len() as u32 - 1;
                    Environment::Image { image, rotation, intensity }
                }
                (None, Some(color)) => Environment::Constant(color),
                (None, None) => Environment::Black,
            };
            Ok(())
        })
    }

    /// Says where the light of the environment comes in, such as a window or a door: paths look for it there.
    ///
    /// Parameters
    /// ----------
    /// corners : array_like, shape (4, 3)
    ///     Of a flat convex quadrilateral, one after the other around it, in metres. It is no surface.
    fn add_portal(&self, py: Python, corners: &Bound<PyAny>) -> PyResult<()> {
        let portal = portal(corners)?;
        self.change(py, |scene| {
            scene.portals.push(portal);
            Ok(())
        })
    }

    /// Fills the space between bodies with a medium.
    ///
    /// Parameters
    /// ----------
    /// medium : Medium or None
    ///     Without a grid of densities; None is vacuum.
    /// top : float, default infinity
    ///     There is fog below this height only, metres. Fog that is everywhere lets nothing through from the environment.
    #[pyo3(signature = (medium, *, top=f32::INFINITY))]
    fn set_fog(&self, py: Python, medium: Option<Bound<Medium>>, top: f32) -> PyResult<()> {
        let fog = medium.map(|m| fog(m.get(), top)).transpose()?;
        self.change(py, |scene| {
            scene.fog = fog;
            Ok(())
        })
    }
}
