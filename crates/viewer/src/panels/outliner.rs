//! The tree of objects: what is in what, what is shown, and its name.

use crate::outliner::{Item, Outliner, Row};
use crate::viewer::{Command, Viewer};
use egui::{
    Align, Button, Color32, CursorIcon, EventFilter, Id, Key, Layout, Modifiers, Pos2, Rect, Response, Role,
    ScrollArea, Sense, Shape, Stroke, TextEdit, Ui, WidgetInfo, pos2, vec2,
};

/// How far what is in a group stands to the right of it, points.
const INDENT: f32 = 14.0;
/// Width of arrows and switches, points.
const SIGN: f32 = 18.0;
/// Least and greatest height of the list, points.
const HEIGHTS: [f32; 2] = [60.0, 2000.0];

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    head(viewer, ui);
    let edits = viewer.edit_count();
    let Some(document) = &viewer.document else { return };
    let outliner = &mut viewer.open.outliner;
    let selected = viewer.selection.map(|s| s.object);
    if selected != outliner.known_selection {
        outliner.known_selection = selected;
        if let Some(object) = selected {
            outliner.reveal(document, Item::Object(object));
        }
    }
    outliner.follow(document, edits);
    list(viewer, ui);
    handle(viewer, ui);
}

/// What is typed to find objects, and buttons for all lines.
fn head(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let name = ui.label("Find");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            for (name, open) in [("Collapse all", false), ("Expand all", true)] {
                let Some(document) = &viewer.document else { continue };
                let has_groups = !document.scene().groups.list.is_empty();
                if ui.add_enabled(has_groups, Button::new(name)).clicked() {
                    viewer.open.outliner.set_all_open(document, open);
                }
            }
            let width = ui.available_width();
            let field = TextEdit::singleline(&mut viewer.open.outliner.filter).desired_width(width);
            ui.add(field).labelled_by(name.id);
        });
    });
}

/// The lines, of which only those that are seen are made.
fn list(viewer: &mut Viewer, ui: &mut Ui) {
    let height = viewer.settings.outliner_height.clamp(HEIGHTS[0], HEIGHTS[1]);
    let (line, gap) = (ui.spacing().interact_size.y, ui.spacing().item_spacing.y);
    let rows = viewer.open.outliner.rows().to_vec();
    let mut area = ScrollArea::vertical().id_salt("objects").auto_shrink(false).max_height(height);
    if std::mem::take(&mut viewer.open.outliner.reveals)
        && let Some(place) = viewer.open.outliner.cursor.and_then(|item| viewer.open.outliner.place(item))
    {
        // In the middle, with what is beside it.
        let middle = place as f32 * (line + gap) - (height - line) * 0.5;
        area = area.vertical_scroll_offset(middle.max(0.0));
    }
    let id = ui.scope_id().with("tree of objects");
    let mut done = Vec::new();
    let shown = area.show_rows(ui, line, rows.len(), |ui, seen| {
        rows[seen].iter().for_each(|row| done.extend(one(viewer, ui, *row, id)));
        if rows.is_empty() {
            ui.weak("No matches");
        }
    });
    // What is not known to be there loses the focus.
    ui.ctx().check_for_id_clash(id, shown.inner_rect, "tree of objects");
    let tree = ui.interact(shown.inner_rect, id, Sense::focusable_noninteractive());
    tree.widget_info(|| WidgetInfo::labeled(Role::Tree, true, "Objects of the scene"));
    done.into_iter().for_each(|deed| act(viewer, ui, id, deed));
    keys(viewer, ui, id);
}

/// What the user does with a line.
enum Deed {
    Choose(Item),
    /// Select it as well, or no more.
    Toggle(Item),
    /// Select all up to it.
    Extend(Item),
    Open(Item, bool),
    Switch(Item),
    Rename(Item),
    Name(Item, Option<String>),
}

fn one(viewer: &mut Viewer, ui: &mut Ui, row: Row, tree: Id) -> Option<Deed> {
    let Row { item, depth } = row;
    let name = viewer.name_of(item)?.to_owned();
    let mut deed = None;
    ui.push_id(item, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            ui.add_space(depth as f32 * INDENT);
            deed = arrow(&viewer.open.outliner, ui, item, &name);
            if let Some((_, text)) = viewer.open.outliner.renaming.as_mut().filter(|(of, _)| *of == item) {
                deed = deed.take().or(name_field(ui, item, text));
                return;
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                deed = deed.take().or(eye(viewer, ui, item, &name));
                if let Item::Group(group) = item {
                    ui.weak(viewer.open.outliner.tree().count(group).to_string());
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    deed = deed.take().or(label(viewer, ui, item, &name, tree));
                });
            });
        });
    });
    deed
}

