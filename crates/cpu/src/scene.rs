//! A scene ready to be traced: tables and acceleration structures.

use crate::fetch::hit_records::HitRecordTable;
use accel::{Blas, Geometry, Instance, InstanceMotions, Quality, Sphere, Tlas};
use guiding::{Guide, Learner};
use optics::light::light_is_flat;
use optics::vector::{cross, dot};
use optics::{Vec3f, vec3f};
use scene::tables::{
    BindingRecord, BlasRecord, Changes, GeometryKind, GeometryRecord, InstanceRecord, LightRecord,
    MotionRange, NONE, SceneTables,
};
use std::sync::Arc;

/// Tables, acceleration structures, and what is looked up for every hit.
pub(crate) struct CpuScene {
    pub tables: Arc<SceneTables>,
    pub tlas: Tlas,
    pub hit_records: HitRecordTable,
    /// Indices of lights whose disc is seen in the sky.
    pub visible_discs: Vec<u32>,
    /// Whether there are no lights but triangles and rectangles without textures, which can be sampled many at a time.
    pub plain_lights: bool,
    /// Whether the sky is a gradient without anything in it: light that only paths find that leave the scene.
    pub plain_sky: bool,
    /// Whether paths have to know what they are in: see `volumes`.
    pub volumes: bool,
    /// What paths of the present view are guided by.
    pub guide: Option<Arc<Guide>>,
    /// Who learns from them.
    pub learner: Option<Arc<Learner>>,
}

/// Where a hit leads in the tables.
pub(crate) struct HitRecords<'a> {
    pub instance: &'a InstanceRecord,
    pub geometry: &'a GeometryRecord,
    pub binding: &'a BindingRecord,
    /// Number of the primitive within its geometry.
    pub primitive: u32,
}

impl CpuScene {
    pub fn new(tables: Arc<SceneTables>, quality: Quality) -> Self {
        let blas = tables.blas.iter().map(|b| Arc::new(build_blas(&tables, b, quality))).collect();
        let mut tlas = Tlas::build(&[], blas);
        tlas.update_moving(&instances(&tables), motions(&tables));
        Self::with_tlas(tables, tlas)
    }

    /// The scene with other tables, whose triangles are the same. Meshes that deform are refitted.
    pub fn update(self, tables: Arc<SceneTables>, changes: Changes, quality: Quality) -> Self {
        let mut tlas = self.tlas;
        if changes.vertices {
            let moved =
                (0..tables.blas.len()).filter(|b| vertices_differ(&self.tables, &tables, &tables.blas[*b]));
            for index in moved.collect::<Vec<_>>() {
                refit(tlas.blas_mut(index), &tables, &tables.blas[index], quality);
            }
        }
        if changes.transforms || changes.vertices {
            tlas.update_moving(&instances(&tables), motions(&tables));
        }
        Self::with_tlas(tables, tlas)
    }

    fn with_tlas(tables: Arc<SceneTables>, tlas: Tlas) -> Self {
        let is_disc = |&i: &u32| tables.lights[i as usize].visible;
        let visible_discs: Vec<u32> = (0..tables.lights.len() as u32).filter(is_disc).collect();
        let sky = &tables.environment;
        let plain_sky = sky.width == 0 && sky.light == NONE && visible_discs.is_empty();
        let is_plain = |l: &LightRecord| light_is_flat(l.light.kind) && l.textured_material == NONE;
        let plain_lights = tables.motion.is_none() && tables.lights.iter().all(is_plain);
        let hit_records = HitRecordTable::new(&tables);
        let volumes = tables.needs_volumes();
        Self {
            tables,
            tlas,
            hit_records,
            visible_discs,
            plain_lights,
            plain_sky,
            volumes,
            guide: None,
            learner: None,
        }
    }

    /// The records of a hit primitive.
    #[inline(always)]
    pub fn records(&self, instance: u32, primitive: u32) -> HitRecords<'_> {
        let binding = self.hit_records.binding(instance, primitive);
        let geometry = &self.tables.geometries[self.hit_records.hit_record(binding).geometry as usize];
        HitRecords {
            instance: &self.tables.instances[instance as usize],
            geometry,
            binding: &self.tables.bindings[binding as usize],
            primitive: primitive - geometry.first_in_blas,
        }
    }
}

