//! A spinning laser scanner.
//!
//! The model of range and intensity, ray by ray of a beam:
//!
//! - Range is what the time of flight tells: half of the way that light went. Inside of glass it counts as often as the
//!   index of refraction says.
//! - Intensity is π times the BSDF for light that goes back where it came from, times the cosine of the angle of incidence.
//!   So a diffuse surface has its albedo times that cosine, and a white one that faces the sensor has 1 at any distance:
//!   the loss by the square of the distance is calibrated away. Of colours, red counts.
//! - Clear surfaces let the beam through. It is refracted at bodies and not at thin panes, and an echo from behind is dimmed
//!   twice by what each passage leaves. What is rough lets through the share of light that it turns by less than 10 mrad.
//!   What a pane or a mirror reflects is lost; it has a return of its own only where light comes back by itself.
//! - Media dim an echo by their extinction, twice. They have no echo of their own.
//! - What is nearer than the least range, or farther than the largest, has no return, but blocks the beam.

use crate::cloud::PointCloud;
use crate::error::SensorError;
use crate::returns::{Echo, ReturnMode, beam_returns};
use alhazen::{BeamEcho, Control, RayQueries};
use elementary::{cos, log, sin, sin_cos, tan};
use glam::{DAffine3, DMat3, DVec3};
use optics::random::{hash_combine, unit_float};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A spinning laser scanner: a column of lasers that turns about the sensor's z axis.
///
/// The sensor's axes are x forward, y left, z up. Firing `i` of a turn points at azimuth `first_azimuth + i · sweep /
/// azimuths`, counter-clockwise seen from above; 0 is forward. The sensor does not move during a turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Lidar {
    /// Elevation of each laser above the horizon, radians, within ±π/2.
    pub elevations: Vec<f64>,
    /// Firings in the sweep.
    pub azimuths: u32,
    /// Azimuth of the first firing, radians.
    pub first_azimuth: f64,
    /// Angle that the firings cover, radians; 2π is a whole turn.
    pub sweep: f64,
    /// Nearest range that is measured, metres. What is nearer blocks the beam.
    pub min_range: f32,
    /// Farthest range that is measured, metres.
    pub max_range: f32,
    /// Full angle of a beam, radians; 0 is a line.
    pub divergence: f64,
    /// Rays that sample a beam, all of the same power; 1 if the divergence is 0.
    pub beam_rays: u32,
    /// Which return counts where a beam meets several surfaces.
    pub mode: ReturnMode,
    /// Surfaces of a beam closer to each other than this melt into one return, metres.
    pub range_resolution: f32,
    /// Standard deviation of the range, metres; normally distributed.
    pub range_noise: f32,
    /// Returns of lower intensity are lost. 0 keeps all, black surfaces and mirrors included, from which no light comes back.
    pub min_intensity: f32,
    /// Changes the noise.
    pub seed: u32,
}

/// The golden angle: points at its multiples, on radii of the square roots, fill a disc evenly.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

impl Lidar {
    /// Lasers at equal angles between two elevations (radians), without noise or divergence, that see from 0.5 to 120 m.
    pub fn uniform(channels: u32, lowest: f64, highest: f64, azimuths: u32) -> Self {
        let step = if channels > 1 { (highest - lowest) / f64::from(channels - 1) } else { 0.0 };
        Self {
            elevations: (0..channels).map(|i| lowest + step * f64::from(i)).collect(),
            azimuths,
            first_azimuth: 0.0,
            sweep: TAU,
            min_range: 0.5,
            max_range: 120.0,
            divergence: 0.0,
            beam_rays: 1,
            mode: ReturnMode::Strongest,
            range_resolution: 0.3,
            range_noise: 0.0,
            min_intensity: 0.0,
            seed: 0,
        }
    }

    /// Unit direction of a beam's axis in the sensor's frame.
    pub fn direction(&self, channel: usize, firing: u32) -> DVec3 {
        let azimuth = self.first_azimuth + self.sweep * f64::from(firing) / f64::from(self.azimuths);
        let elevation = self.elevations.get(channel).copied().unwrap_or_default();
        let (up, across) = sin_cos(elevation);
        DVec3::new(across * cos(azimuth), across * sin(azimuth), up)
    }

