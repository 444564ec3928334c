//! A ray tracing pipeline with its shader binding table: one kernel on one scene.

use super::memory::Memory;
use super::spirv::{INTERSECTION, RayShaders};
use super::structures::Structures;
use super::table::{HitGroup, HitTable, RayType, Region, ShaderGroup, TableLayout};
use super::vulkan::{Vulkan, failed};
use crate::GpuError;
use ash::vk;
use scene::tables::GeometryKind;
use std::collections::BTreeMap;
use std::ffi::CString;
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::hal::api::Vulkan as Api;

/// Bind groups of the kernels: scene, tracer, view and film.
const GROUPS: usize = 3;

/// Rays trace no rays: paths are loops in the ray generation shader.
const RECURSION_DEPTH: u32 = 1;

/// Accesses out of bounds are caught: scenes come from files.
const CHECKS: bool = true;

/// Held by who compiles a pipeline: NVIDIA's driver (580.159) has two locks that threads which do so for different devices
/// take in different order, and then wait for ever.
static COMPILING: Mutex<()> = Mutex::new(());

/// What a shader sees at a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BindingSlot {
    Storage,
    Uniform,
    /// So many textures.
    Textures(u32),
    Structure,
}

impl BindingSlot {
    fn descriptor(self) -> vk::DescriptorType {
        match self {
            Self::Storage => vk::DescriptorType::STORAGE_BUFFER,
            Self::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
            Self::Textures(_) => vk::DescriptorType::SAMPLED_IMAGE,
            Self::Structure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
        }
    }

    /// How many descriptors it takes.
    fn count(self) -> u32 {
        match self {
            Self::Textures(count) => count,
            Self::Storage | Self::Uniform | Self::Structure => 1,
        }
    }
}

/// All bindings of the shaders, by group and number.
type Slots = BTreeMap<(u32, u32), BindingSlot>;

/// A pipeline: what it was made of can be dropped before it.
pub(super) struct Program {
    vulkan: Arc<Vulkan>,
    slots: Slots,
    set_layouts: Vec<vk::DescriptorSetLayout>,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    pool: vk::DescriptorPool,
    sets: Vec<vk::DescriptorSet>,
    table: Option<(Memory, TableLayout)>,
    structures: Arc<Structures>,
    /// What the sets point to: it must live as long.
    bound: Vec<((u32, u32), Resource)>,
}

/// A buffer or texture.
#[derive(Clone)]
pub(super) enum Resource {
    /// A buffer as a whole. It must have been written or cleared through wgpu.
    Buffer(wgpu::Buffer),
    /// Textures that are only read: one, or all of an array.
    Textures(Vec<wgpu::TextureView>),
}

impl Program {
    /// Compiles the pipeline of one ray generation shader, which is the only entry point of `generation`, and all shaders
    /// of `hits`.
    pub fn new(
        vulkan: &Arc<Vulkan>,
        generation: &RayShaders,
        hits: &RayShaders,
        structures: Arc<Structures>,
    ) -> Result<Self, GpuError> {
        let mut program = Self {
            vulkan: vulkan.clone(),
            slots: slots(&[generation, hits])?,
            set_layouts: Vec::new(),
            layout: vk::PipelineLayout::null(),
            pipeline: vk::Pipeline::null(),
            pool: vk::DescriptorPool::null(),
            sets: Vec::new(),
            table: None,
            structures,
            bound: Vec::new(),
        };
        program.make_layouts()?;
        program.make_sets()?;
        let mut modules = Modules { vulkan: vulkan.clone(), stages: Vec::new() };
        for shaders in [generation, hits] {
            modules.add(shaders)?;
        }
        let compiling = COMPILING.lock().unwrap_or_else(PoisonError::into_inner);
        program.make_pipeline(&modules)?;
        drop(compiling);
        Ok(program)
    }