/// The triangle of a group.
fn arrow(outliner: &Outliner, ui: &mut Ui, item: Item, name: &str) -> Option<Deed> {
    let size = vec2(SIGN, ui.spacing().interact_size.y);
    let Item::Group(group) = item else {
        ui.add_space(SIGN);
        return None;
    };
    let is_open = outliner.is_open(group);
    let response = ui.allocate_response(size, Sense::click());
    let verb = if is_open { "Collapse" } else { "Expand" };
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("{verb} {name}")));
    let openness = if is_open { 1.0 } else { 0.0 };
    egui::collapsing_header::paint_default_icon(ui, openness, &response);
    response.clicked().then_some(Deed::Open(item, !is_open))
}

/// The name. A click chooses it, a second one renames; with Ctrl it is chosen as well, with Shift all up to it.
fn label(viewer: &Viewer, ui: &mut Ui, item: Item, name: &str, tree: Id) -> Option<Deed> {
    let chosen = viewer.is_chosen(item);
    let is_marked = viewer.open.outliner.cursor == Some(item);
    let is_seen = match (item, &viewer.document) {
        (Item::Object(object), Some(document)) => {
            document.scene().instances.get(object as usize).is_some_and(|i| i.visible)
        }
        _ => viewer.is_on(item),
    };
    let mut text = egui::RichText::new(if name.is_empty() { "(no name)" } else { name });
    if matches!(item, Item::Group(_)) {
        text = text.strong();
    }
    if !is_seen {
        text = text.weak().italics();
    }
    let response = ui.add(Button::selectable(chosen, text).truncate());
    if is_marked && ui.memory(|m| m.has_focus(tree)) {
        let stroke = Stroke::new(1.0, ui.visuals().selection.stroke.color);
        ui.painter().rect_stroke(response.rect, 2.0, stroke, egui::StrokeKind::Inside);
    }
    if response.double_clicked() {
        return Some(Deed::Rename(item));
    }
    let modifiers = ui.input(|i| i.modifiers);
    response.clicked().then_some(match (modifiers.command, modifiers.shift) {
        (true, _) => Deed::Toggle(item),
        (_, true) => Deed::Extend(item),
        _ => Deed::Choose(item),
    })
}

/// The field in which a line gets another name. Enter takes it, Escape does not.
fn name_field(ui: &mut Ui, item: Item, text: &mut String) -> Option<Deed> {
    let field = ui.add(TextEdit::singleline(text).desired_width(f32::INFINITY).id_salt("new name"));
    let key = Id::unique("new name has had the focus");
    let began = ui.data(|data| data.get_temp::<Item>(key)) == Some(item);
    if !began {
        field.request_focus();
        ui.data_mut(|data| data.insert_temp(key, item));
        return None;
    }
    if !field.lost_focus() {
        return None;
    }
    ui.data_mut(|data| data.remove::<Item>(key));
    let is_wanted = !ui.input(|i| i.key_pressed(Key::Escape));
    Some(Deed::Name(item, is_wanted.then(|| text.clone())))
}

/// The switch of a line: an open eye, or a line through it.
fn eye(viewer: &Viewer, ui: &mut Ui, item: Item, name: &str) -> Option<Deed> {
    let on = viewer.is_on(item);
    let response = ui.allocate_response(vec2(SIGN, ui.spacing().interact_size.y), Sense::click());
    let label = format!("Visible: {name}");
    response.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, on, &label));
    let visuals = ui.style().interact(&response);
    let colour = if on { visuals.text_color() } else { ui.visuals().weak_text_color() };
    paint_eye(ui, response.rect.center(), on, colour);
    let clicked = response.clicked();
    response.on_hover_text("Whether it is part of the picture (Space or H)");
    clicked.then_some(Deed::Switch(item))
}

fn paint_eye(ui: &Ui, center: Pos2, on: bool, colour: Color32) {
    let stroke = Stroke::new(1.2, colour);
    let lid = |up: f32| {
        let point = |i: i32| {
            let x = i as f32 / 4.0;
            pos2(center.x + 6.0 * x, center.y - up * 3.6 * (1.0 - x * x))
        };
        Shape::line((-4..=4).map(point).collect(), stroke)
    };
    ui.painter().extend([lid(1.0), lid(-1.0)]);
    if on {
        ui.painter().circle_filled(center, 1.8, colour);
    } else {
        ui.painter().line_segment([center + vec2(-5.0, 4.5), center + vec2(5.0, -4.5)], stroke);
    }
}

