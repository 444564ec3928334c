//! What is rendered, by what, and how it is shown.

use super::{count, number};
use crate::render_settings::{RenderSettings, Transport};
use crate::viewer::{Command, Comparison, Viewer};
use crate::worker::Layer;
use alhazen::{
    Adaptive, BackendChoice, Denoiser, DirectSettings, Highlights, HybridSettings, INVERSE_SQUARE,
    RendererOptions, SamplerKind, Sampling, ToneMapper, Visibility,
};
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
    let on_gpu = viewer.backend.name.starts_with("gpu");
    transport(ui, "main", on_gpu, &mut settings);
    // Frames choose their pixels themselves.
    if settings.transport != Transport::Realtime {
        sampling(viewer, ui, &mut settings);
    }
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
fn transport(ui: &mut Ui, salt: &str, on_gpu: bool, s: &mut RenderSettings) {
    ui.push_id(salt, |ui| {
        ComboBox::from_label("Integrator").selected_text(s.transport.name()).show_ui(ui, |ui| {
            // Without a GPU, `hybrid` is another name of `direct`, and `realtime` of `path`.
            for choice in Transport::ALL.into_iter().filter(|t| on_gpu || !t.makes_frames()) {
                ui.selectable_value(&mut s.transport, choice, choice.name());
            }
        });
        let is_realtime = s.transport == Transport::Realtime;
        let samples = if is_realtime { "Frames of a view" } else { "Samples per pixel" };
        count(ui, samples, &mut s.spp, 1..=1_000_000);
        match s.transport {
            Transport::Direct => rays(ui, &mut s.direct_settings),
            Transport::Hybrid => hybrid(ui, &mut s.hybrid_settings),
            Transport::Realtime => {
                super::frames::show(ui, &mut s.realtime_settings);
                if !on_gpu {
                    ui.weak("Frames need a GPU. The CPU shows what they come near: `path`.");
                }
            }
            Transport::Path => {
                let p = &mut s.path_settings;
                count(ui, "Longest path", &mut p.max_depth, 1..=1000);
                count(ui, "Roulette from", &mut p.roulette_start, 0..=1000);
                ui.add(Slider::new(&mut p.roulette_min_survival, 0.01..=1.0).text("Least survival"));
                count(ui, "Splitting", &mut p.splitting, 1..=64);
            }
        }
        ui.checkbox(&mut s.single_scatter, "glTF to the letter");
        ComboBox::from_label("Samples").selected_text(s.sampler.name()).show_ui(ui, |ui| {
            for choice in SamplerKind::ALL {
                ui.selectable_value(&mut s.sampler, choice, choice.name());
            }
        });
        count(ui, "Seed", &mut s.seed, 0..=u32::MAX);
        ui.weak("Nothing is clamped.");
    });
}

/// Rays for each effect.
fn rays(ui: &mut Ui, d: &mut DirectSettings) {
    count(ui, "Shadow rays", &mut d.shadow_samples, 1..=256);
    ui.checkbox(&mut d.soft_shadows, "Soft shadows");
    count(ui, "Reflection rays", &mut d.reflection_samples, 0..=256);
    count(ui, "Ambient rays", &mut d.ambient_samples, 0..=256);
    if d.ambient_distance.is_finite() {
        number(ui, "Occluders up to (m)", &mut d.ambient_distance, 0.05, 0.0..=1e9);
    }
    count(ui, "Longest chain", &mut d.max_depth, 1..=64);
    let mut phong = d.highlights == Highlights::Phong;
    if ui.checkbox(&mut phong, "Phong's highlights").changed() {
        d.highlights = if phong { Highlights::Phong } else { Highlights::Microfacets };
    }
    falloff(ui, &mut d.falloff);
}

