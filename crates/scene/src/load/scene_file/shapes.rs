//! `[[shape]]`: procedural geometry.

use super::Builder;
use super::document::{Context, Entry};
use super::inclusion::MAX_TRIANGLES;
use super::objects::Object;
use super::repeat::{Copy, Palette, Ramp};
use super::subdivision::SurfaceKeys;
use super::values::{positive, within};
use crate::animation::KeyedObject;
use crate::load::LoadError;
use crate::load::session::{MATERIAL, TRIANGLE};
use crate::origin::anchored;
use crate::{Groups, Instance, MaterialId, Mesh, Shape, shapes};
use glam::{Affine3A, DAffine3, DVec3, Vec2, Vec3};
use serde::Deserialize;
use std::collections::HashMap;
use std::sync::Arc;

/// The kinds of shapes, for messages.
const KINDS: &str = "`quad`, `box`, `sphere`, `icosphere`, `uv-sphere`, `grid`, `terrain`, `cylinder`, `torus`, `knot`, \
                     `blob`, `lathe`, `column`, `baluster`, `arch`, `coffers`, `curtain` and `tube`";
/// Divisions along one direction.
const DIVISIONS: [u32; 2] = [1, 8192];
/// Quadrilaterals of one shape.
const MAX_CELLS: u64 = 16_000_000;

/// How the materials of copies differ.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
struct Vary {
    base_color: Option<Palette>,
    emission: Option<Palette>,
    roughness: Option<Ramp>,
    metallic: Option<Ramp>,
    transmission: Option<Ramp>,
    ior: Option<Ramp>,
}

/// Whether a shape shows its facets.
#[derive(Deserialize)]
struct Flat {
    #[serde(default)]
    flat: bool,
}

