//! Alias tables: choosing among weighted entries in constant time.

use bytemuck::NoUninit;

/// One slot of an alias table, to be used with [`crate::warp::alias_choose`].
#[derive(Clone, Copy, Debug, Default, PartialEq, NoUninit)]
#[repr(C)]
pub struct AliasEntry {
    /// Share of the slot that is its own entry, in `[0, 1]`.
    pub threshold: f32,
    /// The entry that has the rest of the slot.
    pub alias: u32,
    /// Probability of choosing the slot's own entry by the whole table.
    pub probability: f32,
}

/// Builds the table for `weights`; negative and non-finite ones count as zero. If all are zero, all are equally likely.
///
/// Source: Vose, "A Linear Algorithm for Generating Random Numbers with a Given Distribution", 1991.
pub fn build_alias_table(weights: &[f64]) -> Vec<AliasEntry> {
    let clean = |w: f64| if w.is_finite() && w > 0.0 { w } else { 0.0 };
    let sum: f64 = weights.iter().copied().map(clean).sum();
    let n = weights.len();
    let probability = |w: f64| if sum > 0.0 { clean(w) / sum } else { 1.0 / n as f64 };
    let mut table: Vec<AliasEntry> = (0..n)
        .map(|i| AliasEntry { threshold: 1.0, alias: i as u32, probability: probability(weights[i]) as f32 })
        .collect();
    let mut scaled: Vec<f64> = weights.iter().map(|w| probability(*w) * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    while let (Some(&below), Some(&above)) = (small.last(), large.last()) {
        small.pop();
        table[below].threshold = scaled[below] as f32;
        table[below].alias = above as u32;
        scaled[above] -= 1.0 - scaled[below];
        if scaled[above] < 1.0 {
            large.pop();
            small.push(above);
        }
    }
    // What is left is full up to rounding; an entry of weight zero must stay out even so.
    for i in small {
        if table[i].probability == 0.0 {
            table[i].threshold = 0.0;
            table[i].alias = (0..n).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(i) as u32;
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::{alias_choose, alias_slot};

    fn shares(table: &[AliasEntry]) -> Vec<f64> {
        let n = table.len() as f64;
        let mut share = vec![0.0; table.len()];
        for (i, entry) in table.iter().enumerate() {
            share[i] += f64::from(entry.threshold) / n;
            share[entry.alias as usize] += (1.0 - f64::from(entry.threshold)) / n;
        }
        share
    }

    #[test]
    fn shares_are_the_weights() {
        let weights = [0.5, 3.0, 0.0, 1.5, 1e-6, 10.0, f64::NAN, -1.0];
        let table = build_alias_table(&weights);
        for (i, share) in shares(&table).iter().enumerate() {
            assert!((share - f64::from(table[i].probability)).abs() < 1e-6, "entry {i}: {share} {table:?}");
        }
        assert_eq!(table[2].probability, 0.0);
        assert_eq!(table[6].probability, 0.0);
    }

    #[test]
    fn all_zero_is_uniform_and_empty_is_empty() {
        assert!(shares(&build_alias_table(&[0.0; 4])).iter().all(|s| (s - 0.25).abs() < 1e-9));
        assert!(build_alias_table(&[]).is_empty());
    }

    #[test]
    fn choices_follow_the_table() {
        let weights = [1.0, 2.0, 5.0];
        let table = build_alias_table(&weights);
        let mut counts = [0u32; 3];
        for i in 0..80_000 {
            let u = (i as f32 + 0.5) / 80_000.0;
            let slot = alias_slot(u, 3);
            let entry = table[slot as usize];
            counts[alias_choose(u, 3, slot, entry.threshold, entry.alias).index as usize] += 1;
        }
        for (count, weight) in counts.iter().zip(weights) {
            assert!((f64::from(*count) / 10_000.0 - weight).abs() < 0.01, "{counts:?}");
        }
    }
}
