//! The data that scattering models share: a prepared BSDF, its samples and its values.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod scatter {
    use wgsl_rs::std::*;

    /// Scatters nothing.
    pub const BSDF_NONE: u32 = 0u32;
    /// Diffuse and GGX reflection: metallic-roughness and Lambert.
    pub const BSDF_GLOSSY: u32 = 1u32;
    /// Smooth interface between two media.
    pub const BSDF_SMOOTH_DIELECTRIC: u32 = 2u32;
    /// GGX-rough interface between two media.
    pub const BSDF_ROUGH_DIELECTRIC: u32 = 3u32;
    /// Infinitely thin sheet: transmitted light is not bent; smooth where `alpha` is 0.
    pub const BSDF_THIN_DIELECTRIC: u32 = 4u32;
    /// Ideal mirror.
    pub const BSDF_MIRROR: u32 = 5u32;

    /// GGX width up to which a lobe shows a picture of what is around and not only a gloss: that of roughness 0.1, whose
    /// half width is about one degree.
    pub const SHARP_WIDTH: f32 = 0.01;

    /// A scattering model at one point, prepared for one `wo`.
    #[derive(Clone, Copy, Debug)]
    pub struct Bsdf {
        /// Which model: `BSDF_…`. The other fields mean what the model says.
        pub kind: u32,
        /// GGX width; 0 for smooth sheets.
        pub alpha: f32,
        /// Albedo of the diffuse lobe, or the tint of a mirror or dielectric.
        pub diffuse: Vec3f,
        /// The diffuse lobe is scaled by `diffuse_scale − diffuse_falloff · (1 − cos(wo, h))⁵`.
        pub diffuse_scale: f32,
        /// See `diffuse_scale`.
        pub diffuse_falloff: f32,
        /// Colour of the specular lobe at normal incidence.
        pub specular: Vec3f,
        /// Added to `specular`, times `(1 − cos(wo, h))⁵`.
        pub specular_grazing: Vec3f,
        /// Probability of sampling the specular lobe, in `[0, 1]`.
        pub specular_probability: f32,
        /// Index of refraction of the far side over that of the side of `wo`.
        pub eta: f32,
        /// Multiplies both lobes of a rough dielectric to make up for light lost by single scattering; 1 for none.
        pub compensation: f32,
    }

    /// A sampled direction.
    #[derive(Clone, Copy, Debug)]
    pub struct BsdfSample {
        /// Unit direction in the shading frame.
        pub wi: Vec3f,
        /// BSDF value times |cos| over density; zero if nothing was sampled.
        pub weight: Vec3f,
        /// Density over solid angle of all lobes; 1 where `delta`.
        pub pdf: f32,
        /// Whether the direction comes from a delta lobe, which no light can be sampled for.
        pub delta: bool,
        /// Whether `wi` is on the other side of the surface.
        pub transmitted: bool,
    }

    /// Value and density for a pair of directions.
    #[derive(Clone, Copy, Debug)]
    pub struct BsdfValue {
        /// BSDF value times |cos| of `wi`, sr⁻¹.
        pub value_cos: Vec3f,
        /// Density over solid angle with which `bsdf_sample` chooses `wi`.
        pub pdf: f32,
    }

    /// What the lobes of a surface look like, for filters that treat the diffuse one apart.
    #[derive(Clone, Copy, Debug)]
    pub struct LobeColors {
        /// Albedo of the diffuse lobe; black if there is none.
        pub diffuse: Vec3f,
        /// Colour of the other lobes.
        pub specular: Vec3f,
        /// Perceptual roughness of these in `[0, 1]`.
        pub roughness: f32,
    }

    /// The sample of a path that ends here.
    pub fn no_sample() -> BsdfSample {
        BsdfSample {
            wi: vec3f(0.0, 0.0, 1.0),
            weight: vec3f(0.0, 0.0, 0.0),
            pdf: 0.0,
            delta: false,
            transmitted: false,
        }
    }

    /// A model that scatters nothing.
    pub fn black_bsdf() -> Bsdf {
        Bsdf {
            kind: BSDF_NONE,
            alpha: 1.0,
            diffuse: vec3f(0.0, 0.0, 0.0),
            diffuse_scale: 1.0,
            diffuse_falloff: 0.0,
            specular: vec3f(0.0, 0.0, 0.0),
            specular_grazing: vec3f(0.0, 0.0, 0.0),
            specular_probability: 0.0,
            eta: 1.0,
            compensation: 1.0,
        }
    }
}
