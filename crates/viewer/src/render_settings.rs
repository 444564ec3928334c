//! What the user may set about rendering.

use crate::integrators::Integrators;
use crate::worker::Shown;
use alhazen::{
    Adaptive, Camera, DirectSettings, FrameSamples, FrameView, HybridSettings, Integrator, Job, NoisyPicture,
    PathSettings, RealtimeSettings, Rect, RenderDefaults, SamplerKind, Sampling, ToneMapping, Visibility,
};

/// How light is transported, and how much of it.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Which integrator renders, and the settings of all.
    pub integrators: Integrators,
    /// Follow the BRDF of glTF 2.0, Appendix B, exactly.
    pub single_scatter: bool,
    /// How samples are drawn.
    pub sampler: SamplerKind,
    /// Changes the noise.
    pub seed: u32,
    /// Samples per pixel after which the picture is done; on average, where sampling is adaptive.
    pub spp: u32,
    /// How samples are spread over the picture.
    pub sampling: Sampling,
    /// The picture is done when its relative standard error is below this, in `(0, 1]`, even if it has fewer samples.
    pub noise: Option<f32>,
    /// Width and height in pixels; `None` fills the window.
    pub size: Option<[u32; 2]>,
    /// Only this part of the picture: left, top, right and bottom in shares of its size.
    pub crop: Option<[f32; 4]>,
}

impl RenderSettings {
    /// What a scene asks for.
    pub fn of(job: &Job, spp: Option<u32>) -> Self {
        Self {
            integrators: Integrators::with(job.integrator),
            single_scatter: job.single_scatter,
            sampler: job.sampler,
            seed: job.seed,
            spp: spp.unwrap_or(1024).max(1),
            sampling: Sampling::Uniform,
            noise: None,
            size: None,
            crop: None,
        }
    }

    /// The pixels of a picture of `width`×`height` that are rendered; `None` is all of them. They are at least one.
    pub fn crop_of(&self, [width, height]: [u32; 2]) -> Option<Rect> {
        let [left, top, right, bottom] = self.crop?;
        let span = |low: f32, high: f32, size: u32| {
            let edge = |share: f32| (share * size as f32).round() as u32;
            let low = edge(low).min(size - 1);
            (low, edge(high).clamp(low + 1, size) - low)
        };
        let ((x, width), (y, height)) = (span(left, right, width), span(top, bottom, height));
        Some(Rect { x, y, width, height })
    }

    /// The picture to render.
    ///
    /// - `size`: in pixels.
    /// - `shown`: what is shown of it; how its values become colours is no reason to begin anew, and left to `tone`.
    pub fn job(&self, camera: Camera, [width, height]: [u32; 2], shown: &Shown, tone: ToneMapping) -> Job {
        let mut aovs: Vec<_> = shown.layer.aov().into_iter().collect();
        if shown.denoiser.is_some() {
            aovs.extend(NoisyPicture::LAYERS.into_iter().filter(|layer| shown.layer.aov() != Some(*layer)));
        }
        let mut integrator = *self.integrators.chosen();
        if let Integrator::Realtime(settings) = &mut integrator {
            // Noise is judged as it is seen.
            settings.allocation.white = 1.0 / shown.tone.exposure.max(1e-6);
        }
        Job {
            camera,
            width,
            height,
            crop: self.crop_of([width, height]),
            // What depends on the first hit only needs no light.
            integrator: if shown.layer.is_geometric() { Integrator::Aov } else { integrator },
            single_scatter: self.single_scatter,
            sampler: self.sampler,
            seed: self.seed,
            aovs,
            tone,
            shutter: None,
        }
    }

