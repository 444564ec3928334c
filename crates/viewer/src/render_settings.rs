//! What the user may set about rendering.

use crate::worker::Layer;
use alhazen::{
    Camera, DirectSettings, Integrator, Job, PathSettings, RenderDefaults, SamplerKind, ToneMapping,
};

/// How light is transported, and how much of it.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Whether `direct` renders instead of `path`.
    pub direct: bool,
    /// For path tracing.
    pub path_settings: PathSettings,
    /// For `direct`.
    pub direct_settings: DirectSettings,
    /// Follow glTF to the letter.
    pub single_scatter: bool,
    /// How samples are drawn.
    pub sampler: SamplerKind,
    /// Changes the noise.
    pub seed: u32,
    /// Samples per pixel after which the picture is done.
    pub spp: u32,
    /// Width and height in pixels; `None` fills the window.
    pub size: Option<[u32; 2]>,
}

impl RenderSettings {
    /// What a scene asks for.
    pub fn of(job: &Job, spp: Option<u32>) -> Self {
        let mut settings = Self {
            direct: false,
            path_settings: PathSettings::default(),
            direct_settings: DirectSettings::default(),
            single_scatter: job.single_scatter,
            sampler: job.sampler,
            seed: job.seed,
            spp: spp.unwrap_or(1024).max(1),
            size: None,
        };
        match job.integrator {
            Integrator::Path(path) => settings.path_settings = path,
            Integrator::Direct(direct) => (settings.direct, settings.direct_settings) = (true, direct),
            // The same expected picture.
            Integrator::Hybrid(hybrid) => (settings.direct, settings.direct_settings) = (true, hybrid.rays),
            Integrator::Aov => {}
        }
        settings
    }

    /// How light is transported.
    pub fn integrator(&self) -> Integrator {
        if self.direct {
            Integrator::Direct(self.direct_settings)
        } else {
            Integrator::Path(self.path_settings)
        }
    }

    /// The picture to render.
    ///
    /// - `size`: in pixels.
    pub fn job(&self, camera: Camera, [width, height]: [u32; 2], layer: Layer, tone: ToneMapping) -> Job {
        Job {
            camera,
            width,
            height,
            crop: None,
            // What depends on the first hit only needs no light.
            integrator: if layer.is_geometric() { Integrator::Aov } else { self.integrator() },
            single_scatter: self.single_scatter,
            sampler: self.sampler,
            seed: self.seed,
            aovs: layer.aov().into_iter().collect(),
            tone,
        }
    }

    /// What a scene file says to be rendered like this.
    pub fn defaults(&self, [width, height]: [u32; 2], tone: &ToneMapping) -> RenderDefaults {
        RenderDefaults {
            width: Some(width),
            height: Some(height),
            spp: Some(self.spp),
            // Of paths; `direct` gets its own from the command line only.
            max_depth: Some(self.path_settings.max_depth),
            integrator: Some(self.integrator().name().to_owned()),
            exposure: Some(tone.exposure),
            tonemap: Some(tone.mapper),
            saturation: Some(tone.saturation),
        }
    }

    /// Options of `alhazen render` for what scene files cannot say; empty where nothing is left to say.
    pub fn arguments(&self) -> String {
        let (path, direct) = (PathSettings::default(), DirectSettings::default());
        let (p, d) = (&self.path_settings, &self.direct_settings);
        let mut options = Vec::new();
        let mut number = |is_default: bool, name: &str, value: u32| {
            if !is_default {
                options.push(format!("--{name} {value}"));
            }
        };
        if self.direct {
            number(d.max_depth == direct.max_depth, "max-depth", d.max_depth);
            number(d.shadow_samples == direct.shadow_samples, "shadow-samples", d.shadow_samples);
            number(
                d.reflection_samples == direct.reflection_samples,
                "reflection-samples",
                d.reflection_samples,
            );
            number(d.ambient_samples == direct.ambient_samples, "ambient-samples", d.ambient_samples);
        } else {
            number(p.roulette_start == path.roulette_start, "roulette-start", p.roulette_start);
            number(p.splitting == path.splitting, "splitting", p.splitting);
        }
        number(self.seed == 0, "seed", self.seed);
        if self.direct && !d.soft_shadows {
            options.push("--hard-shadows".into());
        }
        if self.single_scatter {
            options.push("--single-scatter".into());
        }
        if self.sampler == SamplerKind::Independent {
            options.push("--sampler independent".into());
        }
        options.join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::Scene;

    fn settings() -> RenderSettings {
        RenderSettings::of(&Job::for_scene(&Scene::default()), None)
    }

    #[test]
    fn what_a_file_says_is_rendered_again() {
        let mut s = settings();
        (s.direct, s.spp) = (true, 77);
        let tone = ToneMapping { exposure: 2.5, ..ToneMapping::default() };
        let scene = Scene { defaults: s.defaults([320, 200], &tone), ..Scene::default() };
        let job = Job::for_scene(&scene);
        assert_eq!((job.width, job.height, job.tone), (320, 200, tone));
        let again = RenderSettings::of(&job, scene.defaults.spp);
        assert_eq!(again, s);
        (s.direct, s.path_settings.max_depth) = (false, 3);
        let scene = Scene { defaults: s.defaults([320, 200], &tone), ..Scene::default() };
        assert_eq!(RenderSettings::of(&Job::for_scene(&scene), scene.defaults.spp), s);
    }

    #[test]
    fn the_command_line_says_the_rest() {
        let mut s = settings();
        assert_eq!(s.arguments(), "");
        (s.path_settings.splitting, s.seed, s.single_scatter) = (4, 9, true);
        assert_eq!(s.arguments(), "--splitting 4 --seed 9 --single-scatter");
        s.direct = true;
        (s.direct_settings.soft_shadows, s.direct_settings.max_depth) = (false, 3);
        assert_eq!(s.arguments(), "--max-depth 3 --seed 9 --hard-shadows --single-scatter");
    }

    #[test]
    fn layers_of_the_first_hit_transport_no_light() {
        let scene = Scene::default();
        let job = |layer| settings().job(scene.default_camera(), [8, 8], layer, ToneMapping::default());
        assert_eq!(job(Layer::Aov(alhazen::Aov::Depth)).integrator, Integrator::Aov);
        assert!(matches!(job(Layer::Noise).integrator, Integrator::Path(_)));
        assert_eq!(job(Layer::Noise).aovs, [alhazen::Aov::StandardError]);
    }
}
