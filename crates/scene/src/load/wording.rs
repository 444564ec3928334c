//! Messages of the parsers of JSON and TOML in words of these formats: they name types of this program otherwise.

use std::borrow::Cow;

/// Types after `expected`, and what a file calls such values.
const TYPES: [(&[&str], &str); 6] = [
    (&["u8", "u16", "u32", "u64", "usize"], "a whole number that is not negative"),
    (&["i8", "i16", "i32", "i64", "isize"], "a whole number"),
    (&["f32", "f64"], "a number"),
    (&["bool"], "true or false"),
    (&["map"], "a table of names and values"),
    (&["sequence"], "a list"),
];

/// The message without names of types: "expected struct Image with 3 elements" becomes "expected a table of names and
/// values".
pub(super) fn without_types(message: &str) -> Cow<'_, str> {
    const EXPECTED: &str = "expected ";
    let Some((before, after)) = message.rsplit_once(EXPECTED) else { return Cow::Borrowed(message) };
    let mut words = after.split(' ');
    let first = words.next().unwrap_or_default();
    let taken = |count: usize| after.split(' ').take(count).map(|word| word.len() + 1).sum::<usize>();
    let ends_with_count = |count: usize| {
        let rest: Vec<&str> = after.split(' ').skip(count).take(3).collect();
        matches!(rest[..], ["with", number, element]
            if number.parse::<u32>().is_ok() && element.starts_with("element"))
    };
    let (count, replacement) = match (first, words.next()) {
        ("struct", Some(_)) => (2, "a table of names and values"),
        ("enum", Some(_)) => (2, "one of the names that the format has"),
        ("tuple" | "unit" | "newtype", Some("struct" | "variant")) => (3, "a value of the format"),
        ("internally" | "adjacently" | "untagged", _) => return Cow::Borrowed(message),
        ("a", Some("sequence" | "map")) => {
            let is_list = after.starts_with("a sequence");
            (2, if is_list { "a list" } else { "a table of names and values" })
        }
        (name, _) => {
            let name = name.trim_end_matches([',', '.']);
            match TYPES.iter().find(|(names, _)| names.contains(&name)) {
                Some((_, replacement)) => {
                    return Cow::Owned(format!("{before}{EXPECTED}{replacement}{}", &after[name.len()..]));
                }
                None => return Cow::Borrowed(message),
            }
        }
    };
    let count = if ends_with_count(count) { count + 3 } else { count };
    let rest = after.get(taken(count)..).unwrap_or_default();
    let space = if rest.is_empty() { "" } else { " " };
    Cow::Owned(format!("{before}{EXPECTED}{replacement}{space}{rest}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_become_words() {
        for (message, expected) in [
            (
                "invalid length 0, expected struct Image with 3 elements",
                "invalid length 0, expected a table of names and values",
            ),
            (
                "invalid length 0, expected struct Image with 3 elements at line 1 column 9",
                "invalid length 0, expected a table of names and values at line 1 column 9",
            ),
            (
                "invalid type: string \"a\", expected struct Node",
                "invalid type: string \"a\", expected a table of names and values",
            ),
            (
                "invalid type: map, expected f32 at line 2 column 1",
                "invalid type: map, expected a number at line 2 column 1",
            ),
            (
                "invalid value: integer `-1`, expected usize",
                "invalid value: integer `-1`, expected a whole number that is not negative",
            ),
            ("invalid type: map, expected a sequence", "invalid type: map, expected a list"),
            ("expected a string", "expected a string"),
            ("unknown field `a`, expected `b`", "unknown field `a`, expected `b`"),
            ("the file ends", "the file ends"),
        ] {
            assert_eq!(without_types(message), expected);
        }
    }
}
