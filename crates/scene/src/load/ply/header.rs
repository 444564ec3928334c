//! The text at the start of a PLY file: which elements follow, and what each is made of.

use crate::load::LoadError;
use std::path::Path;

/// How the data after the header are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// Size in a binary file, in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// The largest value of an unsigned integer type; 1 for the others. Colours are divided by it.
    pub(super) fn unit(self) -> f64 {
        match self {
            Scalar::U8 => 255.0,
            Scalar::U16 => 65_535.0,
            Scalar::U32 => 4_294_967_295.0,
            Scalar::I8 | Scalar::I16 | Scalar::I32 | Scalar::F32 | Scalar::F64 => 1.0,
        }
    }

    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }
}

/// A column of an element.
#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    /// Type of the value, or of a list's items.
    pub(super) scalar: Scalar,
    /// Type of the item count, for a list.
    pub(super) count: Option<Scalar>,
}

/// A table: so many rows of these properties.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// The least number of bytes that a row takes.
    pub(super) fn min_row_size(&self, format: Format) -> u64 {
        let size = |p: &Property| match format {
            Format::Ascii => 2, // a digit and white space
            Format::LittleEndian | Format::BigEndian => p.count.unwrap_or(p.scalar).size(),
        };
        self.properties.iter().map(|p| size(p) as u64).sum()
    }

    /// Index of the property that has one of these names.
    pub(super) fn find(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| names.contains(&p.name.as_str()))
    }
}

/// The whole header.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
    /// Where the data start, in bytes.
    pub(super) size: usize,
    /// Number of lines with an unknown keyword.
    pub(super) unknown_lines: usize,
    /// Names after `comment TextureFile`, a convention of MeshLab's.
    pub(super) textures: Vec<String>,
}

/// Longer headers than this are no headers.
const MAX_SIZE: usize = 1 << 20;
const MAX_PROPERTIES: usize = 4096;

impl Header {
    /// Parses the header and checks the declared counts against the size of the file.
    pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Self, LoadError> {
        let fail = |message: String| LoadError::malformed(path, "header", message);
        let mut at = 0;
        if line(bytes, &mut at).as_deref() != Some("ply") {
            return Err(fail("the first line is not `ply`".into()));
        }
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut properties = 0;
        let mut unknown_lines = 0;
        let mut textures = Vec::new();
        loop {
            let Some(text) = line(bytes, &mut at).filter(|_| at <= MAX_SIZE) else {
                return Err(fail("there is no `end_header`".into()));
            };
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            match words[..] {
                ["format", name, _version] => {
                    format = Some(match name {
                        "ascii" => Format::Ascii,
                        "binary_little_endian" => Format::LittleEndian,
                        "binary_big_endian" => Format::BigEndian,
                        _ => return Err(fail(format!("the format `{name}` is not known"))),
                    });
                }
                ["element", name, count] => {
                    let count =
                        count.parse().map_err(|_| fail(format!("element {name} has the count `{count}`")))?;
                    elements.push(Element { name: name.into(), count, properties: Vec::new() });
                }
                ["property", "list", count, item, name] => {
                    let (count, scalar) = (Scalar::parse(count), Scalar::parse(item));
                    let (Some(count), Some(scalar)) = (count, scalar) else {
                        return Err(fail(format!("property {name} has an unknown type")));
                    };
                    if matches!(count, Scalar::F32 | Scalar::F64) {
                        return Err(fail(format!("property {name} has a count that is no integer")));
                    }
                    let property = Property { name: name.into(), scalar, count: Some(count) };
                    let element =
                        elements.last_mut().ok_or_else(|| fail("a property without element".into()))?;
                    element.properties.push(property);
                    properties += 1;
                }
                ["property", scalar, name] => {
                    let Some(scalar) = Scalar::parse(scalar) else {
                        return Err(fail(format!("property {name} has the unknown type `{scalar}`")));
                    };
                    let property = Property { name: name.into(), scalar, count: None };
                    let element =
                        elements.last_mut().ok_or_else(|| fail("a property without element".into()))?;
                    element.properties.push(property);
                    properties += 1;
                }
                ["comment" | "obj_info", keyword, ..] if keyword.eq_ignore_ascii_case("TextureFile") => {
                    let name = text.split_once(keyword).map_or("", |(_, name)| name.trim());
                    textures.push(name.trim_matches('"').to_owned());
                }
                ["comment" | "obj_info", ..] | [] => {}
                ["end_header"] => break,
                ["format" | "element" | "property", ..] => {
                    let text: String = text.chars().take(60).collect();
                    return Err(fail(format!("cannot understand the line `{text}`")));
                }
                _ => unknown_lines += 1,
            }
            if properties > MAX_PROPERTIES {
                return Err(fail(format!("more than {MAX_PROPERTIES} properties")));
            }
        }
        let format = format.ok_or_else(|| fail("it states no format".into()))?;
        let header = Self { format, elements, size: at, unknown_lines, textures };
        header.check_counts(path, bytes.len() - at)?;
        Ok(header)
    }

