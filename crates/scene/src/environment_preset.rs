//! Three environments of our own for scenes without lights: a studio with soft boxes, a sky, a night. All are made by the
//! formulas below; none is a photograph.

use crate::image::Pixels;
use crate::{Environment, Image, Scene, Sky, Sun};
use elementary::{cos, sin};
use glam::{Vec3, vec3};

/// Width and height of the studio's picture: its edges are softer than a pixel is wide.
const SIZE: [u32; 2] = [256, 128];

/// An environment that is made by formulas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EnvironmentPreset {
    /// A grey room with soft boxes: a key light to the left, a larger and weaker one to the right, one above, and one
    /// behind what is looked at from +Z.
    Studio,
    /// A blue sky with an afternoon sun that is larger than the real one, so that shadows have soft edges.
    Sky,
    /// A dark blue sky with a moon, as films show nights.
    Night,
}

impl EnvironmentPreset {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Studio, Self::Sky, Self::Night];

    /// What users call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Studio => "studio",
            Self::Sky => "sky",
            Self::Night => "night",
        }
    }

    /// What it looks like, in a few words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Studio => "a grey room with soft boxes",
            Self::Sky => "a blue sky with a soft sun",
            Self::Night => "a dark sky with a moon",
        }
    }

    /// The one with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// The preset as a gradient; `None` for the studio, which is a picture.
    pub fn gradient(self) -> Option<Sky> {
        match self {
            Self::Studio => None,
            Self::Sky => Some(Sky {
                horizon: vec3(0.72, 0.8, 0.88),
                zenith: vec3(0.22, 0.4, 0.78),
                ground: vec3(0.32, 0.3, 0.27),
                sun: Some(Sun {
                    direction: vec3(0.55, 0.65, 0.52).normalize(),
                    irradiance: vec3(2.1, 1.95, 1.65),
                    angular_radius: 0.03,
                }),
            }),
            Self::Night => Some(Sky {
                horizon: vec3(0.035, 0.05, 0.085),
                zenith: vec3(0.008, 0.014, 0.035),
                ground: vec3(0.012, 0.013, 0.016),
                sun: Some(Sun {
                    direction: vec3(-0.5, 0.6, 0.62).normalize(),
                    irradiance: vec3(0.42, 0.5, 0.66),
                    angular_radius: 0.02,
                }),
            }),
        }
    }

    /// Puts it around a scene instead of what there is.
    ///
    /// - `rotation`, `intensity`: of the studio; see [`Environment::Image`].
    pub fn put_around(self, scene: &mut Scene, rotation: f32, intensity: f32) {
        scene.environment = match self.gradient() {
            Some(sky) => Environment::Sky(sky),
            None => {
                scene.images.push(studio());
                Environment::Image { image: scene.images.len() as u32 - 1, rotation, intensity }
            }
        };
    }
}

/// A rectangle that shines, as it is seen from the middle of the room.
struct SoftBox {
    /// Angles of its middle, degrees: from −Z towards +X, and upwards.
    at: [f32; 2],
    /// Half its width and height at distance 1.
    half: [f32; 2],
    /// Radiance, linear RGB.
    radiance: Vec3,
}

const BOXES: [SoftBox; 4] = [
    SoftBox { at: [130.0, 42.0], half: [0.36, 0.3], radiance: Vec3::new(4.4, 4.2, 3.9) },
    SoftBox { at: [-110.0, 25.0], half: [0.45, 0.4], radiance: Vec3::new(1.1, 1.15, 1.25) },
    SoftBox { at: [0.0, 88.0], half: [0.55, 0.3], radiance: Vec3::new(2.2, 2.2, 2.2) },
    SoftBox { at: [-25.0, 30.0], half: [0.16, 0.4], radiance: Vec3::new(2.6, 2.7, 2.9) },
];
/// How soft the edges of boxes are, at distance 1.
const EDGE: f32 = 0.05;
/// Walls at the height of the eyes, ceiling and floor.
const ROOM: [f32; 3] = [0.34, 0.2, 0.12];

