//! Keyframes: values at moments, and what is between them.

use glam::Quat;

/// What happens between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the last key is held.
    Step,
    /// Straight from key to key; rotations along the shorter arc at constant speed.
    Linear,
    /// Cubic Hermite splines; each key has an incoming tangent, a value and an outgoing tangent.
    CubicSpline,
}

/// Values at increasing moments. Before the first and after the last key, its value is held.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    times: Vec<f32>,
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

/// Why a track cannot be played.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// There is no key.
    #[error("has no keys")]
    Empty,
    /// A time that is not finite or not after the one before.
    #[error("has the time {0} s, which is not finite or not after the one before")]
    Time(f32),
    /// A value that is not finite.
    #[error("has the value {0}")]
    Value(f32),
    /// Too few or too many values.
    #[error("has {actual} numbers where {keys} keys need {expected}")]
    Count {
        /// How many there are.
        actual: usize,
        /// How many there should be.
        expected: usize,
        /// Number of keys.
        keys: usize,
    },
}

impl Track {
    /// A track of `times.len()` keys of `width` numbers each; three times as many for [`Interpolation::CubicSpline`].
    ///
    /// # Errors
    /// See [`TrackError`].
    pub fn new(
        times: Vec<f32>,
        values: Vec<f32>,
        width: usize,
        interpolation: Interpolation,
    ) -> Result<Self, TrackError> {
        let keys = times.len();
        if keys == 0 || width == 0 {
            return Err(TrackError::Empty);
        }
        let ordered = |pair: &&[f32]| !(pair[1].is_finite() && pair[0] < pair[1]);
        if !times[0].is_finite() {
            return Err(TrackError::Time(times[0]));
        }
        if let Some(pair) = times.windows(2).find(ordered) {
            return Err(TrackError::Time(pair[1]));
        }
        let each = if interpolation == Interpolation::CubicSpline { 3 * width } else { width };
        let (actual, expected) = (values.len(), keys.saturating_mul(each));
        if actual != expected {
            return Err(TrackError::Count { actual, expected, keys });
        }
        match values.iter().find(|v| !v.is_finite()) {
            Some(value) => Err(TrackError::Value(*value)),
            None => Ok(Self { times, values, width, interpolation }),
        }
    }

    /// Numbers in a value.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The moment of the last key, seconds.
    pub fn end(&self) -> f32 {
        self.times[self.times.len() - 1]
    }

    /// The value at `time` seconds, into `out` of [`Track::width`] numbers.
    ///
    /// # Panics
    /// If `out` has another length.
    pub fn sample(&self, time: f32, out: &mut [f32]) {
        assert_eq!(out.len(), self.width, "one number for each of the value's");
        let (key, next, fraction) = self.between(time);
        match self.interpolation {
            Interpolation::Step => out.copy_from_slice(self.value(key)),
            Interpolation::Linear => {
                for ((out, a), b) in out.iter_mut().zip(self.value(key)).zip(self.value(next)) {
                    *out = a + (b - a) * fraction;
                }
            }
            Interpolation::CubicSpline => self.hermite(key, next, fraction, out),
        }
    }

    /// The rotation at `time` seconds, a unit quaternion (x, y, z, w). The track must be four numbers wide.
    ///
    /// # Panics
    /// If it is not.
    pub fn sample_rotation(&self, time: f32) -> Quat {
        let (key, next, fraction) = self.between(time);
        if self.interpolation == Interpolation::Linear {
            let [a, b] = [key, next].map(|k| unit(Quat::from_slice(self.value(k))));
            return a.slerp(b, fraction);
        }
        let mut value = [0.0; 4];
        self.sample(time, &mut value);
        unit(Quat::from_array(value))
    }

    /// The keys around `time`, and how far it is from the first to the second, in `[0, 1]`.
    fn between(&self, time: f32) -> (usize, usize, f32) {
        let after = self.times.partition_point(|t| *t <= time);
        let last = self.times.len() - 1;
        let Some(key) = after.checked_sub(1) else { return (0, 0, 0.0) };
        if key == last {
            return (last, last, 0.0);
        }
        let (start, end) = (self.times[key], self.times[key + 1]);
        (key, key + 1, ((time - start) / (end - start)).clamp(0.0, 1.0))
    }

    fn value(&self, key: usize) -> &[f32] {
        self.element(key, usize::from(self.interpolation == Interpolation::CubicSpline))
    }

    /// Of a cubic key: 0 is the incoming tangent, 1 the value, 2 the outgoing tangent.
    fn element(&self, key: usize, element: usize) -> &[f32] {
        let each = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        &self.values[(key * each + element) * self.width..][..self.width]
    }

