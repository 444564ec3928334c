//! What is done for a tile, step by step: which pass reads and writes which buffer.

use super::passes::PassId;
use bytemuck::{Pod, Zeroable};
use post::Tile;

/// A buffer of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Memory {
    /// What is filtered, as [`post::Prepared::pixels`] has it.
    Picture,
    /// What a layer of the network hands on, by its number in [`PLANES`].
    Plane(usize),
    /// A level of the picture, times trust; then, but for the finest, the result of the level.
    Trusted(usize),
    /// A level, filtered.
    Filtered(usize),
    /// What is kept of the tile, filtered.
    Result,
    /// Weights of a convolution.
    Weights(usize),
    /// Its bias.
    Bias(usize),
    /// Weights of the head of a level.
    HeadWeights(usize),
    /// Its bias.
    HeadBias(usize),
    /// Weights and bias of the trust logits.
    TrustWeights,
}

/// Levels of the filter: the picture, and half, a quarter, and so on to a 32nd of its resolution.
pub const LEVELS: usize = 6;

/// Planes of activations: level of the network, of which level 0 has half the picture's resolution,
/// and channels.
pub const PLANES: [(usize, usize); 14] = [
    (0, 64),
    (0, 64),
    (0, 48),
    (1, 64),
    (1, 64),
    (1, 64),
    (2, 80),
    (2, 80),
    (2, 80),
    (3, 96),
    (3, 96),
    (3, 96),
    (4, 96),
    (4, 96),
];

const A0: usize = 0;
const B0: usize = 1;
const X0: usize = 2;
const X1: usize = 3;
const M1: usize = 4;
const Y1: usize = 5;
const X2: usize = 6;
const M2: usize = 7;
const Y2: usize = 8;
const X3: usize = 9;
const M3: usize = 10;
const Y3: usize = 11;
const M4: usize = 12;
const Y4: usize = 13;

/// A convolution: planes and channels of what it reads and writes.
struct Convolution {
    /// The input of half the resolution, if there is one.
    coarse: Option<(usize, u32)>,
    /// The other.
    fine: (usize, u32),
    /// Whether that has double the resolution, and the largest of each 2×2 counts.
    pools: bool,
    to: (usize, u32),
}

const fn same(fine: (usize, u32), to: (usize, u32)) -> Convolution {
    Convolution { coarse: None, fine, pools: false, to }
}

const fn pooled(fine: (usize, u32), to: (usize, u32)) -> Convolution {
    Convolution { coarse: None, fine, pools: true, to }
}

const fn merged(coarse: (usize, u32), fine: (usize, u32), to: (usize, u32)) -> Convolution {
    Convolution { coarse: Some(coarse), fine, pools: false, to }
}

/// All convolutions, in their order.
const CONVOLUTIONS: [Convolution; 15] = [
    same((A0, 48), (B0, 48)),
    same((B0, 48), (X0, 48)),
    pooled((X0, 48), (X1, 64)),
    pooled((X1, 64), (X2, 80)),
    pooled((X2, 80), (X3, 96)),
    pooled((X3, 96), (M4, 96)),
    same((M4, 96), (Y4, 96)),
    merged((Y4, 96), (X3, 96), (M3, 96)),
    same((M3, 96), (Y3, 96)),
    merged((Y3, 96), (X2, 80), (M2, 80)),
    same((M2, 80), (Y2, 80)),
    merged((Y2, 80), (X1, 64), (M1, 64)),
    same((M1, 64), (Y1, 64)),
    merged((Y1, 64), (X0, 48), (A0, 64)),
    same((A0, 64), (B0, 64)),
];

/// What the decoder says, from half the resolution to a 32nd: plane and channels.
const DECODED: [(usize, u32); 5] = [(B0, 64), (Y1, 64), (Y2, 80), (Y3, 96), (Y4, 96)];

/// What a pass is told; see `shaders/denoise_step.wgsl` for the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct DenoiseStep {
    size: [u32; 2],
    coarse_quads: u32,
    fine_quads: u32,
    scale: u32,
    unused: u32,
    core: [u32; 2],
    region: [u32; 2],
}

/// A pass with what it reads and writes, beside its uniform.
pub struct Step {
    /// Which pass.
    pub pass: PassId,
    /// What it is told.
    pub told: DenoiseStep,
    /// What it binds, by the number of the binding.
    pub binds: Vec<(u32, Memory)>,
    /// Workgroups across and down.
    pub groups: [u32; 2],
}

impl Step {
    /// A step that writes a level of `size`; workgroups are 8×8 pixels.
    fn new(pass: PassId, size: [u32; 2], told: DenoiseStep, binds: Vec<(u32, Memory)>) -> Self {
        let groups = size.map(|side| side.div_ceil(8));
        Self { pass, told: DenoiseStep { size, ..told }, binds, groups }
    }
}

