//! What is looked up for every hit, gathered in one place.
//!
//! The scene tables are made to be small and to be shared with GPUs. From a hit to its triangle, that is a chain of five
//! records in as many arrays, and most of the fields are about something else. Here each binding (one geometry of one
//! instance) has what the chain would find, in a cache line.

use crate::batch::lanes::{LANES, Lanes};
use crate::scene::determinant;
use crate::simd::Instructions;
use bytemuck::NoUninit;
use optics::ggx::MIN_ALPHA;
use optics::material::{SLOT_BASE_COLOR, SLOT_METALLIC_ROUGHNESS, SLOT_NORMAL};
use scene::tables::{
    BlasRecord, GeometryKind, InstanceRecord, MATERIAL_CHECKERBOARD, MATERIAL_SMOOTH_TERMINATOR,
    MATERIAL_THIN, MaterialRecord, ModelTag, NONE, SceneTables,
};

/// One geometry of one instance.
/// Sixteen numbers, so that those of sixteen hit records can be put side by side: see [`HitRecordTable::rows`].
#[derive(Clone, Copy, Debug, NoUninit)]
#[repr(C, align(64))]
pub(crate) struct HitRecord {
    /// Number that the bottom-level structure gives to the geometry's first primitive.
    pub first_in_blas: u32,
    /// Index of the geometry's first triangle in `indices`.
    pub first_primitive: u32,
    /// Index of its first vertex in `positions`.
    pub first_vertex: u32,
    /// Index of its first normal in `normals`, or `NONE`.
    pub first_normal: u32,
    /// Index into the tables' geometries.
    pub geometry: u32,
    /// Index into the tables' materials.
    pub material: u32,
    /// What paths come to here.
    pub shading_class: ShadingClass,
    /// Bits of [`form`].
    pub form: u32,
    /// Albedo or tint of what is plain.
    pub color: [f32; 3],
    /// Index of refraction of a plain dielectric, and one over it.
    pub ior: f32,
    pub inverse_ior: f32,
    /// Of a plain glossy surface: as [`optics::glossy::MetallicRoughness`] has them.
    pub metallic: f32,
    pub roughness: f32,
    pub specular: f32,
}

/// What the triangles of a hit record are like, as bits.
pub(crate) mod form {
    /// Their vertices are in the space of their object, not in world space.
    pub const MOVED: u32 = 1;
    /// They have vertex normals.
    pub const SMOOTH: u32 = 2;
    /// They are so many that they need not be in the first cache.
    pub const MANY: u32 = 4;
    /// They gather light where the smooth surface would be; see `optics::terminator`.
    pub const LIFTED: u32 = 8;
}

/// Triangles of a geometry that are likely to be in the first cache when they are hit, at most.
const FEW_TRIANGLES: u32 = 64;

/// What a path comes to. Surfaces from [`ShadingClass::Surface`] on are triangles that are computed many at a time. Those of the kinds behind it are
/// scattered many at a time, too: their materials do not shine, have one colour all over, and scatter in one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, NoUninit)]
#[repr(u32)]
pub(crate) enum ShadingClass {
    /// There is no path.
    Nothing,
    /// Beyond everything.
    Sky,
    /// A surface that takes the general way of [`crate::fetch::surface::Surface::new`].
    General,
    /// A surface that scatters in any way.
    Surface,
    /// Ideal diffuse reflection.
    Lambert,
    /// A smooth interface between two media.
    Smooth,
    /// Diffuse and GGX reflection.
    Glossy,
}

impl ShadingClass {
    /// At a triangle that can be computed with others.
    fn of_material(material: &MaterialRecord) -> Self {
        let textured =
            [SLOT_BASE_COLOR, SLOT_METALLIC_ROUGHNESS].iter().any(|&s| material.texture(s).is_some());
        let patterned = material.flags & MATERIAL_CHECKERBOARD != 0;
        if material.is_emissive() || material.absorbs() || textured || patterned {
            return ShadingClass::Surface;
        }
        let alpha = material.roughness * material.roughness;
        match material.model {
            ModelTag::Lambert => ShadingClass::Lambert,
            ModelTag::Dielectric if alpha < MIN_ALPHA && material.flags & MATERIAL_THIN == 0 => {
                ShadingClass::Smooth
            }
            ModelTag::MetallicRoughness if material.transmission <= 0.0 => ShadingClass::Glossy,
            ModelTag::Dielectric
            | ModelTag::MetallicRoughness
            | ModelTag::Mirror
            | ModelTag::Unlit
            | ModelTag::Boundary
            | ModelTag::Layered => ShadingClass::Surface,
        }
    }
}

/// Geometries up to which a search through all of them, for sixteen primitives at once, beats a table by primitive.
const FEW: usize = 16;

