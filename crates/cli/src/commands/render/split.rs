//! Rendering in parts and in several sittings.

use super::parsing::{Samples, parse_duration, parse_samples};
use super::{RenderArgs, check_place};
use crate::console::{ProgressDisplay, keep_each, say};
use alhazen::{
    Checkpoint, Control, Coverage, Denoiser, Film, Job, Part, PartError, PartJob, ProtectedFiles, Renderer,
    Summary, Tile, finish, output,
};
use anyhow::{Context, bail, ensure};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// How a picture is divided over machines and time.
#[derive(Debug, Clone, clap::Args)]
pub struct SplitArgs {
    /// Write what was rendered as a part (.exr) with exact sums, to be added to others by `alhazen merge`. --tile and
    /// --sample-range imply this.
    #[arg(long, help_heading = "Parts", conflicts_with_all = ["time", "noise", "denoise"])]
    part: bool,
    /// Render only tile I of N, counted from 1.
    #[arg(long, help_heading = "Parts", value_name = "I/N", conflicts_with_all = ["time", "noise", "denoise"])]
    pub tile: Option<Tile>,
    /// Render only samples A to B − 1 of the --spp samples of each pixel, or, as I/N, the I-th of N equal shares of
    /// them, counted from 1.
    #[arg(
        long,
        help_heading = "Parts",
        value_name = "A..B|I/N",
        value_parser = parse_samples,
        conflicts_with_all = ["time", "noise", "denoise"]
    )]
    sample_range: Option<Samples>,
    /// Save what there is to this .exr file again and again, to go on from it with --resume.
    #[arg(long, help_heading = "Parts", value_name = "FILE", conflicts_with_all = ["time", "noise"])]
    checkpoint: Option<PathBuf>,
    /// How often to save the checkpoint.
    #[arg(
        long,
        help_heading = "Parts",
        value_name = "DURATION",
        default_value = "60s",
        value_parser = parse_duration,
        requires = "checkpoint"
    )]
    every: Duration,
    /// Go on from the checkpoint if it is there.
    #[arg(long, help_heading = "Parts", requires = "checkpoint")]
    resume: bool,
}

impl SplitArgs {
    /// Whether anything is to be done that a plain render does not do.
    pub fn is_used(&self) -> bool {
        self.makes_parts() || self.checkpoint.is_some()
    }

    /// The checkpoint's file.
    pub fn checkpoint(&self) -> Option<&PathBuf> {
        self.checkpoint.as_ref()
    }

    /// Whether outputs are parts of pictures.
    pub fn makes_parts(&self) -> bool {
        self.part || self.tile.is_some() || self.sample_range.is_some()
    }

    /// The option given, if any is.
    pub fn given(&self) -> Option<&'static str> {
        let options = [
            (self.part, "--part"),
            (self.tile.is_some(), "--tile"),
            (self.sample_range.is_some(), "--sample-range"),
            (self.checkpoint.is_some(), "--checkpoint"),
        ];
        options.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
    }

    /// The samples to render, of `spp` that there are.
    pub fn samples(&self, spp: u32) -> anyhow::Result<Option<Range<u32>>> {
        match &self.sample_range {
            None => Ok(None),
            Some(Samples::Range(range)) => Ok(Some(range.clone())),
            Some(Samples::Share(share)) => {
                let cut = |i: u32| (u64::from(spp) * u64::from(i) / u64::from(share.count)) as u32;
                let range = cut(share.index)..cut(share.index + 1);
                ensure!(!range.is_empty(), "--sample-range {share}: there are only {spp} samples to share");
                Ok(Some(range))
            }
        }
    }

    /// Finds out before rendering what would keep the files from being written.
    pub fn check(&self, outputs: &[PathBuf]) -> anyhow::Result<()> {
        if self.makes_parts() {
            let is_exr = |path: &&PathBuf| output::Format::of(path).is_ok_and(|f| f == output::Format::Exr);
            if let Some(path) = outputs.iter().find(|path| !is_exr(path)) {
                bail!("{} cannot hold a part of a picture: parts are .exr files (--output)", path.display());
            }
        }
        let Some(path) = &self.checkpoint else { return Ok(()) };
        check_place(path)?;
        let saved = ProtectedFiles::new([path]);
        let is_output = outputs.contains(path) || outputs.iter().any(|output| saved.check(output).is_err());
        ensure!(!is_output, "{} is both the checkpoint and an output", path.display());
        ensure!(
            self.resume || !path.exists(),
            "the checkpoint {} is there already: go on from it with --resume, or remove it",
            path.display()
        );
        Ok(())
    }
}