/// The region's size at a level of the filter.
fn size_of_level(tile: &Tile, level: usize) -> [u32; 2] {
    [tile.region.width >> level, tile.region.height >> level].map(|side| side as u32)
}

/// All steps of a tile, of which `kept` columns and rows of the core are in the picture.
pub fn steps(tile: &Tile, kept: [u32; 2]) -> Vec<Step> {
    let plain = DenoiseStep::default();
    let mut steps = vec![Step::new(
        PassId::Features,
        size_of_level(tile, 1),
        plain,
        vec![(1, Memory::Picture), (2, Memory::Plane(A0))],
    )];
    steps.extend((0..CONVOLUTIONS.len()).map(|layer| convolution(tile, layer)));
    steps.extend(filter(tile));
    let [x, y] = [tile.core.x - tile.region.x, tile.core.y - tile.region.y];
    let told =
        DenoiseStep { core: [x as u32, y as u32], region: size_of_level(tile, 0), ..DenoiseStep::default() };
    let binds = vec![
        (1, Memory::Picture),
        (2, Memory::Filtered(0)),
        (3, Memory::Trusted(1)),
        (4, Memory::Trusted(0)),
        (5, Memory::Result),
    ];
    steps.push(Step::new(PassId::Finish, kept, told, binds));
    steps
}

fn convolution(tile: &Tile, layer: usize) -> Step {
    let Convolution { coarse, fine, pools, to } = &CONVOLUTIONS[layer];
    let told = DenoiseStep {
        coarse_quads: coarse.map_or(0, |(_, channels)| channels / 4),
        fine_quads: fine.1 / 4,
        scale: u32::from(*pools),
        ..DenoiseStep::default()
    };
    let binds = vec![
        // What is not there is not read.
        (1, Memory::Plane(coarse.map_or(fine.0, |(plane, _)| plane))),
        (2, Memory::Plane(fine.0)),
        (3, Memory::Weights(layer)),
        (4, Memory::Bias(layer)),
        (5, Memory::Plane(to.0)),
    ];
    let size = size_of_level(tile, PLANES[to.0].0 + 1);
    let step = Step::new(PassId::Convolve(to.1), size, told, binds);
    Step { groups: [size[0].div_ceil(16), size[1].div_ceil(8)], ..step }
}

/// From what the decoder says to the filtered levels, all but the finest put together.
fn filter(tile: &Tile) -> Vec<Step> {
    let decoded = |level: usize| DECODED[level.max(1) - 1];
    let told = |level: usize, scale| DenoiseStep {
        fine_quads: decoded(level).1 / 4,
        scale,
        ..DenoiseStep::default()
    };
    let trust = vec![
        (1, Memory::Picture),
        (3, Memory::Plane(decoded(0).0)),
        (4, Memory::TrustWeights),
        (5, Memory::Trusted(0)),
    ];
    let mut steps = vec![Step::new(PassId::Trust, size_of_level(tile, 1), told(0, 0), trust)];
    steps.extend((1..LEVELS).map(|level| {
        let binds = vec![(1, Memory::Trusted(level - 1)), (2, Memory::Trusted(level))];
        Step::new(PassId::Halve, size_of_level(tile, level), DenoiseStep::default(), binds)
    }));
    steps.extend((0..LEVELS).map(|level| {
        let binds = vec![
            (1, Memory::Trusted(level)),
            (2, Memory::HeadWeights(level)),
            (3, Memory::Plane(decoded(level).0)),
            (4, Memory::HeadBias(level)),
            (5, Memory::Filtered(level)),
        ];
        let scale = if level == 0 { 2 } else { 1 };
        let size = size_of_level(tile, level.max(1));
        let step = Step::new(PassId::Filter, size, told(level, scale), binds);
        Step { groups: [size[0].div_ceil(32), size[1].div_ceil(8)], ..step }
    }));
    steps.extend((1..LEVELS - 1).rev().map(|level| {
        let coarse =
            if level + 2 == LEVELS { Memory::Filtered(level + 1) } else { Memory::Trusted(level + 1) };
        let binds = vec![(2, Memory::Filtered(level)), (3, coarse), (4, Memory::Trusted(level))];
        Step::new(PassId::Combine, size_of_level(tile, level), DenoiseStep::default(), binds)
    }));
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::assert_layout;
    use crate::shader::check;

    #[test]
    fn steps_lie_as_in_the_shader() {
        let module = check::module("denoise_coarser");
        assert_layout!(module, DenoiseStep { size, coarse_quads, fine_quads, scale, unused, core, region });
    }
}
