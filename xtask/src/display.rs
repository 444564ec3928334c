//! A display without a screen (Xvfb), for tests that open windows.
//!
//! Who has one keeps it. Root on Debian and its kin gets the system packages. Everybody else gets them unpacked beside the
//! build, with a program that starts the server where it sees them.

use crate::shell::target_dir;
use crate::vulkan::{Variables, apt};
use anyhow::{Context, ensure};
use std::path::Path;
use std::process::{Command, Stdio};

/// The server, the program that compiles its keyboard, and the libraries that windows are opened with.
const PACKAGES: [&str; 8] = [
    "xvfb",
    "x11-xkb-utils",
    "xkb-data",
    "libx11-6",
    "libx11-xcb1",
    "libxcursor1",
    "libxi6",
    "libxkbcommon-x11-0",
];

/// Sees to it that there is one; the variables by which tests find it. That there is none is no error: tests then say that
/// they are skipped.
pub fn prepare() -> Variables {
    match find_or_set_up() {
        Ok(variables) => variables,
        Err(error) => {
            eprintln!("no Xvfb; tests that open windows will be skipped: {error:#}");
            Variables::new()
        }
    }
}

fn find_or_set_up() -> anyhow::Result<Variables> {
    if starts("Xvfb") {
        return Ok(Variables::new());
    }
    let folder = target_dir()?.join("xvfb");
    let starter = folder.join("Xvfb");
    if !starter.is_file() {
        eprintln!("there is no Xvfb: setting one up");
        if apt::may_install() {
            match apt::install_packages(&PACKAGES) {
                Ok(()) if starts("Xvfb") => return Ok(Variables::new()),
                Ok(()) => eprintln!("the system packages did not help: unpacking them beside the build"),
                Err(error) => eprintln!("{error:#}: unpacking them beside the build"),
            }
        }
        unpack(&folder)?;
    }
    ensure!(starts(&starter.to_string_lossy()), "{} does not start", starter.display());
    let libraries = folder.join("libraries");
    let mut search = libraries.to_string_lossy().into_owned();
    if let Ok(before) = std::env::var("LD_LIBRARY_PATH") {
        search += &format!(":{before}");
    }
    Ok(vec![
        ("ALHAZEN_XVFB".into(), starter.to_string_lossy().into_owned()),
        ("LD_LIBRARY_PATH".into(), search),
    ])
}

/// Whether a server starts.
fn starts(program: &str) -> bool {
    let mut command = Command::new(program);
    command.args(["-displayfd", "1", "-screen", "0", "64x64x24", "-terminate", "-nolisten", "tcp"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::null()).stdin(Stdio::null()).spawn();
    let Ok(mut child) = child else { return false };
    let mut number = String::new();
    if let Some(out) = child.stdout.take() {
        let _ = std::io::BufRead::read_line(&mut std::io::BufReader::new(out), &mut number);
    }
    let _ = child.kill();
    let _ = child.wait();
    number.trim().parse::<u32>().is_ok()
}

/// Unpacks the packages into `folder` and writes a program there that starts the server.
///
/// The server looks for its keyboard compiler in `/usr/bin` and nowhere else. So it starts in a namespace of its own, in
/// which the unpacked programs and data lie over the system's.
fn unpack(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let folder = folder.canonicalize().with_context(|| format!("cannot find {}", folder.display()))?;
    let root = folder.join("root");
    apt::unpack_packages(&PACKAGES, &folder.join("apt"), &root)?;
    let libraries = root.join("usr/lib");
    let entries = std::fs::read_dir(&libraries).with_context(|| format!("no {}", libraries.display()))?;
    let of_machine = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .find(|p| p.join("libX11.so.6").exists())
        .context("the packages have no libX11")?;
    let link = folder.join("libraries");
    let _ = std::fs::remove_file(&link);
    link_to(&of_machine, &link)?;
    let root = root.display();
    let text = format!(
        "#!/bin/sh\n\
         # Written by `cargo xtask test` of Alhazen: starts Xvfb with the programs and keyboards beside it.\n\
         export LD_LIBRARY_PATH='{}'\"${{LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}}\"\n\
         exec unshare --user --map-root-user --mount sh -c '\n\
         mount -t overlay overlay -o lowerdir={root}/usr/bin:/usr/bin /usr/bin &&\n\
         mount -t overlay overlay -o lowerdir={root}/usr/share:/usr/share /usr/share &&\n\
         exec {root}/usr/bin/Xvfb \"$@\"' sh \"$@\"\n",
        of_machine.display()
    );
    let starter = folder.join("Xvfb");
    std::fs::write(&starter, text).with_context(|| format!("cannot write {}", starter.display()))?;
    make_executable(&starter)
}

#[cfg(unix)]
pub fn make_executable(path: &Path) -> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755))?;
    Ok(())
}

#[cfg(unix)]
fn link_to(target: &Path, link: &Path) -> anyhow::Result<()> {
    std::os::unix::fs::symlink(target, link).with_context(|| format!("cannot link {}", link.display()))
}

#[cfg(not(unix))]
pub fn make_executable(_: &Path) -> anyhow::Result<()> {
    anyhow::bail!("there are no packages of Xvfb for this system")
}

#[cfg(not(unix))]
fn link_to(_: &Path, _: &Path) -> anyhow::Result<()> {
    anyhow::bail!("there are no packages of Xvfb for this system")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_server_does_not_start() {
        assert!(!starts("/nowhere/Xvfb"));
        assert!(!starts("true"));
    }
}
