//! Stanford PLY: text or binary of either byte order, with any properties in any order.
//!
//! Used of element `vertex`: `x y z`; `nx ny nz`; `red green blue alpha` (also `r g b a`, `diffuse_red` …); texture
//! coordinates `s t`, `u v`, `texture_u texture_v`, `texture_s texture_t`, `u1 v1`. Their v axis points up and is turned to the
//! scene's convention (v' = 1 − v). Colours of integer types are sRGB and divided by the type's maximum; those of float
//! types are linear, unless one is above 1: then they are taken for sRGB that counts to 255. Of element `face`: `vertex_indices` (or `vertex_index`), polygons of any
//! size, and `texcoord`, texture coordinates for each corner. Of element `tristrips`: `vertex_indices`, strips separated
//! by −1. Other elements and properties are passed over and reported.
//!
//! In text files each row begins a line, if there are enough lines: numbers behind its last one are passed over and
//! reported. `comment TextureFile NAME` names the texture of the base colour.
//!
//! Missing normals are computed ([`crate::normals`]). The material is a neutral grey.

mod header;
mod polygons;
mod values;

use super::session::TRIANGLE;
use super::textures::{Neutral, TextureLoader, find_file, vertex_colors};
use super::{LoadError, LoadOptions, Loaded, text};
use crate::origin::anchored;
use crate::{
    ColorSpace, Instance, LoadReport, Material, Mesh, Sampler, Scene, Shape, Texture, TextureRef,
    TriangleMesh, normals,
};
use glam::{Affine3A, DVec3, Vec2, Vec3, Vec4};
use header::{Element, Header, Scalar};
use polygons::Polygons;
use std::path::Path;
use values::{ValueError, Values};

/// Loads a PLY file: one mesh, one instance, one neutral material.
///
/// # Errors
/// [`LoadError::Read`] and [`LoadError::TooLarge`]; [`LoadError::Malformed`] if the header is wrong, declares more than
/// the file can hold, or the data end early or are not numbers. Faces with indices out of range are left out and
/// reported.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| {
        let folder = path.parent().unwrap_or(Path::new(""));
        let bytes = options.read(path)?;
        parse_file(path, &bytes, Source { folder: Some(folder), is_own: true }, options)
    })
}

/// Loads the mesh of a PLY file without its texture, and with its normals as they are: for scenes that have materials of
/// their own, and where normals decide which side is outside.
///
/// # Errors
/// As [`load`].
pub(super) fn load_mesh(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| {
        let bytes = options.read(path)?;
        parse_file(path, &bytes, Source { folder: None, is_own: false }, options)
    })
}

/// Parses a PLY file that is in memory.
///
/// # Errors
/// As [`load`].
pub fn parse(bytes: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let path = Path::new("memory.ply");
    options.scene_session(path, |options| {
        parse_file(path, bytes, Source { folder: None, is_own: true }, options)
    })
}

/// What a file is loaded for.
#[derive(Clone, Copy)]
struct Source<'a> {
    /// Where its texture is looked for.
    folder: Option<&'a Path>,
    /// It is a scene of its own; else its normals belong to another file, which says what they mean.
    is_own: bool,
}

fn parse_file(path: &Path, bytes: &[u8], source: Source, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let by_lines = parse_rows(path, bytes, source, true, options);
    if !matches!(by_lines, Err(LoadError::Malformed { .. })) {
        return by_lines;
    }
    // Some writers break lines anywhere: then the numbers must be just enough.
    match parse_rows(path, bytes, source, false, options) {
        Ok(loaded) if !loaded.report.notes.iter().any(|note| note.message.contains(LEFT_OVER)) => Ok(loaded),
        _ => by_lines,
    }
}

/// What notes about data behind the last element say.
const LEFT_OVER: &str = "are left over after the last declared element";

