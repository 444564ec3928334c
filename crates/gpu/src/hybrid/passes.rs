//! The passes of a frame from the first hits on: their texts and what they bind.

use super::shafts::Shafts;
use crate::bindings::PassBinding::{self, Uniform, Write};
use crate::film::{AOVS, FILM, TALLY, VIEW};
use crate::gbuffer::linkage;
use crate::gbuffer::slots::{FRAME, LIGHT_MASKS, PIXELS, RAY_COUNTS, REFLECTING};
use crate::pass::{self as compute, PassSpec};
use crate::shader::{Linkage, Variant};
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};

/// A pass of compute shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HybridPass {
    /// Finds the lights that matter to each cluster.
    ClusterLights,
    /// Where the shadow rays of each tile of pixels begin.
    TileBounds,
    /// Where in the hierarchy they have to begin their walk.
    Shafts,
    /// Which lights are hidden from the first surface.
    ShadowRays,
    /// Emission, the sky, and direct light from lights of which it is known whether they are hidden.
    LitSurfaces,
    /// The two before in one, for more lights than there is memory for.
    DirectLights,
    /// The environment's light on the first surface.
    AmbientOcclusion,
    /// Lists the pixels that send out reflection rays.
    ListReflecting,
    /// What the first surface reflects and lets through.
    Reflections,
    /// Adds the frame to the film.
    Compose,
}

impl HybridPass {
    /// All of them; a pass' place is its number.
    pub const ALL: [Self; 10] = [
        Self::ClusterLights,
        Self::TileBounds,
        Self::Shafts,
        Self::ShadowRays,
        Self::LitSurfaces,
        Self::DirectLights,
        Self::AmbientOcclusion,
        Self::ListReflecting,
        Self::Reflections,
        Self::Compose,
    ];

    /// What it is. With these bindings, no pass binds more storage buffers than a megakernel does.
    pub const fn spec(self) -> PassSpec {
        const PER_LIGHT: &[PassBinding] =
            &[Uniform(FRAME), Write(LIGHT_MASKS), Write(PIXELS), Write(RAY_COUNTS)];
        let spec = match self {
            Self::ClusterLights => PassSpec {
                name: "cluster lights",
                own: &[Uniform(FRAME), Write(LIGHT_MASKS)],
                ..PassSpec::of_scene("hybrid_cull", "cluster_lights")
            },
            Self::TileBounds => PassSpec {
                name: "tile bounds",
                own: &[Uniform(FRAME), Write(LIGHT_MASKS), Write(PIXELS)],
                ..PassSpec::of_scene("hybrid_shafts", "tile_bounds")
            },
            Self::Shafts => PassSpec {
                own: &[Uniform(FRAME), Write(LIGHT_MASKS)],
                ..PassSpec::tracing("hybrid_shafts", "shafts")
            },
            Self::ShadowRays => PassSpec {
                name: "shadow rays",
                own: PER_LIGHT,
                ..PassSpec::tracing("hybrid_lights", "shadow_rays")
            },
            Self::LitSurfaces => PassSpec {
                name: "lit surfaces",
                own: PER_LIGHT,
                ..PassSpec::of_scene("hybrid_lights", "lit_surfaces")
            },
            Self::DirectLights => PassSpec {
                name: "direct lights",
                own: PER_LIGHT,
                ..PassSpec::tracing("hybrid_lights", "direct_lights")
            },
            Self::AmbientOcclusion => PassSpec {
                name: "ambient occlusion",
                own: &[Uniform(FRAME), Write(PIXELS), Write(RAY_COUNTS)],
                ..PassSpec::tracing("hybrid_tracing", "ambient_occlusion")
            },
            Self::ListReflecting => PassSpec {
                name: "list reflecting",
                own: &[Write(PIXELS), Write(REFLECTING)],
                ..PassSpec::of_scene("hybrid_listing", "list_reflecting")
            },
            Self::Reflections => PassSpec {
                own: &[Uniform(FRAME), Write(PIXELS), Write(REFLECTING), Write(RAY_COUNTS)],
                ..PassSpec::tracing("hybrid_tracing", "reflections")
            },
            Self::Compose => PassSpec {
                film: &[VIEW, FILM, TALLY, AOVS],
                own: &[Uniform(FRAME), Write(PIXELS), Write(RAY_COUNTS)],
                ..PassSpec::of_scene("hybrid_compose", "compose")
            },
        };
        // All see the view.
        if spec.film.is_empty() { PassSpec { film: &[VIEW], ..spec } } else { spec }
    }

    /// Whether it is there for shafts alone.
    fn makes_shafts(self) -> bool {
        matches!(self, Self::TileBounds | Self::Shafts)
    }

    /// Whether it knows of shafts, where there are any.
    fn uses_shafts(self) -> bool {
        self.makes_shafts() || self == Self::ShadowRays
    }

    /// What its module is linked with. `shafts`: what those bring, if there are any.
    pub fn linkage(self, tracer: &Linkage, shafts: Option<&Linkage>, variant: Variant) -> Linkage {
        linkage(variant).with(shafts.filter(|_| self.uses_shafts()).unwrap_or(tracer))
    }
}

/// A pass for a scene and a tracer, with shafts or without, not compiled yet.
///
/// # Errors
/// When the device cannot bind what it needs.
pub(super) fn frame_pass(
    gpu: &Gpu,
    pass: HybridPass,
    variant: Variant,
    scene: &GpuScene,
    tracer: &dyn Tracer,
    shafts: Option<&Shafts>,
) -> Result<compute::Pass, GpuError> {
    // Whoever finishes the frame records first hits: the others need not be compiled twice.
    let variant = Variant { aovs: variant.aovs && pass == HybridPass::Compose, ..variant };
    let linkage = pass.linkage(&tracer.linkage(), shafts.map(|shafts| &shafts.linkage), variant);
    compute::Pass::new(gpu, "hybrid", pass.spec(), &linkage, Some(scene), Some(tracer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hybrid::shafts;
    use crate::shader::check::check_pass;
    use crate::tracer::{bvh, query};
    use scene::tables::SceneTables;

    #[test]
    fn passes_bind_what_they_use() {
        let scene = SceneTables::build(&testkit::scenes::assortment());
        let below = bvh::linkage_below_for(&bvh::encode(&scene, accel::Quality::Fast), 1 << 27);
        let shafts = shafts::linkage(&below);
        for variant in [
            Variant::default(),
            Variant {
                alpha: true,
                aovs: true,
                images: 16,
                layers: true,
                absorption: true,
                ..Variant::default()
            },
        ] {
            let without = HybridPass::ALL.into_iter().filter(|p| !p.makes_shafts()).map(|pass| (pass, None));
            let with =
                HybridPass::ALL.into_iter().filter(|p| p.uses_shafts()).map(|pass| (pass, Some(&shafts)));
            for (pass, shafts) in without.chain(with) {
                let linkage = pass.linkage(&query::linkage(), shafts, variant);
                let with = format!("{variant:?}, with shafts: {}", shafts.is_some());
                check_pass(&pass.spec(), &linkage, &with);
            }
        }
    }

    #[test]
    fn passes_are_where_their_numbers_say() {
        assert!(HybridPass::ALL.into_iter().enumerate().all(|(i, pass)| pass as usize == i));
    }
}