    fn make_layouts(&mut self) -> Result<(), GpuError> {
        for group in 0..GROUPS as u32 {
            let bindings: Vec<_> = self
                .slots
                .range((group, 0)..(group + 1, 0))
                .map(|(&(_, binding), slot)| {
                    vk::DescriptorSetLayoutBinding::default()
                        .binding(binding)
                        .descriptor_type(slot.descriptor())
                        .descriptor_count(slot.count())
                        .stage_flags(
                            vk::ShaderStageFlags::RAYGEN_KHR
                                | vk::ShaderStageFlags::ANY_HIT_KHR
                                | vk::ShaderStageFlags::CLOSEST_HIT_KHR
                                | vk::ShaderStageFlags::MISS_KHR
                                | vk::ShaderStageFlags::INTERSECTION_KHR,
                        )
                })
                .collect();
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            // SAFETY: bindings are numbered once each, as the keys of a map are.
            let layout = unsafe { self.vulkan.raw.create_descriptor_set_layout(&info, None) };
            self.set_layouts.push(layout.map_err(failed("creating a descriptor set layout"))?);
        }
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&self.set_layouts);
        // SAFETY: the set layouts are alive.
        let layout = unsafe { self.vulkan.raw.create_pipeline_layout(&info, None) };
        self.layout = layout.map_err(failed("creating a pipeline layout"))?;
        Ok(())
    }

    fn make_sets(&mut self) -> Result<(), GpuError> {
        let size = |slot: BindingSlot| {
            let same = self.slots.values().filter(|s| s.descriptor() == slot.descriptor());
            let count = same.map(|s| s.count()).sum::<u32>();
            vk::DescriptorPoolSize::default().ty(slot.descriptor()).descriptor_count(count.max(1))
        };
        let sizes =
            [BindingSlot::Storage, BindingSlot::Uniform, BindingSlot::Textures(1), BindingSlot::Structure]
                .map(size);
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(GROUPS as u32).pool_sizes(&sizes);
        // SAFETY: the pool sizes are not empty and have known types.
        let pool = unsafe { self.vulkan.raw.create_descriptor_pool(&info, None) };
        self.pool = pool.map_err(failed("creating a descriptor pool"))?;
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&self.set_layouts);
        // SAFETY: the pool has room for these sets and nobody else uses it.
        let sets = unsafe { self.vulkan.raw.allocate_descriptor_sets(&info) };
        self.sets = sets.map_err(failed("allocating descriptor sets"))?;
        Ok(())
    }

    fn make_pipeline(&mut self, modules: &Modules) -> Result<(), GpuError> {
        let stages: Vec<_> = modules
            .stages
            .iter()
            .map(|s| {
                let info = vk::PipelineShaderStageCreateInfo::default().stage(s.stage).module(s.module);
                info.name(&s.name)
            })
            .collect();
        let groups = ShaderGroup::all().iter().map(|g| modules.group(g)).collect::<Result<Vec<_>, _>>()?;
        let info = vk::RayTracingPipelineCreateInfoKHR::default()
            .stages(&stages)
            .groups(&groups)
            .max_pipeline_ray_recursion_depth(RECURSION_DEPTH)
            .layout(self.layout);
        // SAFETY: stages, groups and layout are alive; groups name stages that exist and fit them.
        let made = unsafe {
            self.vulkan.pipelines.create_ray_tracing_pipelines(
                vk::DeferredOperationKHR::null(),
                vk::PipelineCache::null(),
                &[info],
                None,
            )
        };
        let refused = |(_, result): (Vec<vk::Pipeline>, vk::Result)| GpuError::Shader {
            shader: "the ray tracing pipeline".into(),
            reason: result.to_string(),
        };
        self.pipeline = made.map_err(refused)?.first().copied().unwrap_or_default();
        Ok(())
    }

    /// Makes the shader binding table of a scene.
    pub fn set_table(&mut self, table: &HitTable) -> Result<(), GpuError> {
        self.vulkan.wait()?;
        let rules = &self.vulkan.limits.table;
        let layout = TableLayout::new(rules, table.records.len() as u32).ok_or_else(|| GpuError::Limit {
            adapter: self.vulkan.adapter.clone(),
            limit: "bytes in a record of the shader binding table",
            needed: u64::from(rules.handle_size) + size_of::<super::table::HitRecord>() as u64,
            offered: u64::from(rules.max_stride),
        })?;
        let groups = ShaderGroup::all().len();
        let handle = rules.handle_size as usize;
        // SAFETY: the pipeline has these groups, and the data is as long as their handles.
        let handles = unsafe {
            self.vulkan.pipelines.get_ray_tracing_shader_group_handles(
                self.pipeline,
                0,
                groups as u32,
                groups * handle,
            )
        };
        let handles = handles.map_err(failed("asking for shader group handles"))?;
        let bytes = layout.bytes(table, |group| &handles[group.index() * handle..][..handle]);
        let usage = vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR;
        let base = u64::from(rules.base_alignment);
        let memory = Memory::with_bytes_at(&self.vulkan, "shader binding table", &bytes, usage, base)?;
        self.table = Some((memory, layout));
        Ok(())
    }

    /// Makes the shaders see these buffers and textures, by group and binding, and the structures. Waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Shader`] if a binding of the shaders gets nothing, or the wrong thing.
    pub fn bind(&mut self, resources: Vec<((u32, u32), Resource)>) -> Result<(), GpuError> {
        self.vulkan.wait()?;
        for (&(group, binding), &slot) in &self.slots {
            let write = vk::WriteDescriptorSet::default()
                .dst_set(self.sets[group as usize])
                .dst_binding(binding)
                .descriptor_type(slot.descriptor());
            let missing = || GpuError::Shader {
                shader: "the ray tracing pipeline".into(),
                reason: format!("group {group}, binding {binding} has no {slot:?}"),
            };
            let here = resources.iter().find(|(place, _)| *place == (group, binding)).map(|(_, r)| r);
            match (slot, here) {
                (BindingSlot::Structure, _) => self.bind_structure(write),
                (BindingSlot::Storage | BindingSlot::Uniform, Some(Resource::Buffer(buffer))) => {
                    // SAFETY: the raw handle is used only while `bound` keeps the buffer.
                    let hal = unsafe { buffer.as_hal::<Api>() }.ok_or_else(missing)?;
                    // SAFETY: as above.
                    let buffer = unsafe { hal.raw_handle() };
                    let info = [vk::DescriptorBufferInfo::default().buffer(buffer).range(vk::WHOLE_SIZE)];
                    self.update(write.buffer_info(&info));
                }
                (BindingSlot::Textures(count), Some(Resource::Textures(views)))
                    if views.len() == count as usize =>
                {
                    let info = |view: &wgpu::TextureView| {
                        // SAFETY: the raw handle is used only while `bound` keeps the view.
                        let hal = unsafe { view.as_hal::<Api>() }?;
                        // SAFETY: as above.
                        let view = unsafe { hal.raw_handle() };
                        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
                        Some(vk::DescriptorImageInfo::default().image_view(view).image_layout(layout))
                    };
                    let infos = views.iter().map(info).collect::<Option<Vec<_>>>().ok_or_else(missing)?;
                    self.update(write.image_info(&infos));
                }
                (BindingSlot::Storage | BindingSlot::Uniform | BindingSlot::Textures(_), _) => {
                    return Err(missing());
                }
            }
        }
        self.bound = resources;
        let textures = self.bound.iter().flat_map(|(_, resource)| match resource {
            Resource::Buffer(_) => &[],
            Resource::Textures(views) => &views[..],
        });
        let textures = textures.map(wgpu::TextureView::texture);
        self.vulkan.make_readable(textures);
        Ok(())
    }

    fn bind_structure(&self, write: vk::WriteDescriptorSet<'_>) {
        let tops = [self.structures.top()];
        let mut info =
            vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&tops);
        self.update(write.descriptor_count(1).push_next(&mut info));
    }

    fn update(&self, write: vk::WriteDescriptorSet<'_>) {
        // SAFETY: set and resource are alive, and the device does not use the set: `bind` has waited for it.
        unsafe { self.vulkan.raw.update_descriptor_sets(&[write], &[]) };
    }

    /// Records one ray generation shader for each of `size` into `encoder`, which must be used for nothing else.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if those are more than the device can start at once.
    pub fn trace(&self, encoder: &mut wgpu::CommandEncoder, size: [u32; 3]) -> Result<(), GpuError> {
        let rays = size.iter().map(|&s| u64::from(s)).product();
        let offered = self.vulkan.limits.max_rays;
        if rays > offered {
            let adapter = self.vulkan.adapter.clone();
            return Err(GpuError::Limit { adapter, limit: "rays of one dispatch", needed: rays, offered });
        }
        let Some((memory, layout)) = self.table.as_ref().filter(|_| rays > 0) else { return Ok(()) };
        let region = |r: &Region| {
            vk::StridedDeviceAddressRegionKHR::default()
                .device_address(memory.address + r.offset)
                .stride(r.stride)
                .size(r.size())
        };
        let (generation, miss, hit) = (region(&layout.generation), region(&layout.miss), region(&layout.hit));
        let callable = vk::StridedDeviceAddressRegionKHR::default();
        self.vulkan.record(encoder, |commands| {
            let (raw, point) = (&self.vulkan.raw, vk::PipelineBindPoint::RAY_TRACING_KHR);
            // SAFETY: pipeline, sets and table are alive until they are dropped, which waits for the device; the regions
            // are aligned and inside the table.
            unsafe {
                raw.cmd_bind_pipeline(commands, point, self.pipeline);
                raw.cmd_bind_descriptor_sets(commands, point, self.layout, 0, &self.sets, &[]);
                self.vulkan.pipelines.cmd_trace_rays(
                    commands,
                    &generation,
                    &miss,
                    &hit,
                    &callable,
                    size[0],
                    size[1],
                    size[2],
                );
            }
        });
        Ok(())
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // A device that is lost has nothing under way either.
        let _ = self.vulkan.wait();
        let raw = &self.vulkan.raw;
        // SAFETY: the device is done with them, and nobody else knows the handles; null is allowed.
        unsafe {
            raw.destroy_pipeline(self.pipeline, None);
            raw.destroy_descriptor_pool(self.pool, None);
            raw.destroy_pipeline_layout(self.layout, None);
            self.set_layouts.iter().for_each(|&layout| raw.destroy_descriptor_set_layout(layout, None));
        }
    }
}

