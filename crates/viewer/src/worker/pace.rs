//! How large pictures are and how many samples a pass has, so that passes take the time that they should.

use std::time::Duration;

/// How long a frame of a moving camera should take on the CPU: 30 frames a second.
const CPU_FRAME: Duration = Duration::from_millis(33);
/// The same on a GPU. What the camera does has to wait for the pass before, for its own, and for the window's next frame:
/// together two frames of a display of 60 Hz.
const GPU_FRAME: Duration = Duration::from_millis(12);
/// How long a pass of a resting camera should take: often enough to watch the picture sharpen.
const RESTING_PASS: Duration = Duration::from_millis(120);
/// A picture of a resting camera whose first pass would take longer than this begins with a small one.
const PATIENCE: Duration = Duration::from_millis(200);
/// The smallest pictures have so many pixels: 160 × 90, a third of 480 × 270 along each side. In smaller
/// ones what is a fortieth of the picture has less than four pixels, and neither the denoiser nor a
/// viewer can tell it from noise. Slow machines then show fewer pictures a second.
const LEAST_PIXELS: f32 = 160.0 * 90.0;
/// Before anything is known, pictures have this share of the full width.
const FIRST_SCALE: f32 = 0.25;
/// Weight of the newest measurement.
const NEWEST: f64 = 0.4;

/// What has been measured, and what follows from it.
#[derive(Clone, Debug)]
pub struct Pace {
    /// How long a frame of a moving camera should take.
    frame: Duration,
    /// Samples a second of small pictures with one sample a pixel, conversion to display values included.
    moving: Option<f64>,
    /// Samples a second of full pictures.
    resting: Option<f64>,
    /// Share of the full width that moving pictures have.
    scale: Option<f32>,
}

impl Pace {
    /// Nothing is known yet. `on_gpu`: whether a GPU renders.
    pub fn new(on_gpu: bool) -> Self {
        let frame = if on_gpu { GPU_FRAME } else { CPU_FRAME };
        Self { frame, moving: None, resting: None, scale: None }
    }

    /// Forgets what was measured: another scene.
    pub fn forget(&mut self) {
        *self = Self { moving: None, resting: None, scale: None, ..*self };
    }

    /// Learns from a pass of `samples` samples that took `elapsed`.
    pub fn record(&mut self, preview: bool, samples: u64, elapsed: Duration) {
        let rate = samples as f64 / elapsed.as_secs_f64().max(1e-6);
        let known = if preview { &mut self.moving } else { &mut self.resting };
        *known = Some(known.map_or(rate, |old| old + NEWEST * (rate - old)));
    }

    /// Samples a second of full pictures, once measured.
    pub fn rate(&self) -> Option<f64> {
        self.resting.or(self.moving)
    }

    /// The share of the full width and height, in `(0, 1]`, at which a picture of `pixels` pixels takes a frame's time.
    ///
    /// It follows the measurements only when they differ much from what it was: pictures that change their size all the
    /// time flicker.
    pub fn moving_scale(&mut self, pixels: u64) -> f32 {
        let Some(rate) = self.moving.or(self.resting) else { return FIRST_SCALE };
        let affordable = rate * self.frame.as_secs_f64();
        let least = (LEAST_PIXELS / pixels.max(1) as f32).sqrt().min(1.0);
        let target = ((affordable / pixels.max(1) as f64).sqrt() as f32).clamp(least, 1.0);
        let scale = match self.scale {
            Some(old) if target > old * 0.85 && target < old * 1.2 => old,
            _ => target,
        };
        self.scale = Some(scale);
        scale
    }

    /// Whether a picture of `pixels` pixels should be shown small first.
    pub fn needs_preview(&self, pixels: u64) -> bool {
        let Some(rate) = self.resting.or(self.moving) else { return true };
        pixels as f64 / rate > PATIENCE.as_secs_f64()
    }

    /// Samples per pixel of the next pass of a full picture that has `done` samples already.
    ///
    /// A picture begins with one sample, and passes grow with it: there is less to see in each new sample.
    pub fn samples(&self, pixels: u64, done: u32) -> u32 {
        let affordable =
            self.resting.map_or(1.0, |rate| rate * RESTING_PASS.as_secs_f64() / pixels.max(1) as f64);
        (affordable as u32).clamp(1, done.clamp(1, 64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLION: u64 = 1_000_000;

    #[test]
    fn moving_pictures_take_a_frame() {
        let mut pace = Pace::new(false);
        assert_eq!(pace.moving_scale(MILLION), FIRST_SCALE);
        // Three million samples a second are 99,000 in 33 ms.
        pace.record(true, 300_000, Duration::from_millis(100));
        let scale = pace.moving_scale(MILLION);
        assert!((scale - 0.3146).abs() < 1e-3, "{scale}");
        pace.record(true, 100_000, Duration::from_millis(30));
        assert_eq!(pace.moving_scale(MILLION), scale, "small changes do not show");
        for _ in 0..20 {
            pace.record(true, MILLION * 100, Duration::from_millis(33));
        }
        assert_eq!(pace.moving_scale(MILLION), 1.0);
        for _ in 0..60 {
            pace.record(true, 10, Duration::from_millis(33));
        }
        assert_eq!(pace.moving_scale(MILLION), 0.12, "160 × 90 pixels");
        assert_eq!(Pace { scale: None, ..pace.clone() }.moving_scale(4096), 1.0, "all of a small picture");
        let mut on_gpu = Pace::new(true);
        on_gpu.record(true, 300_000, Duration::from_millis(100));
        // 36,000 samples in 12 ms.
        assert!((on_gpu.moving_scale(MILLION) - 0.1897).abs() < 1e-3);
    }

    #[test]
    fn resting_pictures_begin_with_one_sample_and_grow() {
        let mut pace = Pace::new(false);
        assert!(pace.needs_preview(MILLION), "nothing is known yet");
        pace.record(false, 100 * MILLION, Duration::from_secs(1));
        assert!(!pace.needs_preview(MILLION));
        assert_eq!(pace.samples(MILLION, 0), 1);
        assert_eq!(pace.samples(MILLION, 4), 4);
        assert_eq!(pace.samples(MILLION, 1000), 12, "what 120 ms allow");
        assert_eq!(pace.samples(100 * MILLION, 1000), 1, "at least one");
        assert!(pace.needs_preview(100 * MILLION));
    }
}