fn act(viewer: &mut Viewer, ui: &Ui, tree: Id, deed: Deed) {
    match deed {
        Deed::Choose(item) => viewer.choose(item),
        Deed::Toggle(item) => viewer.toggle_chosen(item),
        Deed::Extend(item) => viewer.extend_to(item),
        Deed::Switch(item) => return viewer.switch(item),
        Deed::Open(Item::Group(group), open) => viewer.open.outliner.set_open(group, open),
        Deed::Open(Item::Object(_), _) => {}
        Deed::Rename(item) => {
            viewer.choose(item);
            return viewer.run(Command::Rename, ui.ctx());
        }
        Deed::Name(item, name) => {
            viewer.open.outliner.renaming = None;
            if let Some(name) = name {
                viewer.rename(item, &name);
            }
        }
    }
    ui.memory_mut(|memory| memory.request_focus(tree));
}

/// Arrows walk through the lines, Enter opens groups and frames objects, Space and H hide and show.
fn keys(viewer: &mut Viewer, ui: &Ui, tree: Id) {
    let has_focus = ui.memory(|memory| memory.has_focus(tree));
    viewer.open.outliner.has_focus = has_focus;
    if !has_focus {
        return;
    }
    let arrows = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(tree, arrows));
    let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
    let steps = [(Key::ArrowDown, 1), (Key::ArrowUp, -1), (Key::PageDown, 10), (Key::PageUp, -10)];
    for (_, by) in steps.into_iter().filter(|(key, _)| pressed(*key)) {
        go(viewer, ui, viewer.open.outliner.beside(by));
    }
    let cursor = viewer.open.outliner.cursor;
    if pressed(Key::ArrowRight) {
        open_or_enter(viewer, ui, cursor);
    }
    if pressed(Key::ArrowLeft) {
        match cursor {
            Some(Item::Group(group)) if viewer.open.outliner.is_open(group) => {
                viewer.open.outliner.set_open(group, false);
            }
            _ => go(viewer, ui, viewer.open.outliner.above()),
        }
    }
    if pressed(Key::Enter) {
        match cursor {
            Some(Item::Group(group)) => {
                let open = !viewer.open.outliner.is_open(group);
                viewer.open.outliner.set_open(group, open);
            }
            Some(Item::Object(_)) => viewer.run(Command::Frame, ui.ctx()),
            None => {}
        }
    }
    if let Some(item) = cursor.filter(|_| pressed(Key::Space)) {
        viewer.switch(item);
    }
}

fn open_or_enter(viewer: &mut Viewer, ui: &Ui, cursor: Option<Item>) {
    let Some(Item::Group(group)) = cursor else { return };
    if viewer.open.outliner.is_open(group) {
        go(viewer, ui, viewer.open.outliner.beside(1));
    } else {
        viewer.open.outliner.set_open(group, true);
    }
}

/// Chooses a line and scrolls to it; with Shift as well as what is chosen.
fn go(viewer: &mut Viewer, ui: &Ui, item: Option<Item>) {
    if let Some(item) = item {
        if ui.input(|i| i.modifiers.shift) {
            viewer.extend_to(item);
        } else {
            viewer.choose(item);
        }
        viewer.open.outliner.reveals = true;
    }
}

/// A border that is dragged to make the list higher.
fn handle(viewer: &mut Viewer, ui: &mut Ui) {
    let response = ui.allocate_response(vec2(ui.available_width(), 8.0), Sense::drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Splitter, true, "Height of the list"));
    grip(ui, &response);
    let response = response.on_hover_cursor(CursorIcon::ResizeVertical);
    if response.dragged() {
        let height = viewer.settings.outliner_height + response.drag_delta().y;
        viewer.settings.outliner_height = height.clamp(HEIGHTS[0], HEIGHTS[1]);
    }
}

fn grip(ui: &Ui, response: &Response) {
    let colour = ui.style().interact(response).fg_stroke.color.gamma_multiply(0.4);
    let place = Rect::from_center_size(response.rect.center(), vec2(36.0, 3.0));
    ui.painter().rect_filled(place, 1.5, colour);
}
