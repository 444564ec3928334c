//! What leaves sixteen vertices: continuations of paths, light samples and the shadow rays to them.

use crate::batch::lanes::{LANES, Lanes, Vectors};
use crate::simd::Instructions;
use optics::Vec3f;

/// Continuations of paths.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NextLanes {
    /// Where the next ray starts.
    pub origin: Vectors,
    /// Its unit direction.
    pub wi: Vectors,
    /// See [`crate::batch::streams::Path::pdf`].
    pub pdf: Lanes<f32>,
    /// Throughput of the path up to the next vertex.
    pub throughput: Vectors,
    /// See [`PathState::eta_scale`].
    pub eta_scale: Lanes<f32>,
    /// 1 if the path goes on: the direction is on the right side of the geometric surface, and roulette lets it live.
    pub alive: Lanes<u32>,
}

impl NextLanes {
    /// Which of the first `waiting` lanes go on, as bits.
    #[inline(always)]
    pub fn alive(&self, i: impl Instructions, waiting: usize) -> u32 {
        i.equal(&self.alive.0, 1) & ((1 << waiting) - 1)
    }
}

/// Light samples of vertices: the fields of [`LightSample`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LightLanes {
    pub wi: Vectors,
    pub distance: Lanes<f32>,
    pub radiance: Vectors,
    /// Density with the choice of the light; 0 where there is nothing to ask for.
    pub pdf: Lanes<f32>,
    pub delta: Lanes<u32>,
}

/// Shadow rays to light samples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ConnectionLanes {
    /// Where the shadow ray starts.
    pub origin: Vectors,
    /// Its unit direction.
    pub direction: Vectors,
    /// From there to the light.
    pub distance: Lanes<f32>,
    /// Contribution to the pixel if nothing is in the way; zero where there is nothing to ask for.
    pub contribution: Vectors,
}

impl ConnectionLanes {
    /// Which of the first `waiting` lanes have something to ask for, as bits.
    #[inline(always)]
    pub fn asking(&self, i: impl Instructions, waiting: usize) -> u32 {
        let mut nothing = Lanes::<u32>::default();
        for lane in 0..LANES {
            let Vec3f { x, y, z } = self.contribution.get(lane);
            // Not `<= 0`: NaN must reach the film, where it is counted.
            nothing.0[lane] = u32::from(x + y + z == 0.0);
        }
        i.equal(&nothing.0, 0) & ((1 << waiting) - 1)
    }
}
