//! What nodes carry and animations change: instances, cameras, lights, materials.

use crate::{Camera, LightKind, Material, MaterialId, Projection, TextureRef, UvTransform};
use glam::{DAffine3, Vec2, Vec3, Vec4};

/// An instance that a node carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimatedInstance {
    /// Index into [`crate::Scene::instances`].
    pub instance: u32,
    /// Index of the node.
    pub node: u32,
    /// Instance to node. Not used where the mesh has a skin, which moves it into the rig's space itself.
    pub local: Option<DAffine3>,
    /// Hidden, whatever the node says.
    pub hidden: bool,
    /// Applied after everything else: from what the rig's nodes are relative to ([`super::Rig::origin`]) to the scene.
    pub root: DAffine3,
}

/// A camera that a node carries: it looks along the node's −Z axis, +Y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimatedCamera {
    /// Index into [`crate::Scene::cameras`].
    pub camera: u32,
    /// Index of the node.
    pub node: u32,
    /// The projection at rest.
    pub projection: Projection,
}

/// Where a node with a camera looks from, in which direction, and which direction is up; `None` for a node that is
/// squeezed to a plane or not finite.
pub fn view_of(world: &DAffine3) -> Option<(Vec3, Vec3, Vec3)> {
    let eye = world.translation.as_vec3();
    let forward = -world.matrix3.z_axis.as_vec3().normalize_or_zero();
    let up = world.matrix3.y_axis.as_vec3().normalize_or_zero();
    (eye.is_finite() && forward.cross(up).length() > 1e-6).then_some((eye, forward, up))
}

impl AnimatedCamera {
    /// Puts the scene's camera where its node is. A node that cannot carry a camera leaves it where it was.
    pub fn place(&self, world: &DAffine3, camera: &mut Camera) {
        camera.projection = self.projection;
        if let Some((eye, forward, up)) = view_of(world) {
            (camera.eye, camera.target, camera.up) = (eye, eye + forward, up);
        }
    }
}

/// A light that a node carries: it shines along the node's −Z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimatedLight {
    /// Index into [`crate::Scene::lights`].
    pub light: u32,
    /// Index of the node.
    pub node: u32,
    /// The light at rest.
    pub source: Punctual,
    /// Applied after the node's own place: from what the rig's nodes are relative to to the scene.
    pub root: DAffine3,
}

/// A punctual light as files describe it, without its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Punctual {
    /// Its shape.
    pub kind: PunctualKind,
    /// Linear colour.
    pub color: Vec3,
    /// Candela, or lux for a directional light.
    pub intensity: f32,
}

/// How a punctual light spreads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualKind {
    /// Everywhere.
    Point,
    /// From infinitely far away.
    Directional,
    /// In a cone.
    Spot {
        /// Angle from the axis up to which it is constant, radians.
        inner: f32,
        /// Angle at which it is dark, radians.
        outer: f32,
    },
}

impl Punctual {
    /// The light at a node; `None` for values that no light can have.
    pub fn at(&self, world: &DAffine3) -> Option<LightKind> {
        let strength = self.color * self.intensity;
        let position = world.translation.as_vec3();
        let direction = -world.matrix3.z_axis.as_vec3().normalize_or_zero();
        let sound = strength.is_finite() && strength.min_element() >= 0.0 && position.is_finite();
        if !sound || (self.kind != PunctualKind::Point && direction == Vec3::ZERO) {
            return None;
        }
        Some(match self.kind {
            PunctualKind::Point => LightKind::Point { position, intensity: strength },
            PunctualKind::Directional => {
                LightKind::Directional { direction, irradiance: strength, angular_diameter: 0.0 }
            }
            PunctualKind::Spot { inner, outer } => {
                let finite = |angle: f32| if angle.is_finite() { angle } else { 0.0 };
                let outer_angle = finite(outer).clamp(1e-4, std::f32::consts::FRAC_PI_2);
                let inner_angle = finite(inner).clamp(0.0, outer_angle * 0.9999);
                LightKind::Spot { position, direction, intensity: strength, inner_angle, outer_angle }
            }
        })
    }
}

