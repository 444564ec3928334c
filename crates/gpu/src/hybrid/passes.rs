//! The passes of a frame: their texts and what they bind.

use super::items::DrawClass;
use super::shafts;
use crate::Gpu;
use crate::bindings::{buffer, entry};
use crate::shader::{Variant, scene_text};
use crate::tracer::TracerText;
use wgpu::{BindingType, BufferBindingType, ShaderStages};

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

/// Bindings of group 3, by number, as the shaders name them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The frame's uniform.
    Frame = 0,
    /// Items.
    Items = 1,
    /// Parts.
    Parts = 2,
    /// Items that the camera may see.
    SeenItems = 3,
    /// Sizes of the draws.
    Draws = 4,
    /// Which lights matter to which cluster, and which of them are hidden from each pixel's first surface.
    LightMasks = 5,
    /// A record for each pixel.
    Pixels = 6,
    /// The instances of the frame before.
    PreviousInstances = 7,
    /// What was drawn.
    Ids = 8,
    /// The pixels that send out reflection rays.
    Reflecting = 9,
    /// How many rays were traced for each pixel.
    RayCounts = 10,
}

/// A binding of group 3 and whether the pass writes there.
type Bound = (Slot, bool);

const READS: bool = false;
const WRITES: bool = true;

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

    /// Name of its entry point.
    pub fn entry_point(self) -> &'static str {
        match self {
            Self::Cull => "cull",
            Self::ClusterLights => "cluster_lights",
            Self::Resolve => "resolve",
            Self::CameraRays => "camera_rays",
            Self::TileBounds => "tile_bounds",
            Self::Shafts => "shafts",
            Self::ShadowRays => "shadow_rays",
            Self::LitSurfaces => "lit_surfaces",
            Self::DirectLights => "direct_lights",
            Self::AmbientOcclusion => "ambient_occlusion",
            Self::ListReflecting => "list_reflecting",
            Self::Reflections => "reflections",
            Self::Compose => "compose",
        }
    }

    /// Its name in profiles.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cull => "cull",
            Self::ClusterLights => "cluster lights",
            Self::Resolve => "resolve",
            Self::CameraRays => "camera rays",
            Self::TileBounds => "tile bounds",
            Self::Shafts => "shafts",
            Self::ShadowRays => "shadow rays",
            Self::LitSurfaces => "lit surfaces",
            Self::DirectLights => "direct lights",
            Self::AmbientOcclusion => "ambient occlusion",
            Self::ListReflecting => "list reflecting",
            Self::Reflections => "reflections",
            Self::Compose => "compose",
        }
    }

    /// Whether it asks the tracer.
    pub fn traces(self) -> bool {
        match self {
            Self::CameraRays
            | Self::Shafts
            | Self::ShadowRays
            | Self::DirectLights
            | Self::AmbientOcclusion
            | Self::Reflections => true,
            Self::Cull
            | Self::ClusterLights
            | Self::Resolve
            | Self::TileBounds
            | Self::LitSurfaces
            | Self::ListReflecting
            | Self::Compose => false,
        }
    }

    /// Bindings of the film's group that it needs beside the view, which all bind. With them, no pass binds more storage
    /// buffers than a megakernel does.
    pub fn film_bindings(self) -> &'static [u32] {
        match self {
            Self::CameraRays => &[2],
            Self::Compose => &[1, 2, 3],
            _ => &[],
        }
    }

    /// Bindings of group 3 that it needs.
    pub fn bindings(self) -> &'static [Bound] {
        match self {
            Self::Cull => &[
                (Slot::Frame, READS),
                (Slot::Items, READS),
                (Slot::Parts, READS),
                (Slot::SeenItems, WRITES),
                (Slot::Draws, WRITES),
            ],
            Self::ClusterLights => &[(Slot::Frame, READS), (Slot::LightMasks, WRITES)],
            Self::Resolve => &[
                (Slot::Frame, READS),
                (Slot::Items, READS),
                (Slot::Parts, READS),
                (Slot::Pixels, WRITES),
                (Slot::PreviousInstances, READS),
                (Slot::Ids, READS),
            ],
            Self::CameraRays => {
                &[(Slot::Frame, READS), (Slot::Pixels, WRITES), (Slot::PreviousInstances, READS)]
            }
            Self::TileBounds => &[(Slot::Frame, READS), (Slot::LightMasks, WRITES), (Slot::Pixels, WRITES)],
            Self::Shafts => &[(Slot::Frame, READS), (Slot::LightMasks, WRITES)],
            Self::ShadowRays | Self::LitSurfaces | Self::DirectLights => &[
                (Slot::Frame, READS),
                (Slot::LightMasks, WRITES),
                (Slot::Pixels, WRITES),
                (Slot::RayCounts, WRITES),
            ],
            Self::AmbientOcclusion => {
                &[(Slot::Frame, READS), (Slot::Pixels, WRITES), (Slot::RayCounts, WRITES)]
            }
            Self::ListReflecting => &[(Slot::Pixels, WRITES), (Slot::Reflecting, WRITES)],
            Self::Reflections => &[
                (Slot::Frame, READS),
                (Slot::Pixels, WRITES),
                (Slot::Reflecting, WRITES),
                (Slot::RayCounts, WRITES),
            ],
            Self::Compose => &[(Slot::Frame, READS), (Slot::Pixels, WRITES), (Slot::RayCounts, WRITES)],
        }
    }

    /// Whether it is there for shafts alone.
    fn makes_shafts(self) -> bool {
        matches!(self, Self::TileBounds | Self::Shafts)
    }

    /// Whether it knows of shafts, where there are any.
    fn uses_shafts(self) -> bool {
        self.makes_shafts() || self == Self::ShadowRays
    }

    /// The text that it is in. `below`: the tracer's for walks that begin below the root, if it has one.
    pub fn text(self, tracer: &TracerText, below: Option<&TracerText>, variant: Variant) -> String {
        let (tracer, shafts) = match below {
            Some(below) if self.uses_shafts() => (below, shafts::text()),
            _ => (tracer, shafts::no_text()),
        };
        match self {
            Self::Cull | Self::ClusterLights => cull_text(variant),
            Self::Resolve => resolve_text(variant),
            Self::Compose => compose_text(variant),
            Self::ListReflecting => listing_text(variant),
            Self::CameraRays => camera_text(tracer, variant),
            Self::TileBounds
            | Self::Shafts
            | Self::ShadowRays
            | Self::LitSurfaces
            | Self::DirectLights
            | Self::AmbientOcclusion
            | Self::Reflections => tracing_text(tracer, &shafts, variant),
        }
    }
}

