//! Where the bytes of a buffer or an image are: in the URI itself or in a file next to this one.

use crate::load::LoadOptions;
use crate::load::textures::find_file;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::path::{Path, PathBuf};

/// What a URI of a buffer or an image leads to.
#[derive(Debug, PartialEq)]
pub(super) enum Target {
    /// The bytes were in the URI.
    Data(Vec<u8>),
    /// A file on this machine; it need not exist.
    File(PathBuf),
}

/// Writers disagree about padding; the data is the same.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Resolves a URI that stands in the file `path`.
///
/// Percent-encoded and plain names both work, relative or absolute; network addresses are refused. The error is a
/// sentence for the user.
pub(super) fn resolve(path: &Path, uri: &str, options: &LoadOptions) -> Result<Target, String> {
    if has_prefix(uri, "data:") {
        return data(uri).map(Target::Data);
    }
    let shown = shorten(uri);
    if let Some(scheme) = scheme(uri) {
        return Err(format!("`{shown}` has the scheme `{scheme}`: only files and embedded data are read"));
    }
    if uri.starts_with("//") || uri.starts_with("\\\\") {
        return Err(format!("`{shown}` names another machine: only local files are read"));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let decoded = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
    // A file may really be called `a%20b`.
    let found = find_file(folder, &decoded, options).or_else(|| find_file(folder, uri, options));
    Ok(Target::File(found.unwrap_or_else(|| folder.join(&*decoded))))
}

/// The start of a URI, for messages.
pub(super) fn shorten(uri: &str) -> String {
    if uri.chars().nth(80).is_none() { uri.into() } else { uri.chars().take(80).chain(['…']).collect() }
}

fn data(uri: &str) -> Result<Vec<u8>, String> {
    let (head, body) = uri.split_once(',').ok_or("the data URI has no comma")?;
    if !head.to_ascii_lowercase().ends_with(";base64") {
        return Err(format!("the data URI `{}` is not base64", shorten(head)));
    }
    BASE64.decode(body).map_err(|error| format!("the data URI is not valid base64: {error}"))
}

/// The scheme of an absolute URI. One letter is a Windows drive.
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let valid = scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    (valid && scheme.len() > 1 && scheme.starts_with(|c: char| c.is_ascii_alphabetic())).then_some(scheme)
}

fn has_prefix(text: &str, prefix: &str) -> bool {
    text.get(..prefix.len()).is_some_and(|start| start.eq_ignore_ascii_case(prefix))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolve_in(folder: &Path, uri: &str) -> Result<Target, String> {
        let path = folder.join("scene.gltf");
        let resolved = LoadOptions::default().session(&path, |options| Ok(resolve(&path, uri, options)));
        resolved.expect("nothing is over the budget")
    }

    #[test]
    fn embedded_data_is_decoded_with_and_without_padding() {
        let folder = Path::new("");
        for uri in ["data:application/octet-stream;base64,AAEC/w==", "DATA:;BASE64,AAEC/w"] {
            assert_eq!(resolve_in(folder, uri), Ok(Target::Data(vec![0, 1, 2, 255])), "{uri}");
        }
        for (uri, why) in [
            ("data:;base64,A*A=", "not valid base64"),
            ("data:text/plain,abc", "not base64"),
            ("data:;base64", "comma"),
        ] {
            let error = resolve_in(folder, uri).unwrap_err();
            assert!(error.contains(why), "{uri}: {error}");
        }
    }

    #[test]
    fn percent_encoded_and_plain_names_are_found() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a ❤.bin", "b%20c.bin"] {
            std::fs::write(folder.path().join(name), b"x").unwrap();
        }
        for (uri, name) in [
            ("a%20❤.bin", "a ❤.bin"),
            ("a%20%E2%9D%A4.bin", "a ❤.bin"),
            ("b%20c.bin", "b%20c.bin"),
            ("b%2520c.bin", "b%20c.bin"),
            ("missing.bin", "missing.bin"),
        ] {
            assert_eq!(
                resolve_in(folder.path(), uri),
                Ok(Target::File(folder.path().join(name))),
                "{uri} should lead to {name}"
            );
        }
    }

    #[test]
    fn the_network_is_refused() {
        for uri in ["http://example.org/a.bin", "https:a.bin", "file:///etc/hosts", "//host/a", "\\\\host\\a"]
        {
            assert!(resolve_in(Path::new(""), uri).is_err(), "{uri}");
        }
        assert!(resolve_in(Path::new(""), "C:\\a.bin").is_ok());
    }
}
