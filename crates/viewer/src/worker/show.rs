//! From a film to what the window shows.

use super::channels::Channels;
use alhazen::{Aov, AovData, AovKind, Denoiser, Film, FrameView, Image, ToneMapping};
use egui::{Color32, ColorImage};
use rayon::prelude::*;

/// How a film becomes display values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Which of its layers.
    pub layer: Layer,
    /// How radiance becomes display values.
    pub tone: ToneMapping,
    /// Which channels of radiance.
    pub channels: Channels,
    /// Show the luminance of radiance as false colours: this many stops around the exposure's middle grey.
    pub false_colour: Option<f32>,
    /// What takes the noise out of the picture.
    pub denoiser: Option<Denoiser>,
}

impl Default for Shown {
    /// The picture, without its noise.
    fn default() -> Self {
        let denoiser = Some(Denoiser::default());
        Self {
            layer: Layer::Picture,
            tone: ToneMapping::default(),
            channels: Channels::All,
            false_colour: None,
            denoiser,
        }
    }
}

/// What of a film is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Layer {
    /// The rendered radiance.
    #[default]
    Picture,
    /// An auxiliary layer, its values made visible.
    Aov(Aov),
    /// How large the standard error of a pixel is, relative to its value, as a heat map.
    Noise,
}

impl Layer {
    /// What can be shown.
    pub fn all() -> impl Iterator<Item = Self> {
        let is_shown = |aov: &Aov| !matches!(aov, Aov::ObjectMatte | Aov::MaterialMatte);
        let aovs = Aov::ALL.into_iter().filter(is_shown).map(Self::Aov);
        [Self::Picture, Self::Noise].into_iter().chain(aovs)
    }

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "picture",
            Self::Noise => "noise",
            Self::Aov(aov) => aov.name(),
        }
    }

    /// The layer that the film has to have for it.
    pub fn aov(self) -> Option<Aov> {
        match self {
            Self::Picture => None,
            Self::Noise => Some(Aov::StandardError),
            Self::Aov(aov) => Some(aov),
        }
    }

    /// Whether it is a property of the first hit, for which no light has to be transported. What guides denoisers is found by paths.
    pub fn is_geometric(self) -> bool {
        match self {
            Self::Picture | Self::Noise => false,
            Self::Aov(aov) => {
                !matches!(aov, Aov::SampleCount | Aov::StandardError) && !aov.guides_denoisers()
            }
        }
    }
}

/// The numbers of a layer, three channels; missing ones are zero. Ids that stand for nothing are -1.
pub fn layer_image(film: &Film, layer: Layer) -> Image {
    let Some(aov) = layer.aov() else { return parallel_mean(film) };
    let window = film.window();
    let mut out = Image::black(window.width, window.height, 3);
    match film.aov(aov) {
        Some(AovData::Float(values)) => {
            let n = values.channels();
            let pixels = out.data_mut().chunks_exact_mut(3).zip(values.data().chunks_exact(n));
            pixels.for_each(|(out, values)| out[..n].copy_from_slice(values));
        }
        Some(AovData::Integer(ids)) => {
            for (out, id) in out.data_mut().chunks_exact_mut(3).zip(ids) {
                out[0] = if id == u32::MAX { -1.0 } else { id as f32 };
            }
        }
        // Mattes are for files. Or the film is of a wish before the layer was asked for.
        Some(AovData::Shares(_)) | None => {}
    }
    out
}

/// As [`Film::to_image`], on all cores.
fn parallel_mean(film: &Film) -> Image {
    let window = film.window();
    let mut out = Image::black(window.width, window.height, 3);
    let pixels = out.data_mut().par_chunks_exact_mut(3).zip(film.pixels());
    pixels.for_each(|(out, pixel)| out.copy_from_slice(&pixel.mean().map(|m| m as f32)));
    out
}

