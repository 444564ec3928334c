//! Pictures that are on the device already, frame after frame.

use super::buffers::{TileBuffers, bindable_pixels};
use super::{BoundStep, GpuNetwork, steps};
use crate::pass::Dispatch;
use crate::{Gpu, GpuError};
use post::{Region, Tile};

/// What sides of what the network sees are multiples of.
const ALIGNMENT: u32 = 32;

/// Memory for a picture that passes before write and passes behind read, as one tile.
pub struct ResidentPicture {
    buffers: TileBuffers,
    steps: Vec<BoundStep>,
}

impl ResidentPicture {
    /// What the network sees: pixels as [`post::Prepared::pixels`] has them, row by row, of sides
    /// that are the next multiples of 32.
    pub fn input(&self) -> &wgpu::Buffer {
        self.buffers.ends()[0]
    }

    /// What it makes of them: three scaled values a pixel of the picture, row by row.
    pub fn result(&self) -> &wgpu::Buffer {
        self.buffers.ends()[1]
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.buffers.memory_bytes()
    }
}

impl GpuNetwork {
    /// Memory for pictures of a size, bound to the network's steps.
    ///
    /// # Errors
    /// When the picture has more pixels than the device can bind, or there is no memory.
    pub fn resident(&self, gpu: &Gpu, [width, height]: [u32; 2]) -> Result<ResidentPicture, GpuError> {
        let [across, down] = [width, height].map(|side| side.next_multiple_of(ALIGNMENT) as usize);
        let most = bindable_pixels(gpu, self.products.numbers());
        if across * down > most {
            let (adapter, needed, offered) = (gpu.info.name.clone(), (across * down) as u64, most as u64);
            return Err(GpuError::Limit { adapter, limit: "pixels of the learned filter", needed, offered });
        }
        let whole = Region { x: 0, y: 0, width: across, height: down };
        let tile = Tile { region: whole, core: whole };
        let steps = steps::steps(&tile, [width, height]);
        let buffers = TileBuffers::new(gpu, &[tile], self.products.numbers())?;
        buffers.write(gpu, &[], &steps)?;
        let steps = self.bind(gpu, &buffers, &steps)?;
        Ok(ResidentPicture { buffers, steps })
    }

    /// Records all steps within a pass.
    pub fn record(&self, recorded: &mut wgpu::ComputePass<'_>, picture: &ResidentPicture) {
        for step in &picture.steps {
            if let Some(pass) = self.passes.get(step.pass) {
                pass.dispatch(recorded, &step.groups, Dispatch::Groups(step.size));
            }
        }
    }
}
