//! Scene tables as the shaders read them: bind group 0 but for materials and textures, whose records are the optics'.
//!
//! Each structure is declared once; its WGSL is made from the declaration.

#![allow(missing_docs, reason = "`#[wgsl]` makes a static that cannot be documented")]

use super::words::Words;
use optics::light_node::{LightNode, NODE_WIDTH};
use optics::wgsl_records;
use optics::{Vec3f, Vec4f, Vec4u, vec3f, vec4f};
use scene::tables::{
    GeometryKind, GeometryRecord, InstanceRecord, LightRecord as TableLight, LightTree, NONE, SceneTables,
};
use wgsl_rs::wgsl;

pub use scene_records::*;

/// Structures and constants of the scene's bindings.
#[wgsl]
pub mod scene_records {
    use wgsl_rs::std::*;

    /// Flag of an [`Instance`]: the transform is the identity.
    pub const INSTANCE_IDENTITY: u32 = 1u32;

    /// Flag of an [`Instance`]: the transform mirrors.
    pub const INSTANCE_MIRRORED: u32 = 2u32;

    /// Flag of a [`Binding`]: the primitives are spheres.
    pub const BINDING_SPHERES: u32 = 1u32;

    /// Flag of a [`Binding`]: vertices have normals.
    pub const BINDING_NORMALS: u32 = 2u32;

    /// Flag of a [`Binding`]: vertices have first texture coordinates.
    pub const BINDING_UV0: u32 = 4u32;

    /// Flag of a [`Binding`]: rays may pass through the surface, by its alpha or from behind.
    pub const BINDING_ALPHA: u32 = 8u32;

    /// Flag of a [`SceneInfo`]: bodies have priorities, and refract by what is on both of their sides.
    pub const VOLUMES_NEST: u32 = 1u32;

    /// Flag of a [`SceneInfo`]: there are bodies that paths and cameras may be inside of.
    pub const VOLUMES_BODIES: u32 = 2u32;

    /// Flag of a [`LightRecord`]: both sides emit.
    pub const LIGHT_TWO_SIDED: u32 = 1u32;

    /// Flag of a [`LightRecord`]: its disc is seen in the sky.
    pub const LIGHT_VISIBLE: u32 = 2u32;

    /// Flag of a [`LightRecord`]: a profile says where it shines.
    pub const LIGHT_PROFILE: u32 = 4u32;

