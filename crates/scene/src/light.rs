//! Punctual and directional lights.

use crate::{Photometry, TextureRef};
use glam::{Affine3A, Vec3};
use serde::{Deserialize, Serialize};
use std::f32::consts::{FRAC_PI_2, PI};
use std::ops::RangeInclusive;

/// The widest field of view of a projector, radians.
pub(crate) const WIDEST_PROJECTION: f32 = 0.99 * PI;

/// A light without a surface of its own. Emissive meshes and spheres are lights through their
/// material instead.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name from the file.
    pub name: String,
    /// Geometry and strength.
    #[serde(flatten)]
    pub kind: LightKind,
    /// How the intensity of a point or spot depends on direction, beside what the kind says; the
    /// kind's intensity is that where the profile is greatest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Photometry>,
}

impl Light {
    /// A light without a profile.
    pub fn new(name: impl Into<String>, kind: LightKind) -> Self {
        Self { name: name.into(), kind, profile: None }
    }

    /// The light moved by `motion`. Its strength stays the same, whatever the scale.
    #[must_use]
    pub fn moved(&self, motion: &Affine3A) -> Self {
        let mut light = self.clone();
        for (_, parameter) in light.kind.parameters() {
            match parameter {
                LightParameter::Position(p) => *p = motion.transform_point3(*p),
                LightParameter::Direction(d) => {
                    *d = motion.transform_vector3(*d).try_normalize().unwrap_or(*d);
                }
                LightParameter::Strength(..) | LightParameter::Angle(..) | LightParameter::Picture(_) => {}
            }
        }
        light.profile = light.profile.map(|profile| profile.placed(motion));
        light
    }

    /// The light with directions of unit length, angles within their ranges, and a spot's profile
    /// aimed as the spot is. What is valid already stays as it is, bit for bit.
    #[must_use]
    pub fn valid(&self) -> Self {
        let mut light = self.clone();
        for (_, parameter) in light.kind.parameters() {
            match parameter {
                LightParameter::Direction(d) if !d.is_normalized() => *d = d.normalize_or(Vec3::NEG_Y),
                LightParameter::Angle(angle, range) => *angle = angle.clamp(*range.start(), *range.end()),
                _ => {}
            }
        }
        match light.kind {
            LightKind::Directional { .. } | LightKind::Projector { .. } => light.profile = None,
            LightKind::Spot { direction, .. } => {
                light.profile = light.profile.map(|profile| profile.aimed_along(direction));
            }
            LightKind::Point { .. } => {}
        }
        light
    }
}

/// Where a light's energy comes from and where it goes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", rename_all_fields = "kebab-case", tag = "kind")]
pub enum LightKind {
    /// A point that shines equally in all directions.
    Point {
        /// World position, metres.
        position: Vec3,
        /// Radiant intensity, linear RGB, W/sr (candela in glTF).
        intensity: Vec3,
    },
    /// A point that shines into a cone.
    Spot {
        /// World position, metres.
        position: Vec3,
        /// Unit direction in which it shines.
        direction: Vec3,
        /// Radiant intensity on the axis, linear RGB, W/sr.
        intensity: Vec3,
        /// Angle from the axis up to which the intensity is constant, radians, less than
        /// `outer_angle`.
        inner_angle: f32,
        /// Angle from the axis at which the intensity reaches zero, radians, at most π/2.
        outer_angle: f32,
    },
    /// A point that throws a picture, as a slide projector does, or a pattern of structured light.
    Projector {
        /// World position, metres.
        position: Vec3,
        /// Unit direction of the picture's centre.
        direction: Vec3,
        /// Unit direction towards which the picture's top is; not along `direction`.
        up: Vec3,
        /// Radiant intensity where the picture is white, linear RGB, W/sr.
        intensity: Vec3,
        /// Full angle of the picture's shorter side, radians.
        field_of_view: f32,
        /// The picture. That of a texture graph is square. Texture coordinates begin at its top
        /// left.
        picture: TextureRef,
    },
    /// Infinitely far away.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, linear RGB, W/m² (lux in glTF).
        irradiance: Vec3,
        /// Full angle under which the source is seen, radians; 0 gives hard shadows.
        angular_diameter: f32,
    },
}

