//! Parsed faces to meshes: one for each object or group, with one part for each of its materials.

use super::parse::{Change, Corner, Data, MISSING};
use super::polygons;
use crate::load::textures::vertex_colors;
use crate::normals::{self, group};
use crate::subdivision::Cage;
use crate::triangulate::Triangulator;
use crate::{LoadOptions, LoadReport, Mesh, Part, Shape, TriangleMesh};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::HashMap;

/// Faces of one chunk that share mesh, material and smoothing group.
pub(super) struct Run {
    pub(super) chunk: u32,
    pub(super) faces: std::ops::Range<u32>,
    smoothing: u32,
}

/// What becomes a mesh.
struct MeshPlan {
    name: String,
    parts: Vec<PartPlan>,
}

/// What becomes a part: a material (by order of first use) and its faces.
pub(super) struct PartPlan {
    pub(super) material: u32,
    pub(super) runs: Vec<Run>,
}

/// Meshes, and the names of the materials that their parts refer to by position; `None` is a face without `usemtl`.
pub(super) struct Built {
    pub(super) meshes: Vec<Mesh>,
    pub(super) materials: Vec<Option<String>>,
    /// The polygons of meshes, with their numbers, if they are to be kept.
    pub(super) cages: Vec<(u32, Cage)>,
}

/// With more objects than this, a file's faces become a single mesh.
const MAX_MESHES: usize = 10_000;

/// Makes the meshes of a file. `name` is that of the mesh outside of all objects and groups.
pub(super) fn build(data: &Data, name: &str, options: &LoadOptions, report: &mut LoadReport) -> Built {
    let mut planner = Planner::new(data, name);
    planner.run(data);
    let Planner { mut plans, materials, smoothing, .. } = planner;
    if plans.len() > MAX_MESHES {
        report.info(format!("more than {MAX_MESHES} objects were merged into one mesh"));
        plans = vec![merge(plans, name)];
    }
    let colors = vertex_colors(data.colors.clone(), true, report);
    let built: Vec<(Mesh, Counts, Option<Cage>)> = plans
        .into_par_iter()
        .map(|plan| {
            let source = Source { data, colors: &colors };
            build_mesh(plan, &source, smoothing, options)
        })
        .collect();
    let mut counts = Counts::default();
    let mut meshes = Vec::with_capacity(built.len());
    let mut cages = Vec::new();
    for (mesh, of_mesh, cage) in built {
        counts.add(&of_mesh);
        if !mesh.parts.is_empty() {
            cages.extend(cage.map(|cage| (meshes.len() as u32, cage)));
            meshes.push(mesh);
        }
    }
    counts.report(report);
    Built { meshes, materials, cages }
}

/// Sorts faces into meshes and parts, following the statements between them.
struct Planner {
    plans: Vec<MeshPlan>,
    /// Names of materials in order of first use by a face.
    materials: Vec<Option<String>>,
    /// Whether the file has any `s` statement.
    smoothing: bool,
    /// Objects divide the file into meshes; without any, groups do.
    by_object: bool,
    default_name: String,
    mesh_ids: HashMap<Option<String>, usize>,
    part_ids: HashMap<(usize, u32), usize>,
    material_ids: HashMap<Option<String>, u32>,
}

impl Planner {
    fn new(data: &Data, name: &str) -> Self {
        let any = |wanted: fn(&Change) -> bool| {
            data.chunks.iter().any(|c| c.changes.iter().any(|(_, s)| wanted(s)))
        };
        Self {
            plans: Vec::new(),
            materials: Vec::new(),
            smoothing: any(|c| matches!(c, Change::Smoothing(_))),
            by_object: any(|c| matches!(c, Change::Object(_))),
            default_name: name.to_owned(),
            mesh_ids: HashMap::new(),
            part_ids: HashMap::new(),
            material_ids: HashMap::new(),
        }
    }

    fn run(&mut self, data: &Data) {
        let (mut mesh, mut material, mut smoothing): (Option<&str>, Option<&str>, u32) =
            (None, None, group::BY_CREASE);
        for (chunk, faces) in data.chunks.iter().enumerate() {
            let mut start = 0;
            for (at, change) in &faces.changes {
                self.add(mesh, material, Run { chunk: chunk as u32, faces: start..*at, smoothing });
                start = *at;
                match change {
                    Change::Object(name) if self.by_object => mesh = Some(name),
                    Change::Group(name) if !self.by_object => mesh = Some(name),
                    Change::Material(name) => material = Some(name),
                    Change::Smoothing(value) => smoothing = *value,
                    Change::Object(_) | Change::Group(_) | Change::Library(_) => {}
                }
            }
            self.add(mesh, material, Run { chunk: chunk as u32, faces: start..faces.len(), smoothing });
        }
    }

