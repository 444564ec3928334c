//! Every module alone, and every shader that is made of them, without a device.

use super::abstract_modules::{ABSTRACT, modules_of};
use super::check::{self, validate, write_all_languages};
use super::*;
use crate::kernel::KernelKind;
use crate::tracer::{bvh, query};
use crate::views::ExactWants;
use crate::{denoise, gbuffer, hybrid};
use std::collections::BTreeSet;

/// All that Rust generates, and walks of our own hierarchy in all ways that there are.
fn with_hierarchy() -> Linkage {
    let tables = scene::tables::SceneTables::build(&testkit::scenes::assortment());
    let encoded = bvh::encode(&tables, accel::Quality::Fast);
    let packets = bvh::linkage_packets_for(&encoded, 1 << 8, 8);
    check::linkage(Variant { images: 16, ..Variant::default() })
        .with(&gbuffer::linkage(Variant::default()))
        .with(&packets)
        .with(&ExactWants { surface: true, albedo: true, flow: true }.linkage(Variant::default()))
        .with(&hybrid::shafts_linkage(&bvh::linkage_below_for(&encoded, 1 << 8)))
        .bind("question", "rays_closest_packet")
        .generate("filter_steps", "const FILTER_STEP: i32 = 2;\nconst FILTER_RADIUS: i32 = 1;")
        .generate("denoise_shape", denoise::shape(48))
}

/// As [`with_hierarchy`], but everything is traced by ray queries, and no shafts begin within them.
fn with_queries() -> Linkage {
    with_hierarchy().with(&query::linkage()).bind("shafts", "hybrid_no_shafts").bind("question", "rays_any")
}

/// As [`with_queries`], by a ray tracing pipeline.
#[cfg(not(any(target_vendor = "apple", target_arch = "wasm32")))]
fn with_pipelines() -> Option<Linkage> {
    Some(with_queries().with(&crate::pipeline::linkage()))
}

/// There are none here.
#[cfg(any(target_vendor = "apple", target_arch = "wasm32"))]
fn with_pipelines() -> Option<Linkage> {
    None
}

/// What a module is linked with, by how its rays are traced.
pub(super) fn tracings(name: &str) -> Vec<Linkage> {
    let by_queries = with_queries().modules(name);
    match by_queries {
        // Only ray generation shaders trace by a ray tracing pipeline, and only they know of it.
        _ if name.contains("pipeline") => with_pipelines().into_iter().collect(),
        Ok(modules) if modules.contains("tracer_bvh") => vec![with_hierarchy()],
        // Where there are no shafts, walks begin at the root.
        _ if name == "hybrid_no_shafts" => vec![with_queries()],
        Ok(modules) if modules.contains("tracer_query") => vec![with_queries(), with_hierarchy()],
        _ => vec![with_queries()],
    }
}

/// A module with all that it imports is a valid shader, whatever abstract names stand for: no import is missing.
#[test]
fn every_module_is_complete_by_its_imports() {
    let mut count = 0;
    for (name, _) in modules::files() {
        for linkage in tracings(name) {
            let text = linkage.text(name).unwrap_or_else(|e| panic!("{name}: {e}"));
            validate(name, &text);
            count += 1;
            for &(which, choices) in ABSTRACT {
                // The tracer was chosen above, with what follows from that.
                let decided = ["tracer", "entry_lists", "shafts", "question"].contains(&which);
                for choice in modules_of(choices).into_iter().filter(|_| !decided) {
                    let other = linkage.clone().bind(which, choice);
                    let other = other.text(name).unwrap_or_else(|e| panic!("{name} with {choice}: {e}"));
                    if other != text {
                        validate(&format!("{name} with {choice}"), &other);
                        count += 1;
                    }
                }
            }
        }
    }
    assert!(count > 120, "only {count} texts");
}

/// What a text declares at its top level.
pub(super) fn declared(text: &str) -> BTreeSet<&str> {
    text.lines().filter_map(declared_in).collect()
}

/// The name that a line declares, if it does that at the top level.
fn declared_in(line: &str) -> Option<&str> {
    let mut rest = line;
    while rest.starts_with('@') {
        // An attribute, with its argument if it has one.
        let end = rest.find([' ', '(']).unwrap_or(rest.len());
        rest = if rest[end..].starts_with('(') { rest.split_once(')')?.1 } else { &rest[end..] }.trim_start();
    }
    let rest = ["fn ", "struct ", "const ", "alias ", "override ", "var "]
        .iter()
        .find_map(|keyword| rest.strip_prefix(keyword))
        .or_else(|| rest.strip_prefix("var<")?.split_once("> ").map(|(_, name)| name))?;
    words(rest).next()
}

/// Identifiers, keywords and numbers.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

