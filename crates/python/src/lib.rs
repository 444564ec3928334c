//! The Python package `alhazen`: scenes from NumPy arrays or files, pictures and ray hits as NumPy arrays.
//!
//! This crate is the compiled module `alhazen._alhazen`; what is easier said in Python stands in `python/alhazen`. Long work
//! runs without the interpreter's lock and can be interrupted ([`watch`]). Nothing here knows how light is transported: it
//! calls the facade.

// A test program would need libpython to link. `cargo test NAME` makes one, whatever the manifest says: it shall be empty.
#![cfg(not(test))]

mod arrays;
mod camera;
mod denoise;
mod errors;
mod light;
mod material;
mod medium;
mod part;
mod protect;
mod queries;
mod render;
mod scene;
mod sensors;
mod system;
mod texture_graph;
mod views;
mod watch;

use pyo3::prelude::*;

#[global_allocator]
static ALLOCATOR: alhazen::HugePages = alhazen::HugePages;

/// The compiled part of the package `alhazen`.
#[pymodule]
mod _alhazen {
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::denoise::{SequenceDenoiser, denoise};
    #[pymodule_export]
    use super::errors::{BackendError, Error, LoadError, PartError};
    #[pymodule_export]
    use super::medium::Medium;
    #[pymodule_export]
    use super::part::{Part, merge};
    #[pymodule_export]
    use super::queries::Hits;
    #[pymodule_export]
    use super::render::{encode_png, write_file, write_picture};
    #[pymodule_export]
    use super::scene::{Scene, load};
    #[pymodule_export]
    use super::sensors::{Lidar, PointCloud, level_pose};
    #[pymodule_export]
    use super::system::{backends, scenes};

    /// Adds what is no class or function.
    #[pymodule_init]
    fn init(module: &super::Bound<'_, super::PyModule>) -> super::PyResult<()> {
        use super::PyModuleMethods;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
