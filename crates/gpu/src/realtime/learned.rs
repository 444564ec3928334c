//! The learned denoiser's network as the spatial filter of frames.
//!
//! It sees what the filter by edges sees: the light that frames have found together, its deviation,
//! and the surfaces. Both lobes are filtered as one. What is emitted has no noise and goes around
//! it.

use super::buffers::Buffers;
use super::passes::{planes, slots::*};
use crate::bindings::PassBinding::{Read, Uniform, Write};
use crate::bindings::whole;
use crate::denoise::{GpuNetwork, ResidentPicture};
use crate::pass::{self, Dispatch, Pass, PassGroups, PassSpec};
use crate::shader::Linkage;
use crate::{Gpu, GpuError};

/// What the network sees.
const PICTURE: u32 = 27;
/// What it has filtered.
const RESULT: u32 = 28;

/// The passes before the network and behind it.
fn specs() -> [PassSpec; 2] {
    [
        PassSpec {
            own: &[Uniform(REALTIME), Read(GUIDES), Read(SIGNALS_IN), Write(PICTURE)],
            ..PassSpec::new("realtime_learned", "show_network")
        },
        PassSpec {
            own: &[Uniform(REALTIME), Read(GUIDES), Read(SIGNALS_IN), Read(RESULT), Write(COLORS)],
            ..PassSpec::new("realtime_learned_result", "finish_learned")
        },
    ]
}

fn linkage(spec: &PassSpec) -> Linkage {
    Linkage::default().with(&planes(spec.own))
}

/// The filter on a device.
pub(super) struct Learned {
    network: GpuNetwork,
    /// What shows the light to the network, and what makes radiance of its result.
    passes: [Pass; 2],
    bound: Option<Bound>,
}

/// What depends on the picture's size.
struct Bound {
    picture: ResidentPicture,
    groups: [PassGroups; 2],
    size: [u32; 2],
}

impl Learned {
    /// Compiles it.
    ///
    /// # Errors
    /// When the driver refuses a shader, or there is no memory for the weights.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let make = |spec: PassSpec| {
            let linkage = linkage(&spec);
            Pass::new(gpu, "realtime", spec, &linkage, None, None)
        };
        let [before, behind] = specs().map(make);
        let mut passes = [before?, behind?];
        pass::compile(gpu, &mut passes)?;
        Ok(Self { network: GpuNetwork::new(gpu)?, passes, bound: None })
    }

    /// Forgets the buffers of frames.
    pub fn unbind(&mut self) {
        self.bound = None;
    }

    /// Binds the buffers of frames, unless that is done.
    ///
    /// # Errors
    /// When the picture has more pixels than the device can bind, or there is no memory.
    pub fn prepare(&mut self, gpu: &Gpu, buffers: &Buffers) -> Result<(), GpuError> {
        if self.bound.is_some() {
            return Ok(());
        }
        let picture = self.network.resident(gpu, buffers.size)?;
        let own = [
            whole(REALTIME, &buffers.realtime),
            whole(GUIDES, &buffers.guides),
            // The accumulation writes them.
            whole(SIGNALS_IN, &buffers.signals[0]),
            whole(PICTURE, picture.input()),
            whole(RESULT, picture.result()),
            whole(COLORS, &buffers.colors),
        ];
        let bind = |pass: &Pass| pass.bind(gpu, &[], &own);
        let groups = [bind(&self.passes[0])?, bind(&self.passes[1])?];
        self.bound = Some(Bound { picture, groups, size: buffers.size });
        Ok(())
    }

    /// Bytes on the device that depend on the picture's size.
    pub fn memory_bytes(&self) -> u64 {
        self.bound.as_ref().map_or(0, |bound| bound.picture.memory_bytes())
    }

    /// Records it: from the light that was gathered to the frame's colours.
    pub fn record(&self, recorded: &mut wgpu::ComputePass<'_>) {
        let Some(Bound { picture, groups: [before, behind], size }) = &self.bound else { return };
        let padded = size.map(|side| side.next_multiple_of(32).div_ceil(8));
        self.passes[0].dispatch(recorded, before, Dispatch::Groups(padded));
        self.network.record(recorded, picture);
        self.passes[1].dispatch(recorded, behind, Dispatch::Groups(size.map(|side| side.div_ceil(8))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::check::check_pass;

    #[test]
    fn passes_bind_what_they_use() {
        specs().iter().for_each(|spec| check_pass(spec, &linkage(spec), spec.name));
    }
}
