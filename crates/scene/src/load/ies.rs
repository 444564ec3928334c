//! Photometric files: IESNA LM-63 of 1986, 1991, 1995, 2002 and 2019, of types A, B and C.
//!
//! Text. Lines of keywords, a line `TILT=`, then numbers between blanks, commas and ends of lines: of the lamp, of the angles, and the
//! intensities for each horizontal angle in turn. Only half or a quarter of a lamp that is symmetric is written down.
//!
//! Source: ANSI/IESNA LM-63-2002, "Standard File Format for the Electronic Transfer of Photometric Data".

mod planes;

use super::{LoadError, LoadOptions};
use crate::photometry::LightProfile;
use planes::Planes;
use std::iter::Zip;
use std::ops::RangeFrom;
use std::path::Path;
use std::str::{Lines, Split};

/// Steps of the table, in degrees, the first that all angles of the file are multiples of; the last for what is on none. All divide
/// a quarter.
const VERTICAL_STEPS: [f64; 4] = [1.0, 0.5, 0.25, 0.1];
const HORIZONTAL_STEPS: [f64; 11] = [90.0, 45.0, 30.0, 22.5, 15.0, 10.0, 7.5, 5.0, 2.5, 1.0, 0.5];

/// Most angles of either kind that a file may have.
const MOST_ANGLES: usize = 10_000;

/// Reads a file.
///
/// # Errors
/// [`LoadError::Read`], [`LoadError::TooLarge`], and [`LoadError::Malformed`], which names the line, for what is no such file, for
/// lamps whose tilt is in another file, and impossible numbers.
pub fn load(path: &Path, options: &LoadOptions) -> Result<LightProfile, LoadError> {
    options.session(path, |options| {
        let bytes = options.read(path)?;
        parse(&super::text::decoded(path, &bytes)?)
            .map_err(|(object, message)| LoadError::malformed(path, object, message))
    })
}

/// Where a file is wrong, and what is wrong.
type Wrong = (String, String);

/// The profile of a file's bytes.
///
/// # Errors
/// Where the file is wrong, and what is wrong there.
pub fn parse(bytes: &[u8]) -> Result<LightProfile, Wrong> {
    // Names of makers may be in any code page; numbers are not.
    let text = String::from_utf8_lossy(bytes);
    let mut numbers = Numbers::after_tilt(&text)?;
    let lamp = Lamp::read(&mut numbers)?;
    lamp.profile()
}

/// What a file says of a lamp.
struct Lamp {
    /// Degrees, ascending.
    vertical: Vec<f64>,
    /// Degrees, ascending.
    horizontal: Vec<f64>,
    kind: Kind,
    /// All vertical angles of the first horizontal angle, then of the next.
    candelas: Vec<f64>,
    factor: f64,
}

/// What the angles are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Type C: vertical angles from where the lamp is aimed, horizontal ones around that axis.
    Around(Symmetry),
    /// Types A and B.
    Of(Planes),
}

/// Which part of a lamp is written down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Symmetry {
    /// One angle: it is the same all around.
    Round,
    /// From 0° to 90°.
    Quarter,
    /// From 0° to 180°.
    Half,
    /// From 90° to 270°.
    OtherHalf,
    /// All of it.
    None,
}

impl Lamp {
    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Wrong> {
        numbers.next("the number of lamps")?;
        numbers.next("lumens per lamp")?;
        let multiplier = numbers.factor("the multiplier of candelas")?;
        let vertical = numbers.count("the number of vertical angles", 2)?;
        let horizontal = numbers.count("the number of horizontal angles", 1)?;
        let kind = numbers.next("the type of photometry")?;
        let planes = match kind {
            1.0 => None,
            2.0 => Some(Planes::Across),
            3.0 => Some(Planes::Upright),
            _ => {
                let message = format!("photometry is of type {kind}; types are 1 (C), 2 (B) and 3 (A)");
                return Err(numbers.wrong(message));
            }
        };
        for what in ["the type of units", "the width", "the length", "the height"] {
            numbers.next(what)?;
        }
        let ballast = numbers.factor("the factor of the ballast")?;
        let lamp = numbers.factor("the factor of ballast and lamp")?;
        numbers.next("the input in watts")?;
        let (most_vertical, most_horizontal) =
            if planes.is_some() { ([-90.0, 90.0], [-90.0, 90.0]) } else { ([0.0, 180.0], [0.0, 360.0]) };
        let vertical = numbers.angles("vertical angles", vertical, most_vertical)?;
        let horizontal = numbers.angles("horizontal angles", horizontal, most_horizontal)?;
        let kind = match planes {
            Some(_) if horizontal.len() < 2 => {
                return Err(numbers.wrong("lamps of type A and B have at least two horizontal angles".into()));
            }
            Some(planes) => Kind::Of(planes),
            None => Kind::Around(Symmetry::of(&horizontal).ok_or_else(|| {
                numbers.wrong(format!(
                    "horizontal angles are one, or from 0 to 90, 180 or 360, or from 90 to 270; they are from {} to {}",
                    horizontal[0],
                    horizontal[horizontal.len() - 1]
                ))
            })?),
        };
        let mut candelas = Vec::new();
        for _ in 0..vertical.len() * horizontal.len() {
            let value = numbers.next("an intensity")?;
            if value < 0.0 {
                return Err(numbers.wrong(format!("an intensity must not be {value}")));
            }
            candelas.push(value);
        }
        Ok(Self { vertical, horizontal, kind, candelas, factor: multiplier * ballast * lamp })
    }

