//! What scenes were loaded from is not written over, as the command line has it.

use crate::errors::chain;
use alhazen::{FilesRead, ImageError, ProtectedFiles};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Inputs of all scenes that this process has loaded.
static INPUTS: Mutex<Option<ProtectedFiles>> = Mutex::new(None);

/// Protects what was read.
pub fn remember(read: &FilesRead) {
    let mut inputs = INPUTS.lock().unwrap_or_else(PoisonError::into_inner);
    inputs.get_or_insert_default().extend(read.list());
}

/// Whether a file may be written.
pub fn check(path: &Path) -> PyResult<()> {
    let inputs = INPUTS.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(inputs) = inputs.as_ref() else { return Ok(()) };
    inputs.check(path).map_err(|_| {
        PyOSError::new_err(format!(
            "cannot write {}: a scene was loaded from it, and it would be lost",
            path.display()
        ))
    })
}

/// Python's exception for a file that could not be written.
pub fn write_error(error: ImageError) -> PyErr {
    match error {
        // As Python's own `open` raises it: FileNotFoundError, PermissionError and so on.
        ImageError::Write { source, .. } => source.into(),
        other => PyOSError::new_err(chain(&other)),
    }
}
