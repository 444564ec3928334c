//! The passes of a frame: their texts and what they bind.

use super::items::DrawClass;
use crate::bindings::PassBinding::{self, Read, Texture, Uniform, Write};
use crate::film::{AOVS, FILM, TALLY, VIEW};
use crate::pass::PassSpec;
use crate::shader::constants::numbers;
use crate::shader::{Linkage, Variant};

/// What a pixel of the identifications holds: item and primitive.
pub const ID_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Reversed depth needs floating point.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A pass of compute shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Finds the items that the camera may see.
    Cull,
    /// Finds the lights that matter to each cluster.
    ClusterLights,
    /// From what was drawn to hits.
    Resolve,
    /// First hits by rays instead.
    CameraRays,
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

/// Numbers of group 3's bindings, as the shaders have them.
pub(crate) mod slots {
    /// The frame's uniform.
    pub const FRAME: u32 = 0;
    /// Items.
    pub const ITEMS: u32 = 1;
    /// Parts.
    pub const PARTS: u32 = 2;
    /// Items that the camera may see.
    pub const SEEN_ITEMS: u32 = 3;
    /// Sizes of the draws.
    pub const DRAWS: u32 = 4;
    /// Which lights matter to which cluster, and which of them are hidden from each pixel's first surface.
    pub const LIGHT_MASKS: u32 = 5;
    /// A record for each pixel.
    pub const PIXELS: u32 = 6;
    /// The instances of the frame before.
    pub const PREVIOUS_INSTANCES: u32 = 7;
    /// What was drawn.
    pub const IDS: u32 = 8;
    /// The pixels that send out reflection rays.
    pub const REFLECTING: u32 = 9;
    /// How many rays were traced for each pixel.
    pub const RAY_COUNTS: u32 = 10;
}

use slots::*;

impl Pass {
    /// All of them; a pass' place is its number.
    pub const ALL: [Self; 13] = [
        Self::Cull,
        Self::ClusterLights,
        Self::Resolve,
        Self::CameraRays,
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
            Self::Cull => PassSpec {
                own: &[Uniform(FRAME), Read(ITEMS), Read(PARTS), Write(SEEN_ITEMS), Write(DRAWS)],
                ..PassSpec::of_scene("hybrid_cull", "cull")
            },
            Self::ClusterLights => PassSpec {
                name: "cluster lights",
                own: &[Uniform(FRAME), Write(LIGHT_MASKS)],
                ..PassSpec::of_scene("hybrid_cull", "cluster_lights")
            },
            Self::Resolve => PassSpec {
                own: &[
                    Uniform(FRAME),
                    Read(ITEMS),
                    Read(PARTS),
                    Write(PIXELS),
                    Read(PREVIOUS_INSTANCES),
                    Texture(IDS),
                ],
                ..PassSpec::of_scene("hybrid_resolve", "resolve")
            },
            Self::CameraRays => PassSpec {
                name: "camera rays",
                film: &[VIEW, TALLY],
                own: &[Uniform(FRAME), Write(PIXELS), Read(PREVIOUS_INSTANCES)],
                ..PassSpec::tracing("hybrid_camera", "camera_rays")
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

/// What the rasteriser binds of group 3.
pub const RASTER_BINDINGS: &[PassBinding] = &[Uniform(FRAME), Read(ITEMS), Read(PARTS), Read(SEEN_ITEMS)];

/// What all modules of the hybrid renderer are linked with but the tracer.
pub(crate) fn linkage(variant: Variant) -> Linkage {
    Linkage::of(variant)
        .bind("first_hits", "first_hits_ignored")
        .generate("draw_classes", numbers([("DRAW_CLASSES", DrawClass::ALL.len() as u32)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hybrid::shafts;
    use crate::shader::check::{check_pass, validate};
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
            let without = Pass::ALL.into_iter().filter(|p| !p.makes_shafts()).map(|pass| (pass, None));
            let with = Pass::ALL.into_iter().filter(|p| p.uses_shafts()).map(|pass| (pass, Some(&shafts)));
            for (pass, shafts) in without.chain(with) {
                let linkage = pass.linkage(&query::linkage(), shafts, variant);
                let with = format!("{variant:?}, with shafts: {}", shafts.is_some());
                check_pass(&pass.spec(), &linkage, &with);
            }
        }
    }

    #[test]
    fn the_rasteriser_is_valid_and_binds_what_it_uses() {
        for variant in [Variant::default(), Variant { alpha: true, images: 16, ..Variant::default() }] {
            let (module, _) = validate("raster", &linkage(variant).text("hybrid_raster").expect("linked"));
            let mut own: Vec<u32> = module
                .global_variables
                .iter()
                .filter_map(|(_, v)| v.binding.filter(|b| b.group == 3).map(|b| b.binding))
                .collect();
            own.sort_unstable();
            assert_eq!(own, RASTER_BINDINGS.iter().map(|b| b.number()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn passes_are_where_their_numbers_say() {
        assert!(Pass::ALL.into_iter().enumerate().all(|(i, pass)| pass as usize == i));
        assert!(DrawClass::ALL.into_iter().enumerate().all(|(i, class)| class as usize == i));
    }
}
