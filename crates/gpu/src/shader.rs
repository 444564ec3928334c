//! Putting shaders together.
//!
//! One text for all: `enable` directives, optics, constants, scene, tracer, kernel. Nothing here needs a device, so
//! every combination is parsed, validated and translated in tests without one.

use crate::tracer::TracerText;
use crate::scene::records::scene_records;
use crate::scene::word_records::layer_readers;
use crate::{Gpu, GpuError};
use backend::SamplerKind;
use optics::albedo::DielectricAlbedo;
use optics::light::LIGHT_RECTANGLE;
use optics::random::{SAMPLER_BLUE_NOISE, SAMPLER_INDEPENDENT, SAMPLER_SOBOL};
use scene::tables::NONE;
use std::cell::OnceCell;
use std::fmt::Write;
use std::sync::PoisonError;

/// What is decided when a shader is put together, because a branch at run time would cost registers or time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Variant {
    /// How random numbers are drawn. That is asked with every one of them.
    pub sampler: SamplerKind,
    /// Whether any surface of the scene has holes.
    pub alpha: bool,
    /// Whether first hits are recorded.
    pub aovs: bool,
    /// Whether several paths go on from the first vertex of each camera ray.
    pub splitting: bool,
    /// Whether any material is layered.
    pub layers: bool,
    /// Whether any body absorbs light.
    pub absorption: bool,
    /// Elements of the binding array of images; 0: all texels lie in the layers of one texture.
    pub images: u32,
    /// Whether there are several lights, of which one has to be chosen.
    pub light_tree: bool,
    /// The kind (`LIGHT_…` of the optics) that all lights have but the environment, if it is one and the shader is to know
    /// no other.
    pub light_kind: Option<u32>,
    /// Whether no surface is near a flat light, so that the shader need not know how to sample one by solid angle.
    pub far_lights: bool,
    /// Whether any light has a profile.
    pub profiles: bool,
    /// Whether the environment is sampled through portals.
    pub portals: bool,
    /// Whether there are ends of media that are no surfaces.
    pub boundaries: bool,
    /// Whether the shader's paths know what they are in. What does not know it sees through boundaries.
    pub volumes: bool,
}

impl Variant {
    /// All variants; what changes little else with all of the rest or nothing: binding arrays, layers, absorption, how
    /// lights are chosen, and media.
    pub fn all() -> impl Iterator<Item = Self> {
        let of = |i: u32| Self {
            alpha: i & 1 != 0,
            aovs: i & 2 != 0,
            splitting: i & 4 != 0,
            layers: i & 8 != 0,
            absorption: i & 16 != 0,
            light_tree: i & 32 != 0,
            boundaries: i & 64 != 0,
            volumes: i & 128 != 0,
            profiles: i & 256 != 0,
            portals: i & 512 != 0,
            images: 0,
            light_kind: (i & 2 != 0).then_some(LIGHT_RECTANGLE),
            far_lights: i & 4 != 0,
            sampler: SamplerKind::ALL[i as usize % SamplerKind::ALL.len()],
        };
        let with_images = move |i: u32| Self { images: 16, ..of(i) };
        (0..8).chain([8, 16, 32, 63, 65, 192, 256, 512, 1023]).map(of).chain([0, 1023].map(with_images))
    }
}

/// How records of pixels and paths lie in memory.
pub(crate) const PLANES: &str = include_str!("shaders/planes.wgsl");

