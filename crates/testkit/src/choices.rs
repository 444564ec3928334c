//! Decisions of generators: from a seed for tests, from the bytes of a fuzzer.

use crate::Random;
use elementary::pow;

/// Where a generator takes its decisions from.
///
/// A fuzzer changes bytes, so each decision takes few of them, in order: a changed byte changes one thing.
#[derive(Clone, Debug)]
pub struct Choices<'a> {
    source: Source<'a>,
}

#[derive(Clone, Debug)]
enum Source<'a> {
    Seed(Random),
    /// What is left of the bytes. Where there are none left, every decision is 0.
    Bytes(&'a [u8]),
}

/// Numbers at which code breaks: the ends of types, what rounds to zero or infinity in single precision, and next to 0 and 1.
const EXTREMES: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-7,
    0.999_999_9,
    1.000_000_2,
    1e-30,
    1e-46,
    1e6,
    1e19,
    -1e19,
    3.4e38,
    -3.4e38,
    1e39,
    1e300,
];

impl<'a> Choices<'a> {
    /// Endless random decisions; equal seeds give equal ones.
    pub fn from_seed(seed: u64) -> Self {
        Self { source: Source::Seed(Random::new(seed)) }
    }

    /// Decisions that a fuzzer makes.
    pub fn from_bytes(bytes: &'a [u8]) -> Self {
        Self { source: Source::Bytes(bytes) }
    }

    /// The next byte.
    pub fn byte(&mut self) -> u8 {
        match &mut self.source {
            Source::Seed(random) => (random.bits() >> 56) as u8,
            Source::Bytes(bytes) => bytes.split_off_first().copied().unwrap_or(0),
        }
    }

    /// A number below `count`, which is at least 1 and at most 65,536; uniform up to the remainder of the division.
    pub fn below(&mut self, count: usize) -> usize {
        let number = match count {
            0..=256 => usize::from(self.byte()),
            _ => usize::from(u16::from_le_bytes([self.byte(), self.byte()])),
        };
        number % count
    }

    /// True once in `times`, by chance.
    pub fn once_in(&mut self, times: usize) -> bool {
        // The last value, so that bytes that ran out decide for what is usual.
        self.below(times) == times - 1
    }

    /// One of a list that is not empty.
    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    /// A number in `[0, 1]`.
    pub fn unit(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / 65_535.0
    }

    /// A number in `[0, 1]`, often one of its ends or next to them.
    pub fn share(&mut self) -> f64 {
        if self.once_in(4) { self.one_of(&[0.0, 1.0, 1e-7, 1.0 - 1e-6, 1e-3]) } else { self.unit() }
    }

    /// A number of moderate size and any sign; now and then an extreme one.
    pub fn number(&mut self) -> f64 {
        if self.once_in(16) { self.one_of(&EXTREMES) } else { 4.0 * self.unit() - 2.0 }
    }

    /// A positive number of any size that scenes have, and some that they should not.
    pub fn size(&mut self) -> f64 {
        let exponent = if self.once_in(3) { 24.0 * self.unit() - 12.0 } else { 2.0 * self.unit() - 1.0 };
        pow(10f64, exponent)
    }

    /// An index into `count` things; now and then one that is none.
    pub fn index(&mut self, count: usize) -> u32 {
        if count == 0 || self.once_in(64) {
            return self.one_of(&[count as u32, count as u32 + 1, 0x7fff_ffff, u32::MAX]);
        }
        self.below(count) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_ran_out_decide_for_what_is_usual() {
        let mut choices = Choices::from_bytes(&[7]);
        assert_eq!((choices.below(5), choices.below(5), choices.byte()), (2, 0, 0));
        assert!(!choices.once_in(2) && choices.number() == -2.0 && choices.index(3) == 0);
    }

    #[test]
    fn seeds_reach_every_choice() {
        let mut choices = Choices::from_seed(1);
        let mut seen = [0; 300];
        (0..30_000).for_each(|_| seen[choices.below(300)] += 1);
        assert!(seen.iter().all(|count| (50..200).contains(count)), "{seen:?}");
        assert!((0..1000).any(|_| choices.index(3) > 3) && (0..1000).any(|_| choices.number() > 1e30));
    }
}
