//! Checks of the documents against the workspace, so that they cannot fall behind.

use crate::learn::example_commands;
use std::path::{Path, PathBuf};

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Folders below `crates`, as `crates/name`.
fn members() -> Vec<String> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    let entries = std::fs::read_dir(crates).expect("the workspace has crates");
    let names = entries.map(|e| e.expect("readable").file_name().to_string_lossy().into_owned());
    names.map(|name| format!("crates/{name}")).chain(["xtask".into()]).collect()
}

fn unnamed(members: &[String], page: &str) -> Vec<String> {
    members.iter().filter(|m| !page.contains(&format!("**`{m}`**"))).cloned().collect()
}

#[test]
fn the_architecture_names_every_member() {
    let (members, page) = (members(), read("ARCHITECTURE.md"));
    assert!(members.len() > 10, "only {members:?}");
    let missing = unnamed(&members, &page);
    assert!(missing.is_empty(), "ARCHITECTURE.md has no paragraph for {missing:?}");
    for paragraph in page.split("\n\n").filter(|p| p.starts_with("**`")) {
        assert!(paragraph.contains("*Invariant:"), "no invariant in: {paragraph}");
    }
}

#[test]
fn a_forgotten_member_is_noticed() {
    assert_eq!(unnamed(&["crates/forgotten".into()], &read("ARCHITECTURE.md")), ["crates/forgotten"]);
}

/// README.md, CHANGELOG.md and all pages below `docs`, with their folders.
fn user_documents() -> Vec<(PathBuf, String)> {
    let root = crate::shell::root();
    let pages = crate::tables::pages().expect("docs can be read");
    let all = ["README.md", "CHANGELOG.md"].map(|name| root.join(name)).into_iter().chain(pages);
    all.map(|page| (page.clone(), std::fs::read_to_string(&page).expect("text"))).collect()
}

/// Targets of links in `page`, without those to other sites and without what follows a `#`.
fn local_links(page: &str) -> Vec<&str> {
    let links = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let local = links.filter(|link| !link.contains("://"));
    local.filter_map(|link| link.split('#').next()).filter(|link| !link.is_empty()).collect()
}

#[test]
fn pages_and_pictures_that_documents_link_to_exist() {
    let mut count = 0;
    for (path, page) in user_documents() {
        let folder = path.parent().expect("a folder");
        for link in local_links(&page) {
            assert!(folder.join(link).exists(), "{} links to {link}", path.display());
            count += 1;
        }
    }
    assert!(count > 50, "only {count} links");
}

#[test]
fn links_are_found() {
    let page = "[a](b.md#c) ![d](e.png) [f](https://g) [h](#i)";
    assert_eq!(local_links(page), ["b.md", "e.png"]);
}

/// A heading's anchor as GitHub makes it: lower case, spaces as `-`, no punctuation.
fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn headings_that_documents_link_to_exist() {
    let mut count = 0;
    for (path, page) in user_documents() {
        for link in page.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let Some((file, wanted)) = link.split_once('#') else { continue };
            let target = match file {
                "" => path.clone(),
                _ if file.ends_with(".md") && !link.contains("://") => path.with_file_name(file),
                _ => continue,
            };
            let target = std::fs::read_to_string(&target).unwrap_or_else(|e| panic!("{link}: {e}"));
            let mut headings = target.lines().filter(|line| line.starts_with('#'));
            assert!(headings.any(|h| anchor(h) == wanted), "{} links to {link}", path.display());
            count += 1;
        }
    }
    assert!(count > 5, "only {count} links to headings");
    assert_eq!(anchor("## What is kept: a (b) c-d"), "what-is-kept-a-b-c-d");
}

/// Numbers of the lines that are wider than 100 columns. Tables, code and lines with a link are as
/// wide as they need to be.
fn wide_lines(page: &str) -> Vec<usize> {
    let mut in_code = false;
    let mut wide = vec![];
    for (line, number) in page.lines().zip(1..) {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        let is_free = in_code || line.trim_start().starts_with('|') || line.contains("](");
        if line.chars().count() > 100 && !is_free && !line.contains("://") {
            wide.push(number);
        }
    }
    wide
}

#[test]
fn lines_of_documents_have_at_most_100_columns() {
    for (path, page) in user_documents() {
        assert_eq!(wide_lines(&page), [0; 0], "lines of {}", path.display());
    }
}

