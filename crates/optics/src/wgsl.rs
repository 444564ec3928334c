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
    MODULES.get_or_init(|| everything::WGSL_SOURCE.imports.iter().map(|s| (s.name, render(s))).collect())
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

#[wgsl]
#[inline_all]
#[allow(unused_imports, reason = "the imports are the text: nothing here uses them")]
mod everything {
    use crate::accumulation::*;
    use crate::allocation::*;
    use crate::anisotropic::*;
    use crate::antialiasing::*;
    use crate::bounds::*;
    use crate::bsdf::*;
    use crate::camera::*;
    use crate::closure::*;
    use crate::clusters::*;
    use crate::color_nodes::*;
    use crate::constants::*;
    use crate::dielectric::*;
    use crate::direct_light::*;
    use crate::distortion::*;
    use crate::edge_stops::*;
    use crate::equirect::*;
    use crate::estimator::*;
    use crate::falloff::*;
    use crate::frame::*;
    use crate::fresnel::*;
    use crate::ggx::*;
    use crate::glossy::*;
    use crate::history::*;
    use crate::image_texture::*;
    use crate::interiors::*;
    use crate::intersect::*;
    use crate::iridescence::*;
    use crate::layered::*;
    use crate::layers::*;
    use crate::light::*;
    use crate::light_profile::*;
    use crate::light_tree::*;
    use crate::lobes::*;
    use crate::material::*;
    use crate::math::*;
    use crate::medium::*;
    use crate::noise::*;
    use crate::offset::*;
    use crate::path::*;
    use crate::pattern::*;
    use crate::patterns::*;
    use crate::phong::*;
    use crate::plain::*;
    use crate::portal::*;
    use crate::random::*;
    use crate::reprojection::*;
    use crate::reservoir::*;
    use crate::rounds::*;
    use crate::scatter::*;
    use crate::shaft::*;
    use crate::shape::*;
    use crate::sheen::*;
    use crate::signal::*;
    use crate::sky::*;
    use crate::spatial_filter::*;
    use crate::spherical_rectangle::*;
    use crate::spherical_triangle::*;
    use crate::terminator::*;
    use crate::texture_node::*;
    use crate::texture_point::*;
    use crate::tonemap::*;
    use crate::vertex::*;
    use crate::volume::*;
    use crate::voronoi::*;
    use crate::warp::*;
    use crate::wide_projection::*;
}
