//! The camera's shutter: when it is open, how it opens, and whether rows of the picture do so one
//! after the other.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// When light reaches the film. Times are in seconds relative to the moment that the scene is shown
/// at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Shutter {
    /// When it opens; of a rolling shutter, the first row.
    pub open: f32,
    /// When it closes, not before `open`.
    pub close: f32,
    /// How it opens and closes.
    #[serde(default)]
    pub shape: ShutterShape,
    /// Whether rows or columns are exposed one after the other; `None` is all at once.
    #[serde(default)]
    pub rolling: Option<Rolling>,
}

/// How much light a shutter lets through over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum ShutterShape {
    /// All of it from the beginning to the end.
    #[default]
    Box,
    /// Rising to the middle, falling from there.
    Triangle,
    /// Rising and falling in these shares of the time, each in `[0, 1]`, together at most 1.
    Trapezoid(f32, f32),
}

/// A shutter that exposes a line of pixels after the other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Rolling {
    /// Which lines.
    pub lines: Lines,
    /// How much later the last line is exposed than the first, seconds, above 0.
    pub readout: f32,
}

/// Lines of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lines {
    /// From the top of the picture to its bottom.
    Rows,
    /// From the left to the right.
    Columns,
}

/// Why there is no such shutter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShutterError {
    /// Times that are not finite, or an end before the beginning.
    #[error("a shutter that opens at {0} s cannot close at {1} s")]
    Times(f32, f32),
    /// Text that is no shape.
    #[error(
        "`{0}` is no shape of a shutter: there are box, triangle and trapezoid:RISE,FALL (shares of the time)"
    )]
    Shape(String),
    /// Text that says of no rolling shutter.
    #[error("`{0}` is no rolling shutter: expected rows:SECONDS or columns:SECONDS")]
    Rolling(String),
}

impl Shutter {
    /// A shutter that is open in between.
    ///
    /// # Errors
    /// [`ShutterError::Times`].
    pub fn new(open: f32, close: f32) -> Result<Self, ShutterError> {
        Self { open, close, shape: ShutterShape::Box, rolling: None }.checked()
    }

    /// A shutter that is open for a share of a frame, centred on the frame's moment.
    ///
    /// # Errors
    /// As [`Shutter::new`].
    pub fn of_frame(share: f32, fps: f32) -> Result<Self, ShutterError> {
        let half = 0.5 * share / fps;
        Self::new(-half, half)
    }

    /// The shutter itself if its times can be.
    ///
    /// # Errors
    /// [`ShutterError::Times`].
    pub fn checked(self) -> Result<Self, ShutterError> {
        let can_be = self.open.is_finite() && self.close.is_finite() && self.open <= self.close;
        if can_be { Ok(self) } else { Err(ShutterError::Times(self.open, self.close)) }
    }

    fn readout(&self) -> f32 {
        self.rolling.map_or(0.0, |rolling| rolling.readout)
    }

    /// From the opening of the first line to the closing of the last, seconds. 0 is an instant.
    pub fn span(&self) -> f32 {
        self.close - self.open + self.readout()
    }

    /// The moment of a share of [`Shutter::span`], relative to the scene's.
    pub fn moment(&self, share: f32) -> f32 {
        self.open + self.span() * share
    }

    /// The shutter in a time that is 0 when the first line opens and 1 when the last one closes;
    /// `None` for an instant.
    pub fn timing(&self) -> Option<optics::shutter::Shutter> {
        let over_span = self.span().recip();
        let (rise, fall) = self.shape.ramps();
        let delay = |lines| match self.rolling {
            Some(rolling) if rolling.lines == lines => rolling.readout * over_span,
            _ => 0.0,
        };
        over_span.is_finite().then(|| optics::shutter::Shutter {
            open: 0.0,
            duration: (self.close - self.open) * over_span,
            rise,
            fall,
            row_delay: delay(Lines::Rows),
            column_delay: delay(Lines::Columns),
        })
    }
}

impl fmt::Display for Shutter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{} {}", self.open, self.close, self.shape)?;
        self.rolling.map_or(Ok(()), |rolling| write!(f, " {rolling}"))
    }
}