/// The bindings of all shaders; those of the shader record's stand-in are none.
fn slots(shaders: &[&RayShaders]) -> Result<Slots, GpuError> {
    let mut slots = Slots::new();
    for shaders in shaders {
        let module = shaders.module();
        for (_, variable) in module.global_variables.iter() {
            let Some(place) = variable.binding.as_ref().filter(|b| (b.group as usize) < GROUPS) else {
                continue;
            };
            let slot = match (variable.space, &module.types[variable.ty].inner) {
                (naga::AddressSpace::Storage { .. }, _) => BindingSlot::Storage,
                (naga::AddressSpace::Uniform, _) => BindingSlot::Uniform,
                (_, naga::TypeInner::AccelerationStructure { .. }) => BindingSlot::Structure,
                (_, naga::TypeInner::Image { class: naga::ImageClass::Sampled { .. }, .. }) => {
                    BindingSlot::Textures(1)
                }
                (_, naga::TypeInner::BindingArray { size: naga::ArraySize::Constant(count), .. }) => {
                    BindingSlot::Textures(count.get())
                }
                (_, other) => {
                    let name = variable.name.clone().unwrap_or_default();
                    let reason = format!("{name} is a {other:?}, which ray tracing pipelines do not bind");
                    return Err(GpuError::Shader { shader: "a ray tracing shader".into(), reason });
                }
            };
            slots.insert((place.group, place.binding), slot);
        }
    }
    Ok(slots)
}

