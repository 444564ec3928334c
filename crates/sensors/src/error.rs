//! Why a sensor could not measure or a file could not be written.

use std::path::PathBuf;

/// Why a sensor could not measure or a file could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SensorError {
    /// A setting is impossible.
    #[error("{name}: {value} {problem}")]
    Setting {
        /// Which.
        name: &'static str,
        /// Its value.
        value: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A file could not be read.
    #[error("cannot read {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{path}: {reason}")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// No writer knows the file name's ending.
    #[error("{path}: unknown point cloud format; known are .ply and .npz")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A folder could not be made.
    #[error("cannot make the folder {path}")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("cannot write a file")]
    Write(#[from] alhazen::ImageError),
    /// A picture could not be written.
    #[error("cannot write a picture")]
    Output(#[from] alhazen::output::OutputError),
    /// A camera of a list of poses is none.
    #[error("pose {pose}")]
    Camera {
        /// Its number in the list.
        pose: usize,
        /// What is wrong with it.
        source: alhazen::CalibrationError,
    },
    /// The renderer failed.
    #[error("cannot render")]
    Render(#[from] alhazen::BackendError),
    /// The work was cancelled.
    #[error("cancelled")]
    Cancelled,
}

impl SensorError {
    pub(crate) fn setting(name: &'static str, value: impl ToString, problem: &'static str) -> Self {
        Self::Setting { name, value: value.to_string(), problem }
    }
}
