//! Mesa's software driver as a system package, for root on Debian and its kin.

use crate::shell::{output, run};
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The driver, and the loader through which programs find it.
pub const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// Where a Debian 12 is told of its backports.
const BACKPORTS_FILE: &str = "/etc/apt/sources.list.d/alhazen-backports.sources";

/// Whether system packages can be installed: Linux, apt and root.
pub fn may_install() -> bool {
    let id = output(Command::new("id").arg("-u"));
    id.is_ok_and(|id| id.trim() == "0") && is_there()
}

/// Whether there is an apt at all.
pub fn is_there() -> bool {
    let version = Command::new("apt-get").arg("--version").output();
    cfg!(target_os = "linux") && version.is_ok_and(|v| v.status.success())
}

/// The suite whose Mesa traces rays, where the distribution's own does not: Debian 12's backports.
pub fn newer_suite() -> Option<&'static str> {
    let release = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
    let is_bookworm = |l: &str| l.trim() == "VERSION_CODENAME=bookworm";
    (field(&release, "ID") == Some("debian") && release.lines().any(is_bookworm))
        .then_some("bookworm-backports")
}

fn field<'a>(release: &'a str, name: &str) -> Option<&'a str> {
    let value = release.lines().find_map(|l| l.trim().strip_prefix(name)?.strip_prefix('='))?;
    Some(value.trim_matches('"'))
}

/// Installs the packages, saying what it does to the system.
pub fn install() -> anyhow::Result<()> {
    let suite = newer_suite();
    if let Some(suite) = suite.filter(|s| !has_suite(s)) {
        let text = backports_source(suite, &mirror());
        eprintln!("adding {BACKPORTS_FILE}, because this Debian's own Mesa does not trace rays:\n{text}");
        std::fs::write(BACKPORTS_FILE, text).with_context(|| format!("cannot write {BACKPORTS_FILE}"))?;
    }
    // Sources that have nothing to do with this may be out of reach.
    if let Err(error) = run(&mut apt_get(&["update"])) {
        eprintln!("{error:#}; going on");
    }
    let mut command = apt_get(&["install", "-y", "--no-install-recommends"]);
    command.args(suite.iter().flat_map(|s| ["-t", s])).args(PACKAGES);
    run(&mut command)
}

/// Installs packages of the system's own suite.
pub fn install_packages(packages: &[&str]) -> anyhow::Result<()> {
    // Sources that have nothing to do with this may be out of reach.
    if let Err(error) = run(&mut apt_get(&["update"])) {
        eprintln!("{error:#}; going on");
    }
    run(apt_get(&["install", "-y", "--no-install-recommends"]).args(packages))
}

/// An apt-get that asks nothing and waits for others.
pub fn apt_get(arguments: &[&str]) -> Command {
    let mut command = Command::new("apt-get");
    command.args(["-qq", "-o", "DPkg::Lock::Timeout=300"]).args(arguments);
    command.env("DEBIAN_FRONTEND", "noninteractive").env("LC_ALL", "C");
    // Results go to stdout, and this is none.
    command.stdout(std::io::stderr());
    command
}

/// Whether apt's sources name `suite`.
pub fn has_suite(suite: &str) -> bool {
    let mut command = Command::new("apt-get");
    command.args(["indextargets", "--format", "$(CREATED_BY) $(RELEASE)"]);
    output(&mut command).is_ok_and(|targets| targets.lines().any(|l| l == format!("Packages {suite}")))
}

/// The mirror that the system uses.
pub fn mirror() -> String {
    let mut command = Command::new("apt-get");
    command.args(["indextargets", "--format", "$(CREATED_BY) $(RELEASE) $(REPO_URI)"]);
    let targets = output(&mut command).unwrap_or_default();
    let own = targets.lines().find_map(|l| l.strip_prefix("Packages bookworm "));
    own.unwrap_or("http://deb.debian.org/debian").trim_end_matches('/').to_owned()
}