/// A shader of the pipeline.
struct ShaderStage {
    name: CString,
    stage: vk::ShaderStageFlags,
    module: vk::ShaderModule,
}

/// The shaders of a pipeline while it is made.
struct Modules {
    vulkan: Arc<Vulkan>,
    stages: Vec<ShaderStage>,
}

impl Modules {
    fn add(&mut self, shaders: &RayShaders) -> Result<(), GpuError> {
        for (name, stage) in shaders.entry_points() {
            let words = shaders.spirv(name, CHECKS)?;
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            let refused = |reason: String| GpuError::Shader { shader: name.to_owned(), reason };
            let c_name = CString::new(name).map_err(|e| refused(e.to_string()))?;
            let stage = match stage {
                _ if name == INTERSECTION => vk::ShaderStageFlags::INTERSECTION_KHR,
                naga::ShaderStage::RayGeneration => vk::ShaderStageFlags::RAYGEN_KHR,
                naga::ShaderStage::Miss => vk::ShaderStageFlags::MISS_KHR,
                naga::ShaderStage::ClosestHit => vk::ShaderStageFlags::CLOSEST_HIT_KHR,
                naga::ShaderStage::AnyHit => vk::ShaderStageFlags::ANY_HIT_KHR,
                other => return Err(refused(format!("{other:?} is no stage of ray tracing"))),
            };
            // SAFETY: the words are SPIR-V that naga validated and the patches kept valid.
            let module = unsafe { self.vulkan.raw.create_shader_module(&info, None) };
            let module = module.map_err(|e| refused(e.to_string()))?;
            self.stages.push(ShaderStage { name: c_name, stage, module });
        }
        Ok(())
    }

