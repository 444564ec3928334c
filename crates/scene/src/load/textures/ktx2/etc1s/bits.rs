//! Bits of a section, and the codes for numbers that are made of them.

use super::error::Etc1sError;

/// Bits from the lowest of the first byte on. Behind the end they are zero; [`Bits::check`] says whether that happened.
pub(super) struct Bits<'d> {
    data: &'d [u8],
    /// Number of the next bit.
    next: usize,
    /// What is read, for messages.
    section: &'static str,
}

impl<'d> Bits<'d> {
    pub fn new(data: &'d [u8], section: &'static str) -> Self {
        Self { data, next: 0, section }
    }

    /// The next bit.
    pub fn bit(&mut self) -> u32 {
        let byte = self.data.get(self.next / 8).copied().unwrap_or(0);
        let bit = byte >> (self.next % 8) & 1;
        self.next += 1;
        bit.into()
    }

    /// The next `count` bits, at most 32, the first one lowest.
    pub fn take(&mut self, count: u32) -> u32 {
        (0..count).fold(0, |value, i| value | self.bit() << i)
    }

    /// A number in groups of `width` bits, lowest first, each followed by whether there is another.
    pub fn groups(&mut self, width: u32) -> u32 {
        let mut value = 0;
        for shift in (0..32).step_by(width as usize) {
            value |= self.take(width) << shift;
            if self.bit() == 0 {
                break;
            }
        }
        value
    }

    /// Whether all bits that were asked for were there.
    ///
    /// # Errors
    /// [`Etc1sError::End`].
    pub fn check(&self) -> Result<(), Etc1sError> {
        if self.next > self.data.len() * 8 { Err(Etc1sError::End(self.section)) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_from_their_lowest_bit() {
        let mut bits = Bits::new(&[0b1011_0110, 0b0000_0001], "test");
        assert_eq!([bits.take(3), bits.take(6), bits.bit()], [0b110, 0b11_0110, 0]);
        assert_eq!(bits.check(), Ok(()));
        assert_eq!(bits.take(7), 0);
        assert_eq!(bits.check(), Err(Etc1sError::End("test")));
        // 5 + 16 · 2: two groups of four bits, 1 says that the second follows.
        assert_eq!(Bits::new(&[0b0101_0101, 0], "test").groups(4), 5 + 16 * 2);
        assert_eq!(Bits::new(&[0xff; 5], "test").groups(7), u32::MAX);
    }
}
