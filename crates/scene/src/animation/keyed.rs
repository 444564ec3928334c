//! Transforms given at moments, of what no node carries.

use super::decompose::{motion_through, transform_of};
use glam::Affine3A;
use optics::motion::AffineRows;

/// What a [`Keyed`] transform moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyedObject {
    /// Index into [`crate::Scene::instances`].
    Instance(u32),
    /// Index into [`crate::Scene::cameras`]: it looks along the −Z axis of the space that the transform
    /// comes from, +Y up.
    Camera(u32),
}

/// A transform to the world that is known at moments. Between them it is decomposed and
/// interpolated as [`optics::motion`] says; before the first and after the last it stays.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyed {
    /// What is moved.
    pub object: KeyedObject,
    /// Moments, seconds, increasing.
    times: Vec<f32>,
    /// From object to world at those.
    transforms: Vec<Affine3A>,
}

/// Why transforms at moments are no motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KeyedError {
    /// There is none, or there are not as many moments.
    #[error("{times} moments for {transforms} transforms; there must be one each, and at least one")]
    Count {
        /// How many moments.
        times: usize,
        /// How many transforms.
        transforms: usize,
    },
    /// A moment that is not finite or not after the one before.
    #[error("the moment {0} s is not finite or not after the one before")]
    Time(f32),
    /// A transform that is not finite.
    #[error("the transform at {0} s is not finite")]
    Transform(f32),
}

impl Keyed {
    /// A motion through `transforms` at `times`, seconds.
    ///
    /// # Errors
    /// See [`KeyedError`].
    pub fn new(object: KeyedObject, times: Vec<f32>, transforms: Vec<Affine3A>) -> Result<Self, KeyedError> {
        if times.is_empty() || times.len() != transforms.len() {
            return Err(KeyedError::Count { times: times.len(), transforms: transforms.len() });
        }
        let disordered = times.windows(2).find(|pair| pair[1] <= pair[0]).map(|pair| pair[1]);
        if let Some(time) = times.iter().copied().find(|t| !t.is_finite()).or(disordered) {
            return Err(KeyedError::Time(time));
        }
        match times.iter().zip(&transforms).find(|(_, transform)| !transform.is_finite()) {
            Some((time, _)) => Err(KeyedError::Transform(*time)),
            None => Ok(Self { object, times, transforms }),
        }
    }

    /// The last moment, seconds.
    pub fn end(&self) -> f32 {
        self.times[self.times.len() - 1]
    }

    /// The transform at `time` seconds.
    pub fn at(&self, time: f32) -> Affine3A {
        let after = self.times.partition_point(|t| *t <= time);
        if after == 0 || after == self.times.len() {
            return self.transforms[after.saturating_sub(1)];
        }
        let [start, end] = [self.times[after - 1], self.times[after]];
        let motion = motion_through(&self.transforms[after - 1..=after]);
        transform_of(&AffineRows::of_motion(&motion, (time - start) / (end - start)))
    }

    /// Gives the instance that it moves another number.
    pub(crate) fn renumber(&mut self, number: impl Fn(u32) -> u32) {
        if let KeyedObject::Instance(index) = &mut self.object {
            *index = number(*index);
        }
    }

    /// Moves everything by `motion`.
    pub(crate) fn shift(&mut self, motion: &Affine3A) {
        self.transforms.iter_mut().for_each(|transform| *transform = *motion * *transform);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn transforms_are_held_outside_of_their_moments() {
        let at = |x: f32| Affine3A::from_translation(Vec3::X * x);
        let keys = vec![at(1.0), at(3.0), at(3.0)];
        let keyed = Keyed::new(KeyedObject::Instance(0), vec![0.0, 1.0, 4.0], keys).expect("a motion");
        let x = |time: f32| keyed.at(time).translation.x;
        assert_eq!([x(-1.0), x(0.0), x(0.5), x(1.0), x(2.0), x(9.0)], [1.0, 1.0, 2.0, 3.0, 3.0, 3.0]);
        assert_eq!(keyed.end(), 4.0);
    }

    #[test]
    fn impossible_keys_are_refused() {
        let new = |times: &[f32], count: usize| {
            Keyed::new(KeyedObject::Camera(0), times.to_vec(), vec![Affine3A::IDENTITY; count])
        };
        assert_eq!(new(&[], 0), Err(KeyedError::Count { times: 0, transforms: 0 }));
        assert_eq!(new(&[0.0, 1.0], 1), Err(KeyedError::Count { times: 2, transforms: 1 }));
        assert_eq!(new(&[0.0, 0.0], 2), Err(KeyedError::Time(0.0)));
        assert!(matches!(new(&[f32::NAN], 1), Err(KeyedError::Time(_))));
    }
}
