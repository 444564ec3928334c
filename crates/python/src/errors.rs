//! Errors as Python exceptions, with everything that led to them.

use alhazen::{BackendError as RenderError, ChoiceError, LoadError as SceneLoadError};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use std::error::Error as StdError;

create_exception!(
    alhazen,
    Error,
    PyException,
    "What went wrong in Alhazen; the base of its other exceptions."
);
create_exception!(
    alhazen,
    LoadError,
    Error,
    "A scene could not be loaded. The text names file, object and value."
);
create_exception!(alhazen, BackendError, Error, "A back end is not there, cannot hold the scene, or failed.");

create_exception!(
    alhazen,
    PartError,
    Error,
    "Parts of a picture are damaged, incomplete, or do not belong together."
);

/// The text of an error and of all its causes.
pub fn chain(error: &dyn StdError) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text += &format!(": {error}");
        cause = error.source();
    }
    text
}

/// A scene that could not be loaded.
pub fn load_error(error: SceneLoadError) -> PyErr {
    LoadError::new_err(chain(&error))
}

/// What a back end could not do.
pub fn render_error(error: RenderError) -> PyErr {
    match error {
        // The view is what the caller asked for.
        RenderError::View { .. } | RenderError::Film(_) => PyValueError::new_err(chain(&error)),
        _ => BackendError::new_err(chain(&error)),
    }
}

/// A back end that is not there.
pub fn choice_error(error: ChoiceError) -> PyErr {
    BackendError::new_err(chain(&error))
}

/// An argument that does not do.
pub fn bad(text: impl Into<String>) -> PyErr {
    PyValueError::new_err(text.into())
}
