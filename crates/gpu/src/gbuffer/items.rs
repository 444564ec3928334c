//! What the rasteriser draws: geometries cut into parts small enough to be culled, in all places where they stand.

use bytemuck::{Pod, Zeroable};
use scene::tables::{BlasRecord, GeometryKind, GeometryRecord, SceneTables};

/// Bits of an identification that number a primitive within its part, as in `shaders/hybrid_items.wgsl`.
pub const PRIMITIVE_BITS: u32 = 7;
/// Most triangles of a part.
const MOST: u32 = 1 << PRIMITIVE_BITS;
/// Triangles up to which a part counts as small: an instance of the draw has as many vertices as the largest part of its
/// class, and what a part does not need of them is thrown away.
const FEW: u32 = 16;
/// Most items: the rest of an identification numbers them, all bits set is nothing.
pub const MOST_ITEMS: u64 = (1 << (32 - PRIMITIVE_BITS)) - 1;

/// Items that one draw shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DrawClass {
    /// At most [`FEW`] triangles.
    Few,
    /// At most [`MOST`] triangles.
    Many,
    /// As [`DrawClass::Few`], with holes.
    FewHoled,
    /// As [`DrawClass::Many`], with holes.
    ManyHoled,
    /// A sphere.
    Sphere,
}

impl DrawClass {
    /// All of them; a class's place is its number.
    pub const ALL: [Self; 5] = [Self::Few, Self::Many, Self::FewHoled, Self::ManyHoled, Self::Sphere];

    /// Vertices of an item: three a triangle, or the cube around a sphere.
    pub fn vertices(self) -> u32 {
        match self {
            Self::Few | Self::FewHoled => 3 * FEW,
            Self::Many | Self::ManyHoled => 3 * MOST,
            Self::Sphere => 36,
        }
    }
}

/// Consecutive primitives of a geometry; see `shaders/hybrid_items.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct HybridPart {
    /// Bounds in object space, metres.
    pub low: [f32; 3],
    /// Number of the geometry within its bottom-level structure.
    pub geometry: u32,
    /// The other corner.
    pub high: [f32; 3],
    /// Number of the first primitive within the geometry.
    pub first: u32,
    /// Number of primitives.
    pub count: u32,
    /// Nothing.
    pub padding0: u32,
    /// Nothing.
    pub padding1: u32,
    /// Nothing.
    pub padding2: u32,
}

/// A part of an instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HybridItem {
    /// Index into the scene's instances.
    pub instance: u32,
    /// Index into [`Items::parts`].
    pub part: u32,
}

/// Everything that may be drawn.
#[derive(Clone, Debug, Default)]
pub struct Items {
    /// Parts of all geometries, in the order of the bottom-level structures.
    pub parts: Vec<HybridPart>,
    /// Items, sorted by class.
    pub items: Vec<HybridItem>,
    /// Index of each class's first item.
    pub class_first: [u32; 5],
}

impl Items {
    /// Cuts the geometries of a scene.
    pub fn new(tables: &SceneTables) -> Self {
        let mut parts = Vec::new();
        let of_blas: Vec<_> = tables
            .blas
            .iter()
            .map(|blas| {
                let first = parts.len();
                add_parts(&mut parts, tables, blas);
                first..parts.len()
            })
            .collect();
        let mut by_class: [Vec<HybridItem>; 5] = Default::default();
        for (number, instance) in (0..).zip(&tables.instances) {
            let kind = tables.blas[instance.blas as usize].kind;
            for part in of_blas[instance.blas as usize].clone() {
                let binding = &tables.bindings[(instance.first_binding + parts[part].geometry) as usize];
                let holed = tables.materials[binding.material as usize].has_alpha();
                let class = class_of(kind, parts[part].count, holed);
                by_class[class as usize].push(HybridItem { instance: number, part: part as u32 });
            }
        }
        let mut class_first = [0; 5];
        for class in 1..class_first.len() {
            class_first[class] = class_first[class - 1] + by_class[class - 1].len() as u32;
        }
        Self { parts, items: by_class.concat(), class_first }
    }
}

