//! Which samples of which pixels there are: what keeps parts of a picture from being added twice or forgotten.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use crate::Rect;

/// Some samples of every pixel of a rectangle: what a render splits into, and what its parts are counted in.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Block {
    /// The pixels.
    pub window: Rect,
    /// Indices of the samples that each of the pixels has.
    pub samples: Range<u32>,
}

impl Block {
    /// Whether there is no sample in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.window.area() == 0 || self.samples.is_empty()
    }

    /// The number of samples, all pixels together.
    #[must_use]
    pub fn sample_count(&self) -> u64 {
        self.window.area() as u64 * self.samples.len() as u64
    }

    /// Whether all of `other` lies inside.
    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        self.window.contains_rect(&other.window)
            && self.samples.start <= other.samples.start
            && other.samples.end <= self.samples.end
    }

    /// What is in both, if anything is.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let window = self.window.intersection(&other.window)?;
        let samples = self.samples.start.max(other.samples.start)..self.samples.end.min(other.samples.end);
        let common = Self { window, samples };
        (!common.is_empty()).then_some(common)
    }

    /// Cuts out `hole`, which lies inside: what is left, in up to six pieces.
    fn without(&self, hole: &Self) -> impl Iterator<Item = Self> {
        let (a, b) = (&self.window, &hole.window);
        let across = |y: u32, height: u32| Rect { x: a.x, y, width: a.width, height };
        let beside = |x: u32, width: u32| Rect { x, y: b.y, width, height: b.height };
        let (bottom, right) = (b.y + b.height, b.x + b.width);
        let pieces = [
            (across(a.y, b.y - a.y), self.samples.clone()),
            (across(bottom, a.y + a.height - bottom), self.samples.clone()),
            (beside(a.x, b.x - a.x), self.samples.clone()),
            (beside(right, a.x + a.width - right), self.samples.clone()),
            (*b, self.samples.start..hole.samples.start),
            (*b, hole.samples.end..self.samples.end),
        ];
        pieces.into_iter().map(|(window, samples)| Self { window, samples }).filter(|b| !b.is_empty())
    }
}

impl fmt::Display for Block {
    /// For people: `samples 0..16 of the 8×4 pixels at (2, 3)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Rect { x, y, width, height } = self.window;
        let Range { start, end } = self.samples;
        write!(f, "samples {start}..{end} of the {width}×{height} pixels at ({x}, {y})")
    }
}

/// A set of samples of pixels, in the one form that the set has: two coverages are equal if and only if they hold the
/// same samples, in whatever pieces they were added.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    blocks: Vec<Block>,
}

impl Coverage {
    /// The set of all samples in `blocks`, which must not overlap.
    ///
    /// # Errors
    /// The first samples found that are in two blocks.
    pub fn new(blocks: impl IntoIterator<Item = Block>) -> Result<Self, Block> {
        let blocks: Vec<Block> = blocks.into_iter().filter(|b| !b.is_empty()).collect();
        match first_overlap(&blocks) {
            Some(common) => Err(common),
            None => Ok(Self { blocks: canonical(blocks) }),
        }
    }

    /// What there is when each pixel of `window`, row by row from the top, has as many samples as `counts` says, the
    /// first of them number `first_sample`.
    #[must_use]
    pub fn of_counts(window: Rect, first_sample: u32, counts: impl IntoIterator<Item = u32>) -> Self {
        let mut counts = counts.into_iter();
        let mut blocks = Vec::new();
        for y in window.y..window.y + window.height {
            let row: Vec<u32> = counts.by_ref().take(window.width as usize).collect();
            let mut x = window.x;
            for run in row.chunk_by(|a, b| a == b) {
                let width = run.len() as u32;
                let samples = first_sample..first_sample.saturating_add(run[0]);
                blocks.push(Block { window: Rect { x, y, width, height: 1 }, samples });
                x += width;
            }
        }
        Self { blocks: canonical(blocks.into_iter().filter(|b| !b.is_empty()).collect()) }
    }

    /// The set in blocks that do not overlap, from the top down.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Whether there is no sample in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Some samples that are in both sets, if there are any.
    #[must_use]
    pub fn overlap(&self, other: &Self) -> Option<Block> {
        let pairs = self.blocks.iter().flat_map(|a| other.blocks.iter().map(move |b| (a, b)));
        pairs.filter_map(|(a, b)| a.intersection(b)).next()
    }

    /// The set of the samples of both.
    ///
    /// # Errors
    /// Some samples that are in both.
    pub fn union(&self, other: &Self) -> Result<Self, Block> {
        match self.overlap(other) {
            Some(common) => Err(common),
            None => Ok(Self { blocks: canonical([&self.blocks[..], &other.blocks].concat()) }),
        }
    }

    /// What of `whole` is not in the set.
    #[must_use]
    pub fn missing(&self, whole: &Block) -> Self {
        let mut left = vec![whole.clone()];
        left.retain(|b| !b.is_empty());
        for block in &self.blocks {
            let cut = |piece: &Block| match piece.intersection(block) {
                Some(hole) => piece.without(&hole).collect(),
                None => vec![piece.clone()],
            };
            left = left.iter().flat_map(cut).collect();
        }
        Self { blocks: canonical(left) }
    }

    /// The number of samples of each pixel of `window`, row by row from the top.
    #[must_use]
    pub fn counts(&self, window: Rect) -> Vec<u64> {
        let mut counts = vec![0; window.area()];
        for block in &self.blocks {
            let Some(common) = window.intersection(&block.window) else { continue };
            for y in common.y - window.y..common.y - window.y + common.height {
                let start = y as usize * window.width as usize + (common.x - window.x) as usize;
                let row = &mut counts[start..start + common.width as usize];
                row.iter_mut().for_each(|n| *n += block.samples.len() as u64);
            }
        }
        counts
    }
}

