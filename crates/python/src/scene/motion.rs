//! What moves, and the shutter that sees it.

use super::Scene;
use crate::arrays::matrices;
use crate::errors::bad;
use alhazen::{Animation, Keyed, KeyedObject, Rolling, Shutter, ShutterShape};
use glam::{Affine3A, DAffine3, DMat4};
use pyo3::prelude::*;

#[pymethods]
impl Scene {
    /// Lets an instance move through transforms; see `open_shutter` and `set_time`.
    ///
    /// Between two moments, translation, rotation and stretch are interpolated apart: what turns
    /// goes along an arc about the origin of its mesh. Before the first and after the last moment
    /// it stands still.
    ///
    /// Parameters
    /// ----------
    /// instance : int
    /// times : sequence of float
    ///     Moments, seconds, increasing.
    /// transforms : array_like, shape (n, 4, 4)
    ///     From the mesh to the world at each of them.
    fn set_motion(
        &self,
        py: Python,
        instance: u32,
        times: Vec<f32>,
        transforms: &Bound<PyAny>,
    ) -> PyResult<()> {
        let affine = |rows: &[[f64; 4]; 4]| -> Affine3A {
            DAffine3::from_mat4(DMat4::from_cols_array_2d(rows).transpose()).as_affine3a()
        };
        let transforms: Vec<_> = matrices("transforms", transforms)?.iter().map(affine).collect();
        let keyed = Keyed::new(KeyedObject::Instance(instance), times, transforms);
        let keyed = keyed.map_err(|error| bad(format!("set_motion: {error}")))?;
        self.change(py, |scene| {
            let count = scene.instances.len();
            if instance as usize >= count {
                return Err(bad(format!("instance: the scene has only {count}")));
            }
            for animation in &mut scene.animations {
                animation.keyed.retain(|other| other.object != keyed.object);
            }
            scene.animations.push(Animation { keyed: vec![keyed], ..Animation::default() });
            Ok(())
        })
    }

    /// Brings everything that moves to where it is at a moment, and closes the shutter: pictures
    /// show an instant.
    ///
    /// Parameters
    /// ----------
    /// time : float
    ///     Seconds.
    fn set_time(&self, py: Python, time: f32) -> PyResult<()> {
        finite(time)?;
        self.change(py, |scene| {
            scene.set_time(time);
            scene.defaults.shutter = None;
            Ok(())
        })
    }

    /// Opens the shutter: pictures that are rendered from now on are blurred by what moves
    /// meanwhile. What is changed afterwards counts when this is called again.
    ///
    /// Parameters ---------- open, close : float When the shutter opens and closes, in seconds
    /// around `time`. time : float, default 0 The moment of the picture, seconds. Cameras that
    /// orbit take it from `render`. shape : str, default "box" How it opens and closes: "box",
    /// "triangle", or "trapezoid:RISE,FALL" with shares of the time. rolling : str, optional
    /// "rows:SECONDS" or "columns:SECONDS": the last line of pixels is exposed later than the first
    /// by so much.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     What changes meanwhile but is shown as it is in the middle.
    #[pyo3(signature = (open, close, *, time=0.0, shape="box".into(), rolling=None))]
    fn open_shutter(
        &self,
        py: Python,
        open: f32,
        close: f32,
        time: f32,
        shape: String,
        rolling: Option<String>,
    ) -> PyResult<Vec<String>> {
        finite(time)?;
        let mut shutter = Shutter::new(open, close).map_err(|error| bad(error.to_string()))?;
        shutter.shape = shape.parse::<ShutterShape>().map_err(|error| bad(format!("shape: {error}")))?;
        let rolling = rolling.map(|text| text.parse::<Rolling>()).transpose();
        shutter.rolling = rolling.map_err(|error| bad(format!("rolling: {error}")))?;
        self.change(py, |scene| {
            scene.open_shutter(time, &shutter);
            scene.defaults.shutter = Some(shutter);
            Ok(scene.motion.as_ref().map_or(Vec::new(), |motion| motion.held.clone()))
        })
    }
}

fn finite(time: f32) -> PyResult<()> {
    if time.is_finite() { Ok(()) } else { Err(bad(format!("time: {time} is not a moment"))) }
}
