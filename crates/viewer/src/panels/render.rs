//! Back end, integrator, sampling, display and comparison.

use super::widgets::{check, choice, count, number, section, slider, told};
use crate::render_settings::RenderSettings;
use crate::viewer::Viewer;
use crate::worker::{Channels, Layer};
use alhazen::{
    Adaptive, AmbientOcclusion, BackendChoice, Denoiser, DirectSettings, Highlights, HybridSettings,
    INVERSE_SQUARE, Integrator, Mis, RendererOptions, SamplerKind, Sampling, ToneMapper, Visibility,
};
use egui::Ui;

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
    section(ui, "Device", |ui| backend(viewer, ui));
    super::output::presets(viewer, ui);
    let mut settings = viewer.render.clone();
    let on_gpu = viewer.backend.name.starts_with("gpu");
    section(ui, "Light transport", |ui| transport(ui, "main", on_gpu, &mut settings));
    // Frames choose their pixels themselves.
    if !matches!(settings.integrators.chosen(), Integrator::Realtime(_)) {
        section(ui, "Adaptive sampling and noise", |ui| sampling(viewer, ui, &mut settings));
    }
    section(ui, "Resolution", |ui| size(viewer, ui, &mut settings));
    viewer.render = settings;
    section(ui, "Display", |ui| display(viewer, ui));
    section(ui, "Render to a file", |ui| super::output::show(viewer, ui));
}

