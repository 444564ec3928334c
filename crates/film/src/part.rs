//! Parts of a picture: some samples of some of its pixels, with all that is needed to add them to others.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Duration;

use crate::{Block, Coverage, Film, FilmError, ImageError, Rect};

mod file;

/// Some samples of a picture: what one machine has made of it, or what several have made together.
///
/// The film's sums are exact, so parts may be merged in any order and grouping ([`Part::merge`], [`crate::Merger`]): the
/// same samples always give the same bits, those of the picture made whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    film: Film,
    covered: Coverage,
    whole: Block,
    /// What must be equal for two parts to belong to one picture: the scene and every setting that decides a sample,
    /// as text by name.
    pub identity: BTreeMap<String, String>,
    /// What the finished picture's file shall say besides.
    pub metadata: BTreeMap<String, String>,
    /// Names of the back ends that made the samples.
    pub backends: BTreeSet<String>,
    /// Time that was spent on rendering, on all machines together.
    pub render_time: Duration,
}

/// Why a part could not be made, read, written or merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// The file cannot be read or written, or is no EXR file (any more).
    #[error(transparent)]
    File(#[from] ImageError),
    /// The file is an EXR file, but has no exact sums.
    #[error("{}: this is a finished picture, not a part of one: it has no exact sums", path.display())]
    NotAPart {
        /// The file.
        path: PathBuf,
    },
    /// The file was written by another version of this program.
    #[error("{}: this part has format {found}, but this version reads format {known}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// What it says.
        found: String,
        /// What this version writes and reads.
        known: &'static str,
    },
    /// The file says something that cannot be, or not what it said when it was written.
    #[error("{}: the part is damaged: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The film does not have the samples that the part is said to cover.
    #[error("the film does not have the samples that it should have: {reason}")]
    Inconsistent {
        /// The difference.
        reason: String,
    },
    /// Two parts belong to different pictures.
    #[error(
        "{name} and {other} do not belong together: {what} is `{value}` in the one and `{other_value}` in the other"
    )]
    Foreign {
        /// One part.
        name: String,
        /// The part that it was to be merged with.
        other: String,
        /// The setting that is different.
        what: String,
        /// Its value in `name`.
        value: String,
        /// Its value in `other`.
        other_value: String,
    },
    /// Two parts have samples in common, which would be counted twice.
    #[error("{name} and {other} both have {common}")]
    Overlap {
        /// One part.
        name: String,
        /// The other.
        other: String,
        /// Some of what both have.
        common: Block,
    },
    /// There is nothing to merge.
    #[error("there are no parts to merge")]
    Nothing,
    /// The film could not be made.
    #[error("cannot make the film")]
    Film(#[from] FilmError),
}

impl Part {
    /// A part that has the samples `covered` of the picture `whole` on its film.
    ///
    /// # Errors
    /// [`PartError::Inconsistent`] if the film does not have exactly the samples of `covered`, or these are not all in
    /// `whole` and in the film's window.
    pub fn new(film: Film, covered: Coverage, whole: Block) -> Result<Self, PartError> {
        let inconsistent = |reason: String| Err(PartError::Inconsistent { reason });
        if !whole.window.contains_rect(&film.window()) {
            return inconsistent(format!(
                "{:?} reaches beyond the picture's {:?}",
                film.window(),
                whole.window
            ));
        }
        let mine = Block { window: film.window(), samples: whole.samples.clone() };
        if let Some(block) = covered.blocks().iter().find(|b| !mine.contains(b)) {
            return inconsistent(format!("{block} are outside of {mine}"));
        }
        let counts = covered.counts(film.window());
        if let Some(i) = film.pixels().iter().zip(&counts).position(|(p, n)| p.taken() != *n) {
            let width = film.window().width as usize;
            let (x, y) = (film.window().x + (i % width) as u32, film.window().y + (i / width) as u32);
            let (has, should) = (film.pixels()[i].taken(), counts[i]);
            return inconsistent(format!("pixel ({x}, {y}) has {has} samples instead of {should}"));
        }
        Ok(Self {
            film,
            covered,
            whole,
            identity: BTreeMap::new(),
            metadata: BTreeMap::new(),
            backends: BTreeSet::new(),
            render_time: Duration::ZERO,
        })
    }

