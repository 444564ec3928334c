//! Presets of quality: how many samples, and when a picture is good enough.

use crate::render_settings::RenderSettings;
use crate::worker::Shown;
use alhazen::{Adaptive, Denoiser, Sampling};

/// A preset of quality. It leaves the integrator and the resolution as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// A few samples.
    Draft,
    /// Enough to judge light and materials.
    Preview,
    /// Until the noise is low.
    Final,
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Preview, Self::Final];

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Preview => "preview",
            Self::Final => "final",
        }
    }

    /// What it sets.
    pub fn about(self) -> &'static str {
        match self {
            Self::Draft => "16 samples per pixel, denoised",
            Self::Preview => "128 samples per pixel, denoised",
            Self::Final => {
                "adaptive sampling until the noise is below 0.01, at most 4096 samples per pixel, denoised"
            }
        }
    }

    /// Samples per pixel, how they are spread, and the noise that ends the picture.
    fn values(self) -> (u32, Sampling, Option<f32>) {
        match self {
            Self::Draft => (16, Sampling::Uniform, None),
            Self::Preview => (128, Sampling::Uniform, None),
            Self::Final => (4096, Sampling::Adaptive(Adaptive::default()), Some(0.01)),
        }
    }

    /// Sets it.
    pub fn apply(self, render: &mut RenderSettings, shown: &mut Shown) {
        (render.spp, render.sampling, render.noise) = self.values();
        shown.denoiser = shown.denoiser.or(Some(Denoiser::default()));
    }

    /// The preset that these settings are; `None` where they are none.
    pub fn of(render: &RenderSettings, shown: &Shown) -> Option<Self> {
        let is_it = |preset: &Self| (render.spp, render.sampling, render.noise) == preset.values();
        Self::ALL.into_iter().find(|preset| is_it(preset) && shown.denoiser.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::{Job, Scene};

    #[test]
    fn presets_are_recognised_until_something_is_changed() {
        let mut render = RenderSettings::of(&Job::for_scene(&Scene::default()), None);
        let mut shown = Shown { denoiser: None, ..Shown::default() };
        assert_eq!(Preset::of(&render, &shown), None);
        for preset in Preset::ALL {
            preset.apply(&mut render, &mut shown);
            assert_eq!(Preset::of(&render, &shown), Some(preset));
            assert!(shown.denoiser.is_some());
        }
        render.spp += 1;
        assert_eq!(Preset::of(&render, &shown), None);
    }
}