/// What the rasteriser binds of group 3.
pub const RASTER_BINDINGS: &[Bound] =
    &[(Slot::Frame, READS), (Slot::Items, READS), (Slot::Parts, READS), (Slot::SeenItems, READS)];

const FILM: &str = include_str!("../shaders/film.wgsl");
const FRAME: &str = include_str!("../shaders/hybrid_frame.wgsl");
const ITEMS: &str = include_str!("../shaders/hybrid_items.wgsl");
const PIXELS: &str = include_str!("../shaders/hybrid_pixels.wgsl");
const GROUP_RAYS: &str = include_str!("../shaders/group_rays.wgsl");
const REFLECTING: &str = include_str!("../shaders/hybrid_reflecting.wgsl");
const DIRECT: &str = include_str!("../shaders/direct.wgsl");
const RAYS: &str = include_str!("../shaders/rays.wgsl");

/// Culling of items and lights.
fn cull_text(variant: Variant) -> String {
    let classes = format!("const DRAW_CLASSES: u32 = {}u;", DrawClass::ALL.len());
    let reach = include_str!("../shaders/light_reach.wgsl");
    let cull = include_str!("../shaders/hybrid_cull.wgsl");
    [&scene_text(variant), &classes, FILM, reach, FRAME, ITEMS, cull].join("\n")
}

/// The rasteriser's shaders.
pub(super) fn raster_text(variant: Variant) -> String {
    [&scene_text(variant), FILM, FRAME, ITEMS, include_str!("../shaders/hybrid_raster.wgsl")].join("\n")
}

/// From identifications to hits.
pub(super) fn resolve_text(variant: Variant) -> String {
    let resolve = include_str!("../shaders/hybrid_resolve.wgsl");
    [&scene_text(variant), FILM, FRAME, ITEMS, PIXELS, resolve].join("\n")
}

/// From pixels to the film.
fn compose_text(variant: Variant) -> String {
    let compose = include_str!("../shaders/hybrid_compose.wgsl");
    [&scene_text(variant), FILM, GROUP_RAYS, FRAME, PIXELS, compose].join("\n")
}

