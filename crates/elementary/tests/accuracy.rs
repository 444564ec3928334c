//! How far results are from those in `f64`, and what special values yield.
//!
//! Those in `f64` are `libm`'s: C libraries are not all good enough to compare with (Wine's sine of
//! 10³⁰ is none).

use elementary::*;

/// Units in the last place that `x` is from a value known better.
fn units(x: f32, expected: f64) -> f64 {
    let nearest = expected as f32;
    if x == nearest || !nearest.is_finite() {
        assert!(x == nearest, "{x} instead of {expected}");
        return 0.0;
    }
    let unit = f64::from(nearest.abs().max(f32::MIN_POSITIVE).next_up())
        - f64::from(nearest.abs().max(f32::MIN_POSITIVE));
    (f64::from(x) - expected).abs() / unit
}

/// The largest error of `function` over a share of all positive `f32` and their opposites.
fn worst(function: fn(f32) -> f32, exact: fn(f64) -> f64, stride: usize) -> f64 {
    let all = (0..0x7f80_0000u32).step_by(stride).map(f32::from_bits);
    let error = |x: f32| {
        let expected = exact(f64::from(x));
        if expected.is_nan() { 0.0 } else { units(function(x), expected) }
    };
    all.flat_map(|x| [x, -x]).map(error).fold(0.0, f64::max)
}

#[test]
fn errors_are_fractions_of_a_unit_in_the_last_place() {
    // A prime, so that all low bits occur.
    let stride = 1_009;
    for (name, function, exact, bound) in [
        ("exp", exp::<f32> as fn(f32) -> f32, exp as fn(f64) -> f64, 0.51),
        ("exp2", exp2, exp2, 0.51),
        ("log", log, log, 0.51),
        ("log2", log2, log2, 0.51),
        ("log10", log10, log10, 0.51),
        ("sin", sin, sin, 0.51),
        ("cos", cos, cos, 0.51),
        ("tan", tan, tan, 0.81),
        ("asin", asin, asin, 1.0),
        ("acos", acos, acos, 1.0),
        ("atan", atan, atan, 1.0),
        ("cbrt", cbrt, cbrt, 0.51),
    ] {
        let error = worst(function, exact, stride);
        assert!(error < bound, "{name} is off by {error} units in the last place");
    }
}

#[test]
fn errors_of_functions_of_two_numbers_are_small() {
    let numbers = || (0..0x7f80_0000u32).step_by(2_000_003).map(f32::from_bits);
    let (mut powers, mut angles, mut lengths) = (0.0f64, 0.0f64, 0.0f64);
    for x in numbers() {
        for y in numbers().flat_map(|y| [y, -y]) {
            let (a, b) = (f64::from(x), f64::from(y));
            powers = powers.max(units(pow(x, y), pow(a, b)));
            angles = angles.max(units(atan2(x, y), atan2(a, b)));
            lengths = lengths.max(units(hypot(x, y), hypot(a, b)));
        }
        for y in [0.5, 1.0 / 2.4, 2.0, 2.2, 2.4, 5.0, -1.7] {
            powers = powers.max(units(pow(x, y), pow(f64::from(x), f64::from(y))));
        }
    }
    assert!(powers < 0.51 && angles < 1.3 && lengths < 0.51, "{powers} {angles} {lengths}");
}

#[test]
fn powers_of_special_values_are_those_of_ieee_754() {
    let infinity = f32::INFINITY;
    let values = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 1e-40, 16_777_217.0, 1e10, 1e38, infinity, f32::NAN];
    for x in values.into_iter().flat_map(|x| [x, -x]) {
        for y in values.into_iter().flat_map(|y| [y, -y]) {
            let (result, expected) = (pow(x, y), pow(f64::from(x), f64::from(y)) as f32);
            assert!(
                result.to_bits() == expected.to_bits() || result.is_nan() && expected.is_nan(),
                "{x} to the power of {y} is {result} instead of {expected}"
            );
        }
    }
}

#[test]
fn special_values_and_exact_results() {
    assert_eq!((exp(0.0f32), exp(-200.0f32), exp(200.0f32)), (1.0, 0.0, f32::INFINITY));
    assert_eq!((exp(f32::NEG_INFINITY), exp(f32::INFINITY)), (0.0, f32::INFINITY));
    assert!(exp(f32::NAN).is_nan() && exp2(f32::NAN).is_nan() && log(f32::NAN).is_nan());
    assert_eq!((log(0.0f32), log(-0.0f32), log(1.0f32)), (f32::NEG_INFINITY, f32::NEG_INFINITY, 0.0));
    assert!(log(-1.0f32).is_nan() && log2(f32::NEG_INFINITY).is_nan());
    assert_eq!(log10(f32::INFINITY), f32::INFINITY);
    for exponent in -149..128 {
        let power = exp2(exponent as f32);
        assert_eq!(f64::from(power), powi(2f64, exponent));
        assert_eq!(log2(power), exponent as f32);
    }
}

#[test]
fn integer_powers_are_those_of_repeated_multiplication() {
    for x in [0.5f64, -3.0, 1.5] {
        let mut power = 1.0;
        for exponent in 0..20 {
            assert_eq!(powi(x, exponent), power);
            assert_eq!(powi(x, -exponent), 1.0 / power);
            power *= x;
        }
    }
    assert_eq!((powi(2.0f32, -126), powi(2.0f32, i32::MIN)), (f32::MIN_POSITIVE, 0.0));
}
