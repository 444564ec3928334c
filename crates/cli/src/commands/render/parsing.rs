//! Values on the command line.

use alhazen::{Projection, Rect, Rolling, Shutter, ShutterError, ShutterShape, Tile};
use std::ops::Range;
use std::time::Duration;

fn parse_numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let numbers: Vec<T> = text.split(',').map(|t| t.trim().parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// Finite numbers in a list of any length.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers(pub Vec<f64>);

/// Parses numbers that commas separate.
pub fn parse_list(text: &str) -> Result<Numbers, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|t| t.trim().parse()).collect();
    let numbers = numbers.ok().filter(|n| n.iter().all(|x| x.is_finite()));
    numbers.map(Numbers).ok_or_else(|| "expected numbers separated by commas".into())
}

/// A position, `X,Y,Z`, with all its digits: coordinates may be far from the origin.
pub fn parse_position(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<[f64; 3]> = parse_numbers(text);
    numbers.filter(|v| v.iter().all(|x| x.is_finite())).ok_or_else(|| "expected three numbers: X,Y,Z".into())
}

/// Three finite numbers: `X,Y,Z`.
pub fn parse_vector(text: &str) -> Result<[f32; 3], String> {
    let numbers: Option<[f32; 3]> = parse_numbers(text);
    numbers.filter(|v| v.iter().all(|x| x.is_finite())).ok_or_else(|| "expected three numbers: X,Y,Z".into())
}

/// How light fades with distance: `C,L,Q`, none negative and one of them positive.
pub fn parse_falloff(text: &str) -> Result<[f32; 3], String> {
    let numbers: Option<[f32; 3]> = parse_numbers(text);
    let fades = |v: &[f32; 3]| v.iter().all(|x| x.is_finite() && *x >= 0.0) && v.iter().any(|x| *x > 0.0);
    numbers
        .filter(fades)
        .ok_or_else(|| "expected three numbers, C,L,Q, none negative and one of them above zero".into())
}

/// A rectangle of pixels: `X,Y,WIDTH,HEIGHT`.
pub fn parse_crop(text: &str) -> Result<Rect, String> {
    let [x, y, width, height] = parse_numbers(text).ok_or("expected four whole numbers: X,Y,WIDTH,HEIGHT")?;
    Ok(Rect { x, y, width, height })
}

/// Frames of a sequence at most: nine hours at thirty frames a second.
pub const MAX_FRAMES: u32 = 1_000_000;

/// Frames `A..B`, or one frame `A`.
pub fn parse_frames(text: &str) -> Result<(u32, u32), String> {
    let number = |t: &str| t.parse::<u32>().map_err(|e| format!("{t:?}: {e}"));
    let (a, b) = match text.split_once("..") {
        Some((a, b)) => (number(a)?, number(b)?),
        None => {
            let frame = number(text)?;
            (frame, frame.checked_add(1).ok_or("the number is too large")?)
        }
    };
    match b.checked_sub(a) {
        None | Some(0) => Err(format!("{a}..{b} has no frames")),
        Some(count) if count > MAX_FRAMES => Err(format!("{count} frames are more than {MAX_FRAMES}")),
        Some(_) => Ok((a, b)),
    }
}

/// When the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShutterTimes {
    /// For an instant, whatever the scene says.
    Off,
    /// In between, seconds around the moment of the picture.
    Seconds(f32, f32),
    /// For a share of a frame around its moment.
    Share(f32),
}

/// `OPEN..CLOSE` in seconds, a share of a frame, or `off`.
pub fn parse_shutter(text: &str) -> Result<ShutterTimes, String> {
    let expected = || "expected OPEN..CLOSE in seconds, a share of a frame above 0, or off".to_owned();
    let number = |text: &str| text.trim().parse::<f32>().ok().filter(|x| x.is_finite());
    if text == "off" {
        return Ok(ShutterTimes::Off);
    }
    match text.split_once("..") {
        Some((open, close)) => {
            let (open, close) = number(open).zip(number(close)).ok_or_else(expected)?;
            Shutter::new(open, close).map_err(|error| error.to_string())?;
            Ok(ShutterTimes::Seconds(open, close))
        }
        None => number(text).filter(|share| *share > 0.0).map(ShutterTimes::Share).ok_or_else(expected),
    }
}

/// A shutter's shape.
pub fn parse_shutter_shape(text: &str) -> Result<ShutterShape, String> {
    text.parse().map_err(|error: ShutterError| error.to_string())
}

/// A rolling shutter.
pub fn parse_rolling(text: &str) -> Result<Rolling, String> {
    text.parse().map_err(|error: ShutterError| error.to_string())
}

/// Some of the samples of each pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Samples {
    /// Those with these indices.
    Range(Range<u32>),
    /// One of several equal shares.
    Share(Tile),
}

/// Indices of samples `A..B`, or the share `I/N` of all of them.
pub fn parse_samples(text: &str) -> Result<Samples, String> {
    if text.contains('/') {
        return text.parse().map(Samples::Share).map_err(|_| "expected A..B or I/N".into());
    }
    let parse = || {
        let (a, b) = text.split_once("..")?;
        Some(a.trim().parse().ok()?..b.trim().parse().ok()?)
    };
    let range: Range<u32> = parse().ok_or("expected A..B or I/N")?;
    if range.is_empty() { Err(format!("{text} has no samples")) } else { Ok(Samples::Range(range)) }
}