    /// What is the same everywhere in a scene.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct SceneInfo {
        /// Radiance of the gradient sky at the horizon, at the zenith and below.
        pub horizon: Vec3f,
        /// Size of the environment image in pixels; width 0: there is none, the gradient counts.
        pub environment_width: u32,
        /// See above.
        pub zenith: Vec3f,
        /// See above.
        pub environment_height: u32,
        /// See above.
        pub ground: Vec3f,
        /// Rotation of the environment image in turns.
        pub environment_rotation: f32,
        /// See above.
        pub light_count: u32,
        /// Index of the environment image's light, or NONE.
        pub environment_light: u32,
        /// Where the indices of lights begin, in `words`, whose disc is seen in the sky, and how many there are.
        pub first_disc: u32,
        /// See above.
        pub disc_count: u32,
        /// Where the alias table of the environment's rows begins, in `words`: threshold and alias each.
        pub row_alias: u32,
        /// log₂ of the width of a layer of `texels`, and its height.
        pub texel_width_log2: u32,
        /// See above.
        pub texel_height: u32,
        /// Where the directional albedo of sheen begins, in `words`; only in scenes with layers.
        pub sheen_albedo: u32,
        /// Where the tree of lights begins, in `words`: two numbers of the tree, the lights' places, its
        /// nodes; see `light_chooser_tree.wgsl`.
        pub light_tree: u32,
        /// Where the medium between bodies begins, in `words`, or NONE, and the height below which it is.
        pub fog_medium: u32,
        /// See above.
        pub fog_top: f32,
        /// VOLUMES_… bits.
        pub volume_flags: u32,
        /// Where the triangles of portals begin, in `words`, nine each: a vertex and two edges; and how many there are.
        pub first_portal: u32,
        /// See above.
        pub portal_count: u32,
        /// Where the boxes around everything that shines begin, in `words`, six numbers each: the lowest and the highest corner; and how
        /// many there are.
        pub emitter_boxes: u32,
        /// See above.
        pub emitter_box_count: u32,
        /// Of each light of a list of few, three vectors: centre and radius, axis and intensity, and of the cones the cosine and sine
        /// of the spread, the cosine of the emission, and the back; see the optics' `LightGroup`.
        pub light_list: [Vec4f; 24],
        /// The lights of the list.
        pub light_list_indices: [Vec4u; 2],
    }

    /// A bottom-level structure placed in the world.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct Instance {
        /// Rows of the 3×4 matrices.
        pub object_to_world: [Vec4f; 3],
        /// See above.
        pub world_to_object: [Vec4f; 3],
        /// Index into `bindings` of the first geometry's.
        pub first_binding: u32,
        /// INSTANCE_… bits.
        pub flags: u32,
        /// Number of the bottom-level structure.
        pub blas: u32,
        /// Fills 16 bytes.
        pub padding: u32,
    }

    /// One geometry of one instance: what a record of a shader binding table would hold.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct Binding {
        /// Index into `materials`.
        pub material: u32,
        /// Where the lights of the geometry's primitives begin in `words`, an index into `lights` each; NONE if its light cannot be
        /// sampled.
        pub first_light: u32,
        /// What the user calls an instance.
        pub object: u32,
        /// BINDING_… bits.
        pub flags: u32,
        /// Number of the geometry's first primitive within its bottom-level structure.
        pub first_in_blas: u32,
        /// Where the geometry's indices (three a triangle) or spheres (four numbers each) begin in `words`.
        pub first_word: u32,
        /// Index into `vertices` of the first vertex.
        pub first_vertex: u32,
        /// Where attributes begin in `words`, or NONE: tangents (4 numbers), second texture coordinates (2), colours (4).
        pub first_tangent: u32,
        /// See above.
        pub first_uv1: u32,
        /// See above.
        pub first_color: u32,
        /// Where the three rows of four numbers from world to object space begin in `words`, of what was moved into world space and
        /// has something that lies in the space of its object; NONE elsewhere.
        pub placement: u32,
        /// Fills 16 bytes.
        pub padding: u32,
    }

    /// Position, normal (zero if there is none) and first texture coordinates.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct Vertex {
        /// See above.
        pub position: Vec3f,
        /// See above.
        pub u: f32,
        /// See above.
        pub normal: Vec3f,
        /// See above.
        pub v: f32,
    }

    /// A light and its slot of the alias table that chooses among lights.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct LightRecord {
        /// See above.
        pub position: Vec3f,
        /// LIGHT_… of the optics.
        pub kind: u32,
        /// See above.
        pub edge1: Vec3f,
        /// See above.
        pub size: f32,
        /// See above.
        pub edge2: Vec3f,
        /// LIGHT_TWO_SIDED, LIGHT_VISIBLE, LIGHT_PROFILE.
        pub flags: u32,
        /// See above.
        pub emission: Vec3f,
        /// Material whose textures modulate the light, or NONE.
        pub textured_material: u32,
        /// See above.
        pub threshold: f32,
        /// See above.
        pub alias_index: u32,
        /// See above.
        pub probability: f32,
        /// Where the twelve numbers are, in `words`, by which a sampled point of a textured surface is found on the textures: of a
        /// triangle both sets of three pairs, of a sphere three rows from world to object space. Where the profile of a point or
        /// spot is, with LIGHT_PROFILE: rows, columns, values row by row.
        pub texture_places: u32,
    }
}

wgsl_records!(SceneInfo, Instance, Binding, Vertex, LightRecord);

/// The WGSL of the records and constants.
pub fn records_text() -> String {
    WGSL_SOURCE.wgsl_source().expect("a test builds the text of the records")
}

/// See [`SceneInfo::light_list`]; zeros where lights are no list.
pub(super) fn light_list(tree: &LightTree) -> [Vec4f; 3 * NODE_WIDTH] {
    let zero = vec4f(0.0, 0.0, 0.0, 0.0);
    let with = |v: Vec3f, w: f32| vec4f(v.x, v.y, v.z, w);
    let Some((list, _)) = tree.list() else { return [zero; 3 * NODE_WIDTH] };
    std::array::from_fn(|i| {
        let group = list.group(i / 3);
        match i % 3 {
            0 => with(group.center, group.radius),
            1 => with(group.axis, group.intensity),
            _ => vec4f(group.cos_spread, group.sin_spread, group.cos_emission, group.back),
        }
    })
}

/// See [`SceneInfo::light_list_indices`]; zeros where lights are no list.
pub(super) fn light_list_indices(tree: &LightTree) -> [Vec4u; NODE_WIDTH / 4] {
    let light = |place| tree.list().map_or(0, |(list, _): (&LightNode, _)| list.light(place));
    std::array::from_fn(|i| Vec4u::from_array(std::array::from_fn(|j| light((4 * i + j) as u32))))
}

