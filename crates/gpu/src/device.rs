//! Choosing and opening a GPU.
//!
//! Nothing here panics on an old driver, a missing feature or no adapter at all: what is missing is named. wgpu reports
//! most errors late, through callbacks; [`Gpu::check`] and [`Gpu::guarded`] bring them back to who caused them.

use crate::GpuError;
use crate::faults::{FaultKind, InjectedFault, Reports};
use crate::matrix_units::{MATRIX_FEATURES, MatrixUnits};
use crate::pipeline_store::PipelineStore;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;
use wgpu::{DeviceType, Features, Limits};

/// What is used where a device has it. Nothing of this is required to open a device.
const WANTED: Features = Features::EXPERIMENTAL_RAY_QUERY
    .union(Features::EXPERIMENTAL_RAY_TRACING_PIPELINES)
    .union(Features::TIMESTAMP_QUERY)
    .union(Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    .union(Features::TIMESTAMP_QUERY_INSIDE_PASSES)
    .union(Features::SUBGROUP)
    .union(Features::IMMEDIATES)
    .union(Features::PRIMITIVE_INDEX)
    .union(Features::PASSTHROUGH_SHADERS)
    .union(Features::TEXTURE_BINDING_ARRAY)
    .union(Features::BUFFER_BINDING_ARRAY)
    .union(Features::STORAGE_RESOURCE_BINDING_ARRAY)
    .union(Features::SAMPLED_TEXTURE_AND_STORAGE_BUFFER_ARRAY_NON_UNIFORM_INDEXING)
    .union(Features::PARTIALLY_BOUND_BINDING_ARRAY)
    .union(Features::SHADER_INT64)
    .union(Features::PIPELINE_CACHE)
    .union(MATRIX_FEATURES);

/// Storage buffers that one shader needs: scene, tracer and film together.
pub const STORAGE_BUFFERS: u32 = 12;

/// Which GPU to open, and what to pretend that it cannot do.
#[derive(Clone, Debug)]
pub struct GpuOptions {
    /// A part of the adapter's name, in any case; `None` takes the best.
    pub adapter: Option<String>,
    /// How many adapters that would do to pass over: machines have several of one name.
    pub ordinal: usize,
    /// Whether a driver that computes on the CPU will do.
    pub allow_software: bool,
    /// Features that may be used, if the adapter has them. Tests mask some out.
    pub features: Features,
    /// Upper bounds of what may be used of the adapter's limits. Tests lower some.
    pub limits: Option<LimitCaps>,
    /// A fault that tests make.
    pub fault: Option<InjectedFault>,
}

impl Default for GpuOptions {
    fn default() -> Self {
        Self {
            adapter: None,
            ordinal: 0,
            allow_software: true,
            features: Features::all(),
            limits: None,
            fault: None,
        }
    }
}

/// Upper bounds of limits, for pretending to be on a smaller device.
#[derive(Clone, Copy, Debug)]
pub struct LimitCaps {
    /// Bytes that a shader can see of one buffer.
    pub storage_binding_bytes: u64,
    /// Longest side of a texture.
    pub texture_side: u32,
    /// Storage buffers of one shader.
    pub storage_buffers: u32,
}

impl Default for LimitCaps {
    fn default() -> Self {
        Self { storage_binding_bytes: u64::MAX, texture_side: u32::MAX, storage_buffers: u32::MAX }
    }
}

/// An adapter of this machine.
#[derive(Clone, Debug)]
pub struct AdapterSummary {
    /// Name, driver and kind.
    pub info: wgpu::AdapterInfo,
    /// All features that it has, not only those that are used.
    pub features: Features,
    /// Its limits.
    pub limits: Limits,
}

impl AdapterSummary {
    fn new(adapter: &wgpu::Adapter) -> Self {
        Self { info: adapter.get_info(), features: adapter.features(), limits: adapter.limits() }
    }

    /// Whether it computes on the CPU.
    pub fn is_software(&self) -> bool {
        self.info.device_type == DeviceType::Cpu
    }

    /// Of those wanted, the features that it has, by name.
    pub fn used_features(&self) -> Vec<String> {
        (self.features & WANTED).iter_names().map(|(name, _)| name.to_owned()).collect()
    }

    /// Of those wanted, the features that it lacks, by name.
    pub fn missing_features(&self) -> Vec<String> {
        (WANTED - self.features).iter_names().map(|(name, _)| name.to_owned()).collect()
    }
}

/// Abstract modules, each with the one that stands for it.
pub(crate) type Sums = [(&'static str, &'static str); 2];

/// Numbers are added up among a workgroup, and then once to what all share: that saves hardware its atomics.
pub(crate) const SUMS_BY_GROUP: Sums = [("ray_sum", "group_rays"), ("handing", "wavefront_handing")];

/// Each invocation adds to what all share. Software drivers compile barriers for minutes.
pub(crate) const SUMS_BY_INVOCATION: Sums = [("ray_sum", "own_rays"), ("handing", "own_handing")];

/// An open device.
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter that it is on.
    pub info: wgpu::AdapterInfo,
    /// Features that may be used.
    pub features: Features,
    /// Limits to be kept.
    pub limits: Limits,
    /// What it multiplies matrices with, if it can.
    pub(crate) matrix_units: Option<MatrixUnits>,
    /// Which modules count rays and hand paths on: those that add up among a workgroup, or those that do without.
    pub(crate) sums: Sums,
    /// Compute pipelines by their entry point and text: a scene that is loaded again, or another one of the same kind, waits for no
    /// compiler.
    pub(crate) pipelines: Mutex<HashMap<String, wgpu::ComputePipeline>>,
    /// Those of earlier runs.
    pub(crate) store: Option<PipelineStore>,
    reports: Reports,
    fault: Option<InjectedFault>,
}