/// The optics, the constants and the scene: everything that is in front of a tracer.
pub fn scene_text(variant: Variant) -> String {
    let (enables, texels) = match variant.images {
        0 => ("", include_str!("shaders/texels_layers.wgsl")),
        _ => ("enable wgpu_binding_array;", include_str!("shaders/texels_images.wgsl")),
    };
    let optics = match (variant.volumes, variant.layers) {
        (true, _) => optics::wgsl::all(),
        (false, true) => optics::wgsl::without_volumes(),
        (false, false) => optics::wgsl::without_layers(),
    };
    let (readers, scattering) = match variant.layers {
        true => (layer_readers(), include_str!("shaders/scattering_layered.wgsl")),
        false => ("", include_str!("shaders/scattering_plain.wgsl")),
    };
    let records =
        scene_records::WGSL_SOURCE.wgsl_source().expect("a test builds the text of the scene's records");
    [
        enables,
        &optics,
        &constants(variant),
        PLANES,
        &records,
        include_str!("shaders/scene.wgsl"),
        readers,
        texels,
        include_str!("shaders/texture.wgsl"),
        include_str!("shaders/surface.wgsl"),
        include_str!("shaders/material.wgsl"),
        include_str!("shaders/lights.wgsl"),
        scattering,
    ]
    .join("\n")
}

/// A whole shader.
pub fn assemble(tracer: &TracerText, kernel: &str, variant: Variant) -> String {
    [tracer.enables, &scene_text(variant), &tracer.text, kernel].join("\n")
}

/// Constants that Rust decides.
fn constants(variant: Variant) -> String {
    let numbers = [
        ("DIELECTRIC_ALBEDO_HEIGHT", DielectricAlbedo::SIZE[1] as u32),
    ];
    let mut text = String::new();
    let of_layers = crate::scene::materials::layer_constants().into_iter().filter(|_| variant.layers);
    let of_media = crate::scene::media::medium_constants().filter(|_| variant.volumes);
    for (name, value) in numbers.into_iter().chain(of_layers).chain(of_media) {
        let _ = writeln!(text, "const {name}: u32 = {value}u;"); // writing to a string cannot fail
    }
    let _ = writeln!(text, "const SAMPLER: u32 = {}u;", sampler_kind(variant.sampler));
    let _ = writeln!(text, "const IMAGE_SLOTS: u32 = {}u;", variant.images.max(1));
    let _ = writeln!(text, "const SCENE_HAS_ALPHA: bool = {};", variant.alpha);
    let _ = writeln!(text, "const SCENE_HAS_LAYERS: bool = {};", variant.layers);
    let _ = writeln!(text, "const SCENE_ABSORBS: bool = {};", variant.absorption);
    let _ = writeln!(text, "const WANTS_AOVS: bool = {};", variant.aovs);
    let _ = writeln!(text, "const SPLITS_PATHS: bool = {};", variant.splitting);
    let _ = writeln!(text, "const LIGHT_TREE: bool = {};", variant.light_tree);
    let light_kind = variant.light_kind.unwrap_or(NONE);
    let _ = writeln!(text, "const ALL_LIGHTS_ARE: u32 = {light_kind}u;");
    let _ = writeln!(text, "const FLAT_LIGHTS_ARE_FAR: bool = {};", variant.far_lights);
    let _ = writeln!(text, "const SCENE_HAS_PROFILES: bool = {};", variant.profiles);
    let _ = writeln!(text, "const SCENE_HAS_PORTALS: bool = {};", variant.portals);
    let _ = writeln!(text, "const FOLLOWS_VOLUMES: bool = {};", variant.volumes);
    let _ = writeln!(text, "const HIDES_BOUNDARIES: bool = {};", variant.boundaries && !variant.volumes);
    text
}

/// `SAMPLER_…` of the optics.
pub(crate) fn sampler_kind(sampler: SamplerKind) -> u32 {
    match sampler {
        SamplerKind::Sobol => SAMPLER_SOBOL,
        SamplerKind::Independent => SAMPLER_INDEPENDENT,
        SamplerKind::BlueNoise => SAMPLER_BLUE_NOISE,
    }
}

