//! The subcommands, one file each.

#[allow(clippy::disallowed_methods, reason = "measurements, and scenes that only they show")]
pub mod bench;
pub mod compare;
pub mod completions;
pub mod dataset;
pub mod denoise;
pub mod doctor;
pub mod explain;
pub mod info;
mod loading;
pub mod man;
pub mod merge;
pub mod render;
pub mod scenes;
pub mod sensor;
pub mod submit;
mod tone;
pub mod tonemap;
#[cfg_attr(not(feature = "window"), path = "view_left_out.rs")]
pub mod view;

use alhazen::{LoadError, LoadOptions, Loaded, Source};
use anyhow::Context;

/// Loads what the user named, with `parameters`; a misspelt built-in scene yields a suggestion.
pub fn load_scene(
    name: &str,
    parameters: &[(String, String)],
    options: &LoadOptions,
) -> anyhow::Result<Loaded> {
    let mut source = Source::parse(name);
    source.parameters = parameters.iter().cloned().collect();
    let result = source.load(options);
    let suggestion = match &result {
        Err(LoadError::UnknownScene { name, .. }) => closest(name),
        _ => None,
    };
    result.with_context(|| match suggestion {
        Some(suggestion) => format!("cannot load the scene {name}; did you mean {suggestion}?"),
        None => format!("cannot load the scene {name}"),
    })
}

/// The built-in scene whose name is most like `name`, if any is like it.
fn closest(name: &str) -> Option<&'static str> {
    let distances = alhazen::builtin::list().into_iter().map(|b| (edit_distance(name, b.name), b.name));
    distances.min().filter(|(distance, known)| *distance <= known.len() / 3).map(|(_, known)| known)
}

/// Number of letters to insert, delete or replace to get from one word to the other.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// Parses `NAME=VALUE`.
pub fn parse_parameter(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    Ok((name.trim().to_owned(), value.trim().to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typing_errors_find_their_scene() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(closest("cornel"), Some("cornell"));
        assert_eq!(closest("three-sphere"), Some("three-spheres"));
        assert_eq!(closest("teapot"), None);
    }
}