/// The first samples found that two of `blocks` have in common.
fn first_overlap(blocks: &[Block]) -> Option<Block> {
    let mut sorted: Vec<&Block> = blocks.iter().collect();
    sorted.sort_by_key(|b| b.window.y);
    let mut active: Vec<&Block> = Vec::new();
    for block in sorted {
        active.retain(|b| end_y(b) > block.window.y);
        if let Some(common) = active.iter().find_map(|b| b.intersection(block)) {
            return Some(common);
        }
        active.push(block);
    }
    None
}

fn end_y(block: &Block) -> u32 {
    block.window.y + block.window.height
}

/// Columns of pixels and the samples that all of them have.
#[derive(PartialEq)]
struct Span {
    columns: Range<u32>,
    samples: Vec<Range<u32>>,
}

/// The same samples in as few slabs of rows as possible, each in as few spans of columns as possible: a form that does not
/// depend on how the blocks were cut.
fn canonical(mut blocks: Vec<Block>) -> Vec<Block> {
    blocks.sort_by_key(|b| b.window.y);
    let mut edges: Vec<u32> = blocks.iter().flat_map(|b| [b.window.y, end_y(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    let mut slabs: Vec<(Range<u32>, Vec<Span>)> = Vec::new();
    let (mut next, mut active): (usize, Vec<&Block>) = (0, Vec::new());
    for rows in edges.windows(2).map(|pair| pair[0]..pair[1]) {
        active.retain(|b| end_y(b) > rows.start);
        while let Some(block) = blocks.get(next).filter(|b| b.window.y == rows.start) {
            active.push(block);
            next += 1;
        }
        let spans = spans_of(&active);
        match slabs.last_mut() {
            Some((above, same)) if above.end == rows.start && *same == spans => above.end = rows.end,
            _ => slabs.push((rows, spans)),
        }
    }
    let block = |rows: &Range<u32>, span: &Span, samples: &Range<u32>| Block {
        window: Rect {
            x: span.columns.start,
            y: rows.start,
            width: span.columns.len() as u32,
            height: rows.len() as u32,
        },
        samples: samples.clone(),
    };
    let of_slab = |(rows, spans): &(Range<u32>, Vec<Span>)| -> Vec<Block> {
        spans.iter().flat_map(|span| span.samples.iter().map(move |s| block(rows, span, s))).collect()
    };
    slabs.iter().flat_map(of_slab).collect()
}

/// What blocks that share some rows cover there.
fn spans_of(blocks: &[&Block]) -> Vec<Span> {
    let mut edges: Vec<u32> = blocks.iter().flat_map(|b| [b.window.x, b.window.x + b.window.width]).collect();
    edges.sort_unstable();
    edges.dedup();
    let mut spans: Vec<Span> = Vec::new();
    for columns in edges.windows(2).map(|pair| pair[0]..pair[1]) {
        let here = |b: &&&Block| b.window.x <= columns.start && columns.end <= b.window.x + b.window.width;
        let mut samples: Vec<Range<u32>> = blocks.iter().filter(here).map(|b| b.samples.clone()).collect();
        samples.sort_by_key(|s| s.start);
        samples.dedup_by(|next, before| {
            let adjacent = before.end == next.start;
            if adjacent {
                before.end = next.end;
            }
            adjacent
        });
        match spans.last_mut() {
            Some(left) if left.columns.end == columns.start && left.samples == samples => {
                left.columns.end = columns.end;
            }
            _ if samples.is_empty() => {}
            _ => spans.push(Span { columns, samples }),
        }
    }
    spans
}

/// A text that is no [`Block`] or [`Coverage`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` does not say which samples of which pixels: expected X,Y,WIDTH,HEIGHT,FIRST..END")]
pub struct UnknownBlock(pub String);

impl Block {
    /// As [`Block::from_str`] reads it: `x,y,width,height,first..end`.
    #[must_use]
    pub fn to_text(&self) -> String {
        let Rect { x, y, width, height } = self.window;
        format!("{x},{y},{width},{height},{}..{}", self.samples.start, self.samples.end)
    }
}

impl FromStr for Block {
    type Err = UnknownBlock;

    fn from_str(text: &str) -> Result<Self, UnknownBlock> {
        let parse = || {
            let (window, samples) = text.rsplit_once(',')?;
            let numbers: Vec<u32> = window.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
            let [x, y, width, height] = numbers.try_into().ok()?;
            let (start, end) = samples.split_once("..")?;
            x.checked_add(width).and(y.checked_add(height))?;
            let samples = start.parse().ok()?..end.parse().ok()?;
            Some(Self { window: Rect { x, y, width, height }, samples })
        };
        parse().ok_or_else(|| UnknownBlock(text.to_owned()))
    }
}

impl Coverage {
    /// The blocks as [`Coverage::from_str`] reads them: separated by semicolons.
    #[must_use]
    pub fn to_text(&self) -> String {
        self.blocks.iter().map(Block::to_text).collect::<Vec<_>>().join(";")
    }
}

impl FromStr for Coverage {
    type Err = UnknownBlock;

    fn from_str(text: &str) -> Result<Self, UnknownBlock> {
        let blocks: Vec<Block> =
            text.split(';').filter(|t| !t.is_empty()).map(str::parse).collect::<Result<_, _>>()?;
        Self::new(blocks).map_err(|_| UnknownBlock(text.to_owned()))
    }
}

#[cfg(test)]
mod tests;
