//! The network: an encoder that sees ever more of the picture at ever lower resolution, and a
//! decoder that puts it together again.
//!
//! Source: Ronneberger, Fischer and Brox, "U-Net: Convolutional Networks for Biomedical Image
//! Segmentation", 2015.

use super::convolution::{Activations, Convolution, Merging};
use super::lanes::InstructionSet;
use super::weights::Layers;

/// What the decoder says, at 1/2, 1/4, 1/8, 1/16 and 1/32 of the resolution.
pub type Decoded = [Activations; 5];

impl Layers {
    /// Runs the network on features of half the resolution, whose sides are multiples of sixteen.
    pub fn decode(&self, set: InstructionSet, features: Activations) -> Decoded {
        // Blocks and assignments, so that nothing lives longer than it is needed.
        let [x0, mut pooled] = {
            let x0 = self.e0a.apply(set, &features);
            drop(features);
            self.e0b.apply_and_pool(set, &x0)
        };
        let x1;
        [x1, pooled] = self.e1.apply_and_pool(set, &pooled);
        let x2;
        [x2, pooled] = self.e2.apply_and_pool(set, &pooled);
        let x3;
        [x3, pooled] = self.e3.apply_and_pool(set, &pooled);
        let x4 = self.e4b.apply(set, &self.e4a.apply(set, &pooled));
        drop(pooled);
        let merge = |a: &Merging, b: &Convolution, coarse: &Activations, fine: Activations| {
            let merged = a.apply(set, coarse, &fine);
            drop(fine);
            b.apply(set, &merged)
        };
        let y3 = merge(&self.d3a, &self.d3b, &x4, x3);
        let y2 = merge(&self.d2a, &self.d2b, &y3, x2);
        let y1 = merge(&self.d1a, &self.d1b, &y2, x1);
        let y0 = merge(&self.d0a, &self.d0b, &y1, x0);
        [y0, y1, y2, y3, x4]
    }
}