/// Every import brings a name that the module itself uses, whichever module an abstract name stands for.
#[test]
fn no_import_is_unneeded() {
    let Some(with_all) = with_pipelines() else { return };
    for (name, text) in modules::files() {
        let code: String = text
            .lines()
            .map(|line| line.split("//").next().unwrap_or_default())
            .collect::<Vec<_>>()
            .join("\n");
        let used: BTreeSet<_> = words(&code).collect();
        let imports = text.lines().filter_map(|line| line.strip_prefix("#import "));
        for import in imports.flat_map(|line| line.split(", ")) {
            let choices = ABSTRACT.iter().find(|(which, _)| *which == import);
            for module in choices.map_or_else(|| vec![import], |(_, choices)| modules_of(choices)) {
                let text = with_all.own_text(module).unwrap_or_else(|| panic!("{name}: {module}"));
                let names = declared(text);
                assert!(!names.is_disjoint(&used), "{name} uses nothing of {module}");
            }
        }
    }
}

/// Scenes without layers pay nothing for them: their shaders do not know that there are any.
#[test]
fn plain_scenes_have_no_layers_in_their_text() {
    let of = |layers| {
        let linkage = check::linkage(Variant { layers, ..Variant::default() });
        linkage.text("path_vertex").expect("linked")
    };
    let (plain, layered) = (of(false), of(true));
    for name in ["layered_bsdf", "sheen_lobe", "anisotropic_d", "iridescent_fresnel", "surface_layers"] {
        assert!(layered.contains(name), "{name}");
        assert!(!plain.contains(name), "{name}");
    }
}

/// Nor do scenes without media.
#[test]
fn scenes_without_media_have_none_in_their_text() {
    let of = |volumes| {
        let linkage = KernelKind::Path.linkage(Variant { volumes, ..Variant::default() });
        linkage.with(&query::linkage()).text("entry_compute").expect("linked")
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
        bvh::linkage_for(&bvh::encode(&tables, accel::Quality::Fast), limit)
    };
    let still = |scene: &scene::Scene| {
        let tables = scene::tables::SceneTables::build(scene);
        let encoded = bvh::encode_still(&tables, accel::Quality::Fast, true);
        assert!(encoded.is_flattened());
        bvh::linkage_for(&encoded, 1 << 27)
    };
    let three_spheres = scene::builtin::load("three-spheres", &Default::default(), &Default::default())
        .expect("a scene")
        .scene;
    let tracers = [
        ("query", query::linkage()),
        ("bvh, one instance", bvh(&testkit::scenes::cornell(), 1 << 27)),
        ("bvh, two levels in pages", bvh(&three_spheres, 1 << 8)),
        ("bvh, joined instances", still(&three_spheres)),
    ];
    for (tracer_name, tracer) in tracers {
        for kind in KernelKind::ALL {
            for variant in Variant::all() {
                let name = format!("{tracer_name}, {}, {variant:?}", kind.name());
                let text = kind.linkage(variant).with(&tracer).text("entry_compute").expect("linked");
                let (module, info) = validate(&name, &text);
                write_all_languages(&name, &module, &info, "render_pixel");
            }
        }
        for variant in Variant::all() {
            let name = format!("{tracer_name}, wavefront, {variant:?}");
            let text = Linkage::of(variant).with(&tracer).text("wavefront_tracing").expect("linked");
            let (module, info) = validate(&name, &text);
            write_all_languages(&name, &module, &info, "connect");
        }
    }
}

/// Packet traversal has texts of its own.
#[test]
fn packets_translate_for_every_driver() {
    let encode =
        |scene: &scene::Scene| bvh::encode(&scene::tables::SceneTables::build(scene), accel::Quality::Fast);
    let tracers = [
        ("one instance", bvh::linkage_packets_for(&encode(&testkit::scenes::cornell()), 1 << 27, 8)),
        ("two levels in pages", bvh::linkage_packets_for(&encode(&testkit::scenes::assortment()), 1 << 8, 4)),
    ];
    for (name, tracer) in tracers {
        for variant in Variant::all() {
            let linkage = crate::rays::RayQuestion::ClosestPacket.linkage(variant).with(&tracer);
            let (module, info) = validate(name, &linkage.text("entry_rays_compute").expect("linked"));
            write_all_languages(name, &module, &info, "main");
        }
    }
}

/// The stages of the wavefront that ask no tracer.
#[test]
fn the_wavefront_translates_for_every_driver() {
    for variant in Variant::all() {
        let name = format!("wavefront, {variant:?}");
        let text = Linkage::of(variant).text("wavefront_shading").expect("linked without a tracer");
        let (module, info) = validate(&name, &text);
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
        assert!(matches!(&error, GpuError::Shader { shader, .. } if shader == "the broken one"), "{error}");
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
    let linkage = check::linkage(Variant::default())
        .generate("broken", "#import lights\nfn f() -> f32 { return lightt(); }");
    validate("broken", &linkage.text("broken").expect("linked"));
}
