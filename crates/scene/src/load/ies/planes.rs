//! Photometry of types A and B: directions by two angles from −90° to 90°, as of floodlights and headlights, which shine to one side.
//!
//! Both angles are 0 where the lamp is aimed. Vertical angles grow upwards, horizontal ones clockwise as seen from above: to the right of
//! who looks where the lamp is aimed. Source: ANSI/IESNA LM-63-2002, section 3, and CIE 121.

use super::{Lamp, VERTICAL_STEPS, bracket, step_of};
use elementary::{asin, atan2, sin_cos};

/// Which planes angles are measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Planes {
    /// Type A: planes through the vertical axis; the horizontal angle says which, the vertical one where in it.
    Upright,
    /// Type B: planes through the horizontal axis that is across the lamp; the vertical angle says which, the horizontal one where in it.
    Across,
}

/// Below this, cosines of right angles are rounding errors.
const ROUNDING: f64 = 1e-9;

impl Planes {
    /// Vertical and horizontal angle of a direction of type C, all in degrees. What is above the lamp here has the horizontal angle 0
    /// there.
    pub fn angles(self, vertical: f64, horizontal: f64) -> [f64; 2] {
        let [(sin, cos), (sin_around, cos_around)] = [vertical, horizontal].map(|a| sin_cos(a.to_radians()));
        let exact = |v: f64| if v.abs() < ROUNDING { 0.0 } else { v };
        // Type C counts anticlockwise.
        let [forward, up, right] = [cos, sin * cos_around, -sin * sin_around].map(exact);
        let angles = match self {
            Self::Upright => [asin(up.clamp(-1.0, 1.0)), atan2(right, forward)],
            Self::Across => [atan2(up, forward), asin(right.clamp(-1.0, 1.0))],
        };
        angles.map(f64::to_degrees)
    }
}

impl Lamp {
    /// Steps of the table in degrees, vertical and horizontal: directions of planes fall between them, so they are as fine as the finest
    /// that the file has, or finer.
    pub(super) fn steps_of_planes(&self) -> (f64, f64) {
        let all = [&self.vertical[..], &self.horizontal].concat();
        let down = step_of(&all, &VERTICAL_STEPS);
        (down, if down < 1.0 { 0.5 } else { 1.0 })
    }

    /// The intensity without factors in a direction of type C, degrees; 0 where nothing was measured. Lamps whose first horizontal angle is
    /// 0 are the same on both sides.
    pub(super) fn candela_of_planes(&self, planes: Planes, vertical: f64, horizontal: f64) -> f64 {
        let [vertical, horizontal] = planes.angles(vertical, horizontal);
        let horizontal = if self.horizontal[0] == 0.0 { horizontal.abs() } else { horizontal };
        let (Some((row, down)), Some((column, across))) =
            (bracket(&self.vertical, vertical), bracket(&self.horizontal, horizontal))
        else {
            return 0.0;
        };
        let at = |column: usize| {
            let values = &self.candelas[column * self.vertical.len()..(column + 1) * self.vertical.len()];
            values[row] + (values[row + 1] - values[row]) * down
        };
        at(column) + (at(column + 1) - at(column)) * across
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_of_planes_are_those_of_directions() {
        for planes in [Planes::Upright, Planes::Across] {
            let near = |vertical, horizontal, expected: [f64; 2]| {
                let found = planes.angles(vertical, horizontal);
                let far = found.iter().zip(expected).any(|(a, b)| (a - b).abs() > 1e-9);
                assert!(!far, "{planes:?}: {found:?} instead of {expected:?}");
            };
            near(0.0, 77.0, [0.0, 0.0]);
            near(30.0, 0.0, [30.0, 0.0]);
            near(30.0, 180.0, [-30.0, 0.0]);
            // Anticlockwise is to the left.
            near(30.0, 90.0, [0.0, -30.0]);
            near(30.0, 270.0, [0.0, 30.0]);
        }
        // Half to the right, half upwards, by 45° first one way and then the other.
        let aside = [1.0_f64, std::f64::consts::SQRT_2];
        let [v, h] = Planes::Upright.angles(60.0, -(aside[0].atan2(aside[1])).to_degrees());
        assert!((v - 45.0).abs() < 1e-9 && (h - 45.0).abs() < 1e-9, "{v} {h}");
        let [v, h] = Planes::Across.angles(60.0, -(aside[1].atan2(aside[0])).to_degrees());
        assert!((v - 45.0).abs() < 1e-9 && (h - 45.0).abs() < 1e-9, "{v} {h}");
    }
}
