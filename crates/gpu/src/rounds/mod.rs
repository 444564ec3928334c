//! Rounds of adaptive sampling that the device decides about by itself.
//!
//! A fast device makes a sample of every pixel in less time than the host needs to read a film. So the film stays where it is:
//! passes over it find out how noisy each pixel is, how many samples all deserve, and which pixels get how many
//! (`shaders/rounds.wgsl`; the rule itself is the optics', as that of [`film::Allocation`]). The host reads back how many portions of
//! samples that makes, a few words, and starts them; which pixels they belong to is known on the device.

use crate::bindings::PassBinding::{Read, Uniform, Write};
use crate::bindings::whole;
use crate::film::{FilmBuffers, FilmPixel};
use crate::pass::{Dispatch, Pass, PassGroups, PassSpec, begin, compile};
use crate::portions::PORTIONS;
use crate::readback::read_mapped;
use crate::scene::upload::{empty_buffer, write_buffer};
use crate::shader::Linkage;
use crate::timing::Timer;
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use film::Film;
use wgpu::BufferUsages;

/// Sizes of portions that are needed: what pixels get are multiples of the last of them.
const SIZES: usize = 2;
/// Factors that are tried at a time, and pixels that one workgroup tries them on.
const CANDIDATES: u64 = 8;
const TRIED_PIXELS: u64 = 1024;
/// How often the search for the factor is narrowed, by [`CANDIDATES`] each time.
const SEARCH_STEPS: usize = 7;
/// Bytes of an estimate and of a plan.
const ESTIMATE: u64 = 32;
const PLAN: u64 = 16;
/// What messages and profiles call it.
const DECIDING: &str = "choosing pixels";
/// Workgroups in a row of those that try factors.
const MOST_GROUPS: u64 = 1024;

/// See `shaders/rounds.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Round {
    size: [u32; 2],
    first_sample: u32,
    size_number: u32,
    total: f32,
    offset: f32,
    padding: [u32; 2],
}

/// See `shaders/rounds.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Picture {
    offset: f32,
    squared_error: f32,
    least_valid: f32,
    least_taken: f32,
    low: f32,
    high: f32,
    most_extra: u32,
    portions: [u32; SIZES],
}

/// What the device has found out about its film.
#[derive(Clone, Debug)]
pub(crate) struct Decision {
    /// See [`Film::relative_error`]; relative to what the round was to be relative to.
    pub error: f64,
    /// Valid samples of the pixel that has fewest.
    pub least_valid: u32,
    /// All samples of the pixel that has fewest.
    pub least_taken: u32,
    /// Samples of the pixel that gets most.
    pub most_extra: u32,
    /// How many portions there are of each size.
    counts: [u32; SIZES],
}

impl Decision {
    /// What is to be done: which of the sizes ([`PORTIONS`]), and how many.
    pub fn portions(&self) -> impl Iterator<Item = (usize, u32)> {
        self.counts.into_iter().enumerate()
    }

    /// Samples of all pixels.
    pub fn samples(&self) -> u64 {
        self.portions().map(|(size, count)| u64::from(PORTIONS[size]) * u64::from(count)).sum()
    }
}

/// The passes, in the order in which they run.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RoundStep {
    Estimate,
    SetLevel,
    Weigh,
    SetRange,
    TryFactors,
    Narrow,
    Choose,
    CountPortions,
    PlaceTiles,
    ShareOut,
}

impl RoundStep {
    const ALL: [Self; 10] = [
        Self::Estimate,
        Self::SetLevel,
        Self::Weigh,
        Self::SetRange,
        Self::TryFactors,
        Self::Narrow,
        Self::Choose,
        Self::CountPortions,
        Self::PlaceTiles,
        Self::ShareOut,
    ];