    fn check_counts(&self, path: &Path, available: usize) -> Result<(), LoadError> {
        let mut needed = 0u64;
        for element in &self.elements {
            let row = element.min_row_size(self.format);
            if row == 0 && element.count > available as u64 {
                let message = format!("{} rows without properties", element.count);
                return Err(LoadError::malformed(path, format!("element {}", element.name), message));
            }
            needed = needed.saturating_add(row.saturating_mul(element.count));
            // The last number of a text needs no white space after it.
            if needed > available as u64 + 1 {
                let message = format!(
                    "{} rows need at least {needed} bytes, but only {available} follow",
                    element.count
                );
                return Err(LoadError::malformed(path, format!("element {}", element.name), message));
            }
        }
        Ok(())
    }
}

/// The next line, without its end; `None` at the end of the file.
fn line(bytes: &[u8], at: &mut usize) -> Option<String> {
    let rest = bytes.get(*at..).filter(|r| !r.is_empty())?;
    let length = rest.iter().take(MAX_SIZE).position(|c| matches!(c, b'\n' | b'\r'))?;
    *at += length + 1;
    if rest[length] == b'\r' && rest.get(length + 1) == Some(&b'\n') {
        *at += 1;
    }
    Some(String::from_utf8_lossy(&rest[..length]).trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Header, String> {
        Header::parse(Path::new("x.ply"), text.as_bytes()).map_err(|e| e.to_string())
    }

    #[test]
    fn types_elements_and_line_ends() {
        for end in ["\n", "\r\n", "\r"] {
            let text = [
                "ply",
                "format ascii 1.0",
                "comment a b",
                "element vertex 1",
                "property float32 x  ",
                "property list uchar int vertex_indices",
                "",
                "end_header",
                "0 0",
            ]
            .join(end);
            let header = parse(&text).unwrap();
            assert_eq!(header.format, Format::Ascii);
            assert_eq!((header.elements[0].count, header.elements[0].properties.len()), (1, 2));
            assert_eq!(&text[header.size..], "0 0");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, message) in [
            ("plx\n", "the first line is not `ply`"),
            ("ply\nformat ascii 1.0\n", "there is no `end_header`"),
            ("ply\nend_header\n", "it states no format"),
            ("ply\nformat bits 1.0\n", "the format `bits` is not known"),
            ("ply\nproperty float x\n", "a property without element"),
            ("ply\nelement vertex -1\n", "element vertex has the count `-1`"),
            ("ply\nelement vertex 1\nproperty half x\n", "property x has the unknown type `half`"),
            (
                "ply\nelement vertex 1\nproperty list float int x\n",
                "property x has a count that is no integer",
            ),
            ("ply\nelement vertex\n", "cannot understand the line `element vertex`"),
            (
                "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\nproperty double x\nend_header\nabc",
                "1000000000000 rows need at least 8000000000000 bytes, but only 3 follow",
            ),
            (
                "ply\nformat ascii 1.0\nelement x 99999999999\nend_header\n",
                "99999999999 rows without properties",
            ),
        ] {
            assert!(parse(text).unwrap_err().ends_with(message), "{text}: {:?}", parse(text));
        }
    }
}
