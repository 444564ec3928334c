//! From a hit to the surface there: position, normals, coordinates, colour.

use crate::fetch::texture_points::{
    bumped_normal, object_position, sphere_texture_point, triangle_texture_point,
};
use crate::scene::{
    CpuScene, HitRecords, determinant, transform_normal, transform_point, transform_vector, vec3,
};
use accel::{Candidate, Hit, Ray};
use optics::frame::{Frame, bend_normal, frame_from_normal, map_normal, tangent_space};
use optics::material::{SLOT_NORMAL, material_reads_alpha};
use optics::offset::{offset_ray_origin, sphere_clearance, triangle_clearance};
use optics::shape::{sphere_tangent_turned, sphere_uv, turned_direction};
use optics::terminator::{TerminatorLift, terminator_lift};
use optics::texture_point::{TexturePoint, texture_point_at};
use optics::vector::{cross, dot, normalize};
use optics::{Vec2f, Vec3f, Vec4f, vec2f, vec3f, vec4f};
use scene::tables::{
    GeometryKind, GeometryRecord, MATERIAL_CHECKERBOARD_FADES, MATERIAL_SMOOTH_TERMINATOR, MATERIAL_TANGENTS,
    MATERIAL_TANGENTS_MIRRORED, MaterialRecord, NONE, SceneTables,
};

/// A point on a surface as a ray arrives there. World space unless it says otherwise.
pub(crate) struct Surface {
    pub position: Vec3f,
    /// How far off the primitive rays must start: see `optics::offset`.
    pub clearance: f32,
    /// Unit geometric normal on the side of the ray's origin.
    pub normal: Vec3f,
    /// Unit shading normal on that side, normal map applied.
    pub shading_normal: Vec3f,
    /// Where light is gathered and rays start that leave on that side: the position, or where the smooth surface would be
    /// that vertex normals stand for; see `optics::terminator`.
    pub origin: Vec3f,
    /// Unit normal of the plane that what can reach the surface is above: the geometric one, or that of the smooth surface.
    pub horizon: Vec3f,
    /// Whether the ray arrives at the front (the side that the winding, or the sphere's outside, faces).
    pub front: bool,
    /// Unit direction back along the ray.
    pub wo: Vec3f,
    /// Texture coordinates of both sets.
    pub coords: Vec4f,
    /// Linear vertex colour, one where there is none.
    pub color: Vec4f,
    /// Index into the tables' materials.
    pub material: u32,
    /// Index into the tables' lights, or `NONE`.
    pub light: u32,
    /// Index of the user's instance.
    pub object: u32,
    /// Number of the primitive in its geometry.
    pub primitive: u32,
    /// Position in object space, for procedural patterns.
    pub object_position: Vec3f,
    /// What only texture graphs ask; set where the material has some.
    pub graph: GraphPlace,
    /// The shading normal without the normal map, and the frame along the texture coordinates: what layers need.
    /// Elsewhere the shading normal, and any frame.
    pub layer_frame: Frame,
}

/// How the spaces of textures lie on a surface; see [`TexturePoint`].
#[derive(Clone, Copy)]
pub(crate) struct GraphPlace {
    /// Unit geometric normal in object space.
    normal: Vec3f,
    object_density: f32,
    uv_density: Vec2f,
}

impl GraphPlace {
    /// Of surfaces without graphs.
    pub const NONE: Self =
        Self { normal: vec3f(0.0, 0.0, 0.0), object_density: 0.0, uv_density: vec2f(0.0, 0.0) };

    fn of(point: &TexturePoint) -> Self {
        Self { normal: point.normal, object_density: point.object_density, uv_density: point.uv_density }
    }
}

