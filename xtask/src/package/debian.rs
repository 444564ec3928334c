//! The Debian package, made of the same tree as the archive.

use super::VERSION;
use super::archive::{files_below, timestamp};
use super::platform::Platform;
use crate::shell::{root, run as run_command};
use anyhow::Context;
use flate2::write::GzEncoder;
use flate2::{Compression, GzBuilder};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where a file of the tree goes in the package, and whether it is compressed there; `None`: it stays out.
fn place(path: &str) -> Option<(String, bool)> {
    let same = || format!("usr/{path}");
    match path {
        // Debian's own places and names.
        "share/zsh/site-functions/_alhazen" => {
            Some(("usr/share/zsh/vendor-completions/_alhazen".into(), false))
        }
        "share/doc/alhazen/CHANGELOG.md" => Some(("usr/share/doc/alhazen/changelog".into(), true)),
        "share/doc/alhazen/THIRD-PARTY-LICENSES.txt" => Some((same(), true)),
        // `copyright` has both.
        "share/doc/alhazen/LICENSE-MIT" | "share/doc/alhazen/LICENSE-APACHE" => None,
        _ => Some((same(), path.starts_with("share/man/"))),
    }
}

/// Makes the package of `tree` in `folder`; returns its path, or `None` where there is none for the platform.
///
/// # Errors
/// If `dpkg-deb` is missing or fails.
pub fn make(platform: &Platform, tree: &Path, folder: &Path) -> anyhow::Result<Option<PathBuf>> {
    let (Some(processor), Some(name)) = (platform.debian, platform.debian_file()) else { return Ok(None) };
    let stage = super::folder()?.join("debian");
    super::empty(&stage)?;
    let mut bytes = 0;
    for path in files_below(tree)? {
        let from = tree.join(&path);
        let Some((to, compressed)) = place(&path.to_string_lossy()) else { continue };
        let content = std::fs::read(&from)?;
        bytes += content.len() as u64;
        write(&stage, &to, &content, compressed)?;
    }
    let copyright = std::fs::read(root().join("packaging/debian/copyright"))?;
    write(&stage, "usr/share/doc/alhazen/copyright", &copyright, false)?;
    write(&stage, "usr/share/doc/alhazen/changelog.Debian", changelog().as_bytes(), true)?;
    let control = std::fs::read_to_string(root().join("packaging/debian/control.in"))?;
    write(&stage, "DEBIAN/control", fill(&control, processor, bytes.div_ceil(1024)).as_bytes(), false)?;
    let package = folder.join(name);
    let mut dpkg = Command::new("dpkg-deb");
    dpkg.env("SOURCE_DATE_EPOCH", timestamp().to_string()).args(["--root-owner-group", "-Zxz", "--build"]);
    run_command(dpkg.arg(&stage).arg(&package))?;
    Ok(Some(package))
}

fn fill(control: &str, processor: &str, kilobytes: u64) -> String {
    let control = control.replace("@VERSION@", VERSION).replace("@PROCESSOR@", processor);
    control.replace("@KILOBYTES@", &kilobytes.to_string())
}

/// Debian's changelog, which says who packed; the project's own lies beside it.
fn changelog() -> String {
    let mut date = Command::new("date");
    date.env("LC_ALL", "C").args(["--utc", "--rfc-email", &format!("--date=@{}", timestamp())]);
    let date = crate::shell::output(&mut date).unwrap_or_default();
    format!(
        "alhazen ({VERSION}-1) unstable; urgency=medium\n\n  * See changelog.gz.\n\n -- Alhazen maintainers \
         <alhazen@users.noreply.github.com>  {}\n",
        date.trim()
    )
}

fn write(stage: &Path, to: &str, content: &[u8], compressed: bool) -> anyhow::Result<()> {
    let to = stage.join(if compressed { format!("{to}.gz") } else { to.to_owned() });
    let folder = to.parent().context("no folder")?;
    std::fs::create_dir_all(folder)?;
    let file = std::fs::File::create(&to).with_context(|| format!("cannot make {}", to.display()))?;
    if compressed {
        // Without a name and a time, so that the same text gives the same bytes.
        let mut encoder: GzEncoder<_> = GzBuilder::new().write(file, Compression::best());
        encoder.write_all(content)?;
        encoder.finish()?;
    } else {
        (&file).write_all(content)?;
    }
    set_modes(&to, stage)
}

/// Programs may be run; folders may be entered; whatever the umask is.
#[cfg(unix)]
fn set_modes(file: &Path, stage: &Path) -> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let set = |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode));
    set(file, if file.starts_with(stage.join("usr/bin")) { 0o755 } else { 0o644 })?;
    for folder in file.ancestors().skip(1).take_while(|f| f.starts_with(stage)) {
        set(folder, 0o755)?;
    }
    Ok(())
}

#[cfg(not(unix))]
fn set_modes(_: &Path, _: &Path) -> anyhow::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_go_where_debian_wants_them() {
        let at = |path: &str| place(path).map(|(to, compressed)| to + if compressed { ".gz" } else { "" });
        assert_eq!(at("bin/alhazen").as_deref(), Some("usr/bin/alhazen"));
        assert_eq!(at("share/man/man1/alhazen.1").as_deref(), Some("usr/share/man/man1/alhazen.1.gz"));
        assert_eq!(
            at("share/doc/alhazen/CHANGELOG.md").as_deref(),
            Some("usr/share/doc/alhazen/changelog.gz")
        );
        assert_eq!(at("share/doc/alhazen/LICENSE-MIT"), None);
    }

    #[test]
    fn the_control_file_is_complete() {
        let control = std::fs::read_to_string(root().join("packaging/debian/control.in")).unwrap();
        let filled = fill(&control, "amd64", 7);
        assert!(!filled.contains('@') || filled.matches('@').count() == 1, "only the maintainer: {filled}");
        for line in [&format!("Version: {VERSION}-1")[..], "Architecture: amd64", "Installed-Size: 7"] {
            assert!(filled.lines().any(|l| l == line), "no `{line}`");
        }
    }
}
