//! What is decided when a shader is put together, and which modules that means.

use super::constants::numbers;
use super::modules::Linkage;
use crate::scene::SceneTraits;
use crate::scene::records::records_text;
use crate::scene::word_records::{layer_readers, node_readers, use_readers};
use backend::{Integrator, Mis, SamplerKind, View};
use optics::albedo::DielectricAlbedo;
use optics::distortion::DISTORTION_NONE;
use optics::light::LIGHT_RECTANGLE;
use optics::random::{SAMPLER_BLUE_NOISE, SAMPLER_INDEPENDENT, SAMPLER_SOBOL};
use scene::tables::NONE;
use std::fmt::Write;

/// What is decided when a shader is put together, because a branch at run time would cost registers or time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Variant {
    /// How random numbers are drawn. That is asked with every one of them.
    pub sampler: SamplerKind,
    /// Whether any surface of the scene has holes, or backs that are not there.
    pub alpha: bool,
    /// Whether any sphere has.
    pub sphere_holes: bool,
    /// Whether any surface cannot be seen from behind.
    pub culled_backs: bool,
    /// Whether texels of any texture are half floats.
    pub half_texels: bool,
    /// Whether anything that was moved into world space lies in the space of its object.
    pub placements: bool,
    /// Whether first hits are recorded.
    pub aovs: bool,
    /// Whether of these what guides denoisers is, which paths look for behind glass and in mirrors.
    pub features: bool,
    /// Whether several paths go on from the first vertex of each camera ray.
    pub splitting: bool,
    /// Whether tangents of spheres are turned in any material.
    pub turned_tangents: bool,
    /// Whether any texture is a graph.
    pub graphs: bool,
    /// Whether any material is layered.
    pub layers: bool,
    /// Whether any body absorbs light.
    pub absorption: bool,
    /// Elements of the binding array of images; 0: all texels lie in the layers of one texture.
    pub images: u32,
    /// Whether lights are many, so that they are chosen by where they are.
    pub light_tree: bool,
    /// How many lights there are to choose among, if they are few and the shader is to know no others; else 0. Only with
    /// [`Variant::light_tree`].
    pub light_list: u32,
    /// The kind (`LIGHT_…` of the optics) that all lights have but the environment, if it is one and the shader is to know
    /// no other.
    pub light_kind: Option<u32>,
    /// Whether there is one light, and the shader is to know no others.
    pub one_light: bool,
    /// Whether no surface is near a flat light, so that the shader need not know how to sample one by solid angle.
    pub far_lights: bool,
    /// Whether any light has a profile.
    pub profiles: bool,
    /// Whether the environment is sampled through portals.
    pub portals: bool,
    /// Whether any mesh gathers light where the smooth surface would be that its normals stand for.
    pub smooth_terminators: bool,
    /// Whether the shader's paths know what they are in. What does not know it sees through boundaries.
    pub volumes: bool,
    /// Whether the camera's lens may bend lines.
    pub lens_distortion: bool,
    /// Whether what indirect light adds may be limited.
    pub indirect_limit: bool,
    /// Whether camera rays leave at times of their own.
    pub motion: bool,
    /// Whether anything of the scene moves meanwhile. Only with [`Variant::motion`].
    pub scene_moves: bool,
    /// How the two ways to find light are weighted.
    pub mis: Mis,
    /// Whether the film is that of a batch of views, below each other, each with a camera of its own.
    pub many_views: bool,
    /// What else there is in the scene.
    pub traits: SceneTraits,
}

impl Variant {
    /// All variants; what changes little else with all of the rest or nothing: binding arrays, layers, absorption, how
    /// lights are chosen, and media.
    pub fn all() -> impl Iterator<Item = Self> {
        let of = |i: u32| Self {
            alpha: i & 1 != 0,
            sphere_holes: i & 3 == 3,
            culled_backs: i & 1 != 0,
            half_texels: i & 2 != 0,
            placements: i & 4 != 0,
            turned_tangents: i & 2 != 0,
            lens_distortion: i & 2 != 0,
            indirect_limit: i & 4 != 0,
            motion: i & 16 != 0,
            scene_moves: i & 48 == 48,
            aovs: i & 2 != 0,
            features: i & 6 == 6,
            splitting: i & 4 != 0,
            graphs: i & 8 != 0,
            layers: i & 8 != 0,
            absorption: i & 16 != 0,
            light_tree: i & 32 != 0,
            light_list: match i & 98 {
                34 => 2,
                98 => 3,
                _ => 0,
            },
            volumes: i & 64 != 0,
            profiles: i & 128 != 0,
            portals: i & 256 != 0,
            smooth_terminators: i & 1 != 0,
            images: 0,
            light_kind: (i & 2 != 0).then_some(LIGHT_RECTANGLE),
            far_lights: i & 4 != 0,
            one_light: i & 36 == 4,
            many_views: i & 6 == 4,
            traits: if i & 2 == 0 { SceneTraits::default() } else { SceneTraits::of(&[], &[], &[], &[]) },
            sampler: SamplerKind::ALL[i as usize % SamplerKind::ALL.len()],
            mis: Mis::ALL[i as usize % Mis::ALL.len()],
        };
        let with_images = move |i: u32| Self { images: 16, ..of(i) };
        (0..8).chain([8, 16, 32, 63, 65, 128, 256, 511]).map(of).chain([0, 511].map(with_images))
    }

