//! Lines, words and numbers of OBJ and MTL files.

use std::borrow::Cow;

/// The logical lines of a text: without surrounding white space, joined where one ends in `\`.
///
/// A comment never goes on in the next line, so that a path at its end does no harm.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { rest: text }
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = memchr::memchr(b'\n', self.rest);
        let (line, rest) = end.map_or((self.rest, &[][..]), |end| (&self.rest[..end], &self.rest[end + 1..]));
        self.rest = rest;
        Some(trim(line))
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Cow<'a, [u8]>;

    fn next(&mut self) -> Option<Cow<'a, [u8]>> {
        let line = self.physical()?;
        if !goes_on(line) {
            return Some(Cow::Borrowed(line));
        }
        let mut joined = line[..line.len() - 1].to_vec();
        while let Some(line) = self.physical() {
            joined.push(b' ');
            joined.extend_from_slice(line);
            if !goes_on(line) {
                break;
            }
            joined.pop();
        }
        Some(Cow::Owned(joined))
    }
}

fn goes_on(line: &[u8]) -> bool {
    line.last() == Some(&b'\\') && before_comment(line).len() == line.len()
}

/// What stands before a comment: a `#` at the start of a word begins one. Inside a word it is a part of a name.
pub(super) fn before_comment(line: &[u8]) -> &[u8] {
    let begins = |at: &usize| *at == 0 || is_space(line[*at - 1]);
    let comment = memchr::memchr_iter(b'#', line).find(begins);
    trim(&line[..comment.unwrap_or(line.len())])
}

/// What stands before a comment where no name is: any `#` begins one.
pub(super) fn before_hash(line: &[u8]) -> &[u8] {
    &line[..memchr::memchr(b'#', line).unwrap_or(line.len())]
}

/// Text whose lines end in `\n`: that of old Macs, with `\r` alone, is converted.
pub(super) fn with_line_feeds(text: &[u8]) -> Cow<'_, [u8]> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text); // byte order mark
    if memchr::memchr(b'\n', text).is_some() || memchr::memchr(b'\r', text).is_none() {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.iter().map(|c| if *c == b'\r' { b'\n' } else { *c }).collect())
}

/// Cuts a text into pieces of about `size` bytes, each ending where a logical line does.
pub(super) fn chunks(text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut chunks = Vec::with_capacity(text.len() / size + 1);
    let mut start = 0;
    while start < text.len() {
        let mut end = (start + size).min(text.len());
        while end < text.len() {
            let Some(line_end) = memchr::memchr(b'\n', &text[end..]) else {
                end = text.len();
                break;
            };
            end += line_end + 1;
            let before = &text[start..end - 1];
            let before = before.strip_suffix(b"\r").unwrap_or(before);
            if !matches!(before.last(), Some(b'\\' | b' ' | b'\t' | b'\r')) {
                break; // white space might hide a continuation
            }
        }
        chunks.push(&text[start..end]);
        start = end;
    }
    chunks
}

fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c | 0)
}

/// Without white space at both ends.
pub(super) fn trim(mut text: &[u8]) -> &[u8] {
    while let [first, rest @ ..] = text
        && is_space(*first)
    {
        text = rest;
    }
    while let [rest @ .., last] = text
        && is_space(*last)
    {
        text = rest;
    }
    text
}

/// Takes the first word off a line; `None` when only white space is left.
#[inline]
pub(super) fn word<'a>(line: &mut &'a [u8]) -> Option<&'a [u8]> {
    let start = line.iter().position(|c| !is_space(*c))?;
    let rest = &line[start..];
    let length = rest.iter().position(|c| is_space(*c)).unwrap_or(rest.len());
    *line = &rest[length..];
    Some(&rest[..length])
}

/// Text for names: what is not UTF-8 is replaced.
pub(super) fn name(text: &[u8]) -> String {
    String::from_utf8_lossy(trim(text)).into_owned()
}

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// Reads a number as the standard library does, or `None` if the text is not one.
#[inline]
pub(super) fn number(text: &[u8]) -> Option<f32> {
    fast_number(text).or_else(|| std::str::from_utf8(text).ok()?.parse().ok())
}

/// The number that the longest readable start of the text holds.
pub(super) fn number_prefix(text: &[u8]) -> Option<f32> {
    (1..text.len().min(64)).rev().find_map(|length| number(&text[..length]))
}

