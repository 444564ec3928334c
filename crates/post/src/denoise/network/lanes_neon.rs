//! [`Lanes`] of NEON.

use super::{Lanes, Sixteen, Stage};
use std::arch::aarch64::*;
use std::arch::is_aarch64_feature_detected;

/// Proof that the processor has NEON.
#[derive(Clone, Copy)]
pub struct Neon(());

/// Applies an operation to each of the four registers.
macro_rules! each {
    ($operation:ident($($operand:expr),+)) => {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            [
                $operation($($operand[0]),+),
                $operation($($operand[1]),+),
                $operation($($operand[2]),+),
                $operation($($operand[3]),+),
            ]
        }
    };
}

impl Neon {
    /// If the processor has it.
    pub fn detect() -> Option<Self> {
        is_aarch64_feature_detected!("neon").then_some(Self(()))
    }

    /// Runs a stage with 24 of the 32 registers as accumulators.
    pub fn run(self, stage: impl Stage) {
        #[target_feature(enable = "neon")]
        fn run(lanes: Neon, stage: impl Stage) {
            stage.run::<Neon, 6>(lanes);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { run(self, stage) }
    }
}

impl Lanes for Neon {
    type V = [float32x4_t; 4];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::V {
        self.halves(value, value)
    }

    #[inline(always)]
    fn halves(self, low: f32, high: f32) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        let [low, high] = unsafe { [vdupq_n_f32(low), vdupq_n_f32(high)] };
        [low, low, high, high]
    }

    #[inline(always)]
    fn load(self, from: &Sixteen) -> Self::V {
        let from = from.as_ptr();
        // SAFETY: `self` proves that the instructions exist; sixteen numbers are four registers.
        unsafe { [vld1q_f32(from), vld1q_f32(from.add(4)), vld1q_f32(from.add(8)), vld1q_f32(from.add(12))] }
    }

    #[inline(always)]
    fn store(self, value: Self::V, to: &mut Sixteen) {
        let to = to.as_mut_ptr();
        for (i, register) in value.into_iter().enumerate() {
            // SAFETY: `self` proves that the instructions exist; sixteen numbers are four
            // registers.
            unsafe { vst1q_f32(to.add(4 * i), register) }
        }
    }

    #[inline(always)]
    fn add(self, a: Self::V, b: Self::V) -> Self::V {
        each!(vaddq_f32(a, b))
    }

    #[inline(always)]
    fn mul(self, a: Self::V, b: Self::V) -> Self::V {
        each!(vmulq_f32(a, b))
    }

    #[inline(always)]
    fn max(self, a: Self::V, b: Self::V) -> Self::V {
        each!(vmaxq_f32(a, b))
    }

    #[inline(always)]
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        each!(vfmaq_f32(c, a, b))
    }

    #[inline(always)]
    fn power_of_two(self, rounded: Self::V) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let one = vreinterpretq_u32_f32(vdupq_n_f32(1.0));
            rounded.map(|v| {
                let exponent = vshlq_n_u32::<23>(vreinterpretq_u32_f32(v));
                vreinterpretq_f32_u32(vaddq_u32(exponent, one))
            })
        }
    }
}
