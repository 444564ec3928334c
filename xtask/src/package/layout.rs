//! What is in an archive, and where.

use super::platform::{Layout, Platform};
use crate::shell::{output, root, run as run_command};
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The name under which desktops know the program.
pub const ID: &str = "io.github.alhazen_render.alhazen";

/// Where the text of a file comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The program itself.
    Program,
    /// A file of the repository.
    Repository(&'static str),
    /// A desktop's file: `packaging/desktop/ID.` and this ending.
    Desktop(&'static str),
    /// What `alhazen completions SHELL` prints.
    Completions(&'static str),
    /// All pages that `alhazen man --output` writes into a folder.
    ManualPages,
    /// Licences of the crates that are linked.
    Notices,
}

/// A file, or for manual pages a folder, of an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// What it is.
    pub origin: Origin,
    /// Where it lies below the archive's folder, with `/`.
    pub place: String,
}

/// Everything in the archive of a platform.
pub fn entries(platform: &Platform) -> Vec<Entry> {
    let mut entries = Vec::new();
    let mut add = |origin, place: String| entries.push(Entry { origin, place });
    let documents = match platform.layout {
        Layout::Windows => {
            add(Origin::Program, platform.program().into());
            add(Origin::Completions("powershell"), "completions/_alhazen.ps1".into());
            String::new()
        }
        Layout::Desktop | Layout::Plain => {
            add(Origin::Program, format!("bin/{}", platform.program()));
            add(Origin::ManualPages, "share/man/man1".into());
            add(Origin::Completions("bash"), "share/bash-completion/completions/alhazen".into());
            add(Origin::Completions("zsh"), "share/zsh/site-functions/_alhazen".into());
            add(Origin::Completions("fish"), "share/fish/vendor_completions.d/alhazen.fish".into());
            "share/doc/alhazen/".to_owned()
        }
    };
    if platform.layout == Layout::Desktop {
        for (ending, folder) in [
            ("desktop", "applications"),
            ("svg", "icons/hicolor/scalable/apps"),
            ("metainfo.xml", "metainfo"),
            ("thumbnailer", "thumbnailers"),
        ] {
            add(Origin::Desktop(ending), format!("share/{folder}/{ID}.{ending}"));
        }
        add(Origin::Desktop("mime.xml"), format!("share/mime/packages/{ID}.xml"));
    }
    for file in ["README.md", "CHANGELOG.md", "SECURITY.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        add(Origin::Repository(file), format!("{documents}{file}"));
    }
    add(Origin::Notices, format!("{documents}THIRD-PARTY-LICENSES.txt"));
    entries
}

/// The programs that a tree is made of.
pub struct Programs<'a> {
    /// The one that is packed.
    pub packed: &'a Path,
    /// The one that prints completions and pages: it must run here.
    pub speaking: &'a Path,
}

/// Writes the tree of a platform to `folder`, which is emptied before.
pub fn write(platform: &Platform, programs: &Programs<'_>, folder: &Path) -> anyhow::Result<()> {
    super::empty(folder)?;
    for Entry { origin, place } in entries(platform) {
        let to = folder.join(place);
        let parent = to.parent().context("no folder")?;
        std::fs::create_dir_all(parent).with_context(|| format!("cannot make {}", parent.display()))?;
        let speak = |arguments: &[&str]| output(Command::new(programs.speaking).args(arguments));
        match origin {
            Origin::Program => copy(programs.packed, &to)?,
            Origin::Repository(file) => copy(&root().join(file), &to)?,
            Origin::Desktop(ending) => copy(&desktop_file(ending), &to)?,
            Origin::Completions(shell) => {
                let script = speak(&["completions", shell])?;
                ensure!(script.contains("alhazen"), "`alhazen completions {shell}` printed no script");
                std::fs::write(&to, script)?;
            }
            Origin::ManualPages => {
                let mut man = Command::new(programs.speaking);
                run_command(man.args(["man", "--output"]).arg(&to))?;
                ensure!(to.join("alhazen.1").is_file(), "`alhazen man` wrote no alhazen.1");
            }
            Origin::Notices => std::fs::write(&to, super::notices::text(platform, "cli")?)?,
        }
    }
    make_executable(&folder.join(match platform.layout {
        Layout::Windows => platform.program().to_owned(),
        Layout::Desktop | Layout::Plain => format!("bin/{}", platform.program()),
    }))
}

/// The file of the repository that desktops read, by its ending.
pub fn desktop_file(ending: &str) -> PathBuf {
    root().join(format!("packaging/desktop/{ID}.{ending}"))
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    let copied = std::fs::copy(from, to);
    copied.map(drop).with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))
}

#[cfg(unix)]
fn make_executable(path: &Path) -> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    Ok(std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755))?)
}

#[cfg(not(unix))]
fn make_executable(_: &Path) -> anyhow::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::platform::PLATFORMS;
    use super::*;

    #[test]
    fn files_of_the_repository_exist() {
        for entry in PLATFORMS.iter().flat_map(entries) {
            let file = match entry.origin {
                Origin::Repository(file) => root().join(file),
                Origin::Desktop(ending) => desktop_file(ending),
                _ => continue,
            };
            assert!(file.is_file(), "{} is missing", file.display());
        }
    }

    #[test]
    fn every_archive_has_program_licences_and_completions() {
        for platform in PLATFORMS {
            let entries = entries(&platform);
            let has = |origin: &Origin| entries.iter().any(|e| e.origin == *origin);
            assert!(has(&Origin::Program) && has(&Origin::Notices), "{}", platform.name);
            assert!(has(&Origin::Repository("LICENSE-MIT")) && has(&Origin::Repository("LICENSE-APACHE")));
            assert!(entries.iter().any(|e| matches!(e.origin, Origin::Completions(_))));
            let is_desktop = platform.layout == Layout::Desktop;
            assert_eq!(has(&Origin::Desktop("desktop")), is_desktop, "{}", platform.name);
            let mut places: Vec<_> = entries.iter().map(|e| &e.place).collect();
            places.sort();
            places.dedup();
            assert_eq!(places.len(), entries.len(), "two files at one place");
        }
    }
}
