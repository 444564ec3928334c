//! Rendering a part of a picture, to be merged with others.

use crate::metadata::{Description, metadata, software};
use crate::{Checkpoint, Job, Renderer, Summary};
use backend::{BackendError, Control, View};
use film::{Block, Coverage, Film, Part, PartError, Rect};
use post::ToneMapping;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;
use std::str::FromStr;
use std::time::Duration;
use web_time::Instant;

/// One of several tiles that make up a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Number of the tile, from 0.
    pub index: u32,
    /// How many there are.
    pub count: u32,
}

/// A text that is no [`Tile`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no tile: expected I/N, such as 1/4 for the first of four")]
pub struct UnknownTile(pub String);

impl FromStr for Tile {
    type Err = UnknownTile;

    /// Reads `I/N`: tile I, counted from 1, of N.
    fn from_str(text: &str) -> Result<Self, UnknownTile> {
        let parse = || {
            let (number, count) = text.split_once('/')?;
            let (number, count): (u32, u32) = (number.trim().parse().ok()?, count.trim().parse().ok()?);
            (1..=count).contains(&number).then(|| Self { index: number - 1, count })
        };
        parse().ok_or_else(|| UnknownTile(text.to_owned()))
    }
}

impl fmt::Display for Tile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index + 1, self.count)
    }
}

/// Why a part of a picture could not be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderPartError {
    /// The picture has no such tile.
    #[error("the picture of {width}×{height} pixels cannot be cut into {} tiles", tile.count)]
    Tile {
        /// Which tile was asked for.
        tile: Tile,
        /// Width of what was to be cut, in pixels.
        width: u32,
        /// Height of what was to be cut, in pixels.
        height: u32,
    },
    /// The samples are not among those of the whole picture.
    #[error("samples {}..{} are not among the picture's 0..{spp}", samples.start, samples.end)]
    Samples {
        /// Which samples were asked for.
        samples: Range<u32>,
        /// Samples per pixel of the whole picture.
        spp: u32,
    },
    /// The back end failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// What there is of the picture cannot be added to.
    #[error(transparent)]
    Part(#[from] PartError),
}

/// Which part of which picture to render.
#[derive(Clone, Debug)]
pub struct PartJob<'a> {
    /// The whole picture.
    pub job: &'a Job,
    /// Samples per pixel of the whole picture.
    pub spp: u32,
    /// The tile to render; `None` is all of the picture.
    pub tile: Option<Tile>,
    /// Indices of the samples to render; `None` is all of them.
    pub samples: Option<Range<u32>>,
    /// When the camera is where it is, in seconds.
    pub time: f32,
    /// Number of the picture in a sequence.
    pub frame: Option<u32>,
    /// What the finished picture's file shall say of the scene.
    pub description: &'a Description,
}

impl<'a> PartJob<'a> {
    /// All of a picture.
    pub fn whole(job: &'a Job, spp: u32, description: &'a Description) -> Self {
        Self { job, spp, tile: None, samples: None, time: 0.0, frame: None, description }
    }

    /// The whole picture, as a block of samples.
    pub fn picture(&self) -> Block {
        let window = self.job.crop.unwrap_or(Rect::full(self.job.width, self.job.height));
        Block { window, samples: 0..self.spp }
    }

    /// The part of it that is to be rendered.
    ///
    /// # Errors
    /// [`RenderPartError::Tile`] or [`RenderPartError::Samples`] if there is no such part.
    pub fn share(&self) -> Result<Block, RenderPartError> {
        let Block { window, samples } = self.picture();
        let missing = |tile| RenderPartError::Tile { tile, width: window.width, height: window.height };
        let window = match self.tile {
            None => window,
            Some(tile) => window.tile(tile.index, tile.count).ok_or_else(|| missing(tile))?,
        };
        match &self.samples {
            Some(range) if range.is_empty() || range.end > self.spp => {
                Err(RenderPartError::Samples { samples: range.clone(), spp: self.spp })
            }
            range => Ok(Block { window, samples: range.clone().unwrap_or(samples) }),
        }
    }