/// The studio's picture.
pub(crate) fn studio() -> Image {
    let [width, height] = SIZE;
    let pixel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let azimuth = ((x as f32 + 0.5) / width as f32 - 0.5) * std::f32::consts::TAU;
        let elevation = (0.5 - (y as f32 + 0.5) / height as f32) * std::f32::consts::PI;
        radiance(direction(azimuth, elevation)).to_array()
    };
    let pixels = Pixels::Rgb32F((0..width * height).map(pixel).collect());
    Image { name: "studio".into(), width, height, pixels }
}

/// Unit direction; angles in radians, from −Z towards +X, and upwards.
fn direction(azimuth: f32, elevation: f32) -> Vec3 {
    let level = cos(elevation);
    vec3(sin(azimuth) * level, sin(elevation), -cos(azimuth) * level)
}

/// What comes from a direction.
fn radiance(from: Vec3) -> Vec3 {
    let [walls, ceiling, floor] = ROOM;
    let end = if from.y > 0.0 { ceiling } else { floor };
    let room = Vec3::splat(walls + (end - walls) * smooth(from.y.abs()));
    BOXES.iter().fold(room, |light, shining| light + (shining.radiance - light) * shining.covers(from))
}

impl SoftBox {
    /// How much of a direction it covers, in `[0, 1]`.
    fn covers(&self, from: Vec3) -> f32 {
        let [azimuth, elevation] = self.at.map(f32::to_radians);
        let axis = direction(azimuth, elevation);
        let side = vec3(cos(azimuth), 0.0, sin(azimuth));
        let ahead = from.dot(axis);
        if ahead <= 0.0 {
            return 0.0;
        }
        let place = [from.dot(side) / ahead, from.dot(side.cross(axis)) / ahead];
        let within = |i: usize| smooth((self.half[i] - place[i].abs()) / EDGE + 0.5);
        within(0) * within(1)
    }
}

/// From 0 to 1 without corners (smoothstep).
fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_known() {
        for preset in EnvironmentPreset::ALL {
            assert_eq!(EnvironmentPreset::from_name(preset.name()), Some(preset));
        }
        assert_eq!(EnvironmentPreset::from_name("noon"), None);
    }

    /// Irradiance of what looks up: white is bright under a studio and a sky without being clipped, and dark at night.
    #[test]
    fn presets_are_as_bright_as_they_are_called() {
        let sky_of = |sky: Sky| {
            // The gradient over the upper half sphere, by midpoints.
            let steps = 64;
            let each = |i: usize| {
                let up = (i as f32 + 0.5) / steps as f32;
                (sky.horizon + (sky.zenith - sky.horizon) * up) * up
            };
            let sum: Vec3 = (0..steps).map(each).sum();
            let sun = sky.sun.map_or(Vec3::ZERO, |sun| sun.irradiance * sun.direction.y);
            sum * std::f32::consts::TAU / steps as f32 + sun
        };
        let up = |preset: EnvironmentPreset| match preset.gradient() {
            Some(sky) => sky_of(sky),
            None => {
                let image = studio();
                let Pixels::Rgb32F(pixels) = &image.pixels else { panic!("floats") };
                let cell = std::f32::consts::TAU / SIZE[0] as f32 * (std::f32::consts::PI / SIZE[1] as f32);
                let weighed = pixels.iter().enumerate().map(|(i, c)| {
                    let row = (i as u32 / SIZE[0]) as f32;
                    let elevation = (0.5 - (row + 0.5) / SIZE[1] as f32) * std::f32::consts::PI;
                    Vec3::from_array(*c) * (sin(elevation).max(0.0) * cos(elevation) * cell)
                });
                weighed.sum()
            }
        };
        let white = EnvironmentPreset::ALL.map(|preset| (up(preset) / std::f32::consts::PI).max_element());
        assert!((0.6..1.2).contains(&white[0]) && (0.6..1.2).contains(&white[1]), "{white:?}");
        assert!((0.05..0.4).contains(&white[2]), "{white:?}");
    }

    #[test]
    fn the_studio_has_its_boxes_where_they_are() {
        let at =
            |azimuth: f32, elevation: f32| radiance(direction(azimuth.to_radians(), elevation.to_radians()));
        for shining in &BOXES {
            assert!(at(shining.at[0], shining.at[1]).abs_diff_eq(shining.radiance, 1e-5));
        }
        assert!(at(60.0, 0.0).max_element() < 0.5 && at(0.0, -89.0).max_element() < 0.2);
    }
}