impl Surface {
    /// The surface at `hit` on `ray`, of unit direction, which leaves at `time` of the shutter.
    #[inline(always)]
    pub fn new(scene: &CpuScene, ray: &Ray, hit: &Hit, time: f32) -> Self {
        let tables = &*scene.tables;
        let mut records = scene.records(hit.instance, hit.primitive);
        let moved = tables.moved_instance(hit.instance, time);
        if let Some(moved) = &moved {
            records.instance = moved;
        }
        let material = &tables.materials[records.binding.material as usize];
        let wo = -vec3(ray.direction);
        let point = match records.geometry.kind {
            GeometryKind::Triangles => triangle_point(tables, &records, material, wo, hit),
            GeometryKind::Spheres => sphere_point(tables, &records, material, ray, hit),
        };
        let front = dot(point.normal, wo) >= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let normal = point.normal * side;
        let shading_normal = shading_normal(tables, &records, &point, wo, normal, side, hit);
        let layer_frame = if material.layers == NONE {
            Frame { tangent: shading_normal, bitangent: shading_normal, normal: shading_normal }
        } else {
            let smooth_normal = point.shading.map_or(normal, |n| bend_normal(wo, normal, n * side));
            tangent_frame(&point, smooth_normal, side)
        };
        Self {
            position: point.position,
            clearance: point.clearance,
            normal,
            shading_normal,
            origin: point.position + point.lift.offset,
            horizon: point.shading.filter(|_| point.lift.share > 0.0).map_or(normal, |n| n * side),
            front,
            wo,
            coords: point.coords,
            color: point.color,
            material: records.binding.material,
            light: tables.light_of(records.binding, records.primitive),
            object: records.binding.object,
            primitive: records.primitive,
            object_position: point.object_position,
            graph: point.graph,
            layer_frame,
        }
    }

    /// Where a ray starts that leaves on the side of the viewer (`above`) or on the other.
    #[inline(always)]
    pub fn ray_origin(&self, above: bool) -> Vec3f {
        if above {
            offset_ray_origin(self.origin, self.horizon, self.clearance)
        } else {
            offset_ray_origin(self.position, -self.normal, self.clearance)
        }
    }

    /// What textures ask of the surface. `width`: of the ray's footprint, metres.
    #[inline]
    pub fn texture_point(&self, width: f32) -> TexturePoint {
        TexturePoint {
            coords: self.coords,
            color: self.color,
            position: self.object_position,
            width,
            world: self.position,
            object_density: self.graph.object_density,
            normal: self.graph.normal,
            uv_density: self.graph.uv_density,
        }
    }

    /// The shading frame.
    #[inline(always)]
    pub fn frame(&self) -> Frame {
        frame_from_normal(self.shading_normal)
    }
}

/// Unit geometric normals of the fronts at `hits`, whichever side the rays came from; directions may have any length. Zero
/// for a miss, and where a triangle is too thin to have one.
pub(crate) fn front_normals(scene: &CpuScene, rays: &[Ray], hits: &[Hit], normals: &mut [[f32; 3]]) {
    let rays = rays.chunks(TOGETHER).zip(hits.chunks(TOGETHER));
    for ((rays, hits), normals) in rays.zip(normals.chunks_mut(TOGETHER)) {
        front_normals_together(scene, rays, hits, normals);
    }
}

/// So many look-ups wait for memory together.
const TOGETHER: usize = 64;

/// As [`front_normals`], for at most [`TOGETHER`] hits. Records, corners and vertices are looked up one kind after the other:
/// within a kind no look-up waits for another, so their cache misses overlap.
fn front_normals_together(scene: &CpuScene, rays: &[Ray], hits: &[Hit], normals: &mut [[f32; 3]]) {
    let tables = &*scene.tables;
    let records: [Option<HitRecords>; TOGETHER] = std::array::from_fn(|i| {
        let hit = hits.get(i).filter(|h| !h.is_miss())?;
        Some(scene.records(hit.instance, hit.primitive))
    });
    let corners: [[u32; 3]; TOGETHER] = std::array::from_fn(|i| match &records[i] {
        Some(r) if r.geometry.kind == GeometryKind::Triangles => {
            tables.indices[(r.geometry.first_primitive + r.primitive) as usize]
        }
        _ => [0; 3],
    });
    for (i, normal) in normals.iter_mut().enumerate() {
        let n = match &records[i] {
            None => vec3f(0.0, 0.0, 0.0),
            Some(r) if r.geometry.kind == GeometryKind::Spheres => {
                let material = &tables.materials[r.binding.material as usize];
                sphere_point(tables, r, material, &rays[i], &hits[i]).normal
            }
            Some(r) => {
                let vertex = |c: u32| vec3(tables.positions[(r.geometry.first_vertex + c) as usize]);
                let n = face_normal(r, corners[i].map(vertex));
                // The square of a tiny triangle's normal would be zero.
                let largest = n.x.abs().max(n.y.abs()).max(n.z.abs());
                if largest > 0.0 { normalize(n * (1.0 / largest)) } else { vec3f(0.0, 0.0, 0.0) }
            }
        };
        *normal = n.to_array();
    }
}

