//! The light transport, written once.
//!
//! Every module holds pure functions of numbers in the Rust subset of `wgsl-rs`: rustc compiles them for the CPU, and
//! `module::WGSL_SOURCE` is the same text as WGSL for the GPU. Nothing here touches a buffer, a texture, a thread or a
//! device: who calls fetches data and passes numbers in.
//!
//! Conventions: `wo` points towards the camera, `wi` towards the light, both away from the surface, in the local frame
//! with the normal along +Z where a function says so. `alpha` is GGX width, roughness squared. A density always says
//! its measure. Depth counts as Mitsuba does: 1 is emission seen directly.

// Conventions of WGSL that rustc and clippy would write otherwise: fields are named in full, `if` is a statement,
// and a module has the name of its file so that imports read the same in both languages.
#![allow(clippy::redundant_field_names, clippy::module_inception, clippy::needless_return)]
#![allow(
    clippy::excessive_precision,
    clippy::approx_constant,
    clippy::collapsible_if,
    clippy::collapsible_else_if,
    clippy::manual_clamp
)]
#![allow(clippy::needless_range_loop, clippy::assign_op_pattern, clippy::wrong_self_convention)]
// The macro makes an undocumentable static in every module; a test sees to it that functions and constants have docs.
#![allow(missing_docs)]

pub use wgsl_rs::std::{Vec2f, Vec2u, Vec3f, Vec4f, Vec4i, Vec4u, vec2f, vec2u, vec3f, vec4f};

/// The functions of WGSL on vectors, for host code that works with the same types.
pub mod vector {
    pub use wgsl_rs::std::{cross, dot, length, normalize, reflect};
}

mod base;
mod display;
mod geometry;
mod lights;
mod materials;
mod realtime;
mod sampling;
mod surface;
mod textures;
mod transport;

// `#[wgsl]` needs its module inline, so each file holds one module of its own name; here they become flat.
pub use base::{constants::constants, math::math};
pub use display::tonemap::tonemap;
pub use geometry::{
    bounds::bounds, camera::camera, distortion::distortion, frame::frame, intersect::intersect,
    offset::offset, shape::shape, terminator::terminator, wide_projection::wide_projection,
};
pub use lights::{
    equirect::equirect, falloff::falloff, light::light, node as light_node, portal::portal, portal_triangle,
    profile::light_profile, reservoir::reservoir, shaft::shaft, sky::sky, tree::light_tree,
};
pub use materials::{
    image_texture::image_texture, layers::layers, material::material, plain::plain, record::WgslRecord,
};
pub use realtime::{
    accumulation::accumulation, allocation::allocation, antialiasing::antialiasing, clusters::clusters,
    edge_stops::edge_stops, history::history, reprojection::reprojection, signal::signal,
    spatial_filter::spatial_filter,
};
pub use sampling::{
    alias_table, random::random, rounds::rounds, spherical_rectangle::spherical_rectangle,
    spherical_triangle::spherical_triangle, warp::warp,
};
pub use surface::{
    anisotropic::anisotropic, bsdf::bsdf, closure::closure, dielectric::dielectric, fresnel::fresnel,
    ggx::ggx, glossy::glossy, iridescence::iridescence, layered::layered, lobes::lobes, pattern::pattern,
    phong::phong, scatter::scatter, sheen::sheen,
};
pub use textures::{
    color_nodes::color_nodes, noise::noise, patterns::patterns, texture_node::texture_node,
    texture_point::texture_point, voronoi::voronoi,
};
pub use transport::{
    direct_light::direct_light, estimator::estimator, interiors::interiors, medium::medium, path::path,
    vertex::vertex, volume::volume,
};

pub mod albedo;
pub mod builtins;
pub mod wgsl;