/// How to find the geometry of a primitive.
enum Geometries {
    /// There is only one.
    One,
    /// First primitives, `u32::MAX` beyond the last geometry.
    Few([u32; FEW]),
    /// Geometry by primitive.
    Many(Vec<u32>),
}

/// All hit records of a scene and the way to them.
pub(crate) struct HitRecordTable {
    /// Parallel to the tables' bindings.
    hit_records: Vec<HitRecord>,
    /// The numbers of all hit records by the order of the fields, if there are at most sixteen.
    columns: Option<Box<[[u32; LANES]; LANES]>>,
    /// For each instance: its first binding and its structure.
    instances: Vec<[u32; 2]>,
    /// For each structure.
    geometries: Vec<Geometries>,
}

impl HitRecordTable {
    pub fn new(tables: &SceneTables) -> Self {
        let of_instance = |i: &InstanceRecord| {
            let first = tables.blas[i.blas as usize].first_geometry;
            let count = tables.blas[i.blas as usize].geometry_count;
            let hit_record = |k: u32| hit_record(tables, i, first + k, i.first_binding + k);
            (0..count).map(|k| (i.first_binding + k, hit_record(k))).collect::<Vec<_>>()
        };
        let mut hit_records: Vec<_> = tables.instances.iter().flat_map(of_instance).collect();
        hit_records.sort_unstable_by_key(|(binding, _)| *binding);
        let hit_records: Vec<HitRecord> = hit_records.into_iter().map(|(_, hit_record)| hit_record).collect();
        Self {
            columns: columns(bytemuck::cast_slice(&hit_records)),
            hit_records,
            instances: tables.instances.iter().map(|i| [i.first_binding, i.blas]).collect(),
            geometries: tables.blas.iter().map(|b| geometries(tables, b)).collect(),
        }
    }

    /// The binding of a hit primitive, which is also its hit record's index.
    #[inline(always)]
    pub fn binding(&self, instance: u32, primitive: u32) -> u32 {
        let [first_binding, blas] = self.instances[instance as usize];
        let geometry = match &self.geometries[blas as usize] {
            Geometries::One => 0,
            // The last geometry that starts at the primitive or before it.
            Geometries::Few(first) => first.iter().map(|&f| u32::from(f <= primitive)).sum::<u32>() - 1,
            Geometries::Many(geometry) => geometry[primitive as usize],
        };
        first_binding + geometry
    }

    /// The bindings of the hit primitives in `mask`. Others get anything.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "only so all lanes are compared at once")]
    pub fn bindings(
        &self,
        instances: &[u32; LANES],
        primitives: &[u32; LANES],
        mut mask: u32,
        out: &mut Lanes<u32>,
    ) {
        if let [[first_binding, blas]] = self.instances[..] {
            match &self.geometries[blas as usize] {
                Geometries::One => {
                    out.0.fill(first_binding);
                    return;
                }
                Geometries::Few(first) => {
                    let mut started = [0; LANES];
                    for first in *first {
                        for lane in 0..LANES {
                            started[lane] += u32::from(first <= primitives[lane]);
                        }
                    }
                    for lane in 0..LANES {
                        out.0[lane] = first_binding.wrapping_add(started[lane]).wrapping_sub(1);
                    }
                    return;
                }
                Geometries::Many(_) => {}
            }
        }
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            out.0[lane] = self.binding(instances[lane], primitives[lane]);
        }
    }

    /// All hit records as rows of numbers, in the order of the fields.
    #[inline(always)]
    fn rows(&self) -> &[[u32; LANES]] {
        bytemuck::cast_slice(&self.hit_records)
    }

    /// The numbers of the hit records of the `bindings` in `mask`, in the order of the fields. Others get anything.
    #[inline(always)]
    pub fn fetch<I: Instructions>(
        &self,
        i: I,
        bindings: &[u32; LANES],
        mask: u32,
        fields: [&mut [u32; LANES]; LANES],
    ) {
        match &self.columns {
            Some(columns) => {
                for (column, field) in columns.iter().zip(fields) {
                    i.look_up(column, bindings, field);
                }
            }
            None => i.fetch_rows(self.rows(), bindings, mask, fields),
        }
    }

    /// The hit record of a binding.
    #[inline(always)]
    pub fn hit_record(&self, binding: u32) -> &HitRecord {
        &self.hit_records[binding as usize]
    }
}

/// A few rows turned around.
fn columns(rows: &[[u32; LANES]]) -> Option<Box<[[u32; LANES]; LANES]>> {
    if rows.len() > LANES {
        return None;
    }
    let mut columns = Box::new([[0; LANES]; LANES]);
    for (place, row) in rows.iter().enumerate() {
        for (column, number) in columns.iter_mut().zip(row) {
            column[place] = *number;
        }
    }
    Some(columns)
}

