//! Scene tables as the shaders read them. A test compares every layout with what naga makes of `shaders/scene.wgsl`.

#![allow(missing_docs, reason = "the fields are explained where shaders declare them")]

use super::words::Words;
use bytemuck::{Pod, Zeroable};
use scene::tables::{
    GeometryKind, GeometryRecord, InstanceRecord, LightRecord as TableLight, NONE, SceneTables,
};

/// Set where an instance's transform is the identity.
pub const INSTANCE_IDENTITY: u32 = 1;
/// Set where an instance's transform mirrors.
pub const INSTANCE_MIRRORED: u32 = 2;
/// Set on geometries of spheres.
pub const BINDING_SPHERES: u32 = 1;
/// Set where vertices have normals.
pub const BINDING_NORMALS: u32 = 2;
/// Set where vertices have first texture coordinates.
pub const BINDING_UV0: u32 = 4;
/// Set where rays may pass through the surface by its alpha.
pub const BINDING_ALPHA: u32 = 8;
/// Set where a material emits; the other bits are the scene's own.
pub const MATERIAL_EMISSIVE: u32 = 64;

/// Set where bodies have priorities.
pub const VOLUMES_NEST: u32 = 1;
/// Set where there are bodies that paths and cameras may be inside of.
pub const VOLUMES_BODIES: u32 = 2;
pub(super) const TEXTURE_UV1: u32 = 1;
pub(super) const TEXTURE_BILINEAR: u32 = 2;
pub(super) const TEXTURE_SRGB: u32 = 4;
pub(super) const TEXTURE_WRAP_U_SHIFT: u32 = 4;
pub(super) const TEXTURE_WRAP_V_SHIFT: u32 = 6;
const LIGHT_TWO_SIDED: u32 = 1;
const LIGHT_VISIBLE: u32 = 2;
const LIGHT_PROFILE: u32 = 4;

/// What is the same everywhere in a scene; see the shader for the fields.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct SceneInfo {
    pub horizon: [f32; 3],
    pub environment_width: u32,
    pub zenith: [f32; 3],
    pub environment_height: u32,
    pub ground: [f32; 3],
    pub environment_rotation: f32,
    pub light_count: u32,
    pub environment_light: u32,
    pub first_disc: u32,
    pub disc_count: u32,
    pub row_alias: u32,
    pub texel_width_log2: u32,
    pub texel_height: u32,
    pub sheen_albedo: u32,
    pub light_tree: u32,
    pub fog_medium: u32,
    pub fog_top: f32,
    pub volume_flags: u32,
    pub first_portal: u32,
    pub portal_count: u32,
    pub emitter_boxes: u32,
    pub emitter_box_count: u32,
}

/// A bottom-level structure placed in the world.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    pub object_to_world: [[f32; 4]; 3],
    pub world_to_object: [[f32; 4]; 3],
    pub first_binding: u32,
    pub flags: u32,
    pub blas: u32,
    pub padding: u32,
}

/// One geometry of one instance.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Binding {
    pub material: u32,
    pub first_light: u32,
    pub object: u32,
    pub flags: u32,
    pub first_in_blas: u32,
    pub first_word: u32,
    pub first_vertex: u32,
    pub first_tangent: u32,
    pub first_uv1: u32,
    pub first_color: u32,
    pub padding0: u32,
    pub padding1: u32,
}

/// Position, normal and first texture coordinates.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    pub position: [f32; 3],
    pub u: f32,
    pub normal: [f32; 3],
    pub v: f32,
}

/// The use of a texture by a material.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct TextureUse {
    pub row_u: [f32; 3],
    pub first_texel: u32,
    pub row_v: [f32; 3],
    pub flags: u32,
    pub width: u32,
    pub height: u32,
    /// The image among those of all textures: its place in a binding array.
    pub image: u32,
    pub padding: u32,
}

/// A material with all its textures.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Material {
    pub base_color: [f32; 4],
    pub emission: [f32; 3],
    pub model: u32,
    pub metallic: f32,
    pub roughness: f32,
    pub specular: f32,
    pub ior: f32,
    pub transmission: f32,
    pub normal_scale: f32,
    pub alpha_cutoff: f32,
    pub flags: u32,
    pub checkerboard_even: [f32; 3],
    pub checkerboard_scale: f32,
    pub checkerboard_odd: [f32; 3],
    pub padding: u32,
    pub checkerboard_fade: [f32; 2],
    pub medium: u32,
    pub priority: i32,
    pub absorption: [f32; 3],
    pub layers: u32,
    pub textures: [TextureUse; 5],
}

