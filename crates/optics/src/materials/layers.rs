//! A layered material at one point: from its records and texels to the parameters of its lobes.

use super::record::wgsl_records;
use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod layers {
    use crate::frame::*;
    use crate::layered::*;
    use crate::material::*;
    use wgsl_rs::std::*;

    /// Flag of a [`LayersRecord`]: alpha of the specular colour's texture is glossiness.
    pub const LAYERS_GLOSSINESS: u32 = 1u32;
    /// Flag of a [`LayersRecord`]: the coat has a normal map.
    pub const LAYERS_COAT_NORMAL: u32 = 2u32;
    /// Flag of a [`LayersRecord`]: a texture gives direction and strength of the anisotropy.
    pub const LAYERS_ANISOTROPY: u32 = 4u32;

    /// Textures that layers may have, by `LAYER_…`.
    pub const LAYER_TEXTURES: u32 = 12u32;
    /// Place of the coat's strength (R).
    pub const LAYER_COAT: u32 = 0u32;
    /// Place of the coat's roughness (G).
    pub const LAYER_COAT_ROUGHNESS: u32 = 1u32;
    /// Place of the coat's tangent-space normal map (RGB).
    pub const LAYER_COAT_NORMAL: u32 = 2u32;
    /// Place of the sheen's colour (RGB).
    pub const LAYER_SHEEN_COLOR: u32 = 3u32;
    /// Place of the sheen's roughness (A).
    pub const LAYER_SHEEN_ROUGHNESS: u32 = 4u32;
    /// Place of the film's strength (R).
    pub const LAYER_IRIDESCENCE: u32 = 5u32;
    /// Place of the film's thickness (G), between both thicknesses.
    pub const LAYER_FILM_THICKNESS: u32 = 6u32;
    /// Place of the anisotropy's direction (RG) and strength (B).
    pub const LAYER_ANISOTROPY: u32 = 7u32;
    /// Place of the diffuse transmission's strength (A).
    pub const LAYER_DIFFUSE_TRANSMISSION: u32 = 8u32;
    /// Place of the diffuse transmission's colour (RGB).
    pub const LAYER_DIFFUSE_TRANSMISSION_COLOR: u32 = 9u32;
    /// Place of the specular strength (A).
    pub const LAYER_SPECULAR: u32 = 10u32;
    /// Place of the specular colour (RGB) and, with [`LAYERS_GLOSSINESS`], of glossiness (A).
    pub const LAYER_SPECULAR_COLOR: u32 = 11u32;

    /// The layers of one material. Names and ranges are those of the glTF extensions.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct LayersRecord {
        /// Linear colour of the dielectric's reflection.
        pub specular_color: Vec3f,
        /// Index of refraction that the dielectric's reflectance follows from: that of the material, or 0.
        pub reflectance_ior: f32,
        /// Linear colour of the sheen's fibres.
        pub sheen_color: Vec3f,
        /// Perceptual roughness of the sheen.
        pub sheen_roughness: f32,
        /// Linear colour of the diffuse light that leaves on the other side.
        pub diffuse_transmission_color: Vec3f,
        /// Share of the diffuse light that leaves on the other side.
        pub diffuse_transmission: f32,
        /// Thickness of the film in nanometres, for texels of 0 and 1.
        pub film_thickness: Vec2f,
        /// Cosine and sine of the angle between tangent and the longer axis.
        pub anisotropy_direction: Vec2f,
        /// Strength of the anisotropy.
        pub anisotropy: f32,
        /// Share of the surface that the coat covers.
        pub coat: f32,
        /// Perceptual roughness of the coat.
        pub coat_roughness: f32,
        /// Scale of the coat's normal map.
        pub coat_normal_scale: f32,
        /// 20 / Abbe number.
        pub dispersion: f32,
        /// Share of the surface that the film covers.
        pub iridescence: f32,
        /// Index of refraction of the film.
        pub film_ior: f32,
        /// Roughness of the base's diffuse reflection.
        pub diffuse_roughness: f32,
        /// `LAYERS_…` bits.
        pub flags: u32,
        /// Shaders have records of whole vectors of four words.
        pub padding0: u32,
        /// See `padding0`.
        pub padding1: u32,
        /// See `padding0`.
        pub padding2: u32,
    }

    /// Texels of all textures of a layered material; ones where there is no texture.
    #[derive(Clone, Copy, Debug)]
    pub struct LayerTexels {
        /// Texels of [`LayersRecord`]'s textures, by `LAYER_…`.
        pub layers: [Vec4f; 12],
        /// Texel of [`SLOT_METALLIC_ROUGHNESS`].
        pub metallic_roughness: Vec4f,
        /// Texel of [`SLOT_TRANSMISSION`].
        pub transmission: Vec4f,
    }

    /// Directions at a point of a surface, world space, all of unit length.
    #[derive(Clone, Copy, Debug)]
    pub struct SurfaceDirections {
        /// Towards the viewer.
        pub wo: Vec3f,
        /// Geometric normal on the viewer's side.
        pub normal: Vec3f,
        /// Shading normal on that side, normal map applied.
        pub shading_normal: Vec3f,
        /// Interpolated normal without the normal map, and the frame along the texture coordinates.
        pub layer_frame: Frame,
    }

    /// A layered material at one point, textures applied.
    #[derive(Clone, Copy, Debug)]
    pub struct LayeredPoint {
        /// The shading frame; its X is the direction of anisotropy.
        pub frame: Frame,
        /// Direction towards the viewer in that frame.
        pub wo: Vec3f,
        /// Parameters of the lobes.
        pub parameters: LayeredParameters,
        /// Multiplies refracted light; see [`choose_dispersed`].
        pub refraction_tint: Vec3f,
    }

    /// The coat's unit normal in world space: of its own map, or without one.
    pub fn coat_normal(l: LayersRecord, s: SurfaceDirections, texel: Vec4f) -> Vec3f {
        if (l.flags & LAYERS_COAT_NORMAL) == 0u32 {
            return s.layer_frame.normal;
        }
        let mapped = map_normal(s.layer_frame, vec3f(texel.x, texel.y, texel.z), l.coat_normal_scale);
        bend_normal(s.wo, s.normal, mapped)
    }

    /// The frame whose X is the direction of anisotropy. `texel`: of [`LAYER_ANISOTROPY`].
    pub fn anisotropy_frame(l: LayersRecord, s: SurfaceDirections, texel: Vec4f) -> Frame {
        let has_texture = (l.flags & LAYERS_ANISOTROPY) != 0u32;
        let direction = vec2f(select(1.0, texel.x, has_texture), select(0.5, texel.y, has_texture));
        frame_from_tangent(
            s.shading_normal,
            anisotropy_axis(s.layer_frame, l.anisotropy_direction, direction),
        )
    }

    /// A layered material at a point.
    ///
    /// - `base_color`: see [`material_base_color`].
    /// - `ior`, `front`: see [`material_eta`].
    /// - `throughput`: of the path, which decides what colour it is refracted as. `u_dispersion`: uniform number for that
    ///   choice.
    pub fn layered_point(
        m: MaterialRecord,
        l: LayersRecord,
        s: SurfaceDirections,
        base_color: Vec3f,
        t: LayerTexels,
        ior: f32,
        front: bool,
        throughput: Vec3f,
        u_dispersion: f32,
    ) -> LayeredPoint {
        let specular_color = t.layers[11];
        let mut roughness = m.roughness * t.metallic_roughness.y;
        if (l.flags & LAYERS_GLOSSINESS) != 0u32 {
            roughness = 1.0 - (1.0 - m.roughness) * specular_color.w;
        }
        let thin = (m.flags & MATERIAL_THIN) != 0u32;
        let transmission = m.transmission * t.transmission.x;
        let inside = !front && !thin && transmission > 0.0;
        let dispersed = choose_dispersed(l.dispersion, ior, throughput, u_dispersion);
        let frame = anisotropy_frame(l, s, t.layers[7]);
        let parameters = LayeredParameters {
            base_color: base_color,
            metallic: saturate(m.metallic * t.metallic_roughness.z),
            roughness: saturate(roughness),
            diffuse_roughness: l.diffuse_roughness,
            specular: m.specular * t.layers[10].w,
            specular_color: l.specular_color * vec3f(specular_color.x, specular_color.y, specular_color.z),
            ior: l.reflectance_ior,
            anisotropy: l.anisotropy * t.layers[7].z,
            transmission: transmission,
            diffuse_transmission: l.diffuse_transmission * t.layers[8].w,
            diffuse_transmission_color: l.diffuse_transmission_color
                * vec3f(t.layers[9].x, t.layers[9].y, t.layers[9].z),
            sheen_color: l.sheen_color * vec3f(t.layers[3].x, t.layers[3].y, t.layers[3].z),
            sheen_roughness: l.sheen_roughness * t.layers[4].w,
            coat: l.coat * t.layers[0].x,
            coat_roughness: saturate(l.coat_roughness * t.layers[1].y),
            coat_normal: to_local(frame, coat_normal(l, s, t.layers[2])),
            iridescence: l.iridescence * t.layers[5].x,
            film_ior: l.film_ior,
            film_thickness: l.film_thickness.x + (l.film_thickness.y - l.film_thickness.x) * t.layers[6].y,
            eta: select(dispersed.ior, 1.0 / dispersed.ior, inside),
            thin: thin,
            inside: inside,
        };
        LayeredPoint {
            frame: frame,
            wo: to_local(frame, s.wo),
            parameters: parameters,
            refraction_tint: dispersed.tint,
        }
    }

    /// Whether the albedo of the coat is looked up, at [`coat_cosine`] and the coat's roughness.
    pub fn has_coat(m: LayeredParameters) -> bool {
        m.coat > 0.0
    }

    /// Whether the albedo of sheen is looked up, at the cosine of `wo` and the sheen's roughness.
    pub fn has_sheen(m: LayeredParameters) -> bool {
        m.sheen_color.x + m.sheen_color.y + m.sheen_color.z > 0.0
    }

    /// Whether the albedo of a rough dielectric is looked up, at the cosine of `wo`, the base's roughness and `eta`.
    pub fn has_interface(m: LayeredParameters) -> bool {
        m.transmission > 0.0 && !m.thin
    }

    /// Cosine of the viewing direction with the coat's normal, in `[0, 1]`.
    pub fn coat_cosine(p: LayeredPoint) -> f32 {
        saturate(dot(p.parameters.coat_normal, p.wo))
    }

    /// Albedos of lobes that are not there.
    pub fn no_albedos() -> LayeredAlbedos {
        LayeredAlbedos { base: vec2f(1.0, 0.0), coat: vec2f(1.0, 0.0), sheen: 0.0, whole_interface: 1.0 }
    }
}

use layers::LayersRecord;

wgsl_records!(LayersRecord);
