//! The clear sky and the sun above it, by where the sun stands and how hazy the air is.
//!
//! Source: Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999: the sky's luminance and
//! chromaticity (section 3.2, appendix A.2), sunlight (appendix A.1) and the sun's position (appendix A.6). It is evaluated once, for the
//! environment's table of radiance, which back ends then read like a picture.

use crate::{Image, Pixels, Sun};
use elementary::{acos, asin, atan2, cos, exp, pow, powi, sin, sin_cos, tan};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use std::str::FromStr;

/// Lumens of a watt of radiant power in the units of this program: luminance = 683 × (0.2126 R + 0.7152 G + 0.0722 B).
const LUMENS_PER_WATT: f64 = 683.0;
/// Illuminance of the sun outside the atmosphere, lux.
const SOLAR_ILLUMINANCE: f64 = 133_300.0;
/// Colour of the sun outside the atmosphere, luminance 1: a black body of 5778 K, linear Rec. 709.
const SOLAR_COLOR: [f64; 3] = [1.111, 0.976, 0.914];
/// Wavelengths that stand for the primaries, µm.
const WAVELENGTHS: [f64; 3] = [0.615, 0.535, 0.445];
/// Absorption by ozone at these wavelengths, 1/cm; the layer is 0.35 cm thick.
const OZONE: [f64; 3] = [0.105, 0.07, 0.003];
/// Angular radius of the sun, radians.
const SUN_RADIUS: f32 = 0.00465;
/// Size of the table, pixels.
const TABLE_HEIGHT: u32 = 256;

/// A clear sky with its sun.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Daylight {
    /// Where the sun stands.
    pub sun: SunPosition,
    /// Haziness of the air: 2 is very clear, 3 clear, 6 hazy, 10 the limit of the model.
    pub turbidity: f32,
    /// Share of light that the ground below the horizon reflects, linear RGB in `[0, 1]`.
    pub ground: Vec3,
    /// Factor on everything; 1 is W·sr⁻¹·m⁻².
    pub intensity: f32,
}

/// Where the sun stands. North is −Z, east is +X.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SunPosition {
    /// Angle above the horizon, radians, in `[0, π/2]`.
    pub elevation: f64,
    /// Angle from north over east, radians.
    pub azimuth: f64,
}

/// Why there is no such position of the sun.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SunError {
    /// Neither two angles nor a moment and a place.
    #[error(
        "`{0}` is neither ELEVATION,AZIMUTH in degrees nor DATE`T`TIME+ZONE@LATITUDE,LONGITUDE, such as 2026-06-21T14:30+02:00@48.14,11.58"
    )]
    Text(String),
    /// A number out of its range.
    #[error("{name} is {value}, which is not between {low} and {high}")]
    Range {
        /// What it is.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The least that it can be.
        low: f64,
        /// The most that it can be.
        high: f64,
    },
    /// Night.
    #[error("the sun is {0:.1}° below the horizon then and there")]
    Night(f64),
}

impl SunPosition {
    /// From angles in degrees.
    ///
    /// # Errors
    /// An elevation outside 0 to 90, or an azimuth that is not finite.
    pub fn from_degrees(elevation: f64, azimuth: f64) -> Result<Self, SunError> {
        let elevation = in_range("the elevation", elevation, 0.0, 90.0)?.to_radians();
        let azimuth = in_range("the azimuth", azimuth, -360.0, 360.0)?.to_radians();
        Ok(Self { elevation, azimuth })
    }