/// A light and its slot of the alias table that chooses among lights.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct LightRecord {
    pub position: [f32; 3],
    pub kind: u32,
    pub edge1: [f32; 3],
    pub size: f32,
    pub edge2: [f32; 3],
    pub flags: u32,
    pub emission: [f32; 3],
    pub textured_material: u32,
    pub threshold: f32,
    pub alias_index: u32,
    pub probability: f32,
    pub first_uv: u32,
}

/// All instances.
pub(super) fn instances(tables: &SceneTables) -> Vec<Instance> {
    let record = |i: &InstanceRecord| Instance {
        object_to_world: i.object_to_world,
        world_to_object: i.world_to_object,
        first_binding: i.first_binding,
        flags: if i.identity { INSTANCE_IDENTITY } else { 0 }
            | if mirrors(&i.object_to_world) { INSTANCE_MIRRORED } else { 0 },
        blas: i.blas,
        padding: 0,
    };
    tables.instances.iter().map(record).collect()
}

fn mirrors(m: &[[f32; 4]; 3]) -> bool {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1) < 0.0
}

/// One binding for each geometry of each instance.
pub(super) fn bindings(tables: &SceneTables, words: &Words) -> Vec<Binding> {
    let mut bindings = vec![Binding::default(); tables.bindings.len()];
    for instance in &tables.instances {
        let blas = tables.blas[instance.blas as usize];
        for g in 0..blas.geometry_count {
            let index = (instance.first_binding + g) as usize;
            let geometry = &tables.geometries[(blas.first_geometry + g) as usize];
            bindings[index] = binding(tables, words, index, geometry);
        }
    }
    bindings
}

fn binding(tables: &SceneTables, words: &Words, index: usize, geometry: &GeometryRecord) -> Binding {
    let own = tables.bindings[index];
    let spheres = geometry.kind == GeometryKind::Spheres;
    let flag = |bit: u32, on: bool| if on { bit } else { 0 };
    let within = |part: u32, width: u32, first: u32| if first == NONE { NONE } else { part + width * first };
    Binding {
        material: own.material,
        first_light: within(words.primitive_lights, 1, own.first_light),
        object: own.object,
        flags: flag(BINDING_SPHERES, spheres)
            | flag(BINDING_NORMALS, geometry.first_normal != NONE)
            | flag(BINDING_UV0, geometry.first_uv0 != NONE)
            | flag(BINDING_ALPHA, !spheres && tables.materials[own.material as usize].has_alpha()),
        first_in_blas: geometry.first_in_blas,
        first_word: if spheres {
            words.spheres + 4 * geometry.first_primitive
        } else {
            words.indices + 3 * geometry.first_primitive
        },
        first_vertex: geometry.first_vertex,
        first_tangent: within(words.tangents, 4, geometry.first_tangent),
        first_uv1: within(words.uv1, 2, geometry.first_uv1),
        first_color: within(words.colors, 4, geometry.first_color),
        padding0: 0,
        padding1: 0,
    }
}

/// All vertices of all geometries, in the order of the tables' positions.
pub(super) fn vertices(tables: &SceneTables) -> Vec<Vertex> {
    let position = |p: &[f32; 3]| Vertex { position: *p, ..Vertex::default() };
    let mut vertices: Vec<Vertex> = tables.positions.iter().map(position).collect();
    for g in tables.geometries.iter().filter(|g| g.kind == GeometryKind::Triangles) {
        let own = &mut vertices[g.first_vertex as usize..][..g.vertex_count as usize];
        if g.first_normal != NONE {
            let normals = &tables.normals[g.first_normal as usize..];
            own.iter_mut().zip(normals).for_each(|(vertex, n)| vertex.normal = *n);
        }
        if g.first_uv0 != NONE {
            let coordinates = &tables.uv0[g.first_uv0 as usize..];
            own.iter_mut().zip(coordinates).for_each(|(vertex, uv)| [vertex.u, vertex.v] = *uv);
        }
    }
    vertices
}

