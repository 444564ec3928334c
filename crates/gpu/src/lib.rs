//! The GPU back ends: the same optics, traced three ways.
//!
//! A shader is the optics' text, the scene's bindings (`shaders/scene.wgsl` and the files about surfaces, materials and
//! lights), one tracer and one kernel; [`shader`] puts them together. Bind group 0 is the scene, 1 the tracer's
//! structures, 2 the view and the film, 3 the queues of the path tracer's wavefront, or
//! what the passes of the real-time renderer hand on. Start reading at [`Gpu::open`] and [`GpuScene::upload`].

#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the standard library"))]

mod backend;
mod batch;
mod bindings;
pub mod denoise;
mod device;
mod error;
mod faults;
pub mod film;
pub mod frames;
mod gbuffer;
pub mod hybrid;
pub mod kernel;
#[cfg(test)]
mod layout;
pub mod live;
mod matrix_units;
pub mod megakernel;
mod pass;
#[cfg(not(any(target_vendor = "apple", target_arch = "wasm32")))]
pub mod pipeline;
mod pipeline_store;
mod plan;
mod portions;
pub mod rays;
mod readback;
pub mod realtime;
mod rounds;
pub mod scene;
pub mod screen;
pub mod shader;
pub mod timing;
pub mod tracer;
pub mod view;
pub mod views;
pub mod wavefront;

pub use backend::GpuBackend;
pub use device::{AdapterSummary, Gpu, GpuOptions, LimitCaps, STORAGE_BUFFERS, adapters, has_hardware};
pub use error::GpuError;
pub use faults::{FaultKind, InjectedFault};
pub use kernel::PathKernel;
pub use matrix_units::MatrixUnits;
pub use scene::GpuScene;

/// For tests: a device, or `None` and a visible skip.
#[cfg(test)]
pub(crate) fn open_for_test(test: &str, options: &GpuOptions) -> Option<testkit::Exclusive<Gpu>> {
    let opened = testkit::Exclusive::new(has_hardware(), || Gpu::open(options));
    if let Err(GpuError::NoAdapter { found }) = &*opened {
        testkit::skip_without_gpu(test, found);
        return None;
    }
    Some(opened.map(|gpu| gpu.unwrap_or_else(|error| panic!("{test}: {error}"))))
}
