//! The guide of the view that is being rendered: learned once, kept until scene or view is another one.

use crate::guided::training::{Trained, train, training_view};
use crate::scene::CpuScene;
use crate::schedule::photon_passes;
use backend::{BackendError, Control, Integrator, Switch, View};
use guiding::Guide;
use std::sync::Arc;

/// What was learned last.
#[derive(Default)]
pub(crate) struct Guides {
    /// The small picture that it was learned by, and whether the guide was to be followed whatever it is worth.
    learned: Option<(View, Option<Arc<Guide>>)>,
    notices: Vec<String>,
}

impl Guides {
    /// Forgets what was learned: the scene is another one.
    pub fn forget(&mut self) {
        self.learned = None;
    }

    /// What users should hear, once.
    pub fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    /// Gives the scene the guide that paths of `view` are to follow, or none; learns it if need be. Returns the rays that this has
    /// taken; `None` if it was cancelled. Runs on the threads of the current pool.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub fn prepare(
        &mut self,
        scene: &mut CpuScene,
        view: &View,
        control: &Control,
    ) -> Result<Option<u64>, BackendError> {
        scene.guide = None;
        let Integrator::Path(settings) = view.integrator else { return Ok(Some(0)) };
        let Some(small) = training_view(view) else { return Ok(Some(0)) };
        if settings.guiding == Switch::Off {
            return Ok(Some(0));
        }
        if let Some((learned, guide)) = &self.learned
            && *learned == small
        {
            scene.guide.clone_from(guide);
            return Ok(Some(0));
        }
        let unguided = if scene.volumes {
            Some("through media and nested bodies")
        } else {
            photon_passes::wanted(scene, view).map(|_| "that gather photons")
        };
        if let Some(which) = unguided {
            self.notices.push(format!("path guiding: paths {which} are not guided"));
            self.learned = Some((small, None));
            return Ok(Some(0));
        }
        let Some(Trained { guide, rays, verdict }) = train(scene, &small, control)? else { return Ok(None) };
        self.notices.push(verdict);
        scene.guide.clone_from(&guide);
        self.learned = Some((small, guide));
        Ok(Some(rays))
    }
}