    /// Source: glTF 2.0 specification, appendix C.5.
    fn hermite(&self, key: usize, next: usize, t: f32, out: &mut [f32]) {
        let span = self.times[next] - self.times[key];
        let (t2, t3) = (t * t, t * t * t);
        let start = 2.0 * t3 - 3.0 * t2 + 1.0;
        let leaving = span * (t3 - 2.0 * t2 + t);
        let end = -2.0 * t3 + 3.0 * t2;
        let arriving = span * (t3 - t2);
        for (i, out) in out.iter_mut().enumerate() {
            *out = start * self.value(key)[i]
                + leaving * self.element(key, 2)[i]
                + end * self.value(next)[i]
                + arriving * self.element(next, 0)[i];
        }
    }
}

fn unit(rotation: Quat) -> Quat {
    let length = rotation.length();
    if length.is_finite() && length > 0.0 { rotation / length } else { Quat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn at(track: &Track, time: f32) -> f32 {
        let mut out = [0.0];
        track.sample(time, &mut out);
        out[0]
    }

    #[test]
    fn steps_hold_and_lines_are_straight_and_both_end_where_keys_end() {
        let keys = || (vec![1.0, 2.0, 4.0], vec![10.0, 20.0, 0.0]);
        let (times, values) = keys();
        let step = Track::new(times, values, 1, Interpolation::Step).expect("sound");
        let (times, values) = keys();
        let line = Track::new(times, values, 1, Interpolation::Linear).expect("sound");
        assert_eq!([0.0, 1.0, 1.9, 2.0, 4.0, 9.0].map(|t| at(&step, t)), [10.0, 10.0, 10.0, 20.0, 0.0, 0.0]);
        assert_eq!([0.0, 1.5, 3.0, 4.0, 9.0].map(|t| at(&line, t)), [10.0, 15.0, 10.0, 0.0, 0.0]);
        assert_eq!(at(&line, f32::NAN), 10.0);
    }

    /// A spline through samples of a cubic with its derivatives as tangents is that cubic.
    #[test]
    fn splines_reproduce_cubics() {
        let f = |t: f32| t * t * t - 2.0 * t * t + 0.5 * t + 3.0;
        let slope = |t: f32| 3.0 * t * t - 4.0 * t + 0.5;
        let times = vec![0.0, 0.5, 2.0];
        let values = times.iter().flat_map(|t| [slope(*t), f(*t), slope(*t)]).collect();
        let track = Track::new(times, values, 1, Interpolation::CubicSpline).expect("sound");
        for i in 0..=20 {
            let t = i as f32 * 0.1;
            assert!((at(&track, t) - f(t)).abs() < 1e-5, "{t}: {} against {}", at(&track, t), f(t));
        }
    }

    #[test]
    fn rotations_take_the_shorter_arc_at_constant_speed() {
        let half = Quat::from_rotation_y(FRAC_PI_2);
        // −q is the same rotation as q.
        let values = [Quat::IDENTITY.to_array(), (-half).to_array()].concat();
        let track = Track::new(vec![0.0, 3.0], values, 4, Interpolation::Linear).expect("sound");
        for i in 0..=3 {
            let expected = Quat::from_rotation_y(FRAC_PI_2 * i as f32 / 3.0);
            let sampled = track.sample_rotation(i as f32);
            // An angle of nearly nothing is a matter of rounding: the arc cosine of nearly one.
            let apart = (sampled - expected).length().min((sampled + expected).length());
            assert!(apart < 1e-5, "{i}: {apart}");
        }
    }

    #[test]
    fn what_cannot_be_played_is_refused() {
        let new = |times: &[f32], values: &[f32], interpolation| {
            Track::new(times.to_vec(), values.to_vec(), 1, interpolation)
        };
        assert_eq!(new(&[], &[], Interpolation::Step), Err(TrackError::Empty));
        assert_eq!(new(&[1.0, 1.0], &[0.0; 2], Interpolation::Linear), Err(TrackError::Time(1.0)));
        assert_eq!(
            new(&[f32::INFINITY], &[0.0], Interpolation::Linear),
            Err(TrackError::Time(f32::INFINITY))
        );
        assert!(matches!(new(&[0.0, f32::NAN], &[0.0; 2], Interpolation::Linear), Err(TrackError::Time(_))));
        assert!(matches!(new(&[0.0], &[f32::NAN], Interpolation::Linear), Err(TrackError::Value(_))));
        let count = TrackError::Count { actual: 2, expected: 3, keys: 1 };
        assert_eq!(new(&[0.0], &[0.0; 2], Interpolation::CubicSpline), Err(count));
    }
}
