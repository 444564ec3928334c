//! What this machine can run, and what is built in.

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Back ends on this machine.
///
/// Returns
/// -------
/// list of dict
///     For each back end: ``name`` (as `Scene.render` takes it), ``available``, ``chosen`` (whether it renders when nothing
///     else is asked for), ``device`` and ``reason``.
#[pyfunction]
pub fn backends(py: Python) -> PyResult<Vec<Bound<PyDict>>> {
    let all = py.detach(alhazen::system::backends);
    let describe = |b: alhazen::system::BackendStatus| {
        let entry = PyDict::new(py);
        entry.set_item("name", b.name)?;
        entry.set_item("available", b.available)?;
        entry.set_item("chosen", b.chosen)?;
        entry.set_item("device", b.device)?;
        entry.set_item("reason", b.reason)?;
        Ok(entry)
    };
    all.into_iter().map(describe).collect()
}

/// Names of the built-in scenes, which `load` takes in place of a path.
///
/// Returns
/// -------
/// list of str
#[pyfunction]
pub fn scenes() -> Vec<&'static str> {
    alhazen::builtin::list().into_iter().map(|b| b.name).collect()
}
