//! The report of a benchmark: settings, tables, plots and pictures, written as JSON, CSV and one page of HTML.
//!
//! Fill a [`Report`] and call [`Report::write`]. Tables are for programs and people alike: a cell is a number or a text.

mod html;
mod machine;
mod plot;

pub use plot::{Plot, Scale};

use alhazen::{Image, ImageError, write_atomically};
use anyhow::Context;
use clap::Args;
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What all measurements have: where their report goes.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Folder for the report; it is made if need be.
    #[arg(long, value_name = "FOLDER", default_value = "bench")]
    pub report: PathBuf,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A name.
    Text(String),
    /// A number; what is not finite is an empty cell, and null in JSON.
    Number(f64),
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl Cell {
    /// With four significant digits.
    fn text(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number(n) if !n.is_finite() => String::new(),
            Self::Number(n) if *n == n.trunc() && n.abs() < 1e6 => format!("{n:.0}"),
            Self::Number(n) if (1e-3..1e6).contains(&n.abs()) => {
                let digits = (3.0 - n.abs().log10().floor()).clamp(0.0, 6.0) as usize;
                format!("{n:.digits$}")
            }
            Self::Number(n) => format!("{n:.3e}"),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Text(text) => json!(text),
            Self::Number(n) => json!(n),
        }
    }

    /// As CSV wants it: quoted where need be, numbers with all digits.
    fn csv(&self) -> String {
        match self {
            Self::Text(text) if text.contains([',', '"', '\n']) => {
                format!("\"{}\"", text.replace('"', "\"\""))
            }
            Self::Text(text) => text.clone(),
            Self::Number(n) if n.is_finite() => n.to_string(),
            Self::Number(_) => String::new(),
        }
    }
}

/// Rows of measurements.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Part of the name of its CSV file: small letters and hyphens.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// Names of the columns, with units.
    pub columns: Vec<String>,
    /// As many cells each as there are columns.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without rows.
    pub fn new(name: &str, title: &str, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|c| (*c).to_owned()).collect();
        Self { name: name.to_owned(), title: title.to_owned(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, row: Vec<Cell>) {
        debug_assert_eq!(row.len(), self.columns.len(), "{}", self.name);
        self.rows.push(row);
    }

    /// As text in columns, for terminals.
    pub fn text(&self) -> String {
        let rows: Vec<Vec<String>> = self.rows.iter().map(|r| r.iter().map(Cell::text).collect()).collect();
        let width = |c: usize| {
            let cells = rows.iter().map(|r| r[c].chars().count());
            cells.chain([self.columns[c].chars().count()]).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let line = |cells: &[String]| {
            let padded = cells.iter().zip(&widths).enumerate().map(|(c, (cell, width))| {
                if c == 0 { format!("{cell:width$}") } else { format!("{cell:>width$}") }
            });
            padded.collect::<Vec<_>>().join("  ") + "\n"
        };
        let body: String = rows.iter().map(|r| line(r)).collect();
        format!("{}\n{}{body}", self.title, line(&self.columns))
    }

    fn csv(&self) -> String {
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let header = line(self.columns.iter().map(|c| Cell::from(c.as_str()).csv()).collect());
        let rows = self.rows.iter().map(|r| line(r.iter().map(Cell::csv).collect()));
        header + &rows.collect::<String>()
    }

    fn json(&self) -> Value {
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|r| self.columns.iter().cloned().zip(r.iter().map(Cell::json)).collect())
            .collect();
        json!({ "name": self.name, "title": self.title, "rows": rows })
    }
}

/// What a page shows, in this order.
pub(super) enum Item {
    Table(Table),
    Plot(Plot),
    Picture { title: String, png: Vec<u8> },
    Text(String),
}

/// A report that grows.
pub struct Report {
    name: String,
    title: String,
    about: Vec<(String, String)>,
    items: Vec<Item>,
}

