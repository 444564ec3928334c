//! The samples that a batch makes, and how their random numbers are drawn.

use backend::View;
use optics::motion::MOTION_MIDDLE;
use optics::random::{
    PixelSampler, SAMPLER_BLUE_NOISE, SAMPLER_INDEPENDENT, SAMPLER_SOBOL, sample_2d, sampler_new,
};
use optics::shutter::{PAIR_TIME, shutter_time};
use optics::vec2f;

/// One sample to be made: its pixel and its index.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleId {
    pub x: u32,
    pub y: u32,
    pub index: u32,
}

/// Neighbours in a batch that belong to one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// Place of the pixel's estimate.
    pub place: u32,
    /// Number of samples.
    pub count: u32,
}

/// How the view draws its samples, as the optics know it.
pub(crate) fn sampler_kind(view: &View) -> u32 {
    match view.sampler {
        backend::SamplerKind::Sobol => SAMPLER_SOBOL,
        backend::SamplerKind::Independent => SAMPLER_INDEPENDENT,
        backend::SamplerKind::BlueNoise => SAMPLER_BLUE_NOISE,
    }
}

/// The random numbers of a sample.
#[inline(always)]
pub(crate) fn new_sampler(view: &View, sample: &SampleId) -> PixelSampler {
    sampler_new(sampler_kind(view), sample.x, sample.y, view.width, sample.index, view.seed)
}

/// When the camera ray of a sample leaves, in the time of the scene's motion.
#[inline]
pub(crate) fn ray_time(view: &View, sampler: PixelSampler, sample: &SampleId) -> f32 {
    let Some(shutter) = &view.shutter else { return MOTION_MIDDLE };
    let at = vec2f(sample.x as f32, sample.y as f32);
    let size = vec2f(view.width as f32, view.height as f32);
    shutter_time(shutter.timing, at, size, sample_2d(sampler, PAIR_TIME).x)
}

/// The time of a slot, of those of a batch.
#[inline(always)]
pub(crate) fn time_of(times: &[f32], slot: u32) -> f32 {
    times.get(slot as usize).copied().unwrap_or(MOTION_MIDDLE)
}
