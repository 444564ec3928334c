//! What happens to a film before it is shown: denoising, if it is asked for, then exposure and tone mapping, applied once,
//! at the end.

#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the standard library"))]
// Only what talks to Open Image Denoise's C library and the network's vector instructions are unsafe.
#![deny(unsafe_code)]

mod denoise;
mod sequence;

pub use denoise::{
    DenoiseError, LayerWeights, Network, NetworkInput, NetworkWeights, NoisyPicture, Oidn, OidnError,
    PREPARED_VALUES, Prepared, Region, SizesDiffer, Tile, WeightsError, denoise, denoise_by_regression,
    denoise_with,
};
pub use sequence::{Frame, FrameError, History, Surface};

use film::Image;
use optics::tonemap::{
    TONEMAP_ACES, TONEMAP_AGX, TONEMAP_NEUTRAL, TONEMAP_NONE, TONEMAP_REINHARD, TONEMAP_SRGB, tonemap,
};
use optics::vec3f;
use rayon::prelude::*;
use scene::ToneMapper;

/// How radiance becomes display values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMapping {
    /// The curve.
    pub mapper: ToneMapper,
    /// Factor on radiance before the curve, positive.
    pub exposure: f32,
    /// Applied after the curve; 1 changes nothing.
    pub saturation: f32,
}

impl Default for ToneMapping {
    /// Clip and encode as sRGB.
    fn default() -> Self {
        Self { mapper: ToneMapper::Srgb, exposure: 1.0, saturation: 1.0 }
    }
}

impl ToneMapping {
    /// Display values in `[0, 1]` of a picture of linear radiance: three channels, ready to be rounded to bytes.
    pub fn apply(&self, image: &Image) -> Image {
        let mut out = image.to_rgb();
        let mapper = tag(self.mapper);
        out.data_mut().par_chunks_exact_mut(3).for_each(|c| {
            let mapped = tonemap(mapper, vec3f(c[0], c[1], c[2]), self.exposure, self.saturation);
            c.copy_from_slice(&mapped.to_array());
        });
        out
    }
}

fn tag(mapper: ToneMapper) -> u32 {
    match mapper {
        ToneMapper::Srgb => TONEMAP_SRGB,
        ToneMapper::None => TONEMAP_NONE,
        ToneMapper::Reinhard => TONEMAP_REINHARD,
        ToneMapper::Aces => TONEMAP_ACES,
        ToneMapper::Agx => TONEMAP_AGX,
        ToneMapper::Neutral => TONEMAP_NEUTRAL,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mapper_is_applied() {
        let image = Image::from_fn(2, 1, |x, _| if x == 0 { [0.5, 0.2, 0.1] } else { [4.0, 4.0, 4.0] });
        let all = [
            ToneMapper::Srgb,
            ToneMapper::None,
            ToneMapper::Reinhard,
            ToneMapper::Aces,
            ToneMapper::Agx,
            ToneMapper::Neutral,
        ];
        let mapped: Vec<_> = all
            .map(|mapper| ToneMapping { mapper, ..ToneMapping::default() }.apply(&image).into_data())
            .to_vec();
        for (i, a) in mapped.iter().enumerate() {
            assert!(a.iter().all(|v| (0.0..=1.0).contains(v)), "{:?}: {a:?}", all[i]);
            assert!(mapped[..i].iter().all(|b| a != b), "{:?} gives the same as another mapper", all[i]);
        }
        assert_eq!(mapped[1][0], 0.5);
    }

    #[test]
    fn exposure_scales_radiance() {
        let image = Image::from_fn(1, 1, |_, _| [0.1, 0.1, 0.1]);
        let none = |exposure| ToneMapping { mapper: ToneMapper::None, exposure, saturation: 1.0 };
        assert!((none(3.0).apply(&image).rgb(0, 0)[1] - 0.3).abs() < 1e-6);
    }
}
