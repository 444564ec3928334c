//! A material as back ends read it, and what it is at a point once textures are looked up.

use super::record::wgsl_records;
use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod material {
    use crate::image_texture::*;
    use crate::pattern::*;
    use wgsl_rs::std::*;

    /// Flag of a [`MaterialRecord`]: alpha below the cutoff is a hole.
    pub const MATERIAL_ALPHA_MASK: u32 = 1u32;
    /// Flag of a [`MaterialRecord`]: alpha is coverage.
    pub const MATERIAL_ALPHA_BLEND: u32 = 2u32;
    /// Flag of a [`MaterialRecord`]: both sides emit.
    pub const MATERIAL_EMISSION_TWO_SIDED: u32 = 4u32;
    /// Flag of a [`MaterialRecord`]: a dielectric without thickness.
    pub const MATERIAL_THIN: u32 = 8u32;
    /// Flag of a [`MaterialRecord`]: a checkerboard replaces the base colour.
    pub const MATERIAL_CHECKERBOARD: u32 = 16u32;
    /// Flag of a [`MaterialRecord`]: the checkerboard's coverage falls with distance.
    pub const MATERIAL_CHECKERBOARD_FADES: u32 = 32u32;
    /// Flag of a [`MaterialRecord`]: the surface emits.
    pub const MATERIAL_EMISSIVE: u32 = 64u32;
    /// Flag of a [`MaterialRecord`]: shading needs a frame along the texture coordinates.
    pub const MATERIAL_TANGENTS: u32 = 128u32;
    /// Flag of a [`MaterialRecord`]: light passes through the surface into a body.
    pub const MATERIAL_BODY: u32 = 256u32;
    /// Flag of a [`MaterialRecord`]: the back is not there, for no ray.
    pub const MATERIAL_CULLS_BACKS: u32 = 512u32;
    /// Flag of a [`MaterialRecord`]: light is gathered where the smooth surface would be that vertex normals stand for.
    pub const MATERIAL_SMOOTH_TERMINATOR: u32 = 1024u32;

    /// Flag of a [`MaterialRecord`]: the coordinates that tangents follow are mirrored; see
    /// [`MaterialRecord::tangent_turn`].
    pub const MATERIAL_TANGENTS_MIRRORED: u32 = 2048u32;

    /// Flag of a [`MaterialRecord`]: a texture of it is a graph, whose patterns may lie in the space of the object.
    pub const MATERIAL_GRAPHS: u32 = 4096u32;

    /// Place of the base colour in [`MaterialRecord::textures`]: RGB, and alpha.
    pub const SLOT_BASE_COLOR: u32 = 0u32;
    /// Place of roughness (G) and metalness (B).
    pub const SLOT_METALLIC_ROUGHNESS: u32 = 1u32;
    /// Place of transmission (R).
    pub const SLOT_TRANSMISSION: u32 = 2u32;
    /// Place of emission (RGB).
    pub const SLOT_EMISSION: u32 = 3u32;
    /// Place of the tangent-space normal map (RGB).
    pub const SLOT_NORMAL: u32 = 4u32;

    /// How a material scatters, before layers.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[repr(u32)]
    pub enum ModelTag {
        /// Metal and dielectric, mixed, of glTF 2.0.
        MetallicRoughness = 0,
        /// Ideal diffuse reflection.
        Lambert = 1,
        /// An interface between transparent media.
        Dielectric = 2,
        /// An ideal mirror.
        Mirror = 3,
        /// Shows its base colour, whatever the light.
        Unlit = 4,
        /// [`ModelTag::MetallicRoughness`] or [`ModelTag::Dielectric`] with layers on it.
        Layered = 5,
        /// No surface, only the end of a medium.
        Boundary = 6,
    }

    /// One material. Vectors are linear RGB.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct MaterialRecord {
        /// Base colour and alpha.
        pub base_color: Vec4f,
        /// Emitted radiance, W·sr⁻¹·m⁻².
        pub emission: Vec3f,
        /// The scattering model.
        pub model: ModelTag,
        /// Metalness in `[0, 1]`.
        pub metallic: f32,
        /// Perceptual roughness in `[0, 1]`.
        pub roughness: f32,
        /// Strength of the dielectric's reflection in `[0, 1]`.
        pub specular: f32,
        /// Index of refraction, ≥ 1.
        pub ior: f32,
        /// Share of refracted light in `[0, 1]`.
        pub transmission: f32,
        /// Scale of the normal map's x and y.
        pub normal_scale: f32,
        /// Alpha below this is a hole.
        pub alpha_cutoff: f32,
        /// `MATERIAL_…` bits.
        pub flags: u32,
        /// Colour of the checkerboard's even squares.
        pub checkerboard_even: Vec3f,
        /// 1 / side of a square, m⁻¹.
        pub checkerboard_scale: f32,
        /// Colour of the odd squares.
        pub checkerboard_odd: Vec3f,
        /// Direction of the tangent between those in which a shape's own u and v grow, in turns from u towards v: where
        /// the transformed u grows and the transformed v does not. For shapes whose tangents are formulas; those of meshes
        /// have the transform in them.
        pub tangent_turn: f32,
        /// Distances between which the checkerboard's coverage falls from 1 to 0, metres.
        pub checkerboard_fade: Vec2f,
        /// The medium inside, or `NONE`: an index into the tables' media; on a device, where it begins in `words`.
        pub medium: u32,
        /// Which body is there where bodies overlap: the one of the highest priority.
        pub priority: i32,
        /// Absorption coefficient of what is inside, m⁻¹; zero where light does not get inside.
        pub absorption: Vec3f,
        /// The layers, or `NONE`: an index into the tables' layers; on a device, where they begin in `words`.
        pub layers: u32,
        /// Textures by `SLOT_…`.
        pub textures: [TextureUse; 5],
    }

    /// Linear base colour at a point: factor × vertex colour × texel, or the checkerboard's.
    ///
    /// - `vertex_color`, `texel`: ones where there are none. `pattern_position`: in the x–z plane of object space,
    ///   metres. `footprint_width`: of the pixel on the surface, metres; see [`footprint_width`].
    pub fn material_base_color(
        m: MaterialRecord,
        vertex_color: Vec4f,
        texel: Vec4f,
        pattern_position: Vec2f,
        footprint_width: f32,
    ) -> Vec3f {
        if (m.flags & MATERIAL_CHECKERBOARD) != 0u32 {
            let odd =
                checkerboard(pattern_position * m.checkerboard_scale, footprint_width * m.checkerboard_scale);
            return m.checkerboard_even + (m.checkerboard_odd - m.checkerboard_even) * odd;
        }
        vec3f(
            m.base_color.x * vertex_color.x * texel.x,
            m.base_color.y * vertex_color.y * texel.y,
            m.base_color.z * vertex_color.z * texel.z,
        )
    }

    /// Whether the alpha of the base colour counts.
    pub fn material_reads_alpha(m: MaterialRecord) -> bool {
        (m.flags & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND)) != 0u32
    }

    /// Coverage of a point in `[0, 1]`: 0 is a hole.
    ///
    /// - `vertex_alpha`, `texel_alpha`: of vertex colour and base colour texture; 1 where there is none.
    pub fn material_coverage(
        m: MaterialRecord,
        vertex_alpha: f32,
        texel_alpha: f32,
        pattern_position: Vec2f,
    ) -> f32 {
        let mut alpha = 1.0;
        if material_reads_alpha(m) {
            alpha = m.base_color.w * vertex_alpha * texel_alpha;
        }
        if (m.flags & MATERIAL_ALPHA_MASK) != 0u32 {
            alpha = select(0.0, 1.0, alpha >= m.alpha_cutoff);
        }
        // Most points are near enough to be there as a whole, and need no root.
        let near = m.checkerboard_fade.x;
        let is_near = dot(pattern_position, pattern_position) <= near * near;
        if (m.flags & MATERIAL_CHECKERBOARD_FADES) != 0u32 && !is_near {
            alpha = alpha * distance_fade(length(pattern_position), near, m.checkerboard_fade.y);
        }
        alpha
    }

    /// Whether a path may find light on the material's surfaces: they emit, or show their colour unlit.
    pub fn material_shines(m: MaterialRecord) -> bool {
        (m.flags & MATERIAL_EMISSIVE) != 0u32 || m.model == ModelTag::Unlit
    }

    /// Whether rays pass through some points of the material's surfaces by its alpha.
    pub fn material_has_holes(m: MaterialRecord) -> bool {
        let holes = MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND | MATERIAL_CHECKERBOARD_FADES;
        (m.flags & holes) != 0u32
    }

    /// Whether the material emits from its front (`front`) or its back.
    pub fn material_emits(m: MaterialRecord, front: bool) -> bool {
        (m.flags & MATERIAL_EMISSIVE) != 0u32 && (front || (m.flags & MATERIAL_EMISSION_TWO_SIDED) != 0u32)
    }

    /// Emitted radiance, W·sr⁻¹·m⁻². `texel`: of the emission texture, ones without one.
    pub fn material_emission(m: MaterialRecord, texel: Vec4f) -> Vec3f {
        vec3f(m.emission.x * texel.x, m.emission.y * texel.y, m.emission.z * texel.z)
    }

    /// Index of refraction of the far side over that of the near one. `ior`: of what is behind the surface over what is
    /// in front of it. `front`: whether the front is seen.
    pub fn material_eta(m: MaterialRecord, ior: f32, front: bool) -> f32 {
        select(1.0 / ior, ior, front || (m.flags & MATERIAL_THIN) != 0u32)
    }
}