fn hit_record(tables: &SceneTables, instance: &InstanceRecord, geometry: u32, binding: u32) -> HitRecord {
    let g = &tables.geometries[geometry as usize];
    let material_index = tables.bindings[binding as usize].material;
    let material = &tables.materials[material_index as usize];
    // Patterns live in object space, and mirroring turns the normal.
    let patterned = material.flags & MATERIAL_CHECKERBOARD != 0;
    // Layers want tangents, and the normal without its map; graphs ask where they are in every space.
    let bare = !material.texture(SLOT_NORMAL).is_some() && material.layers == NONE && !material.has_graphs();
    let pattern_is_placed = patterned && tables.bindings[binding as usize].placement != NONE;
    let placed_oddly = pattern_is_placed
        || (!instance.identity && (patterned || determinant(&instance.object_to_world) < 0.0));
    let [red, green, blue, _] = material.base_color.to_array();
    HitRecord {
        first_in_blas: g.first_in_blas,
        first_primitive: g.first_primitive,
        first_vertex: g.first_vertex,
        first_normal: g.first_normal,
        geometry,
        material: material_index,
        shading_class: if g.kind != GeometryKind::Triangles || placed_oddly || !bare {
            ShadingClass::General
        } else if g.first_color != NONE {
            ShadingClass::Surface
        } else {
            ShadingClass::of_material(material)
        },
        form: if instance.identity { 0 } else { form::MOVED }
            | if g.first_normal == NONE { 0 } else { form::SMOOTH }
            | if material.flags & MATERIAL_SMOOTH_TERMINATOR == 0 { 0 } else { form::LIFTED }
            | if g.primitive_count <= FEW_TRIANGLES { 0 } else { form::MANY },
        color: [red, green, blue],
        ior: material.ior,
        inverse_ior: 1.0 / material.ior,
        metallic: material.metallic.clamp(0.0, 1.0),
        roughness: material.roughness.clamp(0.0, 1.0),
        specular: material.specular,
    }
}

fn geometries(tables: &SceneTables, blas: &BlasRecord) -> Geometries {
    let records = &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
    if records.len() <= 1 {
        return Geometries::One;
    }
    if records.len() <= FEW {
        let mut first = [u32::MAX; FEW];
        for (f, record) in first.iter_mut().zip(records) {
            *f = record.first_in_blas;
        }
        return Geometries::Few(first);
    }
    let numbered = (0..).zip(records);
    Geometries::Many(numbered.flat_map(|(i, g)| std::iter::repeat_n(i, g.primitive_count as usize)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Vec3};
    use scene::{Instance, Material, Mesh, Part, Scene, Shape, shapes};

    /// A mesh of this many parts, two triangles each, which stands so often in the world.
    fn tables(parts: usize, instances: usize) -> SceneTables {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        let part = || Part { shape: Shape::Triangles(shapes::rectangle(glam::Vec2::ONE)), material: 0 };
        let parts = std::iter::repeat_with(part).take(parts).collect();
        scene.meshes.push(Mesh { name: "m".into(), parts });
        for i in 0..instances {
            let place = Affine3A::from_translation(Vec3::X * (10.0 * i as f32 + 1.0));
            scene.instances.push(Instance::new("i", 0, place));
        }
        SceneTables::build(&scene)
    }

    #[test]
    fn sixteen_bindings_are_those_of_each() {
        for (parts, instances) in [(1, 1), (5, 1), (16, 1), (40, 1), (5, 3)] {
            let tables = tables(parts, instances);
            let (triangles, hit_records) = (2 * parts as u32, HitRecordTable::new(&tables));
            let placed = tables.instances.len() as u32;
            for start in 0..triangles {
                let primitive: [u32; LANES] =
                    std::array::from_fn(|lane| (start + 7 * lane as u32) % triangles);
                let instance: [u32; LANES] = std::array::from_fn(|lane| lane as u32 % placed);
                let mut found = Lanes::default();
                hit_records.bindings(&instance, &primitive, 0xffff, &mut found);
                for lane in 0..LANES {
                    let binding = hit_records.binding(instance[lane], primitive[lane]);
                    assert_eq!(found.0[lane], binding, "triangle {} of {parts} parts", primitive[lane]);
                    let hit_record = hit_records.hit_record(binding);
                    assert!(
                        hit_record.first_in_blas <= primitive[lane]
                            && primitive[lane] < hit_record.first_in_blas + 2
                    );
                    assert_eq!(hit_records.rows()[binding as usize][0], hit_record.first_in_blas);
                    assert_eq!(hit_records.rows()[binding as usize][11], hit_record.ior.to_bits());
                }
            }
        }
    }
}
