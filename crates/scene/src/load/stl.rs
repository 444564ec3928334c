//! STL: triangles without anything else, as text or binary.
//!
//! The binary form has a header of 80 bytes, a count, and 50 bytes for each triangle: its normal, three corners, and two
//! bytes without a meaning. The text form has `solid`s of `facet`s; lines have no meaning but for the names behind `solid`
//! and `endsolid`. Many writers let the header of the binary form begin with `solid`, too: a file is binary if it is exactly
//! as long as its count says, or if it has zero bytes where text has none.
//!
//! Corners in the same place become one vertex, and normals are computed ([`crate::normals`]): those of the file are the
//! faces' own at best. Units and the up axis are not in the format: coordinates are taken as they are. The material is a
//! neutral grey.

use super::session::TRIANGLE as TRIANGLE_COST;
use super::{LoadError, LoadOptions, Loaded, text};
use crate::{Instance, LoadReport, Material, Mesh, Scene, Shape, TriangleMesh, normals};
use glam::{Affine3A, DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Loads an STL file: one mesh, one instance, one neutral material.
///
/// # Errors
/// [`LoadError::Read`] and [`LoadError::TooLarge`]; [`LoadError::Malformed`] for what is neither form, for text that is
/// not what the format has in its place, for files without a triangle, and for binary files that end early: with
/// [`LoadOptions::lenient`] these keep their whole triangles, which is reported.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| parse_named(path, &options.read(path)?, options))
}

/// Parses an STL file that is in memory.
///
/// # Errors
/// As [`load`].
pub fn parse(bytes: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let path = Path::new("memory.stl");
    options.scene_session(path, |options| parse_named(path, bytes, options))
}

fn parse_named(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut report = LoadReport { bytes_read: bytes.len() as u64, ..LoadReport::default() };
    let mut builder = Builder::default();
    let text = text::decoded(path, bytes)?;
    if is_text(&text) {
        // A triangle takes at least 30 characters.
        options.budget().take(text.len() as u64 / 30 * TRIANGLE_COST, "triangles")?;
        read_text(path, &text, &mut builder)?;
    } else {
        options.budget().take((bytes.len() / TRIANGLE) as u64 * TRIANGLE_COST, "triangles")?;
        read_binary(path, bytes, &mut builder, &mut report, options.lenient)?;
    }
    if builder.infinite > 0 {
        report.repaired(format!(
            "{} triangles with coordinates that are not finite were left out",
            builder.infinite
        ));
    }
    if builder.collapsed > 0 {
        report.repaired(format!("{} triangles with two equal corners were left out", builder.collapsed));
    }
    if builder.mesh.indices.is_empty() {
        let (infinite, collapsed) = (builder.infinite, builder.collapsed);
        let message = match infinite + collapsed {
            0 => "there is no triangle in it".to_owned(),
            _ => format!(
                "none of its triangles can be drawn: {infinite} are not finite, {collapsed} have two equal corners"
            ),
        };
        return Err(LoadError::malformed(path, "file", message));
    }
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut meshes = [builder.mesh];
    normals::generate(&mut meshes, options.crease_angle);
    let [mesh] = meshes;
    let mut scene = Scene { name: name.clone(), ..Scene::default() };
    scene.materials.push(Material { double_sided: true, ..Material::default() });
    scene.meshes.push(Mesh::single(name.clone(), Shape::Triangles(mesh), 0));
    scene.instances.push(Instance::new(name, 0, Affine3A::IDENTITY));
    scene.settle_meshes(DVec3::ZERO, &mut report);
    Ok(Loaded { scene, report })
}

/// Triangles whose corners are joined where they are in the same place.
#[derive(Default)]
struct Builder {
    mesh: TriangleMesh,
    places: HashMap<[u32; 3], u32>,
    infinite: usize,
    collapsed: usize,
}

impl Builder {
    fn add(&mut self, corners: [Vec3; 3]) {
        if !corners.iter().all(|c| c.is_finite()) {
            self.infinite += 1;
            return;
        }
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            self.collapsed += 1;
            return;
        }
        let triangle = corners.map(|corner| {
            // Adding zero turns −0 into 0: they are the same place.
            let key = (corner + Vec3::ZERO).to_array().map(f32::to_bits);
            *self.places.entry(key).or_insert_with(|| {
                self.mesh.positions.push(corner);
                self.mesh.positions.len() as u32 - 1
            })
        });
        self.mesh.indices.push(triangle);
    }
}

/// The number of triangles that the header of the binary form declares.
fn declared(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(80..HEADER)?.first_chunk::<4>()?;
    usize::try_from(u32::from_le_bytes(*count)).ok()
}

fn is_text(bytes: &[u8]) -> bool {
    let fits =
        declared(bytes).and_then(|n| n.checked_mul(TRIANGLE)?.checked_add(HEADER)) == Some(bytes.len());
    let begins = bytes.trim_ascii_start().get(..5).is_some_and(|start| start.eq_ignore_ascii_case(b"solid"));
    // The count and the normal of the first triangle hardly do without a zero byte.
    let has_zeros = bytes.get(80..).is_some_and(|rest| rest.iter().take(66).any(|byte| *byte == 0));
    begins && !fits && !has_zeros
}

