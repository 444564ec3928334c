//! What settings there are: their tool-tips, and how the palette finds them.

mod image;
mod rendering;
mod scene;

use super::open::{Sought, Tab};
use crate::viewer::Viewer;
use egui::{Align, Context, Id, Response, Stroke, StrokeKind, Ui};
use image::IMAGE;
use rendering::RENDERING;
use scene::SCENE;

/// A control of a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The page that it is on.
    pub page: Tab,
    /// Its label.
    pub label: &'static str,
    /// What it does, with its unit and range: the tool-tip.
    pub about: &'static str,
    /// Other words that people look for it by.
    pub also: &'static str,
}

const fn setting(page: Tab, label: &'static str, about: &'static str, also: &'static str) -> Setting {
    Setting { page, label, about, also }
}

/// All controls of pages that have a label.
pub fn all() -> impl Iterator<Item = &'static Setting> {
    RENDERING.iter().chain(IMAGE).chain(SCENE)
}

/// A setting that was found is marked for so long, seconds.
const MARKED: f64 = 2.0;
/// A page has been laid out after so long, seconds: what it has not shown by then it does not have.
const LAID_OUT: f64 = 0.5;

/// The tool-tip of the control with this label.
pub fn tooltip(label: &str) -> Option<&'static str> {
    all().find(|setting| setting.label == label).map(|setting| setting.about)
}

/// The control with its tool-tip, if it has one.
pub(super) fn explain(response: Response, label: &str) -> Response {
    match tooltip(label) {
        Some(text) => response.on_hover_text(text),
        None => response,
    }
}

fn key() -> Id {
    Id::unique("sought setting")
}

/// Opens the page of a setting and marks it there.
pub(super) fn seek(viewer: &mut Viewer, setting: &Setting) {
    (viewer.open.side, viewer.open.tab) = (true, setting.page);
    let sought = Sought { label: setting.label, since: viewer.time(), found: false };
    viewer.open.sought = Some(sought);
}

/// Before pages are shown: tells rows what is sought.
pub(super) fn begin(viewer: &Viewer, ctx: &Context) {
    ctx.data_mut(|data| match viewer.open.sought {
        Some(sought) => drop(data.insert_temp(key(), sought)),
        None => data.remove::<Sought>(key()),
    });
}

/// After pages were shown: says where a setting is not to be had at the moment.
pub(super) fn end(viewer: &mut Viewer, ctx: &Context) {
    let Some(sought) = ctx.data(|data| data.get_temp::<Sought>(key())) else { return };
    let age = viewer.time() - sought.since;
    ctx.request_repaint();
    viewer.open.sought = (age < MARKED).then_some(sought);
    if !sought.found && age > LAID_OUT {
        viewer.open.sought = None;
        let text = format!("\"{}\" does not apply to what is selected at the moment", sought.label);
        viewer.notice(text, false);
    }
}

/// Whether a setting is looked for: then all sections are open.
pub(super) fn is_seeking(ctx: &Context) -> bool {
    ctx.data(|data| data.get_temp::<Sought>(key()).is_some_and(|sought| !sought.found))
}

/// Scrolls to a row and marks it, if it is what is sought.
pub(super) fn show_if_sought(ui: &Ui, label: &str, row: &Response) {
    let Some(sought) = ui.data(|data| data.get_temp::<Sought>(key())) else { return };
    if sought.label != label {
        return;
    }
    if !sought.found {
        row.scroll_to_me(Some(Align::Center));
        ui.data_mut(|data| data.insert_temp(key(), Sought { found: true, ..sought }));
    }
    let stroke = Stroke::new(1.5, ui.visuals().warn_fg_color);
    ui.painter().rect_stroke(row.rect.expand(2.0), 3.0, stroke, StrokeKind::Outside);
}

/// Whether all words of `text` (lower case) are in a name or its other words.
pub(super) fn matches(words: &[String], name: &str, also: &str) -> bool {
    let (name, also) = (name.to_lowercase(), also.to_lowercase());
    words.iter().all(|word| name.contains(word.as_str()) || also.contains(word.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_listed_once_and_say_what_they_do() {
        for (i, setting) in all().enumerate() {
            assert!(setting.about.ends_with('.'), "{setting:?}");
            let again = all().take(i).find(|other| other.label == setting.label);
            assert_eq!(again, None, "{} is listed twice", setting.label);
        }
        assert_eq!(tooltip("no such control"), None);
    }

    #[test]
    fn settings_are_found_by_their_usual_names() {
        let found = |text: &str| -> Vec<&str> {
            let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            let hits = all().filter(|s| matches(&words, s.label, s.also));
            hits.map(|s| s.label).collect()
        };
        for (text, label) in [
            ("exposure", "Exposure (stops)"),
            ("brightness", "Exposure (stops)"),
            ("gamma", "Tone mapper"),
            ("bounces", "Maximum depth"),
            ("noise threshold", "Noise limit"),
            ("spp", "Samples per pixel"),
            ("aperture", "Lens radius (m)"),
            ("dof", "Depth of field"),
            ("fov", "Field of view (°)"),
            ("hdri", "Environment"),
            ("metalness", "Metallic"),
            ("translate", "Position (m)"),
            ("resolution", "Fixed resolution"),
            ("gpu", "Back end"),
            ("oidn", "Denoiser"),
            ("ior", "Index of refraction"),
            ("ao", "Ambient occlusion rays"),
            ("haze", "Turbidity"),
        ] {
            assert!(found(text).contains(&label), "{text}: {:?}", found(text));
        }
    }
}