/// A material whose values change.
#[derive(Clone, Debug)]
pub struct AnimatedMaterial {
    /// Index into [`crate::Scene::materials`].
    pub material: MaterialId,
    /// The material at rest.
    pub rest: Material,
    /// `rest.emission` without its strength.
    pub emissive_factor: Vec3,
    /// Multiplied into it.
    pub emissive_strength: f32,
    /// The transforms of the textures at rest, in parts; parallel to [`TextureUse::ALL`].
    pub textures: [TextureMotion; TextureUse::ALL.len()],
}

/// A transform of texture coordinates in parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureMotion {
    /// Added last.
    pub offset: Vec2,
    /// Counter-clockwise as seen with v downwards, radians.
    pub rotation: f32,
    /// Applied first.
    pub scale: Vec2,
}

impl Default for TextureMotion {
    fn default() -> Self {
        Self { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE }
    }
}

/// Textures of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureUse {
    /// Base colour.
    BaseColor,
    /// Metalness and roughness.
    MetallicRoughness,
    /// Normal map.
    Normal,
    /// Emission.
    Emission,
    /// Transmission.
    Transmission,
}

impl TextureUse {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::BaseColor, Self::MetallicRoughness, Self::Normal, Self::Emission, Self::Transmission];

    fn of(self, material: &mut Material) -> Option<&mut TextureRef> {
        match self {
            Self::BaseColor => material.base_color_texture.as_mut(),
            Self::MetallicRoughness => material.metallic_roughness_texture.as_mut(),
            Self::Normal => material.normal_texture.as_mut(),
            Self::Emission => material.emission_texture.as_mut(),
            Self::Transmission => material.transmission_texture.as_mut(),
        }
    }
}

/// A value of a material that can be animated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialValue {
    /// Four numbers.
    BaseColor,
    /// One number.
    Metallic,
    /// One number.
    Roughness,
    /// Three numbers.
    EmissiveFactor,
    /// One number.
    EmissiveStrength,
    /// One number.
    NormalScale,
    /// One number; has an effect on masked materials only.
    AlphaCutoff,
    /// One number.
    Ior,
    /// One number.
    Transmission,
    /// One number.
    Specular,
    /// Two numbers.
    TextureOffset(TextureUse),
    /// One number, radians.
    TextureRotation(TextureUse),
    /// Two numbers.
    TextureScale(TextureUse),
}

impl MaterialValue {
    /// How many numbers it has.
    pub fn width(self) -> usize {
        match self {
            Self::BaseColor => 4,
            Self::EmissiveFactor => 3,
            Self::TextureOffset(_) | Self::TextureScale(_) => 2,
            Self::Metallic
            | Self::Roughness
            | Self::EmissiveStrength
            | Self::NormalScale
            | Self::AlphaCutoff
            | Self::Ior
            | Self::Transmission
            | Self::Specular
            | Self::TextureRotation(_) => 1,
        }
    }
}

/// A strength that files may have; what is not a number is none.
fn strength(number: f32) -> f32 {
    if number > 0.0 { number.min(Material::MOST_EMISSIVE_STRENGTH) } else { 0.0 }
}

