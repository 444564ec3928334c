//! The stages of the wavefront: which text they are in, and what they bind.

use super::queues::{DISPATCHES, GATHERED, HITS, PATHS, SHADOW_RAYS, WAVE};
use crate::shader::{Variant, scene_text};
use crate::tracer::TracerText;

/// A kernel that does one thing for all paths of a wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Starts paths at the camera.
    Generate,
    /// Finds where paths arrive.
    Extend,
    /// Finds what light paths that end there may meet.
    ExtendLast,
    /// Records first hits for auxiliary layers.
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

    /// Name of its entry point, and in profiles.
    pub fn name(self) -> &'static str {
        match self {
            Self::Generate => "generate",
            Self::Extend => "extend",
            Self::ExtendLast => "extend_last",
            Self::Record => "record",
            Self::Shade => "shade",
            Self::Prepare => "prepare",
            Self::Connect => "connect",
            Self::Accumulate => "accumulate",
        }
    }

    /// What finds where paths arrive that are on segment `depth` of `max_depth`.
    pub fn extending(depth: u32, max_depth: u32) -> Self {
        if depth > 1 && depth == max_depth { Self::ExtendLast } else { Self::Extend }
    }

    /// Whether it asks the tracer.
    pub fn traces(self) -> bool {
        match self {
            Self::Extend | Self::ExtendLast | Self::Connect => true,
            Self::Generate | Self::Record | Self::Shade | Self::Prepare | Self::Accumulate => false,
        }
    }

    /// Bindings of the film's group that it needs beside the view. No stage binds more storage buffers than the
    /// megakernel does, so that both run on the same devices.
    pub fn film_bindings(self) -> &'static [u32] {
        match self {
            Self::Extend | Self::ExtendLast | Self::Shade | Self::Connect => &[],
            Self::Generate | Self::Prepare => &[2],
            Self::Record => &[2, 3],
            Self::Accumulate => &[1, 2],
        }
    }

    /// Bindings of the queues' group that it needs.
    pub fn queue_bindings(self) -> &'static [u32] {
        match self {
            Self::Generate => &[WAVE, PATHS],
            Self::Extend | Self::ExtendLast | Self::Record => &[WAVE, PATHS, HITS],
            Self::Shade => &[WAVE, PATHS, HITS, SHADOW_RAYS, GATHERED],
            Self::Prepare => &[WAVE, DISPATCHES],
            Self::Connect => &[WAVE, SHADOW_RAYS, GATHERED],
            Self::Accumulate => &[WAVE, GATHERED],
        }
    }
}

/// What the stages share of queues.
pub(crate) const WAVEFRONT: &str = include_str!("../shaders/wavefront.wgsl");

/// How paths get from one stage to the next.
pub(crate) const HANDING: &str = include_str!("../shaders/wavefront_handing.wgsl");

/// What all stages have in front of them.
fn common() -> [&'static str; 3] {
    [include_str!("../shaders/film.wgsl"), include_str!("../shaders/path_vertex.wgsl"), WAVEFRONT]
}

/// The text of the stages that ask a tracer.
pub fn tracing_text(tracer: &TracerText, variant: Variant) -> String {
    let rays = include_str!("../shaders/rays.wgsl");
    let stages = include_str!("../shaders/wavefront_tracing.wgsl");
    let scene = scene_text(variant);
    let [film, vertex, wavefront] = common();
    [tracer.enables, &scene, &tracer.text, film, rays, vertex, wavefront, stages].join("\n")
}

/// The text of all other stages, the same for all tracers.
pub fn shading_text(variant: Variant) -> String {
    let stages = include_str!("../shaders/wavefront_shading.wgsl");
    let scene = scene_text(variant);
    let [film, vertex, wavefront] = common();
    [&scene, film, vertex, wavefront, HANDING, stages].join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::validate;
    use crate::tracer::query;
    use naga::{AddressSpace, Module, valid::ModuleInfo};

    /// Storage buffers that the entry point of a stage uses, as group and binding.
    fn storage_buffers(module: &Module, info: &ModuleInfo, stage: Stage) -> Vec<(u32, u32)> {
        let index = module.entry_points.iter().position(|e| e.name == stage.name()).expect("a stage");
        let used = module.global_variables.iter().filter(|(handle, variable)| {
            let is_storage = matches!(variable.space, AddressSpace::Storage { .. });
            is_storage && !info.get_entry_point(index)[*handle].is_empty()
        });
        used.filter_map(|(_, v)| v.binding.map(|b| (b.group, b.binding))).collect()
    }

    /// Every stage binds what its shader uses of film and queues, and no more storage buffers than a device must have.
    #[test]
    fn stages_bind_what_they_use() {
        // The least that our own hierarchy has: instances, a page of nodes, a page of primitives.
        const TRACER: usize = 3;
        const SCENE: usize = 6;
        for variant in Variant::all() {
            let (shading, shading_info) = validate("shading", &shading_text(variant));
            let (tracing, tracing_info) = validate("tracing", &tracing_text(&query::TEXT, variant));
            for stage in Stage::ALL {
                let (module, info) =
                    if stage.traces() { (&tracing, &tracing_info) } else { (&shading, &shading_info) };
                let bound = |group: u32, bindings: &[u32]| {
                    let used = storage_buffers(module, info, stage).into_iter();
                    let mut used: Vec<u32> =
                        used.filter(|&(g, _)| g == group).map(|(_, binding)| binding).collect();
                    used.sort_unstable();
                    assert_eq!(used, bindings, "{}: group {group}, {variant:?}", stage.name());
                };
                bound(2, stage.film_bindings());
                bound(3, stage.queue_bindings());
                let count = SCENE
                    + if stage.traces() { TRACER } else { 0 }
                    + stage.film_bindings().len()
                    + stage.queue_bindings().len();
                assert!(count <= crate::STORAGE_BUFFERS as usize, "{}: {count} buffers", stage.name());
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
