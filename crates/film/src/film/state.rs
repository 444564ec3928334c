//! A film's exact contents as channels of an image file, and back: nothing is rounded.

use super::id_counts::IdCounts;
use super::{Film, Layer};
use crate::{AovKind, ExactSum, ExrChannel, ExrSamples, PixelStats};

/// Words of 32 bits in an [`ExactSum`], and in a count of samples.
const SUM_WORDS: usize = 4;
const COUNT_WORDS: usize = 2;

const COLOURS: [&str; 3] = ["R", "G", "B"];

impl Film {
    /// Everything that the film knows but [`Film::invalid_aovs`], as channels of whole numbers and of 32-bit floats.
    ///
    /// For each colour `c`, `sum.c` and `square.c` are the sums of samples and of their squares; `count` and `invalid` are the
    /// numbers of samples; `aov-count` and `layer.sum.c` belong to layers of means, `layer.id.i` and `layer.count.i` to the
    /// thing number `i` that a pixel of a matte shows. Numbers of more than 32 bits have a
    /// channel for each 32 bits, the least significant first: `count.0`, `count.1`. Of these, channels that are zero
    /// everywhere are left out: most numbers are small.
    #[must_use]
    pub fn to_channels(&self) -> Vec<ExrChannel> {
        let mut channels = Vec::new();
        for (c, colour) in COLOURS.iter().enumerate() {
            push_sums(&mut channels, &format!("sum.{colour}"), || {
                self.pixels.iter().map(move |p| p.sum()[c])
            });
            push_sums(&mut channels, &format!("square.{colour}"), || {
                self.pixels.iter().map(move |p| p.sum_of_squares()[c])
            });
        }
        let counts = |of: fn(&PixelStats) -> u64| self.pixels.iter().map(move |p| u128::from(of(p)));
        push_words(&mut channels, "count", COUNT_WORDS, || counts(PixelStats::count));
        push_words(&mut channels, "invalid", COUNT_WORDS, || counts(PixelStats::invalid));
        if !self.aov_counts.is_empty() {
            channels.push(uint("aov-count", self.aov_counts.clone()));
        }
        for (aov, layer) in self.aovs.iter().zip(&self.layers) {
            if let Layer::Shares(pixels) = layer {
                push_shares(&mut channels, aov.name(), pixels);
            }
            let names = aov.channels();
            for (c, name) in names.iter().enumerate() {
                match layer {
                    Layer::Mean(sums) => push_sums(&mut channels, &format!("{aov}.sum.{name}"), || {
                        sums.iter().skip(c).step_by(names.len()).copied()
                    }),
                    Layer::First(values) => {
                        let values = values.iter().skip(c).step_by(names.len()).copied().collect();
                        let name = format!("{aov}.first.{name}");
                        channels.push(ExrChannel { name, samples: ExrSamples::Float(values) });
                    }
                    Layer::FirstId(ids) => channels.push(uint(&format!("{aov}.first.{name}"), ids.clone())),
                    Layer::Shares(_) | Layer::Derived => {}
                }
            }
        }
        channels
    }

    /// Replaces the film's contents by what [`Film::to_channels`] has made of a film of the same window and layers. Other
    /// channels are ignored. [`Film::invalid_aovs`] becomes zero.
    ///
    /// # Errors
    /// The name of a channel that is missing, or has other numbers than it must have; the film is then empty.
    pub fn set_channels(&mut self, channels: &[ExrChannel]) -> Result<(), String> {
        self.clear();
        self.fill_from(&Channels(channels)).inspect_err(|_| self.clear())
    }

    fn fill_from(&mut self, channels: &Channels) -> Result<(), String> {
        let area = self.window.area();
        let count = channels.words("count", COUNT_WORDS, area)?;
        let invalid = channels.words("invalid", COUNT_WORDS, area)?;
        for (colour, name) in COLOURS.iter().enumerate() {
            let sum = channels.words(&format!("sum.{name}"), SUM_WORDS, area)?;
            let square = channels.words(&format!("square.{name}"), SUM_WORDS, area)?;
            for (i, pixel) in self.pixels.iter_mut().enumerate() {
                pixel.set_sums(colour, exact(&sum, i), exact(&square, i));
            }
        }
        for (i, pixel) in self.pixels.iter_mut().enumerate() {
            pixel.set_counts(number(&count, i) as u64, number(&invalid, i) as u64);
        }
        if !self.aov_counts.is_empty() {
            self.aov_counts.copy_from_slice(channels.uints("aov-count", area)?);
        }
        for (aov, layer) in self.aovs.iter().zip(&mut self.layers) {
            debug_assert_eq!(matches!(layer, Layer::Mean(_)), aov.kind() == AovKind::Mean);
            if let Layer::Shares(pixels) = layer {
                fill_shares(channels, aov.name(), pixels)?;
            }
            let names = aov.channels();
            for (c, name) in names.iter().enumerate() {
                match layer {
                    Layer::Mean(sums) => {
                        let words = channels.words(&format!("{aov}.sum.{name}"), SUM_WORDS, area)?;
                        let sums = sums.iter_mut().skip(c).step_by(names.len());
                        sums.enumerate().for_each(|(i, sum)| *sum = exact(&words, i));
                    }
                    Layer::First(values) => {
                        let from = channels.floats(&format!("{aov}.first.{name}"), area)?;
                        values.iter_mut().skip(c).step_by(names.len()).zip(from).for_each(|(v, f)| *v = *f);
                    }
                    Layer::FirstId(ids) => {
                        ids.copy_from_slice(channels.uints(&format!("{aov}.first.{name}"), area)?);
                    }
                    Layer::Shares(_) | Layer::Derived => {}
                }
            }
        }
        Ok(())
    }
}

