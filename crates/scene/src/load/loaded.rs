//! What a loader returns.

use crate::report::LoadReport;
use crate::scene::Scene;

/// A scene and what was noticed while loading it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What was ignored, repaired or approximated.
    pub report: LoadReport,
}