use material::{
    MATERIAL_BODY, MATERIAL_CHECKERBOARD, MATERIAL_CHECKERBOARD_FADES, MATERIAL_CULLS_BACKS,
    MATERIAL_EMISSIVE, MATERIAL_GRAPHS, MaterialRecord, ModelTag,
};

wgsl_records!(MaterialRecord);

/// Questions of host code.
impl MaterialRecord {
    /// Whether light that passes through what is behind the surface becomes less.
    #[inline(always)]
    pub fn absorbs(&self) -> bool {
        self.absorption.to_array() != [0.0; 3]
    }

    /// Whether rays may pass through the surface by its alpha.
    #[inline(always)]
    pub fn has_holes(&self) -> bool {
        material::material_has_holes(*self)
    }

    /// Whether the back is not there.
    #[inline(always)]
    pub fn culls_backs(&self) -> bool {
        self.flags & MATERIAL_CULLS_BACKS != 0
    }

    /// Whether rays may pass through the surface, so that tracers have to ask about every hit.
    #[inline(always)]
    pub fn has_alpha(&self) -> bool {
        self.has_holes() || self.culls_backs()
    }

    /// Whether a procedural pattern covers the surface, which lies in the space of the object.
    #[inline(always)]
    pub fn is_patterned(&self) -> bool {
        self.flags & (MATERIAL_CHECKERBOARD | MATERIAL_CHECKERBOARD_FADES | MATERIAL_GRAPHS) != 0
    }

