//! How a picture is shown: arguments that several commands share.

use super::render::parsing::{parse_not_negative, parse_positive};
use alhazen::{ToneMapper, ToneMapping};
use clap::ValueEnum;

/// Changes to a picture's own tone mapping.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ToneArgs {
    /// Factor on radiance before tone mapping.
    #[arg(long, help_heading = "Display", value_parser = parse_positive)]
    exposure: Option<f32>,
    /// Curve from radiance to display.
    #[arg(long, help_heading = "Display", value_enum)]
    tonemap: Option<ToneMapName>,
    /// Saturation after the curve; 1 changes nothing.
    #[arg(long, help_heading = "Display", value_parser = parse_not_negative)]
    saturation: Option<f32>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ToneMapName {
    /// Clip and encode as sRGB.
    Srgb,
    /// Clip.
    None,
    /// Reinhard.
    Reinhard,
    /// ACES (Narkowicz).
    Aces,
    /// AgX.
    Agx,
    /// Khronos PBR Neutral.
    Neutral,
}

impl ToneArgs {
    /// The factor on radiance, where one is given.
    pub fn exposure(&self) -> Option<f32> {
        self.exposure
    }

    /// Makes the changes.
    pub fn apply(&self, tone: &mut ToneMapping) {
        tone.exposure = self.exposure.unwrap_or(tone.exposure);
        tone.saturation = self.saturation.unwrap_or(tone.saturation);
        if let Some(mapper) = self.tonemap {
            tone.mapper = match mapper {
                ToneMapName::Srgb => ToneMapper::Srgb,
                ToneMapName::None => ToneMapper::None,
                ToneMapName::Reinhard => ToneMapper::Reinhard,
                ToneMapName::Aces => ToneMapper::Aces,
                ToneMapName::Agx => ToneMapper::Agx,
                ToneMapName::Neutral => ToneMapper::Neutral,
            };
            // A scene's saturation belongs to its own curve.
            tone.saturation = self.saturation.unwrap_or(1.0);
        }
    }
}
