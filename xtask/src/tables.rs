//! Tables of measurements in the documents, made from the numbers in `docs/data`.
//!
//! A page has a line `<!-- table: NAME -->` and a line `<!-- end of table -->`. The lines between
//! them are made from `docs/data/NAME.json`:
//!
//! ```json
//! {
//!   "columns": ["scene", "Msamples/s", "ratio"],
//!   "rows": [["cornell", 5.98, [3.83, 4.35, 4.35]]],
//!   "measured": [{ "what": "all", "command": "…", "machine": "…", "date": "2026-11-26" }]
//! }
//! ```
//!
//! A cell is text, a number, or three numbers: least, median and largest value, as
//! `cargo xtask bench … --json` writes ratios. The name `provenance` stands for a table of the
//! commands, machines and dates of all measurements.

use crate::shell::root;
use anyhow::{Context, bail, ensure};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const BEGIN: &str = "<!-- table: ";
const END: &str = "<!-- end of table -->";
const PROVENANCE: &str = "provenance";

/// Writes the tables of all pages below `docs` again.
pub fn update() -> anyhow::Result<()> {
    let all = measurements()?;
    for page in pages()? {
        let text = read(&page)?;
        let updated = with_tables(&text, &all).with_context(|| page.display().to_string())?;
        if updated != text {
            std::fs::write(&page, updated).with_context(|| format!("cannot write {}", page.display()))?;
            println!("wrote {}", page.display());
        }
    }
    Ok(())
}

/// The Markdown files of the folder `docs`, those in folders below it included.
pub fn pages() -> anyhow::Result<Vec<PathBuf>> {
    let (mut found, mut folders) = (Vec::new(), vec![root().join("docs")]);
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
        for entry in entries {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

fn read(path: &Path) -> anyhow::Result<String> {
    // A checkout may end lines in another way.
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(text.replace("\r\n", "\n"))
}

/// The measurements in `docs/data` by name.
type Measurements = BTreeMap<String, Value>;

fn measurements() -> anyhow::Result<Measurements> {
    let folder = root().join("docs/data");
    let mut all = Measurements::new();
    for entry in std::fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "json") {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let value = serde_json::from_str(&read(&path)?).with_context(|| path.display().to_string())?;
            all.insert(name, value);
        }
    }
    Ok(all)
}

/// The page with all of its tables made again.
fn with_tables(page: &str, all: &Measurements) -> anyhow::Result<String> {
    let (mut out, mut rest) = (String::new(), page);
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (name, after) = after.split_once(" -->\n").context("a table's first mark does not end")?;
        let (_, after) = after.split_once(END).with_context(|| format!("no end of table `{name}`"))?;
        let table = match (name, all.get(name)) {
            (PROVENANCE, _) => provenance(all),
            (_, Some(value)) => table(value),
            (_, None) => bail!("docs/data has no `{name}`"),
        };
        let table = table.with_context(|| format!("table `{name}`"))?;
        out.extend([before, BEGIN, name, " -->\n", &table, END]);
        rest = after;
    }
    out.push_str(rest);
    Ok(out)
}

/// The Markdown table of a measurement.
fn table(value: &Value) -> anyhow::Result<String> {
    ensure!(!list(value, "measured")?.is_empty(), "it does not say how it was measured");
    let columns = list(value, "columns")?;
    let mut rows = vec![];
    for row in list(value, "rows")? {
        let row = row.as_array().context("a row is not a list")?;
        ensure!(row.len() == columns.len(), "{row:?} does not have {} cells", columns.len());
        rows.push(row.iter().map(cell).collect::<anyhow::Result<Vec<_>>>()?);
    }
    let header = columns.iter().map(cell).collect::<anyhow::Result<Vec<_>>>()?;
    Ok(markdown(&header, &rows))
}

/// The table of where the numbers of the tables come from.
fn provenance(all: &Measurements) -> anyhow::Result<String> {
    let mut rows = vec![];
    for (name, value) in all {
        for run in list(value, "measured")? {
            let text = |key: &str| run[key].as_str().with_context(|| format!("`{name}` has no {key}"));
            let what = format!("[{name}]({name}.json), {}", text("what")?);
            // A bar within a cell would end it.
            let command = format!("`{}`", text("command")?.replace('|', "\\|"));
            rows.push(vec![what, text("machine")?.into(), text("date")?.into(), command]);
        }
    }
    Ok(markdown(&["numbers", "machine", "date", "command"].map(String::from), &rows))
}