    /// What a scene file says to be rendered like this.
    pub fn defaults(&self, [width, height]: [u32; 2], tone: &ToneMapping) -> RenderDefaults {
        RenderDefaults {
            width: Some(width),
            height: Some(height),
            spp: Some(self.spp),
            // Of paths; the others get theirs from the command line only.
            max_depth: Some(self.integrators.path().max_depth),
            integrator: Some(self.integrators.chosen().name().to_owned()),
            exposure: Some(tone.exposure),
            tonemap: Some(tone.mapper),
            saturation: Some(tone.saturation),
            ..RenderDefaults::default()
        }
    }

    /// Options of `alhazen render` for what scene files cannot say; empty where nothing is left to say.
    pub fn arguments(&self) -> String {
        let mut options = Options::default();
        let integrator = self.integrators.chosen();
        match integrator {
            Integrator::Path(p) => {
                let path = PathSettings::default();
                options.number("roulette-start", p.roulette_start, path.roulette_start);
                let (least, default) = (p.roulette_min_survival, path.roulette_min_survival);
                options.number("roulette-min-survival", least, default);
                options.number("splitting", p.splitting, path.splitting);
                options.number("mis", p.mis, path.mis);
            }
            Integrator::Direct(direct) => options.rays(direct, &DirectSettings::default()),
            Integrator::Hybrid(h) => {
                let hybrid = HybridSettings::default();
                options.rays(&h.rays, &hybrid.rays);
                options.flag("no-shadows", !h.shadows);
                options.flag("visibility rays", h.visibility == Visibility::Rays);
                options.number("light-cutoff", h.light_cutoff, hybrid.light_cutoff);
                options.number("reflection-survival", h.reflection_survival, hybrid.reflection_survival);
            }
            Integrator::Realtime(realtime) => options.frames(realtime),
            // The others have ambient occlusion at most.
            _ => {}
        }
        let usual = Integrator::from_name(integrator.name()).and_then(Integrator::ambient);
        if let (Some(ambient), Some(usual)) = (integrator.ambient(), usual) {
            options.number("ambient-samples", ambient.samples, usual.samples);
            options.number("ambient-distance", ambient.distance, usual.distance);
        }
        options.number("seed", self.seed, 0);
        options.flag("single-scatter", self.single_scatter);
        options.flag(&format!("sampler {}", self.sampler), self.sampler != SamplerKind::default());
        // Frames have their own way to choose pixels, and a film of theirs cannot tell its noise.
        if matches!(integrator, Integrator::Realtime(_)) {
            return options.0.join(" ");
        }
        if let Some(noise) = self.noise {
            options.number("noise", noise, 0.0);
        }
        match self.sampling {
            // With a limit of noise, the command line takes adaptive sampling unless it is told otherwise.
            Sampling::Uniform => options.flag("sampling uniform", self.noise.is_some()),
            Sampling::Adaptive(adaptive) => {
                options.flag("sampling adaptive", self.noise.is_none());
                options.number("min-spp", adaptive.min_spp, Adaptive::default().min_spp);
            }
        }
        options.0.join(" ")
    }
}

/// Options of a command line.
#[derive(Default)]
struct Options(Vec<String>);

impl Options {
    fn number<T: PartialEq + std::fmt::Display>(&mut self, name: &str, value: T, default: T) {
        if value != default {
            self.0.push(format!("--{name} {value}"));
        }
    }

    fn flag(&mut self, name: &str, given: bool) {
        if given {
            self.0.push(format!("--{name}"));
        }
    }

    fn rays(&mut self, d: &DirectSettings, default: &DirectSettings) {
        self.number("max-depth", d.max_depth, default.max_depth);
        self.number("shadow-samples", d.shadow_samples, default.shadow_samples);
        self.number("reflection-samples", d.reflection_samples, default.reflection_samples);
        self.flag("hard-shadows", !d.soft_shadows);
        self.flag(&format!("highlights {}", d.highlights.name()), d.highlights != default.highlights);
        let [c, l, q] = d.falloff;
        self.flag(&format!("falloff {c},{l},{q}"), d.falloff != default.falloff);
    }

