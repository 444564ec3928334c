//! What the page can set, by the names of the command line's options.

use alhazen::{Integrator, Job, Mis, PathSettings, SamplerKind, ToneMapper};
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::Error;
use std::collections::BTreeMap;

/// A setting that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} cannot be {value:?}: {reason}")]
pub struct SettingError {
    /// Which setting.
    pub name: String,
    /// What it was to be.
    pub value: String,
    /// What is wrong with that.
    pub reason: String,
}

/// One setting.
#[derive(Clone, Debug, PartialEq)]
pub enum Setting {
    /// `path`, `direct`, `ao` or `aov`.
    Integrator(Integrator),
    /// Longest path in segments.
    MaxDepth(u32),
    /// Paths shorter than this never meet Russian roulette.
    RouletteStart(u32),
    /// Paths that go on from the first vertex.
    Splitting(u32),
    /// How the two ways to find light are weighted.
    Mis(Mis),
    /// How samples are drawn.
    Sampler(SamplerKind),
    /// Whether light that is scattered several times within a rough surface is left out.
    SingleScatter(bool),
    /// Changes the noise.
    Seed(u32),
    /// Factor on radiance.
    Exposure(f32),
    /// The curve.
    ToneMapper(ToneMapper),
}

impl Setting {
    /// Reads a setting from its name and value, as the command line has them.
    ///
    /// # Errors
    /// For names and values that do not exist.
    pub fn parse(name: &str, value: &str) -> Result<Self, SettingError> {
        let bad = |reason: String| SettingError { name: name.into(), value: value.into(), reason };
        let number = |low: u32, high: u32| {
            let number = value.parse().ok().filter(|n| (low..=high).contains(n));
            number.ok_or_else(|| bad(format!("give a whole number, {low} to {high}")))
        };
        Ok(match name {
            "integrator" => Self::Integrator(
                Integrator::from_name(value)
                    .filter(|found| !matches!(found, Integrator::Hybrid(_) | Integrator::Realtime(_)))
                    .ok_or_else(|| bad("there are path, direct, ao, aov".into()))?,
            ),
            "max-depth" => Self::MaxDepth(number(1, 4096)?),
            "roulette-start" => Self::RouletteStart(number(1, 4096)?),
            "splitting" => Self::Splitting(number(1, 64)?),
            "mis" => Self::Mis(value.parse().map_err(bad)?),
            "sampler" => Self::Sampler(value.parse().map_err(bad)?),
            "single-scatter" => {
                Self::SingleScatter(value.parse().map_err(|_| bad("there are true and false".into()))?)
            }
            "seed" => Self::Seed(number(0, u32::MAX)?),
            "exposure" => {
                let exposure = value.parse().ok().filter(|e: &f32| e.is_finite() && *e > 0.0);
                Self::Exposure(exposure.ok_or_else(|| bad("give a positive number".into()))?)
            }
            "tonemap" => {
                let mapper = ToneMapper::deserialize(IntoDeserializer::<Error>::into_deserializer(value));
                Self::ToneMapper(mapper.map_err(|e| bad(e.to_string()))?)
            }
            _ => return Err(bad("there is no such setting".into())),
        })
    }

    /// Makes it part of a job. Settings of paths make paths of what was something else.
    pub fn apply(&self, job: &mut Job) {
        match *self {
            Self::Integrator(integrator) => job.integrator = integrator,
            Self::MaxDepth(depth) => with_path(job, |path| path.max_depth = depth),
            Self::RouletteStart(start) => with_path(job, |path| path.roulette_start = start),
            Self::Splitting(paths) => with_path(job, |path| path.splitting = paths),
            Self::Mis(mis) => with_path(job, |path| path.mis = mis),
            Self::Sampler(sampler) => job.sampler = sampler,
            Self::SingleScatter(single) => job.single_scatter = single,
            Self::Seed(seed) => job.seed = seed,
            Self::Exposure(exposure) => job.tone.exposure = exposure,
            Self::ToneMapper(mapper) => job.tone.mapper = mapper,
        }
    }
}

/// What a job's settings are, by their names: what the page's controls show.
pub(crate) fn settings_of(job: &Job) -> BTreeMap<&'static str, String> {
    let path = match job.integrator {
        Integrator::Path(path) => path,
        _ => PathSettings::default(),
    };
    let mapper = serde_json::to_value(job.tone.mapper).unwrap_or_default();
    BTreeMap::from([
        ("integrator", job.integrator.name().to_owned()),
        ("max-depth", path.max_depth.to_string()),
        ("roulette-start", path.roulette_start.to_string()),
        ("splitting", path.splitting.to_string()),
        ("mis", path.mis.name().to_owned()),
        ("sampler", job.sampler.name().to_owned()),
        ("single-scatter", job.single_scatter.to_string()),
        ("exposure", job.tone.exposure.to_string()),
        ("tonemap", mapper.as_str().unwrap_or_default().to_owned()),
    ])
}

/// Changes the settings of paths, which are the usual ones where the job had another integrator.
fn with_path(job: &mut Job, change: impl FnOnce(&mut PathSettings)) {
    let mut path = match job.integrator {
        Integrator::Path(path) => path,
        _ => PathSettings::default(),
    };
    change(&mut path);
    job.integrator = Integrator::Path(path);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_job_has_can_be_set() {
        let scene = alhazen::Scene::default();
        let camera = alhazen::Camera::perspective("", glam::Vec3::Z, glam::Vec3::ZERO, 1.0);
        let mut job = Job::by_camera(&scene, camera, 8, 8);
        let before = job.clone();
        for (name, value) in settings_of(&job) {
            Setting::parse(name, &value).expect(name).apply(&mut job);
        }
        assert_eq!(job, before);
    }

    #[test]
    fn settings_have_the_names_of_the_command_line() {
        let parse = |name: &str, value: &str| Setting::parse(name, value);
        assert_eq!(parse("mis", "light"), Ok(Setting::Mis(Mis::Light)));
        assert_eq!(parse("tonemap", "agx"), Ok(Setting::ToneMapper(ToneMapper::Agx)));
        assert_eq!(parse("sampler", "independent"), Ok(Setting::Sampler(SamplerKind::Independent)));
        for (name, value) in [
            ("mis", "both"),
            ("max-depth", "0"),
            ("exposure", "-1"),
            ("exposure", "inf"),
            ("integrator", "realtime"),
            ("tonemap", "sepia"),
            ("colour", "red"),
        ] {
            let error = parse(name, value).expect_err(name);
            assert!(error.to_string().contains(name) && error.to_string().contains(value), "{error}");
        }
    }
}
