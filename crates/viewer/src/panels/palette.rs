//! The list of all commands, found by typing.

use crate::viewer::{COMMANDS, CommandInfo, Viewer};
use egui::{Context, Key, Window};

/// Shows it, if it is open.
pub fn show(viewer: &mut Viewer, ctx: &Context) {
    if !viewer.open.palette {
        return;
    }
    let mut chosen = None;
    let mut open = true;
    let window = Window::new("Commands").open(&mut open).collapsible(false).default_width(420.0);
    window.anchor(egui::Align2::CENTER_TOP, [0.0, 60.0]).show(ctx, |ui| {
        let name = ui.label("Type to find a command");
        let text = egui::TextEdit::singleline(&mut viewer.open.palette_text).desired_width(f32::INFINITY);
        let field = ui.add(text).labelled_by(name.id);
        if ui.memory(|m| m.focused().is_none()) && !field.lost_focus() {
            field.request_focus();
        }
        let found: Vec<&CommandInfo> = matching(&viewer.open.palette_text).collect();
        if field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) {
            chosen = found.first().map(|info| info.command);
        }
        egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
            for info in found {
                let keys = info.shortcut_text(ctx);
                if ui.add(egui::Button::new(info.name).shortcut_text(keys).frame(false)).clicked() {
                    chosen = Some(info.command);
                }
            }
        });
    });
    if ctx.input(|i| i.key_pressed(Key::Escape)) || chosen.is_some() || !open {
        (viewer.open.palette, viewer.open.palette_text) = (false, String::new());
    }
    if let Some(command) = chosen {
        viewer.run(command, ctx);
    }
}

/// Commands whose name has all words of `text`.
fn matching(text: &str) -> impl Iterator<Item = &'static CommandInfo> {
    let words: Vec<String> = text.to_lowercase().split_whitespace().map(str::to_owned).collect();
    COMMANDS.iter().filter(move |info| {
        let name = info.name.to_lowercase();
        words.iter().all(|word| name.contains(word.as_str()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_in_any_order_find_commands() {
        let names = |text: &str| matching(text).map(|info| info.name).collect::<Vec<_>>();
        assert_eq!(names("turntable rec"), ["Record a turntable…"]);
        assert_eq!(names("exposure").len(), 2);
        assert_eq!(names("").len(), COMMANDS.len());
        assert!(names("no such thing").is_empty());
    }
}