/// Display values of what [`layer_image`] returned. `frames`: what frames show that build on each other.
pub fn display(numbers: &Image, film: &Film, shown: &Shown, frames: FrameView) -> ColorImage {
    let size = [numbers.width() as usize, numbers.height() as usize];
    let data = numbers.data();
    let pixels = match shown.layer {
        Layer::Picture => match shown.false_colour {
            _ if has_own_colours(frames) => per_pixel(data, |values| map_colour(frames, values)),
            None => return tone_mapped(numbers, shown),
            Some(stops) => per_pixel(data, |rgb| {
                let luminance = alhazen::luminance(shown.channels.of(rgb)) * shown.tone.exposure;
                heat((luminance.max(1e-20) / 0.18).log2() / stops * 0.5 + 0.5)
            }),
        },
        Layer::Noise => {
            let errors = data.par_chunks_exact(3).zip(film.pixels());
            let relative = errors.map(|(error, pixel)| {
                let value = alhazen::luminance(pixel.mean().map(|m| m as f32));
                // A tenth of middle grey keeps the dark, where nobody sees the noise, from glowing.
                let relative = alhazen::luminance([error[0], error[1], error[2]]) / (value + 0.018);
                // From a thousandth to one, a colour's step for each factor.
                heat(1.0 + relative.max(1e-9).log10() / 3.0)
            });
            relative.collect()
        }
        Layer::Aov(aov) => visible(aov, data),
    };
    ColorImage::new(size, pixels)
}

/// Whether frames show numbers that are no light.
fn has_own_colours(frames: FrameView) -> bool {
    !matches!(frames, FrameView::Picture | FrameView::Diffuse | FrameView::Specular)
}

/// The colour of what frames show of themselves: variances by their logarithm, shares as they are.
fn map_colour(frames: FrameView, values: [f32; 3]) -> Color32 {
    match frames {
        // Of both signals together; from a millionth to one.
        FrameView::Variance => heat(1.0 + (values[0] + values[1]).max(1e-9).log10() / 6.0),
        _ => heat(values[0]),
    }
}

fn tone_mapped(image: &Image, shown: &Shown) -> ColorImage {
    let size = [image.width() as usize, image.height() as usize];
    let mapped = match shown.channels {
        Channels::All => shown.tone.apply(image),
        channels => shown.tone.apply(&of_channels(image, channels)),
    };
    ColorImage::new(size, per_pixel(mapped.data(), colour))
}

/// Channels of a picture as grey.
fn of_channels(image: &Image, channels: Channels) -> Image {
    let mut grey = image.to_rgb();
    grey.data_mut().par_chunks_exact_mut(3).for_each(|c| c.copy_from_slice(&channels.of([c[0], c[1], c[2]])));
    grey
}

/// Values of a layer as colours.
fn visible(aov: Aov, data: &[f32]) -> Vec<Color32> {
    match (aov, aov.kind()) {
        (Aov::Depth, _) => {
            let (near, far) = range(data.iter().step_by(3).copied().filter(|d| *d > 0.0));
            let near_first = |d: f32| heat(1.0 - (d - near) / (far - near).max(1e-6));
            per_pixel(data, |d| if d[0] > 0.0 { near_first(d[0]) } else { Color32::BLACK })
        }
        (Aov::SampleCount, _) => {
            let (_, most) = range(data.iter().step_by(3).copied());
            per_pixel(data, |n| heat(n[0] / most.max(1.0)))
        }
        (_, AovKind::Mean) if aov.channels()[0] == "X" => {
            per_pixel(data, |n| colour(n.map(|c| c * 0.5 + 0.5)))
        }
        (_, AovKind::Mean) => per_pixel(data, |c| colour(c.map(alhazen::srgb_encode))),
        (_, AovKind::First) => per_pixel(data, |p| colour(p.map(|c| c - c.floor()))),
        (_, AovKind::FirstId | AovKind::Shares) => per_pixel(data, |id| id_colour(id[0])),
        (_, AovKind::Derived) => {
            per_pixel(data, |e| heat(alhazen::luminance(e).max(1e-9).log10() / 4.0 + 1.0))
        }
    }
}

fn per_pixel(data: &[f32], f: impl Fn([f32; 3]) -> Color32 + Sync) -> Vec<Color32> {
    data.par_chunks_exact(3).map(|c| f([c[0], c[1], c[2]])).collect()
}

fn colour(rgb: [f32; 3]) -> Color32 {
    let [r, g, b] = rgb.map(|c| (c * 255.0 + 0.5) as u8);
    Color32::from_rgb(r, g, b)
}

fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    let finite = values.filter(|v| v.is_finite());
    finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// Blue, cyan, green, yellow, red, white for values from 0 to 1.
pub fn heat(value: f32) -> Color32 {
    const STOPS: [[f32; 3]; 6] = [
        [0.05, 0.05, 0.35],
        [0.0, 0.55, 0.8],
        [0.1, 0.7, 0.2],
        [0.95, 0.85, 0.1],
        [0.9, 0.15, 0.05],
        [1.0, 1.0, 1.0],
    ];
    let place = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let lower = (place as usize).min(STOPS.len() - 2);
    let share = place - lower as f32;
    colour(std::array::from_fn(|c| STOPS[lower][c] + (STOPS[lower + 1][c] - STOPS[lower][c]) * share))
}