    /// The table of the whole lamp. Where the file's angles are on its steps, both are the same between them.
    fn profile(&self) -> Result<LightProfile, Wrong> {
        let strongest = self.candelas.iter().copied().fold(0.0, f64::max);
        let (down, across) = self.steps();
        let rows = (180.0 / down).round() as u32 + 1;
        let columns = if across > 0.0 { (360.0 / across).round() as u32 } else { 1 };
        let value = |i: u32| {
            let (row, column) = (i / columns, i % columns);
            let candela = self.candela(f64::from(row) * down, f64::from(column) * across);
            if strongest > 0.0 { (candela / strongest).clamp(0.0, 1.0) as f32 } else { 0.0 }
        };
        let values = (0..rows * columns).map(value).collect();
        let peak = (strongest * self.factor) as f32;
        LightProfile::new(rows, columns, values, peak)
            .ok_or_else(|| ("the intensities".into(), format!("the greatest is {peak} candela")))
    }

    /// Steps of the table in degrees, vertical and horizontal; 0 if it is the same all around.
    fn steps(&self) -> (f64, f64) {
        let down = step_of(&self.vertical, &VERTICAL_STEPS);
        match self.kind {
            Kind::Around(Symmetry::Round) => (down, 0.0),
            Kind::Around(_) => (down, step_of(&self.horizontal, &HORIZONTAL_STEPS)),
            Kind::Of(_) => self.steps_of_planes(),
        }
    }

    /// The intensity without factors in a direction of type C, degrees; 0 where no vertical angle was measured.
    fn candela(&self, vertical: f64, horizontal: f64) -> f64 {
        let symmetry = match self.kind {
            Kind::Around(symmetry) => symmetry,
            Kind::Of(planes) => return self.candela_of_planes(planes, vertical, horizontal),
        };
        let Some((row, down)) = bracket(&self.vertical, vertical) else { return 0.0 };
        let at = |column: usize| {
            let values = &self.candelas[column * self.vertical.len()..(column + 1) * self.vertical.len()];
            values[row] + (values[row + 1] - values[row]) * down
        };
        if symmetry == Symmetry::Round {
            return at(0);
        }
        let horizontal = symmetry.fold(horizontal);
        let last = self.horizontal.len() - 1;
        match bracket(&self.horizontal, horizontal) {
            Some((column, across)) => at(column) + (at(column + 1) - at(column)) * across,
            // From the last angle on to the first.
            None => {
                let gap = 360.0 - self.horizontal[last] + self.horizontal[0];
                let share = (horizontal - self.horizontal[last]).rem_euclid(360.0) / gap.max(1e-9);
                at(last) + (at(0) - at(last)) * share.min(1.0)
            }
        }
    }
}

impl Symmetry {
    /// By the horizontal angles; `None` if they are no part of a lamp.
    fn of(horizontal: &[f64]) -> Option<Self> {
        if horizontal.len() == 1 {
            return Some(Self::Round);
        }
        match (horizontal[0], horizontal[horizontal.len() - 1]) {
            (0.0, 90.0) => Some(Self::Quarter),
            (0.0, 180.0) => Some(Self::Half),
            (90.0, 270.0) => Some(Self::OtherHalf),
            (0.0, last) if last > 180.0 => Some(Self::None),
            _ => None,
        }
    }

    /// The horizontal angle that was measured in place of one in `[0, 360)`.
    fn fold(self, angle: f64) -> f64 {
        match self {
            Self::Round | Self::None => angle,
            Self::Quarter => {
                let half = angle % 180.0;
                half.min(180.0 - half)
            }
            Self::Half => angle.min(360.0 - angle),
            Self::OtherHalf if angle < 90.0 => 180.0 - angle,
            Self::OtherHalf if angle > 270.0 => 540.0 - angle,
            Self::OtherHalf => angle,
        }
    }
}

