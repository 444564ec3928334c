//! What happens where paths hit and miss: emission, light samples, scattering.

pub(crate) mod aov;
pub(crate) mod closures;
pub(crate) mod features;
pub(crate) mod glossy_lanes;
pub(crate) mod hits;
pub(crate) mod light_lanes;
pub(crate) mod lights;
pub(crate) mod material;
pub(crate) mod misses;
pub(crate) mod path_batch;
pub(crate) mod scatter;
pub(crate) mod scatter_lanes;
pub(crate) mod scattering;
pub(crate) mod stages;