fn list<'a>(value: &'a Value, key: &str) -> anyhow::Result<&'a Vec<Value>> {
    value[key].as_array().with_context(|| format!("no list `{key}`"))
}

fn cell(value: &Value) -> anyhow::Result<String> {
    if let Some(text) = value.as_str() {
        return Ok(text.to_owned());
    }
    if let Some(x) = value.as_f64() {
        return Ok(number(x));
    }
    let spread: Vec<_> = value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
    let [least, median, most] = spread[..] else { bail!("{value} is no cell") };
    Ok(format!("**{}** ({}–{})", number(median), number(least), number(most)))
}

/// A number with three significant digits, or all digits of its integer part.
#[allow(clippy::disallowed_methods, reason = "a table for people")]
fn number(x: f64) -> String {
    let magnitude = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    format!("{x:.*}", (2 - magnitude).max(0) as usize)
}

fn markdown(header: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule = format!("|{}\n", "---|".repeat(header.len()));
    [line(header), rule].into_iter().chain(rows.iter().map(|row| line(row))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn tables_of_the_documents_are_up_to_date() {
        let (all, mut tables) = (measurements().unwrap(), 0);
        for page in pages().unwrap() {
            let text = read(&page).unwrap();
            let updated = with_tables(&text, &all).unwrap_or_else(|e| panic!("{}: {e:#}", page.display()));
            tables += updated.matches(END).count();
            assert!(updated == text, "{} is old: run `cargo xtask docs --tables`", page.display());
        }
        assert!(tables > 5, "only {tables} tables");
    }

    #[test]
    fn every_measurement_is_shown() {
        let pages: String = pages().unwrap().iter().map(|page| read(page).unwrap()).collect();
        for name in measurements().unwrap().keys() {
            assert!(pages.contains(&format!("{BEGIN}{name} -->")), "no page shows {name}");
        }
    }

    fn one(value: Value) -> Measurements {
        [("x".to_owned(), value)].into()
    }

    fn measurement() -> Value {
        json!({
            "columns": ["scene", "speed", "ratio"],
            "rows": [["cornell", 5.98, [3.826, 4.35, 4.352]]],
            "measured": [{ "what": "all", "command": "a|b", "machine": "M", "date": "2026-11-26" }],
        })
    }

    #[test]
    fn an_old_table_is_replaced() {
        let page = "# Speed\n<!-- table: x -->\nold\n<!-- end of table -->\n\
                    <!-- table: provenance -->\n<!-- end of table -->\nrest\n";
        assert_eq!(
            with_tables(page, &one(measurement())).unwrap(),
            "# Speed\n<!-- table: x -->\n| scene | speed | ratio |\n|---|---|---|\n\
             | cornell | 5.98 | **4.35** (3.83–4.35) |\n<!-- end of table -->\n\
             <!-- table: provenance -->\n| numbers | machine | date | command |\n|---|---|---|---|\n\
             | [x](x.json), all | M | 2026-11-26 | `a\\|b` |\n<!-- end of table -->\nrest\n"
        );
    }

    #[test]
    fn broken_measurements_are_errors() {
        let page = "<!-- table: x -->\n<!-- end of table -->\n";
        let fails = |value: Value| with_tables(page, &one(value)).is_err();
        assert!(!fails(measurement()));
        for (key, value) in
            [("rows", json!([["too", "short"]])), ("measured", json!([])), ("columns", json!(null))]
        {
            let mut broken = measurement();
            broken[key] = value;
            assert!(fails(broken), "{key}");
        }
        assert!(with_tables("<!-- table: x -->\n", &one(measurement())).is_err(), "no end");
        assert!(with_tables(&page.replace('x', "y"), &one(measurement())).is_err(), "no such data");
    }

    #[test]
    fn numbers_have_three_digits() {
        let shown = [5.98, 2.0, 0.845, 1648.0, 107.4, 10.06, 0.0].map(number);
        assert_eq!(shown, ["5.98", "2.00", "0.845", "1648", "107", "10.1", "0.00"]);
    }
}
