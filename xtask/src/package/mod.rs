//! `cargo xtask package`: what a release is made of. The release workflow runs the same commands.

mod archive;
mod binary;
mod cargo_sources;
mod checksums;
mod debian;
mod layout;
mod manifests;
mod notices;
mod platform;
mod sbom;
mod source;
mod wheel;

use crate::shell::target_dir;
use anyhow::Context;
use platform::Platform;
use std::path::{Path, PathBuf};

/// The workspace's version: every member has it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Pack a release: by default this platform's archive, Debian package, sources, and their checksums.
///
/// Files are written to target/package/release. docs/packages.md says how a release is made.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct PackageArgs {
    #[command(subcommand)]
    step: Option<Step>,
    #[command(flatten)]
    archive: ArchiveArgs,
}

/// What an archive is made of.
#[derive(Debug, clap::Args)]
struct ArchiveArgs {
    /// The target that the program is for [default: this machine's].
    #[arg(long, value_name = "TRIPLE")]
    target: Option<String>,
    /// A program that is built already; otherwise it is built with the profile `dist`.
    #[arg(long, value_name = "FILE")]
    binary: Option<PathBuf>,
    /// A program that runs here and prints completions and manual pages, where the packed one does not.
    #[arg(long, value_name = "FILE")]
    documents_from: Option<PathBuf>,
    /// Link with Zig (`cargo zigbuild`) against the C library of old Linux systems, as releases are.
    #[arg(long, conflicts_with = "binary")]
    zig: bool,
    /// Say what would be made, and make nothing.
    #[arg(long)]
    dry_run: bool,
}

#[derive(Debug, clap::Subcommand)]
enum Step {
    /// Build the Python wheel of a platform.
    Wheel {
        /// The target that the wheel is for [default: this machine's].
        #[arg(long, value_name = "TRIPLE")]
        target: Option<String>,
        /// The Python that runs maturin.
        #[arg(long, value_name = "PATH", default_value = "python3")]
        python: PathBuf,
    },
    /// Pack the source distribution of the Python package.
    Sdist {
        /// The Python that runs maturin.
        #[arg(long, value_name = "PATH", default_value = "python3")]
        python: PathBuf,
    },
    /// Pack the sources of the commit.
    Source,
    /// Write the software bill of materials (CycloneDX); needs cargo-cyclonedx.
    Sbom,
    /// Write SHA256SUMS for the files of a folder.
    Checksums {
        /// The folder.
        folder: PathBuf,
    },
    /// Fill the manifests of package managers with the checksums of a release.
    Manifests {
        /// The folder with the files and SHA256SUMS of the release.
        folder: PathBuf,
    },
    /// Check that a tag, the workspace, the changelog and the metadata for desktops name one version.
    Tag {
        /// The tag, such as v1.2.3.
        tag: String,
    },
}

/// Makes what is asked for.
pub fn run(args: &PackageArgs) -> anyhow::Result<()> {
    let out = || -> anyhow::Result<PathBuf> { made(&folder()?.join("release")) };
    match &args.step {
        None if args.archive.dry_run => dry_run(&args.archive),
        None => pack(&args.archive, &out()?),
        Some(Step::Wheel { target, python }) => {
            wheel::wheel(&Platform::find(target.as_deref())?, python, &made(&folder()?.join("wheels"))?)
        }
        Some(Step::Sdist { python }) => wheel::sdist(python, &made(&folder()?.join("wheels"))?),
        Some(Step::Source) => source::pack(&out()?).map(|path| println!("{}", path.display())),
        Some(Step::Sbom) => sbom::make(&out()?).map(drop),
        Some(Step::Checksums { folder }) => checksums::write(folder),
        Some(Step::Manifests { folder: release }) => {
            let to = folder()?.join("manifests");
            manifests::write(release, &to)?;
            println!("{}", to.display());
            Ok(())
        }
        Some(Step::Tag { tag }) => manifests::check_tag(tag),
    }
}

