//! What becomes of caustics that the renderer is to decide on.

use crate::{Job, Renderer};
use backend::{Integrator, Switch};
use scene::tables::CausticsAdvice;

impl Renderer {
    /// Turns [`Switch::Auto`] of a job into what the scene and the back end make of it, so that parts of a picture and
    /// its files say what was rendered. Returns what was chosen and why; `None` if there was nothing to choose.
    pub fn settle_caustics(&self, job: &mut Job) -> Option<String> {
        let Integrator::Path(path) = &mut job.integrator else { return None };
        if path.caustics != Switch::Auto {
            return None;
        }
        let CausticsAdvice { wanted, reason } = self.tables()?.caustics_advice();
        let able = self.backend_name() == "cpu";
        path.caustics = if wanted && able { Switch::On } else { Switch::Off };
        let reason = if wanted && !able {
            format!("{reason}, but only the back end `cpu` has photons")
        } else {
            reason
        };
        Some(format!("caustics: {} ({reason})", path.caustics))
    }
}