fn class_of(kind: GeometryKind, count: u32, holed: bool) -> DrawClass {
    match (kind, count <= FEW, holed) {
        // Their fragments look for holes whether there are any or not.
        (GeometryKind::Spheres, ..) => DrawClass::Sphere,
        (GeometryKind::Triangles, true, false) => DrawClass::Few,
        (GeometryKind::Triangles, false, false) => DrawClass::Many,
        (GeometryKind::Triangles, true, true) => DrawClass::FewHoled,
        (GeometryKind::Triangles, false, true) => DrawClass::ManyHoled,
    }
}

fn add_parts(parts: &mut Vec<HybridPart>, tables: &SceneTables, blas: &BlasRecord) {
    let geometries = &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
    for (number, geometry) in (0..).zip(geometries) {
        let most = if blas.kind == GeometryKind::Spheres { 1 } else { MOST };
        for first in (0..geometry.primitive_count).step_by(most as usize) {
            let count = most.min(geometry.primitive_count - first);
            let (low, high) = bounds(tables, geometry, first, count);
            parts.push(HybridPart { low, geometry: number, high, first, count, ..HybridPart::default() });
        }
    }
}

/// The box around some primitives of a geometry.
fn bounds(tables: &SceneTables, g: &GeometryRecord, first: u32, count: u32) -> ([f32; 3], [f32; 3]) {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let mut add = |p: [f32; 3], radius: f32| {
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis] - radius);
            high[axis] = high[axis].max(p[axis] + radius);
        }
    };
    let primitives = (g.first_primitive + first) as usize..(g.first_primitive + first + count) as usize;
    match g.kind {
        GeometryKind::Triangles => {
            let positions = &tables.positions[g.first_vertex as usize..];
            let corners = tables.indices[primitives].iter().flatten();
            corners.for_each(|&vertex| add(positions[vertex as usize], 0.0));
        }
        GeometryKind::Spheres => {
            tables.spheres[primitives].iter().for_each(|&[x, y, z, radius]| add([x, y, z], radius));
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every primitive of every instance exactly once, in a part that holds it, in its class.
    #[test]
    fn items_cover_every_primitive_once() {
        let tables = SceneTables::build(&testkit::scenes::assortment());
        let all = Items::new(&tables);
        let mut seen = std::collections::HashSet::new();
        for (index, item) in (0..).zip(&all.items) {
            let part = &all.parts[item.part as usize];
            let instance = &tables.instances[item.instance as usize];
            let blas = &tables.blas[instance.blas as usize];
            let g = &tables.geometries[(blas.first_geometry + part.geometry) as usize];
            assert!(part.count >= 1 && part.first + part.count <= g.primitive_count);
            for primitive in part.first..part.first + part.count {
                assert!(seen.insert((item.instance, part.geometry, primitive)), "twice");
                let (low, high) = bounds(&tables, g, primitive, 1);
                assert!((0..3).all(|a| part.low[a] <= low[a] && high[a] <= part.high[a]));
            }
            let class = DrawClass::ALL.into_iter().rev().find(|c| all.class_first[*c as usize] <= index);
            let vertices = class.map(DrawClass::vertices).expect("a class");
            let per_primitive = if blas.kind == GeometryKind::Spheres { 36 } else { 3 };
            assert!(part.count * per_primitive <= vertices, "{class:?}: {part:?}");
        }
        let of_instance = |i: &scene::tables::InstanceRecord| {
            let blas = &tables.blas[i.blas as usize];
            let own = &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize];
            own.iter().map(|g| g.primitive_count as usize).sum::<usize>()
        };
        assert_eq!(seen.len(), tables.instances.iter().map(of_instance).sum::<usize>());
        assert!(seen.len() > 100 && all.class_first[4] < all.items.len() as u32, "spheres, too");
    }
}