/// Adds a matte: for each of the things that a pixel shows, a channel with its id and one with its number of samples, which is
/// zero where a pixel shows fewer.
fn push_shares(channels: &mut Vec<ExrChannel>, layer: &str, pixels: &[IdCounts]) {
    let most = pixels.iter().map(|pixel| pixel.iter().count()).max().unwrap_or(0);
    for i in 0..most {
        let shown = || pixels.iter().map(|pixel| pixel.iter().nth(i).unwrap_or_default());
        channels.push(uint(&format!("{layer}.id.{i}"), shown().map(|(id, _)| id).collect()));
        channels.push(uint(&format!("{layer}.count.{i}"), shown().map(|(_, count)| count).collect()));
    }
}

/// The inverse of [`push_shares`].
fn fill_shares(channels: &Channels, layer: &str, pixels: &mut [IdCounts]) -> Result<(), String> {
    for i in 0.. {
        let (id_name, count_name) = (format!("{layer}.id.{i}"), format!("{layer}.count.{i}"));
        if channels.find(&id_name).is_none() {
            break;
        }
        let ids = channels.uints(&id_name, pixels.len())?;
        let counts = channels.uints(&count_name, pixels.len())?;
        for ((pixel, &id), &count) in pixels.iter_mut().zip(ids).zip(counts) {
            pixel.add(id, count);
        }
    }
    Ok(())
}

fn uint(name: &str, values: Vec<u32>) -> ExrChannel {
    ExrChannel { name: name.to_owned(), samples: ExrSamples::Uint(values) }
}

/// Adds numbers as channels of 32 bits each.
fn push_words<I: Iterator<Item = u128>>(
    channels: &mut Vec<ExrChannel>,
    name: &str,
    words: usize,
    numbers: impl Fn() -> I,
) {
    for word in 0..words {
        let word_of = |n: u128| (n >> (32 * word)) as u32;
        if numbers().any(|n| word_of(n) != 0) {
            channels.push(uint(&format!("{name}.{word}"), numbers().map(word_of).collect()));
        }
    }
}

fn push_sums<I: Iterator<Item = ExactSum>>(channels: &mut Vec<ExrChannel>, name: &str, sums: impl Fn() -> I) {
    push_words(channels, name, SUM_WORDS, || sums().map(|sum| sum.to_bits() as u128));
}

/// The channels of numbers that are stored word by word; those that are zero everywhere are empty.
type Words<'a> = Vec<&'a [u32]>;

/// Number `i` of numbers that are stored word by word.
fn number(words: &Words, i: usize) -> u128 {
    words.iter().rev().fold(0, |number, word| number << 32 | u128::from(word.get(i).copied().unwrap_or(0)))
}

fn exact(words: &Words, i: usize) -> ExactSum {
    ExactSum::from_bits(number(words, i) as i128)
}

/// Channels by name.
struct Channels<'a>(&'a [ExrChannel]);

impl Channels<'_> {
    fn find(&self, name: &str) -> Option<&ExrSamples> {
        self.0.iter().find(|c| c.name == name).map(|c| &c.samples)
    }

    fn uints(&self, name: &str, area: usize) -> Result<&[u32], String> {
        match self.find(name) {
            Some(ExrSamples::Uint(values)) if values.len() == area => Ok(values),
            _ => Err(name.to_owned()),
        }
    }

    fn floats(&self, name: &str, area: usize) -> Result<&[f32], String> {
        match self.find(name) {
            Some(ExrSamples::Float(values)) if values.len() == area => Ok(values),
            _ => Err(name.to_owned()),
        }
    }

    fn words(&self, name: &str, words: usize, area: usize) -> Result<Words<'_>, String> {
        let word = |word: usize| {
            let name = format!("{name}.{word}");
            if self.find(&name).is_none() { Ok(&[][..]) } else { self.uints(&name, area) }
        };
        (0..words).map(word).collect()
    }
}
