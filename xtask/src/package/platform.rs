//! What a release is made for.

use anyhow::Context;

/// How an archive is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// `bin` and `share`, as below `/usr/local`; with what desktops read.
    Desktop,
    /// `bin` and `share` without what desktops read.
    Plain,
    /// The program at the top, as Windows programs are unpacked.
    Windows,
}

/// One line of the table of archives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Platform {
    /// Target triple; `universal2-apple-darwin` stands for both of Apple's, in one file.
    pub target: &'static str,
    /// As file names have it.
    pub name: &'static str,
    /// How the archive is laid out.
    pub layout: Layout,
    /// Whether the viewer is part of the program. Static programs cannot load what windows and GPUs need.
    pub has_window: bool,
    /// Debian's name of the processor, where a package is made for it.
    pub debian: Option<&'static str>,
    /// The tag that wheels are made for; `None`: what maturin chooses.
    pub wheel: Option<&'static str>,
}

/// All platforms that a release has.
pub const PLATFORMS: [Platform; 6] = [
    Platform {
        target: "x86_64-unknown-linux-gnu",
        name: "linux-x86_64",
        layout: Layout::Desktop,
        has_window: true,
        debian: Some("amd64"),
        wheel: Some("manylinux_2_28"),
    },
    Platform {
        target: "aarch64-unknown-linux-gnu",
        name: "linux-aarch64",
        layout: Layout::Desktop,
        has_window: true,
        debian: Some("arm64"),
        wheel: Some("manylinux_2_28"),
    },
    Platform {
        target: "x86_64-unknown-linux-musl",
        name: "linux-x86_64-musl",
        layout: Layout::Plain,
        has_window: false,
        debian: None,
        wheel: Some("musllinux_1_2"),
    },
    Platform {
        target: "aarch64-unknown-linux-musl",
        name: "linux-aarch64-musl",
        layout: Layout::Plain,
        has_window: false,
        debian: None,
        wheel: Some("musllinux_1_2"),
    },
    Platform {
        target: "universal2-apple-darwin",
        name: "macos-universal2",
        layout: Layout::Plain,
        has_window: true,
        debian: None,
        wheel: None,
    },
    Platform {
        target: "x86_64-pc-windows-msvc",
        name: "windows-x86_64",
        layout: Layout::Windows,
        has_window: true,
        debian: None,
        wheel: None,
    },
];

/// The targets that a universal binary of macOS is made of.
pub const APPLE_TARGETS: [&str; 2] = ["aarch64-apple-darwin", "x86_64-apple-darwin"];

impl Platform {
    /// The platform of a target, or of this machine.
    ///
    /// # Errors
    /// If releases have none for it.
    pub fn find(target: Option<&str>) -> anyhow::Result<Self> {
        let here = match std::env::consts::OS {
            "macos" => "universal2-apple-darwin".to_owned(),
            "windows" => format!("{}-pc-windows-msvc", std::env::consts::ARCH),
            _ => format!("{}-unknown-linux-gnu", std::env::consts::ARCH),
        };
        let wanted = target.unwrap_or(&here);
        let known = || PLATFORMS.iter().map(|p| p.target).collect::<Vec<_>>().join(", ");
        let found = PLATFORMS.iter().find(|p| p.target == wanted).copied();
        found.with_context(|| format!("releases have nothing for {wanted}; known are {}", known()))
    }

    /// The program's file name.
    pub fn program(&self) -> &'static str {
        if self.layout == Layout::Windows { "alhazen.exe" } else { "alhazen" }
    }

    /// The folder in the archive, and the archive's name without its ending.
    pub fn stem(&self) -> String {
        format!("alhazen-{}-{}", super::VERSION, self.name)
    }

    /// The archive's name.
    pub fn archive(&self) -> String {
        let ending = if self.layout == Layout::Windows { "zip" } else { "tar.gz" };
        format!("{}.{ending}", self.stem())
    }

    /// The Debian package's name.
    pub fn debian_file(&self) -> Option<String> {
        self.debian.map(|processor| format!("alhazen_{}-1_{processor}.deb", super::VERSION))
    }

    /// Whether it is built with Zig as the linker, which has the C libraries of old systems.
    pub fn is_linux(&self) -> bool {
        self.target.contains("-linux-")
    }

    /// Whether programs for it are static: they need nothing of the system, and cannot load drivers.
    pub fn is_static(&self) -> bool {
        self.target.ends_with("-musl")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_unique() {
        for name in [|p: &Platform| p.archive(), |p: &Platform| p.target.to_owned()] {
            assert_eq!(PLATFORMS.iter().map(name).collect::<BTreeSet<_>>().len(), PLATFORMS.len());
        }
    }

    #[test]
    fn platforms_are_found_by_their_targets() {
        let windows = Platform::find(Some("x86_64-pc-windows-msvc")).unwrap();
        assert_eq!((windows.program(), windows.layout), ("alhazen.exe", Layout::Windows));
        assert!(windows.archive().ends_with("-windows-x86_64.zip"));
        let error = Platform::find(Some("riscv64gc-unknown-linux-gnu")).unwrap_err().to_string();
        assert!(error.contains("riscv64gc") && error.contains("x86_64-unknown-linux-gnu"), "{error}");
    }

    #[test]
    fn what_is_static_has_no_window() {
        assert!(PLATFORMS.iter().all(|p| !(p.is_static() && p.has_window)));
    }
    /// The release workflow builds each platform once and tests each at least once, and publishes after that.
    #[test]
    fn the_release_workflow_builds_and_tests_every_platform() {
        let path = crate::shell::root().join(".github/workflows/release.yml");
        let workflow = std::fs::read_to_string(path).unwrap();
        let (build, rest) = workflow.split_once("\n  sources:\n").unwrap();
        let (test, publish) = rest.split_once("\n  collect:\n").unwrap();
        for platform in PLATFORMS {
            let named = |text: &str| text.matches(&format!("target: {}", platform.target)).count();
            assert_eq!(named(build), 1, "{} is built", platform.target);
            assert!(named(test) > 0, "{} is not tested", platform.target);
        }
        assert!(publish.contains("needs: [version, checks, test, sources]\n"));
        for job in ["draft", "pypi", "images", "publish"] {
            let (_, job) = publish.split_once(&format!("\n  {job}:\n")).unwrap();
            let condition = job.lines().nth(1).unwrap();
            assert_eq!(condition.trim(), "if: github.ref_type == 'tag'");
        }
        assert!(publish.contains("needs: [version, collect]") && publish.contains("needs: draft"));
    }
}
