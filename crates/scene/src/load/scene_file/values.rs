//! Small values that several sections share: colours, rotations, scales, angles.

use super::document::Context;
use crate::load::LoadError;
use glam::{DAffine3, DQuat, DVec3, EulerRot, Vec3};
use optics::tonemap::srgb_decode_channel;
use serde::Deserialize;

/// The line of a byte position, counted from 1.
pub(super) fn line_of(text: &str, position: usize) -> usize {
    1 + text.as_bytes().iter().take(position).filter(|b| **b == b'\n').count()
}

/// A colour: linear, or encoded as sRGB in hexadecimal.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawColor")]
pub(super) struct Color(pub Vec3);

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a colour: [r, g, b] (linear), \"#rrggbb\" (sRGB) or one number (grey)"
)]
enum RawColor {
    Grey(f32),
    Linear([f32; 3]),
    Hex(String),
}

impl TryFrom<RawColor> for Color {
    type Error = String;

    fn try_from(raw: RawColor) -> Result<Self, String> {
        let color = match raw {
            RawColor::Grey(v) => Vec3::splat(v),
            RawColor::Linear(rgb) => Vec3::from_array(rgb),
            RawColor::Hex(text) => {
                hex(&text).ok_or_else(|| format!("`{text}` is not a colour like \"#rrggbb\""))?
            }
        };
        if color.min_element() < 0.0 {
            return Err(format!("a colour must not be negative, {color} is"));
        }
        Ok(Self(color))
    }
}

fn hex(text: &str) -> Option<Vec3> {
    let digits =
        text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let number = u32::from_str_radix(digits, 16).ok()?;
    let linear = |shift: u32| srgb_decode_channel((number >> shift & 255) as f32 / 255.0);
    Some(Vec3::new(linear(16), linear(8), linear(0)))
}

/// A rotation in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a rotation: [x, y, z] in degrees or { axis = [x, y, z], angle = degrees }"
)]
pub(super) enum Rotation {
    /// About x, then y, then z (fixed axes).
    Euler([f64; 3]),
    /// About an axis.
    Axis(AxisAngle),
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisAngle {
    axis: [f64; 3],
    angle: f64,
}

impl Rotation {
    /// As a quaternion; fails if the axis is zero.
    pub fn quat(&self, context: &Context) -> Result<DQuat, LoadError> {
        match self {
            Rotation::Euler(angles) => {
                let [x, y, z] = angles.map(f64::to_radians);
                Ok(DQuat::from_euler(EulerRot::ZYX, z, y, x))
            }
            Rotation::Axis(a) => {
                let axis = DVec3::from_array(a.axis);
                direction(axis.as_vec3(), "rotate.axis", context)?;
                Ok(DQuat::from_axis_angle(axis.normalize(), a.angle.to_radians()))
            }
        }
    }
}

/// One factor or one for each axis.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected a scale: one number or [x, y, z]")]
pub(super) enum Scale {
    /// The same along all axes.
    Uniform(f64),
    /// Along each axis.
    Axes([f64; 3]),
}

impl Scale {
    /// The three factors; fails if one is 0.
    pub fn vec(&self, context: &Context) -> Result<DVec3, LoadError> {
        let scale = match *self {
            Scale::Uniform(s) => DVec3::splat(s),
            Scale::Axes(s) => DVec3::from_array(s),
        };
        if scale.abs().min_element() < 1e-9 {
            return Err(context.error(format!("`scale` must not be 0, it is {scale}")));
        }
        Ok(scale)
    }
}

/// Translation, rotation and scale; scale first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
pub(super) struct Transform {
    pub translate: Option<Vec3Value>,
    pub rotate: Option<Rotation>,
    pub scale: Option<Scale>,
}

/// Three numbers.
pub(super) type Vec3Value = [f64; 3];

impl Transform {
    /// The matrix.
    pub fn matrix(&self, context: &Context) -> Result<DAffine3, LoadError> {
        let scale = self.scale.map_or(Ok(DVec3::ONE), |s| s.vec(context))?;
        let rotation = self.rotate.map_or(Ok(DQuat::IDENTITY), |r| r.quat(context))?;
        let translation = DVec3::from_array(self.translate.unwrap_or_default());
        Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
    }
}

/// The unit vector along `v`; fails if it is zero.
pub(super) fn direction(v: Vec3, key: &str, context: &Context) -> Result<Vec3, LoadError> {
    v.try_normalize().ok_or_else(|| context.error(format!("`{key}` must not be zero, it is {v}")))
}

/// The value, if it is within the limits (both included).
pub(super) fn within<T: PartialOrd + std::fmt::Display>(
    value: T,
    [low, high]: [T; 2],
    key: &str,
    context: &Context,
) -> Result<T, LoadError> {
    if value >= low && value <= high {
        return Ok(value);
    }
    Err(context.error(format!("`{key}` must be between {low} and {high}, it is {value}")))
}

/// The value, if it is more than 0.
pub(super) fn positive(value: f32, key: &str, context: &Context) -> Result<f32, LoadError> {
    if value > 0.0 {
        return Ok(value);
    }
    Err(context.error(format!("`{key}` must be positive, it is {value}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_linear_unless_hexadecimal() {
        assert_eq!(hex("#ffffff"), Some(Vec3::ONE));
        let grey = hex("#808080").expect("a colour").x;
        assert!((grey - 0.2158605).abs() < 1e-5, "{grey}");
        for wrong in ["#fff", "ffffff", "#gggggg", "#12345é", ""] {
            assert_eq!(hex(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn lines_are_counted_from_one() {
        assert_eq!((line_of("a\nb", 0), line_of("a\nb", 2), line_of("", 9)), (1, 2, 1));
    }
}
