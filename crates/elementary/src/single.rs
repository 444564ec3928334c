//! Exponentials, logarithms and powers of `f32`, computed in `f64` and rounded once.
//!
//! Method: tables and short polynomials, as in Arm's Optimized Routines and glibc's `expf`, `logf`
//! and `powf`. Intermediate results are good to 2⁻³² of the result or better, so all but one
//! result in a hundred are the nearest `f32`, and the error is below 0.51 units in the last place.
//! Products and sums are rounded one by one: fused ones would be slow where processors lack them.

use std::f64::consts::{LN_2, LOG2_E};

/// How many steps of [`EXP2`] double a power.
const STEPS: f64 = 32.0;

/// The bits of 2^(i / 32), less those that `i << 47` adds: adding `k << 47` to the entry of
/// `k mod 32` gives the bits of 2^(k / 32).
const EXP2: [u64; 32] = [
    0x3ff0_0000_0000_0000,
    0x3fef_d9b0_d315_8574,
    0x3fef_b558_6cf9_890f,
    0x3fef_9301_d012_5b51,
    0x3fef_72b8_3c7d_517b,
    0x3fef_5487_3168_b9aa,
    0x3fef_387a_6e75_6238,
    0x3fef_1e9d_f51f_dee1,
    0x3fef_06fe_0a31_b715,
    0x3fee_f1a7_373a_a9cb,
    0x3fee_dea6_4c12_3422,
    0x3fee_ce08_6061_892d,
    0x3fee_bfda_d536_2a27,
    0x3fee_b42b_569d_4f82,
    0x3fee_ab07_dd48_5429,
    0x3fee_a47e_b03a_5585,
    0x3fee_a09e_667f_3bcd,
    0x3fee_9f75_e8ec_5f74,
    0x3fee_a114_73eb_0187,
    0x3fee_a589_994c_ce13,
    0x3fee_ace5_422a_a0db,
    0x3fee_b737_b0cd_c5e5,
    0x3fee_c491_82a3_f090,
    0x3fee_d503_b23e_255d,
    0x3fee_e89f_995a_d3ad,
    0x3fee_ff76_f2fb_5e47,
    0x3fef_199b_dd85_529c,
    0x3fef_3720_dcef_9069,
    0x3fef_5818_dcfb_a487,
    0x3fef_7c97_337b_9b5f,
    0x3fef_a4af_a2a4_90da,
    0x3fef_d076_5b6e_4540,
];

/// (2^(r / 32) − 1) / r, for r within ±½, to a relative error of 2^(r / 32) of 2⁻³²·⁶: coefficients
/// of 1, r and r², by interpolation at Chebyshev's nodes.
const EXP2_POLYNOMIAL: [f64; 3] = [0.02166084939249829, 0.00023459791806279678, 1.6938584231590093e-06];

/// The smallest significand that [`LOG2`] is for is that of 0.69921875, so that 1 lies amid a step.
const SMALLEST: u64 = 0x3fe6_6000_0000_0000;

/// For each sixteenth of the significands: 1 / c for a number c in the middle, and log₂ c.
const LOG2: [[f64; 2]; 16] = [
    [1.3989071038251366, -0.4843001617159575],
    [1.3403141361256545, -0.4225711719642514],
    [1.2864321608040201, -0.3633753794563512],
    [1.2367149758454106, -0.3065130425006747],
    [1.1906976744186046, -0.2518071504105397],
    [1.147982062780269, -0.19910010007969525],
    [1.1082251082251082, -0.14825095858394247],
    [1.0711297071129706, -0.09913319201925132],
    [1.0364372469635628, -0.05163276841532236],
    [1.0, 0.0],
    [0.9481481481481482, 0.07681559705083084],
    [0.8951048951048951, 0.1598713367783894],
    [0.847682119205298, 0.2384047393250789],
    [0.8050314465408805, 0.3128829552843553],
    [0.7664670658682635, 0.38370429247405213],
    [0.7314285714285714, 0.4512111118323288],
];

/// (log(1 + r) − r) / r² over log 2, for |r| < 0.0297, to a relative error of the logarithm of
/// 2⁻⁴³: coefficients of 1, r … r⁵, by interpolation at Chebyshev's nodes.
const LOG_POLYNOMIAL: [f64; 6] = [
    -0.721347520448299,
    0.480898346966381,
    -0.36067368195992633,
    0.2885389386096864,
    -0.24068684192562564,
    0.20631055619026684,
];

