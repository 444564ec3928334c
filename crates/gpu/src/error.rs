//! What can go wrong on a GPU.

/// Why a GPU could not do what it was asked for.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter is there, or none that does.
    #[error("there is no usable GPU: {found}")]
    NoAdapter {
        /// What was looked at, and why it did not do.
        found: String,
    },
    /// No adapter has the name that the user gave.
    #[error("there is no adapter called `{name}`; there are: {known}")]
    UnknownAdapter {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// The adapter lacks a feature.
    #[error("{adapter} lacks what {tracer} needs: {missing}")]
    Unsupported {
        /// Name of the adapter.
        adapter: String,
        /// Name of the tracer.
        tracer: &'static str,
        /// Missing features, in words.
        missing: String,
    },
    /// A limit of the adapter is too low.
    #[error("{adapter} offers {offered} {limit}, but {needed} are needed")]
    Limit {
        /// Name of the adapter.
        adapter: String,
        /// Which limit, in words.
        limit: &'static str,
        /// What is needed.
        needed: u64,
        /// What there is.
        offered: u64,
    },
    /// The scene has something that no GPU back end renders so.
    #[error("GPU back ends do not render {what}; {instead} does")]
    Scene {
        /// What it has.
        what: &'static str,
        /// Who renders it.
        instead: &'static str,
    },
    /// The driver would not open the device.
    #[error("cannot open {adapter}: {reason}")]
    Open {
        /// Name of the adapter.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// Nothing can be shown on the window.
    #[error("cannot draw on the window: {reason}")]
    Screen {
        /// What the driver said, or what is missing.
        reason: String,
    },
    /// The window cannot show frames as it was asked to.
    #[error("the window has no present mode `{wanted}`; it has {offered}")]
    PresentMode {
        /// What was asked for.
        wanted: String,
        /// What there is.
        offered: String,
    },
    /// An array of the scene is larger than a shader can see.
    #[error("{object} take {bytes} bytes, but a buffer of this device can have {limit}")]
    BufferTooLarge {
        /// What is stored.
        object: &'static str,
        /// Its size.
        bytes: u64,
        /// The largest possible.
        limit: u64,
    },
    /// A picture of the scene is larger than the device's textures.
    #[error("{object} has {width}×{height} pixels, but a texture of this device can have {limit} a side")]
    TextureTooLarge {
        /// What it is.
        object: &'static str,
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
        /// The longest possible side.
        limit: u32,
    },
    /// Device memory is used up, or the driver refused a resource.
    #[error("cannot allocate {bytes} bytes for {object}: {reason}")]
    Allocation {
        /// What was to be stored.
        object: &'static str,
        /// Its size.
        bytes: u64,
        /// What the driver said.
        reason: String,
    },
    /// The modules of a shader do not fit together.
    #[error("cannot link a shader: {0}")]
    Modules(#[from] crate::shader::ModuleError),
    /// A shader or pipeline was refused.
    #[error("the driver refused the shader `{shader}`: {reason}")]
    Shader {
        /// Which shader.
        shader: String,
        /// What the compiler said.
        reason: String,
    },
    /// The device is gone: driver reset, unplugged, or destroyed.
    #[error("the device was lost: {reason}")]
    Lost {
        /// What the driver said.
        reason: String,
    },
    /// Anything else that the device reported.
    #[error("the device failed while {doing}: {reason}")]
    Device {
        /// What was being done.
        doing: &'static str,
        /// What the driver said.
        reason: String,
    },
}
