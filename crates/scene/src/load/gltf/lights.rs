//! Punctual lights (`KHR_lights_punctual`): they shine along their node's −Z axis, in candela and lux.

use super::document::Document;
use super::json;
use super::motion::Motion;
use super::nodes::{Carried, Hierarchy};
use crate::animation::{AnimatedLight, Punctual, PunctualKind};
use crate::load::session::light as light_size;
use crate::{Environment, Light, LoadError, LoadReport};
use glam::{DAffine3, Vec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

impl Document<'_> {
    /// All lights of the scene, and what carries each, with its number in the file. Lights that are shown later only
    /// are there without strength.
    ///
    /// # Errors
    /// A light that does not exist.
    pub fn lights(
        &self,
        hierarchy: &Hierarchy,
        motion: &Motion,
        report: &mut LoadReport,
    ) -> Result<Carried<Light, AnimatedLight>, LoadError> {
        let sources = self.json.extensions.lights.as_ref().map(|l| &l.lights[..]).unwrap_or_default();
        let (mut lights, mut carriers) = (Vec::new(), Vec::new());
        for placed in hierarchy.placed.iter().filter(|p| p.visible || motion.moves(p.node)) {
            let Some(reference) = &self.json.nodes[placed.node as usize].extensions.light else { continue };
            let json = self.get(sources, reference.light, "light")?;
            let world = &hierarchy.worlds[placed.node as usize];
            let found = source(json, report).filter(|source| source.at(world).is_some());
            let Some(source) = found else {
                report.ignored("a light has an unknown type or impossible values and is left out");
                continue;
            };
            let shown = if placed.visible { source } else { Punctual { intensity: 0.0, ..source } };
            let Some(kind) = shown.at(world) else { continue };
            let (light, root) = (lights.len() as u32, DAffine3::IDENTITY);
            carriers.push((reference.light, AnimatedLight { light, node: placed.node, source, root }));
            let name = self.node_name(placed.node, json.name.as_deref());
            let size = light_size(name.len()) + size_of::<AnimatedLight>() as u64;
            self.options.budget().take(size, "lights")?;
            lights.push(Light::new(name, kind));
        }
        Ok(Carried { objects: lights, carriers })
    }
}

fn source(light: &json::Light, report: &mut LoadReport) -> Option<Punctual> {
    if light.range.is_some() && light.kind != "directional" {
        report.approximated(
            "the range of lights is not used: they fall off with the square of the distance for ever",
        );
    }
    let kind = match light.kind.as_str() {
        "point" => PunctualKind::Point,
        "directional" => PunctualKind::Directional,
        "spot" => {
            let outer = light.spot.outer_cone_angle.unwrap_or(FRAC_PI_4);
            let inner = light.spot.inner_cone_angle.unwrap_or(0.0);
            if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2) {
                report.repaired("a spot light's cone angles are not 0 ≤ inner < outer ≤ π/2");
            }
            PunctualKind::Spot { inner, outer }
        }
        _ => return None,
    };
    let color = Vec3::from(light.color.unwrap_or([1.0; 3]));
    Some(Punctual { kind, color, intensity: light.intensity.unwrap_or(1.0) })
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
