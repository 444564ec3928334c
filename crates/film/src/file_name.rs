//! Names that Windows does not take for files, found before anything is rendered.

/// Devices that are there in every folder, whatever ending is behind their names.
const DEVICES: [&str; 22] = [
    "CON", "PRN", "AUX", "NUL", "COM1", "COM2", "COM3", "COM4", "COM5", "COM6", "COM7", "COM8", "COM9",
    "LPT1", "LPT2", "LPT3", "LPT4", "LPT5", "LPT6", "LPT7", "LPT8", "LPT9",
];

/// Why Windows takes no file of this name; `None` if it does.
///
/// Some of these names it opens all the same, as a device or as a stream of another file, so that
/// only replacing the file fails, when the picture is done.
/// Source: Microsoft, "Naming Files, Paths, and Namespaces".
pub(crate) fn refused_by_windows(name: &str) -> Option<String> {
    let stem = name.split('.').next().unwrap_or_default().trim_end();
    if let Some(bad) = name.chars().find(|&c| c < ' ' || r#"<>:"/\|?*"#.contains(c)) {
        Some(format!("file names of Windows have no {bad:?}"))
    } else if name.ends_with(['.', ' ']) {
        Some("file names of Windows end with neither a point nor a space".to_owned())
    } else if DEVICES.iter().any(|device| stem.eq_ignore_ascii_case(device)) {
        Some(format!("{stem} is a device of Windows"))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_windows_refuses_are_known() {
        for name in
            ["a?.png", "a:b.exr", "a<b.png", "tab\t.png", "nul.png", "Con", "com1.x.exr", "a.png.", "a "]
        {
            assert!(refused_by_windows(name).is_some(), "{name}");
        }
        for name in ["a.png", "日本 ä.exr", "console.png", "com10.png", ".hidden", "frame-####.png"] {
            assert_eq!(refused_by_windows(name), None);
        }
    }
}