#[test]
fn wide_lines_are_noticed() {
    let wide = "word ".repeat(21);
    let page = format!("{wide}\n| {wide} |\n```\n{wide}\n```\n[a](b) {wide}\n{wide}\n");
    assert_eq!(wide_lines(&page), [1, 7]);
    assert_eq!(wide_lines(&"é".repeat(100)), [0; 0]);
}

#[test]
fn the_performance_page_and_the_changelog_are_short() {
    for (name, limit) in [("docs/performance.md", 150), ("CHANGELOG.md", 100)] {
        let lines = read(name).lines().count();
        assert!(lines <= limit, "{name} has {lines} lines, more than {limit}");
    }
}

/// The words of a command that are neither a subcommand with a file in `commands` nor an option
/// that the command's `code` declares.
fn unknown_words<'a>(command: &'a str, commands: &Path, code: &str) -> Vec<&'a str> {
    let words: Vec<_> = command.split_whitespace().skip(1).collect();
    let is_subcommand =
        |name: &str| commands.join(format!("{name}.rs")).exists() || commands.join(name).exists();
    let is_option = |option: &str| {
        let name = option.split('=').next().unwrap_or_default().trim_start_matches("--");
        name.is_empty() // what follows `--` is for another command
            || code.contains(&format!(" {}:", name.replace('-', "_")))
            || code.contains(&format!("long = \"{name}\""))
    };
    let subcommand = words.first().filter(|word| !is_subcommand(word));
    let options = words.iter().filter(|word| word.starts_with("--") && !is_option(word));
    subcommand.into_iter().chain(options).copied().collect()
}

#[test]
fn commands_of_documents_exist() {
    let commands = crate::shell::root().join("crates/cli/src/commands");
    let code = code_below(&commands);
    let mut count = 0;
    for (path, page) in user_documents() {
        for command in example_commands(&page) {
            let unknown = unknown_words(command, &commands, &code);
            assert_eq!(unknown, [""; 0], "in `{command}` of {}", path.display());
            count += 1;
        }
    }
    assert!(count > 30, "only {count} commands");
    let wrong = unknown_words("alhazen paint a.glb --spp 4 --no-such-option=1", &commands, &code);
    assert_eq!(wrong, ["paint", "--no-such-option=1"]);
}

/// Messages that the first column of the page's tables quotes: what stands in `code` and has a space.
fn quoted_messages(page: &str) -> Vec<&str> {
    let cells = page.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").next());
    cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).filter(|text| text.contains(' ')).collect()
}

#[test]
fn messages_that_the_troubleshooting_page_quotes_exist() {
    let page = read("docs/troubleshooting.md");
    let code = code_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates"));
    let messages = quoted_messages(&page);
    assert!(messages.len() > 8, "only {messages:?}");
    for message in messages {
        assert!(code.contains(message), "no source file has `{message}`");
    }
    assert_eq!(quoted_messages("| `a b` and `c` | `d e` |\n"), ["a b"]);
}

/// Names in `code` of the last column of the page's tables.
fn named_tests(page: &str) -> Vec<&str> {
    let rows = page.lines().filter(|line| line.starts_with("| ") && line.contains("` |"));
    rows.filter_map(|row| row.trim_end_matches(" |").rsplit(" | ").next())
        .flat_map(|cell| cell.split('`').skip(1).step_by(2))
        .collect()
}

/// All Rust code below `folder`, as one text.
fn code_below(folder: &Path) -> String {
    let mut text = String::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("readable").path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
            text += &code_below(&path);
        } else if path.extension().is_some_and(|e| e == "rs") {
            text += &std::fs::read_to_string(&path).expect("text");
        }
    }
    text
}

/// Those that are no functions, and no names that a macro makes functions of.
fn missing_tests<'a>(names: &[&'a str], code: &str) -> Vec<&'a str> {
    let is_there =
        |name: &str| code.contains(&format!("fn {name}(")) || code.contains(&format!("    {name}: \""));
    names.iter().copied().filter(|name| !is_there(name)).collect()
}

#[test]
fn tests_that_the_references_name_exist() {
    let page = read("docs/references.md");
    let names = named_tests(&page);
    assert!(names.len() > 60, "only {names:?}");
    let code = code_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates"));
    assert_eq!(missing_tests(&names, &code), [""; 0], "named in docs/references.md");
    assert_eq!(missing_tests(&["no_such_test_anywhere"], &code), ["no_such_test_anywhere"]);
}