/// All lights, with the alias table that chooses among them.
pub(super) fn lights(tables: &SceneTables, words: &Words) -> Vec<LightRecord> {
    let mut first_uv = words.light_uvs;
    let record = |(l, alias): (&TableLight, &scene::tables::AliasEntry)| {
        let textured = l.textured_material != NONE;
        let record = LightRecord {
            position: l.light.position.to_array(),
            kind: l.light.kind,
            edge1: l.light.edge1.to_array(),
            size: l.light.size,
            edge2: l.light.edge2.to_array(),
            flags: if l.light.two_sided { LIGHT_TWO_SIDED } else { 0 }
                | if l.visible { LIGHT_VISIBLE } else { 0 }
                | if l.profile == NONE { 0 } else { LIGHT_PROFILE },
            emission: l.light.emission.to_array(),
            textured_material: l.textured_material,
            threshold: alias.threshold,
            alias_index: alias.alias,
            probability: alias.probability,
            first_uv: match (textured, l.profile) {
                (true, _) => first_uv,
                (false, NONE) => NONE,
                (false, profile) => words.profiles + profile,
            },
        };
        first_uv += if textured { 12 } else { 0 };
        record
    };
    tables.lights.iter().zip(&tables.light_alias).map(record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::assert_layout;

    #[test]
    fn layouts_match_the_shader() {
        let module = crate::shader::check::module("lights");
        assert_layout!(
            module,
            SceneInfo {
                horizon,
                environment_width,
                zenith,
                environment_height,
                ground,
                environment_rotation,
                light_count,
                environment_light,
                first_disc,
                disc_count,
                row_alias,
                texel_width_log2,
                texel_height,
                sheen_albedo,
                light_tree,
                fog_medium,
                fog_top,
                volume_flags,
                first_portal,
                portal_count,
                emitter_boxes,
                emitter_box_count,
            }
        );
        assert_layout!(
            module,
            Instance { object_to_world, world_to_object, first_binding, flags, blas, padding }
        );
        assert_layout!(
            module,
            Binding {
                material,
                first_light,
                object,
                flags,
                first_in_blas,
                first_word,
                first_vertex,
                first_tangent,
                first_uv1,
                first_color,
                padding0,
                padding1,
            }
        );
        assert_layout!(module, Vertex { position, u, normal, v });
        assert_layout!(
            module,
            TextureUse { row_u, first_texel, row_v, flags, width, height, image, padding }
        );
        assert_layout!(
            module,
            Material {
                base_color,
                emission,
                model,
                metallic,
                roughness,
                specular,
                ior,
                transmission,
                normal_scale,
                alpha_cutoff,
                flags,
                checkerboard_even,
                checkerboard_scale,
                checkerboard_odd,
                padding,
                checkerboard_fade,
                medium,
                priority,
                absorption,
                layers,
                textures,
            }
        );
        assert_layout!(
            module,
            LightRecord {
                position,
                kind,
                edge1,
                size,
                edge2,
                flags,
                emission,
                textured_material,
                threshold,
                alias_index,
                probability,
                first_uv,
            }
        );
    }

    #[test]
    #[should_panic(expected = "layout of Vertex")]
    fn a_swapped_field_is_noticed() {
        let text = "struct Vertex { u: f32, position: vec3f, normal: vec3f, v: f32 }";
        let module = crate::shader::check::parse(text);
        assert_layout!(module, Vertex { position, u, normal, v });
    }

    #[test]
    fn constants_are_the_shaders() {
        let module = crate::shader::check::module("lights");
        let constants = [
            ("INSTANCE_IDENTITY", INSTANCE_IDENTITY),
            ("INSTANCE_MIRRORED", INSTANCE_MIRRORED),
            ("BINDING_SPHERES", BINDING_SPHERES),
            ("BINDING_NORMALS", BINDING_NORMALS),
            ("BINDING_UV0", BINDING_UV0),
            ("BINDING_ALPHA", BINDING_ALPHA),
            ("MATERIAL_EMISSIVE", MATERIAL_EMISSIVE),
            ("VOLUMES_NEST", VOLUMES_NEST),
            ("VOLUMES_BODIES", VOLUMES_BODIES),
            ("TEXTURE_UV1", TEXTURE_UV1),
            ("TEXTURE_BILINEAR", TEXTURE_BILINEAR),
            ("TEXTURE_SRGB", TEXTURE_SRGB),
            ("TEXTURE_WRAP_U_SHIFT", TEXTURE_WRAP_U_SHIFT),
            ("TEXTURE_WRAP_V_SHIFT", TEXTURE_WRAP_V_SHIFT),
            ("LIGHT_TWO_SIDED", LIGHT_TWO_SIDED),
            ("LIGHT_VISIBLE", LIGHT_VISIBLE),
        ];
        for (name, value) in constants {
            assert_eq!(crate::layout::constant(&module, name), value, "{name}");
        }
    }
}