    fn add(&mut self, mesh: Option<&str>, material: Option<&str>, run: Run) {
        if run.faces.is_empty() {
            return;
        }
        let mesh_id = *self.mesh_ids.entry(mesh.map(str::to_owned)).or_insert_with(|| {
            let name = mesh.filter(|n| !n.is_empty()).unwrap_or(&self.default_name).to_owned();
            self.plans.push(MeshPlan { name, parts: Vec::new() });
            self.plans.len() - 1
        });
        let material_id = *self.material_ids.entry(material.map(str::to_owned)).or_insert_with(|| {
            self.materials.push(material.map(str::to_owned));
            (self.materials.len() - 1) as u32
        });
        let parts = &mut self.plans[mesh_id].parts;
        let part_id = *self.part_ids.entry((mesh_id, material_id)).or_insert_with(|| {
            parts.push(PartPlan { material: material_id, runs: Vec::new() });
            parts.len() - 1
        });
        parts[part_id].runs.push(run);
    }
}

fn merge(plans: Vec<MeshPlan>, name: &str) -> MeshPlan {
    let mut part_ids = HashMap::new();
    let mut merged = MeshPlan { name: name.to_owned(), parts: Vec::new() };
    for part in plans.into_iter().flat_map(|p| p.parts) {
        let id = *part_ids.entry(part.material).or_insert(merged.parts.len());
        if id == merged.parts.len() {
            merged.parts.push(PartPlan { material: part.material, runs: Vec::new() });
        }
        merged.parts[id].runs.extend(part.runs);
    }
    merged
}

pub(super) struct Source<'a> {
    pub(super) data: &'a Data,
    /// Linear vertex colours, or none.
    pub(super) colors: &'a [Vec4],
}

/// How often something had to be mended.
#[derive(Default)]
struct Counts {
    out_of_range: usize,
    attributes_out_of_range: usize,
    without_uv: usize,
    not_simple: usize,
    bad_normals: usize,
    /// Meshes with normals that oppose the winding, and what became of those.
    opposing: usize,
    done_with_opposing: &'static str,
}

impl Counts {
    fn add(&mut self, other: &Self) {
        self.out_of_range += other.out_of_range;
        self.attributes_out_of_range += other.attributes_out_of_range;
        self.without_uv += other.without_uv;
        self.not_simple += other.not_simple;
        self.bad_normals += other.bad_normals;
        self.opposing += other.opposing;
        if other.opposing > 0 {
            self.done_with_opposing = other.done_with_opposing;
        }
    }

    fn report(&self, report: &mut LoadReport) {
        if self.out_of_range > 0 {
            report.ignored(format!("{} faces refer to positions that do not exist", self.out_of_range));
        }
        if self.attributes_out_of_range > 0 {
            let count = self.attributes_out_of_range;
            report.repaired(format!(
                "{count} corners refer to normals or texture coordinates that do not exist"
            ));
        }
        if self.without_uv > 0 {
            report.repaired(format!("{} corners lack texture coordinates; (0, 0) is used", self.without_uv));
        }
        if self.not_simple > 0 {
            report.repaired(format!("{} polygons cross themselves or have no area", self.not_simple));
        }
        if self.opposing > 0 {
            report.repaired(format!(
                "normals of {} meshes oppose the winding of most of their faces and {}",
                self.opposing, self.done_with_opposing
            ));
        }
        if self.bad_normals > 0 {
            report.repaired(format!("{} normals have no length and are computed", self.bad_normals));
        }
    }
}

fn build_mesh(
    plan: MeshPlan,
    source: &Source,
    smoothing: bool,
    options: &LoadOptions,
) -> (Mesh, Counts, Option<Cage>) {
    let built: Vec<(Builder, u32)> =
        plan.parts.par_iter().map(|part| (Builder::new(source, part).build(part), part.material)).collect();
    let drawn = plan.parts.iter().zip(&built).filter(|(_, (builder, _))| !builder.mesh.indices.is_empty());
    let drawn: Vec<&PartPlan> = drawn.map(|(part, _)| part).collect();
    let cage = options.keep_polygons.then(|| polygons::cage(&drawn, source));
    let mut counts = Counts::default();
    let (mut meshes, mut groups, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    for (builder, material) in built.into_iter().filter(|(b, _)| !b.mesh.indices.is_empty()) {
        meshes.push(builder.mesh);
        groups.push(if smoothing { builder.groups } else { Vec::new() });
        materials.push(material);
        counts.add(&builder.counts);
    }
    let opposing = normals::turn_to_winding(&mut meshes, options.keep_normals);
    counts.opposing += usize::from(opposing.is_some());
    counts.done_with_opposing = opposing.unwrap_or_default();
    normals::generate_grouped(&mut meshes, options.crease_angle, &groups);
    let parts = meshes.into_iter().zip(materials);
    let parts = parts.map(|(mesh, material)| Part { shape: Shape::Triangles(mesh), material }).collect();
    (Mesh { name: plan.name, parts }, counts, cage)
}

/// The end of a list of vertices.
const NONE: u32 = u32::MAX;
/// Vertices of one position that are compared before one more is made; duplicates do no harm.
const MAX_COMPARED: usize = 32;

/// Makes the triangles of a part; corners that are equal become one vertex.
struct Builder<'a> {
    source: &'a Source<'a>,
    mesh: TriangleMesh,
    groups: Vec<u32>,
    counts: Counts,
    positions_used: PositionsUsed,
    /// The newest vertex of each position in use.
    heads: Vec<u32>,
    /// For each vertex, the other indices of its corner, and an older vertex of the same position.
    vertices: Vec<(i32, i32, u32)>,
}