fn backports_source(suite: &str, mirror: &str) -> String {
    format!(
        "# Added by `cargo xtask test` of Alhazen for a software Vulkan driver that traces rays.\n\
         # Backports are taken only where they are asked for. Delete this file if you do not want them.\n\
         Types: deb\nURIs: {mirror}\nSuites: {suite}\nComponents: main\n\
         Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg\n"
    )
}

/// Downloads packages (from `suite`, where it has newer ones) and what they need that the system lacks into `folder`,
/// without root; returns their files.
///
/// The package lists of `folder` are its own: those of the system belong to root, and may be missing.
pub fn download(packages: &[&str], suite: Option<&str>, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    ensure!(is_there(), "there is no apt-get to fetch packages with");
    let (lists, cache) = (folder.join("lists"), folder.join("cache"));
    for part in [lists.join("partial"), cache.join("archives/partial")] {
        std::fs::create_dir_all(&part).with_context(|| format!("cannot make {}", part.display()))?;
    }
    let sources = folder.join("sources.list");
    let mut text = std::fs::read_to_string("/etc/apt/sources.list").unwrap_or_default();
    if let Some(suite) = suite.filter(|s| !has_suite(s)) {
        let keyring = "/usr/share/keyrings/debian-archive-keyring.gpg";
        text += &format!("\ndeb [signed-by={keyring}] {} {suite} main\n", mirror());
    }
    std::fs::write(&sources, text).with_context(|| format!("cannot write {}", sources.display()))?;
    let own = |arguments: &[&str]| {
        let mut command = apt_get(&["-o", "Debug::NoLocking=1", "-o", "APT::Sandbox::User=root"]);
        for (option, path) in
            [("Dir::Etc::SourceList", &sources), ("Dir::State::Lists", &lists), ("Dir::Cache", &cache)]
        {
            command.args(["-o", &format!("{option}={}", path.display())]);
        }
        command.args(arguments);
        command
    };
    if let Err(error) = run(&mut own(&["update"])) {
        eprintln!("{error:#}; going on");
    }
    // `--reinstall`: also when the system has the packages, in whatever state.
    let mut command = own(&["install", "-y", "--no-install-recommends", "--download-only", "--reinstall"]);
    command.args(suite.iter().flat_map(|s| ["-t", s])).args(packages);
    run(&mut command)?;
    let archives = cache.join("archives");
    let entries =
        std::fs::read_dir(&archives).with_context(|| format!("cannot read {}", archives.display()))?;
    let files = entries.map(|e| Ok(e?.path())).collect::<anyhow::Result<Vec<_>>>()?;
    let packages: Vec<_> = files.into_iter().filter(|f| f.extension().is_some_and(|e| e == "deb")).collect();
    ensure!(!packages.is_empty(), "apt-get downloaded nothing to {}", archives.display());
    Ok(packages)
}

/// Downloads packages of the system's own suite by way of `folder` and unpacks them into `root`.
pub fn unpack_packages(packages: &[&str], folder: &Path, root: &Path) -> anyhow::Result<()> {
    unpack(&download(packages, None, folder)?, root)
}

/// Unpacks packages into `root`.
pub fn unpack(packages: &[PathBuf], root: &Path) -> anyhow::Result<()> {
    eprintln!("unpacking {} packages", packages.len());
    for package in packages {
        // A second C library beside the one that runs the programs would crash them.
        let is_libc = package.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libc6_"));
        if !is_libc {
            output(Command::new("dpkg").arg("-x").arg(package).arg(root))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_os_release_are_read() {
        let release = "PRETTY_NAME=\"Debian GNU/Linux 12 (bookworm)\"\nVERSION_ID=\"12\"\nID=debian\n";
        assert_eq!(field(release, "ID"), Some("debian"));
        assert_eq!(field(release, "VERSION_ID"), Some("12"));
        assert_eq!(field(release, "VERSION_CODENAME"), None);
    }

    #[test]
    fn the_source_names_suite_and_mirror() {
        let text = backports_source("bookworm-backports", "http://mirror.example/debian");
        assert!(
            text.contains("\nURIs: http://mirror.example/debian\nSuites: bookworm-backports\n"),
            "{text}"
        );
    }
}
