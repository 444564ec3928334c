//! The binary container (.glb): a header, a JSON chunk and at most one binary chunk.

use crate::{LoadError, LoadReport};
use std::path::Path;

/// The two parts of a file.
pub(super) struct Container<'a> {
    /// The JSON text.
    pub json: &'a [u8],
    /// The binary chunk that buffer 0 refers to.
    pub binary: Option<&'a [u8]>,
}

/// JSON longer than this is refused. Geometry belongs in buffers; the parsed form is several times larger.
const MAX_JSON: u64 = 512 << 20;

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

/// Splits a file into its JSON and its binary chunk. The content decides, not the file name's ending.
///
/// # Errors
/// [`LoadError::Malformed`], [`LoadError::TooLarge`].
pub(super) fn split<'a>(
    path: &Path,
    file: &'a [u8],
    report: &mut LoadReport,
) -> Result<Container<'a>, LoadError> {
    let container = if file.starts_with(MAGIC) || is_glb(path) {
        split_binary(path, file, report)?
    } else {
        Container { json: file, binary: None }
    };
    let size = container.json.len() as u64;
    if size > MAX_JSON {
        return Err(LoadError::TooLarge {
            path: path.into(),
            what: "the JSON".into(),
            size,
            limit: MAX_JSON,
        });
    }
    let Some(json) = container.json.strip_prefix(b"\xef\xbb\xbf") else { return Ok(container) };
    report.repaired("the JSON starts with a byte order mark");
    Ok(Container { json, ..container })
}

fn is_glb(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"))
}

fn split_binary<'a>(
    path: &Path,
    file: &'a [u8],
    report: &mut LoadReport,
) -> Result<Container<'a>, LoadError> {
    let malformed = |message: String| LoadError::malformed(path, "binary container", message);
    if !file.starts_with(MAGIC) {
        return Err(malformed("does not start with `glTF`".into()));
    }
    let (Some(version), Some(length)) = (u32_at(file, 4), u32_at(file, 8)) else {
        return Err(malformed(format!("the header has 12 bytes, the file only {}", file.len())));
    };
    if version != 2 {
        return Err(malformed(format!("version {version} is not supported, only 2")));
    }
    // Some writers leave the length wrong; what counts is whether the chunks are whole.
    if u64::from(length) != file.len() as u64 {
        report.repaired(format!("the header declares {length} bytes, the file has {}", file.len()));
    }
    let (kind, json, rest) = chunk(file.get(12..).unwrap_or_default()).map_err(malformed)?;
    if kind != JSON {
        return Err(malformed(format!("the first chunk has type {kind:#010x} instead of JSON")));
    }
    let end = file.len() - rest.len();
    if rest.is_empty() || end as u64 >= u64::from(length) {
        return Ok(Container { json, binary: None }); // what follows the declared length is not the file's
    }
    let (kind, binary, rest) = chunk(rest).map_err(malformed)?;
    if kind == JSON {
        return Err(malformed("has two JSON chunks".into()));
    }
    if !rest.is_empty() {
        report.info("chunks after the binary one are skipped");
    }
    Ok(Container { json, binary: (kind == BIN).then_some(binary) })
}

/// The type and the content of the first chunk, and what follows it.
fn chunk(data: &[u8]) -> Result<(u32, &[u8], &[u8]), String> {
    let (Some(length), Some(kind)) = (u32_at(data, 0), u32_at(data, 4)) else {
        return Err(format!("a chunk header has 8 bytes, only {} are left", data.len()));
    };
    let data = &data[8..];
    let Some((content, rest)) = data.split_at_checked(length as usize) else {
        return Err(format!("a chunk declares {length} bytes, only {} are left", data.len()));
    };
    Ok((kind, content, rest))
}

fn u32_at(data: &[u8], at: usize) -> Option<u32> {
    let bytes = data.get(at..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let mut file = [MAGIC, &2u32.to_le_bytes(), &[0; 4]].concat();
        for (kind, data) in chunks {
            file.extend((data.len() as u32).to_le_bytes());
            file.extend(kind.to_le_bytes());
            file.extend(*data);
        }
        let length = file.len() as u32;
        file[8..12].copy_from_slice(&length.to_le_bytes());
        file
    }

    fn split_ok(file: &[u8]) -> (Container<'_>, LoadReport) {
        let mut report = LoadReport::default();
        (split(Path::new("x.gltf"), file, &mut report).unwrap(), report)
    }

    #[test]
    fn both_chunks_are_found() {
        let file = glb(&[(JSON, b"{}  "), (BIN, b"1234")]);
        let (container, report) = split_ok(&file);
        assert_eq!((container.json, container.binary), (&b"{}  "[..], Some(&b"1234"[..])));
        assert!(report.notes.is_empty());
    }

    #[test]
    fn text_is_taken_whole_and_a_byte_order_mark_is_skipped() {
        let (container, report) = split_ok(b"\xef\xbb\xbf{}");
        assert_eq!((container.json, container.binary), (&b"{}"[..], None));
        assert_eq!(report.notes.len(), 1);
    }

    #[test]
    fn a_wrong_total_length_is_mended_but_a_cut_chunk_is_not() {
        let mut file = glb(&[(JSON, b"{}  "), (BIN, b"1234")]);
        file[8] += 1;
        let (container, report) = split_ok(&file);
        assert_eq!((container.binary, report.notes.len()), (Some(&b"1234"[..]), 1));
        file.pop();
        let error = split(Path::new("x.glb"), &file, &mut LoadReport::default()).err().unwrap();
        assert!(error.to_string().contains("a chunk declares 4 bytes, only 3 are left"), "{error}");
    }
}