    /// A part without samples: of what this is a part, and room for what is to come.
    fn empty_part(&self, window: Rect, scene: &str) -> Result<Part, RenderPartError> {
        let job = self.job;
        let film = Film::with_window(job.width, job.height, window, &job.aovs).map_err(PartError::Film)?;
        let mut part = Part::new(film, Coverage::default(), self.picture())?;
        part.identity = identity(&job.view(self.time), scene);
        part.identity.insert(TONE.into(), tone_text(&job.tone));
        if let Some(frame) = self.frame {
            part.identity.insert("frame".into(), frame.to_string());
        }
        part.metadata = self.description.settings_at(job, self.time);
        Ok(part)
    }
}

/// The name of the tone mapping among what makes parts belong together.
const TONE: &str = "tone mapping";

fn tone_text(tone: &ToneMapping) -> String {
    let ToneMapping { mapper, exposure, saturation } = tone;
    serde_json::json!({ "mapper": mapper, "exposure": exposure, "saturation": saturation }).to_string()
}

/// How the picture that this is a part of is to be shown; `None` if the part does not say.
pub fn tone_of(part: &Part) -> Option<ToneMapping> {
    let value: serde_json::Value = serde_json::from_str(part.identity.get(TONE)?).ok()?;
    let number = |key: &str| value[key].as_f64().map(|n| n as f32);
    let mapper = serde_json::from_value(value["mapper"].clone()).ok()?;
    Some(ToneMapping { mapper, exposure: number("exposure")?, saturation: number("saturation")? })
}

/// Everything that decides what a sample of a picture is, but its pixel and index.
fn identity(view: &View, scene: &str) -> BTreeMap<String, String> {
    // Without `..`, so that no setting can be forgotten. Size, window and layers are the film's; samples are the coverage's.
    let View {
        camera,
        width: _,
        height: _,
        window: _,
        integrator,
        single_scatter,
        sampler,
        seed,
        first_sample: _,
        aovs: _,
        shutter,
    } = view;
    let pair = |k: &str, v: String| (k.to_owned(), v);
    let mut identity = BTreeMap::from([
        pair("software", software()),
        pair("scene", scene.to_owned()),
        pair("camera", format!("{camera:?}")),
        pair("integrator", format!("{integrator:?}")),
        pair("single scattering", single_scatter.to_string()),
        pair("sampler", format!("{sampler:?}")),
        pair("seed", seed.to_string()),
    ]);
    identity.extend(shutter.as_ref().map(|shutter| pair("shutter", format!("{shutter:?}"))));
    identity
}

/// What there is of a picture, ready to be written with [`crate::output::write`]: the film of all its pixels, and what its
/// file says.
///
/// # Errors
/// When there is not enough memory for the film.
pub fn finish(part: Part) -> Result<(Film, BTreeMap<String, String>), PartError> {
    let (settings, backends, time) = (part.metadata.clone(), part.backends.clone(), part.render_time);
    let film = part.into_whole_film()?;
    let mut metadata = metadata(&settings, &film, least_samples(&film), &backends, time);
    // Parts have the same samples for every pixel.
    metadata.insert("sampling".into(), crate::Sampling::default().name().into());
    Ok((film, metadata))
}

/// Samples that every pixel has.
pub(crate) fn least_samples(film: &Film) -> u32 {
    let least = film.pixels().iter().map(film::PixelStats::taken).min().unwrap_or(0);
    u32::try_from(least).unwrap_or(u32::MAX)
}

/// What is being accumulated: what was there before, and a block that the back end works on.
struct Accumulation {
    /// All finished blocks.
    part: Part,
    /// Rendering time of the unfinished block.
    elapsed: Duration,
    /// Back ends that have worked on it.
    backends: BTreeSet<String>,
}

impl Accumulation {
    /// The finished blocks and what the back end has made of `block`, which may be less than all of it.
    fn with(&self, film: &Film, block: &Block) -> Result<Part, PartError> {
        let counts = film.pixels().iter().map(|p| u32::try_from(p.taken()).unwrap_or(u32::MAX));
        let covered = Coverage::of_counts(block.window, block.samples.start, counts);
        let mut new = Part::new(film.clone(), covered, self.part.whole().clone())?;
        new.identity.clone_from(&self.part.identity);
        new.metadata.clone_from(&self.part.metadata);
        new.backends.clone_from(&self.backends);
        new.render_time = self.elapsed;
        if self.part.covered().is_empty() && self.part.film().window() == film.window() {
            return Ok(new); // as it is most of the time, and no second film is needed
        }
        let mut sum = self.part.clone();
        sum.merge("what there is", &new, "what was rendered")?;
        Ok(sum)
    }
}

