//! Archives that hold the same bytes whenever they are made: sorted names, no owners, the commit's time.

use super::platform::Layout;
use anyhow::Context;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// What every entry is dated: `SOURCE_DATE_EPOCH`, or else the time of the commit, in seconds since 1970.
pub fn timestamp() -> u64 {
    let named = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok());
    let of_commit = || {
        let mut git = std::process::Command::new("git");
        git.args(["log", "-1", "--format=%ct"]).current_dir(crate::shell::root());
        crate::shell::output(&mut git).ok()?.trim().parse().ok()
    };
    named.or_else(of_commit).unwrap_or(0)
}

/// Packs the folder `tree` to `file`, below the name of the folder.
///
/// # Errors
/// If a file cannot be read or written.
pub fn pack(tree: &Path, layout: Layout, file: &Path) -> anyhow::Result<()> {
    let packed = if layout == Layout::Windows { zip(tree, file) } else { tar(tree, file) };
    packed.with_context(|| format!("cannot pack {}", file.display()))
}

/// Files below `folder`, relative to it and sorted.
pub fn files_below(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    fn visit(folder: &Path, below: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
        for entry in std::fs::read_dir(folder.join(below))? {
            let entry = entry?;
            let path = below.join(entry.file_name());
            if entry.file_type()?.is_dir() { visit(folder, &path, files)? } else { files.push(path) }
        }
        Ok(())
    }
    let mut files = Vec::new();
    visit(folder, Path::new(""), &mut files)?;
    files.sort();
    Ok(files)
}

/// A path as archives have it.
fn with_slashes(path: &Path) -> String {
    path.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// Programs may be run; nothing else.
fn mode(path: &Path) -> u32 {
    if path.starts_with("bin") || path.extension().is_some_and(|e| e == "exe") { 0o755 } else { 0o644 }
}

fn tar(tree: &Path, file: &Path) -> anyhow::Result<()> {
    let name = tree.file_name().context("no name")?.to_string_lossy();
    let encoder = GzEncoder::new(BufWriter::new(File::create(file)?), Compression::best());
    let mut archive = tar::Builder::new(encoder);
    let time = timestamp();
    for path in files_below(tree)? {
        let bytes = std::fs::read(tree.join(&path))?;
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(mode(&path));
        header.set_mtime(time);
        archive.append_data(&mut header, format!("{name}/{}", with_slashes(&path)), &bytes[..])?;
    }
    archive.into_inner()?.finish()?.into_inner()?.sync_all()?;
    Ok(())
}

fn zip(tree: &Path, file: &Path) -> anyhow::Result<()> {
    use std::io::Write;
    let name = tree.file_name().context("no name")?.to_string_lossy();
    let mut archive = zip::ZipWriter::new(BufWriter::new(File::create(file)?));
    for path in files_below(tree)? {
        // ZIP's oldest date for all: its times are local, so that a real one would depend on the machine.
        let options = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Deflated)
            .last_modified_time(zip::DateTime::default())
            .unix_permissions(mode(&path));
        archive.start_file(format!("{name}/{}", with_slashes(&path)), options)?;
        archive.write_all(&std::fs::read(tree.join(&path))?)?;
    }
    archive.finish()?.into_inner().map_err(|e| e.into_error())?.sync_all()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    fn tree() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let tree = folder.path().join("alhazen-1-linux");
        std::fs::create_dir_all(tree.join("bin")).unwrap();
        std::fs::create_dir_all(tree.join("share/doc")).unwrap();
        std::fs::write(tree.join("bin/alhazen"), b"program").unwrap();
        std::fs::write(tree.join("share/doc/README.md"), b"text").unwrap();
        (folder, tree)
    }

    #[test]
    fn tar_archives_have_names_modes_and_contents() {
        let (folder, tree) = tree();
        let file = folder.path().join("a.tar.gz");
        pack(&tree, Layout::Desktop, &file).unwrap();
        let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(File::open(&file).unwrap()));
        let mut found = Vec::new();
        for entry in archive.entries().unwrap() {
            let mut entry = entry.unwrap();
            let (path, mode) =
                (entry.path().unwrap().to_string_lossy().into_owned(), entry.header().mode().unwrap());
            let mut text = String::new();
            entry.read_to_string(&mut text).unwrap();
            found.push((path, mode, text));
        }
        let expected = [
            ("alhazen-1-linux/bin/alhazen", 0o755, "program"),
            ("alhazen-1-linux/share/doc/README.md", 0o644, "text"),
        ];
        assert_eq!(found, expected.map(|(path, mode, text)| (path.to_owned(), mode, text.to_owned())));
    }

    #[test]
    fn zip_archives_have_names_and_contents() {
        let (folder, tree) = tree();
        let file = folder.path().join("a.zip");
        pack(&tree, Layout::Windows, &file).unwrap();
        let mut archive = zip::ZipArchive::new(File::open(&file).unwrap()).unwrap();
        assert_eq!(archive.len(), 2);
        let mut text = String::new();
        archive.by_name("alhazen-1-linux/bin/alhazen").unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "program");
    }

    #[test]
    fn the_same_tree_gives_the_same_bytes() {
        let (folder, tree) = tree();
        for layout in [Layout::Plain, Layout::Windows] {
            let [first, second] = ["first", "second"].map(|name| {
                let file = folder.path().join(name);
                pack(&tree, layout, &file).unwrap();
                std::fs::read(file).unwrap()
            });
            assert!(first == second, "{layout:?}");
        }
    }
}