/// How the instances move.
fn motions(tables: &SceneTables) -> InstanceMotions {
    let Some(motion) = &tables.motion else { return InstanceMotions::default() };
    let of_instances = motion.instances.iter().map(MotionRange::range).collect();
    InstanceMotions { segments: motion.segments.clone(), of_instances }
}

fn instances(tables: &SceneTables) -> Vec<Instance> {
    let instance =
        |i: &InstanceRecord| Instance { blas: i.blas, object_to_world: i.object_to_world, mask: u32::MAX };
    tables.instances.iter().map(instance).collect()
}

/// Whether a vertex of an object moved between two versions of the scene.
fn vertices_differ(old: &SceneTables, new: &SceneTables, blas: &BlasRecord) -> bool {
    let geometries = &new.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
    geometries.iter().any(|g| {
        let range = g.first_vertex as usize..(g.first_vertex + g.vertex_count) as usize;
        old.positions[range.clone()] != new.positions[range]
    })
}

/// Fits an object's structure to its moved vertices.
fn refit(blas: &mut Blas, tables: &SceneTables, record: &BlasRecord, quality: Quality) {
    if record.kind == GeometryKind::Triangles && blas.skipped_primitives() == 0 {
        blas.refit(&triangles(tables, record));
    } else {
        // Triangles that had no area before are not in the structure, but may have one now.
        *blas = build_blas(tables, record, quality);
    }
}

fn triangles<'t>(tables: &'t SceneTables, blas: &BlasRecord) -> Vec<Geometry<'t>> {
    let geometries = &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
    let geometry = |g: &GeometryRecord| Geometry {
        positions: &tables.positions[g.first_vertex as usize..][..g.vertex_count as usize],
        indices: &tables.indices[g.first_primitive as usize..][..g.primitive_count as usize],
        first_id: g.first_in_blas,
    };
    geometries.iter().map(geometry).collect()
}

fn build_blas(tables: &SceneTables, blas: &BlasRecord, quality: Quality) -> Blas {
    match blas.kind {
        GeometryKind::Triangles => Blas::triangles(&triangles(tables, blas), quality),
        GeometryKind::Spheres => {
            let geometries =
                &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
            let range = |g: &GeometryRecord| {
                &tables.spheres[g.first_primitive as usize..][..g.primitive_count as usize]
            };
            let sphere = |s: &[f32; 4]| Sphere { center: [s[0], s[1], s[2]], radius: s[3] };
            let spheres: Vec<_> = geometries.iter().flat_map(range).map(sphere).collect();
            Blas::spheres(&spheres, 0, quality)
        }
    }
}

/// A point through the rows of a 3×4 matrix.
#[inline]
pub(crate) fn transform_point(m: &[[f32; 4]; 3], p: Vec3f) -> Vec3f {
    let row = |r: &[f32; 4]| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3];
    vec3f(row(&m[0]), row(&m[1]), row(&m[2]))
}

/// A vector through the rows of a 3×4 matrix.
#[inline]
pub(crate) fn transform_vector(m: &[[f32; 4]; 3], v: Vec3f) -> Vec3f {
    let row = |r: &[f32; 4]| r[0] * v.x + r[1] * v.y + r[2] * v.z;
    vec3f(row(&m[0]), row(&m[1]), row(&m[2]))
}

/// A normal from object to world space, given the rows of world to object; not normalised.
#[inline]
pub(crate) fn transform_normal(world_to_object: &[[f32; 4]; 3], n: Vec3f) -> Vec3f {
    let m = world_to_object;
    vec3f(
        m[0][0] * n.x + m[1][0] * n.y + m[2][0] * n.z,
        m[0][1] * n.x + m[1][1] * n.y + m[2][1] * n.z,
        m[0][2] * n.x + m[1][2] * n.y + m[2][2] * n.z,
    )
}

/// Determinant of the linear part of a 3×4 matrix; negative where it mirrors.
pub(crate) fn determinant(m: &[[f32; 4]; 3]) -> f32 {
    let row = |r: &[f32; 4]| vec3f(r[0], r[1], r[2]);
    dot(row(&m[0]), cross(row(&m[1]), row(&m[2])))
}

/// An array as an optics vector.
#[inline]
pub(crate) fn vec3(a: [f32; 3]) -> Vec3f {
    vec3f(a[0], a[1], a[2])
}
