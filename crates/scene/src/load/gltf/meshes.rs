//! Primitives to triangle meshes.

use super::accessor::{Integers, Pick};
use super::document::Document;
use super::instances::Job;
use super::json::{Kind, Primitive};
use super::materials::Use;
use super::pose::Source;
use super::repair::repair;
use super::topology::Topology;
use crate::animation::Deformation;
use crate::load::session::TRIANGLE;
use crate::{LoadError, LoadReport, Mesh, Part, Shape, TriangleMesh, normals, tangents};
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// A primitive as a mesh, and how its vertices move if they are animated.
struct Built {
    mesh: TriangleMesh,
    deformation: Option<Deformation>,
}

/// How the vertices of a part of a job's mesh move.
pub(super) struct JobDeformation {
    pub job: usize,
    pub part: u32,
    pub deformation: Deformation,
}

impl Document<'_> {
    /// Builds the meshes of all jobs, in parallel.
    ///
    /// - `origin`: what the transforms of the jobs are relative to.
    /// - `uses`: gives the use of a primitive's material.
    ///
    /// # Errors
    /// Broken or missing data; the first in file order.
    pub fn build_meshes(
        &self,
        jobs: &[Job],
        origin: DVec3,
        uses: impl Fn(Option<u32>) -> Use + Sync,
        report: &mut LoadReport,
    ) -> Result<(Vec<Mesh>, Vec<JobDeformation>), LoadError> {
        let tasks: Vec<(usize, usize)> = jobs
            .iter()
            .enumerate()
            .flat_map(|(job, j)| {
                (0..self.json.meshes[j.mesh as usize].primitives.len()).map(move |p| (job, p))
            })
            .collect();
        self.reserve::<(Option<Built>, LoadReport)>(tasks.len() as u64)?;
        let built: Vec<_> = tasks
            .par_iter()
            .map(|(job, index)| {
                let primitive = &self.json.meshes[jobs[*job].mesh as usize].primitives[*index];
                let mut notes = LoadReport::default();
                let mesh = self.build(&jobs[*job], *index, origin, uses(primitive.material), &mut notes);
                (mesh, notes)
            })
            .collect();
        let name = |job: &Job| {
            let name = self.json.meshes[job.mesh as usize].name.as_deref().filter(|n| !n.is_empty());
            name.map_or_else(|| format!("mesh {}", job.mesh), str::to_owned)
        };
        self.note_undrawn(jobs, report);
        let mut meshes: Vec<Mesh> = jobs.iter().map(|j| Mesh { name: name(j), parts: Vec::new() }).collect();
        let mut deformations = Vec::new();
        for ((job, index), (built, notes)) in tasks.into_iter().zip(built) {
            notes.notes.into_iter().for_each(|n| report.note(n.severity, n.message));
            if let Some(Built { mesh, deformation }) = built? {
                let material = self.json.meshes[jobs[job].mesh as usize].primitives[index].material;
                let material = uses(material).material;
                if let Some(deformation) = deformation {
                    let part = meshes[job].parts.len() as u32;
                    deformations.push(JobDeformation { job, part, deformation });
                }
                meshes[job].parts.push(Part { shape: Shape::Triangles(mesh), material });
            }
        }
        Ok((meshes, deformations))
    }

    /// Notes and counts the primitives of points and lines, for each mesh in use.
    fn note_undrawn(&self, jobs: &[Job], report: &mut LoadReport) {
        let used: BTreeSet<u32> = jobs.iter().map(|job| job.mesh).collect();
        for index in used {
            let mesh = &self.json.meshes[index as usize];
            let of = |modes: &[u32]| {
                let is_one = |p: &&Primitive| modes.contains(&p.mode.unwrap_or(4));
                mesh.primitives.iter().filter(is_one).count()
            };
            let (points, lines) = (of(&[0]), of(&[1, 2, 3]));
            let unknown = mesh.primitives.iter().filter(|p| p.mode.is_some_and(|mode| mode > 6)).count();
            let kinds = [(points, "points"), (lines, "lines"), (unknown, "a mode that does not exist")];
            let kinds = kinds.iter().filter(|(count, _)| *count > 0);
            let kinds: Vec<String> = kinds.map(|(count, what)| format!("{count} of {what}")).collect();
            if kinds.is_empty() {
                continue;
            }
            let name = mesh.name.as_deref().unwrap_or_default();
            let (left_out, all) = (points + lines + unknown, mesh.primitives.len());
            report.undrawn_primitives += left_out;
            report.ignored(format!(
                "mesh {index} `{name}`: {left_out} of {all} primitives are not drawn: {}",
                kinds.join(", ")
            ));
        }
    }

    /// One primitive; `None` if it has nothing to show.
    fn build(
        &self,
        job: &Job,
        index: usize,
        origin: DVec3,
        material: Use,
        report: &mut LoadReport,
    ) -> Result<Option<Built>, LoadError> {
        let mesh = &self.json.meshes[job.mesh as usize];
        let name = mesh.name.as_deref().unwrap_or_default();
        let object = format!("mesh {} `{name}`, primitive {index}", job.mesh);
        match self.build_strictly(job, origin, &mesh.primitives[index], &object, material, report) {
            Err(error @ LoadError::UnsupportedExtension { .. }) if self.options.lenient => {
                report.ignored(format!("{error}; it is left out"));
                Ok(None)
            }
            Err(error @ LoadError::Malformed { .. }) if self.options.lenient => {
                report.ignored(format!("{error}; it is left out"));
                Ok(None)
            }
            // Such files are whole; programs that know of each other pass the data along by other ways.
            Err(error @ LoadError::NoData { .. }) => {
                report.ignored(format!("{object} is not drawn: {error}"));
                Ok(None)
            }
            other => other,
        }
    }

    fn build_strictly(
        &self,
        job: &Job,
        origin: DVec3,
        primitive: &Primitive,
        object: &str,
        material: Use,
        report: &mut LoadReport,
    ) -> Result<Option<Built>, LoadError> {
        // What is left out was noted by `note_undrawn`.
        let Some(topology) = Topology::from_mode(primitive.mode.unwrap_or(4)) else { return Ok(None) };
        let Some(position) = primitive.attributes.get("POSITION").copied() else {
            report.ignored("a primitive without positions is not drawn");
            return Ok(None);
        };
        let compressed = self.decompressed(primitive, position, object)?;
        let (count, mut indices) = match &compressed {
            Some(compressed) => (compressed.vertices(), compressed.triangles().collect()),
            None => {
                let count = self.accessor_count(position)?;
                (count, self.triangles(primitive, topology, count, object, report)?)
            }
        };
        let used = compact(&mut indices, count);
        let pick = used.as_deref().map_or(Pick::All, Pick::Only);
        let source = Source { primitive, compressed: compressed.as_ref(), pick, count, object };
        let mut mesh = self.attributes(&source, material, report)?;
        mesh.indices = indices;
        self.settle_normals(&mut mesh, primitive, report);
        let mut deformation = self.deformation(job, &source, material, &mesh)?;
        repair(&mut mesh, report);
        let copies = self.complete(&mut mesh, material, report)?;
        if let Some(deformation) = &mut deformation {
            deformation.split(&copies);
            self.apply_pose(job, origin, deformation, &mut mesh, report);
        }
        let deformation = deformation.filter(|_| job.animated);
        Ok((!mesh.indices.is_empty()).then_some(Built { mesh, deformation }))
    }

    /// Turns normals that oppose the winding, unless they are to be kept. Differences of morph targets would have to be turned,
    /// too: there they are only reported.
    fn settle_normals(&self, mesh: &mut TriangleMesh, primitive: &Primitive, report: &mut LoadReport) {
        let keep = self.options.keep_normals || !primitive.targets.is_empty();
        let Some(done) = normals::turn_to_winding(std::slice::from_mut(mesh), keep) else { return };
        if !keep {
            // Bitangents stay where they are.
            mesh.tangents.iter_mut().for_each(|tangent| tangent.w = -tangent.w);
        }
        report.repaired(format!("normals oppose the winding of most faces of a primitive and {done}"));
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
        let count_of_triangles = topology.triangle_count(vertices.len() as u64);
        self.reserve::<[u32; 3]>(count_of_triangles)?;
        self.options.budget().take(count_of_triangles.saturating_mul(TRIANGLE / 2), "triangles")?;
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
        material: Use,
        report: &mut LoadReport,
    ) -> Result<TriangleMesh, LoadError> {
        let declared = Integers::AsDeclared;
        let positions =
            self.attribute::<3, Vec3>(source, "POSITION", Kind::Vec3, declared)?.unwrap_or_default();
        let normals = self.attribute::<3, Vec3>(source, "NORMAL", Kind::Vec3, declared)?.unwrap_or_default();
        // Without normals, tangents are to be ignored; without a normal map, nothing needs them.
        let tangents = if normals.is_empty() || material.tangents.is_none() {
            Vec::new()
        } else {
            self.attribute::<4, Vec4>(source, "TANGENT", Kind::Vec4, declared)?.unwrap_or_default()
        };
        let uv = |slot: usize| {
            let name = format!("TEXCOORD_{}", material.uv_sets[slot]);
            Ok::<_, LoadError>(
                self.attribute::<2, Vec2>(source, &name, Kind::Vec2, declared)?.unwrap_or_default(),
            )
        };
        let colors = if self.attribute_kind(source, "COLOR_0")? == Some(Kind::Vec3) {
            let rgb = self.attribute::<3, Vec3>(source, "COLOR_0", Kind::Vec3, Integers::Normalized)?;
            let rgb = rgb.unwrap_or_default();
            self.reserve::<Vec4>(rgb.len() as u64)?;
            rgb.into_iter().map(|c| c.extend(1.0)).collect()
        } else {
            self.attribute::<4, Vec4>(source, "COLOR_0", Kind::Vec4, Integers::Normalized)?
                .unwrap_or_default()
        };
        if source.primitive.attributes.contains_key("COLOR_1") {
            report.ignored("of several sets of vertex colours only the first is used");
        }
        let (uv0, uv1) = (uv(0)?, uv(1)?);
        Ok(TriangleMesh { positions, normals, tangents, uv0, uv1, colors, indices: Vec::new() })
    }

    /// Adds the tangents that a normal map needs and notes what textures lack. Returns which vertices were copied.
    fn complete(
        &self,
        mesh: &mut TriangleMesh,
        material: Use,
        report: &mut LoadReport,
    ) -> Result<Vec<u32>, LoadError> {
        let missing = [mesh.uv0.is_empty(), mesh.uv1.is_empty()];
        if material.textured.iter().zip(missing).any(|(textured, missing)| *textured && missing) {
            report.repaired("textured surfaces without texture coordinates: they are taken as (0, 0)");
        }
        let Some((set, transform)) = material.tangents.filter(|_| mesh.tangents.is_empty()) else {
            return Ok(Vec::new());
        };
        let uvs = if set == 0 { &mesh.uv0 } else { &mesh.uv1 };
        if !uvs.is_empty() && !mesh.indices.is_empty() {
            // Vertices are split where tangents differ: three a triangle at worst, and as much again while working.
            self.reserve::<[Vec4; 12]>(mesh.indices.len() as u64)?;
            let (method, copies) = tangents::generate_and_split(mesh, set, &transform);
            if method == tangents::Method::PerTriangle {
                report.approximated(
                    "tangents of a mesh with very many triangles around one point are not smooth",
                );
            }
            return Ok(copies);
        }
        Ok(Vec::new())
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