    /// The sums of what is covered.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Which samples there are.
    #[must_use]
    pub fn covered(&self) -> &Coverage {
        &self.covered
    }

    /// The picture that this is a part of: its pixels, and the samples that each shall have.
    #[must_use]
    pub fn whole(&self) -> &Block {
        &self.whole
    }

    /// What of the whole picture is not here.
    #[must_use]
    pub fn missing(&self) -> Coverage {
        self.covered.missing(&self.whole)
    }

    /// The film of all pixels of the picture; those that are not covered have no samples.
    ///
    /// # Errors
    /// [`FilmError::Memory`].
    pub fn into_whole_film(mut self) -> Result<Film, FilmError> {
        self.grow(self.whole.window)?;
        Ok(self.film)
    }

    /// Adds the samples of `other`, a part of the same picture. `name` and `other_name` are what errors call the two.
    ///
    /// Any order and any grouping of merges gives the same part, bit for bit. Where one picture was to have more samples
    /// than the other, the result is of the one with more.
    ///
    /// # Errors
    /// [`PartError::Foreign`] names the first setting that is different, [`PartError::Overlap`] samples that both have; the
    /// part is then unchanged.
    pub fn merge(&mut self, name: &str, other: &Self, other_name: &str) -> Result<(), PartError> {
        if let Some((what, value, other_value)) = self.difference(other) {
            let (name, other) = (name.to_owned(), other_name.to_owned());
            return Err(PartError::Foreign { name, other, what, value, other_value });
        }
        let covered = self.covered.union(&other.covered).map_err(|common| PartError::Overlap {
            name: name.to_owned(),
            other: other_name.to_owned(),
            common,
        })?;
        self.grow(self.film.window().hull(&other.film.window()))?;
        self.film.merge(&other.film)?;
        self.covered = covered;
        self.whole.samples = hull(&self.whole, &other.whole);
        self.backends.extend(other.backends.iter().cloned());
        self.render_time = self.render_time.saturating_add(other.render_time);
        // Any of the two will do, as long as the order of merging does not decide which.
        if other.metadata < self.metadata {
            self.metadata.clone_from(&other.metadata);
        }
        Ok(())
    }

    /// The first setting in which `other` is of a different picture: its name, and both values.
    fn difference(&self, other: &Self) -> Option<(String, String, String)> {
        // The size first: cameras of pictures of different sizes are different, too.
        let size = |p: &Self| {
            let Rect { x, y, width, height } = p.whole.window;
            format!("{width}×{height} at ({x}, {y}) of {}×{}", p.film.width(), p.film.height())
        };
        let layers = |p: &Self| p.film.aovs().iter().map(|a| a.name()).collect::<Vec<_>>().join(", ");
        let pairs = [("size", size(self), size(other)), ("the list of layers", layers(self), layers(other))];
        if let Some((what, a, b)) = pairs.into_iter().find(|(_, a, b)| a != b) {
            return Some((what.to_owned(), a, b));
        }
        let mut keys: BTreeSet<&String> = self.identity.keys().chain(other.identity.keys()).collect();
        keys.retain(|key| self.identity.get(*key) != other.identity.get(*key));
        let key = keys.into_iter().next()?;
        let value = |part: &Self| part.identity.get(key).cloned().unwrap_or("nothing".into());
        Some((key.clone(), value(self), value(other)))
    }

    /// Makes the film's window larger; the new pixels have no samples.
    fn grow(&mut self, window: Rect) -> Result<(), FilmError> {
        if window != self.film.window() {
            let mut film = self.film.tile(window)?;
            film.merge(&self.film)?;
            self.film = film;
        }
        Ok(())
    }
}

/// The samples that the larger of two plans of one picture has.
fn hull(a: &Block, b: &Block) -> std::ops::Range<u32> {
    a.samples.start.min(b.samples.start)..a.samples.end.max(b.samples.end)
}

#[cfg(test)]
mod tests;