/// Which two neighbours among ascending angles an angle is between, and how far from the first to the second.
fn bracket(angles: &[f64], angle: f64) -> Option<(usize, f64)> {
    // Multiples of a step are rounded; angles of files are not that exact.
    const CLOSE: f64 = 1e-6;
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    if angle < first - CLOSE || angle > last + CLOSE {
        return None;
    }
    let after = angles.partition_point(|a| *a <= angle).clamp(1, angles.len() - 1);
    let (low, high) = (angles[after - 1], angles[after]);
    Some((after - 1, ((angle - low) / (high - low)).clamp(0.0, 1.0)))
}

/// The first step that all angles are multiples of, or the last.
fn step_of(angles: &[f64], steps: &[f64]) -> f64 {
    let fits = |step: &&f64| angles.iter().all(|a| ((a / **step).round() * **step - a).abs() < 1e-4);
    steps.iter().find(fits).or(steps.last()).copied().unwrap_or(1.0)
}

/// The numbers of a file, one after the other, and where they are.
struct Numbers<'a> {
    /// The lines behind `TILT=`, numbered from 1.
    lines: Zip<RangeFrom<usize>, Lines<'a>>,
    words: Split<'a, fn(char) -> bool>,
    line: usize,
}

/// What is between blanks and commas of a line. Old systems end files with the character 0x1A.
fn words(line: &str) -> Split<'_, fn(char) -> bool> {
    line.split(|c| c.is_whitespace() || c == ',' || c == '\u{1a}')
}

impl<'a> Numbers<'a> {
    /// Finds the line `TILT=` and passes over what belongs to it. What a lamp gives when it is tilted is not used: the profile was
    /// measured without a tilt.
    fn after_tilt(text: &'a str) -> Result<Self, Wrong> {
        let mut lines = (1..).zip(text.lines());
        let missing = || ("the file".to_owned(), "there is no line that begins with TILT=".to_owned());
        let (line, tilt) = lines
            .by_ref()
            .find_map(|(line, text)| Some((line, text.trim().strip_prefix("TILT=")?)))
            .ok_or_else(missing)?;
        let mut numbers = Self { lines, words: words(""), line };
        match tilt.trim() {
            "NONE" => {}
            "INCLUDE" => {
                numbers.next("how the lamp is mounted")?;
                let pairs = numbers.count("the number of tilts", 0)?;
                for _ in 0..2 * pairs {
                    numbers.next("a tilt or its factor")?;
                }
            }
            other => {
                return Err(
                    numbers.wrong(format!("`TILT={other}`: NONE and INCLUDE are read, other files are not"))
                );
            }
        }
        Ok(numbers)
    }

    fn wrong(&self, message: String) -> Wrong {
        (format!("line {}", self.line), message)
    }

    /// The next number; `what` it is, for messages.
    fn next(&mut self, what: &str) -> Result<f64, Wrong> {
        loop {
            if let Some(word) = self.words.find(|word| !word.is_empty()) {
                let number = word.parse::<f64>().ok().filter(|n| n.is_finite());
                return number.ok_or_else(|| self.wrong(format!("{what} is `{word}`, which is no number")));
            }
            let Some((line, text)) = self.lines.next() else {
                return Err(self.wrong(format!("the file ends before {what}")));
            };
            (self.line, self.words) = (line, words(text));
        }
    }

    /// A number of things, at least `least` and not too many.
    fn count(&mut self, what: &str, least: usize) -> Result<usize, Wrong> {
        let number = self.next(what)?;
        let is_count = number.fract() == 0.0 && (least as f64..=MOST_ANGLES as f64).contains(&number);
        if is_count {
            return Ok(number as usize);
        }
        Err(self
            .wrong(format!("{what} must be a whole number from {least} to {MOST_ANGLES}, it is {number}")))
    }

    /// A factor on intensities.
    fn factor(&mut self, what: &str) -> Result<f64, Wrong> {
        let number = self.next(what)?;
        if (0.0..=1e9).contains(&number) {
            Ok(number)
        } else {
            Err(self.wrong(format!("{what} must not be {number}")))
        }
    }

    /// `count` ascending angles from `least` to `most` degrees.
    fn angles(&mut self, what: &str, count: usize, [least, most]: [f64; 2]) -> Result<Vec<f64>, Wrong> {
        let mut angles: Vec<f64> = Vec::new();
        for _ in 0..count {
            let angle = self.next(what)?;
            if !(least..=most).contains(&angle) {
                return Err(self.wrong(format!("{what} are from {least} to {most}, this is {angle}")));
            }
            if let Some(before) = angles.last().filter(|before| **before >= angle) {
                return Err(self.wrong(format!("{what} ascend, but {angle} is behind {before}")));
            }
            angles.push(angle);
        }
        Ok(angles)
    }
}

#[cfg(test)]
mod tests;
