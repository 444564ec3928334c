//! Manifests of package managers: templates in `packaging`, filled with the version and the checksums of a release.

use super::platform::PLATFORMS;
use super::{VERSION, cargo_sources, checksums, source};
use crate::shell::root;
use anyhow::{Context, bail, ensure};
use std::collections::BTreeMap;
use std::path::Path;

/// Templates below `packaging`. Files are written under the same name without `.in`, winget's below its version.
pub const TEMPLATES: [&str; 8] = [
    "conda/recipe.yaml.in",
    "flatpak/io.github.alhazen_render.alhazen.yml.in",
    "homebrew/alhazen.rb.in",
    "oci/Containerfile.in",
    "oci/Containerfile.vulkan.in",
    "scoop/alhazen.json.in",
    "winget/AlhazenRender.Alhazen.installer.yaml.in",
    "winget/AlhazenRender.Alhazen.locale.en-US.yaml.in",
];

/// winget's third file has no checksum, but a version; it is listed apart only because it is so short.
pub const VERSION_TEMPLATE: &str = "winget/AlhazenRender.Alhazen.yaml.in";

/// All templates.
pub fn templates() -> impl Iterator<Item = &'static str> {
    TEMPLATES.into_iter().chain([VERSION_TEMPLATE])
}

/// Fills `@VERSION@`, `@DATE@`, and `@SHA256:NAME@`, where NAME is a platform's or `source`.
///
/// # Errors
/// If a checksum is missing, or the template names something else.
fn fill(template: &str, sums: &BTreeMap<String, String>, date: &str) -> anyhow::Result<String> {
    let mut filled = template.replace("@VERSION@", VERSION).replace("@DATE@", date);
    while let Some(start) = filled.find("@SHA256:") {
        let rest = &filled[start + "@SHA256:".len()..];
        let (name, _) = rest.split_once('@').context("a checksum's name has no end")?;
        let file = match PLATFORMS.iter().find(|p| p.name == name) {
            Some(platform) => platform.archive(),
            None if name == "source" => source::file(),
            None => bail!("there is no platform {name}"),
        };
        let sum = sums.get(&file).with_context(|| format!("SHA256SUMS has no {file}"))?;
        filled = filled.replace(&format!("@SHA256:{name}@"), sum);
    }
    Ok(filled)
}

/// Where a template's manifest is written, below the folder of manifests.
fn place(template: &str) -> String {
    template.trim_end_matches(".in").replace("winget/", &format!("winget/{VERSION}/"))
}

/// Writes all manifests to `folder` for the release whose files and `SHA256SUMS` lie in `release`.
///
/// # Errors
/// If the release lacks a file that a manifest names.
pub fn write(release: &Path, folder: &Path) -> anyhow::Result<()> {
    let sums = checksums::read(release)?;
    let date = date(super::archive::timestamp());
    super::empty(folder)?;
    for template in templates() {
        let text = std::fs::read_to_string(root().join("packaging").join(template))
            .with_context(|| format!("cannot read packaging/{template}"))?;
        let to = folder.join(place(template));
        std::fs::create_dir_all(to.parent().context("no folder")?)?;
        std::fs::write(&to, fill(&text, &sums, &date).with_context(|| template.to_owned())?)?;
    }
    let lock = std::fs::read_to_string(root().join("Cargo.lock")).context("no Cargo.lock")?;
    let crates = serde_json::to_string_pretty(&cargo_sources::sources(&lock)?)?;
    std::fs::write(folder.join("flatpak/cargo-sources.json"), crates + "\n")?;
    Ok(())
}

/// A day of the calendar, as `2026-11-27`, from seconds since 1970.
///
/// Method: Howard Hinnant, "chrono-Compatible Low-Level Date Algorithms", `civil_from_days`.
fn date(seconds: u64) -> String {
    let days = seconds / 86_400 + 719_468; // since 0000-03-01
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153; // 0 is March
    let day_of_month = day_of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = (year + era * 400, if month < 10 { month + 3 } else { month - 9 });
    format!("{:04}-{month:02}-{day_of_month:02}", year + u64::from(month <= 2))
}

