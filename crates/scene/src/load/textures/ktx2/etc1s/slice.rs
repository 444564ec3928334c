//! A picture: for each block an endpoint and selectors, predicted from its neighbours and from what came before.

use super::bits::Bits;
use super::codebooks::Codebooks;
use super::error::Etc1sError;
use super::huffman::Huffman;
use crate::load::textures::storage::place;

/// Symbol for "as the last 2×2 blocks", above those that say how four blocks are predicted.
const REPEAT_PREDICTIONS: u32 = 256;
/// Fewest repetitions that are written as such.
const MIN_REPETITIONS: u32 = 3;
/// Symbol for a run of selectors whose length is not a symbol itself.
const LONG_RUN: u32 = 63;

/// Prefix codes of all pictures of a file.
pub(super) struct Tables {
    /// How the endpoints of 2×2 blocks are predicted.
    predictions: Huffman,
    /// How far an endpoint's number is from that of the block before.
    endpoint_steps: Huffman,
    /// Selectors, places in their history, and the beginning of runs.
    selectors: Huffman,
    /// Lengths of runs.
    runs: Huffman,
    /// Selectors that the history remembers.
    history_length: usize,
}

impl Tables {
    /// Reads the section.
    ///
    /// # Errors
    /// See [`Etc1sError`].
    pub fn read(section: &[u8]) -> Result<Self, Etc1sError> {
        let mut bits = Bits::new(section, "the prefix codes");
        let tables = Self {
            predictions: Huffman::read(&mut bits)?,
            endpoint_steps: Huffman::read(&mut bits)?,
            selectors: Huffman::read(&mut bits)?,
            runs: Huffman::read(&mut bits)?,
            history_length: bits.take(13) as usize,
        };
        bits.check()?;
        Ok(tables)
    }
}

/// The pixels of a picture of `size` (width, height), row by row.
///
/// # Errors
/// See [`Etc1sError`].
pub(super) fn decode(
    data: &[u8],
    tables: &Tables,
    codebooks: &Codebooks,
    size: (usize, usize),
) -> Result<Vec<[u8; 3]>, Etc1sError> {
    let (columns, rows) = (size.0.div_ceil(4), size.1.div_ceil(4));
    let mut bits = Bits::new(data, "a picture");
    let mut endpoints = Endpoints::new(tables, codebooks.endpoints.len(), columns);
    let mut selectors = SelectorHistory::new(tables, codebooks.selectors.len());
    let mut pixels = vec![[0; 3]; size.0 * size.1];
    for y in 0..rows {
        for x in 0..columns {
            let missing = Etc1sError::Block(y * columns + x);
            let endpoint = endpoints.next(&mut bits, x, y)?;
            let selector = selectors.next(&mut bits)?;
            let (Some(endpoint), Some(selector)) = (endpoint, selector) else { return Err(missing) };
            let found = (codebooks.endpoints.get(endpoint), codebooks.selectors.get(selector));
            let (Some(colors), Some(selectors)) = found else { return Err(missing) };
            let color = |i: usize| colors[usize::from(selectors[i / 4] >> (2 * (i % 4)) & 3)];
            place(&mut pixels, size, (x, y), &std::array::from_fn(color));
        }
        bits.check()?;
    }
    Ok(pixels)
}

/// The endpoints of the blocks so far.
struct Endpoints<'t> {
    tables: &'t Tables,
    /// Size of the codebook.
    count: usize,
    /// The block's number in the codebook for this row up to the current block, and behind it still of the row above.
    row: Vec<usize>,
    /// The one above the block before, which `row` has no more.
    above_left: usize,
    /// The one of the block before, also at the start of a row.
    last: usize,
    /// For each two columns, how the blocks of the next row are predicted: two bits each.
    below: Vec<u32>,
    /// Predictions of this block and, above it in the number, those that are left of its 2×2 blocks.
    current: u32,
    /// Predictions of the last 2×2 blocks, and how often they are still to be taken.
    repeated: (u32, u32),
}