    /// One sweep from `pose` (sensor to world: a rotation and a translation). Points come firing by firing, the channels of a
    /// firing together, several returns of a beam nearest first; beams without a return are left out.
    ///
    /// # Errors
    /// [`SensorError::Setting`] for impossible settings, [`SensorError::Cancelled`].
    pub fn scan(
        &self,
        queries: &RayQueries,
        pose: &DAffine3,
        control: &Control,
    ) -> Result<PointCloud, SensorError> {
        self.check(pose)?;
        let (channels, rays) = (self.elevations.len(), self.beam_rays as usize);
        let beams = channels * self.azimuths as usize;
        let origin = pose.translation.as_vec3().to_array();
        let beam_axis = |beam: usize| self.direction(beam % channels, (beam / channels) as u32);
        let direction = |ray: usize| {
            let axis = beam_axis(ray / rays);
            pose.transform_vector3(self.in_beam(axis, ray % rays)).normalize().as_vec3().to_array()
        };
        let returns = |_, echoes: &mut Vec<BeamEcho>| {
            let measured = echoes.iter().filter(|e| e.range >= self.min_range).map(Echo::from);
            beam_returns(&mut measured.collect::<Vec<_>>(), self.beam_rays, self.range_resolution, self.mode)
        };
        let found = queries.beams((beams, rays), (origin, self.max_range), control, direction, returns);
        if control.is_cancelled() {
            return Err(SensorError::Cancelled);
        }
        let mut cloud = PointCloud::default();
        for (beam, returns) in found.iter().enumerate() {
            for (number, echo) in (0..).zip(returns).filter(|(_, e)| e.intensity >= self.min_intensity) {
                let range = echo.range + self.range_noise * self.normal_number(beam as u32, number);
                let position = (beam_axis(beam) * f64::from(range)).as_vec3().to_array();
                let (channel, firing) = ((beam % channels) as u16, (beam / channels) as u32);
                cloud.push(position, range, echo.intensity, channel, firing, echo.instance);
            }
        }
        Ok(cloud)
    }

    /// Unit direction of one of a beam's rays: on a sunflower pattern that fills the beam's disc.
    fn in_beam(&self, axis: DVec3, ray: usize) -> DVec3 {
        if self.divergence <= 0.0 {
            return axis;
        }
        let (x, y) = axis.any_orthonormal_pair();
        let radius = tan(0.5 * self.divergence) * ((ray as f64 + 0.5) / f64::from(self.beam_rays)).sqrt();
        let (sin, cos) = sin_cos(GOLDEN_ANGLE * ray as f64);
        (axis + (x * cos + y * sin) * radius).normalize()
    }

    /// A number of the standard normal distribution that belongs to a return of a beam. Method: Box and Muller, 1958.
    fn normal_number(&self, beam: u32, number: u32) -> f32 {
        if self.range_noise <= 0.0 {
            return 0.0;
        }
        let mut bits = hash_combine(self.seed, beam);
        if number > 0 {
            bits = hash_combine(bits, number.wrapping_add(1));
        }
        let (u, v) = (unit_float(bits), unit_float(hash_combine(bits, 1)));
        (-2.0 * log(f64::from(1.0 - u))).sqrt() as f32 * cos(std::f32::consts::TAU * v)
    }

    fn check(&self, pose: &DAffine3) -> Result<(), SensorError> {
        fn bad(name: &'static str, value: impl ToString, problem: &'static str) -> SensorError {
            SensorError::setting(name, value, problem)
        }
        let count = self.elevations.len();
        if count == 0 || count > usize::from(u16::MAX) {
            return Err(bad("channels", count, "is not between 1 and 65535"));
        }
        if let Some(e) = self.elevations.iter().find(|e| !(-FRAC_PI_2..=FRAC_PI_2).contains(*e)) {
            return Err(bad("elevation", e, "is not within ±π/2 radians"));
        }
        if self.azimuths == 0 {
            return Err(bad("azimuths", 0, "leaves no firings"));
        }
        if !(self.first_azimuth.is_finite() && self.sweep > 0.0 && self.sweep <= TAU) {
            return Err(bad("sweep", self.sweep, "is not between 0 and 2π radians"));
        }
        if !(self.min_range >= 0.0 && self.min_range < self.max_range) {
            return Err(bad(
                "range",
                format!("{}..{}", self.min_range, self.max_range),
                "is empty or negative",
            ));
        }
        if !(0.0..=1.0).contains(&self.divergence) {
            return Err(bad("divergence", self.divergence, "is not between 0 and 1 radian"));
        }
        if !(1..=4096).contains(&self.beam_rays) {
            return Err(bad("beam rays", self.beam_rays, "is not between 1 and 4096"));
        }
        let rays = count as u64 * u64::from(self.azimuths) * u64::from(self.beam_rays);
        if rays > 1 << 31 {
            return Err(bad("rays", rays, "is more than 2³¹ for one sweep"));
        }
        let lengths = [("range noise", self.range_noise), ("range resolution", self.range_resolution)];
        for (name, value) in lengths.into_iter().chain([("min intensity", self.min_intensity)]) {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(bad(name, value, "is not a number of at least 0"));
            }
        }
        let turned = pose.matrix3 * pose.matrix3.transpose() - DMat3::IDENTITY;
        let rotates =
            turned.to_cols_array().iter().all(|e| e.abs() < 1e-4) && pose.matrix3.determinant() > 0.0;
        if !(rotates && pose.translation.is_finite()) {
            return Err(bad("pose", format!("{pose:?}"), "is not a rotation and a translation"));
        }
        Ok(())
    }
}

/// The pose of a sensor that stands level at `position` in a world with +Y up. `heading` (radians) turns it about +Y,
/// counter-clockwise seen from above; 0 looks towards -Z.
pub fn level_pose(position: DVec3, heading: f64) -> DAffine3 {
    // Columns: where the sensor's x (forward), y (left) and z (up) point.
    let level = DMat3::from_cols(DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y);
    DAffine3::from_mat3_translation(DMat3::from_rotation_y(heading) * level, position)
}