impl Builder<'_> {
    /// Adds a shape and its copies.
    pub(super) fn add_shape(&mut self, mut entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let Some(object) = self.take_object(&mut entry)? else { return Ok(()) };
        let kind = entry.take_string("kind")?;
        let kind = kind.ok_or_else(|| context.error(format!("`kind` is missing; known are {KINDS}")))?;
        let material = self.take_material(&mut entry)?.unwrap_or_else(|| self.neutral_material());
        let vary = entry.take_table("vary").map(|table| table.read::<Vary>()).transpose()?;
        let flat: Flat = entry.split(&["flat"]).read()?;
        let surface = SurfaceKeys::take(&mut entry)?;
        let (mut shape, anchor) = read_shape(&kind, entry, &context)?;
        let anchor = DAffine3::from_translation(anchor);
        if let (true, Shape::Triangles(mesh)) = (flat.flat, &mut shape) {
            mesh.normals.clear(); // which means flat shading
        }
        let mesh = Mesh::single(object.name.clone().unwrap_or_else(|| kind.clone()), shape, material);
        self.spend_triangles(mesh.triangle_count(), &context)?;
        self.scene.meshes.push(mesh);
        self.refine_shape(&surface, &context)?;
        self.place(&object, &kind, &anchor, vary.as_ref(), material, &context)
    }

    /// Adds the instances of the mesh that was added last.
    ///
    /// - `anchor`: from the mesh as it is stored to the object's space.
    fn place(
        &mut self,
        object: &Object,
        kind: &str,
        anchor: &DAffine3,
        vary: Option<&Vary>,
        material: MaterialId,
        context: &Context,
    ) -> Result<(), LoadError> {
        let mesh = (self.scene.meshes.len() - 1) as u32;
        let mut variants = HashMap::new();
        self.group_copies_of_shape(object, kind);
        for (i, copy) in object.copies.iter().enumerate() {
            let materials = match vary {
                Some(vary) => Some(vec![self.variant(vary, copy, material, &mut variants, context)?]),
                None => None,
            };
            let name = object.copy_name(kind, i);
            let mut instance = Instance::new(name, mesh, Affine3A::IDENTITY);
            (instance.visible, instance.dynamic, instance.materials) =
                (object.visible, object.dynamic, materials);
            if let Some(keys) = object.keys(copy, anchor) {
                let number = self.scene.instances.len() as u32;
                self.placement.keys.push((KeyedObject::Instance(number), keys, instance.name.clone()));
            }
            self.scene.instances.push(instance);
            self.placement.instances.push(object.transform(copy) * *anchor);
        }
        Ok(())
    }

    /// Several copies of a shape, which are placed next, are a group.
    fn group_copies_of_shape(&mut self, object: &Object, kind: &str) {
        if object.copies.len() < 2 {
            return;
        }
        let first = self.scene.instances.len();
        let groups = Arc::make_mut(&mut self.scene.groups);
        let all = groups.add(object.name.as_deref().unwrap_or(kind), None);
        groups.append(&Groups::default(), first as u32, object.copies.len(), Some(all));
    }

    /// The material of a copy; copies whose values are equal share one.
    fn variant(
        &mut self,
        vary: &Vary,
        copy: &Copy,
        base: MaterialId,
        known: &mut HashMap<[u32; 10], MaterialId>,
        context: &Context,
    ) -> Result<MaterialId, LoadError> {
        let mut material = self.scene.materials[base as usize].clone();
        let ramp = |ramp: &Option<Ramp>, value: &mut f32, low: f32, high: f32| {
            if let Some(ramp) = ramp {
                *value = ramp.at(copy).clamp(low, high);
            }
        };
        ramp(&vary.roughness, &mut material.roughness, 0.0, 1.0);
        ramp(&vary.metallic, &mut material.metallic, 0.0, 1.0);
        ramp(&vary.transmission, &mut material.transmission, 0.0, 1.0);
        ramp(&vary.ior, &mut material.ior, 1.0, 10.0);
        if let Some(color) = vary.base_color.as_ref().and_then(|p| p.at(copy)) {
            material.base_color = color.min(Vec3::ONE).extend(material.base_color.w);
        }
        if let Some(color) = vary.emission.as_ref().and_then(|p| p.at(copy)) {
            material.emission = color * material.emission.max_element().max(1e-6);
        }
        let [r, g, b, _] = material.base_color.to_array();
        let [x, y, z] = material.emission.to_array();
        let numbers =
            [r, g, b, x, y, z, material.roughness, material.metallic, material.transmission, material.ior];
        let numbers = numbers.map(f32::to_bits);
        if let Some(known) = known.get(&numbers) {
            return Ok(*known);
        }
        context.take(MATERIAL + material.name.len() as u64, "materials")?;
        material.name = format!("{} {}", material.name, copy.index.0 + 1);
        self.scene.materials.push(material);
        let number = (self.scene.materials.len() - 1) as MaterialId;
        known.insert(numbers, number);
        Ok(number)
    }

    fn spend_triangles(&mut self, count: usize, context: &Context) -> Result<(), LoadError> {
        let left = self.budget.triangles.checked_sub(count);
        self.budget.triangles =
            left.ok_or_else(|| context.error(format!("the scene has more than {MAX_TRIANGLES} triangles")))?;
        context.take((count as u64).saturating_mul(TRIANGLE), "triangles")
    }
}

/// A table of a shape's own keys, each with its default.
macro_rules! keys {
    ($name:ident { $($field:ident: $type:ty = $default:expr),* $(,)? }) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
        struct $name { $($field: $type),* }
        impl Default for $name {
            fn default() -> Self { Self { $($field: $default),* } }
        }
    };
}

