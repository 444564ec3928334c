//! Materials, lights, environments and cameras in plain numbers, exactly as the scene has them.
//!
//! Sections of scene files that people write have degrees, names and defaults. These are for programs: radians, metres,
//! every number, so that what is read is bit for bit what was written.

use crate::{
    AlphaMode, Camera, CameraPath, Daylight, Distortion, Environment, EnvironmentPreset, Material, Model,
    Projection, Sky, Sun, SunPosition, UvTransform,
};
use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The numbers of a material; textures and patterns stay what they are. Fields are as those of [`Material`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MaterialRecord {
    /// Name, for people.
    pub name: String,
    /// `metallic-roughness`, `lambert`, `dielectric`, `mirror` or `unlit`.
    pub model: Model,
    /// Linear RGB and alpha.
    pub base_color: [f32; 4],
    /// Metalness.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Strength of the dielectric reflection.
    pub specular: f32,
    /// Index of refraction.
    pub ior: f32,
    /// Share that is refracted.
    pub transmission: f32,
    /// Infinitely thin wall.
    pub thin_walled: bool,
    /// Emitted radiance, W·sr⁻¹·m⁻².
    pub emission: [f32; 3],
    /// Both sides emit.
    pub emission_two_sided: bool,
    /// Scale of the normal map.
    pub normal_scale: f32,
    /// Use of alpha.
    pub alpha_mode: AlphaMode,
    /// Whether the back is shaded.
    pub double_sided: bool,
}

impl From<&Material> for MaterialRecord {
    fn from(m: &Material) -> Self {
        Self {
            name: m.name.clone(),
            model: m.model,
            base_color: m.base_color.to_array(),
            metallic: m.metallic,
            roughness: m.roughness,
            specular: m.specular,
            ior: m.ior,
            transmission: m.transmission,
            thin_walled: m.thin_walled,
            emission: m.emission.to_array(),
            emission_two_sided: m.emission_two_sided,
            normal_scale: m.normal_scale,
            alpha_mode: m.alpha_mode,
            double_sided: m.double_sided,
        }
    }
}

impl MaterialRecord {
    /// Gives a material these numbers.
    pub fn apply(&self, m: &mut Material) {
        m.name.clone_from(&self.name);
        m.model = self.model;
        m.base_color = Vec4::from_array(self.base_color);
        m.metallic = self.metallic;
        m.roughness = self.roughness;
        m.specular = self.specular;
        m.ior = self.ior;
        m.transmission = self.transmission;
        m.thin_walled = self.thin_walled;
        m.emission = Vec3::from_array(self.emission);
        m.emission_two_sided = self.emission_two_sided;
        m.normal_scale = self.normal_scale;
        m.alpha_mode = self.alpha_mode;
        m.double_sided = self.double_sided;
    }

    /// What is wrong with it, if anything is.
    pub fn problem(&self) -> Option<String> {
        let shares = [
            ("metallic", self.metallic),
            ("roughness", self.roughness),
            ("specular", self.specular),
            ("transmission", self.transmission),
        ];
        let colours = ["red", "green", "blue", "alpha"].into_iter().zip(self.base_color);
        if let Some((name, v)) = shares.into_iter().chain(colours).find(|(_, v)| !(0.0..=1.0).contains(v)) {
            return Some(format!("`{name}` must be between 0 and 1, it is {v}"));
        }
        if !(1.0..=10.0).contains(&self.ior) {
            return Some(format!("`ior` must be between 1 and 10, it is {}", self.ior));
        }
        let emission = self.emission.iter().find(|e| !(0.0..=1e9).contains(*e));
        emission.map(|e| format!("`emission` must be between 0 and 1e9, it is {e}"))
    }
}

/// An environment; fields are as those of [`Environment`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", rename_all_fields = "kebab-case", tag = "kind")]
#[allow(missing_docs, reason = "the fields are those of Environment")]
pub enum EnvironmentRecord {
    /// Nothing.
    Black,
    /// The same everywhere.
    Constant { radiance: [f32; 3] },
    /// The picture that the scene has already, turned and scaled.
    Own { rotation: f32, intensity: f32 },
    /// A picture from a file.
    File { file: PathBuf, rotation: f32, intensity: f32 },
    /// The studio of [`EnvironmentPreset`], turned and scaled.
    Studio { rotation: f32, intensity: f32 },
    /// A gradient.
    Sky(SkyRecord),
    /// A clear sky with its sun.
    Daylight(DaylightRecord),
}

/// As [`Daylight`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the fields are those of Daylight and SunPosition")]
pub struct DaylightRecord {
    pub elevation: f64,
    pub azimuth: f64,
    pub turbidity: f32,
    pub ground: [f32; 3],
    pub intensity: f32,
}

/// As [`Sky`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the fields are those of Sky")]
pub struct SkyRecord {
    pub horizon: [f32; 3],
    pub zenith: [f32; 3],
    pub ground: [f32; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun: Option<SunRecord>,
}

/// As [`Sun`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the fields are those of Sun")]
pub struct SunRecord {
    pub direction: [f32; 3],
    pub irradiance: [f32; 3],
    pub angular_radius: f32,
}

impl From<&Environment> for EnvironmentRecord {
    fn from(environment: &Environment) -> Self {
        match environment {
            Environment::Black => Self::Black,
            Environment::Constant(radiance) => Self::Constant { radiance: (*radiance).into() },
            Environment::Image { rotation, intensity, .. } => {
                Self::Own { rotation: *rotation, intensity: *intensity }
            }
            Environment::Sky(sky) => Self::Sky(sky.into()),
            Environment::Daylight(daylight) => Self::Daylight(daylight.into()),
        }
    }
}

impl From<EnvironmentPreset> for EnvironmentRecord {
    fn from(preset: EnvironmentPreset) -> Self {
        let studio = Self::Studio { rotation: 0.0, intensity: 1.0 };
        preset.gradient().map_or(studio, |sky| Self::Sky((&sky).into()))
    }
}

impl From<&Daylight> for DaylightRecord {
    fn from(daylight: &Daylight) -> Self {
        Self {
            elevation: daylight.sun.elevation,
            azimuth: daylight.sun.azimuth,
            turbidity: daylight.turbidity,
            ground: daylight.ground.into(),
            intensity: daylight.intensity,
        }
    }
}

impl DaylightRecord {
    /// The sky, within the limits of its model.
    pub fn daylight(&self) -> Daylight {
        let elevation = self.elevation.clamp(0.0, std::f64::consts::FRAC_PI_2);
        Daylight {
            sun: SunPosition { elevation, azimuth: self.azimuth },
            turbidity: self.turbidity.clamp(2.0, 10.0),
            ground: Vec3::from_array(self.ground).clamp(Vec3::ZERO, Vec3::ONE),
            intensity: self.intensity,
        }
    }
}

impl From<&Sky> for SkyRecord {
    fn from(sky: &Sky) -> Self {
        let sun = |sun: Sun| SunRecord {
            direction: sun.direction.into(),
            irradiance: sun.irradiance.into(),
            angular_radius: sun.angular_radius,
        };
        Self {
            horizon: sky.horizon.into(),
            zenith: sky.zenith.into(),
            ground: sky.ground.into(),
            sun: sky.sun.map(sun),
        }
    }
}

impl SkyRecord {
    /// The sky.
    pub fn sky(&self) -> Sky {
        let sun = |sun: SunRecord| {
            let direction = Vec3::from_array(sun.direction);
            Sun {
                direction: if direction.is_normalized() {
                    direction
                } else {
                    direction.normalize_or(Vec3::Y)
                },
                irradiance: sun.irradiance.into(),
                angular_radius: sun.angular_radius.clamp(1e-4, 0.8),
            }
        };
        Sky {
            horizon: self.horizon.into(),
            zenith: self.zenith.into(),
            ground: self.ground.into(),
            sun: self.sun.map(sun),
        }
    }
}

/// A camera; fields are as those of [`Camera`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the fields are those of Camera")]
pub struct CameraRecord {
    pub name: String,
    pub eye: [f32; 3],
    pub target: [f32; 3],
    pub up: [f32; 3],
    pub projection: Projection,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aspect: Option<f32>,
    pub lens_radius: f32,
    pub focus_distance: f32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orbit: Option<OrbitRecord>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Distortion>,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub skew: f32,
}

fn is_zero(number: &f32) -> bool {
    *number == 0.0
}

/// As [`CameraPath::Orbit`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the fields are those of CameraPath")]
pub struct OrbitRecord {
    pub center: [f32; 3],
    pub radius: f32,
    pub height: f32,
    pub bob: f32,
    pub period: f32,
    pub start: f32,
}

impl From<&Camera> for CameraRecord {
    fn from(c: &Camera) -> Self {
        let orbit = c.path.map(|CameraPath::Orbit { center, radius, height, bob, period, start }| {
            OrbitRecord { center: center.into(), radius, height, bob, period, start }
        });
        Self {
            name: c.name.clone(),
            eye: c.eye.into(),
            target: c.target.into(),
            up: c.up.into(),
            projection: c.projection,
            aspect: c.aspect,
            lens_radius: c.lens_radius,
            focus_distance: c.focus_distance,
            orbit,
            distortion: c.distortion,
            skew: c.skew,
        }
    }
}

impl CameraRecord {
    /// The camera.
    pub fn camera(&self) -> Camera {
        let path = self.orbit.map(|o| CameraPath::Orbit {
            center: o.center.into(),
            radius: o.radius,
            height: o.height,
            bob: o.bob,
            period: o.period,
            start: o.start,
        });
        Camera {
            name: self.name.clone(),
            eye: self.eye.into(),
            target: self.target.into(),
            up: self.up.into(),
            projection: self.projection,
            aspect: self.aspect,
            lens_radius: self.lens_radius,
            focus_distance: self.focus_distance,
            path,
            keys: Vec::new(),
            distortion: self.distortion,
            skew: self.skew,
        }
    }
}

/// A map of texture coordinates: scaled, then turned, then moved; see [`UvTransform::new`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct UvTransformRecord {
    /// Added last.
    pub offset: [f32; 2],
    /// Radians.
    pub rotation: f32,
    /// Factors.
    pub scale: [f32; 2],
}

impl From<&UvTransform> for UvTransformRecord {
    /// Shear, which these numbers cannot say, is lost.
    fn from(transform: &UvTransform) -> Self {
        let [first, second] = transform.rows;
        let (sin, cos) = (-second.x, first.x);
        let rotation = elementary::atan2(sin, cos);
        let (s, c) = elementary::sin_cos(rotation);
        let scale = [elementary::hypot(sin, cos), first.y * s + second.y * c];
        Self { offset: transform.offset.to_array(), rotation, scale }
    }
}

impl UvTransformRecord {
    /// The map.
    pub fn transform(&self) -> UvTransform {
        UvTransform::new(self.offset.into(), self.rotation, self.scale.into())
    }
}