/// A duration with a unit: `30s`, `5m`, `1.5h`; seconds without one.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let (number, factor) = match text.strip_suffix(['s', 'm', 'h']) {
        Some(number) if text.ends_with('s') => (number, 1.0),
        Some(number) if text.ends_with('m') => (number, 60.0),
        Some(number) => (number, 3600.0),
        None => (text, 1.0),
    };
    let value: f64 = number.trim().parse().map_err(|_| "expected a duration such as 30s, 5m or 1.5h")?;
    Duration::try_from_secs_f64(value * factor).map_err(|e| e.to_string())
}

/// A finite number of at least zero.
pub fn parse_not_negative(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err("expected a number of at least 0".into()),
    }
}

/// A number above zero and at most one.
pub fn parse_share(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value > 0.0 && value <= 1.0 => Ok(value),
        _ => Err("expected a number above 0 and at most 1".into()),
    }
}

/// A finite number.
pub fn parse_finite(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("expected a number".into()),
    }
}

/// A finite number in double precision.
pub fn parse_finite_f64(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("expected a number".into()),
    }
}

/// A finite number in double precision of at least zero.
pub fn parse_not_negative_f64(text: &str) -> Result<f64, String> {
    let value = parse_finite_f64(text)?;
    if value >= 0.0 { Ok(value) } else { Err("expected a number of at least 0".into()) }
}

/// A cosine, in `[-1, 1]`.
pub fn parse_cosine(text: &str) -> Result<f32, String> {
    let value = parse_finite(text)?;
    if value.abs() <= 1.0 { Ok(value) } else { Err("expected a number between -1 and 1".into()) }
}

/// A part of a whole, in `[0, 1]`.
pub fn parse_fraction(text: &str) -> Result<f64, String> {
    let value = parse_finite_f64(text)?;
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err("expected a number between 0 and 1".into()) }
}

/// A number of threads: more than this only take memory.
pub fn parse_threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(threads @ 1..=1024) => Ok(threads),
        _ => Err("expected a number of threads between 1 and 1024".into()),
    }
}

/// A number above zero.
pub fn parse_positive(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| "expected a number")?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("expected a number above zero".into()) }
}

/// A moment: a finite number of seconds, at least 0.
pub fn parse_seconds(text: &str) -> Result<f32, String> {
    let value: f32 = text.strip_suffix('s').unwrap_or(text).parse().map_err(|_| "expected seconds")?;
    if value >= 0.0 && value.is_finite() { Ok(value) } else { Err("expected seconds, at least 0".into()) }
}

/// Haziness of the air, in `[2, 10]`.
pub fn parse_turbidity(text: &str) -> Result<f32, String> {
    let value = parse_positive(text)?;
    if (2.0..=10.0).contains(&value) { Ok(value) } else { Err("expected a number between 2 and 10".into()) }
}

/// An angle in degrees, in `(0, 360]`.
pub fn parse_fov(text: &str) -> Result<f32, String> {
    let value = parse_positive(text)?;
    if value <= 360.0 { Ok(value) } else { Err("expected degrees between 0 and 360".into()) }
}

/// The name of a projection.
pub fn parse_projection(text: &str) -> Result<Projection, String> {
    Projection::from_name(text).ok_or_else(|| format!("expected one of {}", Projection::names()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_parsed_and_checked() {
        assert_eq!(parse_vector("1,-2.5, 3"), Ok([1.0, -2.5, 3.0]));
        assert!(parse_vector("1,2").is_err() && parse_vector("1,2,nan").is_err());
        assert_eq!(parse_crop("1,2,3,4"), Ok(Rect { x: 1, y: 2, width: 3, height: 4 }));
        assert_eq!(parse_frames("2..5"), Ok((2, 5)));
        assert_eq!(parse_frames("5"), Ok((5, 6)));
        assert!(
            parse_frames("5..5").is_err()
                && parse_frames("5..").is_err()
                && parse_frames("4294967295").is_err()
        );
        assert_eq!(parse_samples("2..5"), Ok(Samples::Range(2..5)));
        assert_eq!(parse_samples("2/3"), Ok(Samples::Share(Tile { index: 1, count: 3 })));
        assert!(parse_samples("4/3").is_err());
        assert!(
            parse_samples("5..5").is_err() && parse_samples("5").is_err() && parse_samples("-1..2").is_err()
        );
        assert_eq!(parse_duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(parse_duration("2"), Ok(Duration::from_secs(2)));
        assert!(parse_duration("-1s").is_err() && parse_duration("x").is_err());
        assert_eq!((parse_seconds("1.5"), parse_seconds("0s")), (Ok(1.5), Ok(0.0)));
        assert!(parse_seconds("-1").is_err() && parse_seconds("inf").is_err());
        for text in ["nan", "inf", "-inf", "NaN", "infinity", "1e999", "", "x"] {
            let parsers = [parse_finite, parse_positive, parse_not_negative, parse_share, parse_seconds];
            let more = [parse_turbidity, parse_fov, parse_cosine];
            parsers.into_iter().chain(more).for_each(|parse| assert!(parse(text).is_err(), "{text}"));
            let doubles = [parse_finite_f64, parse_not_negative_f64, parse_fraction];
            doubles.into_iter().for_each(|parse| assert!(parse(text).is_err(), "{text}"));
            assert!(parse_duration(text).is_err() && parse_threads(text).is_err(), "{text}");
        }
        assert!(parse_threads("0").is_err() && parse_threads("100000").is_err());
        assert_eq!(
            (parse_cosine("-1"), parse_fraction("0.5"), parse_threads("7")),
            (Ok(-1.0), Ok(0.5), Ok(7))
        );
        assert!(parse_turbidity("1").is_err() && parse_turbidity("2.5") == Ok(2.5));
        assert!(parse_projection("fisheye").is_ok() && parse_projection("intrinsics").is_err());
        assert!(parse_fov("0").is_err() && parse_fov("361").is_err() && parse_fov("45").is_ok());
    }
}