impl Gpu {
    /// Compiles a shader module.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn shader_module(&self, name: &str, text: &str) -> Result<wgpu::ShaderModule, GpuError> {
        let descriptor =
            wgpu::ShaderModuleDescriptor { label: Some(name), source: wgpu::ShaderSource::Wgsl(text.into()) };
        // A counter in every loop, against compilers that take endless ones for unreachable, costs 4 to 8 % of a path.
        let checks =
            wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() };
        // SAFETY: the only check that is left out is that loops end. The texts are our own. Their loops count up to a bound
        // (samples, segments of a path, lights, bits of a word), halve a range, or walk a tree of a depth that the encoder
        // limits, each node of which is visited once: a broken tree is none that it writes, and memory is still checked.
        self.guarded(|| unsafe { self.device.create_shader_module_trusted(descriptor, checks) })
            .map_err(|reason| GpuError::Shader { shader: name.to_owned(), reason })
    }

    /// Makes a compute pipeline of the entry point `main`; see [`ShaderText::pipeline`].
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn compute_pipeline(
        &self,
        name: &str,
        text: &str,
        groups: &[&wgpu::BindGroupLayout],
    ) -> Result<wgpu::ComputePipeline, GpuError> {
        let groups: Vec<_> = groups.iter().copied().map(Some).collect();
        self.shader_text(name, text.to_owned()).pipeline("main", &groups)
    }

    /// A text of which pipelines are made; `name` is for messages.
    pub fn shader_text(&self, name: &str, text: String) -> ShaderText<'_> {
        ShaderText { gpu: self, name: name.to_owned(), text, module: OnceCell::new() }
    }
}

/// A shader's text, compiled when the first pipeline is made of it that is not known already.
pub struct ShaderText<'a> {
    gpu: &'a Gpu,
    name: String,
    text: String,
    module: OnceCell<wgpu::ShaderModule>,
}

impl ShaderText<'_> {
    fn module(&self) -> Result<&wgpu::ShaderModule, GpuError> {
        if let Some(module) = self.module.get() {
            return Ok(module);
        }
        let module = self.gpu.shader_module(&self.name, &self.text)?;
        Ok(self.module.get_or_init(|| module))
    }

    /// Makes the compute pipeline of an entry point, or finds the one that was made before of the same text. Equal texts
    /// have equal bindings, so any bind groups of the one fit the other.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn pipeline(
        &self,
        entry_point: &str,
        groups: &[Option<&wgpu::BindGroupLayout>],
    ) -> Result<wgpu::ComputePipeline, GpuError> {
        /// More than that belong to scenes that are long gone.
        const KEPT: usize = 64;
        let Self { gpu, name, text, .. } = self;
        let key = [entry_point, text].join("\n");
        let known = || gpu.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = known().get(&key) {
            return Ok(pipeline.clone());
        }
        let module = self.module()?;
        let pipeline = gpu
            .guarded(|| {
                let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(name),
                    bind_group_layouts: groups,
                    immediate_size: 0,
                });
                gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(name),
                    layout: Some(&layout),
                    module,
                    entry_point: Some(entry_point),
                    compilation_options: wgpu::PipelineCompilationOptions {
                        // Every kernel writes its workgroup variables before it reads them.
                        zero_initialize_workgroup_memory: false,
                        ..Default::default()
                    },
                    cache: None,
                })
            })
            .map_err(|reason| GpuError::Shader { shader: name.clone(), reason })?;
        let mut known = known();
        if known.len() >= KEPT {
            known.clear();
        }
        known.insert(key, pipeline.clone());
        Ok(pipeline)
    }
}

/// For tests: the module of a text.
#[cfg(test)]
pub(crate) fn parse(text: &str) -> naga::Module {
    naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)))
}

/// For tests: the validated module of a text.
#[cfg(test)]
pub(crate) fn validate(name: &str, text: &str) -> (naga::Module, naga::valid::ModuleInfo) {
    let module = parse(text);
    let flags = naga::valid::ValidationFlags::all();
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    (module, info)
}