    /// From a moment and a place, to about half a degree.
    ///
    /// - `day`: of the year, 1 to 366. `hour`: in `[0, 24]`, by clocks that are `zone` hours before UTC.
    /// - `latitude` north and `longitude` east in degrees.
    ///
    /// # Errors
    /// A number out of range, or a sun below the horizon.
    pub fn at(day: f64, hour: f64, zone: f64, latitude: f64, longitude: f64) -> Result<Self, SunError> {
        let day = in_range("the day of the year", day, 1.0, 366.0)?;
        let hour = in_range("the hour", hour, 0.0, 24.0)?;
        let zone = in_range("the time zone", zone, -14.0, 14.0)?;
        let latitude = in_range("the latitude", latitude, -90.0, 90.0)?.to_radians();
        let longitude = in_range("the longitude", longitude, -180.0, 180.0)?;
        let turn = |offset: f64, period: f64| 2.0 * PI * (day - offset) / period;
        let equation_of_time = 0.170 * sin(2.0 * turn(80.0, 373.0)) - 0.129 * sin(turn(8.0, 355.0));
        let solar_hour = hour + equation_of_time + longitude / 15.0 - zone;
        let declination = 0.4093 * sin(turn(81.0, 368.0));
        // 0 at noon, positive in the afternoon.
        let angle = PI * (solar_hour - 12.0) / 12.0;
        let up = sin(latitude) * sin(declination) + cos(latitude) * cos(declination) * cos(angle);
        let east = -cos(declination) * sin(angle);
        let north = cos(latitude) * sin(declination) - sin(latitude) * cos(declination) * cos(angle);
        let elevation = asin(up.clamp(-1.0, 1.0));
        if elevation < 0.0 {
            return Err(SunError::Night(-elevation.to_degrees()));
        }
        Ok(Self { elevation, azimuth: atan2(east, north) })
    }

    /// Unit direction towards the sun.
    pub fn direction(&self) -> DVec3 {
        let (up, across) = sin_cos(self.elevation);
        let (east, north) = sin_cos(self.azimuth);
        DVec3::new(across * east, up, -across * north)
    }
}

fn in_range(name: &'static str, value: f64, low: f64, high: f64) -> Result<f64, SunError> {
    // Not a number is in no range.
    if (low..=high).contains(&value) { Ok(value) } else { Err(SunError::Range { name, value, low, high }) }
}

impl FromStr for SunPosition {
    type Err = SunError;

    /// `ELEVATION,AZIMUTH` in degrees, or a moment and a place: `2026-06-21T14:30+02:00@48.14,11.58`.
    fn from_str(text: &str) -> Result<Self, SunError> {
        let unknown = || SunError::Text(text.to_owned());
        let pair = |text: &str| -> Option<(f64, f64)> {
            let (a, b) = text.split_once(',')?;
            Some((a.trim().parse().ok()?, b.trim().parse().ok()?))
        };
        let Some((moment, place)) = text.split_once('@') else {
            let (elevation, azimuth) = pair(text).ok_or_else(unknown)?;
            return Self::from_degrees(elevation, azimuth);
        };
        let (latitude, longitude) = pair(place).ok_or_else(unknown)?;
        let (date, time) = moment.split_once('T').ok_or_else(unknown)?;
        let sign_at = time.find(['+', '-', 'Z']).ok_or_else(unknown)?;
        let (clock, zone) = time.split_at(sign_at);
        let zone = match zone.split_at(1) {
            ("Z", "") => 0.0,
            ("+", hours) => hours_of(hours).ok_or_else(unknown)?,
            ("-", hours) => -hours_of(hours).ok_or_else(unknown)?,
            _ => return Err(unknown()),
        };
        let day = day_of_year(date).ok_or_else(unknown)?;
        Self::at(day, hours_of(clock).ok_or_else(unknown)?, zone, latitude, longitude)
    }
}

/// `HH:MM`, with or without seconds, in hours.
fn hours_of(text: &str) -> Option<f64> {
    let mut hours = 0.0;
    for (part, unit) in text.split(':').zip([1.0, 1.0 / 60.0, 1.0 / 3600.0]) {
        hours += f64::from(part.parse::<u8>().ok()?) * unit;
    }
    (text.split(':').count() <= 3).then_some(hours)
}

