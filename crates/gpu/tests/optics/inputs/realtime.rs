//! What real-time frames keep, filter and count.

use super::*;
use optics::accumulation::{Neighbourhood, SignalMean};
use optics::antialiasing::ShownColors;
use optics::bounds::{AxisBox, box_of_two};
use optics::camera::CameraRay;
use optics::history::{History, HistorySum};
use optics::light::LightReach;
use optics::rounds::Neighbours;
use optics::shaft::{Shaft, ShaftEnds, ShaftInterval, shaft_ends};
use optics::signal::{FoundLight, Signal, SplitLight};
use optics::spatial_filter::FilterSum;
use optics::{Vec2f, Vec4f, vec2f, vec4f};

/// Positive numbers.
pub fn sizes2(i: &mut Inputs) -> Vec2f {
    vec2f(size(i), size(i))
}

/// Radiance, and a number that is not negative.
pub fn radiance4(i: &mut Inputs) -> Vec4f {
    vec4f(positive(i), positive(i), positive(i), positive(i))
}

/// Numbers of both signs.
pub fn reals4(i: &mut Inputs) -> Vec4f {
    vec4f(real(i), real(i), real(i), real(i))
}

/// A clip position, which may be behind the camera.
pub fn clip_position(i: &mut Inputs) -> Vec4f {
    let w = i.edge(&[0.0, -1.0]).unwrap_or_else(|| size(i));
    vec4f(i.between(-2.0, 2.0), i.between(-2.0, 2.0), share(i), w)
}

/// A clip position in front of the camera.
pub fn clip_in_front(i: &mut Inputs) -> Vec4f {
    vec4f(i.between(-2.0, 2.0), i.between(-2.0, 2.0), share(i), size(i))
}

pub fn camera_ray(i: &mut Inputs) -> CameraRay {
    CameraRay { origin: point(i), direction: direction(i), weight: share(i) }
}

pub fn signal(i: &mut Inputs) -> Signal {
    Signal {
        diffuse: radiance(i),
        diffuse_deviation: positive(i),
        specular: radiance(i),
        specular_deviation: positive(i),
    }
}

pub fn split_light(i: &mut Inputs) -> SplitLight {
    SplitLight { diffuse: radiance(i), specular: radiance(i), hit_distance: positive(i) }
}

pub fn found_light(i: &mut Inputs) -> FoundLight {
    FoundLight {
        diffuse: radiance(i),
        count: depth(i),
        specular: radiance(i),
        hit_distance: positive(i),
        squares: vec2f(positive(i), positive(i)),
        drawn: depth(i),
        wanted: depth(i),
    }
}

pub fn history(i: &mut Inputs) -> History {
    History {
        diffuse: radiance(i),
        diffuse_count: positive(i),
        specular: radiance(i),
        specular_count: positive(i),
        moments: radiance4(i),
        hit_distance: positive(i),
    }
}

/// As [`history`], and what is no number.
pub fn any_history(i: &mut Inputs) -> History {
    let hit_distance = anything(i);
    History { hit_distance, ..history(i) }
}

pub fn history_sum(i: &mut Inputs) -> HistorySum {
    HistorySum { history: history(i), weight: share(i) }
}

/// Few colours in `[0, 1]`: squares of brighter ones would hide a deviation.
pub fn neighbourhood(i: &mut Inputs) -> Neighbourhood {
    let (mean, spread) = (albedo(i), albedo(i));
    let luminance = vec2f(share(i), 1.0 + share(i));
    Neighbourhood {
        mean,
        mean_of_squares: mean * mean + spread,
        brightest: positive(i),
        luminance,
        count: f32::from(i.below(9) as u8),
    }
}

pub fn shown_colors(i: &mut Inputs) -> ShownColors {
    let (mean, spread) = (albedo(i), albedo(i));
    ShownColors { mean, squares: mean * mean + spread }
}

pub fn signal_mean(i: &mut Inputs) -> SignalMean {
    SignalMean { color: radiance(i), count: positive(i), moments: vec2f(positive(i), positive(i)) }
}

pub fn filter_sum(i: &mut Inputs) -> FilterSum {
    FilterSum { diffuse: radiance4(i), specular: radiance4(i), weights: sizes2(i) }
}

pub fn neighbours(i: &mut Inputs) -> Neighbours {
    let weight = i.edge(&[0.0]).unwrap_or_else(|| size(i));
    Neighbours { mean: radiance(i), variance: radiance(i), weight }
}

pub fn axis_box(i: &mut Inputs) -> AxisBox {
    box_of_two(point(i), point(i))
}

pub fn light_reach(i: &mut Inputs) -> LightReach {
    LightReach { center: far_point(i), radius: size(i) }
}

pub fn shaft(i: &mut Inputs) -> Shaft {
    let b = axis_box(i);
    Shaft { low: b.low, high: b.high, low_step: far_point(i), high_step: far_point(i), known: true }
}

pub fn ends_of_shaft(i: &mut Inputs) -> ShaftEnds {
    shaft_ends(shaft(i))
}

pub fn shaft_interval(i: &mut Inputs) -> ShaftInterval {
    ShaftInterval {
        first: vec4f(share(i), share(i), share(i), share(i)),
        last: vec4f(share(i), share(i), share(i), share(i)),
    }
}