keys!(QuadKeys { size: [f32; 2] = [1.0, 1.0], corners: Vec<[f64; 3]> = Vec::new() });
keys!(BoxKeys { size: [f32; 3] = [1.0; 3], bevel: f32 = 0.0, segments: u32 = 3 });
keys!(SphereKeys { radius: f32 = 1.0 });
keys!(IcosphereKeys { radius: f32 = 1.0, level: u32 = 4 });
keys!(UvSphereKeys { radius: f32 = 1.0, segments: u32 = 64, rings: u32 = 32 });
keys!(GridKeys { size: [f32; 2] = [1.0, 1.0], divisions: [u32; 2] = [10, 10] });
keys!(TerrainKeys {
    size: [f32; 2] = [100.0, 100.0],
    divisions: [u32; 2] = [256, 256],
    height: f32 = 5.0,
    feature: f32 = 25.0,
    roughness: f32 = 0.5,
    octaves: u32 = 8,
    seed: u32 = 1,
});
keys!(CylinderKeys { radius: f32 = 0.5, top_radius: Option<f32> = None, height: f32 = 1.0, segments: u32 = 64 });
keys!(TorusKeys { radius: f32 = 1.0, tube: f32 = 0.3, segments: u32 = 96, sides: u32 = 48 });
keys!(KnotKeys {
    p: u32 = 2,
    q: u32 = 3,
    radius: f32 = 1.0,
    tube: f32 = 0.25,
    segments: u32 = 512,
    sides: u32 = 48,
});
keys!(BlobKeys {
    radius: f32 = 1.0,
    level: u32 = 5,
    amplitude: f32 = 0.15,
    detail: f32 = 0.5,
    seed: u32 = 1
});
keys!(LatheKeys {
    profile: Vec<[f32; 2]> = Vec::new(), segments: u32 = 96, crease: f32 = 40.0, flutes: u32 = 0,
    flute_depth: f32 = 0.0,
});
keys!(ColumnKeys { height: f32 = 4.0, radius: f32 = 0.3, flutes: u32 = 20, segments: u32 = 160 });
keys!(BalusterKeys { height: f32 = 0.9, radius: f32 = 0.09, segments: u32 = 24 });
keys!(ArchKeys {
    size: [f32; 3] = [3.0, 4.0, 0.5], opening: f32 = 2.0, spring: f32 = 2.0, rise: Option<f32> = None,
    segments: u32 = 48, moulding: f32 = 0.0,
});
keys!(CoffersKeys {
    size: [f32; 2] = [4.0, 4.0],
    rise: f32 = 0.0,
    count: [u32; 2] = [6, 6],
    depth: f32 = 0.1,
    segments: u32 = 4,
});
keys!(CurtainKeys {
    size: [f32; 2] = [2.0, 3.0],
    folds: f32 = 6.0,
    depth: f32 = 0.08,
    gather: f32 = 0.0,
    divisions: [u32; 2] = [160, 80],
    seed: u32 = 1,
});
keys!(TubeKeys { path: Vec<[f64; 3]> = Vec::new(), closed: bool = false, radius: f32 = 0.05, sides: u32 = 24 });

