//! The pictures that were kept: snapshots, and files with their layers.

use crate::exr_layers::{ExrLayers, LayerChoice};
use crate::viewer::{Command, Viewer};
use egui::{ComboBox, Ui};

/// What is done with a picture that was kept.
enum Deed {
    Compare,
    Return,
    Forget,
    Layer(LayerChoice),
}

/// The pictures that were kept.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    if ui.button("Keep this picture").clicked() {
        viewer.run(Command::Snapshot, &ui.ctx().clone());
    }
    if viewer.tools.snapshots.is_empty() {
        ui.weak("Snapshots and opened pictures are listed here.");
    }
    let mut deed = None;
    let ctx = ui.ctx().clone();
    for (number, kept) in viewer.tools.snapshots.iter_mut().enumerate() {
        ui.push_id(number, |ui| {
            ui.horizontal(|ui| {
                let small = kept.thumbnail(&ctx);
                let size = small.size_vec2() * (64.0 / small.size_vec2().x);
                let picture = egui::Image::new((small.id(), size)).alt_text(&kept.name);
                ui.add(picture).on_hover_text(&kept.about);
                ui.vertical(|ui| {
                    ui.add(egui::TextEdit::singleline(&mut kept.name).desired_width(160.0));
                    ui.horizontal(|ui| {
                        if ui.small_button("Compare").clicked() {
                            deed = Some((number, Deed::Compare));
                        }
                        let returns = ui.add_enabled(kept.made_by.is_some(), small_button("Go back"));
                        let returns = returns.on_hover_text("Render with its camera and settings again.");
                        if returns.clicked() {
                            deed = Some((number, Deed::Return));
                        }
                        if ui.small_button("Forget").clicked() {
                            deed = Some((number, Deed::Forget));
                        }
                    });
                    if let Some((layers, chosen)) = &kept.layers {
                        deed = deed
                            .take()
                            .or(layer(ui, layers, *chosen).map(|choice| (number, Deed::Layer(choice))));
                    }
                    ui.weak(&kept.about);
                });
            });
        });
    }
    match deed {
        Some((number, Deed::Compare)) => viewer.compare_with_snapshot(number),
        Some((number, Deed::Return)) => viewer.return_to_snapshot(number),
        Some((number, Deed::Layer(choice))) => viewer.choose_layer(number, choice),
        Some((number, Deed::Forget)) => viewer.forget_snapshot(number),
        None => {}
    }
}

fn small_button(text: &str) -> egui::Button<'_> {
    egui::Button::new(text).small()
}

/// Which layer and channel of a file is shown; another one, if it was chosen.
fn layer(ui: &mut Ui, layers: &ExrLayers, chosen: LayerChoice) -> Option<LayerChoice> {
    let mut choice = chosen;
    let names: Vec<&str> = layers.names().collect();
    ui.horizontal(|ui| {
        let list =
            ComboBox::from_id_salt("layer").selected_text(names.get(chosen.layer).copied().unwrap_or(""));
        let list = list.width(110.0).truncate().show_ui(ui, |ui| {
            for (layer, name) in names.iter().enumerate() {
                ui.selectable_value(&mut choice, LayerChoice { layer, channel: None }, *name);
            }
        });
        named(list.response, "Layer of the file");
        let channels = layers.channels(chosen.layer);
        let shown = chosen.channel.and_then(|channel| channels.get(channel)).map_or("all", String::as_str);
        let list = ComboBox::from_id_salt("channel").selected_text(shown).width(50.0).show_ui(ui, |ui| {
            ui.selectable_value(&mut choice.channel, None, "all");
            for (number, name) in channels.iter().enumerate() {
                ui.selectable_value(&mut choice.channel, Some(number), name);
            }
        });
        named(list.response, "Channel of the file");
    });
    (choice != chosen).then_some(choice)
}

/// What people are told of a list without a label beside it.
fn named(response: egui::Response, name: &str) {
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, name));
    response.on_hover_text(name);
}
