//! Instances that move while rays leave: where they are at a ray's time, and what bounds them all
//! the while.

use crate::aabb::Aabb;
use optics::motion::{MotionSegment, motion_at};
use std::ops::Range;
use std::sync::Arc;

/// How the instances of a [`Tlas`](crate::Tlas) move; time runs from 0 to 1.
#[derive(Clone, Debug, Default)]
pub struct InstanceMotions {
    /// Segments of all motions.
    pub segments: Arc<[MotionSegment]>,
    /// For each instance: which segments are its motion. Empty where it stands still.
    pub of_instances: Vec<Range<u32>>,
}

impl InstanceMotions {
    /// The segments of an instance; none if it stands still.
    pub fn of(&self, instance: usize) -> &[MotionSegment] {
        let range = self.of_instances.get(instance).cloned().unwrap_or(0..0);
        &self.segments[range.start as usize..range.end as usize]
    }
}

/// Bounds of all that an object covers during a motion.
///
/// - `bounds`: of the object, in its own space. `placed`: its bounds under a transform.
///
/// Each segment is cut into pieces: see [`MotionSegment::pieces`].
pub(crate) fn motion_bounds(
    motion: &[MotionSegment],
    bounds: &Aabb,
    placed: impl Fn(&[[f32; 4]; 3]) -> Aabb,
) -> Aabb {
    let mut all = Aabb::EMPTY;
    for segment in motion {
        let (pieces, room) = segment.pieces(bounds.extent());
        let share = 1.0 / pieces as f32;
        for piece in 0..=pieces {
            let Aabb { min, max } = placed(&motion_at(*segment, piece as f32 * share).rows());
            all = all.union(Aabb { min: min.map(|x| x - room), max: max.map(|x| x + room) });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use optics::motion::{AffineRows, affine_point};
    use optics::{vec3f, vec4f};

    /// A turn by `angle` about z, with translation and stretch.
    fn turn(angle: f32, stretch: f32) -> MotionSegment {
        let zero = vec4f(0.0, 0.0, 0.0, 0.0);
        MotionSegment {
            translation: vec4f(-1.0, 0.5, 2.0, angle * 0.5),
            translation_step: vec4f(1.0, -3.0, 0.5, 0.0),
            rotation: vec4f(0.0, 0.0, 0.0, 1.0),
            rotation_step: vec4f(0.0, 0.6, 0.8, 0.0),
            stretch: vec4f(1.0, 1.0, 1.0, 0.0),
            stretch_step: vec4f(stretch, 0.0, 0.0, 0.0),
            shear: zero,
            shear_step: vec4f(0.1, 0.0, stretch, 0.0),
        }
    }

    /// No point leaves the bounds, at any time; the bounds are not much larger than what the points
    /// cover.
    #[test]
    fn arcs_stay_in_their_bounds() {
        let object = Aabb { min: [2.0, -1.0, -0.5], max: [3.0, 1.0, 0.5] };
        let corners: Vec<_> = (0..8u32)
            .map(|i| [0, 1, 2].map(|a| if i >> a & 1 == 0 { object.min[a] } else { object.max[a] }))
            .collect();
        let placed = |rows: &[[f32; 4]; 3]| {
            let m = AffineRows::from_rows(*rows);
            let point = |p: &[f32; 3]| affine_point(m, vec3f(p[0], p[1], p[2])).to_array();
            corners.iter().fold(Aabb::EMPTY, |all, p| all.with_point(point(p)))
        };
        for motion in [
            vec![turn(0.0, 0.0)],
            vec![turn(3.1, 0.0)],
            vec![turn(1.0, 2.0), turn(3.0, -0.7)],
            vec![turn(0.05, 0.0)],
        ] {
            let bounds = motion_bounds(&motion, &object, placed);
            let mut covered = Aabb::EMPTY;
            for i in 0..=20_000 {
                covered = covered.union(placed(&AffineRows::of_motion(&motion, i as f32 / 20_000.0).rows()));
            }
            assert!(bounds.contains(&covered), "{bounds:?} {covered:?}");
            for a in 0..3 {
                let extra = (bounds.max[a] - bounds.min[a]) - (covered.max[a] - covered.min[a]);
                assert!(extra < 0.03 * (covered.max[a] - covered.min[a]), "{bounds:?} {covered:?}");
            }
        }
    }
}
