//! Photons for caustics: how they leave their lights, and how they are found again.
//!
//! `emission` sends them out, `integrate::volume::photons` follows them, `schedule::photon_passes` does
//! that for all photons of a pass, `map` finds them again, and `integrate::volume::gather` is where
//! camera paths ask. See `optics::photons` for the method and docs/caustics.md.

mod emission;
mod map;

pub(crate) use emission::{Emitted, PhotonLights};
pub(crate) use map::PhotonMap;

use optics::Vec3f;

/// Light that has arrived at a surface by specular scattering alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Photon {
    /// World position.
    pub position: Vec3f,
    /// Unit direction that the light came from.
    pub wi: Vec3f,
    /// Power, W; that of a pass adds up to the light's.
    pub flux: Vec3f,
    /// Unit geometric normal of the surface, on the side of the light.
    pub normal: Vec3f,
    /// Density with which it was emitted, for each photon, per étendue there: m⁻² sr⁻¹.
    pub density: f32,
    /// Segments of its way.
    pub segments: u32,
}
