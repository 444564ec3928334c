//! Media, fog and subsurface scattering that a caller describes.

use crate::arrays::Input;
use crate::errors::bad;
use crate::light::color;
use alhazen::{DensityGrid, Fog, Material, Model, Portal, Subsurface};
use glam::Vec3;
use pyo3::prelude::*;
use std::sync::Arc;

/// What light is absorbed and scattered in, and that may shine: smoke, milk, fog, flames.
///
/// `Scene.add_material` puts it inside of bodies, `Scene.set_fog` between them. Coefficients are linear RGB or one number for
/// all three, per metre.
///
/// Parameters
/// ----------
/// absorption, scattering : float or array_like, shape (3,), default 0
///     Coefficients, m⁻¹.
/// emission : float or array_like, shape (3,), default 0
///     Radiance that a metre of the medium emits, W·sr⁻¹·m⁻³.
/// anisotropy : float, default 0
///     Mean cosine of the angle by which scattered light turns (Henyey and Greenstein), between -0.99 and 0.99.
/// density : array_like, float32, shape (depth, height, width), optional
///     What all coefficients are multiplied with, at the centres of the cells of a grid: along z, y and x, upwards. Between them it is
///     interpolated, outside of `bounds` it is 0. 1 everywhere if not given.
/// bounds : array_like, shape (2, 3), default unit cube
///     Lower and upper corner of the grid in world space, metres.
#[pyclass(frozen, module = "alhazen")]
pub struct Medium(alhazen::Medium);

#[pymethods]
impl Medium {
    #[new]
    #[pyo3(signature = (*, absorption=None, scattering=None, emission=None, anisotropy=0.0, density=None, bounds=None))]
    fn new(
        absorption: Option<&Bound<PyAny>>,
        scattering: Option<&Bound<PyAny>>,
        emission: Option<&Bound<PyAny>>,
        anisotropy: f32,
        density: Option<&Bound<PyAny>>,
        bounds: Option<&Bound<PyAny>>,
    ) -> PyResult<Self> {
        let coefficient =
            |name, value: Option<&Bound<PyAny>>| value.map_or(Ok(Vec3::ZERO), |v| color(name, v));
        let bounds = bounds.map_or(Ok([Vec3::ZERO, Vec3::ONE]), |b| points("bounds", b))?;
        Ok(Self(alhazen::Medium {
            absorption: coefficient("absorption", absorption)?,
            scattering: coefficient("scattering", scattering)?,
            emission: coefficient("emission", emission)?,
            anisotropy: checked_anisotropy("anisotropy", anisotropy)?,
            density: density.map(|d| grid(d, bounds)).transpose()?.map(Arc::new),
        }))
    }
}

/// Densities of shape (depth, height, width) between two corners.
fn grid(density: &Bound<PyAny>, bounds: [Vec3; 2]) -> PyResult<DensityGrid> {
    let input = Input::<f32>::new("density", density)?;
    let [depth, height, width] = *input.shape() else {
        return Err(bad("density: expected the shape (depth, height, width)"));
    };
    let values = input.numbers()?;
    if let Some(value) = values.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
        return Err(bad(format!("density: {value} is negative or not finite")));
    }
    let side = |n: usize| u32::try_from(n).map_err(|_| bad(format!("density: {n} cells are too many")));
    let size = [side(width)?, side(height)?, side(depth)?];
    DensityGrid::new(size, bounds, values.to_vec()).ok_or_else(|| {
        bad("density: there must be cells, and bounds must be two corners, the second one above the first along each axis")
    })
}

/// `N` points.
fn points<const N: usize>(name: &'static str, value: &Bound<PyAny>) -> PyResult<[Vec3; N]> {
    let input = Input::<f32>::new(name, value)?;
    let rows = input.rows::<3>()?;
    let points: Result<[[f32; 3]; N], _> = rows.try_into();
    points
        .map(|points| points.map(Vec3::from))
        .map_err(|_| bad(format!("{name}: expected the shape ({N}, 3), got ({}, 3)", rows.len())))
}

fn checked_anisotropy(name: &str, anisotropy: f32) -> PyResult<f32> {
    let most = alhazen::Medium::MOST_ANISOTROPIC;
    if anisotropy.abs() <= most {
        Ok(anisotropy)
    } else {
        Err(bad(format!("{name}: {anisotropy} is not between -{most} and {most}")))
    }
}

/// What may be inside of a body; `Scene.add_material` explains it.
pub struct BodyDescribed<'py> {
    pub medium: Option<Bound<'py, Medium>>,
    pub subsurface_radius: Option<Bound<'py, PyAny>>,
    pub subsurface_anisotropy: f32,
    pub priority: Option<i32>,
}

impl BodyDescribed<'_> {
    /// Puts it into a material whose other properties are known.
    pub fn apply(&self, material: &mut Material) -> PyResult<()> {
        material.medium = self.medium.as_ref().map(|m| m.get().0.clone());
        material.subsurface = self.subsurface(material)?;
        material.priority = self.priority;
        let inside = material.medium.is_some() || material.priority.is_some();
        if inside && !material.refracts_into_body() {
            return Err(bad(
                "medium and priority are of bodies that light gets into: models boundary and dielectric, or transmission, \
                 not thin_walled",
            ));
        }
        match self.priority {
            Some(priority) if !(-1000..=1000).contains(&priority) => {
                Err(bad(format!("priority: {priority} is not between -1000 and 1000")))
            }
            _ => Ok(()),
        }
    }

    fn subsurface(&self, material: &Material) -> PyResult<Option<Subsurface>> {
        let Some(radius) = &self.subsurface_radius else { return Ok(None) };
        let radius = color("subsurface_radius", radius)?;
        if radius.min_element() < Subsurface::SHORTEST {
            return Err(bad(format!("subsurface_radius: {radius} is not positive")));
        }
        if material.model != Model::Dielectric || material.thin_walled {
            return Err(bad(
                "subsurface_radius: only bodies of the model dielectric have one, not thin_walled",
            ));
        }
        if material.medium.is_some() {
            return Err(bad("subsurface_radius: the body has a medium already"));
        }
        if material.base_color_texture.is_some() {
            return Err(bad("subsurface_radius: the inside has one colour, base_color, and no texture"));
        }
        let anisotropy = checked_anisotropy("subsurface_anisotropy", self.subsurface_anisotropy)?;
        Ok(Some(Subsurface { radius, anisotropy }))
    }
}

/// Fog below a height.
pub fn fog(medium: &Medium, top: f32) -> PyResult<Fog> {
    let fog = Fog { medium: medium.0.clone(), top };
    if top.is_nan() {
        return Err(bad("top: not a height"));
    }
    if fog.medium.density.is_some() {
        return Err(bad(
            "fog is as dense everywhere: a grid of densities needs a body of the model boundary",
        ));
    }
    if fog.is_endlessly_bright() {
        return Err(bad(
            "fog that shines must absorb or scatter at least a billionth of its emission per metre, or it is \
             infinitely bright",
        ));
    }
    Ok(fog)
}

/// An opening that the environment is seen through.
pub fn portal(value: &Bound<PyAny>) -> PyResult<Portal> {
    Portal::new(points::<4>("corners", value)?).map_err(|e| bad(e.to_string()))
}
