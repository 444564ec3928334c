//! The sources of a release: what git has of the commit, in one archive.

use super::VERSION;
use crate::shell::root;
use anyhow::{Context, ensure};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The archive's name.
pub fn file() -> String {
    format!("alhazen-{VERSION}-source.tar.gz")
}

/// Packs the commit's files into `folder`. Changes that are not committed are not part of it.
///
/// # Errors
/// If git fails.
pub fn pack(folder: &Path) -> anyhow::Result<PathBuf> {
    let path = folder.join(file());
    let mut git = Command::new("git");
    git.args(["archive", "--format=tar", &format!("--prefix=alhazen-{VERSION}/"), "HEAD"]);
    let mut child = git.current_dir(root()).stdout(Stdio::piped()).spawn().context("cannot run git")?;
    let mut encoder = GzEncoder::new(File::create(&path)?, Compression::best());
    let mut tar = child.stdout.take().context("git has no output")?;
    std::io::copy(&mut tar, &mut encoder).context("cannot pack the sources")?;
    encoder.finish()?.sync_all()?;
    ensure!(child.wait()?.success(), "git archive failed");
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sources_are_packed() {
        let folder = tempfile::tempdir().unwrap();
        // A copy of the sources, such as this archive itself, has no git.
        if !root().join(".git").exists() {
            return;
        }
        let file = File::open(pack(folder.path()).unwrap()).unwrap();
        let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(file));
        let manifest = format!("alhazen-{VERSION}/Cargo.toml");
        let mut paths = archive.entries().unwrap().map(|e| e.unwrap().path().unwrap().into_owned());
        assert!(paths.any(|path| path == Path::new(&manifest)));
    }
}
