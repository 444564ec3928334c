//! The few special functions that statistics need.

use std::f64::consts::PI;

/// The quantile of the standard normal distribution: the `z` below which a share `p` of it lies.
///
/// - `p`: in `(0, 1)`; zero and one give infinities, anything else NaN.
///
/// Relative error about 1e-16. Method: Wichura, "Algorithm AS 241: The Percentage Points of the Normal
/// Distribution", Applied Statistics 37(3), 1988 (PPND16).
#[must_use]
#[expect(clippy::excessive_precision, reason = "the digits are as published")]
pub fn normal_quantile(p: f64) -> f64 {
    const A: [f64; 8] = [
        3.387_132_872_796_366_608,
        1.331_416_678_917_843_774_5e2,
        1.971_590_950_306_551_442_7e3,
        1.373_169_376_550_946_112_5e4,
        4.592_195_393_154_987_145_7e4,
        6.726_577_092_700_870_085_3e4,
        3.343_057_558_358_812_810_5e4,
        2.509_080_928_730_122_672_7e3,
    ];
    const B: [f64; 8] = [
        1.0,
        4.231_333_070_160_091_125_2e1,
        6.871_870_074_920_579_083e2,
        5.394_196_021_424_751_107_7e3,
        2.121_379_430_158_659_586_7e4,
        3.930_789_580_009_271_061e4,
        2.872_908_573_572_194_267_4e4,
        5.226_495_278_852_854_561e3,
    ];
    const C: [f64; 8] = [
        1.423_437_110_749_683_577_34,
        4.630_337_846_156_545_295_9,
        5.769_497_221_460_691_405_5,
        3.647_848_324_763_204_605_04,
        1.270_458_252_452_368_382_58,
        2.417_807_251_774_506_117_7e-1,
        2.272_384_498_926_918_458_33e-2,
        7.745_450_142_783_414_076_4e-4,
    ];
    const D: [f64; 8] = [
        1.0,
        2.053_191_626_637_758_821_87,
        1.676_384_830_183_803_849_4,
        6.897_673_349_851_000_045_5e-1,
        1.481_039_764_274_800_745_9e-1,
        1.519_866_656_361_645_719_66e-2,
        5.475_938_084_995_344_946e-4,
        1.050_750_071_644_416_843_24e-9,
    ];
    const E: [f64; 8] = [
        6.657_904_643_501_103_777_2,
        5.463_784_911_164_114_369_9,
        1.784_826_539_917_291_335_8,
        2.965_605_718_285_048_912_3e-1,
        2.653_218_952_657_612_309_3e-2,
        1.242_660_947_388_078_438_6e-3,
        2.711_555_568_743_487_578_15e-5,
        2.010_334_399_292_288_132_65e-7,
    ];
    const F: [f64; 8] = [
        1.0,
        5.998_322_065_558_879_376_9e-1,
        1.369_298_809_227_358_053_1e-1,
        1.487_536_129_085_061_485_25e-2,
        7.868_691_311_456_132_591e-4,
        1.846_318_317_510_054_681_8e-5,
        1.421_511_758_316_445_888_7e-7,
        2.044_263_103_389_939_785_64e-15,
    ];
    let ratio = |top: &[f64; 8], bottom: &[f64; 8], x: f64| {
        let polynomial = |c: &[f64; 8]| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        polynomial(top) / polynomial(bottom)
    };
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(&A, &B, 0.180_625 - q * q);
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    if tail == 0.0 {
        return f64::INFINITY.copysign(q);
    }
    let r = (-tail.ln()).sqrt();
    let z = if r <= 5.0 { ratio(&C, &D, r - 1.6) } else { ratio(&E, &F, r - 5.0) };
    z.copysign(q)
}

/// The significance of each of `tests` independent tests such that all together fail by chance with probability
/// `significance`: `1 - (1 - significance)^(1/tests)` (Šidák 1967). For dependent tests it is on the safe side in
/// common cases.
#[must_use]
pub fn sidak(significance: f64, tests: usize) -> f64 {
    -((-significance).ln_1p() / tests.max(1) as f64).exp_m1()
}

