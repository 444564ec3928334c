//! The full principled surface of glTF: a coat over sheen over a base that mixes metal, plastic, glass and paper.
//!
//! Layers are put on each other by albedo scaling: what lies below a layer is dimmed by the share of light that the layer
//! scatters towards the viewer, which tables of directional albedo know. So no combination of layers reflects more light than
//! it gets. Like the energy compensation of `glossy.rs`, that looks at `wo` alone and is not reciprocal.
//!
//! This file prepares the lobes for a direction; `lobes.rs` evaluates and samples them.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod layered {
    use crate::anisotropic::*;
    use crate::frame::*;
    use crate::fresnel::*;
    use crate::ggx::*;
    use crate::iridescence::*;
    use crate::math::*;
    use crate::oren_nayar::*;
    use crate::sheen::*;
    use wgsl_rs::std::*;

    /// Parameters at one point, textures applied. Names and ranges are those of the glTF extensions.
    #[derive(Clone, Copy, Debug)]
    pub struct LayeredParameters {
        /// Linear base colour in `[0, 1]`.
        pub base_color: Vec3f,
        /// Metalness in `[0, 1]`.
        pub metallic: f32,
        /// Perceptual roughness of the base in `[0, 1]`.
        pub roughness: f32,
        /// Roughness of the base's diffuse reflection in `[0, 1]`; see `oren_nayar`.
        pub diffuse_roughness: f32,
        /// Strength of the dielectric's reflection in `[0, 1]`.
        pub specular: f32,
        /// Colour of the dielectric's reflection at normal incidence, ≥ 0.
        pub specular_color: Vec3f,
        /// Index of refraction, ≥ 1; 0 stands for a dielectric that reflects `specular_color`.
        pub ior: f32,
        /// Strength of the anisotropy in `[0, 1]`, along the frame's X.
        pub anisotropy: f32,
        /// Share of light that is refracted, in `[0, 1]`.
        pub transmission: f32,
        /// Share of the diffuse light that leaves on the other side, in `[0, 1]`.
        pub diffuse_transmission: f32,
        /// Colour of that light, in `[0, 1]`.
        pub diffuse_transmission_color: Vec3f,
        /// Colour of the fibres, in `[0, 1]`.
        pub sheen_color: Vec3f,
        /// Perceptual roughness of the sheen in `[0, 1]`.
        pub sheen_roughness: f32,
        /// Share of the surface that the coat covers, in `[0, 1]`.
        pub coat: f32,
        /// Perceptual roughness of the coat in `[0, 1]`.
        pub coat_roughness: f32,
        /// Unit normal of the coat in the shading frame.
        pub coat_normal: Vec3f,
        /// Share of the surface that a thin film covers, in `[0, 1]`.
        pub iridescence: f32,
        /// Index of refraction of the film, ≥ 1.
        pub film_ior: f32,
        /// Thickness of the film, nanometres.
        pub film_thickness: f32,
        /// Index of refraction of what is below the surface over that of what is above, as seen from `wo`.
        pub eta: f32,
        /// An infinitely thin wall: what is refracted goes straight on.
        pub thin: bool,
        /// Whether `wo` is inside of a body that light is refracted into: there are no layers on that side.
        pub inside: bool,
    }

    /// Directional albedos at the cosine of `wo`, from the tables that back ends look up.
    #[derive(Clone, Copy, Debug)]
    pub struct LayeredAlbedos {
        /// GGX reflection of the base's roughness, as `metallic_roughness_bsdf` takes it.
        pub base: Vec2f,
        /// GGX reflection of the coat's roughness, at the cosine with the coat's normal.
        pub coat: Vec2f,
        /// The sheen lobe of white fibres.
        pub sheen: f32,
        /// The rough dielectric interface as a whole; see `dielectric_compensation`. Not used if the wall is thin.
        pub whole_interface: f32,
    }

    /// The surface, prepared for one `wo`. Colours contain all factors that do not depend on `wi`.
    #[derive(Clone, Copy, Debug)]
    pub struct Layered {
        /// Albedo of the diffuse lobe above the surface.
        pub diffuse: Vec3f,
        /// How that lobe spreads its light.
        pub diffuse_lobe: RoughDiffuse,
        /// Albedo of the diffuse lobe below.
        pub diffuse_below: Vec3f,
        /// GGX widths of the base along X and Y.
        pub widths: Vec2f,
        /// Colour of the base's reflection at normal incidence.
        pub specular: Vec3f,
        /// Added to `specular`, times Schlick's weight.
        pub specular_grazing: Vec3f,
        /// Colour of refracted light, before Fresnel.
        pub refracted: Vec3f,
        /// Largest reflectance of the interface at normal incidence, for light that is refracted.
        pub refracted_f0: f32,
        /// The same at grazing angles.
        pub refracted_f90: f32,
        /// Relative index of refraction; 1 for walls without thickness.
        pub eta: f32,
        /// Colour of the sheen lobe.
        pub sheen: Vec3f,
        /// Width of the sheen's distribution.
        pub sheen_alpha: f32,
        /// Reflectance of the coat at normal incidence; see `coat_grazing`.
        pub coat: f32,
        /// Added to `coat`, times Schlick's weight.
        pub coat_grazing: f32,
        /// GGX width of the coat.
        pub coat_alpha: f32,
        /// Unit normal of the coat in the shading frame.
        pub coat_normal: Vec3f,
        /// Probabilities of sampling the lobes. They sum to 1, or are all 0 where nothing is scattered.
        pub p_diffuse: f32,
        /// See `p_diffuse`.
        pub p_diffuse_below: f32,
        /// See `p_diffuse`.
        pub p_specular: f32,
        /// See `p_diffuse`.
        pub p_refracted: f32,
        /// See `p_diffuse`.
        pub p_sheen: f32,
        /// See `p_diffuse`.
        pub p_coat: f32,
    }

    /// Reflectance of the coat at normal incidence: its index of refraction is 1.5.
    pub const COAT_F0: f32 = 0.04;

    /// Indices nearer to 1 than this bend nothing that could be seen, and half vectors of refraction become noise.
    pub const LEAST_BEND: f32 = 1e-3;

    /// Share of light that a GGX lobe loses between microfacets over the share that it keeps; see
    /// `metallic_roughness_bsdf`.
    pub fn lost_share(albedo: Vec2f, single_scatter: bool) -> f32 {
        let energy = max(albedo.x + albedo.y, 1e-4);
        select((1.0 - energy) / energy, 0.0, single_scatter)
    }

    /// The factor that makes up for what a rough interface loses between microfacets.
    ///
    /// Where the index hardly changes, the angle of total reflection lies between the table's planes, and the table may be
    /// 10 % too low. Little is lost there, so it is left lost, and nothing is gained.
    pub fn interface_compensation(albedo: f32, eta: f32) -> f32 {
        mix(1.0, dielectric_compensation(albedo), saturate(10.0 * abs(eta - 1.0) - 1.5))
    }

    /// Share of light that a single scattering event at a rough interface keeps, if the interface reflects `f0` to `f90`
    /// instead of what its index of refraction says: the table's albedo with other shares of its two lobes.
    ///
    /// - `eta`: greater than 1; from inside, total reflection counts for more than the difference.
    pub fn interface_albedo(e: LayeredAlbedos, eta: f32, f0: f32, f90: f32) -> f32 {
        if eta <= 1.0 {
            return e.whole_interface;
        }
        let reflection = max(e.base.x + e.base.y, 1e-4);
        let tabulated = saturate((f0_from_ior(eta) * e.base.x + e.base.y) / reflection);
        let actual = saturate((f0 * e.base.x + f90 * e.base.y) / reflection);
        let refraction = saturate((e.whole_interface - tabulated * reflection) / max(1.0 - tabulated, 0.05));
        // Seen at a grazing angle, the microfacets that reflect most are those that lose it. The difference above counts
        // that as lost by refraction: the less is reflected, the less of it is true.
        let not_reflected = saturate(1.0 - actual / max(tabulated, 1e-4));
        let kept = mix(refraction, 1.0, saturate(2.0 * tabulated) * not_reflected);
        mix(kept, reflection, actual)
    }

    /// Reflectance at normal incidence of the dielectric part of the base, and of a film on it.
    pub fn dielectric_f0(m: LayeredParameters, cos_theta: f32) -> Vec3f {
        let plain = m.specular_color * f0_from_ior(m.ior);
        let capped = vec3f(min(plain.x, 1.0), min(plain.y, 1.0), min(plain.z, 1.0)) * m.specular;
        film_f0(m, capped, cos_theta)
    }

    /// Reflectance at normal incidence of a base under the film, where there is one. The film's colour is that for `wo`,
    /// as in the Khronos sample viewer.
    pub fn film_f0(m: LayeredParameters, f0: Vec3f, cos_theta: f32) -> Vec3f {
        if m.iridescence <= 0.0 || m.inside {
            return f0;
        }
        let film = iridescent_fresnel(cos_theta, m.film_ior, m.film_thickness, f0);
        let under_film = vec3f(
            schlick_to_f0(film.x, cos_theta),
            schlick_to_f0(film.y, cos_theta),
            schlick_to_f0(film.z, cos_theta),
        );
        f0 + (under_film - f0) * m.iridescence
    }

    /// Prepares the surface for `wo`.
    ///
    /// - `wo`: unit vector in the shading frame, `wo.z > 0`. `e`: albedos at that direction.
    /// - `refraction_tint`: multiplies refracted light; see [`choose_dispersed`].
    /// - `single_scatter`: leave out what is scattered several times between microfacets.
    ///
    /// Source: glTF 2.0 Appendix B and the texts of the `KHR_materials_…` extensions.
    pub fn layered_bsdf(
        m: LayeredParameters,
        e: LayeredAlbedos,
        wo: Vec3f,
        refraction_tint: Vec3f,
        single_scatter: bool,
    ) -> Layered {
        let white = vec3f(1.0, 1.0, 1.0);
        let cos_o = saturate(wo.z);
        let bends = !m.thin && m.transmission > 0.0 && abs(m.eta - 1.0) >= LEAST_BEND;

        // What the layers above the base leave of the light.
        let coat = select(m.coat, 0.0, m.inside);
        let coat_scale = 1.0 + COAT_F0 * lost_share(e.coat, single_scatter);
        let coat_albedo = saturate(coat * coat_scale * (COAT_F0 * e.coat.x + e.coat.y));
        let sheen_color = m.sheen_color * select(1.0, 0.0, m.inside);
        let under_coat = 1.0 - coat_albedo;
        let under_sheen = under_coat * (1.0 - saturate(max_component(sheen_color) * min(e.sheen, 1.0)));

        // The base's reflection: a dielectric, of which a part may be glass, and a metal.
        let energy = e.base.x + e.base.y;
        let lost = lost_share(e.base, single_scatter);
        let f90 = select(mix(m.specular, 1.0, m.iridescence), 1.0, m.inside);
        let opaque_f0 = dielectric_f0(m, cos_o);
        // Both faces of a thin wall reflect.
        let sheet_f0 = vec3f(
            thin_sheet_reflectance(opaque_f0.x),
            thin_sheet_reflectance(opaque_f0.y),
            thin_sheet_reflectance(opaque_f0.z),
        );
        let glass_f0 = opaque_f0 + (sheet_f0 - opaque_f0) * select(0.0, 1.0, m.thin);
        let for_interface = select(
            sheet_compensation(e.base),
            interface_compensation(interface_albedo(e, m.eta, max_component(glass_f0), f90), m.eta),
            bends,
        );
        let compensation = select(for_interface, 1.0, single_scatter);
        let opaque_scale = white + opaque_f0 * lost;
        let metal_f0 = film_f0(m, m.base_color, cos_o);
        let metal_scale = (white + metal_f0 * lost) * m.metallic;
        let dielectric = 1.0 - m.metallic;
        let opaque = dielectric * (1.0 - m.transmission);
        // From inside, total reflection is the glass's alone: what is not glass only scatters.
        let opaque_gloss = select(opaque, 0.0, m.inside);
        let glass = dielectric * m.transmission;

        let mut b = no_layers();
        b.widths = anisotropic_widths(m.roughness, m.anisotropy);
        b.specular = (opaque_f0 * opaque_scale * opaque_gloss
            + glass_f0 * (glass * compensation)
            + metal_f0 * metal_scale)
            * under_sheen;
        b.specular_grazing = ((white * f90 - opaque_f0) * opaque_scale * opaque_gloss
            + (white * f90 - glass_f0) * (glass * compensation)
            + (white - metal_f0) * metal_scale)
            * under_sheen;

        // What the reflection leaves. Its largest channel decides, so that colours of highlights do not tint the rest.
        let opaque_albedo = (opaque_f0 * e.base.x + white * (f90 * e.base.y)) * opaque_scale;
        let reflected = select(max_component(opaque_albedo), 0.0, m.inside);
        let left = opaque * under_sheen * (1.0 - saturate(reflected));
        let left_above = left * (1.0 - m.diffuse_transmission);
        b.diffuse = eon_albedo(m.base_color, m.diffuse_roughness, cos_o) * left_above;
        b.diffuse_lobe =
            scaled_rough_diffuse(rough_diffuse(m.base_color, m.diffuse_roughness, cos_o), left_above);
        b.diffuse_below = m.diffuse_transmission_color * (left * m.diffuse_transmission);
        b.refracted = m.base_color * refraction_tint * (glass * compensation * under_sheen);
        b.refracted_f0 = max_component(glass_f0);
        b.refracted_f90 = f90;
        b.eta = select(1.0, m.eta, bends);

        b.sheen = sheen_color * (under_coat / max(e.sheen, 1.0));
        b.sheen_alpha = sheen_alpha(m.sheen_roughness);
        b.coat = COAT_F0 * coat * coat_scale;
        b.coat_grazing = (1.0 - COAT_F0) * coat * coat_scale;
        b.coat_alpha = max(m.coat_roughness * m.coat_roughness, MIN_ALPHA);
        b.coat_normal = m.coat_normal;

        // Lobes are chosen by what they scatter towards `wo`.
        // Microfacets lean both ways: near the angle of total reflection some reflect all light and some do not.
        let lean = max(b.widths.x, b.widths.y);
        let towards = refraction_schlick(cos_o + lean, b.eta);
        let away = refraction_schlick(max(cos_o - lean, 0.0), b.eta);
        let schlick = (refraction_schlick(cos_o, b.eta) + towards + away) * (1.0 / 3.0);
        let passing = 1.0 - mix(b.refracted_f0, f90, schlick);
        let diffuse = mean_component(b.diffuse);
        let below = mean_component(b.diffuse_below);
        // Grain is wider than the table's lobe, and reaches grazing angles that this does not. The table knows nothing of
        // total reflection, which paths inside of glass meet again and again.
        let grazing = max(max(e.base.y, 0.01), energy * schlick);
        let specular = mean_component(b.specular * energy + b.specular_grazing * grazing);
        let sheen = mean_component(b.sheen) * e.sheen;
        // Beyond the angle of total reflection, microfacets that face elsewhere still let light through.
        let refracted = mean_component(b.refracted) * max(passing, 0.05);
        let sum = diffuse + below + specular + refracted + sheen + coat_albedo;
        let scale = select(0.0, 1.0 / max(sum, 1e-30), sum > 1e-20);
        b.p_diffuse = diffuse * scale;
        b.p_diffuse_below = below * scale;
        b.p_specular = specular * scale;
        b.p_refracted = refracted * scale;
        b.p_sheen = sheen * scale;
        b.p_coat = coat_albedo * scale;
        b
    }

    /// The colour of the surface, which is to layers what base colour is to other materials: that of the base and of light
    /// that shines through it, under fibres. Coats and films have no colour of their own.
    ///
    /// - `sheen_albedo`: see [`LayeredAlbedos`].
    pub fn layered_color(m: LayeredParameters, sheen_albedo: f32) -> Vec3f {
        let through = (1.0 - m.metallic) * (1.0 - m.transmission) * m.diffuse_transmission;
        let base = m.base_color + (m.diffuse_transmission_color - m.base_color) * through;
        let fibres = m.sheen_color * select(min(sheen_albedo, 1.0), 0.0, m.inside);
        base * (1.0 - saturate(max_component(fibres))) + fibres
    }

    /// A surface that scatters nothing.
    pub fn no_layers() -> Layered {
        let black = vec3f(0.0, 0.0, 0.0);
        Layered {
            diffuse: black,
            diffuse_lobe: RoughDiffuse { roughness: 0.0, single: black, multiple: black },
            diffuse_below: black,
            widths: vec2f(1.0, 1.0),
            specular: black,
            specular_grazing: black,
            refracted: black,
            refracted_f0: 0.0,
            refracted_f90: 1.0,
            eta: 1.0,
            sheen: black,
            sheen_alpha: 1.0,
            coat: 0.0,
            coat_grazing: 0.0,
            coat_alpha: 1.0,
            coat_normal: vec3f(0.0, 0.0, 1.0),
            p_diffuse: 0.0,
            p_diffuse_below: 0.0,
            p_specular: 0.0,
            p_refracted: 0.0,
            p_sheen: 0.0,
            p_coat: 0.0,
        }
    }

    /// Schlick's weight of an interface: taken on the less dense side, and 1 where all light is reflected.
    pub fn refraction_schlick(cos_theta: f32, eta: f32) -> f32 {
        if eta >= 1.0 {
            return schlick_weight(cos_theta);
        }
        schlick_weight(fresnel_dielectric(saturate(cos_theta), eta).cos_transmitted)
    }

    /// The frame whose X is the direction of anisotropy, before it is made orthogonal to the normal.
    ///
    /// - `f`: along tangent and bitangent. `rotation`: cosine and sine of the angle from the tangent.
    /// - `texel`: RG in `[0, 1]` as stored, a direction about 0.5; (1, 0.5) where there is no texture.
    pub fn anisotropy_axis(f: Frame, rotation: Vec2f, texel: Vec2f) -> Vec3f {
        let x = 2.0 * texel.x - 1.0;
        let y = 2.0 * texel.y - 1.0;
        let along = x * rotation.x - y * rotation.y;
        let across = x * rotation.y + y * rotation.x;
        f.tangent * along + f.bitangent * across
    }

    /// Which colour a path refracts as, where the index of refraction depends on it.
    #[derive(Clone, Copy, Debug)]
    pub struct Dispersed {
        /// Index of refraction for the colour.
        pub ior: f32,
        /// Multiplies refracted light: the chosen channel over the probability of the choice.
        pub tint: Vec3f,
    }

    /// Chooses one of three channels by what is left of them in the path, each with its own index of refraction.
    ///
    /// - `dispersion`: 20 / Abbe number; 0 for none, when all channels go on together. `ior`: of green, ≥ 1.
    /// - `throughput`: of the path. `u`: uniform number in `[0, 1)`.
    ///
    /// Source: `KHR_materials_dispersion`.
    pub fn choose_dispersed(dispersion: f32, ior: f32, throughput: Vec3f, u: f32) -> Dispersed {
        let sum = throughput.x + throughput.y + throughput.z;
        if dispersion <= 0.0 || sum <= 0.0 || !is_finite(sum) {
            return Dispersed { ior: ior, tint: vec3f(1.0, 1.0, 1.0) };
        }
        let half_spread = (ior - 1.0) * 0.025 * dispersion;
        let p = throughput * (1.0 / sum);
        if u < p.x {
            return Dispersed { ior: max(ior - half_spread, 1.0), tint: vec3f(1.0 / p.x, 0.0, 0.0) };
        }
        if u < p.x + p.y || p.z <= 0.0 {
            return Dispersed { ior: ior, tint: vec3f(0.0, 1.0 / max(p.y, 1e-6), 0.0) };
        }
        Dispersed { ior: ior + half_spread, tint: vec3f(0.0, 0.0, 1.0 / p.z) }
    }
}