/// Reads the keys of a kind and makes its geometry. Shapes whose points are given in coordinates far from their origin are
/// stored relative to an anchor, which comes with them.
fn read_shape(kind: &str, entry: Entry, c: &Context) -> Result<(Shape, DVec3), LoadError> {
    let mut anchor = DVec3::ZERO;
    let mesh = match kind {
        "sphere" => {
            let radius = positive(entry.read::<SphereKeys>()?.radius, "radius", c)?;
            return Ok((shapes::sphere(radius), anchor));
        }
        "quad" => {
            let keys: QuadKeys = entry.read()?;
            let (corners, own) = anchored(&points(&keys.corners));
            anchor = own;
            quad(keys.size, &corners, c)?
        }
        "box" => {
            let k: BoxKeys = entry.read()?;
            within(k.bevel, [0.0, 1e9], "bevel", c)?;
            shapes::cuboid(sizes(k.size, c)?.into(), k.bevel, within(k.segments, [1, 64], "segments", c)?)
        }
        "icosphere" => {
            let k: IcosphereKeys = entry.read()?;
            room(20 << (2 * within(k.level, [0, 9], "level", c)?), c)?;
            shapes::icosphere(positive(k.radius, "radius", c)?, k.level)
        }
        "uv-sphere" => {
            let k: UvSphereKeys = entry.read()?;
            let [segments, rings] = cells([k.segments, k.rings], ["segments", "rings"], c)?;
            shapes::uv_sphere(positive(k.radius, "radius", c)?, segments, rings)
        }
        "grid" => {
            let k: GridKeys = entry.read()?;
            shapes::grid(sizes(k.size, c)?.into(), cells(k.divisions, ["divisions"; 2], c)?)
        }
        "terrain" => terrain(entry.read()?, c)?,
        "cylinder" => {
            let k: CylinderKeys = entry.read()?;
            let top = k.top_radius.unwrap_or(k.radius);
            let [bottom, top] =
                [within(k.radius, [0.0, 1e9], "radius", c)?, within(top, [0.0, 1e9], "top-radius", c)?];
            positive(bottom.max(top), "radius", c)?;
            shapes::cylinder(
                bottom,
                top,
                positive(k.height, "height", c)?,
                within(k.segments, DIVISIONS, "segments", c)?,
            )
        }
        "torus" => {
            let k: TorusKeys = entry.read()?;
            let [segments, sides] = cells([k.segments, k.sides], ["segments", "sides"], c)?;
            shapes::torus(positive(k.radius, "radius", c)?, positive(k.tube, "tube", c)?, segments, sides)
        }
        "knot" => knot(entry.read()?, c)?,
        "tube" => {
            let keys: TubeKeys = entry.read()?;
            let (path, own) = anchored(&points(&keys.path));
            anchor = own;
            tube(&keys, &path, c)?
        }
        "blob" => blob(entry.read()?, c)?,
        "lathe" => lathe(entry.read()?, c)?,
        "column" => {
            let k: ColumnKeys = entry.read()?;
            let (height, radius) = (positive(k.height, "height", c)?, positive(k.radius, "radius", c)?);
            within(k.height / k.radius, [3.0, 1e6], "height / radius", c)?;
            let segments = within(k.segments, DIVISIONS, "segments", c)?;
            shapes::column(&shapes::Column {
                height,
                radius,
                flutes: within(k.flutes, [0, 1024], "flutes", c)?,
                segments,
            })
        }
        "baluster" => {
            let k: BalusterKeys = entry.read()?;
            let segments = within(k.segments, DIVISIONS, "segments", c)?;
            shapes::baluster(positive(k.height, "height", c)?, positive(k.radius, "radius", c)?, segments)
        }
        "arch" => arch(entry.read()?, c)?,
        "coffers" => coffers(entry.read()?, c)?,
        "curtain" => curtain(entry.read()?, c)?,
        _ => return Err(c.error(format!("unknown kind `{kind}`; known are {KINDS}"))),
    };
    Ok((Shape::Triangles(mesh), anchor))
}

fn points(points: &[[f64; 3]]) -> Vec<DVec3> {
    points.iter().copied().map(DVec3::from_array).collect()
}

fn quad(size: [f32; 2], corners: &[Vec3], c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    if corners.is_empty() {
        return Ok(shapes::rectangle(sizes(size, c)?.into()));
    }
    if !corners.len().is_multiple_of(4) {
        let message =
            format!("`corners` must be four points for each quadrilateral, there are {}", corners.len());
        return Err(c.error(message));
    }
    Ok(shapes::quads(corners))
}

fn terrain(k: TerrainKeys, c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    Ok(shapes::terrain(&shapes::Terrain {
        size: sizes(k.size, c)?.into(),
        divisions: cells(k.divisions, ["divisions"; 2], c)?,
        height: k.height,
        feature: positive(k.feature, "feature", c)?,
        roughness: within(k.roughness, [0.0, 1.0], "roughness", c)?,
        octaves: within(k.octaves, [1, 12], "octaves", c)?,
        seed: k.seed,
    }))
}

fn knot(k: KnotKeys, c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    let [segments, sides] = cells([k.segments, k.sides], ["segments", "sides"], c)?;
    let (p, q) = (within(k.p, [1, 64], "p", c)?, within(k.q, [1, 64], "q", c)?);
    Ok(shapes::knot(p, q, positive(k.radius, "radius", c)?, positive(k.tube, "tube", c)?, segments, sides))
}

fn tube(k: &TubeKeys, path: &[Vec3], c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    let sides = within(k.sides, [3, 1024], "sides", c)?;
    room(2 * path.len() as u64 * u64::from(sides), c)?;
    let mesh = shapes::tube(path, k.closed, positive(k.radius, "radius", c)?, sides);
    if mesh.indices.is_empty() {
        return Err(c.error("`path` needs at least two different points, three if `closed`"));
    }
    Ok(mesh)
}

