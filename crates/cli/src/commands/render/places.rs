//! Where pictures go, and whether they can be written there.

use crate::exit::Exit;
use alhazen::{ProtectedFiles, prove_writable};
use anyhow::anyhow;
use std::path::{Path, PathBuf};

/// Finds out before rendering what would keep the picture, or a part if `is_part`, from being written.
pub fn check_output(path: &Path, is_part: bool, inputs: &ProtectedFiles) -> anyhow::Result<()> {
    alhazen::output::Format::of(path)?;
    check_folder(path)?;
    Ok(alhazen::output::prove(path, is_part, inputs)?)
}

/// Finds out whether a file can be written to `path`.
pub fn check_place(path: &Path) -> anyhow::Result<()> {
    check_folder(path)?;
    Ok(prove_writable(path)?)
}

fn check_folder(path: &Path) -> anyhow::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.is_dir() {
        return Ok(());
    }
    let text = format!("cannot write {}: there is no folder {}", path.display(), folder.display());
    Err(Exit::Output.with(anyhow!(text)))
}

/// Where a picture goes: that of a frame of a sequence, or the only one.
pub fn frame_path(path: &Path, frame: Option<u32>) -> PathBuf {
    frame.map_or_else(|| path.to_owned(), |frame| alhazen::output::frame_path(path, frame))
}

/// Whether a file name is that of a video.
pub fn is_video(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mp4"))
}