/// `by_lines`: lines of a text file are rows, where there are enough of them.
fn parse_rows(
    path: &Path,
    bytes: &[u8],
    source: Source,
    by_lines: bool,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let Source { folder, is_own } = source;
    let bytes = &*text::decoded(path, bytes)?;
    let header = Header::parse(path, bytes)?;
    let mut values = Values::new(&bytes[header.size..], header.format);
    let rows = header.elements.iter().filter(|element| !element.properties.is_empty());
    if by_lines {
        values.expect_rows(rows.fold(0, |sum, element| sum.saturating_add(element.count)));
    }
    let mut reader = Reader {
        path,
        bytes,
        header_size: header.size,
        values,
        mesh: TriangleMesh::default(),
        anchor: DVec3::ZERO,
        polygons: Polygons::default(),
        report: LoadReport { bytes_read: bytes.len() as u64, ..Default::default() },
    };
    if header.unknown_lines > 0 {
        reader.report.ignored(format!("{} lines of the header are not understood", header.unknown_lines));
    }
    let has_faces = reader.elements(&header)?;
    reader.report_left_over();
    let Reader { mut mesh, anchor, polygons, mut report, .. } = reader;
    let faces = polygons.ends.len() + polygons.strips.len();
    let triangles = (polygons.corners.len() + polygons.strips.len()) as u64;
    options.budget().take(triangles.saturating_mul(TRIANGLE), "faces")?;
    polygons.triangulate(&mut mesh, &mut report);
    if !has_faces {
        report.ignored("it is a point cloud: points are not drawn");
    }
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut meshes = [mesh];
    let opposing = is_own.then(|| normals::turn_to_winding(&mut meshes, options.keep_normals)).flatten();
    if let Some(done) = opposing {
        report.repaired(format!("normals oppose the winding of most faces and {done}"));
    }
    normals::generate(&mut meshes, options.crease_angle);
    let [mesh] = meshes;
    let mut scene = Scene { name: name.clone(), ..Default::default() };
    if mesh.indices.is_empty() {
        if has_faces {
            report.ignored(format!("none of the file's {faces} faces can be drawn"));
        }
        return Ok(Loaded { scene, report });
    }
    let has_coordinates = !mesh.uv0.is_empty();
    add_material(&header, has_coordinates, folder, options, &mut scene, &mut report);
    scene.meshes.push(Mesh::single(name.clone(), Shape::Triangles(mesh), 0));
    scene.instances.push(Instance::new(name, 0, Affine3A::IDENTITY));
    scene.settle_meshes(anchor, &mut report);
    Ok(Loaded { scene, report })
}

/// Adds the material of all faces, with the first texture that the header names.
fn add_material(
    header: &Header,
    has_coordinates: bool,
    folder: Option<&Path>,
    options: &LoadOptions,
    scene: &mut Scene,
    report: &mut LoadReport,
) {
    let mut material = Material { double_sided: true, ..Default::default() };
    if let Some(name) = header.textures.first() {
        add_texture(name, folder.filter(|_| has_coordinates), options, scene, &mut material, report);
        if !has_coordinates {
            report.ignored(format!("texture {name}: vertices have no coordinates for it"));
        }
    }
    if header.textures.len() > 1 {
        let count = header.textures.len();
        report.approximated(format!(
            "of {count} textures (`comment TextureFile`) the first is used for all faces"
        ));
    }
    scene.materials.push(material);
}

/// Gives a material the texture of that name in `folder`; without a folder it is not looked for.
fn add_texture(
    name: &str,
    folder: Option<&Path>,
    options: &LoadOptions,
    scene: &mut Scene,
    material: &mut Material,
    report: &mut LoadReport,
) {
    let Some(folder) = folder else { return };
    let mut images = TextureLoader::new(options, 0);
    let image = match find_file(folder, name, options) {
        Some(file) => images.file(&file, Neutral::White),
        None => images.missing(name, "the file does not exist", Neutral::White),
    };
    scene.images = images.finish(report);
    scene.textures.push(Texture::image(image, Sampler::default(), ColorSpace::Srgb));
    material.base_color_texture = Some(TextureRef::new(0));
    material.base_color = Vec4::ONE;
}

struct Reader<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    header_size: usize,
    values: Values<'a>,
    mesh: TriangleMesh,
    /// What the positions are relative to.
    anchor: DVec3,
    polygons: Polygons,
    report: LoadReport,
}

/// An index that no vertex has.
const INVALID: u32 = u32::MAX;