/// Decimal numbers of few digits: `digits / 10ⁿ` in double precision, unless rounding that to single precision might
/// differ from rounding the exact value.
#[inline]
fn fast_number(text: &[u8]) -> Option<f32> {
    let (negative, text) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    };
    let (mut digits, mut count, mut fraction, mut at) = (0u64, 0, 0usize, 0);
    let mut in_fraction = false;
    while let Some(byte) = text.get(at) {
        match byte {
            b'0'..=b'9' => {
                digits = digits.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                count += 1;
                fraction += usize::from(in_fraction);
            }
            b'.' if !in_fraction => in_fraction = true,
            _ => break,
        }
        at += 1;
    }
    if at != text.len() || count == 0 || count > 15 {
        return None; // 15 digits are exact in double precision
    }
    let value = digits as f64 / POWERS[fraction];
    // One rounding so far. A second one is harmless unless the value looks like the middle between two floats.
    const HALF: u64 = 1 << 28;
    let near_middle = (value.to_bits() & ((HALF << 1) - 1)).abs_diff(HALF) <= 1;
    let normal = digits == 0 || value >= f64::from(f32::MIN_POSITIVE);
    (normal && !near_middle).then_some(if negative { -(value as f32) } else { value as f32 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lines(text: &str) -> Vec<String> {
        Lines::new(text.as_bytes()).map(|l| String::from_utf8(l.into_owned()).unwrap()).collect()
    }

    #[test]
    fn lines_are_trimmed_and_joined() {
        assert_eq!(lines("a b \r\n\n  c\\\r\n d\\\ne"), ["a b", "", "c d e"]);
        assert_eq!(lines("# C:\\\nf 1"), ["# C:\\", "f 1"]);
        assert_eq!(lines("v 1 # C:\\\nf 1"), ["v 1 # C:\\", "f 1"]);
        assert_eq!(lines("f 1 \\\n2 # a\\\nf 2"), ["f 1  2 # a\\", "f 2"]);
        assert_eq!(lines("map_Kd a#\\\nb"), ["map_Kd a# b"]);
        assert_eq!(before_comment(b"a#1 b # c # d"), b"a#1 b");
        assert_eq!(before_comment(b"# a"), b"");
        assert_eq!(lines("f \\"), ["f "]);
        assert_eq!(lines("\\\n\\\n\\"), ["  "]);
        assert_eq!(*with_line_feeds(b"a\rb"), *b"a\nb");
    }

    #[test]
    fn words_and_numbers() {
        let mut line = &b"\t a  1/2\t"[..];
        assert_eq!(word(&mut line), Some(&b"a"[..]));
        assert_eq!(word(&mut line), Some(&b"1/2"[..]));
        assert_eq!(word(&mut line), None);
        for (text, value) in [
            ("1", 1.0),
            ("+1", 1.0),
            ("-2.", -2.0),
            (".5", 0.5),
            ("-.7e+2", -70.0),
            ("1e5", 1e5),
            ("2.E-001", 0.2),
            ("0.1", 0.1),
            ("16777217", 16777216.0),
            ("340282350000000000000000000000000000000", f32::MAX),
        ] {
            assert_eq!(number(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["", "-", ".", "e5", "1,5", "3.1+e2", "--1", "0x10"] {
            assert_eq!(number(text.as_bytes()), None, "{text}");
        }
        assert_eq!(number_prefix(b"3.1+e2"), Some(3.1));
        assert_eq!(number_prefix(b"0.5f"), Some(0.5));
        assert_eq!(number_prefix(b"abc"), None);
        assert!(number(b"nan").unwrap().is_nan());
    }

    proptest! {
        #[test]
        fn numbers_are_those_of_the_standard_library(text in "[+-]?[0-9]{0,17}\\.?[0-9]{0,9}([eE][+-]?[0-9]{1,2})?") {
            prop_assert_eq!(number(text.as_bytes()), text.parse().ok());
        }

        #[test]
        fn values_survive_printing(value in prop::num::f32::NORMAL, digits in 0usize..12) {
            prop_assert_eq!(number(value.to_string().as_bytes()), Some(value));
            let text = format!("{value:.digits$}");
            prop_assert_eq!(number(text.as_bytes()), text.parse().ok());
        }

        #[test]
        fn chunks_hold_whole_logical_lines(text in "[ab\\\\\r\n #]{0,200}", size in 1usize..20) {
            let pieces = chunks(text.as_bytes(), size);
            prop_assert_eq!(pieces.concat(), text.as_bytes());
            let apart: Vec<_> = pieces.into_iter().flat_map(|p| Lines::new(p).map(Cow::into_owned)).collect();
            let whole: Vec<_> = Lines::new(text.as_bytes()).map(Cow::into_owned).collect();
            prop_assert_eq!(apart, whole);
        }
    }
}
