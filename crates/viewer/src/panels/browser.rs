//! The file dialog of our own.

use crate::browser::{Browser, Entry, SIDE};
use crate::viewer::Viewer;
use alhazen::LoadOptions;
use egui::{
    Align, Align2, Button, Context, Grid, Image, Key, Layout, Modifiers, RichText, ScrollArea, TextEdit,
    TextureOptions, Ui, Window,
};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Height of the list, points.
const LIST: f32 = 320.0;

/// What the user has done.
enum Answer {
    File(PathBuf),
    Cancel,
}

/// Shows it, if it is open.
pub fn show(viewer: &mut Viewer, ctx: &Context) {
    let options = viewer.load_options().clone();
    let Some((what, browser)) = &mut viewer.browser else { return };
    browser.poll();
    let (what, mut answer) = (*what, keys(browser, ctx));
    let mut open = true;
    let window = Window::new(browser.request.title).open(&mut open).collapsible(false).resizable(false);
    window.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).show(ctx, |ui| {
        head(browser, ui);
        ui.horizontal_top(|ui| {
            places(browser, ui);
            answer = answer.take().or(entries(browser, ui));
            preview(browser, &options, ui);
        });
        answer = answer.take().or(foot(browser, ui));
    });
    let answer = if open { answer } else { Some(Answer::Cancel) };
    match answer {
        Some(Answer::File(path)) => {
            viewer.browser = None;
            viewer.use_file(what, path);
        }
        Some(Answer::Cancel) => viewer.browser = None,
        None => {}
    }
}

/// Arrows walk through the list, Enter takes what is marked, Escape closes.
fn keys(browser: &mut Browser, ctx: &Context) -> Option<Answer> {
    let pressed = |key| ctx.input(|i| i.key_pressed(key));
    if ctx.input_mut(|i| i.consume_key(Modifiers::ALT, Key::ArrowUp)) {
        browser.up();
    }
    let steps = [(Key::ArrowDown, 1), (Key::ArrowUp, -1), (Key::PageDown, 10), (Key::PageUp, -10)];
    for (_, step) in steps.into_iter().filter(|(key, _)| pressed(*key)) {
        browser.step(step);
    }
    if pressed(Key::Escape) {
        return Some(Answer::Cancel);
    }
    if pressed(Key::Enter) {
        return browser.accept().map(Answer::File);
    }
    None
}

/// The way to the folder, part by part.
fn head(browser: &mut Browser, ui: &mut Ui) {
    let mut to = None;
    ui.horizontal_wrapped(|ui| {
        if ui.button("Up").on_hover_text("The folder above (Alt and up)").clicked() {
            to = browser.folder().parent().map(Path::to_owned);
        }
        let mut above: Vec<&Path> = browser.folder().ancestors().collect();
        above.reverse();
        for folder in above {
            let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy();
            if ui.add(Button::new(name).frame(false)).clicked() {
                to = Some(folder.to_owned());
            }
            ui.weak("/");
        }
    });
    ui.separator();
    if let Some(folder) = to {
        browser.go(&folder);
    }
}

fn places(browser: &mut Browser, ui: &mut Ui) {
    let mut to = None;
    ui.vertical(|ui| {
        ui.set_width(130.0);
        for place in browser.places() {
            let is_here = place.path == browser.folder();
            let there = place.path.display().to_string();
            let button = Button::selectable(is_here, &place.name).truncate();
            if ui.add(button).on_hover_text(there).clicked() {
                to = Some(place.path.clone());
            }
        }
    });
    if let Some(folder) = to {
        browser.go(&folder);
    }
}

/// The list. A click marks, a double click opens.
fn entries(browser: &mut Browser, ui: &mut Ui) -> Option<Answer> {
    let (mut mark, mut open) = (None, None);
    let marked = browser.marked().map(|entry| entry.path.clone());
    ui.vertical(|ui| {
        ui.set_width(430.0);
        let list = ScrollArea::vertical().max_height(LIST).min_scrolled_height(LIST).auto_shrink(false);
        list.show(ui, |ui| {
            Grid::new("files").striped(true).num_columns(3).min_col_width(60.0).show(ui, |ui| {
                for entry in browser.shown() {
                    let response = row(ui, entry, marked.as_ref() == Some(&entry.path));
                    if response.double_clicked() {
                        open = Some(entry.path.clone());
                    } else if response.clicked() {
                        mark = Some(entry.path.clone());
                    }
                }
            });
            if browser.is_listing() {
                ui.spinner();
            } else if browser.shown().next().is_none() {
                ui.weak("nothing of that kind is here");
            }
        });
    });
    if let Some(path) = mark.or(open.clone()) {
        browser.mark(&path);
    }
    // A name that is typed would be meant otherwise.
    if open.is_some() && browser.request.saves_as.is_none() {
        browser.text.clear();
    }
    open.and_then(|path| if path.is_dir() { browser.go_into(&path) } else { browser.accept() })
        .map(Answer::File)
}