fn read_binary(
    path: &Path,
    bytes: &[u8],
    builder: &mut Builder,
    report: &mut LoadReport,
    lenient: bool,
) -> Result<(), LoadError> {
    let Some(count) = declared(bytes) else {
        let message = format!("{} bytes are neither text nor a header of {HEADER} bytes", bytes.len());
        return Err(LoadError::malformed(path, "header", message));
    };
    let data = &bytes[HEADER..];
    // The two bytes behind the last triangle have no meaning and may be missing.
    let whole = (data.len() + 2) / TRIANGLE;
    // Writers to a stream cannot go back and fill the count in.
    let unknown = (count == 0 || count == u32::MAX as usize) && data.len() >= TRIANGLE;
    if unknown {
        report
            .repaired(format!("the header counts {count} triangles; the size of the file, {whole}, is used"));
    } else if whole < count {
        if whole == 0 {
            let message = format!("{count} triangles are declared, there is none");
            return Err(LoadError::malformed(path, "header", message));
        }
        let message = format!("the file ends after {whole} of {count} triangles");
        if !lenient {
            let message = format!("{message} (try --lenient to load these)");
            return Err(LoadError::malformed(path, "end of the file", message));
        }
        report.repaired(message);
    } else if data.len() > count.saturating_mul(TRIANGLE) {
        let left = data.len() - count * TRIANGLE;
        report.info(format!("{left} bytes after the last triangle are skipped"));
    }
    let count = if unknown { whole } else { count.min(whole) };
    builder.mesh.indices.reserve_exact(count);
    for triangle in data.chunks(TRIANGLE).take(count) {
        let number = |at: usize| {
            triangle[at..].first_chunk::<4>().map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes))
        };
        let corner = |i: usize| Vec3::from_array([0, 4, 8].map(|axis| number(12 * (i + 1) + axis)));
        builder.add([corner(0), corner(1), corner(2)]);
    }
    Ok(())
}

/// Words of a text, with where the next one is looked for.
struct Words<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    fn peek(&self) -> Option<(usize, &'a [u8])> {
        let is_space = |byte: &u8| byte.is_ascii_whitespace() || *byte == 0;
        let rest = self.text.get(self.at..)?;
        let start = self.at + rest.iter().position(|byte| !is_space(byte))?;
        let word = &self.text[start..];
        Some((start, &word[..word.iter().position(is_space).unwrap_or(word.len())]))
    }

    fn next(&mut self) -> Option<&'a [u8]> {
        let (start, word) = self.peek()?;
        self.at = start + word.len();
        Some(word)
    }

    /// Passes over a name: to the end of the line, or to a keyword that follows in the same line.
    fn skip_name(&mut self, keywords: &[&str]) {
        let rest = &self.text[self.at..];
        let end = self.at + rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
        while let Some((start, word)) = self.peek()
            && start < end
        {
            let mut after = Words { text: self.text, at: start + word.len() };
            let is = |word: &[u8], keyword: &str| word.eq_ignore_ascii_case(keyword.as_bytes());
            // A name may have the word `facet` in it, but hardly `facet normal`.
            let begins = keywords.iter().any(|k| is(word, k))
                && (!is(word, "facet")
                    || after.next().is_some_and(|next| is(next, "normal") || is(next, "outer")));
            if begins {
                return;
            }
            self.at = start + word.len();
        }
    }
}

fn read_text(path: &Path, bytes: &[u8], builder: &mut Builder) -> Result<(), LoadError> {
    let mut words = Words { text: bytes, at: 0 };
    let mut corners: Vec<Vec3> = Vec::with_capacity(4);
    let shown = |word: &[u8]| String::from_utf8_lossy(&word[..word.len().min(32)]).into_owned();
    while let Some((start, first)) = words.peek() {
        words.at = start + first.len();
        let malformed = |message: String| {
            LoadError::malformed(path, format!("line {}", text::line_at(bytes, start)), message)
        };
        match first.to_ascii_lowercase().as_slice() {
            b"vertex" => {
                let mut coordinate = || {
                    let word = words.next().unwrap_or_default();
                    let text = std::str::from_utf8(word).ok().and_then(|text| text.parse::<f32>().ok());
                    text.ok_or_else(|| malformed(format!("`{}` is not a coordinate", shown(word))))
                };
                let corner = Vec3::new(coordinate()?, coordinate()?, coordinate()?);
                if corners.len() == 3 {
                    return Err(malformed("a facet has more than three corners".into()));
                }
                corners.push(corner);
            }
            b"endfacet" => match corners[..] {
                [a, b, c] => {
                    builder.add([a, b, c]);
                    corners.clear();
                }
                _ => return Err(malformed(format!("a facet has {} corners", corners.len()))),
            },
            b"solid" => words.skip_name(&["facet", "endsolid"]),
            b"endsolid" => words.skip_name(&["solid"]),
            b"outer" | b"endloop" => {}
            b"facet" => {
                // The normal, which is computed instead.
                while words.peek().is_some_and(|(_, word)| {
                    !["outer", "vertex", "endfacet"].iter().any(|k| word.eq_ignore_ascii_case(k.as_bytes()))
                }) {
                    words.next();
                }
            }
            b"loop" => {}
            _ => return Err(malformed(format!("`{}` does not belong to the format", shown(first)))),
        }
    }
    match corners.len() {
        0 => Ok(()),
        count => {
            Err(LoadError::malformed(path, "end of the file", format!("a facet ends after {count} corners")))
        }
    }
}
