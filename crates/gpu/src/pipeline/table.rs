//! The shader binding table: which shaders run where a ray arrives, and with what data.
//!
//! The driver finds the record of a hit by
//!
//! > ray type offset + ray type stride × geometry + instance offset
//!
//! where the first two come with the ray, the third is the geometry's number in its bottom-level structure, and the last
//! comes with the instance. Here the offset of a ray type is its number and the stride is [`RAY_TYPES`], so the records of
//! one geometry stand side by side, one for each ray type. Instances of one structure with the same materials share
//! their records. `docs/shader-binding-table.md` has a figure.

use bytemuck::{Pod, Zeroable};
use scene::tables::{GeometryKind, InstanceRecord, MaterialRecord, ModelTag, SceneTables};
use std::collections::HashMap;

/// What a ray is traced for. The number is its offset in the table, and its miss shader's index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum RayType {
    /// What is the nearest surface?
    Radiance = 0,
    /// Is anything in the way?
    Shadow = 1,
}

/// Number of ray types: the stride of geometries in the table.
pub const RAY_TYPES: u32 = 2;

/// How surfaces of a material meet light, as far as choosing shaders is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum MaterialClass {
    /// Diffuse and glossy reflection, mirrors included.
    Reflecting = 0,
    /// Refraction.
    Dielectric = 1,
    /// Emission, whatever else there is.
    Emissive = 2,
}

/// Number of material classes.
pub const MATERIAL_CLASSES: u32 = 3;

impl MaterialClass {
    /// The class of a material.
    pub fn of(material: &MaterialRecord) -> Self {
        if material.is_emissive() {
            return Self::Emissive;
        }
        match material.model {
            ModelTag::Dielectric => Self::Dielectric,
            ModelTag::MetallicRoughness | ModelTag::Layered if material.transmission > 0.0 => {
                Self::Dielectric
            }
            ModelTag::MetallicRoughness
            | ModelTag::Layered
            | ModelTag::Lambert
            | ModelTag::Mirror
            | ModelTag::Boundary => Self::Reflecting,
            // Unlit surfaces show their base colour as if they emitted it.
            ModelTag::Unlit => Self::Emissive,
        }
    }

    const ALL: [Self; MATERIAL_CLASSES as usize] = [Self::Reflecting, Self::Dielectric, Self::Emissive];
}

/// Shaders that belong together: what a record names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HitGroup {
    /// For which rays.
    pub ray: RayType,
    /// What primitives: spheres need an intersection shader.
    pub primitive: GeometryKind,
    /// Whether the surface may have holes: an any-hit shader looks.
    pub holes: bool,
    /// On which materials. Shadow rays do not ask; theirs is always [`MaterialClass::Reflecting`].
    pub class: MaterialClass,
}

impl HitGroup {
    fn new(ray: RayType, primitive: GeometryKind, material: &MaterialRecord) -> Self {
        let class = match ray {
            RayType::Radiance => MaterialClass::of(material),
            RayType::Shadow => MaterialClass::Reflecting,
        };
        // Spheres look for their own holes: their intersection shader may offer the far side instead of the near one.
        let holes = primitive == GeometryKind::Triangles && material.has_alpha();
        Self { ray, primitive, holes, class }
    }

    /// All hit groups that there can be, in the order in which a pipeline has them.
    pub fn all() -> Vec<Self> {
        let shapes = [
            (GeometryKind::Triangles, false),
            (GeometryKind::Triangles, true),
            (GeometryKind::Spheres, false),
        ];
        let group = |ray, (primitive, holes), class| Self { ray, primitive, holes, class };
        let radiance = shapes.into_iter().flat_map(|shape| {
            MaterialClass::ALL.into_iter().map(move |class| group(RayType::Radiance, shape, class))
        });
        let shadow = shapes.into_iter().map(|shape| group(RayType::Shadow, shape, MaterialClass::Reflecting));
        radiance.chain(shadow).collect()
    }