/// How light fades with distance.
fn falloff(ui: &mut Ui, coefficients: &mut [f32; 3]) {
    let mut own = *coefficients != INVERSE_SQUARE;
    if ui.checkbox(&mut own, "Lights fade by a law of their own").changed() {
        // What tutorials of real-time graphics use for some tens of metres.
        *coefficients = if own { [1.0, 0.09, 0.032] } else { INVERSE_SQUARE };
    }
    if own {
        let before = *coefficients;
        for (label, c) in ["Constant", "Linear (1/m)", "Quadratic (1/m²)"].into_iter().zip(&mut *coefficients)
        {
            number(ui, label, c, 1e-3, 0.0..=1e6);
        }
        if coefficients.iter().all(|c| *c <= 0.0) {
            *coefficients = before;
        }
    }
}

/// What frames are made of.
fn hybrid(ui: &mut Ui, h: &mut HybridSettings) {
    ui.checkbox(&mut h.shadows, "Shadows");
    rays(ui, &mut h.rays);
    number(ui, "Lights count from (W/m²)", &mut h.light_cutoff, 1e-3, 0.0..=1e6);
    ui.add(Slider::new(&mut h.reflection_survival, 0.01..=1.0).text("Least share of reflections"));
    let mut raster = h.visibility == Visibility::Raster;
    if ui.checkbox(&mut raster, "First hits by the rasteriser").changed() {
        h.visibility = if raster { Visibility::Raster } else { Visibility::Rays };
    }
}

/// Which pixels get samples, and how many are enough.
fn sampling(viewer: &Viewer, ui: &mut Ui, s: &mut RenderSettings) {
    let mut is_adaptive = matches!(s.sampling, Sampling::Adaptive(_));
    if ui.checkbox(&mut is_adaptive, "More samples where the error is").changed() {
        s.sampling = if is_adaptive { Sampling::Adaptive(Adaptive::default()) } else { Sampling::Uniform };
    }
    if let Sampling::Adaptive(adaptive) = &mut s.sampling {
        count(ui, "Samples of every pixel", &mut adaptive.min_spp, 2..=65_536);
        if viewer.comparison.split().is_some() {
            ui.weak("Pictures that take turns get the same samples everywhere.");
        }
    }
    let mut has_limit = s.noise.is_some();
    if ui.checkbox(&mut has_limit, "Done when the noise is low").changed() {
        s.noise = has_limit.then_some(0.02);
    }
    if let Some(noise) = &mut s.noise {
        number(ui, "Relative error", noise, 1e-4, 1e-4..=1.0);
        if let Some(now) = viewer.shot().and_then(|shot| shot.pass.noise) {
            ui.label(format!("now {now:.4}"));
        }
    }
}

/// What takes the noise out.
fn denoiser(viewer: &mut Viewer, ui: &mut Ui) {
    let mut denoises = viewer.shown.denoiser.is_some();
    if ui.checkbox(&mut denoises, "Denoise when done").changed() {
        viewer.shown.denoiser = denoises.then_some(Denoiser::Auto);
    }
    if let Some(denoiser) = &mut viewer.shown.denoiser {
        let name = |d: Denoiser| match d {
            Denoiser::Auto => "best that is here",
            Denoiser::Own => "our own",
            Denoiser::Oidn => "Open Image Denoise",
        };
        ComboBox::from_label("Denoiser").selected_text(name(*denoiser)).show_ui(ui, |ui| {
            for choice in [Denoiser::Auto, Denoiser::Own, Denoiser::Oidn] {
                ui.selectable_value(denoiser, choice, name(choice));
            }
        });
    }
    if let Some(by) = viewer.shot().and_then(|shot| shot.pass.denoised_by.as_ref()) {
        ui.weak(format!("without its noise: {by}"));
    }
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
    denoiser(viewer, ui);
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
            let on_gpu = viewer.backend.name.starts_with("gpu");
            transport(ui, "other", on_gpu, settings);
        }
        Comparison::Stored { name, split, .. } => {
            ui.add(Slider::new(split, 0.0..=1.0).text("Line"));
            ui.label(format!("B: {name}"));
        }
    }
}
