//! Samples of single pixels, cut into portions.
//!
//! A pixel may deserve a thousand samples where its neighbours deserve none. An invocation that makes them one after the other keeps a
//! whole device waiting. So they are cut into portions, each of which is made by an invocation of its own and summed in a place of
//! its own; a pass adds these up (`shaders/portions.wgsl`), always in the same order.

use crate::bindings::{PassBinding, whole};
use crate::film::{FilmBuffers, FilmPixel};
use crate::pass::{Dispatch, Pass, PassGroups, PassSpec, compile};
use crate::scene::upload::{empty_buffer, write_buffer};
use crate::shader::Linkage;
use crate::{Gpu, GpuError};
use backend::PixelSamples;
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages;

/// Samples of a portion, those of the largest first. A pixel's samples are made up of as few of them as possible.
///
/// Invocations that run side by side wait for the one whose paths are longest, the less the more paths each has; and the more
/// samples a portion has, the fewer sums there are to add.
pub(crate) const PORTIONS: [u32; 3] = [16, 4, 1];

/// Portions that a pixel's samples are made up of: how often something is added to the pixel's sums, which is what their rounding
/// errors grow with.
pub(crate) fn portion_count(mut samples: u32) -> u32 {
    let mut count = 0;
    for size in PORTIONS {
        count += samples / size;
        samples %= size;
    }
    count
}

/// What a pixel of the window gets, as shaders see it (`Tally` of `shaders/film.wgsl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Share {
    /// Portions of the pixels before it.
    pub before: u32,
    /// Its first sample.
    pub first_sample: u32,
}

/// Pixels of a window in whole tiles of eight by eight, in whose order shares are.
pub(crate) fn pixels_in_tiles(size: [u32; 2]) -> u64 {
    size.iter().map(|&n| u64::from(n.div_ceil(8))).product::<u64>() * 64
}

/// The place of a pixel of the window, row by row, in the order of tiles.
pub(crate) fn number_in_tiles(width: u32, pixel: u32) -> usize {
    let (x, y) = (pixel % width, pixel / width);
    let tile = y as usize / 8 * width.div_ceil(8) as usize + x as usize / 8;
    64 * tile + (y % 8 * 8 + x % 8) as usize
}

/// Portions of one size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Portions {
    /// Samples of each.
    pub samples: u32,
    /// How many there are of all pixels.
    pub count: u32,
    /// By pixel, tile by tile.
    pub shares: Vec<Share>,
}

/// Cuts samples of pixels of a window into portions of each size that is needed, to be made in this order. No pixel may be
/// there twice.
pub(crate) fn portions(size: [u32; 2], pixels: &[PixelSamples]) -> impl Iterator<Item = Portions> {
    let mut larger = u32::MAX;
    PORTIONS.into_iter().filter_map(move |samples| {
        let mut shares = vec![Share::default(); pixels_in_tiles(size) as usize];
        for p in pixels {
            let rest = p.count % larger;
            let first_sample = p.first + (p.count - rest);
            shares[number_in_tiles(size[0], p.pixel)] = Share { before: rest / samples, first_sample };
        }
        larger = samples;
        let mut count = 0;
        for share in &mut shares {
            let own = std::mem::replace(&mut share.before, count);
            count += own;
        }
        (count > 0).then_some(Portions { samples, count, shares })
    })
}

/// See `shaders/portions.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Task {
    size: [u32; 2],
    first: u32,
    count: u32,
    all: u32,
    padding: u32,
}

/// The pass that adds portions of a film to their pixels.
pub(crate) struct Gathering {
    pass: Pass,
    groups: PassGroups,
    task: wgpu::Buffer,
    size: [u32; 2],
}

/// What it is.
const GATHER: PassSpec = PassSpec {
    own: &[PassBinding::Uniform(0), PassBinding::Write(1), PassBinding::Read(2)],
    ..PassSpec::new("portions", "gather")
};