/// The logarithm of the gamma function, for `x > 0`. Relative error about 1e-14.
///
/// Method: Lanczos approximation with g = 7 and nine terms (Godfrey's coefficients).
#[must_use]
pub fn ln_gamma(x: f64) -> f64 {
    const G: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        return (PI / (PI * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let sum = G.iter().enumerate().skip(1).fold(G[0], |sum, (i, g)| sum + g / (x + i as f64));
    let t = x + 7.5;
    0.5 * (2.0 * PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// The regularised lower incomplete gamma function P(a, x), for `a > 0` and `x ≥ 0`.
///
/// Method: series below `a + 1`, Lentz's continued fraction above (Press et al., "Numerical Recipes", 6.2).
#[must_use]
pub fn gamma_p(a: f64, x: f64) -> f64 {
    if x < a + 1.0 { gamma_series(a, x) } else { 1.0 - gamma_fraction(a, x) }
}

/// The regularised upper incomplete gamma function Q(a, x) = 1 - P(a, x), without cancellation for large `x`.
#[must_use]
pub fn gamma_q(a: f64, x: f64) -> f64 {
    if x < a + 1.0 { 1.0 - gamma_series(a, x) } else { gamma_fraction(a, x) }
}

/// The chance that a χ² variable with `degrees` degrees of freedom exceeds `statistic`. One without degrees of
/// freedom.
#[must_use]
pub fn chi2_p_value(statistic: f64, degrees: usize) -> f64 {
    if degrees == 0 || statistic <= 0.0 { 1.0 } else { gamma_q(degrees as f64 / 2.0, statistic / 2.0) }
}

/// Both expansions need some `√a` terms near `x = a`.
fn max_terms(a: f64) -> usize {
    1000 + (20.0 * a.sqrt()) as usize
}

fn gamma_series(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let mut term = 1.0 / a;
    let mut sum = term;
    for n in 1..max_terms(a) {
        term *= x / (a + n as f64);
        sum += term;
        if term < sum * 1e-17 {
            break;
        }
    }
    sum * (a * x.ln() - x - ln_gamma(a)).exp()
}

fn gamma_fraction(a: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for n in 1..max_terms(a) {
        let n = n as f64;
        let an = -n * (n - a);
        b += 2.0;
        d = 1.0 / (an * d + b).abs().max(TINY).copysign(an * d + b);
        c = (b + an / c).abs().max(TINY).copysign(b + an / c);
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-16 {
            break;
        }
    }
    fraction * (a * x.ln() - x - ln_gamma(a)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(actual: f64, expected: f64, relative: f64) {
        assert!((actual - expected).abs() <= relative * expected.abs(), "{actual:e} instead of {expected:e}");
    }

    #[test]
    fn normal_quantiles_of_the_tables() {
        assert_eq!(normal_quantile(0.5), 0.0);
        close(normal_quantile(0.975), 1.959_963_984_540_054, 1e-14);
        close(normal_quantile(0.25), -0.674_489_750_196_081_7, 1e-14);
        close(normal_quantile(0.001), -3.090_232_306_167_813, 1e-14);
        close(normal_quantile(1e-20), -9.262_340_089_798_408, 1e-14);
        assert_eq!(normal_quantile(0.0), f64::NEG_INFINITY);
        assert!(normal_quantile(1.5).is_nan() && normal_quantile(f64::NAN).is_nan());
    }

    #[test]
    fn quantile_inverts_the_tail() {
        // The two-sided tail of the normal distribution is Q(1/2, z²/2).
        for exponent in 1..200 {
            let p = 0.49 * 0.7_f64.powi(exponent);
            let z = normal_quantile(p);
            close(gamma_q(0.5, z * z / 2.0) / 2.0, p, 1e-11);
        }
    }

    #[test]
    fn gamma_functions_of_the_tables() {
        close(ln_gamma(0.5), PI.sqrt().ln(), 1e-14);
        close(ln_gamma(10.0), 362_880_f64.ln(), 1e-14);
        close(ln_gamma(0.1), 2.252_712_651_734_206, 1e-13);
        for x in [0.01, 0.5, 1.0, 3.0, 20.0] {
            close(gamma_q(1.0, x), (-x).exp(), 1e-12);
            close(gamma_p(2.5, x) + gamma_q(2.5, x), 1.0, 1e-14);
        }
        close(chi2_p_value(3.841_458_820_694_124, 1), 0.05, 1e-12);
        close(chi2_p_value(18.307_038_053_275_146, 10), 0.05, 1e-12);
        close(chi2_p_value(1_074.679_450_344_906, 1000), 0.05, 1e-6);
        assert_eq!([chi2_p_value(0.0, 5), chi2_p_value(3.0, 0)], [1.0, 1.0]);
        assert!((chi2_p_value(1e6, 1_000_000) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn sidak_of_many_tests() {
        close(sidak(0.001, 1), 0.001, 1e-12);
        close(1.0 - (1.0 - sidak(0.001, 1000)).powi(1000), 0.001, 1e-9);
        close(sidak(0.001, 1_000_000_000), 1.000_500_33e-12, 1e-6);
    }
}
