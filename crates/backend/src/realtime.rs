//! Settings of the integrator `realtime`.

use crate::{PathSettings, Visibility};
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// Settings of [`Integrator::Realtime`](crate::Integrator::Realtime). Everything may change from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RealtimeSettings {
    /// The paths; `splitting` does not count.
    pub path: PathSettings,
    /// How the first surface behind each pixel is found.
    pub visibility: Visibility,
    /// Samples of a pixel in a frame.
    pub samples: FrameSamples,
    /// When pixels need no more samples.
    pub allocation: AllocationSettings,
    /// Time that a frame may take on the device: scales the samples of adaptive frames. `None`: as long as they take.
    pub budget: Option<Duration>,
    /// Lights that a first surface looks at before it asks for one of them, up to [`MOST_LIGHT_CANDIDATES`](Self::MOST_LIGHT_CANDIDATES):
    /// chosen by tiles of 8 × 8 pixels together. 0: it chooses one light, as `path` does.
    pub light_candidates: u32,
    /// What is kept of frames before.
    pub history: HistorySettings,
    /// Whether frames are filtered. Otherwise a frame is its own samples, and the mean of many is what `path` shows.
    pub filter: bool,
    /// What filters a frame in space.
    pub spatial: SpatialFilter,
    /// Passes of the filter by edges, each twice as wide as the one before, up to 8; 0 leaves it out.
    pub filter_passes: u32,
    /// What frames show.
    pub show: FrameView,
}

impl RealtimeSettings {
    /// The most lights that a first surface looks at.
    pub const MOST_LIGHT_CANDIDATES: u32 = 32;
}

impl Default for RealtimeSettings {
    fn default() -> Self {
        Self {
            path: PathSettings { max_depth: 4, ..PathSettings::default() },
            visibility: Visibility::default(),
            samples: FrameSamples { least: 1, most: 1 },
            allocation: AllocationSettings::default(),
            budget: None,
            light_candidates: 0,
            history: HistorySettings::default(),
            filter: true,
            spatial: SpatialFilter::default(),
            filter_passes: 5,
            show: FrameView::Picture,
        }
    }
}

/// Samples of a pixel in a frame: a fixed number, or from `least` to `most` where the picture is noisy and none elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameSamples {
    /// The least, at least 1.
    pub least: u32,
    /// The most, from `least` to [`FrameSamples::MOST`].
    pub most: u32,
}

impl FrameSamples {
    /// The most samples that a pixel can have in a frame.
    pub const MOST: u32 = 64;
    /// What adaptive frames have unless the user says otherwise.
    pub const ADAPTIVE: Self = Self { least: 4, most: 16 };

    /// Whether all pixels get the same number.
    pub fn is_fixed(self) -> bool {
        self.least == self.most
    }
}

impl fmt::Display for FrameSamples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_fixed() { write!(f, "{}", self.least) } else { write!(f, "{}..{}", self.least, self.most) }
    }
}

/// What is no number of samples.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no number of samples such as `1` or `4..16`, from 1 to {most}", most = FrameSamples::MOST)]
pub struct BadFrameSamples(pub String);

impl FromStr for FrameSamples {
    type Err = BadFrameSamples;

    fn from_str(text: &str) -> Result<Self, BadFrameSamples> {
        let bad = || BadFrameSamples(text.to_owned());
        let number = |part: &str| part.trim().parse::<u32>().map_err(|_| bad());
        let (least, most) = match text.split_once("..") {
            Some((least, most)) => (number(least)?, number(most)?),
            None => (number(text)?, number(text)?),
        };
        let fits = (1..=Self::MOST).contains(&least) && (least..=Self::MOST).contains(&most);
        if fits { Ok(Self { least, most }) } else { Err(bad()) }
    }
}

/// When pixels of adaptive frames get samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllocationSettings {
    /// Variance of a pixel's mean under which it needs no samples: of luminance as it is seen, y / (y + `white`), without the
    /// surface's colour.
    pub tolerance: f32,
    /// Luminance that is seen as one half, W·sr⁻¹·m⁻²: one over the exposure.
    pub white: f32,
    /// Pixels around a pixel whose samples tell its noise while its own are few, up to 8.
    pub noise_radius: u32,
    /// Pixels over which the map of the noise is spread, up to 8.
    pub blur_radius: u32,
    /// Pixels that need no samples get one in so many frames on average all the same, so that what was only thought to be
    /// calm is found out; 0: never, which is biased.
    pub refresh: u32,
}

impl Default for AllocationSettings {
    fn default() -> Self {
        Self { tolerance: 0.001, white: 1.0, noise_radius: 3, blur_radius: 3, refresh: 8 }
    }
}

