//! Kernels of 5×5 pixels at work: the filter's inner loop.

use super::filter::{REACH, Trusted, VALUES};
use super::lanes::{LANES, Lanes, Stage, exp};
use super::weights::{ALPHA, DETAIL, SLOTS};

/// Logits of two pixels.
pub const PAIR: usize = 2 * SLOTS;

/// Columns of a kernel.
const TAPS: usize = 2 * REACH + 1;

/// The logit of what lies outside the picture: no weight.
const NEVER: f32 = -1e30;

/// Filters a run of pixels. Two neighbours go together: their values, eight of each, are one
/// vector. The last may be alone; what is beside it is computed and forgotten.
pub struct Kernels<'a> {
    /// What is filtered.
    pub from: &'a Trusted,
    /// Column and row of the first pixel.
    pub place: [usize; 2],
    /// The slots of each two pixels; weights afterwards.
    pub pairs: &'a mut [[f32; PAIR]],
    /// From the slots of two pixels to those of the next two.
    pub step: usize,
    /// Where the results go.
    pub to: &'a mut [[f32; VALUES]],
}

impl Stage for Kernels<'_> {
    #[inline(always)]
    fn run<L: Lanes, const PIXELS: usize>(self, l: L) {
        let Self { from, place: [first, y], pairs, step, to } = self;
        let pitch = from.pitch();
        for (i, to) in to.chunks_mut(2).enumerate() {
            let x = first + 2 * i;
            let pair = &mut pairs[i * step];
            let others = [[pair[ALPHA], pair[DETAIL]], [pair[SLOTS + ALPHA], pair[SLOTS + DETAIL]]];
            let is_inside = x >= REACH && x + REACH + 1 < from.width && y >= REACH && y + REACH < from.height;
            for (pixel, slots) in pair.as_chunks_mut::<SLOTS>().0.iter_mut().enumerate() {
                if !is_inside {
                    forget_outside(slots, [x + pixel, y], [from.width, from.height]);
                }
                weigh(l, slots);
            }
            let sum = weighted_sum(l, from, pair, y * pitch + x);
            let mut sums = [0.0; LANES];
            l.store(sum, &mut sums);
            for (pixel, to) in to.iter_mut().enumerate() {
                let sums: &[f32; VALUES] = &sums.as_chunks().0[pixel];
                let factor = 1.0 / sums[6];
                for i in 0..6 {
                    to[i] = sums[i] * factor;
                }
                [to[6], to[7]] = others[pixel];
            }
        }
    }
}

/// The sums of two pixels: the 5×5 around each, by their weights. `place` is that of the first
/// pixel's first.
#[inline(always)]
fn weighted_sum<L: Lanes>(l: L, from: &Trusted, weights: &[f32; PAIR], place: usize) -> L::V {
    let mut sums = [l.splat(0.0); TAPS];
    for (row, sum) in sums.iter_mut().enumerate() {
        let values = &from.data[place + row * from.pitch()..][..TAPS + 1].as_flattened();
        for column in 0..TAPS {
            let tap = TAPS * row + column;
            let weight = l.halves(weights[tap], weights[SLOTS + tap]);
            if let Some(values) = values[column * VALUES..].first_chunk() {
                *sum = l.mul_add(weight, l.load(values), *sum);
            }
        }
    }
    l.add(l.add(l.add(sums[0], sums[1]), l.add(sums[2], sums[3])), sums[4])
}

/// Turns logits into weights, of which the largest is 1. Slots that are no kernel's get none.
#[inline(always)]
fn weigh<L: Lanes>(l: L, slots: &mut [f32; SLOTS]) {
    // Added to the upper half.
    const MASK: [f32; LANES] = {
        let mut mask = [0.0; LANES];
        let mut slot = TAPS * TAPS;
        while slot < SLOTS {
            mask[slot - LANES] = NEVER;
            slot += 1;
        }
        mask
    };
    let [low, high] = slots.as_chunks_mut::<LANES>().0 else { return };
    let (a, b) = (l.load(low), l.add(l.load(high), l.load(&MASK)));
    let mut largest = [0.0; LANES];
    l.store(l.max(a, b), &mut largest);
    for half in [8, 4, 2, 1] {
        for i in 0..half {
            largest[i] = if largest[i] > largest[i + half] { largest[i] } else { largest[i + half] };
        }
    }
    let shift = l.splat(-largest[0]);
    l.store(exp(l, l.add(a, shift)), low);
    l.store(exp(l, l.add(b, shift)), high);
}

/// Takes away the logits of what lies outside the picture.
#[cold]
fn forget_outside(slots: &mut [f32; SLOTS], [x, y]: [usize; 2], [width, height]: [usize; 2]) {
    let outside =
        |place: usize, tap: usize, length: usize| place + tap < REACH || place + tap >= length + REACH;
    for (tap, slot) in slots[..TAPS * TAPS].iter_mut().enumerate() {
        if outside(x, tap % TAPS, width) || outside(y, tap / TAPS, height) {
            *slot = NEVER;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::InstructionSet;
    use super::super::tests::weights::uniform;
    use super::*;

    /// A pixel's result, by its definition.
    fn naive(from: &Trusted, logits: &[f32], [x, y]: [usize; 2]) -> [f64; 6] {
        let (mut sums, mut total) = ([0.0; 6], 0.0);
        for (tap, logit) in logits[..TAPS * TAPS].iter().enumerate() {
            let (x, y) = (x + tap % TAPS, y + tap / TAPS);
            let inside = |at: usize, length: usize| (REACH..length + REACH).contains(&at);
            if inside(x, from.width) && inside(y, from.height) {
                let (values, weight) = (from.data[y * from.pitch() + x], f64::from(*logit).exp());
                total += weight * f64::from(values[6]);
                for c in 0..6 {
                    sums[c] += weight * f64::from(values[c]);
                }
            }
        }
        sums.map(|sum| sum / total)
    }

    #[test]
    fn kernels_are_weighted_means_of_what_is_inside() {
        for (width, height) in [(1, 1), (2, 1), (4, 3), (7, 5), (12, 9)] {
            let mut from = Trusted::new(width, height);
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let value = |c| uniform(1, (8 * (y * width + x) + c) as u32) as f32;
                let place = (y + REACH) * from.pitch() + x + REACH;
                let trust = 0.6 + 0.4 * value(6);
                for c in 0..6 {
                    from.data[place][c] = trust * (1.0 + value(c));
                }
                from.data[place][6] = trust;
            }
            for (set, y) in
                InstructionSet::available().into_iter().flat_map(|set| (0..height).map(move |y| (set, y)))
            {
                let logit = |i: usize| 20.0 * uniform(2 + y as u32, i as u32) as f32;
                let mut pairs: Vec<[f32; PAIR]> =
                    (0..width.div_ceil(2)).map(|i| std::array::from_fn(|k| logit(PAIR * i + k))).collect();
                let logits = pairs.as_flattened().to_vec();
                let mut to = vec![[0.0; VALUES]; width];
                set.run(Kernels { from: &from, place: [0, y], pairs: &mut pairs, step: 1, to: &mut to });
                for (x, found) in to.into_iter().enumerate() {
                    let slots = &logits[SLOTS * x..][..SLOTS];
                    for (found, expected) in found.into_iter().zip(naive(&from, slots, [x, y])) {
                        assert!((f64::from(found) - expected).abs() < 1e-5, "{found} is not {expected}");
                    }
                    assert_eq!(found[6..], [slots[ALPHA], slots[DETAIL]]);
                }
            }
        }
    }
}
