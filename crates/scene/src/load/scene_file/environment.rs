//! `[environment]`: light from infinitely far away.

use super::Builder;
use super::document::{Context, Entry};
use super::values::{Color, Vec3Value, direction, within};
use crate::load::{self, LoadError};
use crate::{Daylight, Environment, Image, Portal, Sky, Sun, SunError, TextureGraph};
use glam::{DVec3, Vec3};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct EnvironmentKeys {
    color: Option<Color>,
    file: Option<String>,
    /// A texture graph: its table, or the name of one.
    texture: Option<toml::Value>,
    sky: Option<SkyKeys>,
    daylight: Option<DaylightKeys>,
    /// Degrees.
    rotation: Option<f32>,
    intensity: Option<f32>,
    #[serde(default)]
    portals: Vec<PortalKeys>,
}

/// An opening that the environment is seen through.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct PortalKeys {
    corners: [Vec3Value; 4],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct SkyKeys {
    horizon: Color,
    zenith: Color,
    ground: Option<Color>,
    sun: Option<SunKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct SunKeys {
    direction: [f32; 3],
    #[serde(default = "white")]
    color: Color,
    /// W/m².
    irradiance: f32,
    /// Degrees.
    #[serde(default = "sun_diameter")]
    angular_diameter: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct DaylightKeys {
    /// Two angles in degrees, or a moment and a place: see [`SunPosition`].
    sun: String,
    turbidity: Option<f32>,
    ground: Option<Color>,
}

fn white() -> Color {
    Color(Vec3::ONE)
}

fn sun_diameter() -> f32 {
    0.53
}

impl Builder<'_> {
    /// Sets the environment.
    pub(super) fn set_environment(&mut self, entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let keys: EnvironmentKeys = entry.read()?;
        let intensity = within(keys.intensity.unwrap_or(1.0), [0.0, 1e9], "intensity", &context)?;
        if keys.rotation.is_some() && keys.file.is_none() && keys.texture.is_none() {
            return Err(context.error("`rotation` needs `file` or `texture`"));
        }
        for (number, keys) in (1..).zip(keys.portals) {
            let corners = keys.corners.map(DVec3::from);
            let portal = Portal::new(corners.map(|corner| (corner - corners[0]).as_vec3()));
            portal.map_err(|e| context.error(format!("`portals`, number {number}: {e}")))?;
            self.placement.portals.push(corners);
        }
        let rotation = keys.rotation.unwrap_or(0.0).to_radians();
        self.scene.environment = match (keys.color, keys.file, keys.texture, keys.sky, keys.daylight) {
            (Some(color), None, None, None, None) => Environment::Constant(color.0 * intensity),
            (None, Some(file), None, None, None) => {
                let path = self.place.folder.join(file);
                let image = load::environment::load(&path, self.options, &mut self.report)?;
                self.environment_of(image, rotation, intensity)
            }
            (None, None, Some(texture), None, None) => {
                let image = self.panorama(&texture, &context)?;
                self.environment_of(image, rotation, intensity)
            }
            (None, None, None, Some(keys), None) => Environment::Sky(sky(keys, intensity, &context)?),
            (None, None, None, None, Some(keys)) => {
                Environment::Daylight(daylight(keys, intensity, &context)?)
            }
            _ => {
                return Err(context
                    .error("`environment` needs one of `color`, `file`, `texture`, `sky` and `daylight`"));
            }
        };
        Ok(())
    }

    fn environment_of(&mut self, image: Image, rotation: f32, intensity: f32) -> Environment {
        self.scene.images.push(image);
        Environment::Image { image: (self.scene.images.len() - 1) as u32, rotation, intensity }
    }

    /// A texture graph, evaluated in all directions.
    fn panorama(&mut self, texture: &toml::Value, context: &Context) -> Result<Image, LoadError> {
        context.take(
            2 * u64::from(TextureGraph::PANORAMA_HEIGHT).pow(2) * size_of::<[f32; 3]>() as u64,
            "an environment",
        )?;
        let graph = self.parse_graph(texture).map_err(|why| context.error(format!("`texture`: {why}")))?;
        graph
            .panorama(TextureGraph::PANORAMA_HEIGHT)
            .map_err(|why| context.error(format!("`texture`: {why}")))
    }
}

fn daylight(keys: DaylightKeys, intensity: f32, context: &Context) -> Result<Daylight, LoadError> {
    let sun =
        keys.sun.parse().map_err(|error: SunError| context.error(format!("`daylight.sun`: {error}")))?;
    let turbidity = within(keys.turbidity.unwrap_or(3.0), [2.0, 10.0], "daylight.turbidity", context)?;
    let ground = keys.ground.map_or(Vec3::splat(0.2), |color| color.0).clamp(Vec3::ZERO, Vec3::ONE);
    Ok(Daylight { sun, turbidity, ground, intensity })
}

/// The sky with everything multiplied by `intensity`.
fn sky(keys: SkyKeys, intensity: f32, context: &Context) -> Result<Sky, LoadError> {
    let sun = keys.sun.map(|sun| {
        let diameter = within(sun.angular_diameter, [0.01, 90.0], "sun.angular-diameter", context)?;
        Ok(Sun {
            direction: direction(sun.direction.into(), "sun.direction", context)?,
            irradiance: sun.color.0
                * within(sun.irradiance, [0.0, 1e9], "sun.irradiance", context)?
                * intensity,
            angular_radius: diameter.to_radians() * 0.5,
        })
    });
    Ok(Sky {
        horizon: keys.horizon.0 * intensity,
        zenith: keys.zenith.0 * intensity,
        ground: keys.ground.unwrap_or(keys.horizon).0 * intensity,
        sun: sun.transpose()?,
    })
}
