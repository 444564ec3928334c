//! How the scene that the window opens with is looked at, where that is not left to the scene.

use super::state::Viewer;
use crate::loading;
use alhazen::EnvironmentPreset;
use alhazen::edits::{DaylightRecord, EnvironmentRecord};
use std::path::PathBuf;

/// What was asked for before the scene was there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FirstView {
    /// Name of the integrator.
    pub integrator: Option<String>,
    /// Samples per pixel after which the picture is done.
    pub spp: Option<u32>,
    /// Name or number of one of the scene's cameras.
    pub camera: Option<String>,
    /// Light from outside.
    pub environment: Option<FirstEnvironment>,
    /// Factor on radiance.
    pub exposure: Option<f32>,
}

/// Light from outside that was asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum FirstEnvironment {
    /// The same radiance everywhere, W·sr⁻¹·m⁻².
    Constant([f32; 3]),
    /// A clear sky with its sun.
    Daylight(DaylightRecord),
    /// One of ours.
    Preset(EnvironmentPreset),
    /// A panorama.
    File(PathBuf),
}

impl Viewer {
    /// Does what was asked for, once the first scene is there. What is not possible is said.
    pub(super) fn take_first_view(&mut self) {
        let Some(first) = self.first_view.take() else { return };
        if let Some(name) = first.integrator
            && !self.render.integrators.choose(&name)
        {
            self.notice(format!("there is no integrator `{name}`"), true);
        }
        self.render.spp = first.spp.unwrap_or(self.render.spp);
        self.shown.tone.exposure = first.exposure.unwrap_or(self.shown.tone.exposure);
        if let Some(name) = first.camera {
            self.look_through_named(&name);
        }
        let record = match first.environment {
            None => return,
            Some(FirstEnvironment::File(file)) => return self.load(loading::Job::Environment(file)),
            Some(FirstEnvironment::Constant(radiance)) => EnvironmentRecord::Constant { radiance },
            Some(FirstEnvironment::Preset(preset)) => EnvironmentRecord::from(preset),
            Some(FirstEnvironment::Daylight(daylight)) => EnvironmentRecord::Daylight(daylight),
        };
        self.edit("environment", |edits| edits.environment = Some(record));
    }

    /// Looks through one of the scene's cameras, by name or else by number.
    fn look_through_named(&mut self, name: &str) {
        let Some(document) = &self.document else { return };
        let cameras = &document.scene().cameras;
        let by_number = || name.parse().ok().filter(|i| *i < cameras.len());
        match cameras.iter().position(|camera| camera.name == name).or_else(by_number) {
            Some(index) => self.look_through_own(index),
            None => {
                let known: Vec<_> = cameras.iter().map(|camera| camera.name.as_str()).collect();
                self.notice(format!("there is no camera {name:?}; the scene has {known:?}"), true);
            }
        }
    }
}
