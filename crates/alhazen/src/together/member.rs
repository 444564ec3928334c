//! One of several back ends that work together.

use super::todo::Todo;
use backend::{Backend, BackendError, Caustics, Control, Integrator, Stats, View};
use std::sync::Arc;
use std::time::Instant;

/// How much slower a processor is thought to be than the fastest device before it is measured: it shall not keep others
/// waiting at the end.
const UNKNOWN_PROCESSOR: f64 = 1.0 / 64.0;

/// A back end, and what it has made of the picture.
pub(super) struct Member {
    pub backend: Box<dyn Backend>,
    /// Samples of pixels a second, by what it did last; `None`: unknown.
    pub rate: Option<f64>,
    /// Whether its shaders are there: what it did first says nothing of its speed.
    pub is_warm: bool,
    /// What its film holds.
    pub made: Todo,
    /// For what it does now.
    pub control: Arc<Control>,
}

/// The part of what is left that devices begin with, all together: enough to be traced in the same way as the rest, and
/// little enough that one which proves slow keeps nobody waiting.
const FIRST: u64 = 8;

/// How much longer than without it all may wait for a member at the end.
const PATIENCE: f64 = 1.5;

/// Why a member stopped.
pub(super) enum Stopped {
    /// There is nothing left that it should do.
    Done,
    /// It is lost; what it held has to be made again.
    Lost(BackendError),
    /// Nobody can do this.
    Refused(BackendError),
}

impl Member {
    pub fn new(backend: Box<dyn Backend>) -> Self {
        Self { backend, rate: None, is_warm: false, made: Todo::default(), control: Arc::default() }
    }

    pub fn is_processor(&self) -> bool {
        self.backend.name() == "cpu"
    }

    /// Makes a piece; it belongs to the member from now on, whether it succeeds or not.
    pub fn make(&mut self, view: &View, piece: Todo) -> Result<Stats, Stopped> {
        let view = &without_photons(view);
        let area = view.window.area() as u64;
        let (amount, start) = (piece.amount(area), Instant::now());
        self.made.append(piece.clone());
        let mut stats = Stats::default();
        for range in &piece.samples {
            let view = View { first_sample: range.start, ..view.clone() };
            let made = self.backend.render(&view, range.len() as u32, &self.control);
            add(&mut stats, &made.map_err(stopped)?);
        }
        if !piece.pixels.is_empty() {
            let made = self.backend.render_pixels(view, &piece.pixels, &self.control);
            add(&mut stats, &made.map_err(stopped)?);
        }
        if self.is_warm || self.is_processor() {
            self.rate = Some(amount as f64 / start.elapsed().as_secs_f64().max(1e-9));
        }
        self.is_warm = true;
        Ok(stats)
    }
}

/// The view with caustics that are left to the renderer switched off: not all members have photons, and all are to make the
/// same picture.
fn without_photons(view: &View) -> View {
    let mut view = view.clone();
    if let Integrator::Path(path) = &mut view.integrator
        && path.caustics == Caustics::Auto
    {
        path.caustics = Caustics::Off;
    }
    view
}

fn stopped(error: BackendError) -> Stopped {
    match error {
        BackendError::Device { .. } => Stopped::Lost(error),
        _ => Stopped::Refused(error),
    }
}

/// Adds up what was done.
pub(super) fn add(sum: &mut Stats, stats: &Stats) {
    sum.samples += stats.samples;
    sum.rays += stats.rays;
    sum.cancelled |= stats.cancelled;
    if let Some(time) = stats.device_time {
        *sum.device_time.get_or_insert_default() += time;
    }
}

/// What a member should take next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Share {
    /// So many samples of pixels.
    Take(u64),
    /// Nothing before the others know how fast they are.
    Wait,
    /// Nothing: the others will be done with all of it before it would be done with the least.
    Leave,
}

/// How much of what is `left` member `me` should take: half of its share by speed, so that all end together.
///
/// - `least`: samples of the smallest piece. `rates`: of all members, with whether they are processors.
pub(super) fn share(left: u64, least: u64, me: usize, rates: &[(Option<f64>, bool)]) -> Share {
    let fastest = rates.iter().filter_map(|(rate, _)| *rate).fold(0.0, f64::max);
    let (mine, is_processor) = rates[me];
    let alone = rates.len() == 1 || rates.iter().all(|(_, is_processor)| *is_processor);
    let Some(rate) = mine.or((is_processor && fastest > 0.0).then_some(fastest * UNKNOWN_PROCESSOR)) else {
        // Devices begin with a part, for which they compile their shaders; processors wait for them.
        let devices = rates.iter().filter(|(_, is_processor)| !is_processor).count() as u64;
        return match (is_processor, alone) {
            (true, false) => Share::Wait,
            (true, true) => Share::Take(least),
            (false, _) => Share::Take(least.max(left / (FIRST * devices))),
        };
    };
    let all: f64 =
        rates.iter().enumerate().map(|(i, (r, _))| if i == me { rate } else { r.unwrap_or(0.0) }).sum();
    let others = all - rate;
    let next =
        rates.iter().enumerate().filter(|(i, _)| *i != me).filter_map(|(_, (r, _))| *r).fold(0.0, f64::max);
    // None of them takes less than the least, so the fastest never leaves.
    let without = (left as f64 / others).max(least as f64 / next);
    if others > 0.0 && least as f64 / rate > PATIENCE * without {
        return Share::Leave;
    }
    Share::Take(((0.5 * left as f64 * rate / all) as u64).max(least))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_shared_by_speed_and_slow_members_leave_the_end_to_others() {
        let (gpu, cpu) = (|rate| (rate, false), |rate| (rate, true));
        // Nothing is known: devices begin with an eighth, a processor waits for them, unless it is alone.
        assert_eq!(share(1000, 10, 0, &[gpu(None), cpu(None)]), Share::Take(125));
        assert_eq!(share(1000, 10, 0, &[gpu(None), gpu(None), cpu(None)]), Share::Take(62));
        assert_eq!(share(40, 10, 0, &[gpu(None), cpu(None)]), Share::Take(10));
        assert_eq!(share(1000, 10, 1, &[gpu(None), cpu(None)]), Share::Wait);
        assert_eq!(share(1000, 10, 0, &[cpu(None)]), Share::Take(10));
        // Three quarters and one of them, half of it at a time.
        let two = [gpu(Some(300.0)), gpu(Some(100.0))];
        assert_eq!(share(800, 10, 0, &two), Share::Take(300));
        assert_eq!(share(800, 10, 1, &two), Share::Take(100));
        // The least takes the second one longer than the first one takes for all that is left.
        assert_eq!(share(10, 10, 1, &two), Share::Leave);
        assert_eq!(share(10, 10, 0, &two), Share::Take(10));
        // Of members that are alike none leaves the last piece to all others, who would do the same.
        let alike = [cpu(Some(100.0)); 8];
        assert!((0..8).all(|me| share(10, 10, me, &alike) == Share::Take(10)));
        let nearly = [cpu(Some(99.0)), cpu(Some(100.0)), cpu(Some(101.0))];
        assert_eq!(share(10, 10, 2, &nearly), Share::Take(10));
        // A processor that was never asked is thought to be slow.
        let unknown = [gpu(Some(640.0)), cpu(None)];
        assert_eq!(share(100, 10, 1, &unknown), Share::Leave);
        assert!(matches!(share(100_000, 10, 1, &unknown), Share::Take(n) if n < 1000));
    }
}
