//! Wavefront OBJ with its MTL materials.
//!
//! # Geometry
//! Every object (`o`) becomes a mesh with one instance; in a file without objects every group (`g`) does. A mesh has
//! one part for each material (`usemtl`) of its faces. Polygons, concave ones too, are triangulated. Texture
//! coordinates are turned to the scene's convention (v' = 1 − v). Vertex colours after a position are read as sRGB.
//! Missing normals are computed ([`crate::normals`]): with smoothing groups where the file has any `s`, otherwise by the
//! crease angle. Points, lines and free-form geometry are reported and left out.
//!
//! # Materials
//! MTL describes materials of the Phong kind, and has physical keys (`Pr`, `Pm`) by a common extension. They become, by the first
//! rule that fits:
//!
//! | MTL | becomes |
//! |---|---|
//! | `illum` 6 or 7; `illum` 4 or 9 with `d` < 1 or with `Tf` that filters or a black `Kd`; any with `d` < 1, `Tf` and `Ni` > 1. Not with `map_d` | [`Model::Dielectric`](crate::Model): `Ni` (1.5 unless above 1), tint `Tf`, or `Kd`, or white; roughness `Pr` or 0 |
//! | `Ks` 0; or neither `Pr` nor `Pm` and `illum` 0 or 1 or no `Ks` at all. Not if metallic | [`Model::Lambert`](crate::Model) |
//! | `illum` 3, 5 or 8, no `Pr` or `Pm`, `Ks` ≥ `Kd` and ≥ 0.1, no `map_Kd` | [`Model::Mirror`](crate::Model) of colour `Ks` if `Kd` is black, otherwise a metal of colour `Ks` + `Kd` |
//! | all else | [`Model::MetallicRoughness`](crate::Model): base colour `Kd`, `metallic` = `Pm`, `specular` = largest of `Ks`, `ior` = `Ni` |
//!
//! - Roughness is `Pr`; without it, that of the GGX lobe as wide as the Phong lobe of exponent `Ns`:
//!   alpha = √(2 / (`Ns` + 2)), roughness = √alpha; 0.5 without `Ns`.
//! - `d` (or 1 − `Tr`) below 1 and `map_d` are coverage ([`AlphaMode`](crate::AlphaMode)); `map_d` with hardly any
//!   value between 0 and 1 becomes a mask.
//! - `Ke`, `map_Ke` emit on both sides. A `Ka` above 1 is taken for emission if there is no `Ke`; otherwise `Ka` has no meaning here.
//! - `map_Pr`, `map_Pm` are packed into one image, as are `map_ORM`, `map_RMA`; `map_d` goes into the alpha channel of
//!   `map_Kd`. `map_bump` is used as a normal map if it looks like one, else as a height map. `norm` is a normal map.
//!   `map_Ks` is replaced by its mean.
//! - Options `-s -o -bm -clamp -imfchan -colorspace` have effect, others are reported.

mod build;
mod images;
mod material;
pub mod mtl;
mod parse;
mod polygons;
mod text;
mod textures;

pub use material::{interpret, roughness_from_exponent};

use super::session::TRIANGLE;
use super::textures::find_file;
use super::{LoadError, LoadOptions, Loaded};
use crate::subdivision::Refinement;
use crate::{Instance, LoadReport, Material, Scene, Shape};
use build::Built;
use glam::Affine3A;
use mtl::MtlMaterial;
use parse::{Change, Data};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use textures::Textures;

/// Larger files are refused: indices inside are 32 bits.
const MAX_SIZE: u64 = 4 << 30;
/// Further `mtllib` statements are left out; each is a search in the file system.
const MAX_LIBRARIES: usize = 1000;

/// Loads an OBJ file, the material libraries it names and their textures.
///
/// # Errors
/// [`LoadError::Read`] and [`LoadError::TooLarge`]; [`LoadError::Malformed`] if the file holds nothing that belongs
/// into an OBJ file. Everything else that is wrong with it, missing libraries and textures included, is mended and reported.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| {
        let bytes = options.read(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        load_from(path, &bytes, Some(folder), options)
    })
}