/// In what coordinates an instance's transform rounds: the largest of three points in world space, and of the translation.
#[inline(always)]
pub(crate) fn transformed_extent(object_to_world: &[[f32; 4]; 3], points: [Vec3f; 3]) -> f32 {
    let largest = |x: f32, y: f32, z: f32| x.abs().max(y.abs()).max(z.abs());
    let [a, b, c] = points.map(|p| largest(p.x, p.y, p.z));
    let [[.., x], [.., y], [.., z]] = *object_to_world;
    a.max(b).max(c) + largest(x, y, z)
}

/// What a primitive knows of a point on it, before the viewer's side and the normal map count.
struct Point {
    position: Vec3f,
    clearance: f32,
    /// Unit geometric normal of the front.
    normal: Vec3f,
    /// Unit interpolated normal of the front; `None` where the surface is flat.
    shading: Option<Vec3f>,
    lift: TerminatorLift,
    /// Tangent and handedness, if the material needs one.
    tangent: Option<(Vec3f, f32)>,
    coords: Vec4f,
    color: Vec4f,
    object_position: Vec3f,
    graph: GraphPlace,
    /// From the centre of a sphere, in the space of its bottom-level structure.
    outward: Vec3f,
}

/// Of what has no vertex normals, or stays exact.
const NO_LIFT: TerminatorLift = TerminatorLift { offset: vec3f(0.0, 0.0, 0.0), share: 0.0 };

#[inline(always)]
fn triangle_point(
    tables: &SceneTables,
    records: &HitRecords,
    material: &MaterialRecord,
    wo: Vec3f,
    hit: &Hit,
) -> Point {
    let (geometry, instance) = (records.geometry, records.instance);
    let corners = tables.indices[(geometry.first_primitive + records.primitive) as usize];
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let vertex = |c: u32| vec3(tables.positions[(geometry.first_vertex + c) as usize]);
    let [p0, p1, p2] = corners.map(vertex);
    let local = p0 * weights[0] + p1 * weights[1] + p2 * weights[2];
    let to_world =
        |n: Vec3f| if instance.identity { n } else { transform_normal(&instance.world_to_object, n) };
    let shading = (geometry.first_normal != NONE)
        .then(|| interpolate(&tables.normals, geometry.first_normal, corners, weights))
        .map(|n| to_world(vec3(n)))
        .filter(|n| dot(*n, *n) > 1e-20)
        .map(normalize);
    let wants_tangent = material.texture(SLOT_NORMAL).is_some() || material.flags & MATERIAL_TANGENTS != 0;
    let tangent = (geometry.first_tangent != NONE && wants_tangent).then(|| {
        let t = interpolate(&tables.tangents, geometry.first_tangent, corners, weights);
        let direction = vec3f(t[0], t[1], t[2]);
        let world = if instance.identity {
            direction
        } else {
            transform_vector(&instance.object_to_world, direction)
        };
        let mirrored = !instance.identity && determinant(&instance.object_to_world) < 0.0;
        (world, if (t[3] < 0.0) != mirrored { -1.0 } else { 1.0 })
    });
    let place = |p: Vec3f| if instance.identity { p } else { transform_point(&instance.object_to_world, p) };
    let (world, position) = ([p0, p1, p2].map(place), place(local));
    let normal = normalize(face_normal(records, [p0, p1, p2]));
    let mut lift = NO_LIFT;
    if material.flags & MATERIAL_SMOOTH_TERMINATOR != 0 && shading.is_some() {
        let vertex_normal = |c: u32| to_world(vec3(tables.normals[(geometry.first_normal + c) as usize]));
        let ([a, b, c], [n0, n1, n2]) = (world, corners.map(vertex_normal));
        let side = if dot(normal, wo) >= 0.0 { 1.0 } else { -1.0 };
        let weights = vec3f(weights[0], weights[1], weights[2]);
        lift = terminator_lift(position, a, b, c, n0, n1, n2, side, normal * side, weights);
    }
    let transformed =
        if instance.identity { 0.0 } else { transformed_extent(&instance.object_to_world, world) };
    Point {
        clearance: triangle_clearance(world[0], world[1], world[2], normal, transformed),
        position,
        normal,
        shading,
        lift,
        tangent,
        coords: tex_coords(tables, geometry, corners, weights),
        color: vertex_color(tables, geometry, corners, weights),
        object_position: object_position(tables, records, local),
        graph: if material.has_graphs() {
            GraphPlace::of(&triangle_texture_point(tables, records, weights))
        } else {
            GraphPlace::NONE
        },
        outward: vec3f(0.0, 0.0, 0.0),
    }
}

