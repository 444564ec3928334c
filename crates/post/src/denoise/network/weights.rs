//! The network's weights: what must be in a file, and how kernels want it.

use super::convolution::{Convolution, Head, Line, Merging, Weights};
use super::lanes::LANES;
use half::f16;
use safetensors::{Dtype, SafeTensors};
use std::ops::Range;

/// The weights that are compiled in; `training/denoiser/README.md` says how they were made.
pub const TRAINED: &[u8] = include_bytes!("../../../weights/denoiser.safetensors");

/// Layers of 3×3: name, channels in, channels out. Two inputs are `FIRST + SECOND`.
pub const CONVOLUTIONS: [(&str, usize, usize); 15] = [
    ("e0a", 44, 48),
    ("e0b", 48, 48),
    ("e1", 48, 64),
    ("e2", 64, 80),
    ("e3", 80, 96),
    ("e4a", 96, 96),
    ("e4b", 96, 96),
    ("d3a", 96 + 96, 96),
    ("d3b", 96, 96),
    ("d2a", 96 + 80, 80),
    ("d2b", 80, 80),
    ("d1a", 80 + 64, 64),
    ("d1b", 64, 64),
    ("d0a", 64 + 48, 64),
    ("d0b", 64, 64),
];

/// Layers of 1×1: name, channels in, channels out.
pub const HEADS: [(&str, usize, usize); 6] =
    [("h0", 64, 4 * 29), ("h1", 64, 27), ("h2", 64, 27), ("h3", 80, 27), ("h4", 96, 27), ("h5", 96, 25)];

/// What a pixel's 25 logits and what else is said of it take: two blocks of outputs, the last of
/// which are unused.
pub const SLOTS: usize = 2 * LANES;

/// The slot of the trust logit, of level 0.
pub const TRUST: usize = 25;

/// The slot of the logit that says how much comes from the coarser level.
pub const ALPHA: usize = 26;

/// The slot of the logit that says how much is filtered without albedo, of level 0.
pub const BETA: usize = 27;

/// The slot of the logit that says how much of a level's own detail is kept.
pub const DETAIL: usize = 28;

/// Slots that are the kernel's.
const KERNEL: usize = 25;

/// Why a file cannot be used as weights.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// It is damaged or of another format.
    #[error("the weights are no safetensors file: {0}")]
    Format(String),
    /// A tensor is not there.
    #[error("the weights lack the tensor `{0}`")]
    Missing(String),
    /// A tensor has other sides.
    #[error("the tensor `{tensor}` of the weights has the shape {found:?} instead of {expected:?}")]
    Shape {
        /// Its name.
        tensor: String,
        /// What it has.
        found: Vec<usize>,
        /// What it must have.
        expected: Vec<usize>,
    },
    /// A tensor is not of 16-bit floats.
    #[error("the tensor `{tensor}` of the weights is of type {found} instead of F16")]
    Type {
        /// Its name.
        tensor: String,
        /// Its type.
        found: String,
    },
    /// A tensor has an infinite value or a NaN.
    #[error("the tensor `{0}` of the weights has a value that is not finite")]
    NotFinite(String),
}

/// All layers, as kernels want them. Names are those of the specification: encoder, decoder, heads;
/// the digit is the level.
#[derive(Clone, Debug)]
pub struct Layers {
    pub e0a: Convolution,
    pub e0b: Convolution,
    pub e1: Convolution,
    pub e2: Convolution,
    pub e3: Convolution,
    pub e4a: Convolution,
    pub e4b: Convolution,
    pub d3a: Merging,
    pub d3b: Convolution,
    pub d2a: Merging,
    pub d2b: Convolution,
    pub d1a: Merging,
    pub d1b: Convolution,
    pub d0a: Merging,
    pub d0b: Convolution,
    /// The trust logits of the four pixels that a pixel of half the resolution stands for, then
    /// their logits beta.
    pub trust: Head,
    /// The logits of each level. Level 0 has [`SLOTS`] for each of four pixels, row by row; the
    /// others [`SLOTS`].
    pub heads: [Head; 6],
}

