//! What tests of other crates share: statistics of images and samplers, and where the test data is. Never shipped.
//!
//! - [`assert_same_expectation`]: two noisy renders are samples of the same expected image.
//! - [`assert_chi2`]: samples follow the density that they claim.
//! - [`scenes`]: what the reference images show, as [`scene::Scene`] values.
//! - [`require_shared`]: the folder with scenes and reference images, or a visible skip; [`skip_without_gpu`] and
//!   [`skip_without_tool`]: others.
//! - [`random_glb`]: glTF files whose structure is right and whose numbers are random.
//!
//! Invariant: every harness has a test that must fail. A check that cannot fail is worse than none.

#![forbid(unsafe_code)]

mod chi2;
mod choices;
mod compare;
mod data;
#[allow(clippy::disallowed_methods, reason = "statistics, not pictures")]
mod estimate;
mod exclusive;
mod gltf;
mod ignis;
mod random;
pub mod scenes;
#[allow(clippy::disallowed_methods, reason = "statistics, not pictures")]
mod special;

pub use chi2::{Chi2, assert_chi2, chi2_test};
pub use choices::Choices;
pub use compare::{Comparison, Report, WHOLE_IMAGE, WorstBlock, assert_same_expectation};
pub use data::{
    output_dir, repository_root, require_shared, shared_dir, skip_without_gpu, skip_without_tool,
};
pub use estimate::{Estimate, ReferenceError};
pub use exclusive::Exclusive;
pub use gltf::random_glb;
pub use ignis::{IgnisScene, load_ignis};
pub use random::Random;
pub use special::{chi2_p_value, gamma_p, gamma_q, ln_gamma, normal_quantile, sidak};

/// The chance with which a whole test may fail although everything is right: 0.1 %. Seeds are fixed, so this is the
/// chance that a new seed is unlucky.
pub const SIGNIFICANCE: f64 = 1e-3;
