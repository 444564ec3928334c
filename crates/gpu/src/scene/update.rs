//! Changing a scene on the device without loading it again.
//!
//! Materials, lights, bindings and transforms are small beside geometry and textures. They are written anew into the
//! buffers where they are, through staging memory that is used again and again.

use super::{GpuScene, SceneTraits, materials, records, scene_info, variant_of};
use crate::shader::Variant;
use crate::{Gpu, GpuError};
use bytemuck::NoUninit;
use scene::tables::{Changes, SceneTables};
use std::sync::Arc;
use wgpu::util::StagingBelt;

/// Bytes of a piece of staging memory: most updates need one.
const CHUNK: u64 = 1 << 18;

/// A ring of staging memory: pieces that the device has read are written again.
pub struct StagingRing(StagingBelt);

impl StagingRing {
    /// An empty ring, which grows to what the largest updates need.
    pub fn new(gpu: &Gpu) -> Self {
        Self(StagingBelt::new(gpu.device.clone(), CHUNK))
    }

    /// Submits copies of all `writes` (a buffer, where in it in bytes, and what) before any work submitted later.
    ///
    /// # Errors
    /// When the device has no memory for the way.
    pub fn write(&mut self, gpu: &Gpu, writes: &[(&wgpu::Buffer, u64, &[u8])]) -> Result<(), GpuError> {
        let belt = &mut self.0;
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            for (buffer, offset, bytes) in writes {
                if let Some(size) = wgpu::BufferSize::new(bytes.len() as u64) {
                    belt.write_buffer(&mut encoder, buffer, *offset, size).copy_from_slice(bytes);
                }
            }
            belt.finish();
            gpu.queue.submit([encoder.finish()]);
            belt.recall();
        })
        .map_err(|reason| GpuError::Device { doing: "updating the scene", reason })
    }
}

/// Whether `data` fits into a buffer from byte `offset` on.
fn fits<T: NoUninit>(buffer: &wgpu::Buffer, offset: u64, data: &[T]) -> bool {
    offset + size_of_val(data) as u64 <= buffer.size()
}

impl GpuScene {
    /// Takes a version of the scene in which only `changes` are new. Returns whether that was possible: where something
    /// grows beyond its buffer, an environment image or a grid of densities changes, lights become several or one, or there is
    /// something that shaders are not made for, nothing is done, and the scene has to be uploaded again.
    ///
    /// # Errors
    /// When the device fails.
    pub fn update(
        &mut self,
        gpu: &Gpu,
        ring: &mut StagingRing,
        tables: &Arc<SceneTables>,
        changes: Changes,
    ) -> Result<bool, GpuError> {
        // Shaders are made for several lights or for one, and for boundaries or none.
        let tree_changes = tables.light_tree.is_empty() != self.tables.light_tree.is_empty();
        let boundaries_change = tables.has_boundaries() != self.tables.has_boundaries();
        if tree_changes || boundaries_change { Ok(false) } else { self.take(gpu, ring, tables, changes) }
    }

    /// As [`GpuScene::update`], for shaders that ask every light and choose none.
    ///
    /// # Errors
    /// When the device fails.
    pub(crate) fn take(
        &mut self,
        gpu: &Gpu,
        ring: &mut StagingRing,
        tables: &Arc<SceneTables>,
        changes: Changes,
    ) -> Result<bool, GpuError> {
        let has_image = |t: &SceneTables| t.environment.width > 0;
        let image_changes = changes.environment && (has_image(tables) || has_image(&self.tables));
        let words = self.words.with_changes(tables);
        let first_word = u64::from(words.first) * 4;
        let info = [scene_info(tables, &words, &self.places)];
        let instances = records::instances(tables);
        let bindings = records::bindings(tables, &words);
        let materials = materials::materials(tables, &words);
        let lights = records::lights(tables, &words);
        let b = &self.buffers;
        let all_fit = fits(&b.words, first_word, &words.data)
            && fits(&b.instances, 0, &instances)
            && fits(&b.bindings, 0, &bindings)
            && fits(&b.materials, 0, &materials)
            && fits(&b.lights, 0, &lights);
        // Shaders are made for what is in the scene.
        let without_choice = |tables| Variant { light_tree: false, ..variant_of(tables) };
        let shaders_change = without_choice(tables) != without_choice(&self.tables);
        let densities_change = changes.materials && tables.densities != self.tables.densities;
        if image_changes || densities_change || shaders_change || !all_fit {
            return Ok(false);
        }
        let mut writes: Vec<(&wgpu::Buffer, u64, &[u8])> = vec![(&b.info, 0, bytemuck::cast_slice(&info))];
        if changes.transforms {
            writes.push((&b.instances, 0, bytemuck::cast_slice(&instances)));
        }
        if changes.materials || changes.lights {
            writes.push((&b.bindings, 0, bytemuck::cast_slice(&bindings)));
            writes.push((&b.materials, 0, bytemuck::cast_slice(&materials)));
        }
        // Lights have places and moments of their own where instances shine.
        if changes.lights || changes.environment || changes.transforms {
            writes.push((&b.lights, 0, bytemuck::cast_slice(&lights)));
        }
        if !changes.is_empty() {
            writes.push((&b.words, first_word, bytemuck::cast_slice(&words.data)));
        }
        ring.write(gpu, &writes)?;
        self.words = words.without_data();
        self.tables = tables.clone();
        // What moves and changes may do so again: it is not asked anew each time.
        self.far_lights &= !(changes.lights || changes.transforms);
        self.traits = self.traits.or(SceneTraits::of(&materials, &bindings, &instances, &lights));
        gpu.check("updating the scene")?;
        Ok(true)
    }
}