/// 2 to the power of `steps` / 32. What `f32` cannot hold anyway may be less than it should be.
#[inline(always)]
fn exp2_steps(steps: f64) -> f64 {
    // Adding 1.5·2⁵² rounds to an integer, whose bits are then the last ones of the sum.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let steps = steps.clamp(-160.0 * STEPS, 160.0 * STEPS);
    let shifted = steps + ROUND;
    let r = steps - (shifted - ROUND);
    let k = shifted.to_bits();
    let scale = f64::from_bits(EXP2[(k % 32) as usize].wrapping_add(k << 47));
    let [c0, c1, c2] = EXP2_POLYNOMIAL;
    scale + scale * (r * (c0 + r * c1 + r * r * c2))
}

/// The logarithm of a finite `x` > 0 to the base 2.
#[inline(always)]
fn log2_positive(x: f32) -> f64 {
    // As an `f64` no `f32` is subnormal.
    let bits = f64::from(x).to_bits();
    let above = bits.wrapping_sub(SMALLEST);
    let exponent = above.cast_signed() >> 52;
    let significand = f64::from_bits(bits.wrapping_sub(above & 0xfff << 52));
    let [inverse, logarithm] = LOG2[(above >> 48) as usize % 16];
    let r = significand * inverse - 1.0;
    let [c0, c1, c2, c3, c4, c5] = LOG_POLYNOMIAL;
    let r2 = r * r;
    let series = (c0 + r * c1) + r2 * ((c2 + r * c3) + r2 * (c4 + r * c5));
    (exponent as f64 + logarithm) + (r * LOG2_E + r2 * series)
}

/// What a logarithm is where it is not that of a positive finite number.
#[cold]
fn log_special(x: f32) -> f32 {
    if x == 0.0 {
        f32::NEG_INFINITY
    } else if x < 0.0 {
        f32::NAN
    } else {
        x
    }
}

/// Whether `x` is positive and finite.
#[inline(always)]
fn is_ordinary(x: f32) -> bool {
    x > 0.0 && x < f32::INFINITY
}

/// See [`exp`](crate::exp).
#[inline]
pub fn exp(x: f32) -> f32 {
    exp2_steps(f64::from(x) * (LOG2_E * STEPS)) as f32
}

/// See [`exp2`](crate::exp2).
#[inline]
pub fn exp2(x: f32) -> f32 {
    exp2_steps(f64::from(x) * STEPS) as f32
}

/// See [`log`](crate::log).
#[inline]
pub fn log(x: f32) -> f32 {
    if is_ordinary(x) { (log2_positive(x) * LN_2) as f32 } else { log_special(x) }
}

/// See [`log2`](crate::log2).
#[inline]
pub fn log2(x: f32) -> f32 {
    if is_ordinary(x) { log2_positive(x) as f32 } else { log_special(x) }
}

/// See [`log10`](crate::log10).
#[inline]
pub fn log10(x: f32) -> f32 {
    if is_ordinary(x) { (log2_positive(x) * std::f64::consts::LOG10_2) as f32 } else { log_special(x) }
}

/// See [`pow`](crate::pow).
#[inline]
pub fn pow(x: f32, y: f32) -> f32 {
    if is_ordinary(x) && y.abs() < f32::INFINITY {
        exp2_steps(log2_positive(x) * f64::from(y) * STEPS) as f32
    } else {
        pow_special(x, y)
    }
}

/// See [`hypot`](crate::hypot).
#[inline]
pub fn hypot(x: f32, y: f32) -> f32 {
    // The squares are exact, and neither they nor their sum leave the range of `f64`.
    let length = (f64::from(x) * f64::from(x) + f64::from(y) * f64::from(y)).sqrt() as f32;
    if x.is_infinite() || y.is_infinite() { f32::INFINITY } else { length }
}

/// A power of zero, of a negative or infinite number, or with an exponent that is infinite, as IEEE
/// 754 (9.2.1) has it.
#[cold]
fn pow_special(x: f32, y: f32) -> f32 {
    if y == 0.0 || x == 1.0 {
        return 1.0;
    }
    if x.is_nan() || y.is_nan() {
        return f32::NAN;
    }
    let size = x.abs();
    if y.is_infinite() {
        let grows = (size > 1.0) == (y > 0.0);
        return if size == 1.0 {
            1.0
        } else if grows {
            f32::INFINITY
        } else {
            0.0
        };
    }
    let integer = y.trunc() == y;
    // Beyond 2²⁴ all are even.
    let odd = integer && (y * 0.5).trunc() * 2.0 != y;
    let power = if size == 0.0 {
        if y > 0.0 { 0.0 } else { f32::INFINITY }
    } else if size.is_infinite() {
        if y > 0.0 { f32::INFINITY } else { 0.0 }
    } else if x < 0.0 && !integer {
        return f32::NAN;
    } else {
        pow(size, y)
    };
    if odd { power.copysign(x) } else { power }
}
