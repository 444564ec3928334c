//! The table of glTF extensions in `docs/formats.md` is the loader's own list.

use scene::load::gltf::{EXTENSIONS, Extension};

const BEGIN: &str = "<!-- extensions: written by `cargo xtask docs` -->\n";
const END: &str = "<!-- end of extensions -->\n";

/// The table, from the loader's list.
fn table(extensions: &[Extension]) -> String {
    let row = |e: &Extension| format!("| `{}` | {} | {} |\n", e.name, e.status.name(), e.remark);
    let rows: String = extensions.iter().map(row).collect();
    format!("| extension | what becomes of it | |\n|---|---|---|\n{rows}")
}

/// A page with another table between the marks; `None` if it has no marks.
fn with_table(page: &str, table: &str) -> Option<String> {
    let (before, rest) = page.split_once(BEGIN)?;
    let (_, after) = rest.split_once(END)?;
    Some([before, BEGIN, table, END, after].concat())
}

/// With `ALHAZEN_UPDATE_DOCS=1` the table is written instead.
#[test]
fn the_table_of_extensions_is_up_to_date() {
    let file = testkit::repository_root().join("docs/formats.md");
    // A checkout may end lines in another way.
    let page = std::fs::read_to_string(&file).expect("the page").replace("\r\n", "\n");
    let expected = with_table(&page, &table(EXTENSIONS)).expect("marks around the table");
    if std::env::var_os("ALHAZEN_UPDATE_DOCS").is_some_and(|v| v == "1") {
        std::fs::write(&file, &expected).expect("the page can be written");
        return;
    }
    assert!(page == expected, "{} is old: run `cargo xtask docs`", file.display());
}

#[test]
fn an_old_table_is_noticed() {
    let page = |extensions| format!("# Formats\n{BEGIN}{}{END}rest\n", table(extensions));
    let (old, new) = (page(&EXTENSIONS[1..]), page(EXTENSIONS));
    let updated = with_table(&old, &table(EXTENSIONS)).expect("marks");
    assert!(old != updated && updated == new);
    assert_eq!(with_table("# Formats\n", ""), None);
}