impl Layers {
    /// Reads a safetensors file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        let file = SafeTensors::deserialize(bytes).map_err(|e| WeightsError::Format(e.to_string()))?;
        let convolution = |name: &str| Ok(Plain::read_convolution(&file, name)?.convolution());
        let merging = |name: &str, coarse: usize| Ok(Plain::read_convolution(&file, name)?.merging(coarse));
        let head = |level: usize| Plain::read_head(&file, level);
        let finest = head(0)?;
        Ok(Self {
            e0a: convolution("e0a")?,
            e0b: convolution("e0b")?,
            e1: convolution("e1")?,
            e2: convolution("e2")?,
            e3: convolution("e3")?,
            e4a: convolution("e4a")?,
            e4b: convolution("e4b")?,
            d3a: merging("d3a", 96)?,
            d3b: convolution("d3b")?,
            d2a: merging("d2a", 96)?,
            d2b: convolution("d2b")?,
            d1a: merging("d1a", 80)?,
            d1b: convolution("d1b")?,
            d0a: merging("d0a", 64)?,
            d0b: convolution("d0b")?,
            trust: finest.linear(LANES, |i| match i {
                0..4 => Some(4 * TRUST + i),
                4..8 => Some(4 * BETA + i - 4),
                _ => None,
            }),
            heads: [
                finest.linear(4 * SLOTS, |i| {
                    let (pixel, slot) = (i / SLOTS, i % SLOTS);
                    (slot <= DETAIL).then_some(4 * slot + pixel)
                }),
                head(1)?.coarse_head(),
                head(2)?.coarse_head(),
                head(3)?.coarse_head(),
                head(4)?.coarse_head(),
                head(5)?.coarse_head(),
            ],
        })
    }
}

/// All layers as the file has them: for devices that run the network themselves.
#[derive(Clone, Debug)]
pub struct NetworkWeights {
    /// Layers of 3×3 in the order in which they are applied, with their names: encoder `e0a`, `e0b`,
    /// `e1` to `e3`, `e4a`, `e4b`, decoder `d3a`, `d3b` to `d0a`, `d0b`. The first inputs of a layer
    /// `d…a` are the coarser level's, enlarged by repeating pixels; those after them are the
    /// encoder's.
    pub convolutions: Vec<(&'static str, Plain)>,
    /// Layers of 1×1 that say the logits of level 0 (116 outputs: slot `k` of the pixel in row `i`
    /// and column `j` of 2×2 is output `4 k + 2 i + j`) to 5. Slots are the 25 of the kernel, then
    /// alpha and detail; at level 0 trust, alpha, beta and detail. Level 5 has the kernel alone.
    pub heads: Vec<Plain>,
}

impl NetworkWeights {
    /// Those of the network that was trained for this renderer.
    ///
    /// # Errors
    /// None but for a damaged program; a test reads them.
    pub fn trained() -> Result<Self, WeightsError> {
        Self::from_bytes(TRAINED)
    }

    /// Reads a safetensors file.
    ///
    /// # Errors
    /// As [`super::Network::from_bytes`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        let file = SafeTensors::deserialize(bytes).map_err(|e| WeightsError::Format(e.to_string()))?;
        let named = |(name, _, _)| Ok((name, Plain::read_convolution(&file, name)?));
        let convolutions = CONVOLUTIONS.into_iter().map(named).collect::<Result<_, WeightsError>>()?;
        let heads = (0..HEADS.len()).map(|level| Plain::read_head(&file, level));
        Ok(Self { convolutions, heads: heads.collect::<Result<_, _>>()? })
    }
}

/// A layer as the file has it.
#[derive(Clone, Debug)]
pub struct Plain {
    /// Rows and columns that the kernel covers: 3 or 1.
    pub size: usize,
    /// Channels of the input.
    pub inputs: usize,
    /// Channels of the output.
    pub outputs: usize,
    /// Weights, `[output][input][ky][kx]`.
    pub weights: Vec<f32>,
    /// One for each output.
    pub bias: Vec<f32>,
}

impl Plain {
    fn read_convolution(file: &SafeTensors<'_>, name: &str) -> Result<Self, WeightsError> {
        let known = CONVOLUTIONS.iter().find(|layer| layer.0 == name);
        let &(_, inputs, outputs) = known.ok_or_else(|| WeightsError::Missing(name.to_owned()))?;
        Self::read(file, name, [3, inputs, outputs])
    }

    fn read_head(file: &SafeTensors<'_>, level: usize) -> Result<Self, WeightsError> {
        let (name, inputs, outputs) = HEADS[level];
        Self::read(file, name, [1, inputs, outputs])
    }

    fn read(
        file: &SafeTensors<'_>,
        name: &str,
        [size, inputs, outputs]: [usize; 3],
    ) -> Result<Self, WeightsError> {
        let weights = tensor(file, format!("{name}.weight"), &[outputs, inputs, size, size])?;
        let bias = tensor(file, format!("{name}.bias"), &[outputs])?;
        Ok(Self { size, inputs, outputs, weights, bias })
    }