/// Which positions a part uses, as small numbers.
enum PositionsUsed {
    /// Nearly all from this one on.
    Dense(i32),
    /// These, in ascending order.
    Sparse(Vec<i32>),
}

impl<'a> Builder<'a> {
    fn new(source: &'a Source, plan: &PartPlan) -> Self {
        let count = source.data.positions.len() as i64;
        let corners =
            || plan.corners(source.data).map(|c| c[0]).filter(|v| (0..count).contains(&i64::from(*v)));
        let (mut low, mut high, mut corner_count) = (i32::MAX, 0, 0usize);
        for v in corners() {
            (low, high, corner_count) = (low.min(v), high.max(v), corner_count + 1);
        }
        let span = if corner_count == 0 { 0 } else { (high - low) as usize + 1 };
        let (positions_used, used) = if span <= corner_count * 4 + 1024 {
            (PositionsUsed::Dense(low), span)
        } else {
            let mut sorted: Vec<i32> = corners().collect();
            sorted.sort_unstable();
            sorted.dedup();
            let used = sorted.len();
            (PositionsUsed::Sparse(sorted), used)
        };
        Self {
            source,
            mesh: TriangleMesh::default(),
            groups: Vec::new(),
            counts: Counts::default(),
            positions_used,
            heads: vec![NONE; used],
            vertices: Vec::new(),
        }
    }

    fn build(mut self, plan: &PartPlan) -> Self {
        let has = |component: usize| plan.corners(self.source.data).any(|c| c[component] != MISSING);
        let (has_uv, has_normal) = (has(1), has(2));
        let mut triangulator = Triangulator::default();
        let (mut ids, mut points, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for run in &plan.runs {
            let faces = &self.source.data.chunks[run.chunk as usize];
            for face in run.faces.clone() {
                let corners = faces.face(face);
                let count = self.source.data.positions.len();
                if corners.iter().any(|c| c[0] < 0 || c[0] as usize >= count) {
                    self.counts.out_of_range += 1;
                    continue;
                }
                ids.clear();
                ids.extend(corners.iter().map(|c| self.vertex(c, has_uv, has_normal)));
                if let [a, b, c] = ids[..] {
                    self.mesh.indices.push([a, b, c]);
                } else {
                    points.clear();
                    points.extend(corners.iter().map(|c| self.source.data.positions[c[0] as usize]));
                    triangles.clear();
                    self.counts.not_simple += usize::from(!triangulator.polygon(&points, &mut triangles));
                    self.mesh.indices.extend(triangles.iter().map(|t| t.map(|i| ids[i as usize])));
                }
                self.groups.resize(self.mesh.indices.len(), run.smoothing);
            }
        }
        self
    }

    /// The vertex of a corner whose position exists.
    fn vertex(&mut self, corner: &Corner, has_uv: bool, has_normal: bool) -> u32 {
        let data = self.source.data;
        let [v, t, n] = *corner;
        let t = self.checked(t, data.uvs.len());
        let n = self.checked(n, data.normals.len());
        let slot = match &self.positions_used {
            PositionsUsed::Dense(low) => (v - low) as usize,
            PositionsUsed::Sparse(sorted) => sorted.partition_point(|p| *p < v),
        };
        let head = self.heads[slot];
        let mut known = head;
        for _ in 0..MAX_COMPARED {
            if known == NONE {
                break;
            }
            let (other_t, other_n, older) = self.vertices[known as usize];
            if (other_t, other_n) == (t, n) {
                return known;
            }
            known = older;
        }
        let id = self.vertices.len() as u32;
        self.vertices.push((t, n, head));
        self.heads[slot] = id;
        self.mesh.positions.push(data.positions[v as usize]);
        if has_uv {
            self.counts.without_uv += usize::from(t == MISSING);
            self.mesh.uv0.push(data.uvs.get(t as usize).copied().unwrap_or(Vec2::ZERO));
        }
        if has_normal {
            let given = data.normals.get(n as usize);
            // Zero asks for a computed one.
            let normal = given.and_then(|n| n.try_normalize()).unwrap_or(Vec3::ZERO);
            self.counts.bad_normals += usize::from(given.is_some() && normal == Vec3::ZERO);
            self.mesh.normals.push(normal);
        }
        if let Some(color) = self.source.colors.get(v as usize) {
            self.mesh.colors.push(*color);
        }
        id
    }

    fn checked(&mut self, index: i32, count: usize) -> i32 {
        if index == MISSING || (index >= 0 && (index as usize) < count) {
            return index;
        }
        self.counts.attributes_out_of_range += 1;
        MISSING
    }
}

impl PartPlan {
    pub(super) fn corners<'a>(&'a self, data: &'a Data) -> impl Iterator<Item = &'a Corner> {
        self.runs.iter().flat_map(|run| {
            let faces = &data.chunks[run.chunk as usize];
            run.faces.clone().flat_map(|face| faces.face(face))
        })
    }
}
