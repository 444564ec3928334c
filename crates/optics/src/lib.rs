//! The light transport, written once.
//!
//! Every module holds pure functions of numbers in the Rust subset of `wgsl-rs`: rustc compiles them for the CPU, and
//! `module::WGSL_SOURCE` is the same text as WGSL for the GPU. Nothing here touches a buffer, a texture, a thread or a
//! device: who calls fetches data and passes numbers in.
//!
//! Conventions: `wo` points towards the camera, `wi` towards the light, both away from the surface, in the local frame
//! with the normal along +Z where a function says so. `alpha` is GGX width, roughness squared. A density always says
//! its measure. Depth counts as Mitsuba does: 1 is emission seen directly.

#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the standard library"))]
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
    pub use crate::builtins::{length, normalize};
    pub use wgsl_rs::std::{cross, dot, reflect};
}

// `#[wgsl]` needs its module inline, so each file holds one module of its own name; below they become flat.

/// Numbers and small functions that everything else uses.
mod base {
    pub mod constants;
    pub mod math;
}

/// What a picture needs before it is shown.
mod display {
    pub mod tonemap;
}

/// Frames, rays, intersections and cameras.
mod geometry {
    pub mod bounds;
    pub mod camera;
    pub mod distortion;
    pub mod frame;
    pub mod intersect;
    pub mod motion;
    pub mod moving_camera;
    pub mod offset;
    pub mod shape;
    pub mod shutter;
    pub mod terminator;
    pub mod wide_projection;
}

/// Where light comes from.
mod lights {
    pub mod equirect;
    pub mod falloff;
    pub mod light;
    pub mod moving_light;
    pub mod node;
    pub mod portal;
    pub mod portal_triangle;
    pub mod profile;
    pub mod reservoir;
    pub mod shaft;
    pub mod sky;
    pub mod tree;
}

/// Materials as records, and what they are at a point.
mod materials {
    pub mod image_texture;
    pub mod layers;
    pub mod material;
    pub mod plain;
    pub mod record;
}

/// What a real-time renderer makes of few samples: what it keeps from earlier frames, and what it borrows from neighbours.
mod realtime {
    pub mod accumulation;
    pub mod allocation;
    pub mod antialiasing;
    pub mod clusters;
    pub mod edge_stops;
    pub mod history;
    pub mod reprojection;
    pub mod signal;
    pub mod spatial_filter;
}

/// Random numbers, and what they are turned into.
mod sampling {
    pub mod alias_table;
    pub mod random;
    pub mod rounds;
    pub mod spherical_rectangle;
    pub mod spherical_triangle;
    pub mod warp;
}

/// How surfaces scatter light.
mod surface {
    pub mod anisotropic;
    pub mod bsdf;
    pub mod closure;
    pub mod dielectric;
    pub mod fresnel;
    pub mod ggx;
    pub mod glossy;
    pub mod iridescence;
    pub mod layered;
    pub mod lobes;
    pub mod oren_nayar;
    pub mod pattern;
    pub mod phong;
    pub mod scatter;
    pub mod sheen;
}

/// Textures as values: noise, patterns, colours, and the nodes of graphs that combine them.
mod textures {
    pub mod color_nodes;
    pub mod noise;
    pub mod patterns;
    pub mod texture_node;
    pub mod texture_point;
    pub mod voronoi;
}

/// Paths, and the statistics of what they bring.
mod transport {
    pub mod direct_light;
    pub mod estimator;
    pub mod guiding;
    pub mod interiors;
    pub mod medium;
    pub mod mis;
    pub mod path;
    pub mod photons;
    pub mod vertex;
    pub mod volume;
}

// Flat, as shaders import them.
pub use base::{constants::constants, math::math};
pub use display::tonemap::tonemap;
pub use geometry::{
    bounds::bounds, camera::camera, distortion::distortion, frame::frame, intersect::intersect,
    motion::motion, moving_camera::moving_camera, offset::offset, shape::shape, shutter::shutter,
    terminator::terminator, wide_projection::wide_projection,
};
pub use lights::{
    equirect::equirect, falloff::falloff, light::light, moving_light::moving_light, node as light_node,
    portal::portal, portal_triangle, profile::light_profile, reservoir::reservoir, shaft::shaft, sky::sky,
    tree::light_tree,
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
    ggx::ggx, glossy::glossy, iridescence::iridescence, layered::layered, lobes::lobes,
    oren_nayar::oren_nayar, pattern::pattern, phong::phong, scatter::scatter, sheen::sheen,
};
pub use textures::{
    color_nodes::color_nodes, noise::noise, patterns::patterns, texture_node::texture_node,
    texture_point::texture_point, voronoi::voronoi,
};
pub use transport::{
    direct_light::direct_light, estimator::estimator, guiding::guiding, interiors::interiors, medium::medium,
    mis::mis, path::path, photons::photons, vertex::vertex, volume::volume,
};

pub mod albedo;
pub mod builtins;
pub mod wgsl;