    /// The variant that makes pictures of `view`, and of others that differ in none of what is decided here.
    #[must_use]
    pub fn for_view(self, view: &View) -> Self {
        let settings = match &view.integrator {
            Integrator::Path(settings) => Some(settings),
            _ => None,
        };
        Self {
            sampler: view.sampler,
            splitting: settings.is_some_and(|s| s.splitting > 1),
            indirect_limit: settings.is_some_and(|s| s.clamp_indirect.is_some()),
            mis: settings.map(|s| s.mis).unwrap_or_default(),
            lens_distortion: view.camera.distortion.model != DISTORTION_NONE,
            motion: view.shutter.is_some() && (self.scene_moves || view.camera_moves()),
            scene_moves: view.shutter.is_some() && self.scene_moves,
            ..self
        }
    }
}

impl Linkage {
    /// The modules of a variant: all but the tracer and what single passes decide.
    pub fn of(variant: Variant) -> Self {
        let moving = |name, linkage: Self, is_on| if is_on { linkage.define(name) } else { linkage };
        let linkage = Self::of_what_stands_still(variant);
        let linkage = moving("MOTION", linkage, variant.motion);
        moving("SCENE_MOVES", linkage, variant.motion && variant.scene_moves)
    }

    /// As [`Linkage::of`], but for motion.
    fn of_what_stands_still(variant: Variant) -> Self {
        let layered = |plain, layered| if variant.layers { layered } else { plain };
        Self::default()
            .bind("texels", if variant.images == 0 { "texels_layers" } else { "texels_images" })
            .bind("graphs", if variant.graphs { "graphs_nodes" } else { "graphs_none" })
            .bind("scattering", layered("scattering_plain", "scattering_layered"))
            .bind(
                "light_chooser",
                match variant.light_list {
                    0 => "light_chooser_tree",
                    // In media, paths keep other things.
                    2 if !variant.volumes => "light_chooser_pair",
                    _ => "light_chooser_list",
                },
            )
            .bind("first_hits", "first_hits_recorded")
            .bind("shafts", "hybrid_no_shafts")
            .bind("ray_sum", "group_rays")
            .bind("handing", "wavefront_handing")
            .generate("variant", variant.constants())
            .generate(
                "albedo_constants",
                numbers([("DIELECTRIC_ALBEDO_HEIGHT", DielectricAlbedo::SIZE[1] as u32)]),
            )
            .generate("layer_constants", numbers(crate::scene::materials::layer_constants()))
            .generate("layer_readers", layer_readers())
            .generate("use_readers", use_readers())
            .generate("node_readers", node_readers())
            .generate("node_constants", numbers(crate::scene::materials::node_constants()))
            .generate("scene_records", records_text())
            .generate("medium_constants", numbers(crate::scene::media::medium_constants()))
    }
}

impl Variant {
    /// The constants that modules ask.
    fn constants(self) -> String {
        let switches = [
            ("SCENE_HAS_ALPHA", self.alpha),
            ("SCENE_HAS_SPHERE_HOLES", self.sphere_holes),
            ("SCENE_CULLS_BACKS", self.culled_backs),
            ("SCENE_HAS_HALF_TEXELS", self.half_texels),
            ("SCENE_HAS_PLACEMENTS", self.placements),
            ("SCENE_TURNS_TANGENTS", self.turned_tangents),
            ("SCENE_HAS_GRAPHS", self.graphs),
            ("SCENE_HAS_LAYERS", self.layers),
            ("SCENE_ABSORBS", self.absorption),
            ("WANTS_AOVS", self.aovs),
            ("WANTS_FEATURES", self.features),
            ("SPLITS_PATHS", self.splitting),
            ("LIGHT_TREE", self.light_tree),
            ("ONE_LIGHT", self.one_light),
            ("FLAT_LIGHTS_ARE_FAR", self.far_lights),
            ("SCENE_HAS_PROFILES", self.profiles),
            ("SCENE_HAS_PORTALS", self.portals),
            ("SCENE_HAS_SMOOTH_TERMINATORS", self.smooth_terminators),
            ("FOLLOWS_VOLUMES", self.volumes),
            ("LENS_DISTORTS", self.lens_distortion),
            ("LIMITS_INDIRECT", self.indirect_limit),
            ("MIS_SQUARED", self.mis.heuristic().squared),
            ("MANY_VIEWS", self.many_views),
        ];
        let mut text = numbers([
            ("SAMPLER", sampler_kind(self.sampler)),
            ("IMAGE_SLOTS", self.images.max(1)),
            ("ALL_LIGHTS_ARE", self.light_kind.unwrap_or(NONE)),
            ("LIGHT_LIST", self.light_list.max(1)),
        ]);
        let mis = self.mis.heuristic();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "const MIS_LIGHTS: f32 = {:?};\nconst MIS_BSDFS: f32 = {:?};",
            mis.lights, mis.bsdfs
        );
        for (name, is_on) in switches {
            let _ = writeln!(text, "const {name}: bool = {is_on};"); // writing to a string cannot fail
        }
        text + &self.traits.constants()
    }
}

/// `SAMPLER_…` of the optics.
pub(crate) fn sampler_kind(sampler: SamplerKind) -> u32 {
    match sampler {
        SamplerKind::Sobol => SAMPLER_SOBOL,
        SamplerKind::Independent => SAMPLER_INDEPENDENT,
        SamplerKind::BlueNoise => SAMPLER_BLUE_NOISE,
    }
}
