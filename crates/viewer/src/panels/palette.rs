//! The list of all commands and settings, found by typing.

use super::settings::{self, Setting, matches, seek};
use crate::viewer::{COMMANDS, Command, CommandInfo, Viewer};
use egui::{Align, Button, Context, Key, ScrollArea, TextEdit, Ui, Window};

/// Other words that people look for commands by.
const ALSO: &[(Command, &str)] = &[
    (Command::Open, "load import file"),
    (Command::Reload, "refresh"),
    (Command::Save, "write export"),
    (Command::SaveAs, "write export"),
    (Command::Screenshot, "capture window image"),
    (Command::SavePicture, "export render image hdr png write"),
    (Command::CopyCommandLine, "cli shell terminal"),
    (Command::CancelLoading, "abort"),
    (Command::Undo, "back"),
    (Command::Redo, "again repeat"),
    (Command::Duplicate, "copy clone"),
    (Command::Delete, "remove"),
    (Command::Hide, "visibility toggle"),
    (Command::Isolate, "solo local view alone"),
    (Command::ShowAll, "unhide reveal"),
    (Command::Rename, "name label"),
    (Command::ToolSelect, "gizmo tool none"),
    (Command::ToolMove, "gizmo translate grab drag tool"),
    (Command::ToolRotate, "gizmo turn tool"),
    (Command::ToolScale, "gizmo resize size tool"),
    (Command::LocalAxes, "gizmo orientation local global space"),
    (Command::Aim, "highlight shadow point sun spot place"),
    (Command::Icons, "overlay gizmo bulb"),
    (Command::Compass, "navigation cube view orientation"),
    (Command::AddModel, "import object mesh"),
    (Command::AddLamp, "light emitter area"),
    (Command::AddPointLight, "lamp"),
    (Command::Frame, "focus zoom fit view"),
    (Command::Home, "reset camera view"),
    (Command::ToggleProjection, "ortho"),
    (Command::Play, "turntable spin rotate camera"),
    (Command::PlayTime, "time start stop"),
    (Command::Rest, "bind pose reset"),
    (Command::KeepView, "bookmark camera"),
    (Command::ResetZoom, "100 % pan reset"),
    (Command::SidePanel, "sidebar properties"),
    (Command::Palette, "search find"),
    (Command::Help, "shortcuts keyboard hotkeys"),
    (Command::Pause, "stop continue"),
    (Command::Restart, "again seed"),
    (Command::NextLayer, "aov pass"),
    (Command::Picture, "beauty"),
    (Command::CompareSettings, "ab diff split"),
    (Command::CompareNow, "ab diff split snapshot"),
    (Command::CompareFile, "ab diff reference"),
    (Command::CompareNothing, "ab stop"),
    (Command::Snapshot, "store reference capture compare"),
    (Command::NextLook, "ab flip toggle diff difference error"),
    (Command::Zebra, "clipping overexposed highlights blown"),
    (Command::PixelGrid, "numbers inspect values"),
    (Command::CopyPicture, "clipboard image"),
    (Command::Brighter, "brightness ev"),
    (Command::Darker, "brightness ev"),
    (Command::PresetDraft, "preset fast low"),
    (Command::PresetPreview, "preset medium"),
    (Command::PresetFinal, "preset high best production"),
    (Command::RenderToFile, "export output final f12 save image"),
    (Command::StopRecording, "cancel abort recording"),
    (Command::RecordTurntable, "animation video sequence"),
    (Command::RecordPath, "animation video sequence flythrough"),
    (Command::RecordOrbit, "animation video sequence"),
    (Command::ExportStatistics, "performance benchmark"),
    (Command::Quit, "exit close"),
];

