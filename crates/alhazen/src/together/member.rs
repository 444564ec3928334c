//! One of several back ends that work together.

use super::todo::Todo;
use backend::{Backend, BackendError, Control, Integrator, LoadStats, Stats, Switch, View};
use scene::tables::{Changes, SceneTables};
use std::sync::Arc;
use web_time::Instant;

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
    /// The scene of a processor beside GPUs, which loads it when it is first needed: it has the hierarchy built once
    /// more, while the host has GPUs to feed.
    waiting: Option<Arc<SceneTables>>,
}

/// The part of what is left that devices begin with, all together: enough to be traced in the same way as the rest, and
/// little enough that one which proves slow keeps nobody waiting.
const FIRST: u64 = 8;

/// The part of its share that a member takes at once. Its speed may be misjudged by a third before others wait for it.
const PORTION: f64 = 0.75;

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
        Self {
            backend,
            rate: None,
            is_warm: false,
            made: Todo::default(),
            control: Arc::default(),
            waiting: None,
        }
    }

    /// Loads a scene, or keeps it until the member is needed.
    pub fn load(&mut self, scene: Arc<SceneTables>, waits: bool) -> Result<LoadStats, BackendError> {
        (self.rate, self.is_warm, self.waiting) = (None, false, None);
        if waits {
            self.waiting = Some(scene);
            return Ok(LoadStats::default());
        }
        self.backend.load(scene)
    }

    /// Follows a scene that has changed.
    pub fn update(&mut self, scene: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, BackendError> {
        if self.waiting.is_some() {
            self.waiting = Some(scene);
            return Ok(LoadStats::default());
        }
        self.backend.update(scene, changes)
    }

    pub fn is_processor(&self) -> bool {
        self.backend.name() == "cpu"
    }

    /// Makes a piece; it belongs to the member from now on, whether it succeeds or not.
    pub fn make(&mut self, view: &View, piece: Todo) -> Result<Stats, Stopped> {
        let view = &for_all(view);
        let area = view.window.area() as u64;
        self.made.append(piece.clone());
        if let Some(scene) = self.waiting.take() {
            self.backend.load(scene).map_err(stopped)?;
        }
        let (amount, start) = (piece.amount(area), Instant::now());
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

/// The view with caustics and guiding that are left to the renderer switched off: not all members have photons and guides,
/// and all are to make the same picture.
fn for_all(view: &View) -> View {
    let mut view = view.clone();
    if let Integrator::Path(path) = &mut view.integrator {
        for switch in [&mut path.caustics, &mut path.guiding] {
            if *switch == Switch::Auto {
                *switch = Switch::Off;
            }
        }
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

/// How fast a member is, as others see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    /// Samples of pixels a second; `None`: unknown; 0: it takes nothing.
    pub rate: Option<f64>,
    /// It is a processor.
    pub is_processor: bool,
    /// Seconds that it needs before it can begin.
    pub loading: f64,
}

impl Member {
    /// Its pace. `loading`: what loading takes, seconds.
    pub fn pace(&self, loading: f64) -> Pace {
        let loading = if self.waiting.is_some() { loading } else { 0.0 };
        Pace { rate: self.rate, is_processor: self.is_processor(), loading }
    }
}

/// How much of what is `left` member `me` should take: a part of its share by speed, so that all end together.
///
/// - `least`: samples of the smallest piece. `paces`: of all members.
pub(super) fn share(left: u64, least: u64, me: usize, paces: &[Pace]) -> Share {
    let Pace { rate, is_processor, loading } = paces[me];
    let fastest = paces.iter().filter_map(|pace| pace.rate).fold(0.0, f64::max);
    let guess = (is_processor && fastest > 0.0).then_some(fastest * UNKNOWN_PROCESSOR);
    let Some(mine) = rate.or(guess) else { return first(left, least, is_processor, paces) };
    // What it would spare the others, seconds.
    if rate.is_none() && left as f64 / fastest * UNKNOWN_PROCESSOR < loading {
        return Share::Leave;
    }
    let others = || paces.iter().enumerate().filter(|(i, _)| *i != me).map(|(_, pace)| pace.rate);
    if others().all(|rate| rate == Some(0.0)) {
        return Share::Take(left);
    }
    let all_others: f64 = others().flatten().sum();
    let next = others().flatten().fold(0.0, f64::max);
    // None of them takes less than the least, so the fastest never leaves.
    let without = (left as f64 / all_others).max(least as f64 / next);
    if all_others > 0.0 && least as f64 / mine > PATIENCE * without {
        return Share::Leave;
    }
    Share::Take(((PORTION * left as f64 * mine / (mine + all_others)) as u64).max(least))
}

/// What a member takes before anybody knows how fast it is. Devices begin with a part, for which they compile their
/// shaders; processors wait for them.
fn first(left: u64, least: u64, is_processor: bool, paces: &[Pace]) -> Share {
    let works = |pace: &&Pace| !pace.is_processor && pace.rate != Some(0.0);
    let devices = paces.iter().filter(works).count() as u64;
    match (is_processor, devices) {
        (true, 0) => Share::Take(least),
        (true, _) => Share::Wait,
        (false, _) => Share::Take(least.max(left / (FIRST * devices))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_shared_by_speed_and_slow_members_leave_the_end_to_others() {
        let gpu = |rate| Pace { rate, is_processor: false, loading: 0.0 };
        let cpu = |rate| Pace { rate, is_processor: true, loading: 0.0 };
        // Nothing is known: devices begin with an eighth, a processor waits for them, unless it is alone.
        assert_eq!(share(1000, 10, 0, &[gpu(None), cpu(None)]), Share::Take(125));
        assert_eq!(share(1000, 10, 0, &[gpu(None), gpu(None), cpu(None)]), Share::Take(62));
        assert_eq!(share(40, 10, 0, &[gpu(None), cpu(None)]), Share::Take(10));
        assert_eq!(share(1000, 10, 1, &[gpu(None), cpu(None)]), Share::Wait);
        assert_eq!(share(1000, 10, 0, &[cpu(None), cpu(None)]), Share::Take(10));
        // Three quarters and one of them, three quarters of it at a time.
        let two = [gpu(Some(300.0)), gpu(Some(100.0))];
        assert_eq!(share(800, 10, 0, &two), Share::Take(450));
        assert_eq!(share(800, 10, 1, &two), Share::Take(150));
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
        assert!(matches!(share(100_000, 10, 1, &unknown), Share::Take(n) if n < 2000));
    }

    #[test]
    fn a_processor_loads_only_what_it_spares_the_others_more_time_than_that_takes() {
        let gpu = |rate| Pace { rate: Some(rate), is_processor: false, loading: 0.0 };
        let cpu = |rate, loading| Pace { rate, is_processor: true, loading };
        // 128 seconds are left, of which it is thought to spare two.
        assert!(matches!(share(12_800, 1, 1, &[gpu(100.0), cpu(None, 1.9)]), Share::Take(_)));
        assert_eq!(share(12_800, 1, 1, &[gpu(100.0), cpu(None, 2.1)]), Share::Leave);
        // Nobody waits for devices that are lost.
        assert_eq!(share(12_800, 1, 1, &[gpu(0.0), cpu(None, 2.1)]), Share::Take(1));
        // Whoever is left alone takes all of it, and does not wait for a speed that nobody measures.
        assert_eq!(share(12_800, 1, 0, &[gpu(100.0), cpu(Some(0.0), 2.1)]), Share::Take(12_800));
        assert!(matches!(share(12_800, 1, 0, &[gpu(100.0), cpu(None, 2.1)]), Share::Take(9_600)));
    }
}