    /// The entry point of its closest-hit shader; shadow rays have none, they only ask whether something is there.
    pub fn closest_hit(&self) -> Option<&'static str> {
        use MaterialClass::{Dielectric, Emissive, Reflecting};
        match (self.ray, self.primitive, self.class) {
            (RayType::Shadow, ..) => None,
            (_, GeometryKind::Triangles, Reflecting) => Some("hit_triangle_reflecting"),
            (_, GeometryKind::Triangles, Dielectric) => Some("hit_triangle_dielectric"),
            (_, GeometryKind::Triangles, Emissive) => Some("hit_triangle_emissive"),
            (_, GeometryKind::Spheres, Reflecting) => Some("hit_sphere_reflecting"),
            (_, GeometryKind::Spheres, Dielectric) => Some("hit_sphere_dielectric"),
            (_, GeometryKind::Spheres, Emissive) => Some("hit_sphere_emissive"),
        }
    }

    /// Its place in [`HitGroup::all`].
    pub fn index(&self) -> usize {
        let shape = match (self.primitive, self.holes) {
            (GeometryKind::Triangles, false) => 0,
            (GeometryKind::Triangles, true) => 1,
            (GeometryKind::Spheres, _) => 2,
        };
        match self.ray {
            RayType::Radiance => shape * MATERIAL_CLASSES as usize + self.class as usize,
            RayType::Shadow => 3 * MATERIAL_CLASSES as usize + shape,
        }
    }
}

/// The data of a record, which the hit group's shaders read. Its layout is the shaders' `HitRecord`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HitRecord {
    /// Index into the scene's materials.
    pub material: u32,
    /// Number of the geometry in its bottom-level structure.
    pub geometry: u32,
    /// Number that the bottom-level structure gives to the geometry's first primitive.
    pub first_in_blas: u32,
    /// Index of a binding of the geometry with this material: of the first instance that has it.
    pub binding: u32,
}

/// The records of all hits of a scene, and where each instance's begin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HitTable {
    /// Records in the table's order.
    pub records: Vec<(HitGroup, HitRecord)>,
    /// For each instance of the scene the index of its first record.
    pub instance_offsets: Vec<u32>,
}

impl HitTable {
    /// The table of a scene.
    pub fn new(tables: &SceneTables) -> Self {
        let mut table = Self::default();
        let mut known: HashMap<(u32, Vec<u32>), u32> = HashMap::new();
        for instance in &tables.instances {
            let key = (instance.blas, materials(tables, instance));
            let offset = *known.entry(key).or_insert_with(|| {
                let offset = table.records.len() as u32;
                table.add_records(tables, instance);
                offset
            });
            table.instance_offsets.push(offset);
        }
        table
    }

    fn add_records(&mut self, tables: &SceneTables, instance: &InstanceRecord) {
        let blas = &tables.blas[instance.blas as usize];
        for (number, material) in (0..).zip(materials(tables, instance)) {
            let geometry = &tables.geometries[(blas.first_geometry + number) as usize];
            let record = HitRecord {
                material,
                geometry: number,
                first_in_blas: geometry.first_in_blas,
                binding: instance.first_binding + number,
            };
            for ray in [RayType::Radiance, RayType::Shadow] {
                let group = HitGroup::new(ray, geometry.kind, &tables.materials[material as usize]);
                self.records.push((group, record));
            }
        }
    }
}

/// Materials of the geometries of an instance.
fn materials(tables: &SceneTables, instance: &InstanceRecord) -> Vec<u32> {
    let count = tables.blas[instance.blas as usize].geometry_count;
    let bindings = &tables.bindings[instance.first_binding as usize..][..count as usize];
    bindings.iter().map(|b| b.material).collect()
}

/// The index of the record that the driver takes for a ray that meets a geometry of an instance.
pub fn record_index(ray: RayType, geometry: u32, instance_offset: u32) -> u32 {
    ray as u32 + RAY_TYPES * geometry + instance_offset
}

