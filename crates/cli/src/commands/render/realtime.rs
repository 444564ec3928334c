//! What `alhazen render` may say about `--integrator realtime`.

use super::parsing::{parse_cosine, parse_not_negative, parse_positive};
use super::roulette::RouletteArgs;
use alhazen::{
    AllocationSettings, FrameSamples, FrameView, HistorySettings, PathSettings, RealtimeSettings,
    SpatialFilter, Visibility,
};
use clap::Args;
use std::time::Duration;

/// Settings of the integrator `realtime`.
#[derive(Debug, Clone, Args)]
pub struct FrameSettings {
    /// `realtime`: samples of a pixel in a frame: a number, or MIN..MAX where it is noisy and none elsewhere [default: 1, or
    /// 4..16 with a budget].
    #[arg(long, help_heading = "Real time", value_name = "N|MIN..MAX")]
    frame_samples: Option<FrameSamples>,
    /// `realtime`: time that a frame may take on the GPU, such as 8ms: how many samples there are follows from it.
    #[arg(long, help_heading = "Real time", value_name = "TIME", value_parser = parse_budget)]
    budget: Option<Duration>,
    /// `realtime`: lights that a first surface looks at before it asks for one of them; tiles of 8 x 8 pixels choose them together.
    /// 0: it chooses one light by itself, as `path` does.
    #[arg(long, help_heading = "Real time", value_name = "N", default_value_t = RealtimeSettings::default().light_candidates, value_parser = clap::value_parser!(u32).range(0..=i64::from(RealtimeSettings::MOST_LIGHT_CANDIDATES)))]
    light_candidates: u32,
    /// `realtime`: variance of a pixel's mean, as it is seen, under which it gets no samples.
    #[arg(long, help_heading = "Real time", value_name = "VARIANCE", default_value_t = AllocationSettings::default().tolerance, value_parser = parse_positive)]
    frame_tolerance: f32,
    /// `realtime`: pixels around a pixel that tell its noise.
    #[arg(long, help_heading = "Real time", value_name = "PIXELS", default_value_t = AllocationSettings::default().noise_radius, value_parser = clap::value_parser!(u32).range(0..=8))]
    noise_radius: u32,
    /// `realtime`: pixels over which the map of the noise is spread.
    #[arg(long, help_heading = "Real time", value_name = "PIXELS", default_value_t = AllocationSettings::default().blur_radius, value_parser = clap::value_parser!(u32).range(0..=8))]
    blur_radius: u32,
    /// `realtime`: calm pixels get a sample in one of so many frames; 0: never, which is biased.
    #[arg(long, help_heading = "Real time", value_name = "FRAMES", default_value_t = AllocationSettings::default().refresh)]
    refresh: u32,
    /// `realtime`: how far distances of the same surface may differ from frame to frame, in tenths of the distance.
    #[arg(long, help_heading = "Real time", value_name = "TENTHS", default_value_t = HistorySettings::default().depth_tolerance, value_parser = parse_positive)]
    depth_tolerance: f32,
    /// `realtime`: least cosine between normals of the same surface from frame to frame.
    #[arg(long, help_heading = "Real time", value_name = "COSINE", default_value_t = HistorySettings::default().normal_tolerance, value_parser = parse_cosine)]
    normal_tolerance: f32,
    /// `realtime`: samples that earlier frames count for at most while anything moves; 0 forgets them.
    #[arg(long, help_heading = "Real time", value_name = "SAMPLES", default_value_t = HistorySettings::default().most, value_parser = parse_not_negative)]
    history: f32,
    /// `realtime`: standard deviations of the samples around a pixel that its past may be away from them while anything moves.
    #[arg(long, help_heading = "Real time", value_name = "DEVIATIONS", default_value_t = HistorySettings::default().clip, value_parser = parse_positive)]
    history_clip: f32,
    /// `realtime`: no filter: frames are their own samples, and the mean of many is what `path` shows.
    #[arg(long, help_heading = "Real time")]
    no_filter: bool,
    /// `realtime`: what filters frames: edges (averages of neighbours on the same surface) or learned (the network of --denoise).
    #[arg(long, help_heading = "Real time", value_name = "NAME", default_value_t = SpatialFilter::Edges, conflicts_with = "no_filter")]
    filter: SpatialFilter,
    /// `realtime`: passes of the filter `edges`, each twice as wide as the one before.
    #[arg(long, help_heading = "Real time", value_name = "N", default_value_t = RealtimeSettings::default().filter_passes, value_parser = clap::value_parser!(u32).range(0..=8))]
    filter_passes: u32,
    /// `realtime`: what frames show: picture, variance, history, noise, blurred-noise, mask, samples, diffuse or specular.
    #[arg(long, help_heading = "Real time", value_name = "VIEW", default_value_t = FrameView::Picture)]
    show: FrameView,
}

impl FrameSettings {
    /// The settings, with paths that are at most `max_depth` segments long.
    pub fn settings(
        &self,
        max_depth: Option<u32>,
        roulette: &RouletteArgs,
        visibility: Visibility,
    ) -> RealtimeSettings {
        let d = RealtimeSettings::default();
        let of_budget = if self.budget.is_some() { FrameSamples::ADAPTIVE } else { d.samples };
        RealtimeSettings {
            path: roulette.apply(PathSettings { max_depth: max_depth.unwrap_or(d.path.max_depth), ..d.path }),
            visibility,
            samples: self.frame_samples.unwrap_or(of_budget),
            allocation: AllocationSettings {
                tolerance: self.frame_tolerance,
                noise_radius: self.noise_radius,
                blur_radius: self.blur_radius,
                refresh: self.refresh,
                ..d.allocation
            },
            budget: self.budget,
            light_candidates: self.light_candidates,
            history: HistorySettings {
                depth_tolerance: self.depth_tolerance,
                normal_tolerance: self.normal_tolerance,
                most: self.history,
                clip: self.history_clip,
            },
            filter: !self.no_filter,
            spatial: self.filter,
            filter_passes: self.filter_passes,
            show: self.show,
        }
    }
}

/// A time such as `8ms`, `0.5s` or, in milliseconds, `8`.
fn parse_budget(text: &str) -> Result<Duration, String> {
    let (number, scale) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1e-3),
        (None, Some(number)) => (number, 1.0),
        (None, None) => (text, 1e-3),
    };
    let seconds = number.trim().parse::<f64>().map(|n| n * scale);
    match seconds {
        Ok(s) if s > 0.0 && s <= 3600.0 => Ok(Duration::from_secs_f64(s)),
        _ => Err("not a time such as 8ms".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_are_times() {
        for (text, ms) in [("8ms", 8.0), ("0.5s", 500.0), ("16", 16.0), ("16.6 ms", 16.6)] {
            assert_eq!(parse_budget(text), Ok(Duration::from_secs_f64(ms * 1e-3)), "{text}");
        }
        for text in ["", "ms", "-1ms", "0", "fast", "1e9s", "nan"] {
            assert!(parse_budget(text).is_err(), "{text}");
        }
    }
}