/// Everything that can be made of this platform.
fn pack(args: &ArchiveArgs, out: &Path) -> anyhow::Result<()> {
    let platform = Platform::find(args.target.as_deref())?;
    let program = match &args.binary {
        Some(path) => path.clone(),
        None => binary::build(&platform, args.zig)?,
    };
    let programs =
        layout::Programs { packed: &program, speaking: args.documents_from.as_deref().unwrap_or(&program) };
    let tree = folder()?.join(platform.stem());
    layout::write(&platform, &programs, &tree)?;
    let archive = out.join(platform.archive());
    archive::pack(&tree, platform.layout, &archive)?;
    println!("{}", archive.display());
    if let Some(package) = debian::make(&platform, &tree, out)? {
        println!("{}", package.display());
    }
    println!("{}", source::pack(out)?.display());
    checksums::write(out)?;
    println!("{}", out.join(checksums::FILE).display());
    Ok(())
}

fn dry_run(args: &ArchiveArgs) -> anyhow::Result<()> {
    let platform = Platform::find(args.target.as_deref())?;
    print!("{}", plan(&platform, args.zig, args.binary.as_deref()));
    for tool in missing_tools(&platform, args.zig) {
        println!("missing here: {tool}");
    }
    Ok(())
}

/// What would be made, a line for each file.
fn plan(platform: &Platform, zig: bool, binary: Option<&Path>) -> String {
    let program = match binary {
        Some(path) => format!("of {}", path.display()),
        None if zig => "built with the profile dist, linked by Zig".to_owned(),
        None => "built with the profile dist".to_owned(),
    };
    let window = if platform.has_window { "with" } else { "without" };
    let mut text = format!(
        "alhazen {VERSION} for {}, {window} the viewer, {program}\n{}\n",
        platform.target,
        platform.archive()
    );
    for entry in layout::entries(platform) {
        text += &format!("  {}/{}\n", platform.stem(), entry.place);
    }
    let others = platform.debian_file().into_iter().chain([source::file(), checksums::FILE.into()]);
    text + &others.map(|name| name + "\n").collect::<String>()
}

/// Programs that packing needs and this machine lacks.
fn missing_tools(platform: &Platform, zig: bool) -> Vec<&'static str> {
    let runs = |program: &str, argument: &str| {
        crate::shell::output(std::process::Command::new(program).arg(argument)).is_ok()
    };
    let needed = [
        (platform.debian.is_some(), "dpkg-deb", "--version", "dpkg-deb"),
        (zig, "cargo-zigbuild", "--version", "cargo-zigbuild"),
        (platform.target.starts_with("universal2"), "lipo", "-version", "lipo"),
        (true, "git", "--version", "git"),
    ];
    needed
        .iter()
        .filter(|(wanted, program, argument, _)| *wanted && !runs(program, argument))
        .map(|n| n.3)
        .collect()
}

/// Where all this happens, beside the build.
fn folder() -> anyhow::Result<PathBuf> {
    made(&target_dir()?.join("package"))
}

/// A folder, made where it is missing.
fn made(folder: &Path) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    Ok(folder.to_owned())
}

/// Makes a folder without anything in it.
fn empty(folder: &Path) -> anyhow::Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            return Err(e).with_context(|| format!("cannot empty {}", folder.display()));
        }
        _ => {}
    }
    made(folder).map(drop)
}

#[cfg(test)]
mod tests {
    use super::platform::PLATFORMS;
    use super::*;

    #[test]
    fn plans_name_every_file() {
        for platform in PLATFORMS {
            let plan = plan(&platform, platform.is_linux(), None);
            assert!(
                plan.contains(&platform.archive()) && plan.contains("THIRD-PARTY-LICENSES.txt"),
                "{plan}"
            );
            assert_eq!(plan.contains(".deb"), platform.debian.is_some(), "{plan}");
            assert_eq!(plan.contains("without the viewer"), platform.is_static(), "{plan}");
        }
    }

    #[test]
    fn folders_are_emptied() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("old"), "").unwrap();
        empty(folder.path()).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        empty(&folder.path().join("new")).unwrap();
    }
}