/// The number of a day `YEAR-MONTH-DAY` in its year, from 1.
fn day_of_year(date: &str) -> Option<f64> {
    let mut parts = date.splitn(3, '-').map(|part| part.parse::<u32>().ok());
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let lengths = [31, 28 + u32::from(leap), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let index = month.checked_sub(1).filter(|m| *m < 12)? as usize;
    let valid = (1..=lengths[index]).contains(&day);
    valid.then(|| f64::from(lengths[..index].iter().sum::<u32>() + day))
}

impl Daylight {
    /// The sun's disc as a light: the sun's irradiance on a surface that faces it.
    pub fn sun(&self) -> Sun {
        let irradiance =
            sun_irradiance(self.sun.elevation, f64::from(self.turbidity)) * f64::from(self.intensity);
        let direction = self.sun.direction().as_vec3().normalize();
        Sun { direction, irradiance: irradiance.as_vec3(), angular_radius: SUN_RADIUS }
    }

    /// The sky and the ground, without the sun, as an equirectangular picture.
    pub(crate) fn image(&self) -> Image {
        let sky = Perez::new(f64::from(self.turbidity), FRAC_PI_2 - self.sun.elevation);
        let sun = self.sun.direction();
        let (width, height) = (2 * TABLE_HEIGHT, TABLE_HEIGHT);
        let intensity = f64::from(self.intensity);
        let upper: Vec<DVec3> = (0..width * height / 2)
            .into_par_iter()
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let uv = optics::vec2f((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
                let direction = optics::sky::equirect_to_direction(uv, 0.0).to_array();
                sky.radiance(DVec3::from_array(direction.map(f64::from)), sun) * intensity
            })
            .collect();
        let sunlight = self.sun().irradiance.as_dvec3() * sin(self.sun.elevation);
        let ground = self.ground.as_dvec3() * (irradiance(&upper, width) + sunlight) / PI;
        let below = std::iter::repeat_n(ground, upper.len());
        let pixels = upper.iter().copied().chain(below).map(|c| c.as_vec3().to_array()).collect();
        Image { name: "daylight".into(), width, height, pixels: Pixels::Rgb32F(pixels) }
    }
}

/// Irradiance of a level surface from the upper half of an equirectangular picture.
fn irradiance(upper: &[DVec3], width: u32) -> DVec3 {
    let step = PI / f64::from(width / 2);
    let weighted = upper.iter().zip(0u32..).map(|(radiance, i)| {
        let theta = (f64::from(i / width) + 0.5) * step;
        *radiance * (cos(theta) * sin(theta) * step * step)
    });
    weighted.sum()
}

/// Irradiance of a surface that faces the sun, W/m², linear RGB.
fn sun_irradiance(elevation: f64, turbidity: f64) -> DVec3 {
    // Optical mass of the air: Kasten's formula.
    let mass = 1.0 / (sin(elevation) + 0.15 * pow(elevation.to_degrees() + 3.885, -1.253));
    let haze = (0.046_08 * turbidity - 0.045_86).max(0.0);
    let through = |i: usize| {
        let wavelength = WAVELENGTHS[i];
        let rayleigh = 0.008_735 * pow(wavelength, -4.08);
        let aerosol = haze * pow(wavelength, -1.3);
        exp(-mass * (rayleigh + aerosol + OZONE[i] * 0.35))
    };
    let watts = SOLAR_ILLUMINANCE / LUMENS_PER_WATT;
    DVec3::from_array([0, 1, 2].map(|i| watts * SOLAR_COLOR[i] * through(i)))
}

/// Perez's distribution of luminance and of the two chromaticities.
struct Perez {
    /// Value at the zenith divided by the distribution there, for Y (kcd/m²), x and y.
    scale: [f64; 3],
    /// A to E for Y, x and y.
    coefficients: [[f64; 5]; 3],
}

impl Perez {
    /// `sun_theta`: the sun's angle from the zenith, radians.
    fn new(turbidity: f64, sun_theta: f64) -> Self {
        let t = turbidity;
        let line = |slope: f64, constant: f64| slope * t + constant;
        let coefficients = [
            [
                line(0.1787, -1.4630),
                line(-0.3554, 0.4275),
                line(-0.0227, 5.3251),
                line(0.1206, -2.5771),
                line(-0.0670, 0.3703),
            ],
            [
                line(-0.0193, -0.2592),
                line(-0.0665, 0.0008),
                line(-0.0004, 0.2125),
                line(-0.0641, -0.8989),
                line(-0.0033, 0.0452),
            ],
            [
                line(-0.0167, -0.2608),
                line(-0.0950, 0.0092),
                line(-0.0079, 0.2102),
                line(-0.0441, -1.6537),
                line(-0.0109, 0.0529),
            ],
        ];
        let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * sun_theta);
        let luminance = ((4.0453 * t - 4.9710) * tan(chi) - 0.2155 * t + 2.4192).max(0.0);
        let cubic = |c: [f64; 4]| ((c[0] * sun_theta + c[1]) * sun_theta + c[2]) * sun_theta + c[3];
        let chromaticity = |rows: [[f64; 4]; 3]| (cubic(rows[0]) * t + cubic(rows[1])) * t + cubic(rows[2]);
        let x = chromaticity([
            [0.001_66, -0.003_75, 0.002_09, 0.0],
            [-0.029_03, 0.063_77, -0.032_02, 0.003_94],
            [0.116_93, -0.211_96, 0.060_52, 0.258_86],
        ]);
        let y = chromaticity([
            [0.002_75, -0.006_10, 0.003_17, 0.0],
            [-0.042_14, 0.089_70, -0.041_53, 0.005_16],
            [0.153_46, -0.267_56, 0.066_70, 0.266_88],
        ]);
        let zenith = [luminance, x, y];
        let scale = [0, 1, 2].map(|i| zenith[i] / distribution(&coefficients[i], 1.0, sun_theta));
        Self { scale, coefficients }
    }

    /// Radiance from a unit direction above the horizon, W·sr⁻¹·m⁻², linear RGB; colours outside Rec. 709 are clipped.
    fn radiance(&self, direction: DVec3, sun: DVec3) -> DVec3 {
        // Within the model, the horizon itself is infinitely far away.
        let cos_theta = direction.y.max(1e-3);
        let gamma = acos(direction.dot(sun).clamp(-1.0, 1.0));
        let value = |i: usize| self.scale[i] * distribution(&self.coefficients[i], cos_theta, gamma);
        let (luminance, x, y) = (value(0).max(0.0) * 1000.0 / LUMENS_PER_WATT, value(1), value(2).max(1e-3));
        let (big_x, big_z) = (x / y * luminance, (1.0 - x - y) / y * luminance);
        let rgb = DVec3::new(
            3.240_454_2 * big_x - 1.537_138_5 * luminance - 0.498_531_4 * big_z,
            -0.969_266 * big_x + 1.876_010_8 * luminance + 0.041_556 * big_z,
            0.055_643_4 * big_x - 0.204_025_9 * luminance + 1.057_225_2 * big_z,
        );
        rgb.max(DVec3::ZERO)
    }
}

