//! What is rendered, by what, and how it is shown.

use super::{count, number};
use crate::render_settings::RenderSettings;
use crate::viewer::{Command, Comparison, Viewer};
use crate::worker::Layer;
use alhazen::{BackendChoice, RendererOptions, SamplerKind, ToneMapper};
use egui::{ComboBox, Slider, Ui};

const MAPPERS: [(ToneMapper, &str); 6] = [
    (ToneMapper::Srgb, "sRGB"),
    (ToneMapper::None, "none (linear)"),
    (ToneMapper::Reinhard, "Reinhard"),
    (ToneMapper::Aces, "ACES"),
    (ToneMapper::Agx, "AgX"),
    (ToneMapper::Neutral, "Khronos Neutral"),
];

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    backend(viewer, ui);
    ui.separator();
    let mut settings = viewer.render.clone();
    transport(ui, "main", &mut settings);
    size(viewer, ui, &mut settings);
    viewer.render = settings;
    ui.separator();
    display(viewer, ui);
    ui.separator();
    comparison(viewer, ui);
}

fn backend(viewer: &mut Viewer, ui: &mut Ui) {
    let mut options = viewer.backend.options.clone();
    ComboBox::from_label("Back end").selected_text(options.backend.name()).show_ui(ui, |ui| {
        for choice in BackendChoice::ALL {
            ui.selectable_value(&mut options.backend, choice, choice.name());
        }
    });
    if options.backend != BackendChoice::Cpu {
        let name = options.adapter.clone().unwrap_or_else(|| "best".into());
        ComboBox::from_label("Adapter").selected_text(name).show_ui(ui, |ui| {
            ui.selectable_value(&mut options.adapter, None, "best");
            if viewer.backend.adapters.is_empty() {
                // Drivers are asked when somebody looks: it may take a while.
                viewer.backend.adapters =
                    alhazen::gpu::adapters().iter().map(|a| a.info.name.clone()).collect();
            }
            for adapter in &viewer.backend.adapters {
                ui.selectable_value(&mut options.adapter, Some(adapter.clone()), adapter);
            }
        });
    } else {
        options.adapter = None;
    }
    if options != viewer.backend.options {
        viewer.switch_backend(RendererOptions { threads: viewer.backend.options.threads, ..options });
    }
    ui.label(format!("{}: {}", viewer.backend.name, viewer.backend.device));
    if !viewer.backend.reason.is_empty() {
        ui.weak(&viewer.backend.reason);
    }
}

/// How light is transported.
fn transport(ui: &mut Ui, salt: &str, s: &mut RenderSettings) {
    ui.push_id(salt, |ui| {
        let name = if s.direct { "direct" } else { "path" };
        ComboBox::from_label("Integrator").selected_text(name).show_ui(ui, |ui| {
            ui.selectable_value(&mut s.direct, false, "path");
            ui.selectable_value(&mut s.direct, true, "direct");
        });
        count(ui, "Samples per pixel", &mut s.spp, 1..=1_000_000);
        if s.direct {
            let d = &mut s.direct_settings;
            count(ui, "Shadow rays", &mut d.shadow_samples, 1..=256);
            ui.checkbox(&mut d.soft_shadows, "Soft shadows");
            count(ui, "Reflection rays", &mut d.reflection_samples, 0..=256);
            count(ui, "Ambient rays", &mut d.ambient_samples, 0..=256);
            if d.ambient_distance.is_finite() {
                number(ui, "Occluders up to (m)", &mut d.ambient_distance, 0.05, 0.0..=1e9);
            }
            count(ui, "Longest chain", &mut d.max_depth, 1..=64);
        } else {
            let p = &mut s.path_settings;
            count(ui, "Longest path", &mut p.max_depth, 1..=1000);
            count(ui, "Roulette from", &mut p.roulette_start, 0..=1000);
            ui.add(Slider::new(&mut p.roulette_min_survival, 0.01..=1.0).text("Least survival"));
            count(ui, "Splitting", &mut p.splitting, 1..=64);
        }
        ui.checkbox(&mut s.single_scatter, "glTF to the letter");
        let mut independent = s.sampler == SamplerKind::Independent;
        if ui.checkbox(&mut independent, "Independent samples").changed() {
            s.sampler = if independent { SamplerKind::Independent } else { SamplerKind::Sobol };
        }
        count(ui, "Seed", &mut s.seed, 0..=u32::MAX);
        ui.weak("Nothing is clamped.");
    });
}

fn size(viewer: &Viewer, ui: &mut Ui, s: &mut RenderSettings) {
    let mut fixed = s.size.is_some();
    if ui.checkbox(&mut fixed, "Fixed size").changed() {
        s.size = fixed.then(|| viewer.size());
    }
    if let Some([width, height]) = &mut s.size {
        count(ui, "Width", width, 16..=16_384);
        count(ui, "Height", height, 16..=16_384);
    }
}

fn display(viewer: &mut Viewer, ui: &mut Ui) {
    ComboBox::from_label("Layer").selected_text(viewer.shown.layer.name()).show_ui(ui, |ui| {
        for layer in Layer::all() {
            ui.selectable_value(&mut viewer.shown.layer, layer, layer.name());
        }
    });
    let tone = &mut viewer.shown.tone;
    let name = MAPPERS.iter().find(|(mapper, _)| *mapper == tone.mapper).map_or("", |(_, name)| name);
    ComboBox::from_label("Tone mapper").selected_text(name).show_ui(ui, |ui| {
        for (mapper, name) in MAPPERS {
            ui.selectable_value(&mut tone.mapper, mapper, name);
        }
    });
    let mut stops = tone.exposure.max(1e-9).log2();
    if ui.add(Slider::new(&mut stops, -10.0..=10.0).text("Exposure (stops)")).changed() {
        tone.exposure = stops.exp2();
    }
    ui.add(Slider::new(&mut tone.saturation, 0.0..=2.0).text("Saturation"));
    let mut has_false_colour = viewer.shown.false_colour.is_some();
    if ui.checkbox(&mut has_false_colour, "False colour").changed() {
        viewer.shown.false_colour = has_false_colour.then_some(6.0);
    }
    if let Some(stops) = &mut viewer.shown.false_colour {
        ui.add(Slider::new(stops, 1.0..=16.0).text("Stops around middle grey"));
    }
    if ui.button("Reset display").clicked() {
        viewer.reset_tone();
        (viewer.shown.layer, viewer.shown.false_colour) = (Layer::Picture, None);
    }
}

fn comparison(viewer: &mut Viewer, ui: &mut Ui) {
    ui.strong("Compare");
    ui.horizontal_wrapped(|ui| {
        for (name, command) in [
            ("Two settings", Command::CompareSettings),
            ("With now", Command::CompareNow),
            ("With a file…", Command::CompareFile),
            ("Nothing", Command::CompareNothing),
        ] {
            if ui.button(name).clicked() {
                viewer.run(command, &ui.ctx().clone());
            }
        }
    });
    match &mut viewer.comparison {
        Comparison::None => {}
        Comparison::Settings { settings, split } => {
            ui.add(Slider::new(split, 0.0..=1.0).text("Line"));
            ui.label("B");
            transport(ui, "other", settings);
        }
        Comparison::Stored { name, split, .. } => {
            ui.add(Slider::new(split, 0.0..=1.0).text("Line"));
            ui.label(format!("B: {name}"));
        }
    }
}
