//! The narrow waist between front ends and what renders: one trait, and the plain data that goes
//! through it.
//!
//! A back end turns [`scene::tables::SceneTables`] and a [`View`] into samples on a [`film::Film`].
//! Front ends know only this, so a new back end needs no change to its callers.

#![forbid(unsafe_code)]

mod control;
mod mis;
mod realtime;
mod view;
mod views;

pub use ::scene::Switch;
pub use control::{Control, Progress};
pub use mis::Mis;
pub use realtime::{
    AllocationSettings, BadFrameSamples, FrameSamples, FrameView, HistorySettings, RealtimeSettings,
    SpatialFilter, UnknownFrameView, UnknownSpatialFilter,
};
pub use view::{
    AmbientOcclusion, DirectSettings, Highlights, HybridSettings, INVERSE_SQUARE, Integrator, PathSettings,
    PixelSamples, SamplerKind, View, ViewShutter, Visibility,
};
pub use views::{ViewBatch, ViewLayer, ViewPictures, ViewValues};

use film::{Film, Image};
use post::NetworkInput;
use scene::tables::{Changes, SceneTables};
use std::sync::Arc;
use std::time::Duration;

/// Why a back end could not do what it was asked for.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// [`Backend::render`] before [`Backend::load`].
    #[error("no scene has been loaded into the {backend} back end")]
    NoScene {
        /// Name of the back end.
        backend: &'static str,
    },
    /// The view cannot be rendered.
    #[error("the view cannot be rendered: {reason}")]
    View {
        /// What is wrong with it.
        reason: String,
    },
    /// The device failed. What was moved to the film before is kept.
    #[error("the {backend} back end failed")]
    Device {
        /// Name of the back end.
        backend: &'static str,
        /// What the device said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The film could not be made.
    #[error("cannot make the film")]
    Film(#[from] film::FilmError),
}

/// What a call of [`Backend::render`] did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stats {
    /// Samples of all pixels together.
    pub samples: u64,
    /// Rays traced: closest-hit and any-hit.
    pub rays: u64,
    /// Wall time.
    pub elapsed: Duration,
    /// Whether the call ended early because it was cancelled.
    pub cancelled: bool,
    /// Time that the device itself was busy, where it has a clock.
    pub device_time: Option<Duration>,
}

/// For back ends: whether all of `pixels` lie in the view's window and have sample indices that
/// exist.
///
/// # Errors
/// [`BackendError::View`] that names the first that does not.
pub fn check_pixels(view: &View, pixels: &[PixelSamples]) -> Result<(), BackendError> {
    let area = view.window.area() as u64;
    for p in pixels {
        let reason = if u64::from(p.pixel) >= area {
            format!("pixel {} is not among the window's {area}", p.pixel)
        } else if p.first.checked_add(p.count).is_none() {
            format!("sample index beyond {} in pixel {}", u32::MAX, p.pixel)
        } else {
            continue;
        };
        return Err(BackendError::View { reason });
    }
    Ok(())
}

/// For back ends that have neither photons nor guides: refuses views that ask for one of them. [`Switch::Auto`] is off
/// there.
///
/// # Errors
/// [`BackendError::View`] that names the back end that has them.
pub fn check_switches(view: &View) -> Result<(), BackendError> {
    let Integrator::Path(path) = view.integrator else { return Ok(()) };
    let asked = match (path.caustics, path.guiding) {
        (Switch::On, _) => "caustics by photons are asked for",
        (_, Switch::On) => "path guiding is asked for",
        _ => return Ok(()),
    };
    Err(BackendError::View { reason: format!("{asked}, which only the back end `cpu` has") })
}

/// For back ends: refuses a scene with media or overlapping bodies where the view's integrator does
/// not follow light through them.
///
/// # Errors
/// [`BackendError::View`] that names the integrator and the one to take instead.
pub fn check_media(scene: &SceneTables, view: &View) -> Result<(), BackendError> {
    let name = view.integrator.name();
    let reason = match view.integrator {
        // The first hit is behind all media.
        Integrator::Path(_) | Integrator::Aov => return Ok(()),
        _ if scene.has_media() => {
            format!("the scene has media, which `{name}` knows nothing of; `path` does")
        }
        _ if scene.nested => format!("bodies have priorities, which `{name}` knows nothing of; `path` does"),
        _ => return Ok(()),
    };
    Err(BackendError::View { reason })
}

/// What [`Backend::render_rounds`] is to do: rounds of adaptive sampling, one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdaptiveRounds {
    /// Samples of all pixels together when a round is over, about: of each round, in order. Without
    /// any, nothing is done.
    pub totals: Vec<u64>,
    /// Samples that every pixel has to have before anything can be decided.
    pub least: u32,
    /// What is added to the squared radiance that errors are relative to; `None` follows the
    /// picture's level. See [`film::Allocation::new`].
    pub floor: Option<f64>,
}

/// One pass of a device, by its own clock.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// What it did.
    pub name: &'static str,
    /// When it began, since the first pass of the back end.
    pub start: Duration,
    /// How long it took.
    pub duration: Duration,
}