impl AnimatedMaterial {
    /// Sets a value of as many numbers as it has. Splines overshoot: values are brought into their range.
    pub fn set(&mut self, value: MaterialValue, numbers: &[f32]) {
        let material = &mut self.rest;
        match value {
            MaterialValue::BaseColor => {
                material.base_color = Vec4::from_slice(numbers).clamp(Vec4::ZERO, Vec4::ONE);
            }
            MaterialValue::Metallic => material.metallic = numbers[0].clamp(0.0, 1.0),
            MaterialValue::Roughness => material.roughness = numbers[0].clamp(0.0, 1.0),
            MaterialValue::EmissiveFactor => self.emissive_factor = Vec3::from_slice(numbers).max(Vec3::ZERO),
            MaterialValue::EmissiveStrength => self.emissive_strength = strength(numbers[0]),
            MaterialValue::NormalScale => material.normal_scale = numbers[0],
            MaterialValue::AlphaCutoff => {
                if let crate::AlphaMode::Mask(cutoff) = &mut material.alpha_mode {
                    *cutoff = numbers[0];
                }
            }
            MaterialValue::Ior => material.ior = numbers[0].max(1.0),
            MaterialValue::Transmission => material.transmission = numbers[0].clamp(0.0, 1.0),
            MaterialValue::Specular => material.specular = numbers[0].clamp(0.0, 1.0),
            MaterialValue::TextureOffset(texture) => {
                self.move_texture(texture, |motion| motion.offset = Vec2::from_slice(numbers));
            }
            MaterialValue::TextureRotation(texture) => {
                self.move_texture(texture, |motion| motion.rotation = numbers[0]);
            }
            MaterialValue::TextureScale(texture) => {
                self.move_texture(texture, |motion| motion.scale = Vec2::from_slice(numbers));
            }
        }
        if matches!(value, MaterialValue::EmissiveFactor | MaterialValue::EmissiveStrength) {
            self.rest.emission = self.emissive_factor * self.emissive_strength;
        }
    }

    fn move_texture(&mut self, texture: TextureUse, change: impl Fn(&mut TextureMotion)) {
        let Some(index) = TextureUse::ALL.iter().position(|t| *t == texture) else { return };
        let motion = &mut self.textures[index];
        change(motion);
        if let Some(reference) = texture.of(&mut self.rest) {
            reference.transform = UvTransform::new(motion.offset, motion.rotation, motion.scale);
        }
    }
}

/// A value of a light that can be animated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightValue {
    /// Three numbers.
    Color,
    /// One number.
    Intensity,
    /// One number; has an effect on spots only.
    InnerConeAngle,
    /// One number; has an effect on spots only.
    OuterConeAngle,
}

impl LightValue {
    /// How many numbers it has.
    pub fn width(self) -> usize {
        if self == Self::Color { 3 } else { 1 }
    }
}

impl Punctual {
    /// Sets a value of as many numbers as it has.
    pub fn set(&mut self, value: LightValue, numbers: &[f32]) {
        match (value, &mut self.kind) {
            (LightValue::Color, _) => self.color = Vec3::from_slice(numbers).max(Vec3::ZERO),
            (LightValue::Intensity, _) => self.intensity = numbers[0].max(0.0),
            (LightValue::InnerConeAngle, PunctualKind::Spot { inner, .. }) => *inner = numbers[0],
            (LightValue::OuterConeAngle, PunctualKind::Spot { outer, .. }) => *outer = numbers[0],
            (LightValue::InnerConeAngle | LightValue::OuterConeAngle, _) => {}
        }
    }
}

/// A value of a camera that can be animated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraValue {
    /// Full vertical field of view of a perspective camera, radians.
    FovY,
    /// Half the height of an orthographic camera's picture, metres.
    HalfHeight,
}

impl AnimatedCamera {
    /// Sets a value; one that no such camera can have leaves it as it was.
    pub fn set(&mut self, value: CameraValue, number: f32) {
        match (value, &mut self.projection) {
            (CameraValue::FovY, Projection::Perspective { fov_y }) => {
                if number > 0.0 && number < std::f32::consts::PI {
                    *fov_y = number;
                }
            }
            (CameraValue::HalfHeight, Projection::Orthographic { height }) => {
                if number.is_finite() && number != 0.0 {
                    *height = 2.0 * number.abs();
                }
            }
            (CameraValue::FovY | CameraValue::HalfHeight, _) => {}
        }
    }
}
