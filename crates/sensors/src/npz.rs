//! Arrays in NumPy's file format, several in a zip archive (.npz), not compressed.
//!
//! Format: NEP 1, <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>, version 1.0.

use std::io::{Cursor, Error, Write};
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

/// An archive that grows in memory.
pub(crate) struct Npz(ZipWriter<Cursor<Vec<u8>>>);

/// A number that arrays are made of.
pub(crate) trait Number: Copy {
    /// NumPy's name of the type, with the byte order.
    const DTYPE: &'static str;

    /// Appends its bytes, the least significant first.
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($type:ty, $name:literal;)*) => {$(
        impl Number for $type {
            const DTYPE: &'static str = $name;

            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

number! {
    f32, "<f4";
    u16, "<u2";
    u32, "<u4";
}

impl Npz {
    pub fn new() -> Self {
        Self(ZipWriter::new(Cursor::new(Vec::new())))
    }

    /// Adds an array in C order.
    pub fn add<T: Number>(&mut self, name: &str, shape: &[usize], values: &[T]) -> Result<(), Error> {
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.0.start_file(format!("{name}.npy"), options)?;
        self.0.write_all(&array(shape, values))
    }

    /// The whole archive.
    pub fn finish(self) -> Result<Vec<u8>, Error> {
        Ok(self.0.finish()?.into_inner())
    }
}

/// An .npy file.
fn array<T: Number>(shape: &[usize], values: &[T]) -> Vec<u8> {
    let sides: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header = format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({sides}), }}", T::DTYPE);
    // Blanks and a line's end fill the header, so that the numbers start at a multiple of 64 bytes.
    const BEFORE: usize = 10;
    let length = (BEFORE + header.len() + 1).next_multiple_of(64) - BEFORE;
    header += &" ".repeat(length - header.len() - 1);
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    (length as u16).append(&mut bytes);
    bytes.extend_from_slice(header.as_bytes());
    values.iter().for_each(|v| v.append(&mut bytes));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_what_numpy_writes() {
        // numpy.lib.format.write_array of numpy.array([[1, 2], [258, 4]], "<u2"), but for the order of blanks.
        let bytes = array(&[2, 2], &[1u16, 2, 258, 4]);
        assert_eq!(bytes.len(), 128 + 8);
        assert_eq!(bytes[..10], *b"\x93NUMPY\x01\x00\x76\x00");
        assert!(bytes[10..].starts_with(b"{'descr': '<u2', 'fortran_order': False, 'shape': (2, 2, ), }  "));
        assert_eq!(bytes[127], b'\n');
        assert_eq!(bytes[128..], [1, 0, 2, 0, 2, 1, 4, 0]);
    }
}
