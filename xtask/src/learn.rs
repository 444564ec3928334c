//! The pictures of `docs/learn`: pages say by which command each is made, and here the commands run.

use crate::shell::{release_binary, root, run as run_command};
use anyhow::Context;
use std::path::PathBuf;
use std::process::Command;

/// Where the pictures lie, relative to the repository's root.
const PICTURES: &str = "docs/images/learn/";

/// The pages of the course with their texts, by name.
fn pages() -> anyhow::Result<Vec<(PathBuf, String)>> {
    let folder = root().join("docs/learn");
    let entries = std::fs::read_dir(&folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|e| e == "md"));
    paths.sort();
    let read = |path: PathBuf| {
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        Ok((path, text))
    };
    paths.into_iter().map(read).collect()
}

/// Lines of shell examples in `page` that call `alhazen`, without comments.
pub fn example_commands(page: &str) -> impl Iterator<Item = &str> {
    let blocks = page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    let lines = blocks.flat_map(str::lines).filter(|line| line.starts_with("alhazen"));
    lines.map(|line| line.split(" #").next().unwrap_or_default().trim())
}

/// Commands of a page that write its pictures.
fn picture_commands(page: &str) -> impl Iterator<Item = &str> {
    example_commands(page).filter(|command| command.contains(PICTURES))
}

/// Makes all pictures of the course.
///
/// # Errors
/// If a page cannot be read, or a command fails.
pub fn pictures() -> anyhow::Result<()> {
    std::fs::create_dir_all(root().join(PICTURES)).context("the pictures of docs/learn")?;
    let binary = release_binary()?;
    for (_, page) in pages()? {
        for line in picture_commands(&page) {
            let mut command = Command::new(&binary);
            command.current_dir(root()).args(line.split_whitespace().skip(1)).arg("--quiet");
            run_command(&mut command)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of the course's own pictures that a page shows.
    fn shown(page: &str) -> Vec<String> {
        let links = page.split("](../images/learn/").skip(1).filter_map(|rest| rest.split(')').next());
        links.map(str::to_owned).collect()
    }

    #[test]
    fn pages_say_how_their_pictures_are_made() {
        let mut count = 0;
        for (path, page) in pages().expect("pages") {
            for name in shown(&page) {
                let made = picture_commands(&page).any(|c| c.ends_with(&format!("{PICTURES}{name}")));
                assert!(made, "{}: no command makes {name}", path.display());
                count += 1;
            }
        }
        assert!(count > 10, "only {count} pictures");
    }

    #[test]
    fn every_picture_is_shown() {
        let pages = pages().expect("pages");
        for entry in std::fs::read_dir(root().join(PICTURES)).expect("pictures") {
            let name = entry.expect("readable").file_name().into_string().expect("a name");
            assert!(pages.iter().any(|(_, page)| shown(page).contains(&name)), "nobody shows {name}");
        }
    }

    #[test]
    fn chapters_fit_a_screen() {
        for (path, page) in pages().expect("pages") {
            let lines = page.lines().count();
            let most = if path.ends_with("five-works.md") { 120 } else { 70 };
            assert!(lines <= most, "{} has {lines} lines", path.display());
        }
    }
}
