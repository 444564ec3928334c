//! Numbers one after the other, from text or from bytes.

use super::header::{Format, Scalar};
use std::cmp::Ordering;

/// Reads the data of a PLY file from front to back.
pub(super) struct Values<'a> {
    bytes: &'a [u8],
    at: usize,
    format: Format,
    lines: Lines,
    /// Text behind the last number of a row, up to the line's end: how often, and where first.
    pub(super) surplus: Option<(usize, usize)>,
}

/// What lines mean in the data of a text file.
#[derive(Clone, Copy, PartialEq)]
enum Lines {
    /// A row may go on in the next line, and several rows may share one: they are white space.
    Free,
    /// Every row begins a line, and may go on in the next one.
    BeginRows,
    /// Every row is a line.
    AreRows,
}

/// Why a number could not be read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ValueError {
    /// The file ends.
    End,
    /// A word of the text is not a number.
    NotANumber,
    /// The line has too few numbers.
    ShortLine,
}

impl<'a> Values<'a> {
    pub(super) fn new(bytes: &'a [u8], format: Format) -> Self {
        Self { bytes, at: 0, format, lines: Lines::Free, surplus: None }
    }

    /// Says how many rows the data should have. In a text with as many lines, or more, each row begins a line: numbers
    /// that are too many must not shift what follows.
    pub(super) fn expect_rows(&mut self, rows: u64) {
        if self.format != Format::Ascii {
            return;
        }
        let lines = self.bytes.split(|byte| matches!(byte, b'\n' | b'\r'));
        let lines = lines.filter(|line| !line.trim_ascii().is_empty()).count() as u64;
        self.lines = match lines.cmp(&rows) {
            Ordering::Less => Lines::Free,
            Ordering::Equal => Lines::AreRows,
            Ordering::Greater => Lines::BeginRows,
        };
    }

    /// Begins a row.
    pub(super) fn begin_row(&mut self) {
        if self.lines == Lines::AreRows {
            let rest = &self.bytes[self.at..];
            self.at += rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len());
        }
    }

    /// Ends a row: what is left in its line belongs to no other row.
    pub(super) fn end_row(&mut self) {
        if self.lines == Lines::Free {
            return;
        }
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
        if !rest[..end].trim_ascii().is_empty() {
            let (count, _) = self.surplus.get_or_insert((0, self.at));
            *count += 1;
        }
        self.at += end;
    }

    /// What is left of the data: non-blank lines of a text, or bytes.
    pub(super) fn left_over(&self) -> Option<String> {
        let rest = &self.bytes[self.at..];
        if self.format != Format::Ascii {
            return (!rest.is_empty()).then(|| format!("{} bytes", rest.len()));
        }
        let lines = rest.split(|byte| matches!(byte, b'\n' | b'\r'));
        let count = lines.filter(|line| !line.trim_ascii().is_empty()).count();
        (count > 0).then(|| format!("{count} lines"))
    }

    /// Where the next number is looked for, in bytes.
    pub(super) fn position(&self) -> usize {
        self.at
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
        if self.lines == Lines::AreRows && rest[..start].iter().any(|c| matches!(c, b'\n' | b'\r')) {
            return Err(ValueError::ShortLine);
        }
        let word = &rest[start..];
        let length = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.at += start + length;
        let text = std::str::from_utf8(&word[..length]).map_err(|_| ValueError::NotANumber)?;
        text.parse().map_err(|_| ValueError::NotANumber)
    }
}