impl Renderer {
    /// Renders a part of a picture of the loaded scene: what of it is not in `so_far` yet.
    ///
    /// The result holds what was in `so_far`, too. It has the bits that it would have if it had been rendered at once. A
    /// `checkpoint` is written at its interval and at the end, also when `control` ends the work early. Then the part has
    /// what was finished ([`Part::covered`]), and the summary says `cancelled`. A checkpoint that cannot be written does not
    /// end the work ([`Checkpoint::on_failure`]).
    ///
    /// # Errors
    /// See [`RenderPartError`]: among others, when `so_far` is of another picture. What the last checkpoint holds is not
    /// lost.
    pub fn render_part(
        &mut self,
        part_job: &PartJob,
        so_far: Option<(&str, Part)>,
        control: &Control,
        mut checkpoint: Option<&mut Checkpoint>,
    ) -> Result<(Part, Summary), RenderPartError> {
        let share = part_job.share()?;
        let scene = self.scene_fingerprint()?;
        let part = part_job.empty_part(share.window, &scene)?;
        let mut sum = Accumulation { part, elapsed: Duration::ZERO, backends: BTreeSet::new() };
        if let Some((name, part)) = &so_far {
            sum.part.merge("what is to be rendered", part, name)?;
        }
        drop(so_far);
        let mut summary = Summary::default();
        let missing = sum.part.covered().missing(&share);
        for block in missing.blocks() {
            self.render_block(part_job, block, &mut sum, &mut summary, control, &mut checkpoint)?;
            if summary.cancelled {
                break;
            }
        }
        if let Some(checkpoint) = checkpoint {
            checkpoint.save_last(&sum.part);
        }
        let film = sum.part.film();
        (summary.spp, summary.invalid_samples) = (least_samples(film), film.invalid_samples());
        summary.noise = film.relative_error();
        Ok((sum.part, summary))
    }

    /// Renders one block, in passes where there is a checkpoint to be written in between, and adds it to the sum.
    fn render_block(
        &mut self,
        part_job: &PartJob,
        block: &Block,
        sum: &mut Accumulation,
        summary: &mut Summary,
        control: &Control,
        checkpoint: &mut Option<&mut Checkpoint>,
    ) -> Result<(), RenderPartError> {
        let mut view = View { window: block.window, ..part_job.job.view(part_job.time) };
        self.restart();
        let mut left = block.samples.clone();
        while !left.is_empty() && !summary.cancelled {
            view.first_sample = left.start;
            let samples = checkpoint.as_ref().map_or(left.len() as u32, |c| c.next_pass(left.len() as u32));
            let start = Instant::now();
            let pass = self.render_pass(&view, samples, control)?;
            sum.elapsed += start.elapsed();
            sum.backends.insert(self.backend_name().to_owned());
            summary.add(&pass);
            summary.elapsed += start.elapsed();
            left.start += samples;
            if let Some(checkpoint) = checkpoint {
                checkpoint.learn(samples, start.elapsed());
                let is_due = checkpoint.is_due() && !left.is_empty() && !summary.cancelled;
                if is_due && let Some(film) = self.film()? {
                    checkpoint.save_or_tell(&sum.with(film, block)?);
                }
            }
        }
        if let Some(film) = self.film()? {
            sum.part = sum.with(film, block)?;
            (sum.elapsed, sum.backends) = (Duration::ZERO, BTreeSet::new());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_counted_from_one() {
        assert_eq!("1/4".parse(), Ok(Tile { index: 0, count: 4 }));
        assert_eq!("4/4".parse::<Tile>().map(|t| t.to_string()), Ok("4/4".into()));
        for text in ["0/4", "5/4", "4", "a/b", "1/0", "-1/2"] {
            assert_eq!(text.parse::<Tile>(), Err(UnknownTile(text.into())));
        }
    }
}
