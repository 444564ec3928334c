//! For tests: texts without a device.

use super::{Linkage, Variant};
use crate::bindings::PassBinding;
use crate::film::VIEW;
use crate::pass::PassSpec;
use crate::realtime::planes;
use crate::tracer::query;

/// The module of a text.
pub(crate) fn parse(text: &str) -> naga::Module {
    naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)))
}

/// The validated module of a text.
pub(crate) fn validate(name: &str, text: &str) -> (naga::Module, naga::valid::ModuleInfo) {
    let module = parse(text);
    let flags = naga::valid::ValidationFlags::all();
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    (module, info)
}

/// What an entry point uses of a group.
fn used(
    module: &naga::Module,
    info: &naga::valid::ModuleInfo,
    entry_point: &str,
    group: u32,
) -> Vec<PassBinding> {
    let index = module.entry_points.iter().position(|e| e.name == entry_point);
    let info = info.get_entry_point(index.expect("an entry point"));
    let variables = module.global_variables.iter().filter(|(handle, _)| !info[*handle].is_empty());
    let mut used: Vec<_> = variables
        .filter_map(|(_, v)| {
            let binding = v.binding.filter(|b| b.group == group)?.binding;
            Some(match v.space {
                naga::AddressSpace::Uniform => PassBinding::Uniform(binding),
                naga::AddressSpace::Storage { access } if access.contains(naga::StorageAccess::STORE) => {
                    PassBinding::Write(binding)
                }
                naga::AddressSpace::Storage { .. } => PassBinding::Read(binding),
                _ => PassBinding::Texture(binding),
            })
        })
        .collect();
    used.sort_unstable();
    used
}

/// Fails unless a pass binds what its shader uses, writes what it may, needs no more storage buffers than a device must have, and can
/// be written for every driver.
pub(crate) fn check_pass(spec: &PassSpec, linkage: &Linkage, with: &str) {
    let (module, info) = check_bindings(spec, linkage, with);
    write_all_languages(&format!("{}, {with}", spec.name), &module, &info, spec.entry_point);
}

/// As [`check_pass`], of a pass that not every driver can have.
pub(crate) fn check_bindings(
    spec: &PassSpec,
    linkage: &Linkage,
    with: &str,
) -> (naga::Module, naga::valid::ModuleInfo) {
    const SCENE: usize = 6;
    /// The least that our own hierarchy has: instances, a page of nodes, a page of primitives.
    const TRACER: usize = 3;
    let name = format!("{}, {with}", spec.name);
    let text = linkage.text(spec.module).unwrap_or_else(|e| panic!("{name}: {e}"));
    let (module, info) = validate(&name, &text);
    // The view is bound with the rest of the film, whether it is used or not.
    let sorted = |bindings: &[PassBinding], is_film: bool| {
        let mut bindings: Vec<_> = bindings.iter().copied().filter(|b| !is_film || *b != VIEW).collect();
        bindings.sort_unstable();
        bindings
    };
    for (group, bindings) in [(2, spec.film), (3, spec.own)] {
        let used = sorted(&used(&module, &info, spec.entry_point, group), group == 2);
        assert_eq!(used, sorted(bindings, group == 2), "{name}, group {group}");
    }
    let uses = |group| !used(&module, &info, spec.entry_point, group).is_empty();
    assert_eq!((spec.sees_scene || !uses(0), spec.traces), (true, uses(1)), "{name}");
    let is_storage = |b: &&PassBinding| matches!(b, PassBinding::Read(_) | PassBinding::Write(_));
    let count = if spec.sees_scene { SCENE } else { 0 }
        + if spec.traces { TRACER } else { 0 }
        + spec.film.iter().chain(spec.own).filter(is_storage).count();
    assert!(count <= crate::STORAGE_BUFFERS as usize, "{name}: {count} buffers");
    (module, info)
}

/// Writes a module as SPIR-V, HLSL and MSL. `function`: a name that each text has to have.
pub(crate) fn write_all_languages(
    name: &str,
    module: &naga::Module,
    info: &naga::valid::ModuleInfo,
    function: &str,
) {
    use naga::back::{hlsl, msl, spv};
    let options = spv::Options { lang_version: (1, 4), ..Default::default() };
    let words = spv::write_vec(module, info, &options, None);
    assert!(words.is_ok_and(|w| w.len() > 500), "{name}: SPIR-V");

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

/// What tests link modules with: ray queries, and buffers that may be written where a pass decides about that.
pub(crate) fn linkage(variant: Variant) -> Linkage {
    Linkage::of(variant)
        .with(&query::linkage())
        .with(&planes(&[]))
        .bind("kernel", "kernel_path")
        .bind("question", "rays_closest")
}

/// As [`module`], where a name is defined.
pub(crate) fn module_with(name: &str, define: &'static str) -> naga::Module {
    parse(&linkage(Variant::default()).define(define).text(name).expect("linked"))
}

/// A module with all that it imports.
pub(crate) fn module(name: &str) -> naga::Module {
    parse(&linkage(Variant::default()).text(name).expect("linked"))
}
