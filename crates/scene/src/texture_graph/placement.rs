//! Where the pattern of a node lies: a space, and a map from its coordinates to those of the pattern.

use glam::{Affine3A, EulerRot, Mat3, Quat, Vec3};
use serde::{Deserialize, Serialize};

/// The space that a pattern lies in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Space {
    /// The first set of texture coordinates, as x and y.
    #[default]
    Uv,
    /// The second set.
    Uv1,
    /// The space of the object.
    Object,
    /// The space of the world.
    World,
    /// That of the scene's first camera: x to the right, y up, z towards the viewer, metres.
    Camera,
}

impl Space {
    /// All of them, with their names in files.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Uv, "uv"),
        (Self::Uv1, "uv1"),
        (Self::Object, "object"),
        (Self::World, "world"),
        (Self::Camera, "camera"),
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(space, _)| *space == self).map_or("uv", |(_, name)| name)
    }

    /// The space of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known)| *known == name).map(|(space, _)| *space)
    }
}

/// Where a pattern lies: its coordinates are `map` applied to those of `space`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// Where coordinates come from.
    pub space: Space,
    /// From them to those of the pattern.
    pub map: Affine3A,
}

/// The map of a placement as people read it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementParts {
    /// Cells per unit of the space.
    pub scale: Vec3,
    /// Rotation of the pattern about x, then y, then z, degrees.
    pub rotate: Vec3,
    /// Added to the coordinates of the pattern.
    pub translate: Vec3,
}

impl PlacementParts {
    /// The parts of a map. Shear, which these numbers cannot say, is left out.
    pub fn of(map: &Affine3A) -> Self {
        let rows = Mat3::from(map.matrix3).transpose();
        let mirrored = if rows.determinant() < 0.0 { -1.0 } else { 1.0 };
        let lengths = [rows.x_axis, rows.y_axis, rows.z_axis].map(Vec3::length);
        let scale = Vec3::from_array(lengths) * Vec3::new(mirrored, 1.0, 1.0);
        // A row without length has no direction.
        let rotate = if lengths.iter().all(|length| *length > 0.0) {
            let turn = Mat3::from_cols(rows.x_axis / scale.x, rows.y_axis / scale.y, rows.z_axis / scale.z);
            let (z, y, x) = Quat::from_mat3(&turn).to_euler(EulerRot::ZYX);
            Vec3::new(x, y, z).map(f32::to_degrees)
        } else {
            Vec3::ZERO
        };
        Self { scale, rotate, translate: map.translation.into() }
    }

    /// The map of these parts.
    pub fn map(&self) -> Affine3A {
        let [x, y, z] = self.rotate.to_array().map(f32::to_radians);
        let turn = Mat3::from_quat(Quat::from_euler(EulerRot::ZYX, z, y, x));
        // The pattern is turned, so its coordinates are turned back; it has `scale` periods per unit.
        let matrix = Mat3::from_diagonal(self.scale) * turn.transpose();
        Affine3A::from_mat3_translation(matrix, self.translate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_make_the_map_again() {
        for scale in [Vec3::ONE, Vec3::new(2.0, 0.5, 7.0), Vec3::new(1.0, -3.0, 1.0)] {
            let parts = PlacementParts { scale, rotate: Vec3::new(10.0, -40.0, 120.0), translate: Vec3::ONE };
            let again = PlacementParts::of(&parts.map()).map();
            assert!(parts.map().abs_diff_eq(again, 1e-4), "{parts:?}: {again:?}");
        }
        let flat = PlacementParts { scale: Vec3::X, rotate: Vec3::ZERO, translate: Vec3::ZERO };
        assert_eq!(PlacementParts::of(&flat.map()), flat);
    }

    #[test]
    fn spaces_have_names() {
        for (space, name) in Space::ALL {
            assert_eq!((space.name(), Space::named(name)), (name, Some(space)));
        }
        assert_eq!(Space::named("moon"), None);
    }
}
