//! Primitives to triangle meshes.

use super::accessor::{Integers, Pick};
use super::document::Document;
use super::instances::Job;
use super::json::{Kind, Primitive};
use super::materials::Use;
use super::pose::Source;
use super::repair::repair;
use super::topology::Topology;
use crate::{LoadError, LoadReport, Mesh, Part, Shape, TriangleMesh, tangents};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

impl Document<'_> {
    /// Builds the meshes of all jobs, in parallel. `uses` gives the use of a primitive's material.
    ///
    /// # Errors
    /// Broken or missing data; the first in file order.
    pub fn build_meshes(
        &self,
        jobs: &[Job],
        uses: impl Fn(Option<u32>) -> Use + Sync,
        report: &mut LoadReport,
    ) -> Result<Vec<Mesh>, LoadError> {
        let tasks: Vec<(usize, usize)> = jobs
            .iter()
            .enumerate()
            .flat_map(|(job, j)| {
                (0..self.json.meshes[j.mesh as usize].primitives.len()).map(move |p| (job, p))
            })
            .collect();
        self.reserve::<(Option<TriangleMesh>, LoadReport)>(tasks.len() as u64)?;
        let built: Vec<_> = tasks
            .par_iter()
            .map(|(job, index)| {
                let primitive = &self.json.meshes[jobs[*job].mesh as usize].primitives[*index];
                let mut notes = LoadReport::default();
                let mesh = self.build(&jobs[*job], *index, uses(primitive.material), &mut notes);
                (mesh, notes)
            })
            .collect();
        let name = |job: &Job| {
            let name = self.json.meshes[job.mesh as usize].name.as_deref().filter(|n| !n.is_empty());
            name.map_or_else(|| format!("mesh {}", job.mesh), str::to_owned)
        };
        let mut meshes: Vec<Mesh> = jobs.iter().map(|j| Mesh { name: name(j), parts: Vec::new() }).collect();
        for ((job, index), (mesh, notes)) in tasks.into_iter().zip(built) {
            notes.notes.into_iter().for_each(|n| report.note(n.severity, n.message));
            if let Some(mesh) = mesh? {
                let material = self.json.meshes[jobs[job].mesh as usize].primitives[index].material;
                let material = uses(material).material;
                meshes[job].parts.push(Part { shape: Shape::Triangles(mesh), material });
            }
        }
        Ok(meshes)
    }

    /// One primitive; `None` if it has nothing to show.
    fn build(
        &self,
        job: &Job,
        index: usize,
        material: Use,
        report: &mut LoadReport,
    ) -> Result<Option<TriangleMesh>, LoadError> {
        let mesh = &self.json.meshes[job.mesh as usize];
        let name = mesh.name.as_deref().unwrap_or_default();
        let object = format!("mesh {} `{name}`, primitive {index}", job.mesh);
        match self.build_strictly(job, &mesh.primitives[index], &object, material, report) {
            Err(error @ LoadError::UnsupportedExtension { .. }) if self.options.lenient => {
                report.ignored(format!("{error}; it is left out"));
                Ok(None)
            }
            Err(error @ LoadError::Malformed { .. }) if self.options.lenient => {
                report.ignored(format!("{error}; it is left out"));
                Ok(None)
            }
            other => other,
        }
    }

    fn build_strictly(
        &self,
        job: &Job,
        primitive: &Primitive,
        object: &str,
        material: Use,
        report: &mut LoadReport,
    ) -> Result<Option<TriangleMesh>, LoadError> {
        let Some(topology) = Topology::from_mode(primitive.mode.unwrap_or(4)) else {
            report.ignored("points and lines are not drawn");
            return Ok(None);
        };
        let Some(position) = primitive.attributes.get("POSITION").copied() else {
            report.ignored("a primitive without positions is not drawn");
            return Ok(None);
        };
        if primitive.extensions.draco.is_some() {
            if !self.has_data(position) {
                return Err(self.unsupported(object, "KHR_draco_mesh_compression"));
            }
            report.info("of data with KHR_draco_mesh_compression, the uncompressed copy is read");
        }
        if primitive.extensions.variants.is_some() {
            report.info("the default material variant is shown");
        }
        let count = self.accessor_count(position)?;
        let mut indices = self.triangles(primitive, topology, count, object, report)?;
        let used = compact(&mut indices, count);
        let pick = used.as_deref().map_or(Pick::All, Pick::Only);
        let source = Source { primitive, pick, count, object };
        let mut mesh = self.attributes(&source, position, material, report)?;
        mesh.indices = indices;
        self.apply_pose(job, &source, &mut mesh)?;
        repair(&mut mesh, report);
        self.complete(&mut mesh, material, report)?;
        Ok(Some(mesh).filter(|m| !m.indices.is_empty()))
    }

    /// The primitive's triangles; all indices are less than `count`.
    fn triangles(
        &self,
        primitive: &Primitive,
        topology: Topology,
        count: u64,
        object: &str,
        report: &mut LoadReport,
    ) -> Result<Vec<[u32; 3]>, LoadError> {
        let vertices = match primitive.indices {
            Some(accessor) => self.read_indices(accessor)?,
            None => {
                self.reserve::<u32>(count)?;
                (0..count.min(u32::MAX.into()) as u32).collect()
            }
        };
        if topology == Topology::List && vertices.len() % 3 != 0 {
            report.repaired("vertices beyond the last whole triangle were left out");
        }
        self.reserve::<[u32; 3]>(topology.triangle_count(vertices.len() as u64))?;
        let mut triangles = topology.triangles(&vertices);
        let Some(worst) = vertices.iter().max().filter(|max| u64::from(**max) >= count) else {
            return Ok(triangles);
        };
        if !self.options.lenient {
            return Err(self.malformed(object, format!("has index {worst} but only {count} vertices")));
        }
        report.repaired("triangles with indices of missing vertices were left out");
        triangles.retain(|t| t.iter().all(|i| u64::from(*i) < count));
        Ok(triangles)
    }

    fn attributes(
        &self,
        source: &Source<'_>,
        position: u32,
        material: Use,
        report: &mut LoadReport,
    ) -> Result<TriangleMesh, LoadError> {
        let declared = Integers::AsDeclared;
        let positions = self.read::<3, Vec3>(position, Kind::Vec3, declared, source.pick)?;
        let find = |name: &str| -> Result<Option<u32>, LoadError> {
            let Some(accessor) = source.primitive.attributes.get(name) else { return Ok(None) };
            self.check_count(source, name, *accessor)?;
            Ok(Some(*accessor))
        };
        let normals = match find("NORMAL")? {
            Some(accessor) => self.read::<3, Vec3>(accessor, Kind::Vec3, declared, source.pick)?,
            None => Vec::new(),
        };
        let tangents = match find("TANGENT")? {
            // Without normals, tangents are to be ignored; without a normal map, nothing needs them.
            Some(accessor) if !normals.is_empty() && material.normal_map_set.is_some() => {
                self.read::<4, Vec4>(accessor, Kind::Vec4, declared, source.pick)?
            }
            _ => Vec::new(),
        };
        let uv = |slot: usize| match find(&format!("TEXCOORD_{}", material.uv_sets[slot]))? {
            Some(accessor) => self.read::<2, Vec2>(accessor, Kind::Vec2, declared, source.pick),
            None => Ok(Vec::new()),
        };
        let colors = match find("COLOR_0")? {
            Some(accessor) if self.accessor_kind(accessor)? == Kind::Vec3 => {
                let rgb = self.read::<3, Vec3>(accessor, Kind::Vec3, Integers::Normalized, source.pick)?;
                self.reserve::<Vec4>(rgb.len() as u64)?;
                rgb.into_iter().map(|c| c.extend(1.0)).collect()
            }
            Some(accessor) => {
                self.read::<4, Vec4>(accessor, Kind::Vec4, Integers::Normalized, source.pick)?
            }
            None => Vec::new(),
        };
        if source.primitive.attributes.contains_key("COLOR_1") {
            report.ignored("of several sets of vertex colours only the first is used");
        }
        let (uv0, uv1) = (uv(0)?, uv(1)?);
        Ok(TriangleMesh { positions, normals, tangents, uv0, uv1, colors, indices: Vec::new() })
    }

    /// Adds the tangents that a normal map needs and notes what textures lack.
    fn complete(
        &self,
        mesh: &mut TriangleMesh,
        material: Use,
        report: &mut LoadReport,
    ) -> Result<(), LoadError> {
        let missing = [mesh.uv0.is_empty(), mesh.uv1.is_empty()];
        if material.textured.iter().zip(missing).any(|(textured, missing)| *textured && missing) {
            report.repaired("textured surfaces without texture coordinates: they are taken as (0, 0)");
        }
        let Some(set) = material.normal_map_set.filter(|_| mesh.tangents.is_empty()) else { return Ok(()) };
        let uvs = if set == 0 { &mesh.uv0 } else { &mesh.uv1 };
        if !uvs.is_empty() && !mesh.indices.is_empty() {
            // Vertices are split where tangents differ: three a triangle at worst, and as much again while working.
            self.reserve::<[Vec4; 12]>(mesh.indices.len() as u64)?;
            if tangents::generate(mesh, set) == tangents::Method::PerTriangle {
                report.approximated(
                    "tangents of a mesh with very many triangles around one point are not smooth",
                );
            }
        }
        Ok(())
    }
}

/// Renumbers the vertices if the triangles use less than half of them; returns which ones are used, in order.
///
/// Many primitives may share one large vertex buffer and use a small part of it each.
fn compact(triangles: &mut [[u32; 3]], count: u64) -> Option<Vec<u32>> {
    if triangles.len() as u64 * 6 >= count {
        return None;
    }
    let mut used = triangles.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    for index in triangles.as_flattened_mut() {
        *index = used.partition_point(|u| u < index) as u32;
    }
    Some(used)
}