impl Reader<'_> {
    /// Reads all elements; returns whether there are faces.
    fn elements(&mut self, header: &Header) -> Result<bool, LoadError> {
        let (mut has_vertices, mut has_faces) = (false, false);
        for element in &header.elements {
            match element.name.as_str() {
                "vertex" if !has_vertices => {
                    has_vertices = true;
                    self.vertices(element)?;
                }
                "face" | "tristrips" => {
                    has_faces |= element.count > 0;
                    self.faces(element)?;
                }
                _ => self.pass_over(element)?,
            }
        }
        if !has_vertices {
            return Err(LoadError::malformed(self.path, "header", "there is no element `vertex`"));
        }
        Ok(has_faces)
    }

    fn fail(&self, element: &Element, row: u64, error: ValueError) -> LoadError {
        let message = match error {
            ValueError::End => format!("the file ends in row {row} of {}", element.count),
            ValueError::NotANumber => format!("row {row} has a word that is not a number"),
            ValueError::ShortLine => {
                format!("row {row}, line {}, has too few numbers", self.line(self.values.position()))
            }
        };
        LoadError::malformed(self.path, format!("element {}", element.name), message)
    }

    /// The line of a place in the data.
    fn line(&self, position: usize) -> usize {
        text::line_at(self.bytes, self.header_size + position)
    }

    fn report_left_over(&mut self) {
        if let Some((count, first)) = self.values.surplus {
            let line = self.line(first);
            self.report.ignored(format!(
                "{count} lines have more numbers than declared, the first is line {line}: the rest of each is skipped"
            ));
        }
        if let Some(left) = self.values.left_over() {
            self.report.ignored(format!("{left} {LEFT_OVER}"));
        }
    }

    fn vertices(&mut self, element: &Element) -> Result<(), LoadError> {
        let columns = VertexColumns::find(element);
        let Some(position) = columns.position else {
            return Err(LoadError::malformed(self.path, "element vertex", "it has no properties x, y, z"));
        };
        columns.report_unused(element, &mut self.report);
        let mut row_values = vec![0.0; element.properties.len()];
        let (mut not_finite, mut zero_normals) = (0usize, 0usize);
        let mut colors = Vec::new();
        // Text and doubles have more digits than are stored.
        let mut positions: Vec<DVec3> = Vec::new();
        for row in 0..element.count {
            self.values.begin_row();
            for (value, property) in row_values.iter_mut().zip(&element.properties) {
                let read = match property.count {
                    None => self.values.next(property.scalar).map(|v| *value = v),
                    Some(count) => {
                        self.values.next(count).and_then(|n| self.values.skip(property.scalar, n as u64))
                    }
                };
                read.map_err(|e| self.fail(element, row, e))?;
            }
            self.values.end_row();
            let mut get = |column: usize| {
                let value = row_values[column] as f32;
                not_finite += usize::from(!value.is_finite());
                if value.is_finite() { value } else { 0.0 }
            };
            // What single precision cannot hold is counted and becomes 0.
            let exact =
                |column| if get(column) == row_values[column] as f32 { row_values[column] } else { 0.0 };
            positions.push(DVec3::from_array(position.map(exact)));
            if let Some(columns) = columns.normal {
                let normal = Vec3::from(columns.map(&mut get)).as_dvec3().try_normalize();
                zero_normals += usize::from(normal.is_none());
                // Zero asks for a computed one.
                self.mesh.normals.push(normal.map_or(Vec3::ZERO, |n| n.as_vec3()));
            }
            if let Some(columns) = columns.uv {
                let [u, v] = columns.map(&mut get);
                self.mesh.uv0.push(Vec2::new(u, 1.0 - v));
            }
            if let Some([r, g, b]) = columns.color {
                let unit = |c: usize| element.properties[c].scalar.unit() as f32;
                let [r, g, b] = [r, g, b].map(|c| get(c) / unit(c));
                let a = columns.alpha.map_or(1.0, |a| get(a) / unit(a));
                colors.push(Vec4::new(r, g, b, a));
            }
        }
        (self.mesh.positions, self.anchor) = anchored(&positions);
        let is_float = |c: [usize; 3]| matches!(element.properties[c[0]].scalar, Scalar::F32 | Scalar::F64);
        self.mesh.colors = vertex_colors(colors, !columns.color.is_some_and(is_float), &mut self.report);
        if not_finite > 0 {
            self.report.repaired(format!("{not_finite} numbers that are not finite were set to 0"));
        }
        if zero_normals > 0 {
            self.report.repaired(format!("{zero_normals} normals have no length and are computed"));
        }
        Ok(())
    }

    fn faces(&mut self, element: &Element) -> Result<(), LoadError> {
        let is_strip = element.name == "tristrips";
        let indices = element.find(&["vertex_indices", "vertex_index"]);
        let Some(indices) = indices.filter(|i| element.properties[*i].count.is_some()) else {
            let message = "it has no list `vertex_indices`";
            return Err(LoadError::malformed(self.path, format!("element {}", element.name), message));
        };
        let texcoord =
            element.find(&["texcoord"]).filter(|i| element.properties[*i].count.is_some() && !is_strip);
        for (i, property) in element.properties.iter().enumerate() {
            if i != indices && Some(i) != texcoord {
                self.report.ignored(format!("property {} of element {}", property.name, element.name));
            }
        }
        let (mut corners, mut uvs): (Vec<u32>, Vec<f32>) = (Vec::new(), Vec::new());
        for row in 0..element.count {
            corners.clear();
            uvs.clear();
            self.values.begin_row();
            for (i, property) in element.properties.iter().enumerate() {
                self.face_property(
                    property,
                    (i == indices).then_some(&mut corners),
                    (Some(i) == texcoord).then_some(&mut uvs),
                )
                .map_err(|e| self.fail(element, row, e))?;
            }
            self.values.end_row();
            if is_strip {
                self.polygons.add_strips(&corners);
            } else {
                self.polygons.add(&corners, &uvs);
            }
        }
        Ok(())
    }

    fn face_property(
        &mut self,
        property: &header::Property,
        corners: Option<&mut Vec<u32>>,
        uvs: Option<&mut Vec<f32>>,
    ) -> Result<(), ValueError> {
        let Some(count) = property.count else { return self.values.next(property.scalar).map(|_| ()) };
        let count = self.values.next(count)?;
        // A negative count becomes 0; one beyond the end of the file is found out before anything is allocated.
        let count = count as u64;
        if let Some(corners) = corners {
            for _ in 0..count {
                let index = self.values.next(property.scalar)?;
                corners.push(if index >= 0.0 && index < f64::from(INVALID) { index as u32 } else { INVALID });
            }
            Ok(())
        } else if let Some(uvs) = uvs {
            for _ in 0..count {
                let value = self.values.next(property.scalar)? as f32;
                uvs.push(if value.is_finite() { value } else { 0.0 });
            }
            Ok(())
        } else {
            self.values.skip(property.scalar, count)
        }
    }

    /// Reads an element that has no effect on the picture.
    fn pass_over(&mut self, element: &Element) -> Result<(), LoadError> {
        if element.count == 0 {
            return Ok(());
        }
        self.report.ignored(format!("element {}", element.name));
        if element.properties.is_empty() {
            return Ok(());
        }
        for row in 0..element.count {
            self.values.begin_row();
            for property in &element.properties {
                let read = match property.count {
                    None => self.values.skip(property.scalar, 1),
                    Some(count) => {
                        self.values.next(count).and_then(|n| self.values.skip(property.scalar, n as u64))
                    }
                };
                read.map_err(|e| self.fail(element, row, e))?;
            }
            self.values.end_row();
        }
        Ok(())
    }
}

