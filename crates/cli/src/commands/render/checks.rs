//! What is found out before anything is rendered: arguments that cannot be, and outputs that cannot be written.

use super::args::RenderArgs;
use super::parsing::MAX_FRAMES;
use super::places::{check_output, check_place, frame_path};
use super::video::Video;
use crate::exit::Exit;
use alhazen::ProtectedFiles;
use anyhow::{anyhow, bail, ensure};
use std::path::PathBuf;

/// Finds out before anything is loaded what of the arguments cannot be, or cannot be written. Returns the videos and the
/// pictures among the outputs.
pub fn check(args: &RenderArgs) -> anyhow::Result<(Vec<Video>, Vec<PathBuf>)> {
    let (videos, pictures) = Video::split(args)?;
    let first = args.sequence().map(|(first, _)| first);
    for path in &pictures {
        check_output(&frame_path(path, first), args.split.makes_parts(), &ProtectedFiles::default())?;
    }
    args.profile.as_deref().map_or(Ok(()), check_place)?;
    check_sequence(args)?;
    check_profile(args)?;
    args.split.check(&args.output)?;
    ensure!(
        videos.is_empty() || !args.split.is_used(),
        "a video cannot be rendered in parts: render its frames"
    );
    if args.is_adaptive()
        && let Some(option) = args.split.given()
    {
        bail!("{option} and --sampling adaptive: parts of a picture have the same samples for every pixel");
    }
    Ok((videos, pictures))
}

/// Refuses sequences without an end. More frames than that are several commands.
fn check_sequence(args: &RenderArgs) -> anyhow::Result<()> {
    let count = args.sequence().map_or(1, |(first, end)| end - first);
    let error = || anyhow!("{count} frames are more than {MAX_FRAMES}: render some of them with --frames");
    if count > MAX_FRAMES { Err(Exit::Usage.with(error())) } else { Ok(()) }
}

/// Refuses a profile in the place of another output.
fn check_profile(args: &RenderArgs) -> anyhow::Result<()> {
    let Some(profile) = &args.profile else { return Ok(()) };
    let taken = args.output.iter().chain(args.split.checkpoint()).any(|path| path == profile);
    let error = || anyhow!("--profile {}: another output has that name", profile.display());
    if taken { Err(Exit::Usage.with(error())) } else { Ok(()) }
}

/// Refuses to replace what was read to make the picture.
pub fn protect_inputs(
    args: &RenderArgs,
    inputs: &ProtectedFiles,
    pictures: &[PathBuf],
) -> anyhow::Result<()> {
    let numbers = args.sequence().map_or(vec![None], |(first, end)| (first..end).map(Some).collect());
    for frame in numbers {
        pictures.iter().try_for_each(|path| inputs.check(&frame_path(path, frame)))?;
    }
    let others = args.output.iter().chain(&args.profile).chain(args.split.checkpoint());
    Ok(others.into_iter().try_for_each(|path| inputs.check(path))?)
}