/// A rendered picture, or a part of one.
pub enum Made {
    /// The renderer has the film; this is what its file says.
    Picture(BTreeMap<String, String>),
    /// Exact sums.
    Part(Box<Part>),
}

impl Made {
    /// Writes it to all `paths`, each even if others fail.
    ///
    /// A picture whose noise cannot be removed is written with it.
    pub fn write(
        self,
        renderer: &mut Renderer,
        paths: &[PathBuf],
        job: &Job,
        args: &RenderArgs,
    ) -> anyhow::Result<()> {
        let encoding = args.files.encoding();
        let write_picture = |film: &Film, metadata: &BTreeMap<String, String>| -> anyhow::Result<()> {
            let mut metadata = metadata.clone();
            let denoised = args.denoise.map(|name| Denoiser::from(name).run(film)).transpose();
            let (denoised, failed) = match denoised {
                Ok(denoised) => (denoised, Ok(())),
                Err(error) => (None, Err(error).context("the picture was written with its noise")),
            };
            if let Some(denoised) = &denoised {
                if !args.quiet {
                    say!("denoised by {}", denoised.by);
                }
                metadata.insert("denoiser".into(), denoised.by.clone());
            }
            let colour = denoised.as_ref().map(|d| &d.picture);
            keep_each(paths, |path| {
                Ok(output::write_as(path, film, colour, &job.tone, &metadata, &encoding)?)
            })?;
            failed
        };
        match self {
            Self::Picture(metadata) => {
                write_picture(renderer.film()?.context("nothing was rendered")?, &metadata)
            }
            Self::Part(part) if args.split.makes_parts() => keep_each(paths, |path| Ok(part.write(path)?)),
            Self::Part(part) => {
                let (film, metadata) = finish(*part)?;
                write_picture(&film, &metadata)
            }
        }
    }
}

/// Says that a checkpoint could not be written; rendering goes on.
fn warn(path: &Path, error: &PartError, kept: Option<&Path>) {
    say!("warning: cannot write the checkpoint {}: {}", path.display(), chain(error));
    if let Some(kept) = kept {
        say!("  it is kept as {}", kept.display());
    }
}

/// An error and everything that led to it, in a line.
fn chain(error: &(dyn std::error::Error + 'static)) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// The checkpoint, and what there is of the picture that it was last of.
pub struct Saved {
    checkpoint: Option<Checkpoint>,
    so_far: Option<Part>,
}

impl Saved {
    /// Reads the checkpoint if the arguments say so and it is there.
    pub fn open(args: &SplitArgs) -> anyhow::Result<Self> {
        let checkpoint = args.checkpoint.as_ref();
        let checkpoint = checkpoint.map(|path| Checkpoint::new(path, args.every).on_failure(warn));
        let so_far = match &checkpoint {
            Some(checkpoint) if args.resume => {
                checkpoint.load().context("cannot go on from the checkpoint")?
            }
            _ => None,
        };
        Ok(Self { checkpoint, so_far })
    }

    /// The frames that are still to be made. Those before the checkpoint's are done.
    pub fn frames_left(&self, frames: Option<(u32, u32)>) -> anyhow::Result<Range<u32>> {
        let Some((first, end)) = frames else { return Ok(0..1) };
        let Some(part) = &self.so_far else { return Ok(first..end) };
        let frame = part.identity.get("frame").and_then(|frame| frame.parse().ok());
        let frame: u32 = frame.context("the checkpoint is of a single picture, not of a sequence")?;
        ensure!((first..end).contains(&frame), "the checkpoint is of frame {frame}, not of {first}..{end}");
        Ok(frame..end)
    }

    /// Renders what is still missing, saving it on the way.
    pub fn render(
        &mut self,
        renderer: &mut Renderer,
        part_job: &PartJob,
        control: &Arc<Control>,
        quiet: bool,
    ) -> anyhow::Result<(Made, Summary)> {
        let so_far = self.so_far.take();
        let nothing = Coverage::default();
        let missing = so_far.as_ref().map_or(&nothing, Part::covered).missing(&part_job.share()?);
        let total = missing.blocks().iter().map(alhazen::Block::sample_count).sum();
        let display = ProgressDisplay::new(control.clone(), total, quiet);
        let name = self.checkpoint.as_ref().map_or(String::new(), |c| c.path().display().to_string());
        let so_far = so_far.map(|part| (name.as_str(), part));
        let (part, summary) = renderer.render_part(part_job, so_far, control, self.checkpoint.as_mut())?;
        display.finish();
        Ok((Made::Part(Box::new(part)), summary))
    }
}