impl ShutterShape {
    /// In which shares of the time it opens and closes.
    pub fn ramps(self) -> (f32, f32) {
        match self {
            Self::Box => (0.0, 0.0),
            Self::Triangle => (0.5, 0.5),
            Self::Trapezoid(rise, fall) => (rise, fall),
        }
    }
}

impl fmt::Display for ShutterShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Box => f.write_str("box"),
            Self::Triangle => f.write_str("triangle"),
            Self::Trapezoid(rise, fall) => write!(f, "trapezoid:{rise},{fall}"),
        }
    }
}

impl FromStr for ShutterShape {
    type Err = ShutterError;

    fn from_str(text: &str) -> Result<Self, ShutterError> {
        let trapezoid = || {
            let (rise, fall) = text.strip_prefix("trapezoid:")?.split_once(',')?;
            let (rise, fall): (f32, f32) = (rise.trim().parse().ok()?, fall.trim().parse().ok()?);
            (rise >= 0.0 && fall >= 0.0 && rise + fall <= 1.0).then_some(Self::Trapezoid(rise, fall))
        };
        match text {
            "box" => Ok(Self::Box),
            "triangle" => Ok(Self::Triangle),
            _ => trapezoid().ok_or_else(|| ShutterError::Shape(text.to_owned())),
        }
    }
}

impl fmt::Display for Rolling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines = if self.lines == Lines::Rows { "rows" } else { "columns" };
        write!(f, "{lines}:{}", self.readout)
    }
}

impl FromStr for Rolling {
    type Err = ShutterError;

    fn from_str(text: &str) -> Result<Self, ShutterError> {
        let parse = || {
            let (lines, readout) = text.split_once(':')?;
            let lines = match lines {
                "rows" => Lines::Rows,
                "columns" => Lines::Columns,
                _ => return None,
            };
            let readout = readout.trim().parse().ok().filter(|s: &f32| s.is_finite() && *s > 0.0)?;
            Some(Self { lines, readout })
        };
        parse().ok_or_else(|| ShutterError::Rolling(text.to_owned()))
    }
}

macro_rules! text {
    ($($kind:ty),*) => {
        $(impl From<$kind> for String {
            fn from(value: $kind) -> Self {
                value.to_string()
            }
        }

        impl TryFrom<String> for $kind {
            type Error = ShutterError;

            fn try_from(text: String) -> Result<Self, ShutterError> {
                text.parse()
            }
        })*
    };
}

text!(ShutterShape, Rolling);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_say_what_they_were_read_from() {
        for text in ["box", "triangle", "trapezoid:0.25,0.5"] {
            assert_eq!(text.parse::<ShutterShape>().expect(text).to_string(), text);
        }
        for text in ["rows:0.02", "columns:1"] {
            assert_eq!(text.parse::<Rolling>().expect(text).to_string(), text);
        }
        for text in ["", "trapezoid:0.6,0.5", "trapezoid:nan,0", "round"] {
            assert!(text.parse::<ShutterShape>().is_err(), "{text}");
        }
        for text in ["rows", "rows:0", "rows:-1", "rows:inf", "lines:1"] {
            assert!(text.parse::<Rolling>().is_err(), "{text}");
        }
    }

    #[test]
    fn lines_share_the_span() {
        let rolling = Some(Rolling { lines: Lines::Rows, readout: 0.03 });
        let shutter = Shutter { rolling, ..Shutter::new(-0.01, 0.0).expect("a shutter") };
        let timing = shutter.timing().expect("it is open");
        assert!((timing.duration - 0.25).abs() < 1e-6 && (timing.row_delay - 0.75).abs() < 1e-6);
        assert_eq!(timing.column_delay, 0.0);
        assert!((shutter.moment(0.5) - 0.01).abs() < 1e-6);
        assert_eq!(Shutter::new(0.5, 0.5).expect("an instant").timing(), None);
        assert_eq!(Shutter::new(1.0, 0.5), Err(ShutterError::Times(1.0, 0.5)));
        let half = Shutter::of_frame(0.5, 25.0).expect("a shutter");
        assert_eq!((half.open, half.close), (-0.01, 0.01));
    }
}
