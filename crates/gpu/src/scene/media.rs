//! Media and grids of densities as the shaders read them, in `words`. Shaders know the places of the fields by name.

#![allow(missing_docs, reason = "the fields are explained where the scene's tables declare them")]

use bytemuck::{Pod, Zeroable};
use scene::tables::{GridRecord, MediumRecord, NONE};

/// Set on media that are the inside of what looks like a surface.
pub const MEDIUM_SUBSURFACE: u32 = 1;

/// A medium, in `words`; see [`scene::tables::MediumRecord`] for the fields.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Medium {
    pub absorption: [f32; 3],
    /// Where its grid begins, in `words`, or `NONE`.
    pub grid: u32,
    pub scattering: [f32; 3],
    /// [`MEDIUM_SUBSURFACE`].
    pub flags: u32,
    pub emission: [f32; 3],
    pub anisotropy: f32,
}

/// Where densities are, in `words`; see [`scene::tables::GridRecord`] for the fields.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Grid {
    pub low: [f32; 3],
    /// Where its densities begin, in `words`.
    pub first: u32,
    pub high: [f32; 3],
    pub largest: f32,
    pub size: [u32; 3],
    pub padding: u32,
}

/// Names that shaders have for the places of the fields of media and grids, with their values in words.
pub fn medium_constants() -> impl Iterator<Item = (&'static str, u32)> {
    macro_rules! places {
        ($($name:literal: $of:ident.$field:ident),* $(,)?) => {
            [$(($name, (std::mem::offset_of!($of, $field) / 4) as u32)),*]
        };
    }
    let fields = places! {
        "MEDIUM_ABSORPTION": Medium.absorption,
        "MEDIUM_GRID": Medium.grid,
        "MEDIUM_SCATTERING": Medium.scattering,
        "MEDIUM_FLAGS": Medium.flags,
        "MEDIUM_EMISSION": Medium.emission,
        "MEDIUM_ANISOTROPY": Medium.anisotropy,
        "GRID_LOW": Grid.low,
        "GRID_FIRST": Grid.first,
        "GRID_HIGH": Grid.high,
        "GRID_LARGEST": Grid.largest,
        "GRID_SIZE": Grid.size,
    };
    fields.into_iter().chain([("MEDIUM_SUBSURFACE", MEDIUM_SUBSURFACE)])
}

/// A medium; `grids`: where those begin, in `words`.
pub fn medium_record(m: &MediumRecord, grids: u32) -> Medium {
    let in_words = |grid: u32| grids + grid * (size_of::<Grid>() / 4) as u32;
    Medium {
        absorption: m.absorption,
        grid: if m.grid == NONE { NONE } else { in_words(m.grid) },
        scattering: m.scattering,
        flags: if m.subsurface { MEDIUM_SUBSURFACE } else { 0 },
        emission: m.emission,
        anisotropy: m.anisotropy,
    }
}

/// A grid; `densities`: where those begin, in `words`.
pub fn grid_record(g: &GridRecord, densities: u32) -> Grid {
    let (first, padding) = (densities + g.first, 0);
    Grid { low: g.low, first, high: g.high, largest: g.largest, size: g.size, padding }
}