/// Perez's formula; `gamma` is the angle from the sun.
fn distribution([a, b, c, d, e]: &[f64; 5], cos_theta: f64, gamma: f64) -> f64 {
    (1.0 + a * exp(b / cos_theta)) * (1.0 + c * exp(d * gamma) + e * powi(cos(gamma), 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: DVec3) -> f64 {
        c.dot(DVec3::new(0.2126, 0.7152, 0.0722)) * LUMENS_PER_WATT
    }

    fn parse(text: &str) -> SunPosition {
        text.parse().unwrap_or_else(|error| panic!("{error}"))
    }

    /// On the days of the solstices and of the equinox, at solar noon, the elevation is known by geometry.
    #[test]
    fn the_sun_is_where_astronomy_has_it() {
        for (date, latitude, expected) in [
            ("2026-06-21", 48.0, 65.4),
            ("2026-12-21", 48.0, 18.6),
            ("2026-03-20", 0.0, 90.0),
            ("2026-03-20", 60.0, 30.0),
        ] {
            let highest = (0..24 * 12).filter_map(|i| {
                let text = format!("{date}T{:02}:{:02}Z@{latitude},0", i / 12, i % 12 * 5);
                text.parse::<SunPosition>().ok().map(|sun| sun.elevation.to_degrees())
            });
            let highest = highest.fold(0.0, f64::max);
            assert!((highest - expected).abs() < 1.0, "{date} at {latitude}°: {highest}° for {expected}°");
        }
        // Munich at 16:44 solar time, hour angle 71°, declination 23.44°: by spherical trigonometry 29.7° and 272.8°.
        let evening = parse("2026-06-21T18:00+02:00@48.14,11.58");
        let azimuth = evening.azimuth.to_degrees().rem_euclid(360.0);
        let elevation = evening.elevation.to_degrees();
        assert!((elevation - 29.7).abs() < 1.0 && (azimuth - 272.8).abs() < 1.0, "{elevation}° {azimuth}°");
        assert!(evening.direction().x < -0.8, "in the west");
    }

    #[test]
    fn angles_and_nonsense_are_told_apart() {
        let south = parse("30, 180").direction();
        assert!((south - DVec3::new(0.0, 0.5, 0.75f64.sqrt())).length() < 1e-6, "{south}");
        assert!(matches!("91,0".parse::<SunPosition>(), Err(SunError::Range { .. })));
        assert!(matches!("2026-06-21T00:00Z@48,11".parse::<SunPosition>(), Err(SunError::Night(_))));
        for text in [
            "",
            "30",
            "a,b",
            "2026-02-30T12:00Z@0,0",
            "2026-02-03T12@0,0",
            "2026-02-03T12:00+1:2:3:4@0,0",
            "nan,0",
        ] {
            assert!(text.parse::<SunPosition>().is_err(), "{text}");
        }
    }

    /// The orders of magnitude that light meters show outdoors.
    #[test]
    fn illuminances_are_those_of_clear_days() {
        let day = |elevation: f64, turbidity| Daylight {
            sun: SunPosition { elevation: elevation.to_radians(), azimuth: 0.0 },
            turbidity,
            ground: Vec3::splat(0.2),
            intensity: 1.0,
        };
        let sunlight =
            |elevation, turbidity| luminance(day(elevation, turbidity).sun().irradiance.as_dvec3());
        assert!((80e3..115e3).contains(&sunlight(60.0, 3.0)), "{}", sunlight(60.0, 3.0));
        assert!(sunlight(5.0, 3.0) < 0.5 * sunlight(30.0, 3.0) && sunlight(60.0, 6.0) < sunlight(60.0, 3.0));
        let low = day(3.0, 3.0).sun().irradiance;
        assert!(low.x > 2.0 * low.z, "a low sun is red: {low}");
        let image = day(60.0, 3.0).image();
        let Pixels::Rgb32F(pixels) = &image.pixels else { panic!("not linear") };
        let all: Vec<DVec3> = pixels.iter().map(|p| Vec3::from_array(*p).as_dvec3()).collect();
        let sky = luminance(irradiance(&all[..all.len() / 2], image.width));
        // The model is on the bright side of what is measured, 10 to 25 klx.
        assert!((10e3..40e3).contains(&sky), "{sky} lux from the sky");
        let zenith = all[0];
        assert!(zenith.z > 1.3 * zenith.x, "the zenith is blue: {zenith}");
        let ground = all[all.len() - 1];
        let level = sky + sunlight(60.0, 3.0) * 60f64.to_radians().sin();
        assert!((luminance(ground) * PI / level - 0.2).abs() < 0.01, "the ground reflects a fifth");
        assert!(all.iter().all(|c| c.is_finite() && c.min_element() >= 0.0));
    }

    /// The brightest place of the sky is around the sun.
    #[test]
    fn the_table_is_turned_to_the_sun() {
        let daylight = Daylight { sun: parse("40,90"), turbidity: 3.0, ground: Vec3::ZERO, intensity: 1.0 };
        let image = daylight.image();
        let Pixels::Rgb32F(pixels) = &image.pixels else { panic!("not linear") };
        let brightest =
            (0..pixels.len()).max_by(|a, b| pixels[*a][1].total_cmp(&pixels[*b][1])).unwrap_or(0) as u32;
        let (x, y) = (brightest % image.width, brightest / image.width);
        let uv = optics::vec2f((x as f32 + 0.5) / image.width as f32, (y as f32 + 0.5) / image.height as f32);
        let direction = Vec3::from_array(optics::sky::equirect_to_direction(uv, 0.0).to_array());
        assert!(direction.dot(daylight.sun().direction) > 0.99, "{direction}");
    }
}
