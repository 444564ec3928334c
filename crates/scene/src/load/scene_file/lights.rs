//! `[[light]]`: point, spot and directional lights.

use super::Builder;
use super::document::{Context, Entry};
use super::repeat::{Copy, Palette};
use super::values::{Color, direction, within};
use crate::load::LoadError;
use crate::merge::placed_light;
use crate::{Light, LightKind};
use glam::Vec3;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct PointKeys {
    #[serde(default)]
    position: [f32; 3],
    #[serde(default = "white")]
    color: Color,
    /// W/sr.
    intensity: f32,
    /// Whether the copies share the intensity.
    #[serde(default)]
    split_intensity: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct SpotKeys {
    #[serde(default)]
    position: [f32; 3],
    direction: Option<[f32; 3]>,
    target: Option<[f32; 3]>,
    #[serde(default = "white")]
    color: Color,
    /// W/sr on the axis.
    intensity: f32,
    #[serde(default)]
    split_intensity: bool,
    /// Degrees from the axis to the edge of the cone.
    #[serde(default = "thirty")]
    angle: f32,
    /// Degrees from the axis up to which the light is full.
    inner_angle: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct DirectionalKeys {
    direction: Option<[f32; 3]>,
    towards: Option<[f32; 3]>,
    #[serde(default = "white")]
    color: Color,
    /// W/m².
    irradiance: f32,
    /// Degrees.
    #[serde(default)]
    angular_diameter: f32,
}

fn white() -> Color {
    Color(Vec3::ONE)
}

fn thirty() -> f32 {
    30.0
}

impl Builder<'_> {
    /// Adds a light and its copies.
    pub(super) fn add_light(&mut self, mut entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let Some(object) = self.take_object(&mut entry)? else { return Ok(()) };
        let palette = entry.take_table("vary-color").map(|table| table.read::<Palette>()).transpose()?;
        let kind = entry.take_string("kind")?.unwrap_or_default();
        let (kind, split) = match kind.as_str() {
            "point" => point(entry.read()?, &context)?,
            "spot" => spot(entry.read()?, &context)?,
            "directional" => (directional(entry.read()?, &context)?, false),
            other => {
                let message = format!("unknown kind `{other}`; known are `point`, `spot` and `directional`");
                return Err(context.error(message));
            }
        };
        let share = if split { 1.0 / object.copies.len().max(1) as f32 } else { 1.0 };
        for (i, copy) in object.copies.iter().enumerate() {
            let kind = tinted(kind, share * tint(palette.as_ref(), copy));
            let light = Light { name: object.copy_name("light", i), kind };
            if object.visible {
                self.scene.lights.push(placed_light(&light, &object.transform(copy)));
            }
        }
        Ok(())
    }
}

/// The colour of a copy.
fn tint(palette: Option<&Palette>, copy: &Copy) -> Vec3 {
    palette.and_then(|p| p.at(copy)).unwrap_or(Vec3::ONE)
}

/// The light with its strength multiplied.
fn tinted(kind: LightKind, factor: Vec3) -> LightKind {
    let mut kind = kind;
    match &mut kind {
        LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => *intensity *= factor,
        LightKind::Directional { irradiance, .. } => *irradiance *= factor,
    }
    kind
}

fn strength(color: Color, value: f32, key: &str, c: &Context) -> Result<Vec3, LoadError> {
    Ok(color.0 * within(value, [0.0, 1e12], key, c)?)
}

fn point(k: PointKeys, c: &Context) -> Result<(LightKind, bool), LoadError> {
    let intensity = strength(k.color, k.intensity, "intensity", c)?;
    Ok((LightKind::Point { position: k.position.into(), intensity }, k.split_intensity))
}

fn spot(k: SpotKeys, c: &Context) -> Result<(LightKind, bool), LoadError> {
    let position = Vec3::from_array(k.position);
    let aim = match (k.direction, k.target) {
        (Some(d), None) => direction(d.into(), "direction", c)?,
        (None, Some(target)) => direction(Vec3::from_array(target) - position, "target − position", c)?,
        _ => return Err(c.error("a spot light needs one of `direction` and `target`")),
    };
    let outer = within(k.angle, [0.1, 90.0], "angle", c)?;
    let inner = within(k.inner_angle.unwrap_or(outer * 0.8), [0.0, outer * 0.999], "inner-angle", c)?;
    let kind = LightKind::Spot {
        position,
        direction: aim,
        intensity: strength(k.color, k.intensity, "intensity", c)?,
        inner_angle: inner.to_radians(),
        outer_angle: outer.to_radians(),
    };
    Ok((kind, k.split_intensity))
}

fn directional(k: DirectionalKeys, c: &Context) -> Result<LightKind, LoadError> {
    let travels = match (k.direction, k.towards) {
        (Some(d), None) => direction(d.into(), "direction", c)?,
        (None, Some(towards)) => -direction(towards.into(), "towards", c)?,
        _ => return Err(c.error("a directional light needs one of `direction` and `towards`")),
    };
    Ok(LightKind::Directional {
        direction: travels,
        irradiance: strength(k.color, k.irradiance, "irradiance", c)?,
        angular_diameter: within(k.angular_diameter, [0.0, 90.0], "angular-diameter", c)?.to_radians(),
    })
}