    /// Whether a texture of it is a graph.
    #[inline(always)]
    pub fn has_graphs(&self) -> bool {
        self.flags & MATERIAL_GRAPHS != 0
    }

    /// Whether texture coordinates matter: for a texture, or for layers, which may have some.
    #[inline(always)]
    pub fn is_textured(&self) -> bool {
        self.layers != crate::constants::NONE || self.textures.iter().any(|t| t.is_some())
    }

    /// Whether the surface emits. An unlit one does not: it has the colour that is seen.
    #[inline(always)]
    pub fn is_emissive(&self) -> bool {
        self.flags & MATERIAL_EMISSIVE != 0
    }

    /// Whether a path may find light on it; see [`material::material_shines`].
    #[inline(always)]
    pub fn shines(&self) -> bool {
        material::material_shines(*self)
    }

    /// Whether light passes through the surface into a body.
    #[inline(always)]
    pub fn is_body(&self) -> bool {
        self.flags & MATERIAL_BODY != 0
    }

    /// Whether it is no surface, only the end of a medium.
    #[inline(always)]
    pub fn is_boundary(&self) -> bool {
        self.model == ModelTag::Boundary
    }

    /// The use of a texture, by `SLOT_…`.
    #[inline(always)]
    pub fn texture(&self, slot: u32) -> &super::image_texture::image_texture::TextureUse {
        &self.textures[slot as usize]
    }
}