fn backend(viewer: &mut Viewer, ui: &mut Ui) {
    let mut options = viewer.backend.options.clone();
    choice(ui, "Back end", options.backend.name(), |ui| {
        for backend in BackendChoice::ALL {
            ui.selectable_value(&mut options.backend, backend, backend.name());
        }
    });
    if options.backend != BackendChoice::Cpu {
        let name = options.adapter.clone().unwrap_or_else(|| "best".into());
        choice(ui, "Adapter", &name, |ui| {
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
    told(ui, "Active device", format!("{}: {}", viewer.backend.name, viewer.backend.device));
    if !viewer.backend.reason.is_empty() {
        ui.weak(&viewer.backend.reason);
    }
}

/// The integrator and its settings.
pub(super) fn transport(ui: &mut Ui, salt: &str, on_gpu: bool, s: &mut RenderSettings) {
    ui.push_id(salt, |ui| {
        let mut name = s.integrators.chosen().name();
        choice(ui, "Integrator", name, |ui| {
            // Without a GPU, `hybrid` is another name of `direct`, and `realtime` of `path`.
            for integrator in s.integrators.iter().filter(|i| on_gpu || !i.makes_frames()) {
                ui.selectable_value(&mut name, integrator.name(), integrator.name());
            }
        });
        s.integrators.choose(name);
        let is_realtime = matches!(s.integrators.chosen(), Integrator::Realtime(_));
        let samples = if is_realtime { "Maximum frames" } else { "Samples per pixel" };
        count(ui, samples, &mut s.spp, 1..=1_000_000);
        let integrator = s.integrators.chosen_mut();
        match integrator {
            Integrator::Direct(direct) => rays(ui, direct),
            Integrator::Hybrid(settings) => hybrid(ui, settings),
            Integrator::Realtime(realtime) => {
                super::frames::show(ui, realtime);
                if !on_gpu {
                    ui.weak("Real-time frames need a GPU. The CPU renders `path` instead.");
                }
            }
            Integrator::Path(p) => {
                count(ui, "Maximum depth", &mut p.max_depth, 1..=1000);
                count(ui, "Russian roulette: start depth", &mut p.roulette_start, 0..=1000);
                let label = "Russian roulette: minimum survival probability";
                slider(ui, label, &mut p.roulette_min_survival, 0.01..=1.0);
                count(ui, "Splitting", &mut p.splitting, 1..=64);
                choice(ui, "Multiple importance sampling", p.mis.name(), |ui| {
                    for mis in Mis::ALL {
                        ui.selectable_value(&mut p.mis, mis, mis.name());
                    }
                });
            }
            // The others have ambient occlusion at most.
            _ => {}
        }
        if let Some(ambient) = integrator.ambient_mut() {
            occlusion(ui, ambient);
        }
        check(ui, "Strict glTF BRDF (single scattering)", &mut s.single_scatter);
        choice(ui, "Sampler", s.sampler.name(), |ui| {
            for sampler in SamplerKind::ALL {
                ui.selectable_value(&mut s.sampler, sampler, sampler.name());
            }
        });
        count(ui, "Seed", &mut s.seed, 0..=u32::MAX);
        told(ui, "Clamping", "none");
    });
}

/// Settings of `direct`.
fn rays(ui: &mut Ui, d: &mut DirectSettings) {
    count(ui, "Shadow rays", &mut d.shadow_samples, 1..=256);
    check(ui, "Soft shadows", &mut d.soft_shadows);
    count(ui, "Reflection rays", &mut d.reflection_samples, 0..=256);
    count(ui, "Maximum specular depth", &mut d.max_depth, 1..=64);
    let mut phong = d.highlights == Highlights::Phong;
    if check(ui, "Phong highlights", &mut phong) {
        d.highlights = if phong { Highlights::Phong } else { Highlights::Microfacets };
    }
    falloff(ui, &mut d.falloff);
}

/// Rays of ambient occlusion, and how far they reach.
fn occlusion(ui: &mut Ui, ambient: &mut AmbientOcclusion) {
    count(ui, "Ambient occlusion rays", &mut ambient.samples, 0..=256);
    let mut limited = ambient.distance.is_finite();
    if check(ui, "Limited ambient occlusion", &mut limited) {
        ambient.set_distance(if limited { 1.0 } else { 0.0 });
    }
    if limited {
        number(ui, "Ambient occlusion distance (m)", &mut ambient.distance, 0.05, 1e-3..=1e9);
    }
}

/// Attenuation of local lights with distance.
fn falloff(ui: &mut Ui, coefficients: &mut [f32; 3]) {
    let mut own = *coefficients != INVERSE_SQUARE;
    if check(ui, "Custom light attenuation", &mut own) {
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

/// Settings of `hybrid`.
fn hybrid(ui: &mut Ui, h: &mut HybridSettings) {
    check(ui, "Shadows", &mut h.shadows);
    rays(ui, &mut h.rays);
    number(ui, "Light cutoff (W/m²)", &mut h.light_cutoff, 1e-3, 0.0..=1e6);
    slider(ui, "Reflections: minimum survival probability", &mut h.reflection_survival, 0.01..=1.0);
    let mut raster = h.visibility == Visibility::Raster;
    if check(ui, "Rasterised first hits", &mut raster) {
        h.visibility = if raster { Visibility::Raster } else { Visibility::Rays };
    }
}

/// Adaptive sampling and the noise limit.
fn sampling(viewer: &Viewer, ui: &mut Ui, s: &mut RenderSettings) {
    let mut is_adaptive = matches!(s.sampling, Sampling::Adaptive(_));
    if check(ui, "Adaptive sampling", &mut is_adaptive) {
        s.sampling = if is_adaptive { Sampling::Adaptive(Adaptive::default()) } else { Sampling::Uniform };
    }
    if let Sampling::Adaptive(adaptive) = &mut s.sampling {
        count(ui, "Minimum samples per pixel", &mut adaptive.min_spp, 2..=65_536);
        if viewer.comparison.split().is_some() {
            ui.weak("While two settings are compared, sampling is uniform.");
        }
    }
    let mut has_limit = s.noise.is_some();
    if check(ui, "Noise limit", &mut has_limit) {
        s.noise = has_limit.then_some(0.02);
    }
    if let Some(noise) = &mut s.noise {
        number(ui, "Relative standard error", noise, 1e-4, 1e-4..=1.0);
        if let Some(now) = viewer.shot().and_then(|shot| shot.pass.noise) {
            told(ui, "Current standard error", format!("{now:.4}"));
        }
    }
}

/// The denoiser.
fn denoiser(viewer: &mut Viewer, ui: &mut Ui) {
    let mut denoises = viewer.shown.denoiser.is_some();
    if check(ui, "Denoise", &mut denoises) {
        viewer.shown.denoiser = denoises.then_some(Denoiser::Network);
    }
    if let Some(denoiser) = &mut viewer.shown.denoiser {
        let name = |d: Denoiser| match d {
            Denoiser::Network => "network",
            Denoiser::Regression => "regression",
            Denoiser::Oidn => "Open Image Denoise",
        };
        choice(ui, "Denoiser", name(*denoiser), |ui| {
            for kind in [Denoiser::Network, Denoiser::Regression, Denoiser::Oidn] {
                ui.selectable_value(denoiser, kind, name(kind));
            }
        });
    }
    if let Some(by) = viewer.shot().and_then(|shot| shot.pass.denoised_by.as_ref()) {
        told(ui, "Denoised by", by.as_str());
    }
}

fn size(viewer: &Viewer, ui: &mut Ui, s: &mut RenderSettings) {
    let mut fixed = s.size.is_some();
    if check(ui, "Fixed resolution", &mut fixed) {
        s.size = fixed.then(|| viewer.size());
    }
    if let Some([width, height]) = &mut s.size {
        count(ui, "Width (pixels)", width, 16..=16_384);
        count(ui, "Height (pixels)", height, 16..=16_384);
    }
}

fn display(viewer: &mut Viewer, ui: &mut Ui) {
    choice(ui, "Layer", viewer.shown.layer.name(), |ui| {
        for layer in Layer::all() {
            ui.selectable_value(&mut viewer.shown.layer, layer, layer.name());
        }
    });
    let channels = &mut viewer.shown.channels;
    choice(ui, "Channels", channels.name(), |ui| {
        for one in Channels::ALL {
            ui.selectable_value(channels, one, one.name());
        }
    });
    denoiser(viewer, ui);
    let tone = &mut viewer.shown.tone;
    let name = MAPPERS.iter().find(|(mapper, _)| *mapper == tone.mapper).map_or("", |(_, name)| name);
    choice(ui, "Tone mapper", name, |ui| {
        for (mapper, name) in MAPPERS {
            ui.selectable_value(&mut tone.mapper, mapper, name);
        }
    });
    let mut stops = tone.exposure.max(1e-9).log2();
    if slider(ui, "Exposure (stops)", &mut stops, -10.0..=10.0) {
        tone.exposure = stops.exp2();
    }
    slider(ui, "Saturation", &mut tone.saturation, 0.0..=2.0);
    let mut has_false_colour = viewer.shown.false_colour.is_some();
    if check(ui, "False colour", &mut has_false_colour) {
        viewer.shown.false_colour = has_false_colour.then_some(6.0);
    }
    if let Some(stops) = &mut viewer.shown.false_colour {
        slider(ui, "False colour range (stops)", stops, 1.0..=16.0);
    }
    if ui.button("Reset display").clicked() {
        viewer.reset_tone();
        (viewer.shown.layer, viewer.shown.false_colour) = (Layer::Picture, None);
        viewer.shown.channels = Channels::All;
    }
}