/// Something that the palette offers.
#[derive(Clone, Copy)]
enum Entry {
    Command(&'static CommandInfo),
    Setting(&'static Setting),
}

/// Shows it, if it is open.
pub fn show(viewer: &mut Viewer, ctx: &Context) {
    let mut chosen = None;
    let mut open = true;
    let window = Window::new("Commands").open(&mut open).collapsible(false).default_width(460.0);
    window.anchor(egui::Align2::CENTER_TOP, [0.0, 60.0]).show(ctx, |ui| {
        let found = field(viewer, ui);
        let marked = viewer.open.palette.marked.min(found.len().saturating_sub(1));
        viewer.open.palette.marked = marked;
        if ui.input(|i| i.key_pressed(Key::Enter)) {
            chosen = found.get(marked).copied();
        }
        ScrollArea::vertical().max_height(360.0).show(ui, |ui| {
            for (number, entry) in found.iter().enumerate() {
                let response = ui.add(button(*entry, number == marked, ctx));
                if number == marked && moved(ui).is_some() {
                    response.scroll_to_me(Some(Align::Center));
                }
                if response.clicked() {
                    chosen = Some(*entry);
                }
            }
            if found.is_empty() {
                ui.weak("No matches");
            }
        });
    });
    if chosen.is_some() || !open {
        viewer.open.close_overlays();
        viewer.open.palette = Default::default();
    }
    match chosen {
        Some(Entry::Command(info)) => viewer.run(info.command, ctx),
        Some(Entry::Setting(setting)) => seek(viewer, setting),
        None => {}
    }
}

/// What is typed, and what it finds. Arrows mark another entry.
fn field(viewer: &mut Viewer, ui: &mut Ui) -> Vec<Entry> {
    let name = ui.label("Type to find a command or a setting");
    let step = moved(ui);
    let choice = &mut viewer.open.palette;
    let text = TextEdit::singleline(&mut choice.text).desired_width(f32::INFINITY);
    let field = ui.add(text).labelled_by(name.id);
    if ui.memory(|m| m.focused().is_none()) && !field.lost_focus() {
        field.request_focus();
    }
    if field.changed() {
        choice.marked = 0;
    }
    choice.marked = choice.marked.saturating_add_signed(step.unwrap_or(0));
    matching(&choice.text)
}

/// By how many entries the arrow keys have moved the mark.
fn moved(ui: &Ui) -> Option<isize> {
    ui.input(|i| match (i.key_pressed(Key::ArrowDown), i.key_pressed(Key::ArrowUp)) {
        (true, false) => Some(1),
        (false, true) => Some(-1),
        _ => None,
    })
}

fn button(entry: Entry, is_marked: bool, ctx: &Context) -> Button<'static> {
    match entry {
        Entry::Command(info) => {
            Button::selectable(is_marked, info.name).shortcut_text(info.shortcut_text(ctx))
        }
        Entry::Setting(setting) => Button::selectable(is_marked, setting.label)
            .shortcut_text(format!("{} page", setting.page.name())),
    }
}

/// What has all words of `text`: commands before settings, and names before other words.
fn matching(text: &str) -> Vec<Entry> {
    let words: Vec<String> = text.to_lowercase().split_whitespace().map(str::to_owned).collect();
    let also = |command| ALSO.iter().find(|(of, _)| *of == command).map_or("", |(_, words)| words);
    let mut found = Vec::new();
    for info in COMMANDS.iter().filter(|info| matches(&words, info.name, also(info.command))) {
        found.push((!matches(&words, info.name, ""), Entry::Command(info)));
    }
    // Without a word there would be too many.
    for setting in settings::all().filter(|s| !words.is_empty() && matches(&words, s.label, s.also)) {
        found.push((!matches(&words, setting.label, ""), Entry::Setting(setting)));
    }
    found.sort_by_key(|(by_other_words, _)| *by_other_words);
    found.into_iter().map(|(_, entry)| entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<&'static str> {
        let name = |entry| match entry {
            Entry::Command(info) => info.name,
            Entry::Setting(setting) => setting.label,
        };
        matching(text).into_iter().map(name).collect()
    }

    #[test]
    fn words_in_any_order_find_commands() {
        assert_eq!(names("turntable rec"), ["Record a turntable…"]);
        assert_eq!(names("").len(), COMMANDS.len());
        assert!(names("no such thing").is_empty());
        assert_eq!(names("export statistics").len(), 0);
        assert_eq!(names("solo"), ["Show only the selection"]);
    }

    #[test]
    fn settings_are_found_and_names_come_first() {
        let exposure = names("exposure");
        assert_eq!(exposure[2], "Exposure (stops)", "{exposure:?}");
        assert!(exposure[..2].iter().all(|name| name.contains("exposure")));
        assert_eq!(names("exposure")[3..], ["False colour"]);
        assert!(names("brightness").contains(&"Exposure (stops)"));
        assert_eq!(names("bounces")[0], "Maximum depth");
    }
}
