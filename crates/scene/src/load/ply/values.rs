//! Numbers one after the other, from text or from bytes.

use super::header::{Format, Scalar};

/// Reads the data of a PLY file from front to back.
pub(super) struct Values<'a> {
    bytes: &'a [u8],
    at: usize,
    format: Format,
}

/// Why a number could not be read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ValueError {
    /// The file ends.
    End,
    /// A word of the text is not a number.
    NotANumber,
}

impl<'a> Values<'a> {
    pub(super) fn new(bytes: &'a [u8], format: Format) -> Self {
        Self { bytes, at: 0, format }
    }

    /// Bytes that are left.
    pub(super) fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next number.
    #[inline]
    pub(super) fn next(&mut self, scalar: Scalar) -> Result<f64, ValueError> {
        match self.format {
            Format::Ascii => self.word(),
            Format::LittleEndian => self.binary(scalar, true),
            Format::BigEndian => self.binary(scalar, false),
        }
    }

    /// Passes over numbers.
    pub(super) fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), ValueError> {
        if self.format == Format::Ascii {
            return (0..count).try_for_each(|_| self.word().map(|_| ()));
        }
        let size = count.saturating_mul(scalar.size() as u64);
        if size > self.remaining() as u64 {
            return Err(ValueError::End);
        }
        self.at += size as usize;
        Ok(())
    }

    #[inline]
    fn binary(&mut self, scalar: Scalar, little: bool) -> Result<f64, ValueError> {
        macro_rules! read {
            ($type:ty) => {{
                const SIZE: usize = size_of::<$type>();
                let bytes = self.bytes[self.at..].first_chunk::<SIZE>().ok_or(ValueError::End)?;
                self.at += SIZE;
                f64::from(if little {
                    <$type>::from_le_bytes(*bytes)
                } else {
                    <$type>::from_be_bytes(*bytes)
                })
            }};
        }
        Ok(match scalar {
            Scalar::I8 => read!(i8),
            Scalar::U8 => read!(u8),
            Scalar::I16 => read!(i16),
            Scalar::U16 => read!(u16),
            Scalar::I32 => read!(i32),
            Scalar::U32 => read!(u32),
            Scalar::F32 => read!(f32),
            Scalar::F64 => read!(f64),
        })
    }

    fn word(&mut self) -> Result<f64, ValueError> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|c| !c.is_ascii_whitespace()).ok_or(ValueError::End)?;
        let word = &rest[start..];
        let length = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.at += start + length;
        let text = std::str::from_utf8(&word[..length]).map_err(|_| ValueError::NotANumber)?;
        text.parse().map_err(|_| ValueError::NotANumber)
    }
}