/// A colour that neighbouring numbers do not share; black for nothing.
fn id_colour(id: f32) -> Color32 {
    if id < 0.0 {
        return Color32::BLACK;
    }
    // The golden ratio spreads hues evenly, however many there are.
    let hue = (id * 0.618_034).fract();
    let value = 0.6 + 0.4 * ((id * 0.381_966).fract());
    egui::ecolor::Hsva::new(hue, 0.65, value, 1.0).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(radiance: [f32; 3]) -> Film {
        let mut film = Film::new(3, 2).expect("small");
        (0..6).for_each(|i| assert!(film.add(i % 3, i / 3, radiance)));
        film
    }

    #[test]
    fn pictures_are_tone_mapped_as_files_are() {
        let film = film([0.5, 0.2, 4.0]);
        let shown = Shown { tone: ToneMapping { exposure: 2.0, ..Default::default() }, ..Default::default() };
        let numbers = layer_image(&film, Layer::Picture);
        assert_eq!(numbers.rgb(2, 1), [0.5, 0.2, 4.0]);
        let image = display(&numbers, &film, &shown, FrameView::Picture);
        let expected = shown.tone.apply(&film.to_image()).rgb(0, 0).map(|c| (c * 255.0).round() as u8);
        assert_eq!(image.size, [3, 2]);
        assert!(image.pixels.iter().all(|p| [p.r(), p.g(), p.b()] == expected), "{image:?} {expected:?}");
    }

    #[test]
    fn one_channel_is_grey() {
        let film = film([0.5, 0.2, 0.05]);
        let numbers = layer_image(&film, Layer::Picture);
        let of = |channels| {
            let shown = Shown { channels, ..Default::default() };
            display(&numbers, &film, &shown, FrameView::Picture).pixels[0]
        };
        let grey = |v: f32| Color32::from_gray((alhazen::srgb_encode(v) * 255.0).round() as u8);
        assert_eq!([of(Channels::Red), of(Channels::Blue)], [grey(0.5), grey(0.05)]);
        assert_eq!(of(Channels::Luminance), grey(alhazen::luminance([0.5, 0.2, 0.05])));
        assert_ne!(of(Channels::All), of(Channels::Red));
    }

    #[test]
    fn false_colours_follow_the_logarithm_of_luminance() {
        let of = |value: f32| {
            let film = film([value; 3]);
            let shown = Shown { false_colour: Some(4.0), ..Default::default() };
            display(&layer_image(&film, Layer::Picture), &film, &shown, FrameView::Picture).pixels[0]
        };
        assert_eq!(of(0.18), heat(0.5));
        assert_eq!(of(0.18 * 16.0), heat(1.0));
        assert_eq!(of(0.0), heat(0.0));
    }

    #[test]
    fn what_frames_show_of_themselves_is_not_tone_mapped() {
        let of = |view: FrameView, values: [f32; 3]| {
            let film = film(values);
            let shown = Shown {
                tone: ToneMapping { exposure: 8.0, ..Default::default() },
                false_colour: Some(4.0),
                ..Default::default()
            };
            display(&layer_image(&film, Layer::Picture), &film, &shown, view).pixels[0]
        };
        assert_eq!(of(FrameView::Samples, [0.25; 3]), heat(0.25));
        assert_eq!(of(FrameView::Mask, [1.0; 3]), heat(1.0));
        assert_eq!(of(FrameView::Variance, [4e-4, 6e-4, 0.0]), heat(0.5));
        assert_ne!(of(FrameView::Diffuse, [0.25; 3]), heat(0.25), "light is shown as light");
    }

    #[test]
    fn layers_that_a_film_lacks_are_black_and_ids_differ() {
        let film = film([1.0; 3]);
        assert_eq!(layer_image(&film, Layer::Aov(Aov::Depth)).rgb(0, 0), [0.0; 3]);
        assert_eq!(id_colour(-1.0), Color32::BLACK);
        let colours: std::collections::HashSet<_> = (0..50).map(|i| id_colour(i as f32)).collect();
        assert_eq!(colours.len(), 50);
        assert_eq!(Layer::all().count(), 15);
    }
}