impl<'t> Endpoints<'t> {
    fn new(tables: &'t Tables, count: usize, columns: usize) -> Self {
        Self {
            tables,
            count,
            row: vec![0; columns],
            above_left: 0,
            last: 0,
            below: vec![0; columns.div_ceil(2)],
            current: 0,
            repeated: (0, 0),
        }
    }

    /// The number of the endpoint of the block in column `x` and row `y`, blocks row by row. `None` if it is predicted from
    /// a block outside the picture.
    fn next(&mut self, bits: &mut Bits, x: usize, y: usize) -> Result<Option<usize>, Etc1sError> {
        if x.is_multiple_of(2) {
            self.current = if y.is_multiple_of(2) { self.predictions(bits)? } else { self.below[x / 2] };
            self.below[x / 2] = self.current >> 4;
        }
        let prediction = self.current & 3;
        self.current >>= 2;
        let above = self.row[x];
        let endpoint = match prediction {
            0 if x > 0 => self.last,
            1 if y > 0 => above,
            2 if x > 0 && y > 0 => self.above_left,
            3 => {
                let step = self.tables.endpoint_steps.symbol(bits)? as usize;
                let next = self.last + step;
                if next >= self.count { next - self.count } else { next }
            }
            _ => return Ok(None),
        };
        self.row[x] = endpoint;
        self.above_left = above;
        self.last = endpoint;
        Ok(Some(endpoint))
    }

    /// How the endpoints of the next 2×2 blocks are predicted, two bits each, the upper row lowest.
    fn predictions(&mut self, bits: &mut Bits) -> Result<u32, Etc1sError> {
        let (last, times) = self.repeated;
        if times > 0 {
            self.repeated.1 -= 1;
            return Ok(last);
        }
        match self.tables.predictions.symbol(bits)? {
            REPEAT_PREDICTIONS => {
                // This one is the first of them.
                self.repeated.1 = bits.groups(4).saturating_add(MIN_REPETITIONS - 1);
                Ok(last)
            }
            symbol => {
                self.repeated.0 = symbol;
                Ok(symbol)
            }
        }
    }
}

/// The selectors that blocks used lately: more or less the most frequent ones first.
struct SelectorHistory<'t> {
    tables: &'t Tables,
    /// Size of the codebook.
    count: usize,
    recent: Vec<usize>,
    /// Where a new one goes: a place in the second half.
    next: usize,
    /// For how many blocks more the first one is taken.
    run: u32,
}

impl<'t> SelectorHistory<'t> {
    fn new(tables: &'t Tables, count: usize) -> Self {
        let length = tables.history_length;
        Self { tables, count, recent: vec![0; length], next: length / 2, run: 0 }
    }

    /// The number of the next block's selectors. `None` if it is a place that the history does not have.
    fn next(&mut self, bits: &mut Bits) -> Result<Option<usize>, Etc1sError> {
        if self.run > 0 {
            self.run -= 1;
            return Ok(self.recent.first().copied());
        }
        let symbol = self.tables.selectors.symbol(bits)? as usize;
        if symbol < self.count {
            self.add(symbol);
            return Ok(Some(symbol));
        }
        let place = symbol - self.count;
        if place == self.recent.len() {
            // This block is the first of the run.
            self.run = 2 + match self.tables.runs.symbol(bits)? {
                LONG_RUN => bits.groups(7).min(u32::MAX - 2),
                length => length,
            };
            return Ok(self.recent.first().copied());
        }
        let found = self.recent.get(place).copied();
        if found.is_some() {
            self.recent.swap(place, place / 2);
        }
        Ok(found)
    }

    fn add(&mut self, selector: usize) {
        let length = self.recent.len();
        if let Some(place) = self.recent.get_mut(self.next) {
            *place = selector;
            self.next = if self.next + 1 == length { length / 2 } else { self.next + 1 };
        }
    }
}