/// All adapters of this machine, the best first.
pub fn adapters() -> Vec<AdapterSummary> {
    ranked_adapters(&instance(None)).iter().map(AdapterSummary::new).collect()
}

/// Whether this machine has a GPU that is not a program. Looks once.
pub fn has_hardware() -> bool {
    static FOUND: OnceLock<bool> = OnceLock::new();
    *FOUND.get_or_init(|| adapters().iter().any(|a| !a.is_software()))
}

/// The drivers of this machine; with a display, those that draw on its windows do so.
pub(crate) fn instance(display: Option<Box<dyn wgpu::wgt::WgpuHasDisplayHandle>>) -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY.with_env(),
        // The validation layer of many systems is older than the shaders that wgpu writes and reports false errors.
        flags: wgpu::InstanceFlags::empty().with_env(),
        display,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    })
}

/// All adapters, the best first.
pub(crate) fn ranked_adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    adapters.sort_by_key(|a| {
        let info = a.get_info();
        let kind = match info.device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other => 3,
            DeviceType::Cpu => 4,
        };
        // The same chip may be there twice, through two driver interfaces.
        (kind, info.backend != wgpu::Backend::Vulkan)
    });
    adapters
}

impl Gpu {
    /// Opens the adapter that the options ask for, or the best one.
    ///
    /// # Errors
    /// When there is none, its limits are too low, or the driver refuses.
    pub fn open(options: &GpuOptions) -> Result<Self, GpuError> {
        Ok(Self::open_one(&ranked_adapters(&instance(None)), options)?.0)
    }

