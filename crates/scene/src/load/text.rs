//! Text files in the encodings that editors and exporters write.

use super::LoadError;
use std::borrow::Cow;
use std::path::Path;

/// The text of a file as UTF-8 (or another superset of ASCII, which is left alone) without byte order mark.
///
/// UTF-16 is converted: by its byte order mark, or by the zero bytes of its first two characters.
///
/// # Errors
/// [`LoadError::Malformed`] for UTF-16 with half a character, and for UTF-32.
pub(super) fn decoded<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, LoadError> {
    let fail = |message: &str| LoadError::malformed(path, "encoding", message);
    let read = match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => {
            return Err(fail("the text is UTF-32; save it as UTF-8"));
        }
        [0xef, 0xbb, 0xbf, rest @ ..] => return Ok(Cow::Borrowed(rest)),
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        [1..=127, 0, 1..=127, 0, ..] => u16::from_le_bytes,
        [0, 1..=127, 0, 1..=127, ..] => u16::from_be_bytes,
        _ => return Ok(Cow::Borrowed(bytes)),
    };
    let (units, rest) = bytes.as_chunks::<2>();
    let text: Result<String, _> = char::decode_utf16(units.iter().map(|unit| read(*unit))).collect();
    let text = text.ok().filter(|_| rest.is_empty());
    let text = text.ok_or_else(|| fail("the text is damaged UTF-16; save it as UTF-8"))?;
    Ok(Cow::Owned(text.trim_start_matches('\u{feff}').as_bytes().to_vec()))
}

/// The line that a place in a text is in, from 1. Lines end in LF, CR LF, or CR alone.
pub(super) fn line_at(text: &[u8], at: usize) -> usize {
    let before = &text[..at.min(text.len())];
    let ends = before.iter().enumerate().filter(|(i, byte)| match byte {
        b'\n' => true,
        b'\r' => text.get(i + 1) != Some(&b'\n'),
        _ => false,
    });
    1 + ends.count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings() {
        let decode = |bytes: &[u8]| decoded(Path::new("a"), bytes).map(Cow::into_owned);
        let utf16 = |text: &str, bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
            text.encode_utf16().flat_map(bytes).collect()
        };
        for text in ["v 1 2 3\n", "# Köln 🎲"] {
            for mark in ["", "\u{feff}"] {
                let marked = format!("{mark}{text}");
                for file in [
                    marked.clone().into_bytes(),
                    utf16(&marked, u16::to_le_bytes),
                    utf16(&marked, u16::to_be_bytes),
                ] {
                    assert_eq!(decode(&file).expect("sound"), text.as_bytes());
                }
            }
        }
        assert_eq!(decode(b"\xe4").expect("Latin-1 is left alone"), b"\xe4");
        assert!(decode(b"\xff\xfe\0\0v\0\0\0").expect_err("UTF-32").to_string().contains("UTF-32"));
        assert!(decode(b"\xff\xfev").expect_err("half").to_string().contains("damaged UTF-16"));
    }

    #[test]
    fn lines_end_in_three_ways() {
        assert_eq!([0, 2, 3, 5, 7].map(|at| line_at(b"a\nb\rc\r\nd", at)), [1, 2, 2, 3, 4]);
    }
}