/// Checks that `tag` is the workspace's version, and that the changelog and the metadata of desktops know it.
///
/// # Errors
/// The first that does not agree.
pub fn check_tag(tag: &str) -> anyhow::Result<()> {
    ensure!(tag == format!("v{VERSION}"), "the tag is {tag}, the workspace's version {VERSION}");
    let changelog = std::fs::read_to_string(root().join("CHANGELOG.md")).context("no CHANGELOG.md")?;
    let heading = changelog.lines().find(|line| line.starts_with("## [")).unwrap_or_default();
    ensure!(heading.starts_with(&format!("## [{VERSION}]")), "CHANGELOG.md begins with `{heading}`");
    ensure!(!heading.contains("unreleased"), "CHANGELOG.md says that {VERSION} is unreleased");
    let metadata = std::fs::read_to_string(super::layout::desktop_file("metainfo.xml"))?;
    let release = first_release(&metadata).context("the metadata for desktops have no release")?;
    ensure!(release == VERSION, "the metadata for desktops begin with version {release}");
    Ok(())
}

/// The version of the first release in AppStream's metadata.
fn first_release(metadata: &str) -> Option<&str> {
    metadata.split_once("<release version=\"")?.1.split('"').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str) -> String {
        std::fs::read_to_string(root().join("packaging").join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn sums() -> BTreeMap<String, String> {
        let files = PLATFORMS.iter().map(|p| p.archive()).chain([source::file()]);
        files.map(|file| (file, "0123456789abcdef".repeat(4))).collect()
    }

    /// Words that look like a version of three numbers.
    fn versions(text: &str) -> Vec<&str> {
        let words =
            text.split(|c: char| !(c.is_ascii_digit() || c == '.')).map(|word| word.trim_matches('.'));
        words
            .filter(|w| w.split('.').count() == 3 && w.split('.').all(|n| n.parse::<u32>().is_ok()))
            .collect()
    }

    /// The version stands in `Cargo.toml`; templates have none of their own but that of the schema they follow.
    #[test]
    fn manifests_have_the_version_of_the_workspace() {
        for template in templates() {
            let text = read(template);
            let others: Vec<_> = text
                .lines()
                .filter(|line| !line.contains("ManifestVersion") && !line.contains("$schema"))
                .flat_map(versions)
                .collect();
            assert_eq!(others, [""; 0], "in {template}");
            let filled = fill(&text, &sums(), "2026-11-27").unwrap();
            assert!(filled.contains(VERSION), "{template} does not name the version");
            for left in ["@VERSION", "@SHA256", "@DATE"] {
                assert!(!filled.contains(left), "{template} has {left}");
            }
        }
        assert_eq!(
            first_release(&read(&format!("desktop/{}.metainfo.xml", super::super::layout::ID))),
            Some(VERSION)
        );
        assert_eq!(versions("v1.2.3, 10.0 and 2026.11.27-1."), ["1.2.3", "2026.11.27"]);
    }

    #[test]
    fn every_template_of_the_folder_is_filled() {
        let files = super::super::archive::files_below(&root().join("packaging")).unwrap();
        let found: Vec<_> = files.iter().map(|path| path.to_string_lossy().replace('\\', "/")).collect();
        let found: Vec<_> =
            found.iter().filter(|name| name.ends_with(".in") && *name != "requirements.in").collect();
        for name in &found {
            assert!(
                templates().any(|t| t == **name) || name.starts_with("debian/"),
                "{name} is filled by nobody"
            );
        }
        assert_eq!(found.len(), templates().count() + 1);
    }

    #[test]
    fn the_release_and_its_manifests_are_written() {
        let (release, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        for file in sums().keys() {
            std::fs::write(release.path().join(file), file).unwrap();
        }
        checksums::write(release.path()).unwrap();
        write(release.path(), folder.path()).unwrap();
        let formula = std::fs::read_to_string(folder.path().join("homebrew/alhazen.rb")).unwrap();
        assert!(formula.contains(&checksums::read(release.path()).unwrap()[&PLATFORMS[4].archive()]));
        assert!(folder.path().join(format!("winget/{VERSION}/AlhazenRender.Alhazen.yaml")).is_file());
        assert!(folder.path().join("flatpak/cargo-sources.json").is_file());
    }

    #[test]
    fn a_missing_file_of_the_release_is_an_error() {
        let error = fill("@SHA256:linux-x86_64@", &BTreeMap::new(), "").unwrap_err().to_string();
        assert!(error.contains("linux-x86_64.tar.gz"), "{error}");
        assert!(fill("@SHA256:amiga@", &sums(), "").is_err());
    }

    #[test]
    fn days_are_those_of_the_calendar() {
        for (seconds, day) in [
            (0, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (1_795_737_600, "2026-11-27"),
            (1_798_761_599, "2026-12-31"),
        ] {
            assert_eq!(date(seconds), day);
        }
    }

    #[test]
    fn tags_of_other_versions_are_refused() {
        assert!(check_tag("v0.0.0").unwrap_err().to_string().contains(VERSION));
        assert!(check_tag(VERSION).is_err(), "without the v");
    }
}
