//! STL: triangles without anything else, as text or binary.
//!
//! The binary form has a header of 80 bytes, a count, and 50 bytes for each triangle: its normal, three corners, and two
//! bytes without a meaning. The text form has `solid`s of `facet`s. Many writers let the header of the binary form begin
//! with `solid`, too, so that the size decides: a file that is exactly as long as its count says is binary.
//!
//! Corners in the same place become one vertex, and normals are computed ([`crate::normals`]): those of the file are the
//! faces' own at best. Units and the up axis are not in the format: coordinates are taken as they are. The material is a
//! neutral grey.

use super::{LoadError, LoadOptions, Loaded, read_file};
use crate::{Instance, LoadReport, Material, Mesh, Scene, Shape, TriangleMesh, normals};
use glam::{Affine3A, DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Loads an STL file: one mesh, one instance, one neutral material.
///
/// # Errors
/// [`LoadError::Read`] and [`LoadError::TooLarge`]; [`LoadError::Malformed`] for what is neither form, and for text that is
/// not what the format has in its place. A binary file that ends early keeps its whole triangles, which is reported.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| parse_named(path, &read_file(path, options)?, options))
}

/// Parses an STL file that is in memory.
///
/// # Errors
/// As [`load`].
pub fn parse(bytes: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    parse_named(Path::new("memory.stl"), bytes, options)
}

fn parse_named(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut report = LoadReport { bytes_read: bytes.len() as u64, ..LoadReport::default() };
    let mut builder = Builder::default();
    if is_text(bytes) {
        read_text(path, bytes, &mut builder)?;
    } else {
        read_binary(path, bytes, &mut builder, &mut report)?;
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
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut meshes = [builder.mesh];
    normals::generate(&mut meshes, options.crease_angle);
    let [mesh] = meshes;
    let mut scene = Scene { name: name.clone(), ..Scene::default() };
    if !mesh.indices.is_empty() {
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        scene.meshes.push(Mesh::single(name.clone(), Shape::Triangles(mesh), 0));
        scene.instances.push(Instance::new(name, 0, Affine3A::IDENTITY));
        scene.settle_meshes(DVec3::ZERO, &mut report);
    }
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
    !fits && bytes.trim_ascii_start().get(..5).is_some_and(|start| start.eq_ignore_ascii_case(b"solid"))
}

fn read_binary(
    path: &Path,
    bytes: &[u8],
    builder: &mut Builder,
    report: &mut LoadReport,
) -> Result<(), LoadError> {
    let Some(count) = declared(bytes) else {
        let message = format!("{} bytes are neither text nor a header of {HEADER} bytes", bytes.len());
        return Err(LoadError::malformed(path, "header", message));
    };
    let data = &bytes[HEADER..];
    let whole = data.len() / TRIANGLE;
    if whole < count {
        if whole == 0 {
            let message = format!("{count} triangles are declared, there is none");
            return Err(LoadError::malformed(path, "header", message));
        }
        report.repaired(format!("the file ends after {whole} of {count} triangles"));
    } else if data.len() > count.saturating_mul(TRIANGLE) {
        report.info("bytes after the last triangle are skipped");
    }
    let count = count.min(whole);
    builder.mesh.indices.reserve_exact(count);
    for triangle in data.chunks_exact(TRIANGLE).take(count) {
        let number = |at: usize| {
            triangle[at..].first_chunk::<4>().map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes))
        };
        let corner = |i: usize| Vec3::from_array([0, 4, 8].map(|axis| number(12 * (i + 1) + axis)));
        builder.add([corner(0), corner(1), corner(2)]);
    }
    Ok(())
}

fn read_text(path: &Path, bytes: &[u8], builder: &mut Builder) -> Result<(), LoadError> {
    let mut corners: Vec<Vec3> = Vec::with_capacity(4);
    for (number, line) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        let malformed = |message: String| LoadError::malformed(path, format!("line {number}"), message);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(first) = words.next() else { continue };
        match first.to_ascii_lowercase().as_slice() {
            b"vertex" => {
                let mut coordinate = || {
                    let word = words.next().unwrap_or_default();
                    let text = String::from_utf8_lossy(word);
                    text.parse::<f32>().map_err(|_| malformed(format!("`{text}` is not a coordinate")))
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
            b"solid" | b"endsolid" | b"facet" | b"outer" | b"endloop" => {}
            _ => {
                let word = String::from_utf8_lossy(&first[..first.len().min(32)]).into_owned();
                return Err(malformed(format!("`{word}` does not belong to the format")));
            }
        }
    }
    match corners.len() {
        0 => Ok(()),
        count => {
            Err(LoadError::malformed(path, "end of the file", format!("a facet ends after {count} corners")))
        }
    }
}
