//! What every scattering model answers, and the dispatch between models.
//!
//! Adding a model: one `BSDF_…` constant and the arms below, a file with its functions beside this one, an entry in the
//! list of `tests/bsdf.rs`, which then checks its energy, density and reciprocity.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod bsdf {
    use crate::dielectric::*;
    use crate::glossy::*;
    use crate::math::*;
    use crate::phong::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    /// Samples a direction for the light that is scattered towards `wo`.
    ///
    /// - `wo`: unit vector in the shading frame, `wo.z > 0`.
    /// - `u_lobe`: uniform number that chooses between lobes; `u`: two more for the direction.
    pub fn bsdf_sample(b: Bsdf, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        if b.kind == BSDF_GLOSSY {
            return glossy_sample(b, wo, u_lobe, u);
        }
        if b.kind == BSDF_SMOOTH_DIELECTRIC {
            return smooth_dielectric_sample(b, wo, u_lobe);
        }
        if b.kind == BSDF_ROUGH_DIELECTRIC {
            return rough_dielectric_sample(b, wo, u_lobe, u);
        }
        if b.kind == BSDF_THIN_DIELECTRIC {
            return thin_dielectric_sample(b, wo, u_lobe, u);
        }
        if b.kind == BSDF_MIRROR {
            return BsdfSample {
                wi: vec3f(-wo.x, -wo.y, wo.z),
                weight: b.diffuse,
                pdf: 1.0,
                delta: true,
                transmitted: false,
            };
        }
        no_sample()
    }

    /// Value times cosine and density of the non-delta part, for `wi` on either side of the surface.
    pub fn bsdf_eval(b: Bsdf, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        if b.kind == BSDF_GLOSSY {
            return glossy_eval(b, wo, wi);
        }
        if b.kind == BSDF_ROUGH_DIELECTRIC {
            return rough_dielectric_eval(b, wo, wi);
        }
        if b.kind == BSDF_THIN_DIELECTRIC {
            return thin_dielectric_eval(b, wo, wi);
        }
        BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 }
    }

    /// Whether anything is scattered at all.
    pub fn bsdf_scatters(b: Bsdf) -> bool {
        b.kind != BSDF_NONE
    }

    /// Whether the model has a part that [`bsdf_eval`] sees, so that sampling lights is worth a shadow ray.
    pub fn bsdf_has_smooth_part(b: Bsdf) -> bool {
        b.kind == BSDF_GLOSSY
            || b.kind == BSDF_ROUGH_DIELECTRIC
            || (b.kind == BSDF_THIN_DIELECTRIC && b.alpha > 0.0)
    }

    /// Whether [`bsdf_sample`] chooses between lobes, so that `u_lobe` matters.
    pub fn bsdf_has_lobes(b: Bsdf) -> bool {
        b.kind != BSDF_GLOSSY || b.specular_probability > 0.0
    }

    /// Whether all directions that [`bsdf_sample`] can choose are known, so that `u` does not matter.
    pub fn bsdf_is_delta(b: Bsdf) -> bool {
        b.kind == BSDF_SMOOTH_DIELECTRIC
            || b.kind == BSDF_MIRROR
            || (b.kind == BSDF_THIN_DIELECTRIC && b.alpha <= 0.0)
    }

    /// Whether all that is seen of the surface is a sharp picture of other things, in mirrors or through glass: see
    /// [`SHARP_WIDTH`].
    pub fn bsdf_is_sharp(b: Bsdf) -> bool {
        let narrow = b.alpha <= SHARP_WIDTH && max_component(b.diffuse) <= 0.0;
        select(
            bsdf_is_delta(b) || (bsdf_transmits(b) && b.alpha <= SHARP_WIDTH),
            narrow && b.specular_probability > 0.0,
            b.kind == BSDF_GLOSSY,
        )
    }

    /// Whether light can arrive from below the surface.
    pub fn bsdf_transmits(b: Bsdf) -> bool {
        b.kind == BSDF_SMOOTH_DIELECTRIC || b.kind == BSDF_ROUGH_DIELECTRIC || b.kind == BSDF_THIN_DIELECTRIC
    }

    // What the lobes are, for renderers that treat diffuse light apart from the rest.

    /// Albedo of the diffuse lobe towards the viewer's side; black if there is none.
    pub fn bsdf_diffuse_albedo(b: Bsdf) -> Vec3f {
        select(vec3f(0.0, 0.0, 0.0), b.diffuse * b.diffuse_scale, b.kind == BSDF_GLOSSY)
    }

    /// See [`LobeColors`].
    pub fn bsdf_lobe_colors(b: Bsdf) -> LobeColors {
        let glossy = b.kind == BSDF_GLOSSY;
        // Of mirrors and dielectrics, `diffuse` is the tint.
        LobeColors {
            diffuse: bsdf_diffuse_albedo(b),
            specular: select(b.diffuse, b.specular, glossy),
            roughness: select(sqrt(b.alpha), 0.0, bsdf_is_delta(b)),
        }
    }

    /// All lobes but the diffuse ones: values of the others stay as they are, and one of them is sampled always.
    pub fn bsdf_without_diffuse(b: Bsdf) -> Bsdf {
        let mut others = b;
        if b.kind == BSDF_GLOSSY {
            others.diffuse = vec3f(0.0, 0.0, 0.0);
            others.specular_probability = 1.0;
        }
        others
    }

    /// Whether there are lobes that are not diffuse.
    pub fn bsdf_reflects(b: Bsdf) -> bool {
        b.kind != BSDF_GLOSSY || b.specular_probability > 0.0
    }

    /// Whether the surface is a mirror or lets light through to where it is refracted, so that what is seen in it is a
    /// picture of its own, and not only a gloss.
    pub fn bsdf_is_interface(b: Bsdf) -> bool {
        b.kind != BSDF_GLOSSY && b.kind != BSDF_NONE
    }

    /// About which share of light the lobes scatter that are not diffuse, in `[0, 1]`. `cos_o`: cosine of `wo`.
    pub fn bsdf_reflected_share(b: Bsdf, cos_o: f32) -> f32 {
        if b.kind != BSDF_GLOSSY {
            return 1.0;
        }
        saturate(max_component(glossy_reflectance(b, cos_o)))
    }

    /// Value times cosine of the non-delta part with Phong's highlights instead of microfacets, where there are glossy
    /// surfaces.
    pub fn bsdf_phong_eval(b: Bsdf, wo: Vec3f, wi: Vec3f) -> Vec3f {
        if b.kind == BSDF_GLOSSY {
            return phong_eval(b, wo, wi);
        }
        bsdf_eval(b, wo, wi).value_cos
    }
}
