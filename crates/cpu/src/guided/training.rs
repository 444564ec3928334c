//! Learning a guide before a picture.
//!
//! Paths of a small version of the whole picture learn what light arrives where, in a few runs of twice as many paths each; every
//! run follows what the one before has learned. Then the guide is frozen. It depends on nothing but scene, camera, settings and
//! seed: not on the part of the picture that is rendered, on threads, or on how samples are divided. So every sample of the picture
//! is a pure function of pixel, index and seed, and its expected value that without a guide.

use crate::scene::CpuScene;
use crate::schedule::passes;
use backend::{Control, Integrator, PathSettings, Switch, View};
use film::{Film, FilmError, Rect};
use guiding::{Guide, Learner};
use optics::math::luminance;
use optics::random::hash_combine;
use optics::vec3f;
use std::ops::Range;
use std::sync::Arc;

/// Samples of each pixel in all runs but the last of them, and in that: the first says how bright the picture is.
const RUNS: [u32; 5] = [1, 2, 4, 8, 16];
/// Pixels of the small picture: this share of those of the picture, one in so many.
const SHARE: u32 = 4;
/// Least and most columns and rows of the small picture.
const SIDES: [u32; 2] = [16, 256];
/// With [`Switch::Auto`], a guide is followed if not more than this share of the second moment of what paths find is left.
const MOST_LEFT: f64 = 0.7;
/// Changes the random numbers: nothing that was learned from is in the picture.
const SEED: u32 = 0x6775_6964;

/// A guide, and what it took.
pub(crate) struct Trained {
    /// The guide, if the picture's paths are to follow it.
    pub guide: Option<Arc<Guide>>,
    /// Rays traced.
    pub rays: u64,
    /// What was decided and why, for users.
    pub verdict: String,
}

/// The small picture of `view` whose paths are learned from. Views that train the same guide have the same one.
pub(crate) fn training_view(view: &View) -> Option<View> {
    let Integrator::Path(settings) = view.integrator else { return None };
    let settings = PathSettings { splitting: 1, clamp_indirect: None, ..settings };
    let pixels = u64::from(view.width) * u64::from(view.height) / u64::from(SHARE);
    let side = (pixels.isqrt().min(u64::from(SIDES[1])) as u32).max(SIDES[0]);
    Some(View {
        width: side,
        height: side,
        window: Rect::full(side, side),
        integrator: Integrator::Path(settings),
        seed: hash_combine(view.seed, SEED),
        first_sample: 0,
        aovs: Vec::new(),
        ..view.clone()
    })
}

/// Learns a guide by the small picture `view`; `None` if it was cancelled. Runs on the threads of the current pool.
///
/// # Errors
/// When there is no memory for the small picture.
pub(crate) fn train(
    scene: &mut CpuScene,
    view: &View,
    control: &Control,
) -> Result<Option<Trained>, FilmError> {
    let area = view.window.area() as u64;
    let samples = area * u64::from(RUNS.iter().sum::<u32>());
    control.begin(samples);
    let bounds = scene.tlas.bounds();
    let mut guide = Arc::new(Guide::unlearned([bounds.min, bounds.max]));
    let auto = matches!(view.integrator, Integrator::Path(PathSettings { guiding: Switch::Auto, .. }));
    let (mut rays, mut first, mut level, mut left) = (0, 0, 0.0, 1.0);
    for (run, count) in RUNS.into_iter().enumerate() {
        let learner = (run > 0).then(|| Arc::new(Learner::new(guide.clone(), level)));
        let mut film = Film::with_window(view.width, view.height, view.window, &[])?;
        rays += follow(scene, view, &guide, learner.clone(), first..first + count, &mut film, control);
        if control.is_cancelled() {
            return Ok(None);
        }
        first += count;
        match learner {
            None => level = mean_luminance(&film),
            Some(learner) => {
                left = learner.moment_left();
                // Half of the paths are in the last run: what will not be followed is not learned to the end.
                if auto && run > 1 && left > MOST_LEFT {
                    let verdict =
                        format!("path guiding: off, {:.0} % of the noise would be left", 100.0 * left);
                    return Ok(Some(Trained { guide: None, rays, verdict }));
                }
                let last = run + 1 == RUNS.len();
                guide = Arc::new(learner.refine(most_finds(count), last));
            }
        }
    }
    let verdict = format!(
        "path guiding: on, {samples} paths have learned at {} places ({} KiB), {:.0} % of the noise is left",
        guide.leaves(),
        guide.memory_bytes() >> 10,
        100.0 * left
    );
    Ok(Some(Trained { guide: Some(guide), rays, verdict }))
}

/// Finds of a leaf of the tree over space above which it is divided, after a run of `count` samples a pixel: with twice as many
/// paths there are √2 times as many leaves with √2 times as many finds each (Müller 2017, section 3.1).
fn most_finds(count: u32) -> u32 {
    (1000 * count).isqrt() * 16
}

/// One run; returns the number of rays.
fn follow(
    scene: &mut CpuScene,
    view: &View,
    guide: &Arc<Guide>,
    learner: Option<Arc<Learner>>,
    samples: Range<u32>,
    film: &mut Film,
    control: &Control,
) -> u64 {
    scene.guide = learner.is_some().then(|| guide.clone());
    scene.learner = learner;
    let rays = passes::render(scene, view, samples, film, None, control);
    (scene.guide, scene.learner) = (None, None);
    rays
}

/// The picture's level.
fn mean_luminance(film: &Film) -> f32 {
    let pixels = film.pixels();
    let level = |mean: [f64; 3]| {
        let [x, y, z] = mean.map(|c| c as f32);
        f64::from(luminance(vec3f(x, y, z)))
    };
    let sum: f64 = pixels.iter().map(|pixel| level(pixel.mean())).sum();
    (sum / pixels.len().max(1) as f64) as f32
}