/// What is kept of frames before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HistorySettings {
    /// Largest difference of distances of the same surface, in tenths of the distance.
    pub depth_tolerance: f32,
    /// Least cosine between normals of the same surface.
    pub normal_tolerance: f32,
    /// Samples that the past counts for at most while anything moves; 0 forgets it. Where nothing moves, all count.
    pub most: f32,
    /// Standard deviations of the samples around a pixel that its past may be away from them while anything moves.
    pub clip: f32,
}

impl Default for HistorySettings {
    fn default() -> Self {
        Self { depth_tolerance: 0.3, normal_tolerance: 0.95, most: 32.0, clip: 1.5 }
    }
}

/// What filters a frame in space, after it has joined those before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SpatialFilter {
    /// Averages over neighbours that show the same plane and differ by no more than their noise.
    #[default]
    Edges,
    /// The learned denoiser's network.
    Learned,
}

impl SpatialFilter {
    /// All of them, the default first.
    pub const ALL: [Self; 2] = [Self::Edges, Self::Learned];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edges => "edges",
            Self::Learned => "learned",
        }
    }
}

impl fmt::Display for SpatialFilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no filter has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown filter `{0}`; there are: {names}", names = SpatialFilter::ALL.map(SpatialFilter::name).join(", "))]
pub struct UnknownSpatialFilter(pub String);

impl FromStr for SpatialFilter {
    type Err = UnknownSpatialFilter;

    fn from_str(name: &str) -> Result<Self, UnknownSpatialFilter> {
        let found = Self::ALL.into_iter().find(|filter| filter.name() == name);
        found.ok_or_else(|| UnknownSpatialFilter(name.to_owned()))
    }
}

/// What frames show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FrameView {
    /// The picture.
    #[default]
    Picture,
    /// Variance of the mean of diffuse (red) and specular (green) luminance, before the filter.
    Variance,
    /// Samples that the past is worth, over the most that it counts for while anything moves.
    History,
    /// The map of the noise: variance of the mean as it is seen, over twice the tolerance.
    Noise,
    /// The same, spread.
    BlurredNoise,
    /// White where samples are wanted.
    Mask,
    /// Samples of the frame, over the most.
    Samples,
    /// Diffuse light without the surface's colour.
    Diffuse,
    /// Specular light without the surface's colour.
    Specular,
}

impl FrameView {
    /// All of them, in the order in which users read them; a view's place is its number in shaders.
    pub const ALL: [Self; 9] = [
        Self::Picture,
        Self::Variance,
        Self::History,
        Self::Noise,
        Self::BlurredNoise,
        Self::Mask,
        Self::Samples,
        Self::Diffuse,
        Self::Specular,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "picture",
            Self::Variance => "variance",
            Self::History => "history",
            Self::Noise => "noise",
            Self::BlurredNoise => "blurred-noise",
            Self::Mask => "mask",
            Self::Samples => "samples",
            Self::Diffuse => "diffuse",
            Self::Specular => "specular",
        }
    }
}

impl fmt::Display for FrameView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no view has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown view `{0}`; there are: {names}", names = FrameView::ALL.map(FrameView::name).join(", "))]
pub struct UnknownFrameView(pub String);

impl FromStr for FrameView {
    type Err = UnknownFrameView;

    fn from_str(name: &str) -> Result<Self, UnknownFrameView> {
        Self::ALL.into_iter().find(|v| v.name() == name).ok_or_else(|| UnknownFrameView(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_samples_are_read_and_others_refused() {
        for (text, least, most) in [("1", 1, 1), ("4..16", 4, 16), (" 2 .. 3", 2, 3), ("64", 64, 64)] {
            let samples: FrameSamples = text.parse().expect(text);
            assert_eq!((samples.least, samples.most), (least, most));
            assert_eq!(samples.to_string().parse(), Ok(samples));
        }
        for text in ["", "0", "4..", "16..4", "1..65", "-1", "four"] {
            assert!(text.parse::<FrameSamples>().is_err(), "{text}");
        }
    }

    #[test]
    fn views_parse_back_and_are_where_their_numbers_say() {
        for (i, view) in FrameView::ALL.into_iter().enumerate() {
            assert_eq!(view.name().parse(), Ok(view));
            assert_eq!(view as usize, i);
        }
        assert!("nothing".parse::<FrameView>().is_err());
    }

    #[test]
    fn filters_parse_back_and_others_are_named() {
        assert!(SpatialFilter::ALL.into_iter().all(|filter| filter.name().parse() == Ok(filter)));
        let error = "wide".parse::<SpatialFilter>().unwrap_err().to_string();
        assert!(error.contains("`wide`") && error.contains("edges, learned"), "{error}");
    }
}
