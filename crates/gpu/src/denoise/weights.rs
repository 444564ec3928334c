//! The network's weights, as the passes want them.

use super::products::{Numbers, Products};
use crate::scene::upload::storage_buffer;
use crate::{Gpu, GpuError};
use half::f16;
use post::{LayerWeights, NetworkWeights};
use wgpu::BufferUsages;

/// Channels that go together: those of a chunk of inputs, and of a block of outputs.
const BLOCK: usize = 16;
/// Outputs of a head for a pixel: the 25 logits of the kernel, zero, and the logits alpha and
/// detail.
const SLOTS: usize = 28;
/// Logits of a kernel.
const KERNEL: usize = 25;
/// The slot of the logit alpha.
const ALPHA: usize = 26;
/// The slot of the logit detail.
const DETAIL: usize = 27;

/// Weights and bias of a layer on the device.
pub struct Layer {
    /// Weights of a convolution: `[chunk of 16 inputs][ky][kx][block of 16 outputs][16 inputs][16
    /// outputs]`, for matrix units `…[16 outputs][16 inputs]`; of a head: `[pixel][input][28]`.
    pub weights: wgpu::Buffer,
    /// The bias, in 32 bits: `[output]`; of a head: `[pixel][28]`.
    pub bias: wgpu::Buffer,
}

/// The layers of 3×3 in the order in which they are applied, and the heads of the filter's levels.
pub struct DeviceWeights {
    /// Fifteen.
    pub convolutions: Vec<Layer>,
    /// Of levels 0 to 5.
    pub heads: Vec<Layer>,
    /// The trust logits of level 0 and the logits beta: four and four for each input, then their
    /// bias.
    pub trust: wgpu::Buffer,
}

impl DeviceWeights {
    /// Moves the weights to the device.
    ///
    /// # Errors
    /// When there is no memory for them.
    pub fn upload(gpu: &Gpu, weights: &NetworkWeights, products: Products) -> Result<Self, GpuError> {
        let convolution = |(_, layer): &(_, LayerWeights)| {
            let weights = numbers_buffer(gpu, &arranged(layer, products), products.numbers())?;
            Ok(Layer { weights, bias: floats(gpu, &layer.bias)? })
        };
        let head = |(level, head)| {
            let (weights, bias) = arranged_head(level, head);
            Ok(Layer { weights: floats(gpu, &weights)?, bias: floats(gpu, &bias)? })
        };
        let convolutions = weights.convolutions.iter().map(convolution);
        let heads = weights.heads.iter().enumerate().map(head);
        let trust = weights.heads.first().map(arranged_trust).unwrap_or_default();
        Ok(Self {
            convolutions: convolutions.collect::<Result<_, GpuError>>()?,
            heads: heads.collect::<Result<_, GpuError>>()?,
            trust: floats(gpu, &trust)?,
        })
    }
}

fn floats(gpu: &Gpu, values: &[f32]) -> Result<wgpu::Buffer, GpuError> {
    storage_buffer(gpu, "the denoiser's weights", values, BufferUsages::empty())
}

fn numbers_buffer(gpu: &Gpu, values: &[f32], numbers: Numbers) -> Result<wgpu::Buffer, GpuError> {
    match numbers {
        Numbers::Full => floats(gpu, values),
        Numbers::Half => {
            let bits: Vec<u16> = values.iter().map(|value| f16::from_f32(*value).to_bits()).collect();
            storage_buffer(gpu, "the denoiser's weights", &bits, BufferUsages::empty())
        }
    }
}

/// The weights of a convolution; what is missing of the last chunk of inputs is zero.
fn arranged(layer: &LayerWeights, products: Products) -> Vec<f32> {
    let has_inputs_inside = matches!(products, Products::Matrices(_));
    let chunks = layer.inputs.div_ceil(BLOCK);
    let mut values = Vec::with_capacity(9 * chunks * BLOCK * layer.outputs);
    for (chunk, tap) in (0..chunks).flat_map(|chunk| (0..9).map(move |tap| (chunk, tap))) {
        for (block, i) in (0..layer.outputs / BLOCK).flat_map(|block| (0..BLOCK).map(move |i| (block, i))) {
            values.extend((0..BLOCK).map(|j| {
                let (k, n) = if has_inputs_inside { (j, i) } else { (i, j) };
                let (input, output) = (chunk * BLOCK + k, block * BLOCK + n);
                if input < layer.inputs { layer.weight(output, input, tap / 3, tap % 3) } else { 0.0 }
            }));
        }
    }
    values
}

/// Which output of a level's head is slot `slot` of pixel `pixel`. See [`NetworkWeights::heads`].
fn output_of(level: usize, head: &LayerWeights, pixel: usize, slot: usize) -> Option<usize> {
    let [alpha, detail] = if level == 0 { [26, 28] } else { [25, 26] };
    let output = match slot {
        ALPHA => alpha,
        DETAIL => detail,
        slot if slot < KERNEL => slot,
        _ => return None,
    };
    let output = if level == 0 { 4 * output + pixel } else { output };
    (output < head.outputs).then_some(output)
}

/// Weights and bias of a head.
fn arranged_head(level: usize, head: &LayerWeights) -> (Vec<f32>, Vec<f32>) {
    let pixels = if level == 0 { 4 } else { 1 };
    let (mut weights, mut bias) = (Vec::new(), Vec::new());
    for pixel in 0..pixels {
        let outputs: [_; SLOTS] = std::array::from_fn(|slot| output_of(level, head, pixel, slot));
        for input in 0..head.inputs {
            weights.extend(outputs.map(|output| output.map_or(0.0, |o| head.weight(o, input, 0, 0))));
        }
        bias.extend(outputs.map(|output| output.map_or(0.0, |o| head.bias[o])));
    }
    (weights, bias)
}

/// Weights and bias of the logits of trust and beta, which the head of level 0 says.
fn arranged_trust(head: &LayerWeights) -> Vec<f32> {
    /// The first of four outputs of each.
    const TRUST: usize = 4 * 25;
    const BETA: usize = 4 * 27;
    let logits = |value: &dyn Fn(usize) -> f32| {
        let outputs = (TRUST..TRUST + 4).chain(BETA..BETA + 4);
        outputs.map(value).collect::<Vec<f32>>()
    };
    let mut values: Vec<f32> =
        (0..head.inputs).flat_map(|input| logits(&|output| head.weight(output, input, 0, 0))).collect();
    values.extend(logits(&|output| head.bias[output]));
    values
}