fn blob(k: BlobKeys, c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    room(20 << (2 * within(k.level, [0, 8], "level", c)?), c)?;
    Ok(shapes::blob(&shapes::Blob {
        radius: positive(k.radius, "radius", c)?,
        level: k.level,
        amplitude: within(k.amplitude, [0.0, 10.0], "amplitude", c)?,
        detail: within(k.detail, [0.0, 1.0], "detail", c)?,
        seed: k.seed,
    }))
}

fn lathe(k: LatheKeys, c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    if k.profile.len() < 2 || k.profile.iter().any(|p| p[0] < 0.0) {
        return Err(
            c.error("`profile` must be at least two points [radius, height], with no negative radius")
        );
    }
    let [segments, _] = cells([k.segments, k.profile.len() as u32], ["segments", "profile"], c)?;
    Ok(shapes::lathe(&shapes::Lathe {
        profile: k.profile.into_iter().map(Vec2::from_array).collect(),
        segments,
        crease_angle: within(k.crease, [0.0, 180.0], "crease", c)?.to_radians(),
        flutes: within(k.flutes, [0, 1024], "flutes", c)?,
        flute_depth: within(k.flute_depth, [0.0, 0.5], "flute-depth", c)?,
    }))
}

fn arch(k: ArchKeys, c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    let opening = positive(k.opening, "opening", c)?;
    Ok(shapes::arch(&shapes::Arch {
        size: sizes(k.size, c)?.into(),
        opening,
        spring: within(k.spring, [0.0, 1e9], "spring", c)?,
        rise: positive(k.rise.unwrap_or(opening * 0.5), "rise", c)?,
        segments: within(k.segments, [4, 8192], "segments", c)?,
        moulding: within(k.moulding, [0.0, 1e9], "moulding", c)?,
    }))
}

fn coffers(k: CoffersKeys, c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    let segments = within(k.segments, [1, 64], "segments", c)?;
    let count = cells(k.count, ["count"; 2], c)?;
    let cells = u64::from(count[0]) * u64::from(count[1]) * u64::from(segments * (segments + 16));
    within(cells, [1, MAX_CELLS], "count × segments", c)?;
    Ok(shapes::coffers(&shapes::Coffers {
        size: sizes(k.size, c)?.into(),
        rise: within(k.rise, [0.0, k.size[0] * 0.5], "rise", c)?,
        count,
        depth: within(k.depth, [0.0, 1e9], "depth", c)?,
        segments,
    }))
}

fn curtain(k: CurtainKeys, c: &Context) -> Result<crate::TriangleMesh, LoadError> {
    Ok(shapes::curtain(&shapes::Curtain {
        size: sizes(k.size, c)?.into(),
        folds: within(k.folds, [0.0, 1000.0], "folds", c)?,
        depth: k.depth,
        gather: within(k.gather, [0.0, 0.9], "gather", c)?,
        divisions: cells(k.divisions, ["divisions"; 2], c)?,
        seed: k.seed,
    }))
}

/// Extents that are all positive.
fn sizes<const N: usize>(size: [f32; N], c: &Context) -> Result<[f32; N], LoadError> {
    size.iter().try_for_each(|s| positive(*s, "size", c).map(|_| ()))?;
    Ok(size)
}

/// Refuses so many triangles before they are made where there is no room for them. They are counted once they are there.
fn room(triangles: u64, c: &Context) -> Result<(), LoadError> {
    c.check_room(triangles.saturating_mul(TRIANGLE), "triangles")
}

/// Two numbers of divisions whose product is not too large.
fn cells(divisions: [u32; 2], keys: [&str; 2], c: &Context) -> Result<[u32; 2], LoadError> {
    for (n, key) in divisions.into_iter().zip(keys) {
        within(n, DIVISIONS, key, c)?;
    }
    let product = u64::from(divisions[0]) * u64::from(divisions[1]);
    within(product, [1, MAX_CELLS], &format!("{} × {}", keys[0], keys[1]), c)?;
    room(product.saturating_mul(2), c)?;
    Ok(divisions)
}