    /// One weight.
    pub fn weight(&self, output: usize, input: usize, ky: usize, kx: usize) -> f32 {
        self.weights[((output * self.inputs + input) * self.size + ky) * self.size + kx]
    }

    /// The bias in blocks, output `i` being the layer's output `order(i)`, if that is one.
    fn bias(&self, outputs: usize, order: impl Fn(usize) -> Option<usize>) -> Vec<[f32; LANES]> {
        let bias = |i: usize| order(i).map_or(0.0, |i| self.bias[i]);
        (0..outputs / LANES).map(|block| std::array::from_fn(|i| bias(block * LANES + i))).collect()
    }
    /// As a kernel takes it.
    pub(super) fn convolution(&self) -> Convolution {
        let shape = [self.size, self.inputs, self.outputs];
        let weights = arranged(shape, |output, input, ky, kx| self.weight(output, input, ky, kx));
        Convolution { bias: self.bias(self.outputs, Some), weights }
    }

    /// As a kernel takes it, if the first `coarse` inputs have half the resolution.
    pub(super) fn merging(&self, coarse: usize) -> Merging {
        // The rows (or columns) of three that one of two stands for, in even and in odd rows of the
        // output.
        const MERGED: [[Range<usize>; 2]; 2] = [[0..1, 1..3], [0..2, 2..3]];
        let summed = |y: usize, x: usize| {
            arranged([2, coarse, self.outputs], |output, input, ky, kx| {
                let rows = MERGED[y][ky].clone();
                let places = rows.flat_map(|ky| MERGED[x][kx].clone().map(move |kx| (ky, kx)));
                places.map(|(ky, kx)| self.weight(output, input, ky, kx)).sum()
            })
        };
        let fine = arranged([3, self.inputs - coarse, self.outputs], |output, input, ky, kx| {
            self.weight(output, coarse + input, ky, kx)
        });
        let coarse = [0, 1].map(|y| [0, 1].map(|x| summed(y, x)));
        Merging { bias: self.bias(self.outputs, Some), coarse, fine }
    }

    /// As a head whose output `i` is the layer's output `order(i)`, or zero.
    pub(super) fn linear(&self, outputs: usize, order: impl Fn(usize) -> Option<usize>) -> Head {
        let weight =
            |output, input, _, _| order(output).map_or(0.0, |output| self.weight(output, input, 0, 0));
        let weights = arranged([1, self.inputs, outputs], weight);
        Head { bias: self.bias(outputs, order), weights }
    }

    /// As the head of a level other than 0, whose outputs after the 25 of the kernel, if there are
    /// any, are alpha and detail.
    fn coarse_head(&self) -> Head {
        self.linear(SLOTS, |slot| {
            let output = match slot {
                ALPHA => KERNEL,
                DETAIL => KERNEL + 1,
                slot if slot < KERNEL => slot,
                _ => return None,
            };
            (output < self.outputs).then_some(output)
        })
    }
}

/// The values of a tensor that must have this shape.
fn tensor(file: &SafeTensors<'_>, name: String, shape: &[usize]) -> Result<Vec<f32>, WeightsError> {
    let Ok(view) = file.tensor(&name) else { return Err(WeightsError::Missing(name)) };
    if view.dtype() != Dtype::F16 {
        return Err(WeightsError::Type { tensor: name, found: view.dtype().to_string() });
    }
    if view.shape() != shape {
        let (found, expected) = (view.shape().to_vec(), shape.to_vec());
        return Err(WeightsError::Shape { tensor: name, found, expected });
    }
    let values = view.data().as_chunks().0.iter().map(|bytes| f16::from_le_bytes(*bytes).to_f32());
    let values: Vec<f32> = values.collect();
    if values.iter().all(|value| value.is_finite()) { Ok(values) } else { Err(WeightsError::NotFinite(name)) }
}

/// Weights of `outputs` outputs (a multiple of sixteen) in the order of kernels, from a function of
/// output, input, `ky` and `kx`.
fn arranged(
    [size, inputs, outputs]: [usize; 3],
    weight: impl Fn(usize, usize, usize, usize) -> f32,
) -> Weights {
    let mut values = Vec::with_capacity(outputs / LANES * size * size * inputs);
    for block in 0..outputs / LANES {
        for (ky, kx) in (0..size).flat_map(|ky| (0..size).map(move |kx| (ky, kx))) {
            let sixteen = |input| Line(std::array::from_fn(|i| weight(block * LANES + i, input, ky, kx)));
            values.extend((0..inputs).map(sixteen));
        }
    }
    Weights { size, inputs, values }
}