impl Gathering {
    /// For a film.
    ///
    /// # Errors
    /// When the driver refuses the shader.
    pub fn new(gpu: &Gpu, film: &FilmBuffers) -> Result<Self, GpuError> {
        let task = empty_buffer(gpu, "portions", size_of::<Task>() as u64, BufferUsages::UNIFORM)?;
        let mut pass = Pass::new(gpu, "portions'", GATHER, &Linkage::default(), None, None)?;
        compile(gpu, [&mut pass])?;
        let resources = [whole(0, &task), whole(1, &film.pixels), whole(2, &film.counters)];
        let groups = pass.bind(gpu, &[], &resources)?;
        let size = film.contents.picture().window_size;
        Ok(Self { pass, groups, task, size })
    }

    /// Adds portions `first` to `first + count` of `all`, which have been submitted, to their pixels.
    ///
    /// # Errors
    /// When the device fails.
    pub fn submit(&self, gpu: &Gpu, first: u32, count: u32, all: u32) -> Result<(), GpuError> {
        let task = Task { size: self.size, first, count, all, padding: 0 };
        write_buffer(gpu, "portions", &self.task, bytemuck::bytes_of(&task))?;
        let workgroups = self.size.map(|n| n.div_ceil(8));
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut recorded = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            self.pass.dispatch(&mut recorded, &self.groups, Dispatch::Groups(workgroups));
            drop(recorded);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: "adding up portions", reason })
    }
}

/// Bytes of one portion's sums.
pub(crate) const PORTION_BYTES: u64 = size_of::<FilmPixel>() as u64;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{assert_layout, layout_of};
    use crate::shader::check;

    #[test]
    fn the_shader_fits_and_translates_for_every_driver() {
        let module = check::module("portions");
        assert_layout!(module, Task { size, first, count, all, padding });
        assert_eq!(layout_of(&module, "FilmPixel"), layout_of(&check::module("film"), "FilmPixel"));
        check::check_pass(&GATHER, &Linkage::default(), "alone");
    }

    /// Every sample of every pixel is in one portion, and those of a pixel are next to each other and in order.
    #[test]
    fn portions_hold_every_sample_once() {
        let size = [25, 21];
        let wanted = [0, 1, 4, 12, 300, 999, 64, 16];
        // Some pixels are not there at all, and none is where it would be in order.
        let pixels: Vec<_> = (0..500)
            .rev()
            .map(|i| PixelSamples { pixel: i, first: 8 + i, count: wanted[i as usize % wanted.len()] })
            .collect();
        let mut next: Vec<u32> = (0..525).map(|i| 8 + i).collect();
        for cut in portions(size, &pixels) {
            let mut found = 0;
            for pixel in 0..525 {
                let number = number_in_tiles(size[0], pixel);
                let share = cut.shares[number];
                let end = cut.shares.get(number + 1).map_or(cut.count, |s| s.before);
                for portion in share.before..end {
                    let first = share.first_sample + (portion - share.before) * cut.samples;
                    assert_eq!(first, next[pixel as usize], "pixel {pixel}, portions of {}", cut.samples);
                    next[pixel as usize] += cut.samples;
                    found += 1;
                }
            }
            assert_eq!(found, cut.count, "portions of {}", cut.samples);
        }
        for p in &pixels {
            assert_eq!(next[p.pixel as usize], p.first + p.count, "pixel {}", p.pixel);
        }
    }

    #[test]
    fn portions_are_as_few_as_possible() {
        for (samples, portions) in [(0, 0), (1, 1), (4, 1), (16, 1), (23, 1 + 1 + 3), (1024, 64)] {
            assert_eq!(portion_count(samples), portions, "{samples}");
        }
    }

    #[test]
    fn sizes_that_nobody_needs_are_left_out() {
        let pixels =
            [PixelSamples { pixel: 3, first: 0, count: 32 }, PixelSamples { pixel: 4, first: 2, count: 3 }];
        let sizes: Vec<_> = portions([8, 8], &pixels).map(|p| (p.samples, p.count)).collect();
        assert_eq!(sizes, [(16, 2), (1, 3)]);
        assert_eq!(portions([8, 8], &[]).count(), 0);
    }
}
