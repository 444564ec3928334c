//! Single samples of `path`, made again by themselves with everything that happens at their vertices.
//!
//! A replayed sample is the film's sample, bit for bit: it draws the same numbers and asks the optics the same questions, and
//! adds what it finds in the same order. It takes one path at a time, where `integrate::path` takes many.

mod describe;
mod follow;
mod record;

pub use record::{
    FoundLight, LightSampleRecord, LightVisibility, PathEnd, PathRecord, SampleRecord, ScatteringRecord,
    SurfaceRecord, VertexPlace, VertexRecord,
};

use crate::batch::samples::SampleId;
use crate::queries::RayQueries;
use backend::{BackendError, Integrator, Switch, View};
use follow::Follower;

impl RayQueries {
    /// Makes a sample of a pixel of `path` again.
    ///
    /// - `view`: the picture; its window and its first sample do not matter. Its integrator must be `path`.
    /// - `pixel`: column and row in the whole picture, from the upper left. `sample`: index of the sample.
    ///
    /// # Errors When the pixel is not in the picture, the integrator is another one, or there is
    /// something between the surfaces of the scene (fog, grids, nested bodies): paths through media
    /// are not recorded. When anything moves while the shutter is open: records are of an instant.
    pub fn replay(&self, view: &View, pixel: [u32; 2], sample: u32) -> Result<SampleRecord, BackendError> {
        let refuse = |reason| Err(BackendError::View { reason });
        let [x, y] = pixel;
        if x >= view.width || y >= view.height {
            return refuse(format!("no pixel {x},{y} in a picture of {}×{}", view.width, view.height));
        }
        let Integrator::Path(settings) = &view.integrator else {
            return refuse(format!(
                "only samples of `path` can be replayed, not of `{}`",
                view.integrator.name()
            ));
        };
        if settings.guiding != Switch::Off {
            return refuse("guided paths cannot be replayed; without guiding they can".into());
        }
        if self.scene().volumes {
            return refuse("paths through media and nested bodies cannot be replayed".into());
        }
        if view.shutter.is_some() && (view.camera_moves() || self.scene().tables.motion.is_some()) {
            return refuse("what moves while the shutter is open cannot be replayed".into());
        }
        Ok(Follower::new(self, view, settings).sample(&SampleId { x, y, index: sample }))
    }
}
