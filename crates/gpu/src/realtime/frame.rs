//! What the passes of a frame are told: one uniform for all of them.

use crate::film::FilmBuffers;
use crate::gbuffer::Projections;
use backend::{FrameSamples, RealtimeSettings, SpatialFilter};
use bytemuck::{Pod, Zeroable};

/// See `shaders/realtime_frame.wgsl` for the fields.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct RealtimeFrame {
    clip_from_world: [[f32; 4]; 4],
    previous_clip_from_world: [[f32; 4]; 4],
    eye: [f32; 3],
    number: u32,
    previous_eye: [f32; 3],
    flags: u32,
    size: [u32; 2],
    least_samples: u32,
    most_samples: u32,
    depth_tolerance: f32,
    normal_tolerance: f32,
    most_history: f32,
    clip: f32,
    tolerance: f32,
    white: f32,
    noise_radius: u32,
    blur_radius: u32,
    refresh: u32,
    affordable: u32,
    show: u32,
    on_film: u32,
    pixel_spread: f32,
    seed: u32,
    light_candidates: u32,
    sample: u32,
}

const HAS_PAST: u32 = 1;
const STANDS_STILL: u32 = 2;
const GATHERS: u32 = 4;
const ADAPTS: u32 = 8;
const SMOOTHS: u32 = 16;

/// Largest radius of a window of pixels around a pixel.
const MOST_RADIUS: u32 = 8;

/// What decides a frame's uniform beside the settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameState {
    pub projections: Projections,
    /// Frames since the past was forgotten, this one not included.
    pub number: u32,
    /// Whether nothing has moved since the frame before.
    pub stands_still: bool,
    /// Samples that the frame can afford in all; 0: any number.
    pub affordable: u32,
    /// Frames on the film, this one included.
    pub on_film: u32,
    /// Number of the frame among the samples of the picture.
    pub sample: u32,
}

/// The samples of a pixel in a frame, brought into their range.
pub(super) fn frame_samples(settings: &RealtimeSettings) -> FrameSamples {
    let least = settings.samples.least.clamp(1, FrameSamples::MOST);
    FrameSamples { least, most: settings.samples.most.clamp(least, FrameSamples::MOST) }
}

/// Lights of its tile that a first surface looks at, brought into their range.
pub(super) fn light_candidates(settings: &RealtimeSettings) -> u32 {
    settings.light_candidates.min(RealtimeSettings::MOST_LIGHT_CANDIDATES)
}

impl RealtimeFrame {
    /// The uniform of a frame.
    pub fn new(settings: &RealtimeSettings, film: &FilmBuffers, state: &FrameState) -> Self {
        let samples = frame_samples(settings);
        let remembers = state.number > 0 && settings.history.most > 0.0;
        let is_filtered = settings.spatial == SpatialFilter::Learned || settings.filter_passes > 0;
        let bits = [
            (remembers, HAS_PAST),
            (state.stands_still, STANDS_STILL),
            (settings.filter, GATHERS),
            (!samples.is_fixed(), ADAPTS),
            (settings.filter && is_filtered, SMOOTHS),
        ];
        let Projections { clip_from_world, previous_clip_from_world, eye, previous_eye } = state.projections;
        let seed = film.contents.seed();
        Self {
            clip_from_world,
            previous_clip_from_world,
            eye,
            // 0 is what memory is at first.
            number: state.number.wrapping_add(1),
            previous_eye,
            flags: bits.iter().filter(|b| b.0).map(|b| b.1).sum(),
            size: film.contents.picture().window_size,
            least_samples: samples.least,
            most_samples: samples.most,
            depth_tolerance: settings.history.depth_tolerance,
            normal_tolerance: settings.history.normal_tolerance,
            most_history: settings.history.most.max(0.0),
            clip: settings.history.clip,
            tolerance: settings.allocation.tolerance,
            white: settings.allocation.white.max(1e-10),
            noise_radius: settings.allocation.noise_radius.min(MOST_RADIUS),
            blur_radius: settings.allocation.blur_radius.min(MOST_RADIUS),
            refresh: settings.allocation.refresh,
            affordable: state.affordable,
            show: settings.show as u32,
            on_film: state.on_film,
            pixel_spread: film.contents.pixel_spread(),
            seed,
            light_candidates: light_candidates(settings),
            sample: state.sample,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{assert_layout, constant};
    use crate::shader::check;
    use backend::FrameView;

    #[test]
    fn layouts_and_constants_match_the_shader() {
        let module = check::module("realtime_noise");
        assert_layout!(
            module,
            RealtimeFrame {
                clip_from_world,
                previous_clip_from_world,
                eye,
                number,
                previous_eye,
                flags,
                size,
                least_samples,
                most_samples,
                depth_tolerance,
                normal_tolerance,
                most_history,
                clip,
                tolerance,
                white,
                noise_radius,
                blur_radius,
                refresh,
                affordable,
                show,
                on_film,
                pixel_spread,
                seed,
                light_candidates,
                sample,
            }
        );
        let flags = [
            ("REALTIME_HAS_PAST", HAS_PAST),
            ("REALTIME_STANDS_STILL", STANDS_STILL),
            ("REALTIME_GATHERS", GATHERS),
            ("REALTIME_ADAPTS", ADAPTS),
            ("REALTIME_SMOOTHS", SMOOTHS),
        ];
        for (name, value) in flags {
            assert_eq!(constant(&module, name), value, "{name}");
        }
        for view in FrameView::ALL {
            let name = format!("SHOW_{}", view.name().to_uppercase().replace('-', "_"));
            assert_eq!(constant(&module, &name), view as u32, "{name}");
        }
    }
}
