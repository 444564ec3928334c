//! How a picture is divided: into parts, and over several sittings.

use super::parsing::{Samples, parse_duration, parse_samples};
use super::places::check_place;
use alhazen::{ProtectedFiles, Tile, output};
use anyhow::{bail, ensure};
use std::ops::Range;
use std::path::PathBuf;
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
    pub(super) every: Duration,
    /// Go on from the checkpoint if it is there.
    #[arg(long, help_heading = "Parts", requires = "checkpoint")]
    pub(super) resume: bool,
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