    /// Those of `realtime`.
    fn frames(&mut self, r: &RealtimeSettings) {
        let d = RealtimeSettings::default();
        self.number("max-depth", r.path.max_depth, d.path.max_depth);
        self.flag("visibility rays", r.visibility == Visibility::Rays);
        if let Some(budget) = r.budget {
            self.flag(&format!("budget {}ms", budget.as_secs_f64() * 1e3), true);
        }
        let unsaid = if r.budget.is_some() { FrameSamples::ADAPTIVE } else { d.samples };
        self.number("frame-samples", r.samples, unsaid);
        self.number("light-candidates", r.light_candidates, d.light_candidates);
        let (a, default) = (&r.allocation, &d.allocation);
        self.number("frame-tolerance", a.tolerance, default.tolerance);
        self.number("noise-radius", a.noise_radius, default.noise_radius);
        self.number("blur-radius", a.blur_radius, default.blur_radius);
        self.number("refresh", a.refresh, default.refresh);
        let (h, default) = (&r.history, &d.history);
        self.number("depth-tolerance", h.depth_tolerance, default.depth_tolerance);
        self.number("normal-tolerance", h.normal_tolerance, default.normal_tolerance);
        self.number("history", h.most, default.most);
        self.number("history-clip", h.clip, default.clip);
        self.flag("no-filter", !r.filter);
        self.number("filter", r.spatial, d.spatial);
        self.number("filter-passes", r.filter_passes, d.filter_passes);
        self.number("show", r.show, FrameView::Picture);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::worker::Layer;
    use alhazen::{Aov, Denoiser, Highlights, Scene, SpatialFilter};
    use std::time::Duration;

    fn settings() -> RenderSettings {
        RenderSettings::of(&Job::for_scene(&Scene::default()), None)
    }

    #[test]
    fn what_a_file_says_is_rendered_again() {
        let mut s = settings();
        s.integrators.choose("direct");
        s.spp = 77;
        let tone = ToneMapping { exposure: 2.5, ..ToneMapping::default() };
        let scene = Scene { defaults: s.defaults([320, 200], &tone), ..Scene::default() };
        let job = Job::for_scene(&scene);
        assert_eq!((job.width, job.height, job.tone), (320, 200, tone));
        let again = RenderSettings::of(&job, scene.defaults.spp);
        assert_eq!(again, s);
        for integrator in Integrator::all() {
            assert!(s.integrators.choose(integrator.name()));
            let scene = Scene { defaults: s.defaults([320, 200], &tone), ..Scene::default() };
            let again = RenderSettings::of(&Job::for_scene(&scene), None);
            assert_eq!(again.integrators.chosen().name(), integrator.name());
        }
        s.integrators =
            Integrators::with(Integrator::Path(PathSettings { max_depth: 3, ..Default::default() }));
        let scene = Scene { defaults: s.defaults([320, 200], &tone), ..Scene::default() };
        assert_eq!(RenderSettings::of(&Job::for_scene(&scene), scene.defaults.spp), s);
    }

    #[test]
    fn the_command_line_says_the_rest() {
        let mut s = settings();
        assert_eq!(s.arguments(), "");
        let path = PathSettings { splitting: 4, ..PathSettings::default() };
        s.integrators = Integrators::with(Integrator::Path(path));
        (s.seed, s.single_scatter) = (9, true);
        assert_eq!(s.arguments(), "--splitting 4 --seed 9 --single-scatter");
        let mut direct = DirectSettings { soft_shadows: false, max_depth: 3, ..DirectSettings::default() };
        s.integrators = Integrators::with(Integrator::Direct(direct));
        assert_eq!(s.arguments(), "--max-depth 3 --hard-shadows --seed 9 --single-scatter");
        (direct.highlights, direct.falloff) = (Highlights::Phong, [1.0, 0.09, 0.032]);
        direct.ambient.set_distance(1.5);
        s.integrators = Integrators::with(Integrator::Direct(direct));
        (s.seed, s.single_scatter) = (0, false);
        assert_eq!(
            s.arguments(),
            "--max-depth 3 --hard-shadows --highlights phong --falloff 1,0.09,0.032 --ambient-distance 1.5"
        );
        let visibility = Visibility::Rays;
        let hybrid =
            HybridSettings { shadows: false, visibility, light_cutoff: 0.25, ..HybridSettings::default() };
        s.integrators = Integrators::with(Integrator::Hybrid(hybrid));
        assert_eq!(s.arguments(), "--no-shadows --visibility rays --light-cutoff 0.25");
    }

    #[test]
    fn the_command_line_says_how_frames_are_made() {
        let mut s = settings();
        s.integrators.choose("realtime");
        s.noise = Some(0.1);
        assert_eq!(s.arguments(), "");
        let r = s.integrators.realtime_mut().expect("one of each");
        (r.budget, r.samples) = (Some(Duration::from_micros(8500)), FrameSamples::ADAPTIVE);
        (r.history.most, r.filter, r.filter_passes, r.show) = (64.0, false, 3, FrameView::BlurredNoise);
        let said = "--budget 8.5ms --history 64 --no-filter --filter-passes 3 --show blurred-noise";
        assert_eq!(s.arguments(), said);
        let r = s.integrators.realtime_mut().expect("one of each");
        (r.budget, r.show, r.light_candidates) = (None, FrameView::Picture, 8);
        assert_eq!(
            s.arguments(),
            "--frame-samples 4..16 --light-candidates 8 --history 64 --no-filter --filter-passes 3"
        );
        let r = s.integrators.realtime_mut().expect("one of each");
        (r.samples, r.filter, r.spatial) = (FrameSamples { least: 1, most: 1 }, true, SpatialFilter::Learned);
        let said = "--light-candidates 8 --history 64 --filter learned --filter-passes 3";
        assert_eq!(s.arguments(), said);
    }

    /// What is dark on the screen may be noisy.
    #[test]
    fn frames_are_judged_as_they_are_seen() {
        let mut s = settings();
        s.integrators.choose("realtime");
        let tone = ToneMapping { exposure: 4.0, ..ToneMapping::default() };
        let shown = Shown { tone, ..Shown::default() };
        let job = s.job(Scene::default().default_camera(), [8, 8], &shown, ToneMapping::default());
        let Integrator::Realtime(settings) = job.integrator else { panic!("{:?}", job.integrator) };
        assert_eq!(settings.allocation.white, 0.25);
    }

    #[test]
    fn noise_and_sampling_are_said_as_the_command_line_understands_them() {
        let mut s = settings();
        s.sampling = Sampling::Adaptive(Adaptive { min_spp: 8, ..Adaptive::default() });
        assert_eq!(s.arguments(), "--sampling adaptive --min-spp 8");
        s.noise = Some(0.02);
        assert_eq!(s.arguments(), "--noise 0.02 --min-spp 8");
        s.sampling = Sampling::Uniform;
        assert_eq!(s.arguments(), "--noise 0.02 --sampling uniform");
    }

    #[test]
    fn layers_of_the_first_hit_transport_no_light() {
        let scene = Scene::default();
        let job = |layer, denoiser| {
            let shown = Shown { layer, denoiser, ..Shown::default() };
            settings().job(scene.default_camera(), [8, 8], &shown, ToneMapping::default())
        };
        assert_eq!(job(Layer::Aov(Aov::Depth), None).integrator, Integrator::Aov);
        assert!(matches!(job(Layer::Noise, None).integrator, Integrator::Path(_)));
        assert_eq!(job(Layer::Noise, None).aovs, [Aov::StandardError]);
        assert_eq!(job(Layer::Picture, Some(Denoiser::Network)).aovs, NoisyPicture::LAYERS);
        assert_eq!(
            job(Layer::Aov(Aov::DenoisingNormal), Some(Denoiser::Network)).aovs,
            [Aov::DenoisingNormal, Aov::Albedo]
        );
    }
}