/// What the device demands of a table, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableRules {
    /// Size of the handle that names a record's shaders.
    pub handle_size: u32,
    /// Records of one region are this far apart, or a multiple.
    pub handle_alignment: u32,
    /// Regions begin at multiples of this.
    pub base_alignment: u32,
    /// Records may not be farther apart.
    pub max_stride: u32,
}

/// Records of one kind, in bytes from the beginning of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Where the first record begins.
    pub offset: u64,
    /// Distance between records.
    pub stride: u64,
    /// Number of records.
    pub count: u32,
}

impl Region {
    /// Bytes that the region takes.
    pub fn size(&self) -> u64 {
        self.stride * u64::from(self.count)
    }

    /// Where a record begins.
    pub fn record(&self, index: u32) -> u64 {
        self.offset + self.stride * u64::from(index)
    }
}

/// Where everything is in the table's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableLayout {
    /// The ray generation shader: one record without data.
    pub generation: Region,
    /// Miss shaders, one for each ray type, without data.
    pub miss: Region,
    /// Hit groups with their data.
    pub hit: Region,
    /// Bytes of the whole table.
    pub size: u64,
}

impl TableLayout {
    /// The layout of a table with `hits` hit records; `None` if the device has no room for a record's data.
    pub fn new(rules: &TableRules, hits: u32) -> Option<Self> {
        let (handle, base) = (u64::from(rules.handle_size), u64::from(rules.base_alignment));
        let spaced = |size: u64| size.next_multiple_of(u64::from(rules.handle_alignment));
        // The one record of ray generation is its own region: it must be as large as it is aligned.
        let generation = Region { offset: 0, stride: spaced(handle).next_multiple_of(base), count: 1 };
        let miss = Region {
            offset: generation.size().next_multiple_of(base),
            stride: spaced(handle),
            count: RAY_TYPES,
        };
        let hit = Region {
            offset: (miss.offset + miss.size()).next_multiple_of(base),
            stride: spaced(handle + size_of::<HitRecord>() as u64),
            // A region without records has no address that a driver would accept.
            count: hits.max(1),
        };
        let widest = generation.stride.max(hit.stride);
        (widest <= u64::from(rules.max_stride)).then_some(Self {
            generation,
            miss,
            hit,
            size: hit.offset + hit.size(),
        })
    }

    /// The table's bytes. `handle` gives the handle of ray generation, of a ray type's miss shader, of a hit group.
    pub fn bytes<'a>(&self, table: &HitTable, handle: impl Fn(ShaderGroup) -> &'a [u8]) -> Vec<u8> {
        let mut bytes = vec![0; self.size as usize];
        let mut put = |at: u64, data: &[u8]| bytes[at as usize..][..data.len()].copy_from_slice(data);
        put(self.generation.offset, handle(ShaderGroup::Generation));
        for ray in [RayType::Radiance, RayType::Shadow] {
            put(self.miss.record(ray as u32), handle(ShaderGroup::Miss(ray)));
        }
        for (index, (group, record)) in (0..).zip(&table.records) {
            let at = self.hit.record(index);
            let name = handle(ShaderGroup::Hit(*group));
            put(at, name);
            put(at + name.len() as u64, bytemuck::bytes_of(record));
        }
        bytes
    }
}

/// A group of shaders of a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaderGroup {
    /// Ray generation.
    Generation,
    /// What happens to a ray that meets nothing.
    Miss(RayType),
    /// What happens to a ray that meets something.
    Hit(HitGroup),
}

impl ShaderGroup {
    /// All groups in the order in which a pipeline has them.
    pub fn all() -> Vec<Self> {
        let misses = [RayType::Radiance, RayType::Shadow].map(Self::Miss);
        let hits = HitGroup::all().into_iter().map(Self::Hit);
        [Self::Generation].into_iter().chain(misses).chain(hits).collect()
    }

    /// Its place in [`ShaderGroup::all`].
    pub fn index(&self) -> usize {
        match self {
            Self::Generation => 0,
            Self::Miss(ray) => 1 + *ray as usize,
            Self::Hit(group) => 1 + RAY_TYPES as usize + group.index(),
        }
    }
}

#[cfg(test)]
mod tests;
