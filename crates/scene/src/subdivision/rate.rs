//! How finely a surface is cut.

use crate::{Camera, Projection};
use elementary::{atan, tan};
use glam::{Affine3A, Vec3};
use serde::{Deserialize, Serialize};

/// When faces are split.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rate {
    /// All faces so often.
    Levels(u32),
    /// Until no edge is longer, in units of the object; at most so often.
    Length {
        /// Length of the longest edge.
        most: f32,
        /// See [`Rate::levels`].
        levels: u32,
    },
    /// Until no edge is longer, in pixels of the picture; at most so often.
    Pixels {
        /// Length of the longest edge.
        most: f32,
        /// See [`Rate::levels`].
        levels: u32,
    },
}

impl Rate {
    /// Faces are not split more often.
    pub const MOST_LEVELS: u32 = 12;
    /// How often faces are split at most if nothing else is said, where edges decide.
    pub const USUAL_LEVELS: u32 = 8;

    /// How often faces are split at most.
    pub fn levels(&self) -> u32 {
        match *self {
            Self::Levels(levels) | Self::Length { levels, .. } | Self::Pixels { levels, .. } => {
                levels.min(Self::MOST_LEVELS)
            }
        }
    }
}

/// Outside of the picture edges may be so many times as long.
const UNSEEN: f32 = 4.0;
/// By how much the cone of what is seen is wider than the picture's diagonal.
const MARGIN: f32 = 1.1;
/// Of more instances than this only the nearest ones count.
const MOST_INSTANCES: usize = 16;

/// How large things are in the picture.
///
/// An edge counts as long as if it were seen from the side, so what is true of the picture is true of mirrors and shadows.
#[derive(Clone, Debug)]
pub struct PixelScale {
    /// From the object to the camera's space, for each place where it stands.
    places: Vec<Affine3A>,
    /// Size of a pixel, metres: at a metre's distance, or anywhere.
    pixel: f32,
    /// Whether the pixel's size is the same at any distance.
    parallel: bool,
    /// Tangent of half the angle of the cone that is seen; infinite if there is none.
    cone: f32,
}

impl PixelScale {
    /// The scale of an object that stands in `instances` (object to world), seen by a camera in a picture `height` pixels
    /// high.
    pub fn new(camera: &Camera, height: u32, instances: &[Affine3A], bounds: [Vec3; 2]) -> Self {
        let to_camera = camera.world_to_camera();
        let mut places: Vec<Affine3A> = instances.iter().map(|instance| to_camera * *instance).collect();
        let middle = 0.5 * (bounds[0] + bounds[1]);
        let distance = |place: &Affine3A| {
            let size = place.transform_vector3(bounds[1] - bounds[0]).length();
            place.transform_point3(middle).length() - 0.5 * size
        };
        places.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        places.truncate(MOST_INSTANCES);
        let projection = &camera.projection;
        let cone = match projection {
            Projection::Perspective { fov_y } => {
                let half = projection.half_size(camera.aspect.unwrap_or(16.0 / 9.0));
                if *fov_y < 2.5 { tan((atan(half.length()) * MARGIN).min(1.5)) } else { f32::INFINITY }
            }
            _ => f32::INFINITY,
        };
        Self {
            places,
            pixel: projection.seen_height(1.0) / height.max(1) as f32,
            parallel: matches!(projection, Projection::Orthographic { .. }),
            cone,
        }
    }

    /// Length of an edge in pixels, in the place where it is largest.
    pub fn pixels(&self, a: Vec3, b: Vec3) -> f32 {
        let at = |place: &Affine3A| self.at(place.transform_point3(a), place.transform_point3(b));
        self.places.iter().map(at).fold(0.0, f32::max)
    }

    fn at(&self, a: Vec3, b: Vec3) -> f32 {
        let edge = b - a;
        let length = edge.length();
        if self.parallel {
            return length / self.pixel;
        }
        let along = if length > 0.0 { (-a.dot(edge) / (length * length)).clamp(0.0, 1.0) } else { 0.0 };
        let nearest = a + edge * along;
        let distance = nearest.length();
        let pixels = length / (self.pixel * distance).max(f32::MIN_POSITIVE);
        let is_unseen = |p: Vec3| p.truncate().length() > -p.z * self.cone;
        // Both ends of a long edge may be unseen while its middle is not.
        if 4.0 * length < distance && is_unseen(a) && is_unseen(b) { pixels / UNSEEN } else { pixels }
    }
}
