//! The stages of the wavefront: which text they are in, and what they bind.

use super::queues::{DISPATCHES, GATHERED, HITS, PATHS, SHADOW_RAYS, WAVE};
use crate::film::{AOVS, FILM, TALLY, VIEW};
use crate::pass::PassSpec;

/// A kernel that does one thing for all paths of a wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Starts paths at the camera.
    Generate,
    /// Finds where paths arrive.
    Extend,
    /// Finds what light paths that end there may meet.
    ExtendLast,
    /// Records for auxiliary layers: first hits, and at every vertex what guides denoisers.
    Record,
    /// Everything that happens at a vertex but tracing.
    Shade,
    /// Writes the sizes of the next dispatches.
    Prepare,
    /// Asks the shadow rays.
    Connect,
    /// Adds samples to the film.
    Accumulate,
}

impl Stage {
    /// All of them; a stage's place is its number.
    pub const ALL: [Self; 8] = [
        Self::Generate,
        Self::Extend,
        Self::ExtendLast,
        Self::Record,
        Self::Shade,
        Self::Prepare,
        Self::Connect,
        Self::Accumulate,
    ];

    /// What finds where paths arrive that are on segment `depth` of `max_depth`.
    pub fn extending(depth: u32, max_depth: u32) -> Self {
        if depth > 1 && depth == max_depth { Self::ExtendLast } else { Self::Extend }
    }

    /// Its pass. No stage binds more storage buffers than the megakernel does, so that both run on the same devices.
    pub const fn spec(self) -> PassSpec {
        const SHADING: &str = "wavefront_shading";
        const TRACING: &str = "wavefront_tracing";
        match self {
            Self::Generate => PassSpec {
                film: &[VIEW, TALLY],
                own: &[WAVE, PATHS],
                ..PassSpec::of_scene(SHADING, "generate")
            },
            Self::Extend => {
                PassSpec { film: &[VIEW], own: &[WAVE, PATHS, HITS], ..PassSpec::tracing(TRACING, "extend") }
            }
            Self::ExtendLast => PassSpec {
                film: &[VIEW],
                own: &[WAVE, PATHS, HITS],
                ..PassSpec::tracing(TRACING, "extend_last")
            },
            Self::Record => PassSpec {
                film: &[VIEW, TALLY, AOVS],
                own: &[WAVE, PATHS, HITS],
                ..PassSpec::of_scene(SHADING, "record")
            },
            Self::Shade => PassSpec {
                film: &[VIEW],
                own: &[WAVE, PATHS, HITS, SHADOW_RAYS, GATHERED],
                ..PassSpec::of_scene(SHADING, "shade")
            },
            Self::Prepare => PassSpec {
                film: &[VIEW, TALLY],
                own: &[WAVE, DISPATCHES],
                ..PassSpec::of_scene(SHADING, "prepare")
            },
            Self::Connect => PassSpec {
                film: &[VIEW],
                own: &[WAVE, SHADOW_RAYS, GATHERED],
                ..PassSpec::tracing(TRACING, "connect")
            },
            Self::Accumulate => PassSpec {
                film: &[VIEW, FILM, TALLY],
                own: &[WAVE, GATHERED],
                ..PassSpec::of_scene(SHADING, "accumulate")
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::Variant;
    use crate::shader::check::{check_pass, linkage};

    #[test]
    fn stages_bind_what_they_use() {
        for variant in Variant::all() {
            for stage in Stage::ALL {
                check_pass(&stage.spec(), &linkage(variant), &format!("{variant:?}"));
            }
        }
    }

    #[test]
    fn stages_are_where_their_numbers_say() {
        for (i, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, i);
        }
    }
}