    fn spec(self) -> PassSpec {
        let entry_point = match self {
            Self::Estimate => "estimate",
            Self::SetLevel => "set_level",
            Self::Weigh => "weigh",
            Self::SetRange => "set_range",
            Self::TryFactors => "try_factors",
            Self::Narrow => "narrow",
            Self::Choose => "choose",
            Self::CountPortions => "count_portions",
            Self::PlaceTiles => "place_tiles",
            Self::ShareOut => "share_out",
        };
        // The film is the kernels' and the host's: rounds only read it.
        let own = &[Uniform(0), Read(1), Read(2), Write(3), Write(4), Write(5), Write(6), Write(7)];
        PassSpec { own, ..PassSpec::new("rounds", entry_point) }
    }
}

/// Decides about rounds of one film.
pub(crate) struct Rounds {
    passes: Vec<Pass>,
    /// All passes bind the same.
    groups: PassGroups,
    uniform: wgpu::Buffer,
    base: wgpu::Buffer,
    #[cfg(test)]
    plans: wgpu::Buffer,
    picture: wgpu::Buffer,
    staging: wgpu::Buffer,
    round: Round,
    /// How often the film had been read by the host when `base` was brought there.
    folds: u32,
    bytes: u64,
}

impl Rounds {
    /// For a film of which nothing has been read by the host yet.
    ///
    /// # Errors
    /// When there is no memory, or the driver refuses the shader.
    pub fn new(gpu: &Gpu, film: &FilmBuffers) -> Result<Self, GpuError> {
        let size = film.contents.picture().window_size;
        let area = u64::from(size[0]) * u64::from(size[1]);
        let tiles = u64::from(size[0].div_ceil(8)) * u64::from(size[1].div_ceil(8));
        let sums = 4 * (4 * tiles).max(CANDIDATES * area.div_ceil(TRIED_PIXELS));
        let readable = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let storage = |object, bytes| empty_buffer(gpu, object, bytes, readable);
        let picture_bytes = size_of::<Picture>() as u64;
        let uniform = empty_buffer(gpu, "a round", size_of::<Round>() as u64, BufferUsages::UNIFORM)?;
        let base = storage("samples that the host has", area * size_of::<FilmPixel>() as u64)?;
        let estimates = storage("estimates of pixels", area * ESTIMATE)?;
        let plans = storage("what pixels get", area * PLAN)?;
        let sums = storage("sums of tiles", sums)?;
        let picture = storage("what a round decides", picture_bytes)?;
        let mapped = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = empty_buffer(gpu, "reading what a round decides", picture_bytes, mapped)?;
        let buffers = [&uniform, &film.pixels, &base, &film.counters, &estimates, &plans, &sums, &picture];
        let make = |step: RoundStep| Pass::new(gpu, "rounds'", step.spec(), &Linkage::default(), None, None);
        let mut passes = RoundStep::ALL.into_iter().map(make).collect::<Result<Vec<_>, _>>()?;
        compile(gpu, &mut passes)?;
        let resources: Vec<_> = (0..).zip(buffers).map(|(number, buffer)| whole(number, buffer)).collect();
        let groups = passes[0].bind(gpu, &[], &resources)?;
        Ok(Self {
            passes,
            groups,
            bytes: [&base, &estimates, &plans, &sums].iter().map(|b| b.size()).sum(),
            uniform,
            base,
            #[cfg(test)]
            plans,
            picture,
            staging,
            round: Round { size, ..Round::default() },
            folds: 0,
        })
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.bytes
    }

    /// Brings what the host has of the film back to the device, unless it is there. `folds`: how often it has read the device's.
    ///
    /// # Errors
    /// When there is no memory for the copy.
    pub fn follow(&mut self, gpu: &Gpu, film: &Film, folds: u32) -> Result<(), GpuError> {
        if self.folds != folds {
            let pixels: Vec<_> = film.pixels().iter().map(FilmPixel::of).collect();
            write_buffer(gpu, "samples that the host has", &self.base, bytemuck::cast_slice(&pixels))?;
            self.folds = folds;
        }
        Ok(())
    }

