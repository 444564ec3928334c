//! The light transport as WGSL, module by module, for GPU back ends whose shaders import what they need.

use inlining::inline_all;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use wgsl_rs::{Source, ir, wgsl};

/// A module of this crate as WGSL: structures, constants and functions, without entry points or bindings.
#[derive(Clone, Debug)]
pub struct Module {
    /// Names of the modules without which its text is not complete.
    pub imports: Vec<&'static str>,
    /// Its own text, without theirs.
    pub text: String,
}

/// The module of a name; `None` if there is none.
pub fn module(name: &str) -> Option<&'static Module> {
    modules().get(name)
}

/// All modules by name.
pub fn modules() -> &'static BTreeMap<&'static str, Module> {
    static MODULES: OnceLock<BTreeMap<&'static str, Module>> = OnceLock::new();
    MODULES.get_or_init(|| {
        let mut modules = BTreeMap::new();
        add_imports(&everything::WGSL_SOURCE, &mut modules);
        modules
    })
}

/// Adds all that a module imports, and what that imports.
fn add_imports(source: &'static Source, modules: &mut BTreeMap<&'static str, Module>) {
    for import in source.imports {
        if !modules.contains_key(import.name) {
            modules.insert(import.name, render(import));
            add_imports(import, modules);
        }
    }
}

/// The complete text of all modules, each once, in an order that needs no forward knowledge.
pub fn all() -> String {
    everything::WGSL_SOURCE.wgsl_source().expect("a test builds the text of every module")
}

/// Renders one module as `Source::wgsl_source` does it with all that a module imports, but for that. A template of which two
/// modules have the same instance would be there twice, which is why modules share none.
fn render(source: &'static Source) -> Module {
    let mut module = (source.ir_constructor)();
    ir::deshadow_module(&mut module);
    let mut types = ir::TypeImports::default();
    collect_types(source, &mut types);
    types.extend(ir::type_imports(&module));
    ir::suffix_module_with_type_imports(&mut module, &types);
    let imports = source.imports.iter().map(|s| s.name).collect();
    Module { imports, text: ir::render_module(&module) }
}

/// What a module knows of the types of all that it imports: literals are given the right types by them.
fn collect_types(source: &'static Source, types: &mut ir::TypeImports) {
    for import in source.imports {
        collect_types(import, types);
        let mut module = (import.ir_constructor)();
        ir::deshadow_module(&mut module);
        types.extend(ir::type_imports(&module));
    }
}

/// The modules that no other one imports; those that are imported come with them.
#[wgsl]
#[inline_all]
#[allow(unused_imports, reason = "the imports are the text: nothing here uses them")]
mod everything {
    use crate::accumulation::*;
    use crate::antialiasing::*;
    use crate::camera::*;
    use crate::closure::*;
    use crate::clusters::*;
    use crate::direct_light::*;
    use crate::equirect::*;
    use crate::guiding::*;
    use crate::interiors::*;
    use crate::intersect::*;
    use crate::layers::*;
    use crate::light_profile::*;
    use crate::moving_camera::*;
    use crate::moving_light::*;
    use crate::offset::*;
    use crate::photons::*;
    use crate::plain::*;
    use crate::portal::*;
    use crate::reprojection::*;
    use crate::reservoir::*;
    use crate::rounds::*;
    use crate::shaft::*;
    use crate::shape::*;
    use crate::shutter::*;
    use crate::spatial_filter::*;
    use crate::terminator::*;
    use crate::texture_node::*;
    use crate::volume::*;
}
