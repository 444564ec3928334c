//! What scatters at a surface, whatever its material is: one model of `bsdf`, or the layers of `layered`.
//!
//! Back ends that know a surface to be without layers, or a scene, ask the functions of `bsdf` instead, which have the
//! same names but for the first word. All directions are in the closure's frame.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod closure {
    use crate::bsdf::*;
    use crate::frame::*;
    use crate::layered::*;
    use crate::lobes::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    /// A surface, prepared for one `wo`.
    #[derive(Clone, Copy, Debug)]
    pub struct Closure {
        /// Whether `layers` scatter, and not `plain`.
        pub layered: bool,
        /// A single model.
        pub plain: Bsdf,
        /// Layers.
        pub layers: Layered,
        /// The shading frame. With layers its X is the direction of anisotropy.
        pub frame: Frame,
    }

    /// A surface without layers, with shading normal `normal`.
    pub fn plain_closure(b: Bsdf, normal: Vec3f) -> Closure {
        Closure { layered: false, plain: b, layers: no_layers(), frame: frame_from_normal(normal) }
    }

    /// A surface with layers.
    pub fn layered_closure(b: Layered, frame: Frame) -> Closure {
        Closure { layered: true, plain: black_bsdf(), layers: b, frame: frame }
    }

    /// See [`bsdf_scatters`].
    pub fn closure_scatters(c: Closure) -> bool {
        c.layered || bsdf_scatters(c.plain)
    }

    /// See [`bsdf_has_smooth_part`].
    pub fn closure_has_smooth_part(c: Closure) -> bool {
        c.layered || bsdf_has_smooth_part(c.plain)
    }

    /// See [`bsdf_has_lobes`].
    pub fn closure_has_lobes(c: Closure) -> bool {
        c.layered || bsdf_has_lobes(c.plain)
    }

    /// See [`bsdf_is_delta`].
    pub fn closure_is_delta(c: Closure) -> bool {
        !c.layered && bsdf_is_delta(c.plain)
    }

    /// See [`bsdf_is_sharp`].
    pub fn closure_is_sharp(c: Closure) -> bool {
        if c.layered {
            return layered_is_sharp(c.layers);
        }
        bsdf_is_sharp(c.plain)
    }

    /// See [`bsdf_transmits`].
    pub fn closure_transmits(c: Closure) -> bool {
        select(bsdf_transmits(c.plain), layered_transmits(c.layers), c.layered)
    }

    /// Index of refraction of the far side over that of the near one.
    pub fn closure_eta(c: Closure) -> f32 {
        select(c.plain.eta, c.layers.eta, c.layered)
    }

    /// See [`bsdf_eval`].
    pub fn closure_eval(c: Closure, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        if c.layered {
            return layered_eval(c.layers, wo, wi);
        }
        bsdf_eval(c.plain, wo, wi)
    }

    /// See [`bsdf_sample`].
    pub fn closure_sample(c: Closure, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        if c.layered {
            return layered_sample(c.layers, wo, u_lobe, u);
        }
        bsdf_sample(c.plain, wo, u_lobe, u)
    }

    /// See [`bsdf_diffuse_albedo`].
    pub fn closure_diffuse_albedo(c: Closure) -> Vec3f {
        if c.layered {
            return c.layers.diffuse;
        }
        bsdf_diffuse_albedo(c.plain)
    }

    /// Albedo of the diffuse lobe on the far side of the surface.
    pub fn closure_diffuse_albedo_below(c: Closure) -> Vec3f {
        // Without layers there is none, and `no_layers` says so.
        c.layers.diffuse_below
    }

    /// See [`LobeColors`]. What coats, sheen and refraction add has no colour of one texture.
    pub fn closure_lobe_colors(c: Closure) -> LobeColors {
        if c.layered {
            let widths = c.layers.widths;
            return LobeColors {
                diffuse: c.layers.diffuse + c.layers.diffuse_below,
                specular: vec3f(1.0, 1.0, 1.0),
                roughness: sqrt(max(widths.x, widths.y)),
            };
        }
        bsdf_lobe_colors(c.plain)
    }

    /// See [`bsdf_without_diffuse`].
    pub fn closure_without_diffuse(c: Closure) -> Closure {
        let mut others = c;
        if c.layered {
            others.layers = layered_without_diffuse(c.layers);
        } else {
            others.plain = bsdf_without_diffuse(c.plain);
        }
        others
    }

    /// See [`bsdf_reflects`].
    pub fn closure_reflects(c: Closure) -> bool {
        select(bsdf_reflects(c.plain), layered_reflects(c.layers), c.layered)
    }

    /// See [`bsdf_is_interface`].
    pub fn closure_is_interface(c: Closure) -> bool {
        select(bsdf_is_interface(c.plain), c.layers.p_refracted > 0.0, c.layered)
    }

    /// See [`bsdf_reflected_share`].
    pub fn closure_reflected_share(c: Closure, cos_o: f32) -> f32 {
        if c.layered {
            return layered_reflected_share(c.layers);
        }
        bsdf_reflected_share(c.plain, cos_o)
    }

    /// See [`bsdf_phong_eval`]. Layers have no such highlights and stay as they are.
    pub fn closure_phong_eval(c: Closure, wo: Vec3f, wi: Vec3f) -> Vec3f {
        if c.layered {
            return layered_eval(c.layers, wo, wi).value_cos;
        }
        bsdf_phong_eval(c.plain, wo, wi)
    }
}
