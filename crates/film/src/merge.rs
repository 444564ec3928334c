//! Adding up the parts of a picture, one after the other, without keeping them all in memory.

use crate::{Coverage, Part, PartError};

/// Adds up parts in any order.
///
/// Errors name the two parts that do not go together, even where the one was added long before the other.
#[derive(Debug, Default)]
pub struct Merger {
    merged: Option<Part>,
    /// What each part brought.
    added: Vec<(String, Coverage)>,
}

impl Merger {
    /// No parts yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a part; `name` is what errors call it.
    ///
    /// # Errors
    /// As [`Part::merge`]; what was added before stays.
    pub fn add(&mut self, name: &str, part: Part) -> Result<(), PartError> {
        let covered = part.covered().clone();
        match &mut self.merged {
            None => self.merged = Some(part),
            Some(merged) => {
                let first = self.added.first().map_or("the first part", |(name, _)| name);
                merged.merge(first, &part, name).map_err(|error| self.name_overlap(error, &covered))?;
            }
        }
        self.added.push((name.to_owned(), covered));
        Ok(())
    }

    /// The sum of all parts.
    ///
    /// # Errors
    /// [`PartError::Nothing`] if there were none.
    pub fn finish(self) -> Result<Part, PartError> {
        self.merged.ok_or(PartError::Nothing)
    }

    /// All that is known at first of an overlap is that it is with something added before.
    fn name_overlap(&self, error: PartError, covered: &Coverage) -> PartError {
        let PartError::Overlap { other, common, .. } = error else { return error };
        let culprit = self.added.iter().find_map(|(name, c)| Some((name.clone(), c.overlap(covered)?)));
        let (name, common) = culprit.unwrap_or(("what is already merged".into(), common));
        PartError::Overlap { name, other, common }
    }
}