/// Where the vertex element has what.
struct VertexColumns {
    position: Option<[usize; 3]>,
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
    color: Option<[usize; 3]>,
    alpha: Option<usize>,
}

impl VertexColumns {
    fn find(element: &Element) -> Self {
        let one = |name: &str| element.find(&[name]).filter(|i| element.properties[*i].count.is_none());
        let three = |names: [&str; 3]| Some([one(names[0])?, one(names[1])?, one(names[2])?]);
        let two = |names: [&str; 2]| Some([one(names[0])?, one(names[1])?]);
        let uv_names =
            [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["texture_s", "texture_t"], ["u1", "v1"]];
        let color_names =
            [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]];
        Self {
            position: three(["x", "y", "z"]),
            normal: three(["nx", "ny", "nz"]),
            uv: uv_names.into_iter().find_map(two),
            color: color_names.into_iter().find_map(three),
            alpha: ["alpha", "a", "diffuse_alpha"].into_iter().find_map(one),
        }
    }

    fn report_unused(&self, element: &Element, report: &mut LoadReport) {
        let three = [self.position, self.normal, self.color].into_iter().flatten().flatten();
        let used: Vec<usize> = three.chain(self.uv.into_iter().flatten()).chain(self.alpha).collect();
        for (_, property) in element.properties.iter().enumerate().filter(|(i, _)| !used.contains(i)) {
            report.ignored(format!("property {} of element {}", property.name, element.name));
        }
    }
}