    /// Opens one of `adapters`, and says which: that which the options ask for, or the first that will do.
    ///
    /// # Errors
    /// As [`Gpu::open`].
    pub(crate) fn open_one<'a>(
        adapters: &'a [wgpu::Adapter],
        options: &GpuOptions,
    ) -> Result<(Self, &'a wgpu::Adapter), GpuError> {
        let adapter = pick(adapters, options)?;
        let info = adapter.get_info();
        let features = adapter.features() & WANTED & options.features;
        let limits = capped(adapter.limits(), options.limits.unwrap_or_default());
        if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
            return Err(GpuError::Limit {
                adapter: info.name,
                limit: "storage buffers a shader",
                needed: u64::from(STORAGE_BUFFERS),
                offered: u64::from(limits.max_storage_buffers_per_shader_stage),
            });
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("alhazen"),
            required_features: features,
            required_limits: limits.clone(),
            // SAFETY: the experimental features are ray queries, ray tracing pipelines and cooperative matrices;
            // what wgpu asks of their users (acceleration structures are built before they are traced, queries
            // initialised before they proceed, indices in bounds) is kept by the tracers and the denoiser's
            // products, and tested on a software driver.
            experimental_features: unsafe { wgpu::ExperimentalFeatures::enabled() },
            memory_hints: wgpu::MemoryHints::Performance,
            trace: wgpu::Trace::Off,
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::Open { adapter: info.name.clone(), reason: e.to_string() })?;
        let reports = Reports::default();
        let sink = reports.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            sink.lock().error.get_or_insert_with(|| error_text(&error));
        }));
        let sink = reports.clone();
        device.set_device_lost_callback(move |reason, message| {
            sink.lock().lost.get_or_insert_with(|| format!("{reason:?}: {message}"));
        });
        let store = PipelineStore::open(&device, features, &info);
        let (pipelines, fault) = (Mutex::default(), options.fault.clone());
        let matrix_units = MatrixUnits::of(adapter, features);
        let sums = if info.device_type == DeviceType::Cpu { SUMS_BY_INVOCATION } else { SUMS_BY_GROUP };
        let gpu = Self {
            device,
            queue,
            info,
            features,
            limits,
            matrix_units,
            sums,
            pipelines,
            store,
            reports,
            fault,
        };
        Ok((gpu, adapter))
    }

    /// What it is, for people.
    pub fn describe(&self) -> String {
        let driver = [self.info.driver.as_str(), self.info.driver_info.as_str()].join(" ");
        format!("{} ({:?}, {})", self.info.name, self.info.backend, driver.trim())
    }

    /// Whether it computes on the CPU.
    pub fn is_software(&self) -> bool {
        self.info.device_type == DeviceType::Cpu
    }

    /// Whether the device is gone for good.
    pub fn is_lost(&self) -> bool {
        self.reports.lock().lost.is_some()
    }

    /// What the device has reported since the last call.
    ///
    /// # Errors
    /// The first error that it reported. A lost device stays lost.
    pub fn check(&self, doing: &'static str) -> Result<(), GpuError> {
        let mut reported = self.reports.lock();
        if let Some(reason) = &reported.lost {
            return Err(GpuError::Lost { reason: reason.clone() });
        }
        match reported.error.take() {
            Some(reason) => Err(GpuError::Device { doing, reason }),
            None => Ok(()),
        }
    }

    /// Runs `make`; what wgpu finds wrong with it, or has no memory for, comes back as a message.
    ///
    /// # Errors
    /// The driver's words.
    pub fn guarded<T>(&self, make: impl FnOnce() -> T) -> Result<T, String> {
        if self.fault_of(&[FaultKind::OutOfMemory, FaultKind::Lost]) == Some(FaultKind::OutOfMemory) {
            return Err("out of memory, as a test wants it".into());
        }
        let scopes =
            [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Internal]
                .map(|filter| self.device.push_error_scope(filter));
        let made = make();
        // Scopes are a stack: the last one pushed goes first.
        let errors: Vec<_> = scopes.into_iter().rev().filter_map(|s| pollster::block_on(s.pop())).collect();
        let Some(error) = errors.first() else { return Ok(made) };
        // Whatever fails on a device that is gone fails for that reason.
        self.hear_of_loss();
        match &self.reports.lock().lost {
            Some(reason) => Err(format!("the device was lost: {reason}")),
            None => Err(error_text(error)),
        }
    }

    /// Lets a device that is lost say so, which it does once its last work has ended.
    fn hear_of_loss(&self) {
        let timeout = Some(Duration::from_secs(5));
        let _ = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout });
    }

    /// Takes a step at which a test may want one of these faults. A device that it wants lost is lost then.
    fn fault_of(&self, kinds: &[FaultKind]) -> Option<FaultKind> {
        let kind = self.fault.as_ref()?.step(kinds)?;
        if kind == FaultKind::Lost {
            self.device.destroy();
        }
        Some(kind)
    }

    /// Waits until everything submitted so far is done.
    ///
    /// # Errors
    /// When the device is lost or has reported an error.
    pub fn wait(&self, doing: &'static str) -> Result<(), GpuError> {
        self.wait_for(None, doing)
    }

    /// Waits until a submission is done.
    ///
    /// # Errors
    /// As [`Gpu::wait`]; also when nothing happens for a minute.
    pub fn wait_for(
        &self,
        submission: Option<wgpu::SubmissionIndex>,
        doing: &'static str,
    ) -> Result<(), GpuError> {
        if self.fault_of(&[FaultKind::Timeout, FaultKind::Lost]) == Some(FaultKind::Timeout) {
            return Err(GpuError::Device { doing, reason: "no answer in time, as a test wants it".into() });
        }
        self.check(doing)?;
        // Longer than any dispatch takes: who waits forever for a hung driver cannot fall back. Programs that play GPU
        // compile a shader when it is first used, which may take minutes on a busy machine.
        let timeout = Some(Duration::from_secs(if self.is_software() { 600 } else { 120 }));
        let waited = self.device.poll(wgpu::PollType::Wait { submission_index: submission, timeout });
        self.check(doing)?;
        let Err(error) = waited else { return Ok(()) };
        self.hear_of_loss();
        self.check(doing)?;
        Err(GpuError::Device { doing, reason: error.to_string() })
    }
}

