//! Checks of the documents against the workspace, so that they cannot fall behind.

use std::path::Path;

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

#[test]
fn pictures_and_pages_that_the_readme_shows_exist() {
    let readme = read("README.md");
    let links = readme.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let local: Vec<_> = links.filter(|l| !l.contains("://")).collect();
    assert!(local.len() > 5, "only {local:?}");
    for link in local {
        assert!(
            Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(link).is_file(),
            "README.md links to {link}"
        );
    }
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