    /// The index of a shader.
    fn find(&self, name: &str) -> Result<u32, GpuError> {
        let at = self.stages.iter().position(|s| s.name.to_str() == Ok(name));
        let missing =
            || GpuError::Shader { shader: name.to_owned(), reason: "there is no such shader".into() };
        at.map(|i| i as u32).ok_or_else(missing)
    }

    fn group(
        &self,
        group: &ShaderGroup,
    ) -> Result<vk::RayTracingShaderGroupCreateInfoKHR<'static>, GpuError> {
        let blank = vk::RayTracingShaderGroupCreateInfoKHR::default()
            .ty(vk::RayTracingShaderGroupTypeKHR::GENERAL)
            .general_shader(vk::SHADER_UNUSED_KHR)
            .closest_hit_shader(vk::SHADER_UNUSED_KHR)
            .any_hit_shader(vk::SHADER_UNUSED_KHR)
            .intersection_shader(vk::SHADER_UNUSED_KHR);
        Ok(match group {
            // The modules begin with it.
            ShaderGroup::Generation => blank.general_shader(0),
            ShaderGroup::Miss(RayType::Radiance) => blank.general_shader(self.find("miss_radiance")?),
            ShaderGroup::Miss(RayType::Shadow) => blank.general_shader(self.find("miss_shadow")?),
            ShaderGroup::Hit(hit) => self.hit_group(hit, blank)?,
        })
    }

    fn hit_group(
        &self,
        hit: &HitGroup,
        blank: vk::RayTracingShaderGroupCreateInfoKHR<'static>,
    ) -> Result<vk::RayTracingShaderGroupCreateInfoKHR<'static>, GpuError> {
        let mut group = match hit.primitive {
            GeometryKind::Triangles => blank.ty(vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP),
            GeometryKind::Spheres => blank
                .ty(vk::RayTracingShaderGroupTypeKHR::PROCEDURAL_HIT_GROUP)
                .intersection_shader(self.find(INTERSECTION)?),
        };
        if hit.holes {
            group = group.any_hit_shader(self.find("look_for_holes")?);
        }
        if let Some(name) = hit.closest_hit() {
            group = group.closest_hit_shader(self.find(name)?);
        }
        Ok(group)
    }
}

impl Drop for Modules {
    fn drop(&mut self) {
        for stage in &self.stages {
            // SAFETY: pipelines do not need their modules once they are made.
            unsafe { self.vulkan.raw.destroy_shader_module(stage.module, None) };
        }
    }
}