/// A direction from the centre of a sphere, in the space of its bottom-level structure, in the space of the user's object.
#[inline(always)]
pub(crate) fn sphere_direction(tables: &SceneTables, records: &HitRecords, outward: Vec3f) -> Vec3f {
    let Some(rows) = tables.placement(records.binding) else { return outward };
    let [x, y, z] = rows.map(|[x, y, z, _]| vec3f(x, y, z));
    turned_direction(x, y, z, outward)
}

/// The normal of a triangle's front in world space, from its corners in object space; not normalised.
#[inline(always)]
fn face_normal(records: &HitRecords, [p0, p1, p2]: [Vec3f; 3]) -> Vec3f {
    let local = cross(p1 - p0, p2 - p0);
    let instance = records.instance;
    if instance.identity { local } else { transform_normal(&instance.world_to_object, local) }
}

fn sphere_point(
    tables: &SceneTables,
    records: &HitRecords,
    material: &MaterialRecord,
    ray: &Ray,
    hit: &Hit,
) -> Point {
    let instance = records.instance;
    let [x, y, z, radius] = tables.spheres[(records.geometry.first_primitive + records.primitive) as usize];
    let center = vec3f(x, y, z);
    let world = vec3(ray.origin) + vec3(ray.direction) * hit.t;
    let local = if instance.identity { world } else { transform_point(&instance.world_to_object, world) };
    // Back onto the sphere: the ray's parameter alone is off by more than an offset of the origin hides.
    let outward = normalize(local - center);
    let on_sphere = center + outward * radius;
    let (position, normal) = if instance.identity {
        (on_sphere, outward)
    } else {
        let normal = normalize(transform_normal(&instance.world_to_object, outward));
        (transform_point(&instance.object_to_world, on_sphere), normal)
    };
    let uv = sphere_uv(sphere_direction(tables, records, outward));
    let mut tangent = sphere_tangent_turned(uv, material.tangent_turn);
    let mut mirrored = material.flags & MATERIAL_TANGENTS_MIRRORED != 0;
    // Of similar shapes only, which transform tangents as normals.
    if let Some(to_object) = tables.placement(records.binding) {
        tangent = transform_normal(to_object, tangent);
        mirrored ^= determinant(to_object) < 0.0;
    }
    if !instance.identity {
        tangent = transform_vector(&instance.object_to_world, tangent);
        mirrored ^= determinant(&instance.object_to_world) < 0.0;
    }
    // The sphere's own axes bound it in world space as corners bound a triangle.
    let corner =
        |s: f32| transform_point(&instance.object_to_world, center + vec3f(radius, radius, radius) * s);
    let clearance = if instance.identity {
        sphere_clearance(position, center, radius, normal, 0.0)
    } else {
        let corners = [corner(1.0), corner(-1.0), position];
        let transformed = transformed_extent(&instance.object_to_world, corners);
        sphere_clearance(position, position, 0.0, normal, transformed)
    };
    Point {
        position,
        clearance,
        normal,
        shading: None,
        lift: NO_LIFT,
        tangent: Some((tangent, if mirrored { -1.0 } else { 1.0 })),
        coords: vec4f(uv.x, uv.y, uv.x, uv.y),
        color: vec4f(1.0, 1.0, 1.0, 1.0),
        object_position: object_position(tables, records, on_sphere),
        graph: if material.has_graphs() {
            GraphPlace::of(&sphere_texture_point(tables, records, outward))
        } else {
            GraphPlace::NONE
        },
        outward,
    }
}

/// The shading normal on the viewer's side, with the normal map applied and bent so that nothing reflects into the
/// surface.
#[inline(always)]
fn shading_normal(
    tables: &SceneTables,
    records: &HitRecords,
    point: &Point,
    wo: Vec3f,
    normal: Vec3f,
    side: f32,
    hit: &Hit,
) -> Vec3f {
    let material = &tables.materials[records.binding.material as usize];
    let mut shading = point.shading.map_or(normal, |n| n * side);
    let texture = material.texture(SLOT_NORMAL);
    if texture.is_height() {
        let frame = tangent_frame(point, shading, side);
        let (scale, weights) = (material.normal_scale, [1.0 - hit.u - hit.v, hit.u, hit.v]);
        shading = bumped_normal(tables, records, texture, &frame, side, scale, weights, point.outward);
    } else if texture.is_some() {
        let unknown = || texture_point_at(point.coords, point.color);
        let texel = crate::fetch::texture::sample(tables, texture, point.coords, unknown);
        let frame = tangent_frame(point, shading, side);
        shading = map_normal(frame, vec3f(texel.x, texel.y, texel.z), material.normal_scale);
    } else if point.shading.is_none() {
        return normal;
    }
    bend_normal(wo, normal, shading)
}