/// Parses an OBJ file that is in memory. Nothing else is read: material libraries are reported as missing.
///
/// # Errors
/// As [`load`].
pub fn parse(bytes: &[u8], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let path = Path::new("memory.obj");
    options.scene_session(path, |options| load_from(path, bytes, None, options))
}

fn load_from(
    path: &Path,
    bytes: &[u8],
    folder: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let size = bytes.len() as u64;
    if size > MAX_SIZE {
        return Err(LoadError::TooLarge {
            path: path.to_owned(),
            what: "the file".into(),
            size,
            limit: MAX_SIZE,
        });
    }
    let mut report = LoadReport { bytes_read: size, ..Default::default() };
    let text = super::text::decoded(path, bytes)?;
    let data = parse::parse(&text, &mut report);
    if data.positions.is_empty() && data.chunks.iter().all(|c| c.len() == 0 && c.changes.is_empty()) {
        return Err(LoadError::malformed(path, "file", "there is no OBJ statement in it"));
    }
    let corners: u64 = data.chunks.iter().map(|chunk| chunk.len() as u64).sum();
    options.budget().take(corners.saturating_mul(TRIANGLE / 2), "faces")?;
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let built = build::build(&data, &name, options, &mut report);
    let mut scene = Scene { name, ..Default::default() };
    let libraries = Libraries::read(path, folder, &data, options, &mut report);
    add_materials(&built, &libraries, folder, options, &mut scene, &mut report);
    scene.meshes = built.meshes;
    scene.refinements = built.cages.into_iter().map(|(mesh, cage)| Refinement::new(mesh, cage)).collect();
    let instances = scene.meshes.iter().enumerate();
    scene.instances =
        instances.map(|(i, mesh)| Instance::new(mesh.name.as_str(), i as u32, Affine3A::IDENTITY)).collect();
    scene.settle_meshes(data.anchor, &mut report);
    if scene.meshes.is_empty() {
        match data.chunks.iter().map(|chunk| chunk.len()).sum::<u32>() {
            0 => report.ignored("the file has no faces that can be drawn"),
            count => report.ignored(format!("none of the file's {count} faces can be drawn")),
        }
    }
    note_unused_textures(&scene, &mut report);
    Ok(Loaded { scene, report })
}

/// The material libraries of a file: each material with the folder of its library.
#[derive(Default)]
struct Libraries {
    materials: Vec<(MtlMaterial, PathBuf)>,
    /// By all that stands behind `newmtl`.
    by_name: HashMap<String, usize>,
    /// By what stands there before a comment.
    by_short_name: HashMap<String, usize>,
}

/// A name without a comment behind it.
fn short_name(name: &str) -> String {
    text::name(text::before_comment(name.as_bytes()))
}

impl Libraries {
    fn read(
        path: &Path,
        folder: Option<&Path>,
        data: &Data,
        options: &LoadOptions,
        report: &mut LoadReport,
    ) -> Self {
        let mut libraries = Self::default();
        let changes = || data.chunks.iter().flat_map(|c| c.changes.iter().map(|(_, change)| change));
        let mut seen = HashSet::new();
        for change in changes() {
            if let Change::Library(names) = change
                && seen.insert(names)
            {
                if seen.len() > MAX_LIBRARIES {
                    report.ignored(format!("more than {MAX_LIBRARIES} `mtllib` statements"));
                    break;
                }
                for file in find_libraries(folder, names, options, report) {
                    libraries.add(&file, options, report);
                }
            }
        }
        let needed = changes().any(|c| matches!(c, Change::Material(_)));
        let beside = path.with_extension("mtl");
        if seen.is_empty() && needed && folder.is_some() && options.is_file(&beside) {
            report.repaired("the file names no material library; the one with its own name is used");
            libraries.add(&beside, options, report);
        }
        libraries
    }

