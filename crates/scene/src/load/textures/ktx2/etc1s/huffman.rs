//! Canonical prefix codes, as in Deflate, whose lengths are compressed themselves.

use super::bits::Bits;
use super::error::Etc1sError;

/// Longest code of a symbol.
const MAX_LENGTH: usize = 16;
/// Symbols of the code for lengths: the lengths 0 to 16, two runs of zeros and two repetitions.
const LENGTH_SYMBOLS: usize = 21;
/// In which order the lengths of that code's own symbols stand.
const LENGTH_ORDER: [usize; LENGTH_SYMBOLS] =
    [17, 18, 19, 20, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 16];

/// A prefix code: shorter codes come first, and among those of one length the lower symbols.
#[derive(Debug, Default)]
pub(super) struct Huffman {
    /// How many codes have each length.
    counts: [u32; MAX_LENGTH + 1],
    /// Symbols by their code.
    symbols: Vec<u16>,
}

impl Huffman {
    /// Reads a code, which may be without symbols.
    ///
    /// # Errors
    /// [`Etc1sError::Table`] and what reading bits gives.
    pub fn read(bits: &mut Bits) -> Result<Self, Etc1sError> {
        let count = bits.take(14) as usize;
        if count == 0 {
            return Ok(Self::default());
        }
        let stored = bits.take(5) as usize;
        let order = LENGTH_ORDER.get(..stored).ok_or(Etc1sError::Table)?;
        let mut lengths = [0; LENGTH_SYMBOLS];
        for symbol in order {
            lengths[*symbol] = bits.take(3) as u8;
        }
        let code = Self::of_lengths(&lengths)?;
        Self::of_lengths(&code.lengths(bits, count)?)
    }

    /// Lengths of `count` symbols, which this code has compressed.
    fn lengths(&self, bits: &mut Bits, count: usize) -> Result<Vec<u8>, Etc1sError> {
        let mut lengths = Vec::with_capacity(count);
        while lengths.len() < count {
            let last = lengths.last().copied().filter(|length| *length > 0);
            let (length, times) = match self.symbol(bits)? {
                17 => (0, 3 + bits.take(3)),
                18 => (0, 11 + bits.take(7)),
                19 => (last.ok_or(Etc1sError::Table)?, 3 + bits.take(2)),
                20 => (last.ok_or(Etc1sError::Table)?, 7 + bits.take(7)),
                length => (length as u8, 1),
            };
            lengths.resize(lengths.len() + times as usize, length);
        }
        bits.check()?;
        if lengths.len() > count { Err(Etc1sError::Table) } else { Ok(lengths) }
    }

    /// The code whose symbols have these lengths; 0: the symbol is not used. A code that leaves bits without meaning must
    /// have one symbol only.
    fn of_lengths(lengths: &[u8]) -> Result<Self, Etc1sError> {
        let mut counts = [0; MAX_LENGTH + 1];
        for length in lengths.iter().filter(|length| **length > 0) {
            counts[usize::from(*length)] += 1;
        }
        let share = |(length, count): (usize, &u32)| u64::from(*count) << (MAX_LENGTH - length);
        let taken: u64 = counts.iter().enumerate().map(share).sum();
        let used: u32 = counts.iter().sum();
        if taken != 1 << MAX_LENGTH && (used != 1 || taken > 1 << MAX_LENGTH) {
            return Err(Etc1sError::Table);
        }
        let mut symbols: Vec<u16> =
            (0..lengths.len() as u16).filter(|s| lengths[usize::from(*s)] > 0).collect();
        symbols.sort_by_key(|symbol| lengths[usize::from(*symbol)]);
        Ok(Self { counts, symbols })
    }

    /// The next symbol.
    ///
    /// # Errors
    /// [`Etc1sError::Symbol`] if the bits are no code.
    pub fn symbol(&self, bits: &mut Bits) -> Result<u32, Etc1sError> {
        // Codes of one length are consecutive numbers; `first` is the lowest of them.
        let (mut code, mut first, mut before) = (0, 0, 0);
        for count in &self.counts[1..] {
            code |= bits.bit();
            if code < first + count {
                // `code ≥ first`: what is below is a shorter code, or the last round would have ended here.
                return Ok(self.symbols[(before + code - first) as usize].into());
            }
            before += count;
            first = (first + count) << 1;
            code <<= 1;
        }
        Err(Etc1sError::Symbol)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_the_textbook_are_read() {
        // The example of RFC 1951: A to H of lengths 3, 3, 3, 3, 3, 2, 4, 4.
        let code = Huffman::of_lengths(&[3, 3, 3, 3, 3, 2, 4, 4]).expect("complete");
        // F = 00, A = 010, H = 1111, E = 110, most significant bit first.
        let mut bits = Bits::new(&[0b1110_1000, 0b0000_0111], "test");
        let read: Vec<u32> = (0..4).map(|_| code.symbol(&mut bits).expect("a symbol")).collect();
        assert_eq!(read, [5, 0, 7, 4]);
    }

    #[test]
    fn codes_that_are_none_are_refused() {
        assert!(matches!(Huffman::of_lengths(&[1, 1, 1]), Err(Etc1sError::Table)), "too many");
        assert!(matches!(Huffman::of_lengths(&[2, 2, 2]), Err(Etc1sError::Table)), "too few");
        let alone = Huffman::of_lengths(&[0, 3]).expect("a single symbol");
        assert_eq!(alone.symbol(&mut Bits::new(&[0], "test")), Ok(1));
        assert_eq!(alone.symbol(&mut Bits::new(&[0xff; 4], "test")), Err(Etc1sError::Symbol));
        assert_eq!(Huffman::default().symbol(&mut Bits::new(&[0], "test")), Err(Etc1sError::Symbol));
    }
}
