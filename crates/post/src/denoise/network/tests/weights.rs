//! Pseudo-random weights, as `training/denoiser/golden.py` makes them, and what is wrong with
//! files.

use super::super::weights::{CONVOLUTIONS, HEADS, WeightsError};
use super::Network;
use half::f16;
use safetensors::{Dtype, serialize, tensor::TensorView};

/// A number in `[-1, 1)`: value `k` of tensor `t`, by the generator SplitMix64.
pub fn uniform(t: u32, k: u32) -> f64 {
    let mut z = (u64::from(t) << 32 | u64::from(k)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 40) as f64 / f64::from(1 << 24) * 2.0 - 1.0
}

/// A tensor: its name, its shape, its values as bytes.
type Tensor = (String, Vec<usize>, Vec<u8>);

/// All tensors: weights of variance `2 / inputs`, biases a tenth of that size.
fn tensors() -> Vec<Tensor> {
    let sized = |size: usize| move |(name, inputs, outputs)| (name, inputs, outputs, size);
    let layers = CONVOLUTIONS.map(sized(3)).into_iter().chain(HEADS.map(sized(1)));
    let mut tensors = Vec::new();
    for (name, inputs, outputs, size) in layers {
        let deviation = (6.0 / (inputs * size * size) as f64).sqrt();
        let parts = [
            ("weight", vec![outputs, inputs, size, size], deviation),
            ("bias", vec![outputs], 0.1 * deviation),
        ];
        for (part, shape, factor) in parts {
            let t = tensors.len() as u32;
            let value = |k| f16::from_f32((uniform(t, k) * factor) as f32).to_le_bytes();
            let bytes = (0..shape.iter().product::<usize>() as u32).flat_map(value).collect();
            tensors.push((format!("{name}.{part}"), shape, bytes));
        }
    }
    tensors
}

/// A file with these tensors.
fn file_of(tensors: &[Tensor], dtype: Dtype) -> Vec<u8> {
    let view = |(name, shape, bytes)| {
        let (name, shape, bytes): (&String, &Vec<usize>, &Vec<u8>) = (name, shape, bytes);
        (name.clone(), TensorView::new(dtype, shape.clone(), bytes).unwrap())
    };
    serialize(tensors.iter().map(|(name, shape, bytes)| view((name, shape, bytes))), None).unwrap()
}

/// A file that is as it should be.
pub fn file() -> Vec<u8> {
    file_of(&tensors(), Dtype::F16)
}

#[test]
fn files_that_are_wrong_are_refused() {
    let error = |bytes: &[u8]| Network::from_bytes(bytes).unwrap_err();
    let good = file();
    for length in [0, 1, 7, 8, 100, good.len() - 1] {
        assert!(matches!(error(&good[..length]), WeightsError::Format(_)), "{length} bytes");
    }
    assert!(matches!(error(&[0xff; 64]), WeightsError::Format(_)));
    let mut lacking = tensors();
    lacking.retain(|tensor| tensor.0 != "d1b.bias");
    assert_eq!(error(&file_of(&lacking, Dtype::F16)), WeightsError::Missing("d1b.bias".to_owned()));
    let mut turned = tensors();
    turned[0].1 = vec![44, 48, 3, 3];
    let message =
        "the tensor `e0a.weight` of the weights has the shape [44, 48, 3, 3] instead of [48, 44, 3, 3]";
    assert_eq!(error(&file_of(&turned, Dtype::F16)).to_string(), message);
    assert!(matches!(error(&file_of(&tensors(), Dtype::BF16)), WeightsError::Type { .. }));
    let mut endless = tensors();
    endless[3].2[..2].copy_from_slice(&f16::INFINITY.to_le_bytes());
    assert_eq!(error(&file_of(&endless, Dtype::F16)), WeightsError::NotFinite("e0b.bias".to_owned()));
}