fn row(ui: &mut Ui, entry: &Entry, is_marked: bool) -> egui::Response {
    let name = if entry.is_folder { format!("{}/", entry.name) } else { entry.name.clone() };
    let response = ui.add(Button::selectable(is_marked, name).truncate());
    ui.weak(if entry.is_folder { String::new() } else { size_text(entry.bytes) });
    ui.weak(entry.modified.and_then(age_text).unwrap_or_default());
    ui.end_row();
    response
}

/// What the marked file looks like.
fn preview(browser: &mut Browser, options: &LoadOptions, ui: &mut Ui) {
    ui.vertical(|ui| {
        ui.set_width(SIDE as f32);
        let Some(entry) = browser.marked().filter(|entry| !entry.is_folder) else { return };
        let (path, name) = (entry.path.clone(), entry.name.clone());
        let wake = browser.wake().clone();
        let Some(preview) = browser.previews.of(&path, options, &wake) else {
            ui.spinner();
            return;
        };
        if let Some(picture) = &preview.picture {
            let shown = browser.texture.take().filter(|(of, _)| *of == path);
            let load = || ui.ctx().load_texture("preview", picture.clone(), TextureOptions::LINEAR);
            let texture = shown.map_or_else(load, |(_, texture)| texture);
            browser.texture = Some((path, texture.clone()));
            ui.add(Image::new(&texture).alt_text(format!("Preview of {name}")));
        }
        ui.label(&name);
        ui.weak(&preview.text);
    });
}

/// What is typed, and the buttons.
fn foot(browser: &mut Browser, ui: &mut Ui) -> Option<Answer> {
    let mut answer = None;
    ui.separator();
    let saves = browser.request.saves_as.is_some();
    ui.horizontal(|ui| {
        let label = ui.label(if saves { "Name" } else { "Find, or a path" });
        let field = TextEdit::singleline(&mut browser.text).desired_width(360.0);
        let field = ui.add(field).labelled_by(label.id);
        if ui.memory(|m| m.focused().is_none()) {
            field.request_focus();
        }
        let kinds = browser.request.endings.join(", ");
        let mut only = !browser.all_kinds;
        ui.checkbox(&mut only, format!("{} only", browser.request.kind)).on_hover_text(kinds);
        browser.all_kinds = !only;
        ui.checkbox(&mut browser.hidden, "Hidden files");
    });
    ui.horizontal(|ui| {
        ui.set_min_width(ui.available_width());
        if let Some(message) = &browser.message {
            ui.label(RichText::new(message).color(ui.visuals().warn_fg_color));
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button(if saves { "Save" } else { "Open" }).clicked() {
                answer = browser.accept().map(Answer::File);
            }
            if ui.button("Cancel").clicked() {
                answer = Some(Answer::Cancel);
            }
        });
    });
    answer
}

fn size_text(bytes: u64) -> String {
    match bytes {
        0..1000 => format!("{bytes} B"),
        1000..1_000_000 => format!("{:.0} kB", bytes as f64 * 1e-3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 * 1e-6),
        _ => format!("{:.1} GB", bytes as f64 * 1e-9),
    }
}

/// How long ago something was; nothing of what is to come.
fn age_text(then: SystemTime) -> Option<String> {
    let minutes = SystemTime::now().duration_since(then).ok()?.as_secs() / 60;
    Some(match minutes {
        0 => "just now".into(),
        1..60 => format!("{minutes} min ago"),
        60..1440 => format!("{} h ago", minutes / 60),
        1440..2880 => "yesterday".into(),
        _ => format!("{} days ago", minutes / 1440),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn sizes_and_ages_are_short() {
        let sizes = [0, 999, 4_096, 12_345_678, 5_000_000_000].map(size_text);
        assert_eq!(sizes, ["0 B", "999 B", "4 kB", "12.3 MB", "5.0 GB"]);
        let ages =
            [5, 600, 7_200, 100_000, 864_000].map(|s| age_text(SystemTime::now() - Duration::from_secs(s)));
        let expected = ["just now", "10 min ago", "2 h ago", "yesterday", "10 days ago"];
        assert_eq!(ages.map(Option::unwrap_or_default), expected);
        assert_eq!(age_text(SystemTime::now() + Duration::from_secs(600)), None);
    }
}