/// A parameter of a light: what it means when the light moves, is edited or printed.
#[derive(Debug)]
pub enum LightParameter<'a> {
    /// World position, metres.
    Position(&'a mut Vec3),
    /// Unit direction, world space.
    Direction(&'a mut Vec3),
    /// Linear RGB, with its unit.
    Strength(&'a mut Vec3, &'static str),
    /// Radians, with its range.
    Angle(&'a mut f32, RangeInclusive<f32>),
    /// What it shows.
    Picture(&'a mut TextureRef),
}

impl LightKind {
    /// The kind's name in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Projector { .. } => "projector",
            Self::Directional { .. } => "directional",
        }
    }

    /// All parameters, each with its name for people.
    pub fn parameters(&mut self) -> Vec<(&'static str, LightParameter<'_>)> {
        use LightParameter::{Angle, Direction, Picture, Position, Strength};
        match self {
            Self::Point { position, intensity } => {
                vec![("Position", Position(position)), ("Intensity", Strength(intensity, "W/sr"))]
            }
            Self::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                let widest_inner = outer_angle.clamp(1e-3, FRAC_PI_2) * 0.999;
                vec![
                    ("Position", Position(position)),
                    ("Direction", Direction(direction)),
                    ("Intensity", Strength(intensity, "W/sr")),
                    ("Outer cone angle", Angle(outer_angle, 1e-3..=FRAC_PI_2)),
                    ("Inner cone angle", Angle(inner_angle, 0.0..=widest_inner)),
                ]
            }
            Self::Projector { position, direction, up, intensity, field_of_view, picture } => vec![
                ("Position", Position(position)),
                ("Direction", Direction(direction)),
                ("Up", Direction(up)),
                ("Intensity", Strength(intensity, "W/sr")),
                ("Field of view", Angle(field_of_view, 1e-3..=WIDEST_PROJECTION)),
                ("Picture", Picture(picture)),
            ],
            Self::Directional { direction, irradiance, angular_diameter } => vec![
                ("Direction", Direction(direction)),
                ("Irradiance", Strength(irradiance, "W/m²")),
                ("Angular diameter", Angle(angular_diameter, 0.0..=PI)),
            ],
        }
    }

    /// The light with its strength multiplied.
    #[must_use]
    pub fn scaled(mut self, factor: Vec3) -> Self {
        for (_, parameter) in self.parameters() {
            if let LightParameter::Strength(strength, _) = parameter {
                *strength *= factor;
            }
        }
        self
    }

    /// What it shows, if it shows a picture.
    pub fn picture(mut self) -> Option<TextureRef> {
        self.parameters().into_iter().find_map(|(_, parameter)| match parameter {
            LightParameter::Picture(picture) => Some(*picture),
            _ => None,
        })
    }

    /// Whether it has no place.
    pub fn is_infinitely_far(&self) -> bool {
        matches!(self, Self::Directional { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot() -> LightKind {
        LightKind::Spot {
            position: Vec3::X,
            direction: Vec3::X,
            intensity: Vec3::ONE,
            inner_angle: 0.1,
            outer_angle: 0.2,
        }
    }

    #[test]
    fn lights_move_with_their_model() {
        let motion = Affine3A::from_translation(Vec3::Y) * Affine3A::from_scale(Vec3::splat(2.0));
        let moved = Light::new("s", spot()).moved(&motion);
        let LightKind::Spot { position, direction, .. } = moved.kind else { panic!("still a spot light") };
        assert_eq!((position, direction), (Vec3::new(2.0, 1.0, 0.0), Vec3::X));
    }

    #[test]
    fn what_is_valid_stays_and_what_is_not_is_mended() {
        let light = Light::new("s", spot());
        assert_eq!(light.valid(), light);
        let LightKind::Spot { position, intensity, .. } = spot() else { unreachable!("it is one") };
        let direction = Vec3::new(0.0, -3.0, 0.0);
        let wrong = LightKind::Spot { position, direction, intensity, inner_angle: 2.0, outer_angle: 3.0 };
        let LightKind::Spot { direction, inner_angle, outer_angle, .. } = Light::new("s", wrong).valid().kind
        else {
            panic!("still a spot light")
        };
        assert_eq!((direction, outer_angle), (Vec3::NEG_Y, FRAC_PI_2));
        assert!(inner_angle < outer_angle);
    }

    /// Beside the parameters of its kind, no light has any.
    #[test]
    fn unknown_keys_are_refused() {
        let text = "name = \"p\"\nkind = \"point\"\nposition = [0, 0, 0]\nintensity = [1, 1, 1]\n";
        assert_eq!(toml::from_str::<Light>(text).expect("a light").kind.name(), "point");
        let error = toml::from_str::<Light>(&format!("{text}colour = 1\n")).expect_err("no such key");
        assert!(error.to_string().contains("colour"), "{error}");
    }
}
