//! Sequences as videos, by the program ffmpeg where it is installed.

use super::args::RenderArgs;
use super::places::{check_place, is_video};
use crate::console::say;
use alhazen::{ImageError, write_atomically};
use anyhow::{Context, bail, ensure};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A video whose frames are rendered to a folder of their own, which goes when the video is there.
pub struct Video {
    path: PathBuf,
    folder: PathBuf,
    ffmpeg: PathBuf,
}

impl Video {
    /// The videos among the outputs that were asked for, and the other outputs.
    pub fn split(args: &RenderArgs) -> anyhow::Result<(Vec<Self>, Vec<PathBuf>)> {
        let (videos, pictures): (Vec<&PathBuf>, Vec<&PathBuf>) =
            args.output.iter().partition(|path| is_video(path));
        let videos = videos.into_iter().enumerate().map(|(number, path)| Self::new(path, number, args));
        Ok((videos.collect::<Result<_, _>>()?, pictures.into_iter().cloned().collect()))
    }

    fn new(path: &Path, number: usize, args: &RenderArgs) -> anyhow::Result<Self> {
        check_place(path)?;
        ensure!(args.sequence().is_some(), "{}: a video needs --frames or --turntable", path.display());
        let Some(ffmpeg) = find_ffmpeg() else {
            bail!("{}: a video needs ffmpeg, which is not installed; .png writes its frames", path.display());
        };
        let folder = std::env::temp_dir().join(format!("alhazen-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        Ok(Self { path: path.to_owned(), folder, ffmpeg })
    }

    /// Where a frame is to be written.
    pub fn frame(&self, number: u32) -> PathBuf {
        self.folder.join(format!("{number:08}.png"))
    }

    /// Makes the video of all frames from `first` on, at `fps` frames a second. It is there complete, or not at all; then the
    /// frames are kept.
    pub fn finish(self, first: u32, fps: f32) -> anyhow::Result<()> {
        let made = self.folder.join("video.mp4");
        let mut command = Command::new(&self.ffmpeg);
        command.args(["-y", "-loglevel", "error", "-framerate", &fps.to_string()]);
        command.args(["-start_number", &first.to_string(), "-i"]).arg(self.folder.join("%08d.png"));
        // Most players want even sides and no more colour samples than this.
        command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "16"]);
        command.args(["-pix_fmt", "yuv420p", "-movflags", "+faststart"]).arg(&made);
        let run = command.output().with_context(|| format!("cannot run {}", self.ffmpeg.display()))?;
        ensure!(
            run.status.success() && made.is_file(),
            "{} could not make {}: {}",
            self.ffmpeg.display(),
            self.path.display(),
            String::from_utf8_lossy(&run.stderr).trim()
        );
        // The folder may be on another file system.
        let failed = |source| ImageError::Write { path: self.path.clone(), source };
        write_atomically(&self.path, |writer| {
            let mut made = File::open(&made).map_err(failed)?;
            std::io::copy(&mut made, writer).map(drop).map_err(failed)
        })?;
        // What is left in a temporary folder harms nobody.
        let _ = std::fs::remove_dir_all(&self.folder);
        Ok(())
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        // Frames that were rendered are kept: only an empty folder can be removed so.
        if std::fs::remove_dir(&self.folder).is_err() && self.folder.is_dir() {
            say!("the frames of {} are kept in {}", self.path.display(), self.folder.display());
        }
    }
}

fn find_ffmpeg() -> Option<PathBuf> {
    let name = if cfg!(windows) { "ffmpeg.exe" } else { "ffmpeg" };
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.is_file())
}
