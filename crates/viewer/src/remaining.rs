//! How long a picture will still take.

use std::time::Duration;

/// How far a picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples per pixel that it has.
    pub spp: u32,
    /// Samples per pixel that it will have.
    pub wanted: u32,
    /// Relative standard error that it has, where it is known.
    pub noise: Option<f64>,
    /// Relative standard error at which it is done.
    pub limit: Option<f32>,
}

impl Progress {
    /// Samples per pixel at which it will be done: noise falls with the root of their number.
    fn end(&self) -> f64 {
        let needed = |noise: f64, limit: f32| f64::from(self.spp) * (noise / f64::from(limit)).powi(2);
        let by_noise =
            self.noise.zip(self.limit).map_or(f64::INFINITY, |(noise, limit)| needed(noise, limit));
        by_noise.min(f64::from(self.wanted))
    }

    /// The share that is done, in `[0, 1]`.
    pub fn share(&self) -> f32 {
        (f64::from(self.spp) / self.end().max(1.0)).clamp(0.0, 1.0) as f32
    }

    /// The time that is left after `spent` on what there is; `None` before anything is done.
    pub fn left(&self, spent: Duration) -> Option<Duration> {
        if self.spp == 0 {
            return None;
        }
        let more = (self.end() / f64::from(self.spp) - 1.0).max(0.0);
        Duration::try_from_secs_f64(spent.as_secs_f64() * more).ok()
    }
}

/// A duration as people say it: `8 s`, `3 min 20 s`, `2 h 05 min`.
pub fn in_words(duration: Duration) -> String {
    let seconds = duration.as_secs_f64().round() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_that_of_samples_or_of_noise() {
        let spent = Duration::from_secs(10);
        let progress = Progress { spp: 25, wanted: 100, noise: None, limit: Some(0.01) };
        assert_eq!((progress.share(), progress.left(spent)), (0.25, Some(Duration::from_secs(30))));
        // Half of the noise takes four times as many samples; the number is reached sooner.
        let noisy = Progress { noise: Some(0.02), ..progress };
        assert_eq!(noisy.left(spent), Some(Duration::from_secs(30)));
        let fair = Progress { noise: Some(0.01 * 2f64.sqrt()), limit: Some(0.01), ..progress };
        let left = fair.left(spent).expect("something is done").as_secs_f64();
        assert!((left - 10.0).abs() < 0.1, "{left}");
        let done = Progress { noise: Some(0.005), ..progress };
        assert_eq!((done.share(), done.left(spent)), (1.0, Some(Duration::ZERO)));
        assert_eq!(Progress { spp: 0, ..progress }.left(spent), None);
    }

    #[test]
    fn durations_are_said_in_two_units_at_most() {
        let words = |seconds: u64| in_words(Duration::from_secs(seconds));
        assert_eq!([words(8), words(200), words(7500)], ["8 s", "3 min 20 s", "2 h 05 min"]);
    }
}