/// First hits by rays.
fn camera_text(tracer: &TracerText, variant: Variant) -> String {
    let camera = include_str!("../shaders/hybrid_camera.wgsl");
    [tracer.enables, &scene_text(variant), &tracer.text, FILM, RAYS, GROUP_RAYS, FRAME, PIXELS, camera]
        .join("\n")
}

/// The list of pixels that reflect.
fn listing_text(variant: Variant) -> String {
    let listing = include_str!("../shaders/hybrid_listing.wgsl");
    [&scene_text(variant), FILM, FRAME, PIXELS, REFLECTING, listing].join("\n")
}

/// The passes that trace rays, and the one that shades what another has traced.
fn tracing_text(tracer: &TracerText, shafts: &str, variant: Variant) -> String {
    let passes = include_str!("../shaders/hybrid_tracing.wgsl");
    let lights = include_str!("../shaders/hybrid_lights.wgsl");
    let reach = include_str!("../shaders/light_reach.wgsl");
    let scene = scene_text(variant);
    [
        tracer.enables,
        &scene,
        &tracer.text,
        FILM,
        RAYS,
        reach,
        DIRECT,
        FRAME,
        PIXELS,
        REFLECTING,
        passes,
        shafts,
        lights,
    ]
    .join("\n")
}

/// Layout of group 3 with some of its bindings.
pub(super) fn slot_layout(gpu: &Gpu, bindings: &[Bound], visibility: ShaderStages) -> wgpu::BindGroupLayout {
    let ty = |slot: Slot, writes: bool| match slot {
        Slot::Frame => buffer(BufferBindingType::Uniform),
        Slot::Ids => BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        _ => buffer(BufferBindingType::Storage { read_only: !writes }),
    };
    let entries: Vec<_> =
        bindings.iter().map(|&(slot, writes)| entry(slot as u32, visibility, ty(slot, writes))).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("frame"),
        entries: &entries,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{used_bindings, validate, write_all_languages};
    use crate::tracer::{bvh, query};
    use scene::tables::SceneTables;

    /// Every pass binds what its shader uses, reads what it only reads, needs no more storage buffers than a device must have, and can
    /// be written for every driver.
    #[test]
    fn passes_bind_what_they_use() {
        const TRACER: usize = 3;
        const SCENE: usize = 6;
        let scene = SceneTables::build(&testkit::scenes::assortment());
        let below = bvh::text_below_for(&bvh::encode(&scene, accel::Quality::Fast), 1 << 27);
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
            let with = Pass::ALL.into_iter().filter(|p| p.uses_shafts()).map(|pass| (pass, Some(&below)));
            for (pass, below) in without.chain(with) {
                let name = format!("{pass:?}, {variant:?}, with shafts: {}", below.is_some());
                let text = pass.text(&query::TEXT, below, variant);
                let (module, info) = validate(&name, &text);
                write_all_languages(&name, &module, &info, pass.entry_point());
                let mut used = used_bindings(&name, &text, pass.entry_point());
                let film = pass.film_bindings().iter().map(|&b| (2, b, true));
                let own = pass.bindings().iter().map(|&(slot, writes)| (3, slot as u32, writes));
                let mut bound: Vec<_> = film.chain(own).collect();
                bound.push((2, 0, false));
                bound.sort_unstable();
                used.push((2, 0, false));
                used.sort_unstable();
                used.dedup();
                assert_eq!(used, bound, "{name}");
                let images = usize::from(pass.bindings().iter().any(|b| b.0 == Slot::Ids));
                let uniforms = 2 + images;
                let count = SCENE + if pass.traces() { TRACER } else { 0 } + bound.len() - uniforms;
                assert!(count <= crate::STORAGE_BUFFERS as usize, "{name}: {count} buffers");
            }
        }
    }

    #[test]
    fn the_rasteriser_is_valid_and_binds_what_it_uses() {
        for variant in [Variant::default(), Variant { alpha: true, images: 16, ..Variant::default() }] {
            let (module, _) = validate("raster", &raster_text(variant));
            let mut own: Vec<u32> = module
                .global_variables
                .iter()
                .filter_map(|(_, v)| v.binding.filter(|b| b.group == 3).map(|b| b.binding))
                .collect();
            own.sort_unstable();
            assert_eq!(own, RASTER_BINDINGS.iter().map(|b| b.0 as u32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn passes_are_where_their_numbers_say() {
        assert!(Pass::ALL.into_iter().enumerate().all(|(i, pass)| pass as usize == i));
        assert!(DrawClass::ALL.into_iter().enumerate().all(|(i, class)| class as usize == i));
    }
}