impl Report {
    /// A report called `name` (a part of file names) about this machine and program, with the `settings` of the
    /// measurement.
    pub fn new(name: &str, title: &str, settings: &[(&str, String)]) -> Self {
        let mut about = machine::about();
        about.extend(settings.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
        Self { name: name.to_owned(), title: title.to_owned(), about, items: Vec::new() }
    }

    /// Adds a paragraph: what was measured and how.
    pub fn text(&mut self, text: &str) {
        self.items.push(Item::Text(text.to_owned()));
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) {
        self.items.push(Item::Table(table));
    }

    /// Adds a plot.
    pub fn plot(&mut self, plot: Plot) {
        self.items.push(Item::Plot(plot));
    }

    /// Adds a picture of display values in `[0, 1]`.
    ///
    /// # Errors
    /// When it has no pixels.
    pub fn picture(&mut self, title: &str, picture: &Image) -> anyhow::Result<()> {
        self.items.push(Item::Picture { title: title.to_owned(), png: picture.encode_png()? });
        Ok(())
    }

    /// Writes `NAME.json`, `NAME-TABLE.csv` for each table, `NAME-N.svg` for each plot, and `NAME.html` into `folder`; returns the
    /// page's path.
    ///
    /// # Errors
    /// When the folder cannot be made or a file not be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<PathBuf> {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let write = |name: String, text: &str| {
            let path = folder.join(name);
            let failed = |source| ImageError::Write { path: path.clone(), source };
            write_atomically(&path, |file| file.write_all(text.as_bytes()).map_err(failed))?;
            anyhow::Ok(path)
        };
        let tables = self.tables();
        for table in &tables {
            write(format!("{}-{}.csv", self.name, table.name), &table.csv())?;
        }
        let plots = self.items.iter().filter_map(|item| match item {
            Item::Plot(plot) => Some(plot),
            Item::Table(_) | Item::Picture { .. } | Item::Text(_) => None,
        });
        for (number, plot) in (1..).zip(plots) {
            write(format!("{}-{number}.svg", self.name), &plot.svg())?;
        }
        write(format!("{}.json", self.name), &format!("{:#}\n", self.json()))?;
        write(format!("{}.html", self.name), &html::page(&self.title, &self.about, &self.items))
    }

    /// All tables as text.
    pub fn summary(&self) -> String {
        self.tables().iter().map(|t| t.text()).collect::<Vec<_>>().join("\n")
    }

    /// Everything but the pictures.
    fn json(&self) -> Value {
        let about: Value = self.about.iter().cloned().map(|(k, v)| (k, json!(v))).collect();
        let tables: Vec<Value> = self.tables().iter().map(|t| t.json()).collect();
        json!({ "benchmark": self.name, "title": self.title, "about": about, "tables": tables })
    }

    fn tables(&self) -> Vec<&Table> {
        let tables = self.items.iter().filter_map(|item| match item {
            Item::Table(table) => Some(table),
            Item::Plot(_) | Item::Picture { .. } | Item::Text(_) => None,
        });
        tables.collect()
    }
}

/// How repeated measurements are spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentiles {
    /// The smallest.
    pub least: f64,
    /// One in twenty is below.
    pub p5: f64,
    /// The median.
    pub p50: f64,
    /// One in twenty is above.
    pub p95: f64,
}

impl Percentiles {
    /// Of `values`, linearly interpolated between neighbours; NaN if there are none.
    pub fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * (sorted.len().max(1) - 1) as f64;
            let (low, high) = (place.floor() as usize, place.ceil() as usize);
            match (sorted.get(low), sorted.get(high)) {
                (Some(a), Some(b)) => a + (b - a) * (place - low as f64),
                _ => f64::NAN,
            }
        };
        Self { least: at(0.0), p5: at(0.05), p50: at(0.5), p95: at(0.95) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_known_values() {
        let values: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        assert_eq!(Percentiles::of(&values), Percentiles { least: 0.0, p5: 5.0, p50: 50.0, p95: 95.0 });
        assert_eq!(Percentiles::of(&[1.0, 2.0]).p50, 1.5);
        assert!(Percentiles::of(&[]).p50.is_nan());
    }

    #[test]
    fn reports_are_complete_in_all_formats() {
        let folder = tempfile::tempdir().unwrap();
        let mut report = Report::new("demo", "A <demo>", &[("spp", "4".into())]);
        let mut table = Table::new("times", "Times", &["scene", "ms"]);
        table.push(vec!["a, \"b\"".into(), 12.345_678.into()]);
        table.push(vec!["c".into(), f64::NAN.into()]);
        report.table(table);
        let points = vec![(1.0, 0.1), (10.0, 0.01)];
        report.plot(Plot::new("Error", ("rays", Scale::Log), ("relMSE", Scale::Log)).with("uniform", points));
        report.picture("crop", &Image::from_fn(2, 2, |_, _| [0.5; 3])).unwrap();
        let page = report.write(folder.path()).unwrap();
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(read("demo-times.csv"), "scene,ms\n\"a, \"\"b\"\"\",12.345678\nc,\n");
        let json: Value = serde_json::from_str(&read("demo.json")).unwrap();
        assert_eq!(json["tables"][0]["rows"][0]["ms"], 12.345_678);
        assert!(json["tables"][0]["rows"][1]["ms"].is_null());
        assert_eq!(json["about"]["spp"], "4");
        assert!(json["about"]["commit"].is_string() && json["about"]["processor"].is_string());
        assert!(read("demo-1.svg").starts_with("<svg") && read("demo-1.svg").contains("uniform"));
        let html = std::fs::read_to_string(page).unwrap();
        for part in ["A &lt;demo&gt;", "<svg", "<polyline", "data:image/png;base64,", "12.35"] {
            assert!(html.contains(part), "no {part}");
        }
        assert!(!html.contains("src=\"http") && !html.contains("<script"), "the page needs other files");
    }
}