    fn add(&mut self, file: &Path, options: &LoadOptions, report: &mut LoadReport) {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let bytes = match options.read(file) {
            Ok(bytes) => bytes,
            Err(error) => return report.ignored(format!("material library {name}: {error}")),
        };
        let mut notes = LoadReport { bytes_read: bytes.len() as u64, ..Default::default() };
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        let text = match super::text::decoded(file, &bytes) {
            Ok(text) => text,
            Err(error) => return report.ignored(format!("material library {name}: {error}")),
        };
        for mut material in mtl::parse(&text, &mut notes) {
            if self.by_name.contains_key(&material.name) {
                notes.ignored(format!("material {}: there is one of that name already", material.name));
                continue;
            }
            let (number, short) = (self.materials.len(), short_name(&material.name));
            self.by_name.insert(material.name.clone(), number);
            self.by_short_name.entry(short.clone()).or_insert(number);
            material.name = short;
            self.materials.push((material, folder.clone()));
        }
        report.absorb(&name, notes);
    }

    /// The material that a `usemtl` means: the whole name, or what stands before a comment in either place.
    fn find(&self, name: &str) -> Option<&(MtlMaterial, PathBuf)> {
        let short = short_name(name);
        let number = self.by_name.get(name).or_else(|| self.by_name.get(&short));
        number.or_else(|| self.by_short_name.get(&short)).map(|number| &self.materials[*number])
    }
}

/// The files of an `mtllib` statement: one whose name may have spaces, or several.
fn find_libraries(
    folder: Option<&Path>,
    names: &str,
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Vec<PathBuf> {
    let find = |name: &str| folder.and_then(|folder| find_file(folder, name.trim_matches('"'), options));
    if let Some(file) = find(names) {
        return vec![file];
    }
    let names = &short_name(names);
    if let Some(file) = find(names) {
        return vec![file];
    }
    // Longest names first: "a b.mtl c.mtl" are two files, one of them with a space.
    const MAX_WORDS: usize = 64;
    const MAX_WORDS_IN_NAME: usize = 8;
    let words: Vec<&str> = names.split_whitespace().take(MAX_WORDS).collect();
    let (mut files, mut at) = (Vec::new(), 0);
    while at < words.len() {
        let last = words.len().min(at + MAX_WORDS_IN_NAME);
        let found = (at + 1..=last).rev().find_map(|end| Some((end, find(&words[at..end].join(" "))?)));
        match found {
            Some((end, file)) => {
                files.push(file);
                at = end;
            }
            None => {
                report.ignored(format!("material library {} does not exist", words[at]));
                at += 1;
            }
        }
    }
    files
}

/// Fills the scene's materials, in the order of `built.materials`, and their textures.
fn add_materials(
    built: &Built,
    libraries: &Libraries,
    folder: Option<&Path>,
    options: &LoadOptions,
    scene: &mut Scene,
    report: &mut LoadReport,
) {
    let mut textures = Textures::new(options);
    for (index, name) in built.materials.iter().enumerate() {
        let known = name.as_ref().and_then(|name| libraries.find(name));
        let material = match (known, name) {
            (Some((mtl, library_folder)), _) => {
                let material = interpret(mtl, report);
                let folders: Vec<&Path> = [library_folder.as_path()].into_iter().chain(folder).collect();
                textures.add(index, mtl, material.model, &folders);
                material
            }
            (None, Some(name)) => {
                report.repaired(format!("material {name} is not in any library; a neutral one is used"));
                Material { name: short_name(name), double_sided: true, ..Default::default() }
            }
            (None, None) => {
                report.info("faces without a material have a neutral one");
                Material { double_sided: true, ..Default::default() }
            }
        };
        scene.materials.push(material);
    }
    textures.attach(scene, report);
}

/// Textured materials on parts without texture coordinates show one colour only.
fn note_unused_textures(scene: &Scene, report: &mut LoadReport) {
    let textured = |m: &Material| {
        m.base_color_texture.is_some()
            || m.metallic_roughness_texture.is_some()
            || m.emission_texture.is_some()
    };
    for part in scene.meshes.iter().flat_map(|m| &m.parts) {
        let material = &scene.materials[part.material as usize];
        if let Shape::Triangles(mesh) = &part.shape
            && mesh.uv0.is_empty()
            && textured(material)
        {
            report.ignored(format!(
                "textures of material {}: faces have no coordinates for them",
                material.name
            ));
        }
    }
}
