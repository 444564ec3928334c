//! Lights and surroundings that a caller describes.

use crate::arrays::vector;
use crate::errors::bad;
use alhazen::{LightKind, hex_color};
use glam::Vec3;
use pyo3::prelude::*;

/// The linear RGB of a text such as "#ff8000", which is sRGB; `None` for what is no text.
pub fn hex(name: &str, value: &Bound<PyAny>) -> PyResult<Option<[f32; 3]>> {
    let Ok(text) = value.extract::<String>() else { return Ok(None) };
    let color = hex_color(&text);
    color.map(Some).ok_or_else(|| bad(format!("{name}: `{text}` is not a colour like \"#ff8000\"")))
}

/// A colour or strength: linear RGB, one number for all three, or a text such as "#ff8000" (sRGB); not negative.
pub fn color(name: &'static str, value: &Bound<PyAny>) -> PyResult<Vec3> {
    if let Some(color) = hex(name, value)? {
        return Ok(color.into());
    }
    let color = match value.extract::<f32>() {
        Ok(grey) => Vec3::splat(grey),
        Err(_) => vector::<3>(name, value)?.into(),
    };
    if color.is_finite() && color.min_element() >= 0.0 {
        Ok(color)
    } else {
        Err(bad(format!("{name}: {color} is negative or not finite")))
    }
}

/// A direction of unit length.
fn direction(value: &Bound<PyAny>) -> PyResult<Vec3> {
    let direction = Vec3::from(vector("direction", value)?);
    direction.try_normalize().ok_or_else(|| bad("direction: the zero vector has no direction"))
}

/// A light that shines in all directions from a point.
pub fn point(position: &Bound<PyAny>, intensity: &Bound<PyAny>) -> PyResult<LightKind> {
    Ok(LightKind::Point {
        position: vector("position", position)?.into(),
        intensity: color("intensity", intensity)?,
    })
}

/// A light that shines into a cone.
pub fn spot(
    position: &Bound<PyAny>,
    towards: &Bound<PyAny>,
    intensity: &Bound<PyAny>,
    inner_angle: f32,
    outer_angle: f32,
) -> PyResult<LightKind> {
    let ordered = inner_angle >= 0.0 && inner_angle < outer_angle;
    if !(ordered && outer_angle <= std::f32::consts::FRAC_PI_2) {
        return Err(bad(format!(
            "expected 0 ≤ inner_angle < outer_angle ≤ π/2, got {inner_angle} and {outer_angle}"
        )));
    }
    Ok(LightKind::Spot {
        position: vector("position", position)?.into(),
        direction: direction(towards)?,
        intensity: color("intensity", intensity)?,
        inner_angle,
        outer_angle,
    })
}

/// A light that is infinitely far away.
pub fn directional(
    towards: &Bound<PyAny>,
    irradiance: &Bound<PyAny>,
    angular_diameter: f32,
) -> PyResult<LightKind> {
    if !(0.0..=std::f32::consts::PI).contains(&angular_diameter) {
        return Err(bad(format!("angular_diameter: {angular_diameter} is not between 0 and π radians")));
    }
    Ok(LightKind::Directional {
        direction: direction(towards)?,
        irradiance: color("irradiance", irradiance)?,
        angular_diameter,
    })
}