fn pick<'a>(adapters: &'a [wgpu::Adapter], options: &GpuOptions) -> Result<&'a wgpu::Adapter, GpuError> {
    let names = || adapters.iter().map(|a| a.get_info().name).collect::<Vec<_>>().join(", ");
    if let Some(wanted) = &options.adapter {
        let matches = |a: &&wgpu::Adapter| a.get_info().name.to_lowercase().contains(&wanted.to_lowercase());
        return adapters.iter().filter(matches).nth(options.ordinal).ok_or_else(|| {
            GpuError::UnknownAdapter {
                name: wanted.clone(),
                known: if adapters.is_empty() { "none".into() } else { names() },
            }
        });
    }
    let will_do = |a: &&wgpu::Adapter| options.allow_software || a.get_info().device_type != DeviceType::Cpu;
    adapters.iter().filter(will_do).nth(options.ordinal).ok_or_else(|| GpuError::NoAdapter {
        found: if adapters.is_empty() {
            "no driver offers an adapter".into()
        } else {
            format!("only software drivers ({})", names())
        },
    })
}

fn capped(limits: Limits, caps: LimitCaps) -> Limits {
    Limits {
        max_storage_buffer_binding_size: limits
            .max_storage_buffer_binding_size
            .min(caps.storage_binding_bytes & !3),
        max_texture_dimension_2d: limits.max_texture_dimension_2d.min(caps.texture_side),
        max_storage_buffers_per_shader_stage: limits
            .max_storage_buffers_per_shader_stage
            .min(caps.storage_buffers),
        ..limits
    }
}

/// An error with all its causes, which say what the outermost message does not.
fn error_text(error: &wgpu::Error) -> String {
    let mut text = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            text = format!("{text}: {cause_text}");
        }
        source = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::open_for_test;
    use crate::tracer::TracerKind;

    #[test]
    fn masked_features_are_missed_by_name() {
        let features = Features::all() - Features::EXPERIMENTAL_RAY_QUERY;
        let options = GpuOptions { features, ..GpuOptions::default() };
        let Some(gpu) = open_for_test("masked_features_are_missed_by_name", &options) else { return };
        let error = TracerKind::Query.check(&gpu).expect_err("masked");
        assert!(
            error.to_string().contains("RAY_QUERY") && error.to_string().contains("gpu-query"),
            "{error}"
        );
        TracerKind::Bvh.check(&gpu).expect("needs nothing");
    }

    #[test]
    fn unknown_adapters_and_low_limits_are_named() {
        if open_for_test("unknown_adapters_and_low_limits_are_named", &GpuOptions::default()).is_none() {
            return;
        }
        let options = GpuOptions { adapter: Some("no such chip".into()), ..GpuOptions::default() };
        let error = Gpu::open(&options).err().expect("no such chip");
        assert!(error.to_string().contains("`no such chip`"), "{error}");
        let caps = LimitCaps { storage_buffers: 4, ..LimitCaps::default() };
        let error =
            Gpu::open(&GpuOptions { limits: Some(caps), ..GpuOptions::default() }).err().expect("too low");
        assert!(matches!(error, GpuError::Limit { offered: 4, .. }), "{error}");
    }

    #[test]
    fn a_destroyed_device_is_an_error_and_no_panic() {
        let Some(gpu) = open_for_test("a_destroyed_device_is_an_error_and_no_panic", &GpuOptions::default())
        else {
            return;
        };
        gpu.wait("testing").expect("alive");
        gpu.device.destroy();
        let error = gpu.wait("testing").and_then(|()| gpu.wait("testing")).expect_err("destroyed");
        assert!(matches!(error, GpuError::Lost { .. }), "{error}");
    }
}
