//! What a scene file may say about how it wants to be rendered.

use crate::Shutter;
use serde::{Deserialize, Serialize};

/// How scene-referred radiance becomes display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ToneMapper {
    /// Clip to `[0, 1]` and encode as sRGB.
    #[default]
    Srgb,
    /// Linear values, clipped, not encoded.
    None,
    /// Reinhard: x / (1 + x) on luminance.
    Reinhard,
    /// ACES filmic (Narkowicz fit).
    Aces,
    /// AgX.
    Agx,
    /// Khronos PBR Neutral.
    Neutral,
}

impl ToneMapper {
    /// All of them, the default first.
    pub const ALL: [Self; 6] = [Self::Srgb, Self::None, Self::Reinhard, Self::Aces, Self::Agx, Self::Neutral];
}

/// What happens at the terminator of a mesh with vertex normals, where the light is above the smooth surface that the normals
/// stand for, but below the triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShadowTerminator {
    /// Light is gathered where the smooth surface would be, so that the triangles do not show in their own shadow. Surfaces
    /// that transmit light stay exact.
    #[default]
    Smooth,
    /// Light is gathered on the triangles: what is below them is black.
    Exact,
}

/// Whether something is done that pays in some scenes only: caustics by photons, path guiding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Switch {
    /// It is not.
    #[default]
    Off,
    /// It is.
    On,
    /// It is where that seems to pay; the renderer says what it chose and why.
    Auto,
}

impl Switch {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 3] = [Self::Off, Self::On, Self::Auto];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::On => "on",
            Self::Auto => "auto",
        }
    }
}

impl std::fmt::Display for Switch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Switch {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|switch| switch.name() == name);
        known.ok_or_else(|| format!("unknown `{name}`; there are: {}", Self::ALL.map(Self::name).join(", ")))
    }
}

/// Defaults of one scene; every field may be absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct RenderDefaults {
    /// Width in pixels.
    pub width: Option<u32>,
    /// Height in pixels.
    pub height: Option<u32>,
    /// Samples per pixel.
    pub spp: Option<u32>,
    /// Maximum path depth; 1 = emission only, 2 = direct light.
    pub max_depth: Option<u32>,
    /// Whether caustics come from photons.
    pub caustics: Option<Switch>,
    /// Whether paths follow what was learned of the light.
    pub guiding: Option<Switch>,
    /// Name of the integrator.
    pub integrator: Option<String>,
    /// Factor on radiance before tone mapping.
    pub exposure: Option<f32>,
    /// Tone mapper.
    pub tonemap: Option<ToneMapper>,
    /// Saturation applied after tone mapping; 1 changes nothing.
    pub saturation: Option<f32>,
    /// Whether the backs of single-sided surfaces are left out: no ray of any kind meets them. By default they are drawn and
    /// block light. Bodies of glass keep theirs, and so do surfaces that emit on both sides.
    pub cull_backs: Option<bool>,
    /// What happens where light grazes a mesh with vertex normals.
    pub shadow_terminator: Option<ShadowTerminator>,
    /// When the camera's shutter is open; without it, pictures show instants.
    pub shutter: Option<Shutter>,
}
