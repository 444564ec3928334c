//! Shafts: where the shadow rays of a tile of pixels to a light begin their walk. `shaders/hybrid_shafts.wgsl` makes and uses them.

use crate::GpuScene;
use crate::scene::records::LightRecord;
use crate::shader::Linkage;
use crate::shader::constants::numbers;

/// Side of a tile in pixels, a multiple of 8. With 16 the lists cost a third, and rays more than that saves: see docs/performance.md.
const TILE: u32 = 8;

/// Most nodes of a list.
const ENTRIES: u32 = 5;

/// Most lights for which shafts are made. Of more, most reach few tiles, and lists for all of them would take too much memory.
const MOST_LIGHTS: u64 = 32;

/// Words that are read together.
const GROUP: u64 = 4;

/// The shafts of a scene's lights.
#[derive(Clone, Debug)]
pub(super) struct Shafts {
    /// What passes are linked with that make or use shafts.
    pub linkage: Linkage,
    /// Lights that there is room for.
    lights: u64,
}

impl Shafts {
    /// For a scene's lights, all that its buffer has room for, if they are not too many. `below`: what the tracer
    /// brings for walks that begin below the root, if it has them.
    pub fn new(scene: &GpuScene, below: Option<Linkage>) -> Option<Self> {
        let lights = scene.buffers.lights.size() / size_of::<LightRecord>() as u64;
        let below = below.filter(|_| lights <= MOST_LIGHTS)?;
        Some(Self { linkage: linkage(&below), lights })
    }

    /// Tiles of a window, or of some of its rows, to the right and downwards.
    pub fn tiles(size: [u32; 2]) -> [u32; 2] {
        size.map(|n| n.div_ceil(TILE))
    }

    /// Lists for some lights of a window.
    pub fn lists(size: [u32; 2], lights: u32) -> u64 {
        Self::tiles(size).into_iter().chain([lights]).map(u64::from).product()
    }

    /// Words of memory for a window: a box for each tile, a list for each tile and light, and what is lost where they begin.
    pub fn words(&self, size: [u32; 2]) -> u64 {
        const BOX: u64 = 2;
        const LIST: u64 = 1 + 2 * ENTRIES as u64;
        GROUP * (1 + Self::lists(size, 1) * (BOX + self.lights * LIST))
    }
}

/// What passes are linked with that make or use shafts, by a tracer whose walks may begin below the root.
pub(crate) fn linkage(below: &Linkage) -> Linkage {
    Linkage::default()
        .with(below)
        .bind("entry_lists", "hybrid_shaft_lists")
        .bind("shafts", "hybrid_shaft_rays")
        .generate("shaft_numbers", numbers([("SHAFT_TILE", TILE), ("SHAFT_ENTRIES", ENTRIES)]))
}

#[cfg(test)]
mod tests;
