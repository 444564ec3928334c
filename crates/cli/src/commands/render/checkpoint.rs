//! Rendering in several sittings: what is saved on the way, and going on from there.

use super::made::Made;
use super::split::SplitArgs;
use crate::console::{ProgressDisplay, say};
use alhazen::{Checkpoint, Control, Coverage, Part, PartError, PartJob, Renderer, Summary};
use anyhow::{Context, ensure};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

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
        let checkpoint = args.checkpoint();
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
