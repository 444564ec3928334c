//! One page that shows a report and needs no other file.

use super::{Cell, Item, Table};
use base64::Engine;
use std::fmt::Write;

const STYLE: &str = "\
body { font: 15px/1.5 sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222; background: #fff }
table { border-collapse: collapse; margin: 1rem 0 }
th, td { border-bottom: 1px solid #ddd; padding: .2rem .7rem; text-align: right }
th:first-child, td:first-child { text-align: left }
figure { margin: 1.5rem 0 }
figcaption { color: #555 }
img { image-rendering: pixelated; max-width: 100% }
dt { float: left; clear: left; width: 9rem; color: #555 }
dd { margin-left: 9.5rem }
";

/// The page.
pub(super) fn page(title: &str, about: &[(String, String)], items: &[Item]) -> String {
    let title = escape(title);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
         <style>\n{STYLE}</style>\n<h1>{title}</h1>\n"
    );
    for item in items {
        out += &match item {
            Item::Text(text) => format!("<p>{}</p>\n", escape(text)),
            Item::Table(table) => as_table(table),
            Item::Plot(plot) => format!("<figure>{}</figure>\n", plot.svg()),
            Item::Picture { title, png } => {
                let data = base64::engine::general_purpose::STANDARD.encode(png);
                let title = escape(title);
                format!(
                    "<figure><img alt=\"{title}\" src=\"data:image/png;base64,{data}\">\
                     <figcaption>{title}</figcaption></figure>\n"
                )
            }
        };
    }
    out += "<h2>How it was measured</h2>\n<dl>\n";
    for (key, value) in about {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "<dt>{}</dt><dd>{}</dd>", escape(key), escape(value));
    }
    out + "</dl>\n</html>\n"
}

fn as_table(table: &Table) -> String {
    let row = |tag: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|c| format!("<{tag}>{}</{tag}>", escape(c))).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let body: String = table.rows.iter().map(|r| row("td", r.iter().map(Cell::text).collect())).collect();
    let header = row("th", table.columns.clone());
    format!("<h2>{}</h2>\n<table>\n{header}{body}</table>\n", escape(&table.title))
}

/// Text as HTML and SVG want it.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
