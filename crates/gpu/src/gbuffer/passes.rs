//! The passes that find first hits: their texts and what they bind.

use super::items::DrawClass;
use crate::bindings::PassBinding::{self, Read, Texture, Uniform, Write};
use crate::film::{TALLY, VIEW};
use crate::pass::{self as compute, PassSpec};
use crate::shader::constants::numbers;
use crate::shader::{Linkage, Variant};
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};

/// What a pixel of the identifications holds: item and primitive.
pub const ID_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Reversed depth needs floating point.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A pass of compute shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GBufferPass {
    /// Finds the items that the camera may see.
    Cull,
    /// From what was drawn to hits.
    Resolve,
    /// First hits by rays instead.
    CameraRays,
}

/// Numbers of group 3's bindings, as the shaders have them: the G-buffer's, and those that the hybrid renderer adds.
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

impl GBufferPass {
    /// All of them; a pass' place is its number.
    pub const ALL: [Self; 3] = [Self::Cull, Self::Resolve, Self::CameraRays];

    /// What it is. With these bindings, no pass binds more storage buffers than a megakernel does.
    pub const fn spec(self) -> PassSpec {
        let spec = match self {
            Self::Cull => PassSpec {
                own: &[Uniform(FRAME), Read(ITEMS), Read(PARTS), Write(SEEN_ITEMS), Write(DRAWS)],
                ..PassSpec::of_scene("hybrid_cull", "cull")
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
        };
        // All see the view.
        if spec.film.is_empty() { PassSpec { film: &[VIEW], ..spec } } else { spec }
    }
}

/// What the rasteriser binds of group 3.
pub const RASTER_BINDINGS: &[PassBinding] = &[Uniform(FRAME), Read(ITEMS), Read(PARTS), Read(SEEN_ITEMS)];

/// What all modules of the G-buffer and of the hybrid renderer are linked with but the tracer.
pub(crate) fn linkage(variant: Variant) -> Linkage {
    Linkage::of(variant)
        .bind("first_hits", "first_hits_ignored")
        .generate("draw_classes", numbers([("DRAW_CLASSES", DrawClass::ALL.len() as u32)]))
}

/// A pass for a scene and a tracer, not compiled yet.
///
/// # Errors
/// When the device cannot bind what it needs.
pub(super) fn frame_pass(
    gpu: &Gpu,
    pass: GBufferPass,
    variant: Variant,
    scene: &GpuScene,
    tracer: &dyn Tracer,
) -> Result<compute::Pass, GpuError> {
    // Whoever finishes the frame records first hits: the others need not be compiled twice.
    let variant = Variant { aovs: false, ..variant };
    let linkage = linkage(variant).with(&tracer.linkage());
    compute::Pass::new(gpu, "hybrid", pass.spec(), &linkage, Some(scene), Some(tracer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::check::{check_pass, validate};
    use crate::tracer::query;

    #[test]
    fn passes_bind_what_they_use() {
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
            for pass in GBufferPass::ALL {
                let linkage = linkage(variant).with(&query::linkage());
                check_pass(&pass.spec(), &linkage, &format!("{variant:?}"));
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
        assert!(GBufferPass::ALL.into_iter().enumerate().all(|(i, pass)| pass as usize == i));
        assert!(DrawClass::ALL.into_iter().enumerate().all(|(i, class)| class as usize == i));
    }
}
