//! How surfaces scatter light.
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
pub mod pattern;
pub mod phong;
pub mod scatter;
pub mod sheen;