    /// Forgets what the host has: the film is empty.
    ///
    /// # Errors
    /// When the device fails at once.
    pub fn forget(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        if std::mem::take(&mut self.folds) == 0 {
            return Ok(());
        }
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&self.base, 0, None);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: "forgetting samples", reason })
    }

    /// Has the device decide who gets samples so that all pixels together have about `total`, once all that was submitted before is
    /// done. [`Rounds::read`] says what it has decided.
    ///
    /// - `first_sample`: of the picture. `offset`: see [`film::Allocation::new`].
    ///
    /// # Errors
    /// When the device fails at once.
    pub fn decide(
        &mut self,
        gpu: &Gpu,
        first_sample: u32,
        total: u64,
        offset: Option<f64>,
        timer: &mut Timer,
    ) -> Result<(), GpuError> {
        self.round.first_sample = first_sample;
        self.round.total = total as f32;
        self.round.offset = offset.map_or(-1.0, |offset| offset as f32);
        self.write_round(gpu)?;
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&self.picture, 0, None);
            let mut recorded = begin(&mut encoder, timer, DECIDING);
            for step in [RoundStep::Estimate, RoundStep::SetLevel, RoundStep::Weigh, RoundStep::SetRange] {
                self.dispatch(&mut recorded, step);
            }
            for _ in 0..SEARCH_STEPS {
                self.dispatch(&mut recorded, RoundStep::TryFactors);
                self.dispatch(&mut recorded, RoundStep::Narrow);
            }
            self.dispatch(&mut recorded, RoundStep::Choose);
            drop(recorded);
            encoder.copy_buffer_to_buffer(&self.picture, 0, &self.staging, 0, self.picture.size());
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: DECIDING, reason })
    }

    /// Waits for what the device decides.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read(&self, gpu: &Gpu) -> Result<Decision, GpuError> {
        let size = self.staging.size();
        let picture =
            read_mapped(gpu, &self.staging, size, DECIDING, bytemuck::pod_read_unaligned::<Picture>)?;
        Ok(decision(&picture))
    }

    /// Has the device say which pixels the portions of a size belong to, where kernels look for it.
    ///
    /// # Errors
    /// When the device fails at once.
    pub fn share_out(&mut self, gpu: &Gpu, size: usize) -> Result<(), GpuError> {
        self.round.size_number = size as u32;
        self.write_round(gpu)?;
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut recorded = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            for step in [RoundStep::CountPortions, RoundStep::PlaceTiles, RoundStep::ShareOut] {
                self.dispatch(&mut recorded, step);
            }
            drop(recorded);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: "sharing out portions", reason })
    }

    fn write_round(&self, gpu: &Gpu) -> Result<(), GpuError> {
        write_buffer(gpu, "a round", &self.uniform, bytemuck::bytes_of(&self.round))
    }

    fn dispatch(&self, recorded: &mut wgpu::ComputePass<'_>, step: RoundStep) {
        let [width, height] = self.round.size;
        let groups = match step {
            RoundStep::SetLevel | RoundStep::SetRange | RoundStep::Narrow | RoundStep::PlaceTiles => [1, 1],
            RoundStep::TryFactors => {
                let groups = (u64::from(width) * u64::from(height)).div_ceil(TRIED_PIXELS);
                let across = groups.clamp(1, MOST_GROUPS);
                [across as u32, groups.div_ceil(across) as u32]
            }
            RoundStep::Estimate
            | RoundStep::Weigh
            | RoundStep::Choose
            | RoundStep::CountPortions
            | RoundStep::ShareOut => [width.div_ceil(8), height.div_ceil(8)],
        };
        self.passes[step as usize].dispatch(recorded, &self.groups, Dispatch::Groups(groups));
    }
}

fn decision(picture: &Picture) -> Decision {
    Decision {
        error: f64::from(picture.squared_error).sqrt(),
        least_valid: picture.least_valid as u32,
        least_taken: picture.least_taken as u32,
        most_extra: picture.most_extra,
        counts: picture.portions,
    }
}

#[cfg(test)]
mod tests;
