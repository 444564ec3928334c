//! How a lamp's intensity depends on direction, as a photometric file says it.

use elementary::{cos, sin};
use glam::{Affine3A, DAffine3, DVec3, Quat, Vec3};
use optics::light_profile::profile_azimuth;
use optics::{Vec3f, vec3f};
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;
use std::sync::Arc;

/// Radiant intensity by direction, relative to the greatest.
///
/// A table with a row for each vertical angle, from 0 (where the lamp is aimed) to π in equal steps, and a column for each horizontal
/// angle, from 0 to 2π in equal steps without the end. Between its angles the intensity is linear in both.
#[derive(Clone, Debug, PartialEq)]
pub struct LightProfile {
    rows: u32,
    columns: u32,
    values: Vec<f32>,
    peak: f32,
}

impl LightProfile {
    /// A profile of `rows × columns` intensities in `[0, 1]`, row by row; `peak`: what 1 stands for, in candela. `None` with less
    /// than two rows, no column, or values and peaks that no lamp can have.
    pub fn new(rows: u32, columns: u32, values: Vec<f32>, peak: f32) -> Option<Self> {
        let count = (rows as usize).checked_mul(columns as usize)?;
        let are_shares = values.iter().all(|v| (0.0..=1.0).contains(v));
        let is_peak = peak.is_finite() && peak >= 0.0;
        (rows >= 2 && columns >= 1 && values.len() == count && are_shares && is_peak).then_some(Self {
            rows,
            columns,
            values,
            peak,
        })
    }

    /// Vertical angles.
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// Horizontal angles.
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// Row by row, in `[0, 1]`.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The greatest intensity, in candela.
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// Integral of the profile over all directions, in steradians, each weighed by `weight`, a function of the cosine of the vertical
    /// angle. 4π if nothing depends on direction. Exact where the weight does not change from row to row.
    pub fn integral(&self, weight: impl Fn(f32) -> f32) -> f32 {
        let step = f64::from(PI) / f64::from(self.rows - 1);
        let rows = self.values.chunks(self.columns as usize);
        let mean = |row: &[f32]| row.iter().map(|v| f64::from(*v)).sum::<f64>() / f64::from(self.columns);
        let weighed: Vec<f64> = (0..)
            .zip(rows)
            .map(|(i, row)| mean(row) * f64::from(weight(cos(f64::from(i) * step) as f32)))
            .collect();
        // ∫ (a + (b − a) (θ − θ₀) / step) sin θ dθ, by parts.
        let between = |i: usize| {
            let (low, high) = (i as f64 * step, (i + 1) as f64 * step);
            let (a, b) = (weighed[i], weighed[i + 1]);
            a * cos(low) - b * cos(high) + (b - a) * (sin(high) - sin(low)) / step
        };
        let all: f64 = (0..weighed.len() - 1).map(between).sum();
        (2.0 * std::f64::consts::PI * all) as f32
    }
}

/// A profile on a light. Written down with its table, so that no other file is needed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct Photometry {
    /// The profile.
    pub profile: Arc<LightProfile>,
    /// Unit direction of vertical angle 0, world space.
    pub axis: Vec3,
    /// Unit direction of horizontal angle 0, at right angles to the axis. Horizontal angles grow anticlockwise for who looks at the
    /// lamp from behind.
    pub zero: Vec3,
}

impl Photometry {
    /// A profile that is aimed along a unit `axis`. Of a lamp that is aimed straight down, horizontal angle 0 is towards +X; others are
    /// turned from there by the shortest way, and then by `turn`, radians anticlockwise as seen from behind.
    pub fn aimed(profile: Arc<LightProfile>, axis: Vec3, turn: f32) -> Self {
        let aside = Quat::from_rotation_arc(Vec3::NEG_Y, axis) * Vec3::X;
        let zero = Quat::from_axis_angle(-axis, turn) * aside;
        Self { profile, axis, zero: at_right_angles(zero, axis) }
    }

    /// A profile that a node of glTF carries (`EXT_lights_ies`): it is aimed along the node's −Z axis, and horizontal angle 0 is towards its
    /// +X axis. `world`: node to world, with any scale.
    pub fn at_node(profile: Arc<LightProfile>, world: &DAffine3) -> Self {
        let turn = |d: DVec3| world.transform_vector3(d).normalize_or(d).as_vec3();
        let axis = turn(DVec3::NEG_Z).normalize();
        Self { profile, axis, zero: at_right_angles(turn(DVec3::X), axis) }
    }

    /// The same profile aimed along another unit axis, turned there by the shortest way.
    #[must_use]
    pub fn aimed_along(&self, axis: Vec3) -> Self {
        if axis == self.axis {
            return self.clone();
        }
        let zero = Quat::from_rotation_arc(self.axis, axis) * self.zero;
        Self { profile: self.profile.clone(), axis, zero: at_right_angles(zero, axis) }
    }

