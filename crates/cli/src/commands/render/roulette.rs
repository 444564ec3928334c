//! How Russian roulette ends paths.

use super::parsing::parse_share;
use alhazen::PathSettings;
use clap::Args;

/// Options of Russian roulette.
#[derive(Clone, Debug, Args)]
pub struct RouletteArgs {
    /// First path length that Russian roulette may end [default: 5].
    #[arg(long, help_heading = "Light", value_name = "DEPTH")]
    roulette_start: Option<u32>,
    /// Least probability with which a path survives Russian roulette: more keeps noise low, less saves time [default: 0.05].
    #[arg(long, help_heading = "Light", value_name = "PROBABILITY", value_parser = parse_share)]
    roulette_min_survival: Option<f32>,
}

impl RouletteArgs {
    /// The settings with these options.
    pub fn apply(&self, settings: PathSettings) -> PathSettings {
        PathSettings {
            roulette_start: self.roulette_start.unwrap_or(settings.roulette_start),
            roulette_min_survival: self.roulette_min_survival.unwrap_or(settings.roulette_min_survival),
            ..settings
        }
    }
}
