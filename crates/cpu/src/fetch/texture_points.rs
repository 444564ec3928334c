//! What texture graphs ask of a point: its place in every space, and how dense these are.

use crate::fetch::surface::{sphere_direction, tex_coords, vertex_color};
use crate::scene::{HitRecords, transform_point, transform_vector, vec3};
use optics::frame::{Frame, to_world};
use optics::shape::sphere_uv;
use optics::texture_point::{
    TexturePoint, area_density, barycentric_step, bump_step, height_normal, sphere_uv_density,
};
use optics::vector::{cross, dot, normalize};
use optics::{Vec3f, vec2f, vec3f, vec4f};
use scene::tables::{GeometryKind, SceneTables, TextureUse};

/// A point in the space of a bottom-level structure, in that of the user's object.
#[inline(always)]
pub(crate) fn object_position(tables: &SceneTables, records: &HitRecords, local: Vec3f) -> Vec3f {
    tables.placement(records.binding).map_or(local, |to_object| transform_point(to_object, local))
}

/// A normal in the space of a bottom-level structure, in that of the user's object.
fn object_normal(tables: &SceneTables, records: &HitRecords, normal: Vec3f) -> Vec3f {
    let Some(to_object) = tables.placement(records.binding) else { return normalize(normal) };
    // Of unit length and right for placements that keep shapes; others are moved into world space with their normals.
    normalize(transform_vector(to_object, normal))
}

/// The point of a triangle with the barycentric weights `weights`, which may lie outside of it. Footprints have no width.
pub(crate) fn triangle_texture_point(
    tables: &SceneTables,
    records: &HitRecords,
    weights: [f32; 3],
) -> TexturePoint {
    let (geometry, instance) = (records.geometry, records.instance);
    let corners = tables.indices[(geometry.first_primitive + records.primitive) as usize];
    let local = corners.map(|c| vec3(tables.positions[(geometry.first_vertex + c) as usize]));
    let in_object = local.map(|p| object_position(tables, records, p));
    let to_world =
        |p: Vec3f| if instance.identity { p } else { transform_point(&instance.object_to_world, p) };
    let in_world = local.map(to_world);
    let mix = |[a, b, c]: [Vec3f; 3]| a * weights[0] + b * weights[1] + c * weights[2];
    let edges = |[a, b, c]: [Vec3f; 3]| (b - a, c - a);
    let ((e1, e2), (d1, d2)) = (edges(in_world), edges(in_object));
    let at_corner = |k: usize| {
        let unit = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        tex_coords(tables, geometry, corners, unit)
    };
    let [t0, t1, t2] = [0, 1, 2].map(at_corner);
    let (u1, u2) = (t1 - t0, t2 - t0);
    let flat = |u: f32, v: f32| vec3f(u, v, 0.0);
    TexturePoint {
        coords: tex_coords(tables, geometry, corners, weights),
        color: vertex_color(tables, geometry, corners, weights),
        position: mix(in_object),
        width: 0.0,
        world: mix(in_world),
        object_density: area_density(e1, e2, d1, d2),
        normal: normalize(cross(d1, d2)),
        uv_density: vec2f(
            area_density(e1, e2, flat(u1.x, u1.y), flat(u2.x, u2.y)),
            area_density(e1, e2, flat(u1.z, u1.w), flat(u2.z, u2.w)),
        ),
    }
}

/// The point of a sphere in the unit direction `outward` from its centre, in the space of its bottom-level structure.
pub(crate) fn sphere_texture_point(
    tables: &SceneTables,
    records: &HitRecords,
    outward: Vec3f,
) -> TexturePoint {
    let instance = records.instance;
    let [x, y, z, radius] = tables.spheres[(records.geometry.first_primitive + records.primitive) as usize];
    let on_sphere = vec3f(x, y, z) + outward * radius;
    let uv = sphere_uv(sphere_direction(tables, records, outward));
    let world =
        if instance.identity { on_sphere } else { transform_point(&instance.object_to_world, on_sphere) };
    // Units of the object per metre, from a step of the sphere's radius.
    let step = vec3f(radius, 0.0, 0.0);
    let length = |v: Vec3f| dot(v, v).sqrt();
    let in_world =
        length(if instance.identity { step } else { transform_vector(&instance.object_to_world, step) });
    let in_object = tables.placement(records.binding).map_or(step, |rows| transform_vector(rows, step));
    let world_radius = in_world.max(1e-30);
    let uv_density = sphere_uv_density(world_radius);
    TexturePoint {
        coords: vec4f(uv.x, uv.y, uv.x, uv.y),
        color: vec4f(1.0, 1.0, 1.0, 1.0),
        position: object_position(tables, records, on_sphere),
        width: 0.0,
        world,
        object_density: length(in_object) / world_radius,
        normal: object_normal(tables, records, outward),
        uv_density: vec2f(uv_density, uv_density),
    }
}

/// The normal of a surface with heights, of any length, in world space.
///
/// - `frame`: along the surface, on the viewer's side; `side`: 1 at the front, −1 at the back. `scale`: of the heights.
/// - `weights`: of a triangle's corners. `outward`: of a sphere, as in [`sphere_texture_point`].
#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "a place on either kind of primitive, and how it is seen")]
pub(crate) fn bumped_normal(
    tables: &SceneTables,
    records: &HitRecords,
    texture: &TextureUse,
    frame: &Frame,
    side: f32,
    scale: f32,
    weights: [f32; 3],
    outward: Vec3f,
) -> Vec3f {
    let point = match records.geometry.kind {
        GeometryKind::Triangles => triangle_texture_point(tables, records, weights),
        GeometryKind::Spheres => sphere_texture_point(tables, records, outward),
    };
    let step = bump_step(point.world);
    let height = |along: Vec3f| {
        let moved = match records.geometry.kind {
            GeometryKind::Triangles => {
                let [e1, e2] = world_edges(tables, records);
                let w = barycentric_step(e1, e2, along);
                let weights = [weights[0] - w.x - w.y, weights[1] + w.x, weights[2] + w.y];
                triangle_texture_point(tables, records, weights)
            }
            GeometryKind::Spheres => {
                let sphere = tables.spheres[(records.geometry.first_primitive + records.primitive) as usize];
                let instance = records.instance;
                let local = if instance.identity {
                    along
                } else {
                    transform_vector(&instance.world_to_object, along)
                };
                sphere_texture_point(tables, records, normalize(outward + local * (1.0 / sphere[3])))
            }
        };
        let seen = TexturePoint { width: step, ..moved };
        crate::fetch::texture::sample(tables, texture, seen.coords, || seen).x * scale * side
    };
    let [h, t, b] = [vec3f(0.0, 0.0, 0.0), frame.tangent * step, frame.bitangent * step].map(height);
    let n = height_normal(h, t, b, step);
    to_world(*frame, n)
}

/// Two edges of a triangle in world space.
fn world_edges(tables: &SceneTables, records: &HitRecords) -> [Vec3f; 2] {
    let (geometry, instance) = (records.geometry, records.instance);
    let corners = tables.indices[(geometry.first_primitive + records.primitive) as usize];
    let [a, b, c] = corners.map(|c| vec3(tables.positions[(geometry.first_vertex + c) as usize]));
    let to_world =
        |v: Vec3f| if instance.identity { v } else { transform_vector(&instance.object_to_world, v) };
    [to_world(b - a), to_world(c - a)]
}
