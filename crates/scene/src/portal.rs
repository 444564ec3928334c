//! Portals: openings that the light of the environment comes through.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// An opening that the environment is seen through, such as a window or a door: a flat convex quadrilateral in world space.
///
/// It is no surface: nothing is seen of it, and it lets all light pass. It says where light from infinitely far away is to be looked
/// for. Light that comes in elsewhere is found all the same, by paths that happen to leave the scene, with more noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[Vec3; 4]", into = "[Vec3; 4]")]
pub struct Portal {
    corners: [Vec3; 4],
}

impl From<Portal> for [Vec3; 4] {
    fn from(portal: Portal) -> Self {
        portal.corners
    }
}

impl TryFrom<[Vec3; 4]> for Portal {
    type Error = PortalError;

    fn try_from(corners: [Vec3; 4]) -> Result<Self, PortalError> {
        Self::new(corners)
    }
}

/// Why four points are no portal.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PortalError {
    /// NaN, infinite, or so large that squares overflow.
    #[error("corner {0} of the portal is not finite")]
    NotFinite(usize),
    /// On a line or in a point.
    #[error("the portal has no area")]
    NoArea,
    /// The corners lie on no plane.
    #[error("the portal is not flat: a corner is {0} m off the plane of its diagonals")]
    NotFlat(f32),
    /// The sides cross, or a corner turns inwards.
    #[error(
        "the portal is not convex at corner {0}: its corners have to be given around it, one after the other"
    )]
    NotConvex(usize),
}

impl Portal {
    /// A portal with these corners, one after the other around it, in either sense.
    ///
    /// # Errors
    /// When they are not the corners of a flat convex quadrilateral with an area; corners are counted from 0.
    pub fn new(corners: [Vec3; 4]) -> Result<Self, PortalError> {
        const FAR: f32 = 1e9;
        if let Some(corner) = corners.iter().position(|c| c.is_nan() || c.abs().max_element() >= FAR) {
            return Err(PortalError::NotFinite(corner));
        }
        let diagonals = [corners[2] - corners[0], corners[3] - corners[1]];
        let size = diagonals[0].length().max(diagonals[1].length());
        let normal = diagonals[0].cross(diagonals[1]);
        if normal.length() <= 1e-6 * size * size {
            return Err(PortalError::NoArea);
        }
        let normal = normal.normalize();
        let off = 0.5 * normal.dot(corners[1] - corners[0]).abs();
        if off > 1e-3 * size {
            return Err(PortalError::NotFlat(off));
        }
        let turn = |i: usize| {
            let [before, at, after] = [i + 3, i, i + 1].map(|k| corners[k % 4]);
            (at - before).cross(after - at).dot(normal)
        };
        match (0..4).find(|&i| turn(i) <= 1e-6 * size * size) {
            Some(corner) => Err(PortalError::NotConvex(corner)),
            None => Ok(Self { corners }),
        }
    }

    /// Moves the portal by `by`.
    pub(crate) fn shift(&mut self, by: Vec3) {
        self.corners.iter_mut().for_each(|corner| *corner += by);
    }

    /// The corners, around it.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 4] {
        self.corners
    }

    /// Square metres.
    #[must_use]
    pub fn area(&self) -> f32 {
        let [a, b, c, d] = self.corners;
        0.5 * (c - a).cross(d - b).length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn what_is_no_portal_is_refused_with_the_reason() {
        let square = [vec3(0.0, 0.0, 1.0), vec3(2.0, 0.0, 1.0), vec3(2.0, 1.0, 1.0), vec3(0.0, 1.0, 1.0)];
        let portal = Portal::new(square).expect("a rectangle");
        assert_eq!((portal.corners(), portal.area()), (square, 2.0));
        let [a, b, c, d] = square;
        assert!(Portal::new([d, c, b, a]).is_ok(), "the other way around");
        assert!(Portal::new([a, b, c, vec3(1.0, 3.0, 1.0)]).is_ok(), "convex, though no rectangle");
        let error = |corners| Portal::new(corners).expect_err("no portal");
        assert_eq!(error([a, b, vec3(f32::NAN, 0.0, 0.0), d]), PortalError::NotFinite(2));
        assert_eq!(error([a, b, c, vec3(0.0, 1e20, 0.0)]), PortalError::NotFinite(3));
        assert_eq!(error([a; 4]), PortalError::NoArea);
        assert_eq!(error([a, b, a.lerp(b, 0.7), a.lerp(b, 0.2)]), PortalError::NoArea);
        assert!(matches!(error([a, b, c, d + vec3(0.0, 0.0, 0.3)]), PortalError::NotFlat(off) if off > 0.05));
        assert!(
            matches!(error([a, c, b, d]), PortalError::NotConvex(_) | PortalError::NoArea),
            "sides cross"
        );
        assert_eq!(error([a, b, vec3(0.5, 0.3, 1.0), d]), PortalError::NotConvex(2));
        assert!(matches!(error([a, a, b, c]), PortalError::NotConvex(_)), "a triangle");
    }
}
