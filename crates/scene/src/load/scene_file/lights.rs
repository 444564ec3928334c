//! `[[light]]`: point, spot and directional lights, projectors.

use super::Builder;
use super::document::{Context, Entry};
use super::repeat::{Copy, Palette};
use super::textures::TextureValue;
use super::values::{Color, direction, within};
use crate::load::textures::Neutral;
use crate::load::{LoadError, ies};
use crate::{ColorSpace, Light, LightKind, LightProfile, Photometry};
use glam::{DAffine3, DVec3, Vec3};
use serde::Deserialize;
use std::sync::Arc;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct PointKeys {
    #[serde(default)]
    position: [f64; 3],
    #[serde(default = "white")]
    color: Color,
    /// W/sr, where the profile is greatest if there is one.
    intensity: Option<f32>,
    /// Whether the copies share the intensity.
    #[serde(default)]
    split_intensity: bool,
    /// A photometric file.
    ies: Option<String>,
    /// A texture graph by direction: its table, or the name of one.
    texture: Option<toml::Value>,
    /// Where the lamp of the file is aimed.
    direction: Option<[f32; 3]>,
    target: Option<[f64; 3]>,
    /// Degrees.
    turn: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct SpotKeys {
    #[serde(default)]
    position: [f64; 3],
    direction: Option<[f32; 3]>,
    target: Option<[f64; 3]>,
    #[serde(default = "white")]
    color: Color,
    /// W/sr on the axis; with a profile, where that is greatest.
    intensity: Option<f32>,
    #[serde(default)]
    split_intensity: bool,
    /// A photometric file.
    ies: Option<String>,
    /// A texture graph by direction: its table, or the name of one.
    texture: Option<toml::Value>,
    /// Degrees.
    turn: Option<f32>,
    /// Degrees from the axis to the edge of the cone.
    #[serde(default = "thirty")]
    angle: f32,
    /// Degrees from the axis up to which the light is full.
    inner_angle: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct ProjectorKeys {
    #[serde(default)]
    position: [f64; 3],
    direction: Option<[f32; 3]>,
    target: Option<[f64; 3]>,
    up: Option<[f32; 3]>,
    #[serde(default = "white")]
    color: Color,
    /// W/sr where the picture is white.
    intensity: f32,
    #[serde(default)]
    split_intensity: bool,
    /// Degrees, of the picture's shorter side.
    #[serde(default = "thirty")]
    field_of_view: f32,
    /// The picture: an image or a texture graph.
    texture: TextureValue,
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
        if !object.motion.is_empty() {
            return Err(context.error("`motion` is for shapes, models and cameras; a shape may shine"));
        }
        let palette = entry.take_table("vary-color").map(|table| table.read::<Palette>()).transpose()?;
        let kind = entry.take_string("kind")?.unwrap_or_default();
        let Lamp { kind, at, profile, split } = match kind.as_str() {
            "point" => self.point(entry.read()?, &context)?,
            "spot" => self.spot(entry.read()?, &context)?,
            "projector" => self.projector(entry.read()?, &context)?,
            "directional" => {
                let kind = directional(entry.read()?, &context)?;
                Lamp { kind, at: DAffine3::IDENTITY, profile: None, split: false }
            }
            other => {
                let message = format!(
                    "unknown kind `{other}`; known are `point`, `spot`, `projector` and `directional`"
                );
                return Err(context.error(message));
            }
        };
        let share = if split { 1.0 / object.copies.len().max(1) as f32 } else { 1.0 };
        for (i, copy) in object.copies.iter().enumerate() {
            let kind = kind.scaled(share * tint(palette.as_ref(), copy));
            let light = Light { name: object.copy_name("light", i), kind, profile: profile.clone() };
            if object.visible {
                self.scene.lights.push(light);
                self.placement.lights.push(object.transform(copy) * at);
            }
        }
        Ok(())
    }
}

/// The colour of a copy.
fn tint(palette: Option<&Palette>, copy: &Copy) -> Vec3 {
    palette.and_then(|p| p.at(copy)).unwrap_or(Vec3::ONE)
}

fn strength(color: Color, value: f32, key: &str, c: &Context) -> Result<Vec3, LoadError> {
    Ok(color.0 * within(value, [0.0, 1e12], key, c)?)
}

/// A light before it is placed.
struct Lamp {
    /// The light at the origin.
    kind: LightKind,
    /// Its place in its object.
    at: DAffine3,
    profile: Option<Photometry>,
    /// Whether its copies share the intensity.
    split: bool,
}

impl Builder<'_> {
    fn point(&mut self, k: PointKeys, c: &Context) -> Result<Lamp, LoadError> {
        let position = DVec3::from_array(k.position);
        let has_profile = k.ies.is_some() || k.texture.is_some();
        if !has_profile && (k.direction.is_some() || k.target.is_some()) {
            return Err(c.error(
                "a point shines in all directions: `direction` and `target` go with `ies` or `texture`",
            ));
        }
        let axis = match (k.direction, k.target) {
            (None, None) => Vec3::NEG_Y,
            aims => aim(aims, position, c)?,
        };
        let profile = self.profile(k.ies.as_deref(), k.texture.as_ref(), k.turn, axis, c)?;
        let intensity = intensity(k.color, k.intensity, profile.as_ref(), c)?;
        let kind = LightKind::Point { position: Vec3::ZERO, intensity };
        Ok(Lamp { kind, at: DAffine3::from_translation(position), profile, split: k.split_intensity })
    }

    fn spot(&mut self, k: SpotKeys, c: &Context) -> Result<Lamp, LoadError> {
        let position = DVec3::from_array(k.position);
        let direction = aim((k.direction, k.target), position, c)?;
        let outer = within(k.angle, [0.1, 90.0], "angle", c)?;
        let inner = within(k.inner_angle.unwrap_or(outer * 0.8), [0.0, outer * 0.999], "inner-angle", c)?;
        let profile = self.profile(k.ies.as_deref(), k.texture.as_ref(), k.turn, direction, c)?;
        let kind = LightKind::Spot {
            position: Vec3::ZERO,
            direction,
            intensity: intensity(k.color, k.intensity, profile.as_ref(), c)?,
            inner_angle: inner.to_radians(),
            outer_angle: outer.to_radians(),
        };
        Ok(Lamp { kind, at: DAffine3::from_translation(position), profile, split: k.split_intensity })
    }

    fn projector(&mut self, k: ProjectorKeys, c: &Context) -> Result<Lamp, LoadError> {
        let position = DVec3::from_array(k.position);
        let direction = aim((k.direction, k.target), position, c)?;
        let is_upright = direction.cross(Vec3::Y).length() > 1e-3;
        let up = match k.up {
            Some(up) => self::direction(up.into(), "up", c)?,
            None if is_upright => Vec3::Y,
            None => Vec3::NEG_Z,
        };
        if direction.cross(up).length() <= 1e-3 {
            return Err(c.error("`up` is along the direction in which the projector is aimed"));
        }
        let picture = self.texture(&Some(k.texture), ColorSpace::Srgb, Neutral::White, c)?;
        let kind = LightKind::Projector {
            position: Vec3::ZERO,
            direction,
            up,
            intensity: strength(k.color, k.intensity, "intensity", c)?,
            field_of_view: within(k.field_of_view, [0.1, 170.0], "field-of-view", c)?.to_radians(),
            picture: picture.ok_or_else(|| c.error("the projector needs a `texture`"))?,
        };
        let at = DAffine3::from_translation(position);
        Ok(Lamp { kind, at, profile: None, split: k.split_intensity })
    }

    /// The profile of a photometric file or of a texture graph, aimed along `axis`.
    fn profile(
        &mut self,
        file: Option<&str>,
        texture: Option<&toml::Value>,
        turn: Option<f32>,
        axis: Vec3,
        c: &Context,
    ) -> Result<Option<Photometry>, LoadError> {
        let profile = match (file, texture) {
            (Some(_), Some(_)) => return Err(c.error("`ies` and `texture` exclude each other")),
            (Some(file), None) => self.profile_of_file(file)?,
            (None, Some(texture)) => {
                let graph = self.parse_graph(texture).map_err(|why| c.error(format!("`texture`: {why}")))?;
                Arc::new(graph.light_profile().map_err(|why| c.error(format!("`texture`: {why}")))?)
            }
            (None, None) if turn.is_some() => {
                return Err(c.error("`turn` is about the axis of a profile: it goes with `ies` or `texture`"));
            }
            (None, None) => return Ok(None),
        };
        let turn = within(turn.unwrap_or(0.0), [-360.0, 360.0], "turn", c)?.to_radians();
        Ok(Some(Photometry::aimed(profile, axis, turn)))
    }

    fn profile_of_file(&mut self, file: &str) -> Result<Arc<LightProfile>, LoadError> {
        let path = self.place.folder.join(file);
        if let Some(known) = self.profiles.get(&path) {
            return Ok(known.clone());
        }
        let profile = Arc::new(ies::load(&path, self.options)?);
        self.profiles.insert(path, profile.clone());
        Ok(profile)
    }
}

/// The unit direction of `direction` or towards `target`.
fn aim(aims: (Option<[f32; 3]>, Option<[f64; 3]>), position: DVec3, c: &Context) -> Result<Vec3, LoadError> {
    match aims {
        (Some(d), None) => direction(d.into(), "direction", c),
        (None, Some(target)) => {
            direction((DVec3::from_array(target) - position).as_vec3(), "target − position", c)
        }
        _ => Err(c.error("the light needs one of `direction` and `target`")),
    }
}

/// The intensity that is given, or the profile's: candela count as W/sr.
fn intensity(
    color: Color,
    given: Option<f32>,
    profile: Option<&Photometry>,
    c: &Context,
) -> Result<Vec3, LoadError> {
    let value = given.or(profile.map(|p| p.profile.peak()));
    let value = value.ok_or_else(|| c.error("the light needs an `intensity`"))?;
    strength(color, value, "intensity", c)
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
