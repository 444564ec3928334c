//! `alhazen merge`: adds up the parts of a picture.

use super::render::{check_output, frame_path};
use super::tone::ToneArgs;
use crate::console::{keep_each, say};
use crate::exit::Exit;
use alhazen::{Coverage, Merger, Part, ProtectedFiles, finish, output, tone_of};
use anyhow::{Context, anyhow};
use std::path::PathBuf;

/// Add up parts of a picture.
///
/// Parts are .exr files that `alhazen render` writes with --tile, --sample-range or --part; checkpoints are parts, too.
/// The order does not matter, and the result is the picture made whole, bit for bit.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen render atrium --tile 1/2 -o part1.exr
  alhazen render atrium --tile 2/2 -o part2.exr
  alhazen merge part*.exr -o atrium.exr -o atrium.png")]
pub struct MergeArgs {
    /// Parts to add up.
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,
    /// Picture to write: .png or .jpg (tone mapped), .exr (linear, layers, metadata) or .hdr. May be given several times.
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Write a part again (.exr), which can be merged with further ones, instead of a picture. It may be incomplete.
    #[arg(long)]
    part: bool,
    /// Merge what there is even if tiles or samples are missing. Pixels without samples are black.
    #[arg(long)]
    allow_missing: bool,
    /// Merge this frame of a sequence: the names of parts and outputs get its number, as those of `alhazen render` do.
    #[arg(long, value_name = "N")]
    frame: Option<u32>,
    #[command(flatten)]
    tone: ToneArgs,
    /// No report.
    #[arg(short, long)]
    quiet: bool,
}

/// Merges.
pub fn run(args: &MergeArgs) -> anyhow::Result<()> {
    let numbered = |paths: &[PathBuf]| -> Vec<PathBuf> {
        paths.iter().map(|path| frame_path(path, args.frame)).collect()
    };
    let (parts, outputs) = (numbered(&args.parts), numbered(&args.output));
    let inputs = ProtectedFiles::new(&parts);
    for path in &outputs {
        check_output(path, args.part, &inputs)?;
        let is_exr = output::Format::of(path)? == output::Format::Exr;
        if args.part && !is_exr {
            let text = format!("{} cannot hold a part: parts are .exr files", path.display());
            return Err(Exit::Usage.with(anyhow!(text)));
        }
    }
    let mut merger = Merger::new();
    for path in &parts {
        merger.add(&path.display().to_string(), Part::read(path)?)?;
    }
    let part = merger.finish()?;
    let missing = part.missing();
    if !missing.is_empty() && !args.part {
        let what = describe(&missing);
        if !args.allow_missing {
            let text = format!("the picture is not complete (see --allow-missing): there are no {what}");
            return Err(Exit::Input.with(anyhow!(text)));
        }
        say!("warning: the picture is not complete: there are no {what}");
    }
    let names: Vec<_> = outputs.iter().map(|p| p.display().to_string()).collect();
    let summary = format!(
        "{}: {} parts, {}×{}, {} spp",
        names.join(", "),
        parts.len(),
        part.film().width(),
        part.film().height(),
        part.whole().samples.len()
    );
    if args.part {
        keep_each(&outputs, |path| Ok(part.write(path)?))?;
    } else {
        let mut tone = tone_of(&part).context("the parts do not say how to show the picture")?;
        args.tone.apply(&mut tone);
        let (film, metadata) = finish(part)?;
        keep_each(&outputs, |path| Ok(output::write(path, &film, &tone, &metadata)?))?;
    }
    if !args.quiet {
        say!("{summary}");
    }
    Ok(())
}

/// The first missing blocks, for people.
fn describe(missing: &Coverage) -> String {
    const MOST: usize = 3;
    let blocks = missing.blocks();
    let mut text = blocks.iter().take(MOST).map(ToString::to_string).collect::<Vec<_>>().join(", no ");
    if blocks.len() > MOST {
        text += &format!(", and {} more gaps", blocks.len() - MOST);
    }
    text
}
