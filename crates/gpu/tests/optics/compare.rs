//! How far results may be apart.

use crate::shader::Kind;

/// How far a GPU's result may be from the CPU's, and why it may differ at all.
#[derive(Debug)]
pub struct Tolerance {
    /// Allowed absolute difference of floating-point numbers.
    pub absolute: f32,
    /// Allowed difference in addition, as a share of the number.
    pub relative: f32,
    /// Share of the inputs for which results may be anything.
    pub exceptions: f32,
    /// The reason.
    pub why: &'static str,
}

/// What a comparison found.
#[derive(Debug)]
pub struct Comparison {
    /// Number of inputs.
    pub inputs: usize,
    /// Inputs whose results are farther apart than allowed.
    pub wrong: usize,
    /// The first of them: number of the input, word of the result, expected and actual.
    pub first: Option<(usize, usize, f32, f32)>,
    /// The largest difference of floating-point numbers, in units of what is allowed.
    pub worst: f32,
}

impl Comparison {
    pub fn passes(&self, tolerance: &Tolerance) -> bool {
        self.inputs > 0 && self.wrong as f32 <= tolerance.exceptions * self.inputs as f32
    }

    pub fn summary(&self) -> String {
        format!(
            "{} of {} beyond, worst {:.2} of what is allowed, first {:?}",
            self.wrong, self.inputs, self.worst, self.first
        )
    }

    pub fn explain(&self, t: &Tolerance) -> String {
        let allowed =
            format!("{:e} + {:e} of the value, {} of the inputs", t.absolute, t.relative, t.exceptions);
        format!("{}; allowed: {allowed} ({})", self.summary(), t.why)
    }
}

/// Compares results, `kinds.len()` words each.
pub fn compare(kinds: &[Kind], expected: &[u32], actual: &[u32], tolerance: &Tolerance) -> Comparison {
    assert_eq!(expected.len(), actual.len(), "as many results as expected");
    let mut comparison = Comparison { inputs: 0, wrong: 0, first: None, worst: 0.0 };
    for (i, (e, a)) in expected.chunks_exact(kinds.len()).zip(actual.chunks_exact(kinds.len())).enumerate() {
        comparison.inputs += 1;
        let excess = |word: usize| match kinds[word] {
            Kind::Exact => {
                if e[word] == a[word] {
                    0.0
                } else {
                    f32::INFINITY
                }
            }
            Kind::Float => excess(f32::from_bits(e[word]), f32::from_bits(a[word]), tolerance),
        };
        let shown = |kind: Kind, word: u32| match kind {
            Kind::Float => f32::from_bits(word),
            Kind::Exact => word as f32,
        };
        let wrong = (0..kinds.len()).find(|&word| excess(word) > 1.0);
        if let Some(word) = wrong {
            comparison.wrong += 1;
            let kind = kinds[word];
            comparison.first.get_or_insert((i, word, shown(kind, e[word]), shown(kind, a[word])));
        }
        comparison.worst = (0..kinds.len()).map(excess).fold(comparison.worst, f32::max);
    }
    comparison
}

/// The difference of two numbers in units of what is allowed. NaN is like NaN, infinity like itself.
fn excess(expected: f32, actual: f32, tolerance: &Tolerance) -> f32 {
    if expected == actual || (expected.is_nan() && actual.is_nan()) {
        return 0.0;
    }
    let difference = (expected - actual).abs();
    let allowed = tolerance.absolute + tolerance.relative * expected.abs();
    if difference.is_finite() && allowed > 0.0 { difference / allowed } else { f32::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEST: Tolerance = Tolerance { absolute: 1e-5, relative: 0.0, exceptions: 0.0, why: "this test" };

    #[test]
    fn one_wrong_result_is_noticed() {
        let expected = [1.0_f32.to_bits(); 64];
        let mut actual = expected;
        assert!(compare(&[Kind::Float], &expected, &actual, &TEST).passes(&TEST));
        actual[17] = 1.001_f32.to_bits();
        let comparison = compare(&[Kind::Float], &expected, &actual, &TEST);
        assert!(!comparison.passes(&TEST));
        assert_eq!(comparison.first.map(|f| f.0), Some(17));
    }

    #[test]
    fn numbers_that_are_none_are_only_like_themselves() {
        assert_eq!(excess(f32::NAN, f32::NAN, &TEST), 0.0);
        assert_eq!(excess(f32::INFINITY, f32::INFINITY, &TEST), 0.0);
        for (a, b) in [(f32::NAN, 0.0), (0.0, f32::NAN), (f32::INFINITY, f32::MAX), (1.0, f32::NEG_INFINITY)]
        {
            assert!(excess(a, b, &TEST) > 1.0, "{a} {b}");
        }
    }

    #[test]
    fn integers_are_compared_exactly() {
        assert!(!compare(&[Kind::Exact], &[7], &[8], &TEST).passes(&TEST));
    }

    #[test]
    fn nothing_to_compare_is_no_success() {
        assert!(!compare(&[Kind::Float], &[], &[], &TEST).passes(&TEST));
    }
}