/// The frame of a tangent-space map about `normal`, which is on the viewer's side.
#[inline(always)]
fn tangent_frame(point: &Point, normal: Vec3f, side: f32) -> Frame {
    let (tangent, handedness) = point.tangent.unwrap_or((normal, 0.0));
    tangent_space(normal, tangent, handedness, side)
}

#[inline(always)]
fn interpolate<const N: usize>(
    values: &[[f32; N]],
    first: u32,
    corners: [u32; 3],
    weights: [f32; 3],
) -> [f32; N] {
    let [a, b, c] = corners.map(|i| &values[(first + i) as usize]);
    std::array::from_fn(|k| a[k] * weights[0] + b[k] * weights[1] + c[k] * weights[2])
}

#[inline(always)]
pub(crate) fn tex_coords(
    tables: &SceneTables,
    geometry: &GeometryRecord,
    corners: [u32; 3],
    weights: [f32; 3],
) -> Vec4f {
    let set = |values: &[[f32; 2]], first: u32| {
        if first == NONE { [0.0; 2] } else { interpolate(values, first, corners, weights) }
    };
    let [u0, v0] = set(&tables.uv0, geometry.first_uv0);
    let [u1, v1] = set(&tables.uv1, geometry.first_uv1);
    vec4f(u0, v0, u1, v1)
}

#[inline(always)]
pub(crate) fn vertex_color(
    tables: &SceneTables,
    geometry: &GeometryRecord,
    corners: [u32; 3],
    weights: [f32; 3],
) -> Vec4f {
    if geometry.first_color == NONE {
        return vec4f(1.0, 1.0, 1.0, 1.0);
    }
    let [r, g, b, a] = interpolate(&tables.colors, geometry.first_color, corners, weights);
    vec4f(r, g, b, a)
}

/// What coverage depends on at a candidate hit, for alpha tests: texture coordinates and vertex colour where the material
/// reads alpha, the position where it fades, and everything where it has graphs.
#[inline(always)]
pub(crate) fn alpha_point(
    tables: &SceneTables,
    records: &HitRecords,
    material: &MaterialRecord,
    c: &Candidate,
) -> TexturePoint {
    let geometry = records.geometry;
    let weights = [1.0 - c.u - c.v, c.u, c.v];
    if geometry.kind == GeometryKind::Spheres {
        return sphere_texture_point(tables, records, normalize(vec3(c.outward)));
    }
    if material.has_graphs() {
        return triangle_texture_point(tables, records, weights);
    }
    let corners = tables.indices[(geometry.first_primitive + records.primitive) as usize];
    let mut point = texture_point_at(vec4f(0.0, 0.0, 0.0, 0.0), vec4f(1.0, 1.0, 1.0, 1.0));
    if material_reads_alpha(*material) {
        point.coords = tex_coords(tables, geometry, corners, weights);
        point.color = vertex_color(tables, geometry, corners, weights);
    }
    if material.flags & MATERIAL_CHECKERBOARD_FADES != 0 {
        let p = interpolate(&tables.positions, geometry.first_vertex, corners, weights);
        point.position = object_position(tables, records, vec3(p));
    }
    point
}

/// Whether a candidate hit is on the back of its surface.
pub(crate) fn faces_away(tables: &SceneTables, records: &HitRecords, c: &Candidate) -> bool {
    let outward = match records.geometry.kind {
        GeometryKind::Spheres => vec3(c.outward),
        GeometryKind::Triangles => {
            let geometry = records.geometry;
            let corners = tables.indices[(geometry.first_primitive + records.primitive) as usize];
            let vertex = |c: u32| vec3(tables.positions[(geometry.first_vertex + c) as usize]);
            let [p0, p1, p2] = corners.map(vertex);
            cross(p1 - p0, p2 - p0)
        }
    };
    dot(outward, vec3(c.direction)) > 0.0
}
