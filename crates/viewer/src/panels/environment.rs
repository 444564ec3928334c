//! Light from infinitely far away: a colour, a sky with a sun, or a picture.

use super::lights::degrees;
use super::widgets::{bright_colour, check, choice, number, row, told, vector};
use crate::viewer::{For, Viewer};
use alhazen::EnvironmentPreset;
use alhazen::edits::{DaylightRecord, EnvironmentRecord, SkyRecord, SunRecord};
use egui::Ui;

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(document) = &viewer.document else { return };
    let original = EnvironmentRecord::from(&document.unchanged().environment);
    let before = document.edits().environment.clone().unwrap_or_else(|| original.clone());
    let mut environment = before.clone();
    choice(ui, "Environment", kind(&before), |ui| {
        if matches!(original, EnvironmentRecord::Own { .. }) {
            ui.selectable_value(&mut environment, original.clone(), kind(&original));
        }
        let sky = if let EnvironmentRecord::Sky(sky) = &before { *sky } else { clear_sky() };
        let daylight = if let EnvironmentRecord::Daylight(d) = &before { *d } else { AFTERNOON };
        for other in [
            EnvironmentRecord::Black,
            EnvironmentRecord::Constant { radiance: [1.0; 3] },
            EnvironmentPreset::Studio.into(),
            EnvironmentRecord::Sky(sky),
            EnvironmentRecord::Daylight(daylight),
        ] {
            ui.selectable_value(&mut environment, other.clone(), kind(&other));
        }
    });
    row(ui, "Ready-made", |ui, _| {
        for preset in EnvironmentPreset::ALL {
            if ui.button(preset.name()).on_hover_text(preset.about()).clicked() {
                environment = preset.into();
            }
        }
    });
    if ui.button("Environment map from a file…").clicked() {
        viewer.ask_for(For::Environment);
    }
    match &mut environment {
        EnvironmentRecord::Black => {}
        EnvironmentRecord::Constant { radiance } => {
            bright_colour(ui, "Radiance", radiance, " W/sr/m²");
        }
        EnvironmentRecord::Own { rotation, intensity }
        | EnvironmentRecord::Studio { rotation, intensity } => {
            picture(ui, rotation, intensity);
        }
        EnvironmentRecord::File { file, rotation, intensity } => {
            told(ui, "File", file.display().to_string());
            picture(ui, rotation, intensity);
        }
        EnvironmentRecord::Sky(sky) => sky_and_sun(ui, sky),
        EnvironmentRecord::Daylight(daylight) => clear_daylight(ui, daylight),
    }
    if environment != before {
        viewer.edit("environment", |edits| edits.environment = Some(environment));
    }
    let is_edited = viewer.document.as_ref().is_some_and(|d| d.edits().environment.is_some());
    if is_edited && ui.button("Reset environment").clicked() {
        viewer.edit("reset environment", |edits| edits.environment = None);
    }
}

fn kind(environment: &EnvironmentRecord) -> &'static str {
    match environment {
        EnvironmentRecord::Black => "none",
        EnvironmentRecord::Constant { .. } => "constant",
        EnvironmentRecord::Own { .. } => "environment map of the scene",
        EnvironmentRecord::File { .. } => "environment map",
        EnvironmentRecord::Studio { .. } => "studio",
        EnvironmentRecord::Sky(_) => "sky",
        EnvironmentRecord::Daylight(_) => "daylight",
    }
}

fn picture(ui: &mut Ui, rotation: &mut f32, intensity: &mut f32) {
    degrees(ui, "Environment rotation", rotation, -360.0..=360.0);
    number(ui, "Environment intensity", intensity, 0.01, 0.0..=1e6);
}

/// What a daylight is at first.
const AFTERNOON: DaylightRecord =
    DaylightRecord { elevation: 0.7, azimuth: 3.9, turbidity: 3.0, ground: [0.2; 3], intensity: 0.02 };

fn clear_daylight(ui: &mut Ui, daylight: &mut DaylightRecord) {
    let (mut elevation, mut azimuth) = (daylight.elevation as f32, daylight.azimuth as f32);
    degrees(ui, "Elevation of the sun", &mut elevation, 0.0..=90.0);
    degrees(ui, "Azimuth from north", &mut azimuth, -360.0..=360.0);
    // Only what was moved: the record is more exact than the slider.
    if elevation != daylight.elevation as f32 {
        daylight.elevation = f64::from(elevation);
    }
    if azimuth != daylight.azimuth as f32 {
        daylight.azimuth = f64::from(azimuth);
    }
    number(ui, "Turbidity", &mut daylight.turbidity, 0.05, 2.0..=10.0);
    bright_colour(ui, "Ground", &mut daylight.ground, "");
    number(ui, "Environment intensity", &mut daylight.intensity, 1e-5, 0.0..=1e6);
}

fn sky_and_sun(ui: &mut Ui, sky: &mut SkyRecord) {
    bright_colour(ui, "Zenith", &mut sky.zenith, "");
    bright_colour(ui, "Horizon", &mut sky.horizon, "");
    bright_colour(ui, "Ground", &mut sky.ground, "");
    let mut has_sun = sky.sun.is_some();
    if check(ui, "Sun", &mut has_sun) {
        sky.sun = has_sun.then(|| SunRecord {
            direction: glam::Vec3::new(0.5, 0.7, 0.5).normalize().to_array(),
            irradiance: [3.0, 2.9, 2.7],
            angular_radius: 0.00465,
        });
    }
    if let Some(sun) = &mut sky.sun {
        vector(ui, "Direction", &mut sun.direction, 0.01);
        bright_colour(ui, "Irradiance", &mut sun.irradiance, " W/m²");
        degrees(ui, "Angular radius", &mut sun.angular_radius, 0.05..=45.0);
    }
}

fn clear_sky() -> SkyRecord {
    SkyRecord { horizon: [0.8, 0.87, 0.95], zenith: [0.25, 0.45, 0.85], ground: [0.3, 0.28, 0.26], sun: None }
}
