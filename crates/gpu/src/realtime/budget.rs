//! How many samples a frame can afford: from what frames before took on the device.

use std::time::Duration;

/// Finds the number of samples with which frames take as long as they may.
///
/// A frame's time is taken for a part that is always there and one that grows with the samples; both are learned from the
/// frames' own times. Where the model is wrong, the next frames correct it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BudgetController {
    /// Seconds of everything but samples.
    fixed: Option<f64>,
    /// Seconds of a sample.
    per_sample: Option<f64>,
}

/// How far one frame may move what is believed.
const TRUST: f64 = 0.2;
/// The same where samples have taken less than this share of what was thought: perhaps there were fewer than could be afforded.
const FEW: (f64, f64) = (0.7, 0.02);
/// Share of the budget that is planned with: frames vary.
const PLANNED: f64 = 0.95;

impl BudgetController {
    /// Learns from a frame: its time for samples, its time for all else, and how many samples it had at most.
    pub fn learn(&mut self, sampling: Duration, other: Duration, samples: u64) {
        let blend =
            |old: Option<f64>, new: f64, trust: f64| Some(old.map_or(new, |old| old + trust * (new - old)));
        self.fixed = blend(self.fixed, other.as_secs_f64(), TRUST);
        if samples > 0 {
            let measured = sampling.as_secs_f64() / samples as f64;
            let is_less = self.per_sample.is_some_and(|believed| measured < FEW.0 * believed);
            self.per_sample = blend(self.per_sample, measured, if is_less { FEW.1 } else { TRUST });
        }
    }

    /// Samples of the next frame that fit into `budget`, at least `least`. `least` before anything was learned.
    pub fn affordable(&self, budget: Duration, least: u32) -> u32 {
        let (Some(fixed), Some(per_sample)) = (self.fixed, self.per_sample) else { return least };
        let left = (PLANNED * budget.as_secs_f64() - fixed).max(0.0);
        let samples = left / per_sample.max(1e-15);
        (samples.min(f64::from(u32::MAX)) as u32).max(least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device whose frames take 2 ms and 1 ns a sample, give or take a tenth.
    fn frame(samples: u32, number: u32) -> (Duration, Duration) {
        let wobble = 1.0 + 0.1 * f64::from((number * 7) % 11).mul_add(0.2, -1.0);
        (Duration::from_secs_f64(1e-9 * f64::from(samples) * wobble), Duration::from_secs_f64(2e-3 * wobble))
    }

    #[test]
    fn frames_come_to_take_what_they_may() {
        for budget in [4, 8, 16].map(Duration::from_millis) {
            let mut controller = BudgetController::default();
            let mut times = Vec::new();
            for number in 0..100 {
                let samples = controller.affordable(budget, 10_000);
                let (sampling, other) = frame(samples, number);
                times.push((sampling + other).as_secs_f64());
                controller.learn(sampling, other, u64::from(samples));
            }
            let late = &times[20..];
            let mean = late.iter().sum::<f64>() / late.len() as f64;
            let share = mean / budget.as_secs_f64();
            assert!((0.85..1.0).contains(&share), "{share} of {budget:?}");
        }
    }

    /// A budget that is too small for anything leaves the least, and what costs nothing needs no division by zero.
    #[test]
    fn there_are_always_some_samples() {
        let mut controller = BudgetController::default();
        assert_eq!(controller.affordable(Duration::from_millis(8), 7), 7);
        controller.learn(Duration::from_millis(1), Duration::from_millis(20), 1000);
        assert_eq!(controller.affordable(Duration::from_millis(8), 7), 7);
        let mut free = BudgetController::default();
        free.learn(Duration::ZERO, Duration::ZERO, 0);
        free.learn(Duration::ZERO, Duration::ZERO, 10);
        assert!(free.affordable(Duration::from_millis(8), 7) > 1_000_000);
    }
}
