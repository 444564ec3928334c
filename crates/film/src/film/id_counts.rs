//! How often a pixel's samples saw what.

/// Ids and their shares of a pixel's samples.
pub type IdShares = Vec<(u32, f32)>;

/// How many samples of a pixel saw each id first. Exact, so the order in which samples come does not matter.
///
/// Most pixels see one thing only, so that one needs no memory of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct IdCounts {
    /// The smallest id and its count; a count of zero if there is none.
    first: (u32, u32),
    /// The others, by id.
    others: Vec<(u32, u32)>,
}

impl IdCounts {
    /// Adds `count` samples that saw `id`.
    pub fn add(&mut self, id: u32, count: u32) {
        if count == 0 {
            return;
        }
        if self.first.1 == 0 {
            self.first = (id, count);
        } else if id == self.first.0 {
            self.first.1 = self.first.1.saturating_add(count);
        } else if id < self.first.0 {
            self.others.insert(0, std::mem::replace(&mut self.first, (id, count)));
        } else {
            match self.others.binary_search_by_key(&id, |&(id, _)| id) {
                Ok(at) => self.others[at].1 = self.others[at].1.saturating_add(count),
                Err(at) => self.others.insert(at, (id, count)),
            }
        }
    }

    /// Adds the samples of `other`.
    pub fn merge(&mut self, other: &Self) {
        other.iter().for_each(|(id, count)| self.add(id, count));
    }

    /// Ids and their counts, by id.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32)> {
        let first = (self.first.1 > 0).then_some(self.first);
        first.into_iter().chain(self.others.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_samples_does_not_matter() {
        let ids = [7, 3, 9, 3, 0, 7, 7, 12, 0, 9];
        let counted = |order: &mut dyn Iterator<Item = &u32>| {
            let mut counts = IdCounts::default();
            order.for_each(|&id| counts.add(id, 1));
            counts
        };
        let all = counted(&mut ids.iter());
        assert_eq!(all.iter().collect::<Vec<_>>(), [(0, 2), (3, 2), (7, 3), (9, 2), (12, 1)]);
        assert_eq!(counted(&mut ids.iter().rev()), all);
        let mut halves = counted(&mut ids[5..].iter());
        halves.merge(&counted(&mut ids[..5].iter()));
        assert_eq!(halves, all);
        assert_ne!(counted(&mut ids[1..].iter()), all);
    }
}