/// What [`Backend::load`] made of the scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadStats {
    /// Wall time of building acceleration structures.
    pub build: Duration,
    /// Bytes of acceleration structures.
    pub acceleration_bytes: usize,
    /// Bytes of scene tables.
    pub table_bytes: usize,
    /// Bytes on a device of its own, as far as they are known; 0 for back ends without one.
    pub device_bytes: u64,
}

/// Turns scene tables into samples on a film.
pub trait Backend: Send {
    /// What the user calls it, such as `cpu`.
    fn name(&self) -> &'static str;

    /// What it runs on, for people: instruction set and threads, or the adapter.
    fn describe(&self) -> String;

    /// Replaces the scene. The film restarts at zero samples with the next [`Backend::render`].
    ///
    /// # Errors
    /// When the device cannot hold the scene.
    fn load(&mut self, scene: Arc<SceneTables>) -> Result<LoadStats, BackendError>;

    /// Takes a new version of the loaded scene in which nothing but `changes` is different, without
    /// building or moving what is still the same. The film restarts with the next
    /// [`Backend::render`].
    ///
    /// # Errors
    /// Without a scene, and when the device fails.
    fn update(&mut self, scene: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, BackendError>;

    /// Adds `samples` samples to every pixel of the view's window. Splitting a call does not change
    /// the result. A view that differs from the last one restarts the film.
    ///
    /// # Errors
    /// Without a scene, for impossible views, and when the device fails; what was rendered before
    /// is kept.
    fn render(&mut self, view: &View, samples: u32, control: &Control) -> Result<Stats, BackendError>;

    /// Adds samples to some pixels of the view's window only, each of which may be named once.
    /// Pixels that are not named cost nothing. The view's own `first_sample` does not count. When
    /// cancelled, any of the pixels may have any of its samples; the film says how many.
    ///
    /// # Errors
    /// As [`Backend::render`]; [`BackendError::View`] for pixels outside the window.
    fn render_pixels(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
    ) -> Result<Stats, BackendError>;

    /// Adds samples to the pixels of the view's picture that need them most, by the rule of
    /// [`film::Allocation`], without anybody reading the film in between: round by round, fewer
    /// than asked for if there is nothing left to do or it is cancelled. `None` where the back end
    /// cannot decide about the first: then callers read the film and name pixels
    /// ([`Backend::render_pixels`]). The view's `first_sample` is that of the picture.
    ///
    /// # Errors
    /// As [`Backend::render`].
    fn render_rounds(
        &mut self,
        _view: &View,
        _rounds: &AdaptiveRounds,
        _control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        Ok(None)
    }

    /// Makes many pictures of the loaded scene, by as many cameras, in one go: whatever takes time
    /// before the first one takes it once, and is kept for the next call. Colours are, bit for bit,
    /// those of a film of one view if the samples of that are made in one dispatch. The film is
    /// none of its business.
    ///
    /// # Errors
    /// As [`Backend::render`]; [`BackendError::View`] for what [`ViewBatch::check`] refuses, and
    /// where the back end makes no batches.
    fn render_views(
        &mut self,
        _batch: &ViewBatch,
        _control: &Control,
    ) -> Result<(ViewPictures, Stats), BackendError> {
        let reason = format!("the back end `{}` makes no batches of views", self.name());
        Err(BackendError::View { reason })
    }

    /// The relative standard error of the picture so far ([`Film::relative_error`]); where there is
    /// a device, in its precision.
    ///
    /// # Errors
    /// When the device fails.
    fn relative_error(&mut self) -> Result<Option<f64>, BackendError> {
        Ok(self.film()?.and_then(Film::relative_error))
    }

    /// Forgets what was rendered: the next [`Backend::render`] begins a new film, even if its view
    /// is the same.
    fn restart(&mut self);

    /// The film with everything rendered so far, in host memory. This waits for the device. `None`
    /// before the first [`Backend::render`].
    ///
    /// # Errors
    /// When the device fails.
    fn film(&mut self) -> Result<Option<&Film>, BackendError>;

    /// Runs the learned denoiser's network on a picture, as [`post::denoise_with`] wants it, on the
    /// device that renders. `None` where the CPU is to do it ([`post::denoise`]): there is no other
    /// device, or it has failed, of which [`Backend::take_notices`] tells then.
    fn filter_noise(&mut self, _picture: &NetworkInput<'_>) -> Option<Image> {
        None
    }

    /// What users should hear of that is no error, such as that a device was lost and another went
    /// on. Each once.
    fn take_notices(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// How the last [`Backend::render`] was spread over dispatches, `megakernel` or `wavefront`;
    /// `None` where there is nothing to choose.
    fn kernel(&self) -> Option<&'static str> {
        None
    }

    /// The passes since the last call of this, for profiles. Empty where the device has no clock.
    fn take_passes(&mut self) -> Vec<PassTime> {
        Vec::new()
    }
}
