//! File names as text: what is refused before the system is asked.
//!
//! Asking Windows about `\\machine\share` sends the user's credentials to that machine, and opening `aux.png` opens a serial
//! port, so such names must not get that far.

use std::path::Path;

/// Names of devices that Windows finds in every folder, whatever follows behind a dot.
const DEVICES: [&str; 6] = ["con", "prn", "aux", "nul", "conin$", "conout$"];
/// Devices that a digit follows.
const NUMBERED_DEVICES: [&str; 2] = ["com", "lpt"];

/// Whether a name can be that of an ordinary file on this system.
pub(super) fn is_ordinary(path: &Path) -> bool {
    let text = path.to_string_lossy();
    !(text.contains('\0') || cfg!(windows) && is_windows_device(&text))
}

/// Whether a name begins as those of other machines, of devices and of verbatim paths do on Windows: `\\machine`,
/// `\\.\device`, `\\?\`, `\??\`, with slashes of either kind.
pub(super) fn leaves_drives(path: &str) -> bool {
    let slashes = path.replace('/', "\\");
    slashes.starts_with("\\\\") || slashes.starts_with("\\??\\")
}

/// Whether a component of a name is a device, a stream of a file, or written such that Windows opens another file.
pub(super) fn is_windows_device(path: &str) -> bool {
    let without_drive = match path.as_bytes() {
        [letter, b':', ..] if letter.is_ascii_alphabetic() => &path[2..],
        _ => path,
    };
    // A drive without a slash is that drive's own current folder, which nobody named.
    let relative_drive = without_drive.len() < path.len() && !without_drive.starts_with(['/', '\\']);
    // The prefix of a canonical path has a question mark or a dot and a colon, which components must not have.
    let body = without_drive.strip_prefix("\\\\?\\").unwrap_or(without_drive);
    let body = match body.as_bytes() {
        [letter, b':', ..] if letter.is_ascii_alphabetic() && body.len() < without_drive.len() => &body[2..],
        _ => body,
    };
    relative_drive || body.split(['/', '\\']).any(is_device_component)
}

fn is_device_component(component: &str) -> bool {
    if component.contains(':') {
        return true;
    }
    if matches!(component, "." | "..") {
        return false;
    }
    // Windows drops dots and blanks at the end: `secret.` is `secret`.
    if component.ends_with(['.', ' ']) {
        return true;
    }
    let stem = component.split('.').next().unwrap_or(component).trim_end_matches(' ').to_lowercase();
    let numbered = NUMBERED_DEVICES.iter().any(|device| {
        let digit = stem.strip_prefix(device).map(|rest| rest.chars().collect::<Vec<_>>());
        matches!(digit.as_deref(), Some(['0'..='9' | '¹' | '²' | '³']))
    });
    numbered || DEVICES.contains(&stem.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_of_windows_are_recognised() {
        for name in [
            "con",
            "CON",
            "aux.png",
            "NUL",
            "nul.tar.gz",
            "prn .txt",
            "com1",
            "COM9.obj",
            "lpt3.mtl",
            "com¹",
            "LPT².png",
            "conin$",
            "CONOUT$",
            "textures/aux.png",
            "textures\\com7",
            "a.txt:stream",
            "a.txt::$DATA",
            "secret.",
            "secret ",
            "a/b./c",
            "C:relative.png",
            "C:\\x\\nul",
            "c:/aux",
        ] {
            assert!(is_windows_device(name), "{name:?}");
        }
        for name in [
            "console.png",
            "auxiliary",
            "com",
            "com10",
            "lpt",
            "nula",
            "a.con",
            "../x.png",
            "./a",
            "C:\\x\\y.png",
            "c:/x",
            "\\\\?\\C:\\x\\y.png",
            "textures/wood.png",
            "",
        ] {
            assert!(!is_windows_device(name), "{name:?}");
        }
    }

    #[test]
    fn names_of_other_machines_are_recognised() {
        for name in [
            "\\\\server\\share\\x",
            "//server/share/x",
            "\\/server/x",
            "\\\\.\\pipe\\x",
            "//./COM1",
            "\\\\?\\C:\\x",
            "//?/UNC/server/share",
            "\\??\\C:\\x",
            "/??/C:/x",
            "\\\\?\\GLOBALROOT\\Device",
        ] {
            assert!(leaves_drives(name), "{name:?}");
        }
        for name in ["C:\\x", "/usr/x", "x\\y", "..\\x", "?"] {
            assert!(!leaves_drives(name), "{name:?}");
        }
    }

    #[test]
    fn zero_bytes_are_in_no_name() {
        assert!(!is_ordinary(Path::new("a\0.png")));
        assert!(is_ordinary(Path::new("a.png")));
    }
}
