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
