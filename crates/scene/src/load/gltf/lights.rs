//! Punctual lights (`KHR_lights_punctual`): they shine along their node's −Z axis, in candela and lux.

use super::document::Document;
use super::json;
use super::nodes::Hierarchy;
use crate::{Environment, Light, LightKind, LoadError, LoadReport};
use glam::{DAffine3, Vec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

impl Document<'_> {
    /// All lights of the scene.
    ///
    /// # Errors
    /// A light that does not exist.
    pub fn lights(&self, hierarchy: &Hierarchy, report: &mut LoadReport) -> Result<Vec<Light>, LoadError> {
        let sources = self.json.extensions.lights.as_ref().map(|l| &l.lights[..]).unwrap_or_default();
        let mut lights = Vec::new();
        for placed in hierarchy.placed.iter().filter(|p| p.visible) {
            let Some(reference) = &self.json.nodes[placed.node as usize].extensions.light else { continue };
            let source = self.get(sources, reference.light, "light")?;
            let name = self.node_name(placed.node, source.name.as_deref());
            match kind(source, &hierarchy.worlds[placed.node as usize], report) {
                Some(kind) => lights.push(Light { name, kind }),
                None => report.ignored("a light has an unknown type or impossible values and is left out"),
            }
        }
        Ok(lights)
    }
}

fn kind(light: &json::Light, world: &DAffine3, report: &mut LoadReport) -> Option<LightKind> {
    let strength = Vec3::from(light.color.unwrap_or([1.0; 3])) * light.intensity.unwrap_or(1.0);
    let position = world.translation.as_vec3();
    let direction = -world.matrix3.z_axis.as_vec3().normalize_or_zero();
    let sound = strength.is_finite() && strength.min_element() >= 0.0 && position.is_finite();
    if !sound || (light.kind != "point" && direction == Vec3::ZERO) {
        return None;
    }
    if light.range.is_some() && light.kind != "directional" {
        report.approximated(
            "the range of lights is not used: they fall off with the square of the distance for ever",
        );
    }
    match light.kind.as_str() {
        "point" => Some(LightKind::Point { position, intensity: strength }),
        "directional" => {
            Some(LightKind::Directional { direction, irradiance: strength, angular_diameter: 0.0 })
        }
        "spot" => {
            let outer = light.spot.outer_cone_angle.unwrap_or(FRAC_PI_4);
            let inner = light.spot.inner_cone_angle.unwrap_or(0.0);
            if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2) {
                report.repaired("a spot light's cone angles are not 0 ≤ inner < outer ≤ π/2");
            }
            let finite = |angle: f32| if angle.is_finite() { angle } else { 0.0 };
            let outer_angle = finite(outer).clamp(1e-4, FRAC_PI_2);
            let inner_angle = finite(inner).clamp(0.0, outer_angle * 0.9999);
            Some(LightKind::Spot { position, direction, intensity: strength, inner_angle, outer_angle })
        }
        _ => None,
    }
}

/// The constant environment that may stand in a scene's extras, as `"environment": [r, g, b]`.
pub(super) fn environment(scene: Option<&json::Scene>, report: &mut LoadReport) -> Environment {
    let value = scene.and_then(|s| s.extras.as_ref()).and_then(|extras| extras.get("environment"));
    let Some(value) = value else { return Environment::Black };
    let radiance = value.as_array().and_then(|list| {
        let numbers: Option<Vec<f32>> = list.iter().map(|v| v.as_f64().map(|v| v as f32)).collect();
        <[f32; 3]>::try_from(numbers?).ok().map(Vec3::from)
    });
    match radiance.filter(|r| r.is_finite() && r.min_element() >= 0.0) {
        Some(radiance) => Environment::Constant(radiance),
        None => {
            report.ignored("the scene's extras.environment is not three numbers ≥ 0");
            Environment::Black
        }
    }
}
