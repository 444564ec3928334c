//! Wheels and the source distribution of the Python package, by maturin.

use super::platform::{APPLE_TARGETS, Platform};
use crate::python::{Environment, folder as python_folder};
use crate::shell::{root, run as run_command};
use anyhow::{Context, ensure};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The builder, and Zig for Linux: exact versions with the hashes of their files, so that a release is built as it was tried.
const TOOLS: &str = "packaging/requirements.txt";

/// Maturin's arguments for a platform's wheel.
fn arguments(platform: &Platform) -> Vec<&'static str> {
    let mut arguments =
        vec!["build", "--locked", "--strip", "--profile", "dist", "--target", platform.target];
    if let Some(tag) = platform.wheel {
        arguments.extend(["--compatibility", tag]);
    }
    if platform.is_linux() {
        arguments.push("--zig");
    }
    arguments
}

/// Where licences lie that go into wheels; those of the project are part of the repository.
const LICENCES: &str = "crates/python/licenses";

/// Builds the wheel of a platform into `folder`.
///
/// # Errors
/// If pip or maturin fails.
pub fn wheel(platform: &Platform, python: &Path, folder: &Path) -> anyhow::Result<()> {
    if platform.target == "universal2-apple-darwin" {
        for target in APPLE_TARGETS {
            run_command(Command::new("rustup").args(["target", "add", target]))?;
        }
    }
    let notices = root().join(LICENCES).join("THIRD-PARTY-LICENSES.txt");
    std::fs::write(&notices, super::notices::text(platform, "python")?).context("cannot write licences")?;
    let built = run_maturin(&arguments(platform), python, folder);
    std::fs::remove_file(&notices).context("cannot remove what was written for the wheel")?;
    built
}

/// Packs the source distribution into `folder`.
///
/// # Errors
/// If pip or maturin fails.
pub fn sdist(python: &Path, folder: &Path) -> anyhow::Result<()> {
    run_maturin(&["sdist"], python, folder)?;
    let name = format!("alhazen_render-{}", super::VERSION);
    let scenes = super::archive::files_below(&root().join("scenes"))?;
    let scenes = scenes.iter().map(|path| Path::new("scenes").join(path));
    add(&folder.join(format!("{name}.tar.gz")), &name, &scenes.collect::<Vec<_>>())
        .context("cannot add the built-in scenes to the source distribution")
}

/// Adds files of the repository to a packed source distribution, below its folder `name`.
///
/// Maturin packs crates, and the built-in scenes, which `scene` includes, lie outside of them.
fn add(archive: &Path, name: &str, files: &[PathBuf]) -> anyhow::Result<()> {
    let packed = std::fs::read(archive)?;
    let mut old = tar::Archive::new(GzDecoder::new(&packed[..]));
    let mut new = tar::Builder::new(GzEncoder::new(std::fs::File::create(archive)?, Compression::best()));
    for entry in old.entries()? {
        let mut entry = entry?;
        let (mut header, path) = (entry.header().clone(), entry.path()?.into_owned());
        new.append_data(&mut header, path, &mut entry)?;
    }
    for file in files {
        let bytes = std::fs::read(root().join(file))?;
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        header.set_mtime(super::archive::timestamp());
        new.append_data(&mut header, Path::new(name).join(file), &bytes[..])?;
    }
    new.into_inner()?.finish()?.sync_all()?;
    Ok(())
}

fn run_maturin(arguments: &[&str], python: &Path, folder: &Path) -> anyhow::Result<()> {
    let builder = Environment::kept(python, &python_folder()?.join("release-builder"))?;
    let tools = root().join(TOOLS);
    builder.install(&[
        "--require-hashes",
        "--only-binary",
        ":all:",
        "--requirement",
        &tools.to_string_lossy(),
    ])?;
    let mut maturin = builder.python();
    maturin.args(["-m", "maturin"]).args(arguments);
    maturin.args(["--manifest-path", "crates/python/Cargo.toml", "--out"]).arg(folder).current_dir(root());
    run_command(&mut maturin)?;
    let packed = std::fs::read_dir(folder)?.flatten().any(|entry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        name.ends_with(".whl") || name.ends_with(".tar.gz")
    });
    ensure!(packed, "maturin has left nothing in {}", folder.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::platform::PLATFORMS;
    use super::*;
    use std::io::Read;

    #[test]
    fn wheels_for_linux_name_the_oldest_library() {
        for platform in PLATFORMS.iter().filter(|p| p.is_linux()) {
            let line = arguments(platform).join(" ");
            let tag = if platform.is_static() { "musllinux_1_2" } else { "manylinux_2_28" };
            assert!(line.contains(&format!("--compatibility {tag} --zig")), "{line}");
        }
        let glibc = super::super::binary::OLDEST_GLIBC.replace('.', "_");
        assert!(PLATFORMS.iter().any(|p| p.wheel.is_some_and(|tag| tag == format!("manylinux_{glibc}"))));
    }
    #[test]
    fn files_are_added_to_a_source_distribution() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tar.gz");
        let mut first = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::fast()));
        let mut header = tar::Header::new_gnu();
        header.set_size(3);
        first.append_data(&mut header, "a/PKG-INFO", &b"abc"[..]).unwrap();
        std::fs::write(&path, first.into_inner().unwrap().finish().unwrap()).unwrap();
        add(&path, "a", &[PathBuf::from("scenes/cornell.toml")]).unwrap();
        let packed = std::fs::read(&path).unwrap();
        let mut archive = tar::Archive::new(GzDecoder::new(&packed[..]));
        let found: Vec<_> = archive
            .entries()
            .unwrap()
            .map(|entry| {
                let mut entry = entry.unwrap();
                let mut text = String::new();
                entry.read_to_string(&mut text).unwrap();
                (entry.path().unwrap().to_string_lossy().into_owned(), text)
            })
            .collect();
        assert_eq!(found[0], ("a/PKG-INFO".to_owned(), "abc".to_owned()));
        let scene = std::fs::read_to_string(root().join("scenes/cornell.toml")).unwrap();
        assert_eq!(found[1..], [("a/scenes/cornell.toml".to_owned(), scene)]);
    }

    #[test]
    fn wheels_have_the_licences_of_the_project() {
        for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let [ours, copied] = [root().join(name), root().join(LICENCES).join(name)].map(std::fs::read);
            assert_eq!(ours.unwrap(), copied.unwrap(), "{name}");
        }
    }
}
