//! The light transport as one WGSL text, for GPU back ends to put in front of their own shaders.

use inlining::inline_all;
use wgsl_rs::wgsl;

/// The complete text of all modules, each once, in an order that needs no forward knowledge: structures, constants and
/// functions, without entry points or bindings.
pub fn all() -> String {
    everything::WGSL_SOURCE.wgsl_source().expect("a test builds the text of every module")
}

/// The same without what only media that scatter need: for scenes that have none, so that they pay nothing.
pub fn without_volumes() -> String {
    surfaces::WGSL_SOURCE.wgsl_source().expect("a test builds the text of every module")
}

/// As before, and without what only layered surfaces need.
pub fn without_layers() -> String {
    plain::WGSL_SOURCE.wgsl_source().expect("a test builds the text of every module")
}

/// Only what decides about rounds of adaptive sampling, which concerns no scene.
pub fn rounds() -> String {
    choice::WGSL_SOURCE.wgsl_source().expect("a test builds the text of every module")
}

#[wgsl]
#[inline_all]
#[allow(unused_imports, reason = "the imports are the text: nothing here uses them")]
mod choice {
    use crate::rounds::*;
}

#[wgsl]
#[inline_all]
#[allow(unused_imports, reason = "the imports are the text: nothing here uses them")]
mod everything {
    use crate::allocation::*;
    use crate::anisotropic::*;
    use crate::bsdf::*;
    use crate::camera::*;
    use crate::constants::*;
    use crate::dielectric::*;
    use crate::edge_stops::*;
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
    use crate::offset::*;
    use crate::path::*;
    use crate::pattern::*;
    use crate::phong::*;
    use crate::plain::*;
    use crate::portal::*;
    use crate::random::*;
    use crate::reservoir::*;
    use crate::rounds::*;
    use crate::scatter::*;
    use crate::shape::*;
    use crate::sheen::*;
    use crate::signal::*;
    use crate::sky::*;
    use crate::spherical_rectangle::*;
    use crate::spherical_triangle::*;
    use crate::tonemap::*;
    use crate::volume::*;
    use crate::warp::*;
}

#[wgsl]
#[inline_all]
#[allow(unused_imports, reason = "the imports are the text: nothing here uses them")]
mod surfaces {
    use crate::allocation::*;
    use crate::anisotropic::*;
    use crate::bsdf::*;
    use crate::camera::*;
    use crate::constants::*;
    use crate::dielectric::*;
    use crate::edge_stops::*;
    use crate::estimator::*;
    use crate::falloff::*;
    use crate::frame::*;
    use crate::fresnel::*;
    use crate::ggx::*;
    use crate::glossy::*;
    use crate::history::*;
    use crate::image_texture::*;
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
    use crate::offset::*;
    use crate::path::*;
    use crate::pattern::*;
    use crate::phong::*;
    use crate::plain::*;
    use crate::portal::*;
    use crate::random::*;
    use crate::reservoir::*;
    use crate::scatter::*;
    use crate::shape::*;
    use crate::sheen::*;
    use crate::signal::*;
    use crate::sky::*;
    use crate::spherical_rectangle::*;
    use crate::spherical_triangle::*;
    use crate::tonemap::*;
    use crate::warp::*;
}

#[wgsl]
#[inline_all]
#[allow(unused_imports, reason = "the imports are the text: nothing here uses them")]
mod plain {
    use crate::allocation::*;
    use crate::bsdf::*;
    use crate::camera::*;
    use crate::constants::*;
    use crate::dielectric::*;
    use crate::edge_stops::*;
    use crate::estimator::*;
    use crate::falloff::*;
    use crate::frame::*;
    use crate::fresnel::*;
    use crate::ggx::*;
    use crate::glossy::*;
    use crate::history::*;
    use crate::image_texture::*;
    use crate::intersect::*;
    use crate::light::*;
    use crate::light_profile::*;
    use crate::light_tree::*;
    use crate::material::*;
    use crate::math::*;
    use crate::medium::*;
    use crate::offset::*;
    use crate::path::*;
    use crate::pattern::*;
    use crate::phong::*;
    use crate::plain::*;
    use crate::portal::*;
    use crate::random::*;
    use crate::reservoir::*;
    use crate::scatter::*;
    use crate::shape::*;
    use crate::signal::*;
    use crate::sky::*;
    use crate::spherical_rectangle::*;
    use crate::spherical_triangle::*;
    use crate::tonemap::*;
    use crate::warp::*;
}
