//! `medium` of materials and `[fog]`: what is between surfaces.

use super::Builder;
use super::document::{Context, Entry};
use super::materials::MaterialKeys;
use super::values::{Color, within};
use crate::load::LoadError;
use crate::{Fog, Material, Medium, Model};
use glam::Vec3;
use serde::Deserialize;

/// What a medium consists of.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub(super) struct MediumKeys {
    /// m⁻¹.
    absorption: Option<Color>,
    /// m⁻¹.
    scattering: Option<Color>,
    /// W·sr⁻¹·m⁻³.
    emission: Option<Color>,
    anisotropy: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct FogKeys {
    absorption: Option<Color>,
    scattering: Option<Color>,
    emission: Option<Color>,
    anisotropy: Option<f32>,
    /// Metres.
    top: Option<f32>,
}

impl MediumKeys {
    fn medium(&self, what: &str, c: &Context) -> Result<Medium, LoadError> {
        let color = |color: Option<Color>, key: &str| {
            let color = color.map_or(Vec3::ZERO, |c| c.0);
            within(color.max_element(), [0.0, 1e9], &format!("{what}{key}"), c)?;
            Ok::<_, LoadError>(color)
        };
        let most = Medium::MOST_ANISOTROPIC;
        let anisotropy = self.anisotropy.unwrap_or(0.0);
        Ok(Medium {
            absorption: color(self.absorption, "absorption")?,
            scattering: color(self.scattering, "scattering")?,
            emission: color(self.emission, "emission")?,
            anisotropy: within(anisotropy, [-most, most], &format!("{what}anisotropy"), c)?,
        })
    }
}

/// The medium of a material, and its priority.
pub(super) fn apply_medium(k: &MaterialKeys, m: &mut Material, c: &Context) -> Result<(), LoadError> {
    if let Some(keys) = &k.medium {
        m.medium = Some(keys.medium("medium.", c)?);
    }
    if m.medium.is_some() && !m.refracts_into_body() {
        return Err(c.error(
            "`medium` needs a surface that light gets through: `model = \"boundary\"`, a dielectric or `transmission`, \
             not `thin-walled`",
        ));
    }
    m.priority = k.priority.map(|p| within(p, [-1000, 1000], "priority", c)).transpose()?;
    if m.priority.is_some() && !m.refracts_into_body() {
        return Err(c.error(
            "`priority` is one of bodies that light gets into: dielectrics, `transmission`, boundaries",
        ));
    }
    if m.model == Model::Boundary && k.alpha_mode.is_some() {
        return Err(c.error("`alpha-mode` has no meaning for a boundary, which is no surface"));
    }
    Ok(())
}

impl Builder<'_> {
    /// `[fog]`.
    pub(super) fn set_fog(&mut self, entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let FogKeys { absorption, scattering, emission, anisotropy, top } = entry.read()?;
        let keys = MediumKeys { absorption, scattering, emission, anisotropy };
        let medium = keys.medium("", &context)?;
        // Along a horizontal ray, fog with a top is as endless as fog without.
        let clear = medium.absorption + medium.scattering;
        let endless = |emission: f32, extinction: f32| emission > 0.0 && extinction <= 0.0;
        if (0..3).any(|i| endless(medium.emission[i], clear[i])) {
            return Err(
                context.error("fog that shines must absorb or scatter as well, or it is infinitely bright")
            );
        }
        self.scene.fog = Some(Fog { medium, top: top.unwrap_or(f32::INFINITY) });
        Ok(())
    }
}
