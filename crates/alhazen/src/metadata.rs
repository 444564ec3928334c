//! What a picture's file says about how it was made.

use crate::Job;
use crate::exr_camera::{CAMERA_FRAME, camera_text};
use backend::Integrator;
use film::{Aov, Film};
use post::ToneMapping;
use scene::{Scene, ToneMapper};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Materials and instances whose names are told where there is no matte of them; the ids of further ones are only numbers.
const MOST_NAMES: usize = 1000;

/// Key of how the picture is shown.
const TONE_MAPPING: &str = "tone_mapping";

/// Keys of the lists of names.
const MATERIAL_NAMES: &str = "material_names";
const INSTANCE_NAMES: &str = "instance_names";

/// What of a scene goes into the files of its pictures.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Description {
    /// How the scene was named: a file or a built-in scene.
    pub scene: String,
    /// Its parameters, as they were given.
    pub parameters: Vec<(String, String)>,
    materials: Vec<String>,
    instances: Vec<String>,
    /// [`Scene::origin`], as text; empty if it is zero.
    origin: String,
}

impl Description {
    /// Describes `scene`, which the user called `name`.
    pub fn new(name: &str, parameters: &[(String, String)], scene: &Scene) -> Self {
        Self {
            scene: name.to_owned(),
            parameters: parameters.to_vec(),
            materials: scene.materials.iter().map(|m| m.name.clone()).collect(),
            instances: scene.instances.iter().map(|i| i.name.clone()).collect(),
            origin: if scene.origin == glam::DVec3::ZERO {
                String::new()
            } else {
                let glam::DVec3 { x, y, z } = scene.origin;
                format!("{x} {y} {z}")
            },
        }
    }

    /// Everything needed to make the picture `job` again, with the camera as it is at the beginning.
    pub fn settings(&self, job: &Job) -> BTreeMap<String, String> {
        self.settings_at(job, 0.0)
    }

    /// As [`Description::settings`], with the camera as it is at `time` seconds.
    pub fn settings_at(&self, job: &Job, time: f32) -> BTreeMap<String, String> {
        let pair = |k: &str, v: String| (k.to_owned(), v);
        let list = |names: &[String], matte: Aov| {
            let told = if job.aovs.contains(&matte) { names.len() } else { names.len().min(MOST_NAMES) };
            json_list(&names[..told])
        };
        let mut settings = BTreeMap::from([
            pair("software", software()),
            pair("scene", self.scene.clone()),
            pair("parameters", format!("{:?}", self.parameters)),
            pair("camera", format!("{:?}", job.camera)),
            pair(CAMERA_FRAME, camera_text(&job.view(time).camera)),
            pair("integrator", format!("{:?}", job.integrator)),
            pair("single_scatter", job.single_scatter.to_string()),
            pair("sampler", format!("{:?}", job.sampler)),
            pair("seed", job.seed.to_string()),
            pair("clamp", clamp(&job.integrator)),
            pair(TONE_MAPPING, format!("{:?}", job.tone)),
            pair(MATERIAL_NAMES, list(&self.materials, Aov::MaterialMatte)),
            pair(INSTANCE_NAMES, list(&self.instances, Aov::ObjectMatte)),
        ]);
        settings.extend(job.shutter.map(|shutter| pair("shutter", shutter.to_string())));
        // Positions in the file, the camera's too, are relative to it.
        if !self.origin.is_empty() {
            settings.extend([pair("scene_origin", self.origin.clone())]);
        }
        settings
    }
}

/// The settings of a picture and what became of them: all that its file says. `backends` are the names of those that have
/// worked on it, `render_time` is how long, all together.
pub fn metadata(
    settings: &BTreeMap<String, String>,
    film: &Film,
    spp: u32,
    backends: &BTreeSet<String>,
    render_time: Duration,
) -> BTreeMap<String, String> {
    let noise = film.relative_error().map_or("unknown".into(), |n| format!("{n:.5}"));
    let backends: Vec<&str> = backends.iter().map(String::as_str).collect();
    let taken = || film.pixels().iter().map(film::PixelStats::taken);
    let measured = [
        ("backend", backends.join(", ")),
        ("spp", spp.to_string()),
        ("render_seconds", format!("{:.3}", render_time.as_secs_f64())),
        ("noise", noise),
        ("least_samples", taken().min().unwrap_or(0).to_string()),
        ("most_samples", taken().max().unwrap_or(0).to_string()),
        ("invalid_samples", film.invalid_samples().to_string()),
    ];
    let mut all = settings.clone();
    all.extend(measured.map(|(k, v)| (k.to_owned(), v)));
    all
}

/// What of the light is limited, which biases the picture: "none", or "indirect" and the most that it may add.
fn clamp(integrator: &Integrator) -> String {
    match integrator {
        Integrator::Path(path) => {
            path.clamp_indirect.map_or("none".into(), |most| format!("indirect {most}"))
        }
        _ => "none".into(),
    }
}

/// How the picture of a file with this metadata is to be shown, if it says so.
pub(crate) fn tone_in(metadata: &BTreeMap<String, String>) -> Option<ToneMapping> {
    let text = metadata.get(TONE_MAPPING)?;
    let value = |key: &str| {
        let rest = text.split_once(&format!("{key}: "))?.1;
        rest.split([',', ' ', '}']).next()
    };
    let number = |key: &str| value(key)?.parse::<f32>().ok().filter(|n| n.is_finite());
    let named = value("mapper")?;
    let mapper = ToneMapper::ALL.into_iter().find(|mapper| format!("{mapper:?}") == named)?;
    Some(ToneMapping { mapper, exposure: number("exposure")?, saturation: number("saturation")? })
}

/// Name and version of this program.
pub fn software() -> String {
    format!("Alhazen {}", env!("CARGO_PKG_VERSION"))
}

/// The names that the metadata of a picture tell of what is in its matte `matte`, by id; none if they do not.
pub(crate) fn names_in(metadata: &BTreeMap<String, String>, matte: Aov) -> Vec<String> {
    let key = if matte == Aov::MaterialMatte { MATERIAL_NAMES } else { INSTANCE_NAMES };
    let list = metadata.get(key).and_then(|list| serde_json::from_str(list).ok());
    list.unwrap_or_default()
}

/// A list of names as JSON.
fn json_list(names: &[String]) -> String {
    serde_json::Value::from(names).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_mapping_is_read_back() {
        for mapper in ToneMapper::ALL {
            let tone = ToneMapping { mapper, exposure: 0.125, saturation: 1.5 };
            let metadata = BTreeMap::from([(TONE_MAPPING.to_owned(), format!("{tone:?}"))]);
            assert_eq!(tone_in(&metadata), Some(tone));
        }
        assert_eq!(tone_in(&BTreeMap::from([(TONE_MAPPING.to_owned(), "mapper: ".to_owned())])), None);
        assert_eq!(tone_in(&BTreeMap::new()), None);
    }
}