/// All instances.
pub(super) fn instances(tables: &SceneTables) -> Vec<Instance> {
    let record = |i: &InstanceRecord| Instance {
        object_to_world: rows(&i.object_to_world),
        world_to_object: rows(&i.world_to_object),
        first_binding: i.first_binding,
        flags: if i.identity { INSTANCE_IDENTITY } else { 0 }
            | if mirrors(&i.object_to_world) { INSTANCE_MIRRORED } else { 0 },
        blas: i.blas,
        padding: 0,
    };
    tables.instances.iter().map(record).collect()
}

fn rows(matrix: &[[f32; 4]; 3]) -> [Vec4f; 3] {
    matrix.map(|[x, y, z, w]| vec4f(x, y, z, w))
}

fn mirrors(m: &[[f32; 4]; 3]) -> bool {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1) < 0.0
}

/// One binding for each geometry of each instance.
pub(super) fn bindings(tables: &SceneTables, words: &Words) -> Vec<Binding> {
    let mut bindings = vec![None; tables.bindings.len()];
    for instance in &tables.instances {
        let blas = tables.blas[instance.blas as usize];
        for g in 0..blas.geometry_count {
            let index = (instance.first_binding + g) as usize;
            let geometry = &tables.geometries[(blas.first_geometry + g) as usize];
            bindings[index] = Some(binding(tables, words, index, geometry));
        }
    }
    bindings.into_iter().flatten().collect()
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
            | flag(BINDING_ALPHA, tables.materials[own.material as usize].has_alpha()),
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
        placement: within(words.placements, 12, own.placement),
        padding: 0,
    }
}

fn vector([x, y, z]: &[f32; 3]) -> Vec3f {
    vec3f(*x, *y, *z)
}

/// All vertices of all geometries, in the order of the tables' positions.
pub(super) fn vertices(tables: &SceneTables) -> Vec<Vertex> {
    let position =
        |p: &[f32; 3]| Vertex { position: vector(p), u: 0.0, normal: vec3f(0.0, 0.0, 0.0), v: 0.0 };
    let mut vertices: Vec<Vertex> = tables.positions.iter().map(position).collect();
    for g in tables.geometries.iter().filter(|g| g.kind == GeometryKind::Triangles) {
        let own = &mut vertices[g.first_vertex as usize..][..g.vertex_count as usize];
        if g.first_normal != NONE {
            let normals = &tables.normals[g.first_normal as usize..];
            own.iter_mut().zip(normals).for_each(|(vertex, n)| vertex.normal = vector(n));
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
    let mut texture_places = words.texture_places;
    let record = |(l, alias): (&TableLight, &scene::tables::AliasEntry)| {
        let textured = l.textured_material != NONE;
        let record = LightRecord {
            position: l.light.position,
            kind: l.light.kind,
            edge1: l.light.edge1,
            size: l.light.size,
            edge2: l.light.edge2,
            flags: if l.light.two_sided { LIGHT_TWO_SIDED } else { 0 }
                | if l.visible { LIGHT_VISIBLE } else { 0 }
                | if l.profile == NONE { 0 } else { LIGHT_PROFILE },
            emission: l.light.emission,
            textured_material: l.textured_material,
            threshold: alias.threshold,
            alias_index: alias.alias,
            probability: alias.probability,
            texture_places: match (textured, l.profile) {
                (true, _) => texture_places,
                (false, NONE) => NONE,
                (false, profile) => words.profiles + profile,
            },
        };
        texture_places += if textured { l.texture_places.len() as u32 } else { 0 };
        record
    };
    tables.lights.iter().zip(&tables.light_alias).map(record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::assert_packed;
    use optics::image_texture::TextureUse;
    use optics::layers::LayersRecord;
    use optics::material::MaterialRecord;
    use optics::texture_node::TextureNode;

    #[test]
    fn shaders_have_no_gaps_between_the_fields_of_records() {
        let module = crate::shader::check::module("scattering_layered");
        assert_packed::<SceneInfo>(&module);
        assert_packed::<Instance>(&module);
        assert_packed::<Binding>(&module);
        assert_packed::<Vertex>(&module);
        assert_packed::<LightRecord>(&module);
        assert_packed::<TextureUse>(&module);
        assert_packed::<MaterialRecord>(&module);
        assert_packed::<LayersRecord>(&module);
        assert_packed::<TextureNode>(&crate::shader::check::module("graphs_nodes"));
    }

    #[test]
    #[should_panic(expected = "`Vertex` has a gap before `position`")]
    fn a_gap_is_noticed() {
        let text = "struct Vertex { u: f32, position: vec3f, normal: vec3f, v: f32 }";
        assert_packed::<Vertex>(&crate::shader::check::parse(text));
    }
}