    /// The profile moved by `motion`; a mirror moves where it is aimed and its horizontal angle 0, and does not mirror its angles.
    #[must_use]
    pub fn placed(&self, motion: &Affine3A) -> Self {
        let turn = |d: Vec3| motion.transform_vector3(d).try_normalize().unwrap_or(d);
        let axis = turn(self.axis);
        Self { profile: self.profile.clone(), axis, zero: at_right_angles(turn(self.zero), axis) }
    }

    /// What `optics::light_profile` wants to know of horizontal angle 0.
    pub fn azimuth_of_zero(&self) -> f32 {
        profile_azimuth(to_optics(self.axis), 0.0, to_optics(self.zero))
    }
}

/// A profile on a light as it is written down.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    axis: [f32; 3],
    zero: [f32; 3],
    peak: f32,
    rows: u32,
    columns: u32,
    values: Vec<f32>,
}

impl From<Photometry> for Written {
    fn from(photometry: Photometry) -> Self {
        let LightProfile { rows, columns, values, peak } = Arc::unwrap_or_clone(photometry.profile);
        Self { axis: photometry.axis.into(), zero: photometry.zero.into(), peak, rows, columns, values }
    }
}

impl TryFrom<Written> for Photometry {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        let (axis, zero) = (Vec3::from(written.axis), Vec3::from(written.zero));
        let (rows, columns) = (written.rows, written.columns);
        let profile = LightProfile::new(rows, columns, written.values, written.peak)
            .ok_or_else(|| format!("no lamp has such a profile of {rows} × {columns} values"))?;
        if !axis.is_normalized() || !zero.is_normalized() || axis.dot(zero).abs() > 1e-3 {
            return Err("`axis` and `zero` of a profile must have unit length and be at right angles".into());
        }
        Ok(Self { profile: Arc::new(profile), axis, zero })
    }
}

/// The unit vector at right angles to a unit `axis` that is nearest to `v`.
fn at_right_angles(v: Vec3, axis: Vec3) -> Vec3 {
    (v - axis * axis.dot(v)).try_normalize().unwrap_or_else(|| axis.any_orthonormal_vector())
}

fn to_optics(v: Vec3) -> Vec3f {
    vec3f(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_of_known_profiles() {
        let whole = LightProfile::new(2, 1, vec![1.0; 2], 1.0).expect("a profile");
        assert!((whole.integral(|_| 1.0) - 4.0 * PI).abs() < 1e-5);
        // A cosine below the horizon, sampled by degrees: π.
        let cosine = |i: u32| (i as f32).to_radians().cos().max(0.0);
        let lambert = LightProfile::new(181, 1, (0..181).map(cosine).collect(), 1.0).expect("a profile");
        assert!((lambert.integral(|_| 1.0) - PI).abs() < 1e-3, "{}", lambert.integral(|_| 1.0));
        let upper = |cos: f32| if cos < 0.0 { 1.0 } else { 0.0 };
        assert!(lambert.integral(upper) < 1e-3);
        for wrong in [
            LightProfile::new(1, 1, vec![1.0], 1.0),
            LightProfile::new(2, 1, vec![1.0], 1.0),
            LightProfile::new(2, 1, vec![1.0, 1.5], 1.0),
            LightProfile::new(2, 1, vec![1.0, f32::NAN], 1.0),
            LightProfile::new(2, 1, vec![1.0; 2], f32::INFINITY),
        ] {
            assert!(wrong.is_none());
        }
    }

    #[test]
    fn lamps_are_turned_as_they_are_aimed() {
        let profile = Arc::new(LightProfile::new(2, 1, vec![1.0; 2], 1.0).expect("a profile"));
        let down = Photometry::aimed(profile.clone(), Vec3::NEG_Y, 0.0);
        assert!((down.zero - Vec3::X).length() < 1e-6);
        // From above, X turns towards −Z.
        let quarter = Photometry::aimed(profile, Vec3::NEG_Y, 0.5 * PI);
        assert!((quarter.zero - Vec3::NEG_Z).length() < 1e-6);
        let azimuth = profile_azimuth(to_optics(down.axis), down.azimuth_of_zero(), vec3f(0.0, 0.0, -1.0));
        assert!((azimuth.rem_euclid(2.0 * PI) - 0.5 * PI).abs() < 1e-5, "{azimuth}");
        let moved = down.placed(&Affine3A::from_rotation_x(0.5 * PI));
        assert!((moved.axis - Vec3::NEG_Z).length() < 1e-6 && (moved.zero - Vec3::X).length() < 1e-6);
        assert!((down.aimed_along(Vec3::Y).axis - Vec3::Y).length() < 1e-6);
    }
}
