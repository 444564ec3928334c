//! How surfaces scatter light.
pub mod bsdf;
pub mod dielectric;
pub mod fresnel;
pub mod ggx;
pub mod glossy;
pub mod pattern;
pub mod scatter;
