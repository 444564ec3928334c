//! What moves while the shutter is open, as back ends read it.

use optics::motion::{AffineRows, MotionSegment, affine_product};
use std::ops::Range;
use std::sync::Arc;

/// Consecutive segments of a motion; none of what stands still.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MotionRange {
    /// Index into [`MotionTable::segments`].
    pub first: u32,
    /// Number of segments.
    pub count: u32,
}

impl MotionRange {
    /// Whether it stands still.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// As a range of indices.
    pub fn range(&self) -> Range<u32> {
        self.first..self.first + self.count
    }
}

/// How a light moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightMotion {
    /// From a space that the light carries along to the world.
    pub segments: MotionRange,
    /// To that space from the world as it is in the middle, where
    /// [`LightRecord::light`](super::LightRecord::light) is.
    pub rest: AffineRows,
}

impl LightMotion {
    /// Of what stands still.
    pub const STILL: Self = Self {
        segments: MotionRange { first: 0, count: 0 },
        rest: AffineRows {
            x: optics::vec4f(1.0, 0.0, 0.0, 0.0),
            y: optics::vec4f(0.0, 1.0, 0.0, 0.0),
            z: optics::vec4f(0.0, 0.0, 1.0, 0.0),
        },
    };
}

/// The motions of a scene. Time runs from 0, when the shutter opens, to 1, when it closes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionTable {
    /// Segments of all motions.
    pub segments: Arc<[MotionSegment]>,
    /// From object to world, parallel to
    /// [`SceneTables::instances`](super::SceneTables::instances), which are as they are in the
    /// middle.
    pub instances: Vec<MotionRange>,
    /// Parallel to [`SceneTables::lights`](super::SceneTables::lights), which are as they are in
    /// the middle.
    pub lights: Vec<LightMotion>,
}

impl MotionTable {
    /// The segments of a range.
    #[inline]
    pub fn of(&self, range: MotionRange) -> &[MotionSegment] {
        &self.segments[range.first as usize..][..range.count as usize]
    }

    /// From the world in the middle to the world at `time`, of light `index`; `None` if it stands
    /// still.
    #[inline]
    pub fn light_transform(&self, index: u32, time: f32) -> Option<AffineRows> {
        let motion = self.lights[index as usize];
        let segments = self.of(motion.segments);
        (!segments.is_empty()).then(|| affine_product(AffineRows::of_motion(segments, time), motion.rest))
    }
}