/// For tests: what an entry point uses of groups 2 and 3, as group, binding, and whether the variable may be written.
#[cfg(test)]
pub(crate) fn used_bindings(name: &str, text: &str, entry_point: &str) -> Vec<(u32, u32, bool)> {
    let (module, info) = validate(name, text);
    let index = module.entry_points.iter().position(|e| e.name == entry_point);
    let info = info.get_entry_point(index.expect("an entry point"));
    let used = module.global_variables.iter().filter(|(handle, _)| !info[*handle].is_empty());
    let bound = used.filter_map(|(_, v)| {
        let writes = matches!(v.space, naga::AddressSpace::Storage { access } if access.contains(naga::StorageAccess::STORE));
        v.binding.map(|b| (b.group, b.binding, writes))
    });
    bound.filter(|(group, ..)| *group >= 2).collect()
}

/// For tests: writes a module as SPIR-V, HLSL and MSL. `function`: a name that each text has to have.
#[cfg(test)]
pub(crate) fn write_all_languages(
    name: &str,
    module: &naga::Module,
    info: &naga::valid::ModuleInfo,
    function: &str,
) {
    use naga::back::{hlsl, msl, spv};
    let options = spv::Options { lang_version: (1, 4), ..Default::default() };
    let words = spv::write_vec(module, info, &options, None);
    assert!(words.is_ok_and(|w| w.len() > 1000), "{name}: SPIR-V");

    let options = hlsl::Options {
        shader_model: hlsl::ShaderModel::V6_5,
        fake_missing_bindings: true,
        ..Default::default()
    };
    let mut text = String::new();
    let pipeline = hlsl::PipelineOptions::default();
    hlsl::Writer::new(&mut text, &options, &pipeline)
        .write(module, info, None)
        .unwrap_or_else(|e| panic!("{name}: HLSL: {e}"));
    assert!(text.contains(function), "{name}: HLSL");

    let options = msl::Options { lang_version: (2, 4), fake_missing_bindings: true, ..Default::default() };
    let (text, _) = msl::write_string(module, info, &options, &msl::PipelineOptions::default())
        .unwrap_or_else(|e| panic!("{name}: MSL: {e}"));
    assert!(text.contains(function), "{name}: MSL");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::KernelKind;
    use crate::tracer::bvh;
    use crate::wavefront::stage;

    #[test]
    fn the_scene_is_valid_in_every_variant() {
        for variant in Variant::all() {
            validate(&format!("{variant:?}"), &scene_text(variant));
        }
    }

    /// Scenes without layers pay nothing for them: their shaders do not know that there are any.
    #[test]
    fn plain_scenes_have_no_layers_in_their_text() {
        let (plain, layered) =
            (scene_text(Variant::default()), scene_text(Variant { layers: true, ..Variant::default() }));
        for name in ["layered_bsdf", "sheen_lobe", "anisotropic_d", "iridescent_fresnel", "surface_layers"] {
            assert!(layered.contains(name), "{name}");
            assert!(!plain.contains(name), "{name}");
        }
    }

    /// Nor do scenes without media.
    #[test]
    fn scenes_without_media_have_none_in_their_text() {
        let of = |volumes| {
            let variant = Variant { volumes, ..Variant::default() };
            scene_text(variant) + &KernelKind::Path.compute_text(variant)
        };
        let (plain, with_media) = (of(false), of(true));
        for name in
            ["interiors_enter", "medium_sample", "MEDIUM_GRID", "segment_of", "VolumePath", "phase_scatter"]
        {
            assert!(with_media.contains(name), "{name}");
            assert!(!plain.contains(name), "{name}");
        }
    }

    /// Every kernel with every tracer for compute shaders: valid, and what drivers are given can be written.
    #[test]
    fn every_shader_translates_for_every_driver() {
        let bvh = |scene: &scene::Scene, limit| {
            let tables = scene::tables::SceneTables::build(scene);
            bvh::text_for(&bvh::encode(&tables, accel::Quality::Fast), limit)
        };
        let still = |scene: &scene::Scene| {
            let tables = scene::tables::SceneTables::build(scene);
            let encoded = bvh::encode_still(&tables, accel::Quality::Fast, true);
            assert!(encoded.is_flattened());
            bvh::text_for(&encoded, 1 << 27)
        };
        let three_spheres = scene::builtin::load("three-spheres", &Default::default(), &Default::default())
            .expect("a scene")
            .scene;
        let tracers = [
            ("query", crate::tracer::query::TEXT),
            ("bvh, one instance", bvh(&testkit::scenes::cornell(), 1 << 27)),
            ("bvh, two levels in pages", bvh(&three_spheres, 1 << 8)),
            ("bvh, joined instances", still(&three_spheres)),
        ];
        for (tracer_name, tracer) in tracers {
            for kind in KernelKind::ALL {
                for variant in Variant::all() {
                    let name = format!("{tracer_name}, {}, {variant:?}", kind.name());
                    let (module, info) =
                        validate(&name, &assemble(&tracer, &kind.compute_text(variant), variant));
                    write_all_languages(&name, &module, &info, "render_pixel");
                }
            }
            for variant in Variant::all() {
                let name = format!("{tracer_name}, wavefront, {variant:?}");
                let (module, info) = validate(&name, &stage::tracing_text(&tracer, variant));
                write_all_languages(&name, &module, &info, "connect");
            }
        }
    }

    /// Walks together have texts of their own.
    #[test]
    fn walks_together_translate_for_every_driver() {
        let encode = |scene: &scene::Scene| {
            bvh::encode(&scene::tables::SceneTables::build(scene), accel::Quality::Fast)
        };
        let tracers = [
            ("one instance", bvh::text_together_for(&encode(&testkit::scenes::cornell()), 1 << 27, 8)),
            (
                "two levels in pages",
                bvh::text_together_for(&encode(&testkit::scenes::assortment()), 1 << 8, 4),
            ),
        ];
        let rays = crate::rays::RayQuestion::ClosestTogether.compute_text();
        for (name, tracer) in tracers {
            for variant in Variant::all() {
                let (module, info) = validate(name, &assemble(&tracer, &rays, variant));
                write_all_languages(name, &module, &info, "main");
            }
        }
    }

    /// The stages of the wavefront that ask no tracer.
    #[test]
    fn the_wavefront_translates_for_every_driver() {
        for variant in Variant::all() {
            let name = format!("wavefront, {variant:?}");
            let (module, info) = validate(&name, &stage::shading_text(variant));
            write_all_languages(&name, &module, &info, "accumulate");
        }
    }

    /// What a driver's compiler refuses is an error that names the shader, and the device works on.
    #[test]
    fn refused_shaders_are_errors_and_kept_ones_are_found_again() {
        let name = "refused_shaders_are_errors_and_kept_ones_are_found_again";
        let Some(gpu) = crate::open_for_test(name, &crate::GpuOptions::default()) else { return };
        for broken in [
            "fn main( {",
            "@compute @workgroup_size(0) fn main() {}",
            "@compute @workgroup_size(1) fn other() {}",
        ] {
            let error = gpu.compute_pipeline("the broken one", broken, &[]).expect_err(broken);
            assert!(
                matches!(&error, GpuError::Shader { shader, .. } if shader == "the broken one"),
                "{error}"
            );
        }
        let good = "@compute @workgroup_size(1) fn main() {}";
        let first = gpu.compute_pipeline("a good one", good, &[]).expect("valid");
        let again = gpu.compute_pipeline("the same", good, &[]).expect("valid");
        assert!(first == again);
        gpu.check("testing").expect("the device is still good");
    }

    #[test]
    #[should_panic(expected = "no definition in scope")]
    fn an_unknown_name_is_noticed() {
        validate("broken", &(scene_text(Variant::default()) + "fn f() -> f32 { return lightt(); }"));
    }
}
