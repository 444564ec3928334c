//! Several back ends on one picture: GPUs, and the processor beside them.
//!
//! Members take ranges of samples, or of pixels, from what is left to do, by how fast they were so far and less and less
//! towards the end, so that all of them end together. Each adds to a film of its own; films add up exactly, so it does
//! not matter who made what. A member that is lost is dropped with its film, and the others make again what it had made.

mod member;
mod todo;
mod views;

use crate::causes::full_text;
use backend::{
    AdaptiveRounds, Backend, BackendError, Control, LoadStats, PassTime, PixelSamples, Stats, View,
    ViewBatch, ViewPictures,
};
use film::{Film, Image};
use member::{Member, Pace, Share, Stopped, add, share};
use post::NetworkInput;
use scene::tables::{Changes, SceneTables};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use todo::Todo;
use web_time::Instant;

/// How often progress is told, and cancelling heard.
const INTERVAL: Duration = Duration::from_millis(5);
/// Samples of a piece of some pixels, at least: a device is busy with them for longer than it takes to hand them over.
const LEAST_SAMPLES: u64 = 1 << 16;

/// Renders with several back ends at once.
pub struct Together {
    /// Those that work, the strongest first.
    members: Vec<Member>,
    /// What is being rendered.
    view: Option<View>,
    merged: Option<Film>,
    notices: Vec<String>,
    /// What loading took, seconds.
    loading: f64,
}

impl Together {
    /// Of back ends that have loaded nothing yet, the strongest first.
    pub fn new(members: Vec<Box<dyn Backend>>) -> Self {
        let members = members.into_iter().map(Member::new).collect();
        Self { members, view: None, merged: None, notices: Vec::new(), loading: 0.0 }
    }

    /// What each works on.
    pub fn devices(&self) -> Vec<String> {
        self.members.iter().map(|m| format!("{} on {}", m.backend.name(), m.backend.describe())).collect()
    }

    /// Drops members that failed, by number. What they held is to be made again.
    ///
    /// # Errors
    /// The last failure, if nobody is left.
    fn drop_lost(&mut self, lost: Vec<(usize, BackendError)>) -> Result<Todo, BackendError> {
        let mut again = Todo::default();
        let last = lost.len();
        for (i, (number, error)) in lost.into_iter().rev().enumerate() {
            let member = self.members.remove(number);
            again.append(member.made);
            if self.members.is_empty() && i + 1 == last {
                return Err(error);
            }
            self.notices.push(format!("{}; the others go on without it", full_text(&error)));
        }
        Ok(again)
    }

    /// Does the same with all members at once, and drops those whose device fails.
    fn all(
        &mut self,
        work: impl Fn(&mut Member) -> Result<LoadStats, BackendError> + Sync,
    ) -> Result<LoadStats, BackendError> {
        let results: Vec<_> = std::thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> =
                self.members.iter_mut().map(|member| scope.spawn(move || work(member))).collect();
            threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
        });
        let mut sum = LoadStats::default();
        let mut lost = Vec::new();
        for (number, result) in results.into_iter().enumerate() {
            match result {
                Ok(Ok(stats)) => {
                    sum.build = sum.build.max(stats.build);
                    sum.acceleration_bytes += stats.acceleration_bytes;
                    sum.table_bytes = sum.table_bytes.max(stats.table_bytes);
                    sum.device_bytes += stats.device_bytes;
                }
                Ok(Err(error)) => lost.push((number, error)),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        self.drop_lost(lost)?;
        if self.members.is_empty() {
            return Err(BackendError::NoScene { backend: "all" });
        }
        Ok(sum)
    }

    /// Begins a picture, unless it is the one that is there.
    fn begin(&mut self, view: &View) {
        let same = |old: &View| View { first_sample: view.first_sample, ..old.clone() } == *view;
        if !self.view.as_ref().is_some_and(same) {
            self.restart();
            self.view = Some(view.clone());
        }
    }

    /// Shares work among the members until all of it is done, or somebody says stop.
    fn work(&mut self, view: &View, mut todo: Todo, control: &Control) -> Result<Stats, BackendError> {
        let start = Instant::now();
        let area = view.window.area() as u64;
        control.begin(todo.amount(area));
        self.merged = None;
        let mut sum = Stats::default();
        while !todo.is_empty() && !control.is_cancelled() {
            let (stats, left, stopped) = work_once(&mut self.members, self.loading, view, todo, control);
            add(&mut sum, &stats);
            todo = left;
            let mut lost = Vec::new();
            for (number, stopped) in stopped.into_iter().enumerate() {
                match stopped {
                    Stopped::Done => {}
                    Stopped::Lost(error) => lost.push((number, error)),
                    Stopped::Refused(error) => return Err(error),
                }
            }
            todo.append(self.drop_lost(lost)?);
            if self.members.is_empty() {
                return Err(BackendError::NoScene { backend: "all" });
            }
        }
        (sum.cancelled, sum.elapsed) = (control.is_cancelled(), start.elapsed());
        Ok(sum)
    }

    /// Frames that follow each other have a past, which one device has.
    fn strongest(&mut self) -> Result<&mut Member, BackendError> {
        let notice = "frames that follow each other are made by the strongest device alone";
        if self.members.len() > 1 && !self.notices.iter().any(|n| n == notice) {
            self.notices.push(notice.to_owned());
        }
        self.members.first_mut().ok_or(BackendError::NoScene { backend: "all" })
    }
}

/// A round: members take pieces until nothing is left for them. Returns what is left, and why each of them stopped.
fn work_once(
    members: &mut [Member],
    loading: f64,
    view: &View,
    todo: Todo,
    control: &Control,
) -> (Stats, Todo, Vec<Stopped>) {
    members.iter_mut().for_each(|member| member.control = Arc::default());
    let controls: Vec<_> = members.iter().map(|member| member.control.clone()).collect();
    let paces = members.iter().map(|m| m.pace(loading)).collect();
    let shared = Mutex::new(Shared { todo, paces });
    // Samples of pieces that are done.
    let finished = AtomicU64::new(0);
    let before = control.progress().samples_done;
    let ended: Vec<(Stats, Stopped)> = std::thread::scope(|scope| {
        let threads: Vec<_> = members
            .iter_mut()
            .enumerate()
            .map(|(number, member)| {
                let (shared, finished) = (&shared, &finished);
                scope.spawn(move || take_pieces(member, number, view, shared, (control, finished)))
            })
            .collect();
        while !threads.iter().all(std::thread::ScopedJoinHandle::is_finished) {
            std::thread::park_timeout(INTERVAL);
            if control.is_cancelled() {
                controls.iter().for_each(|c| c.cancel());
            }
            let now: u64 = controls.iter().map(|c| c.progress().samples_done).sum();
            let done = before + finished.load(Ordering::Relaxed) + now;
            control.advance(done.saturating_sub(control.progress().samples_done));
        }
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|p| std::panic::resume_unwind(p)))
            .collect()
    });
    let done = before + finished.load(Ordering::Relaxed);
    control.advance(done.saturating_sub(control.progress().samples_done));
    let left = shared.into_inner().unwrap_or_else(PoisonError::into_inner).todo;
    let mut sum = Stats::default();
    ended.iter().for_each(|(stats, _)| add(&mut sum, stats));
    (sum, left, ended.into_iter().map(|(_, stopped)| stopped).collect())
}

/// What members share in a round.
struct Shared {
    todo: Todo,
    /// Of all members.
    paces: Vec<Pace>,
}

/// What a member does in a round.
fn take_pieces(
    member: &mut Member,
    number: usize,
    view: &View,
    shared: &Mutex<Shared>,
    (control, finished): (&Control, &AtomicU64),
) -> (Stats, Stopped) {
    let area = view.window.area() as u64;
    let mut sum = Stats::default();
    loop {
        if control.is_cancelled() {
            return (sum, Stopped::Done);
        }
        let piece = {
            let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
            let left = shared.todo.amount(area);
            // Of some pixels any number of samples may be taken; of all of them, one of each at least.
            let least = if shared.todo.samples.is_empty() { LEAST_SAMPLES.min(left.max(1)) } else { area };
            match share(left, least, number, &shared.paces) {
                _ if left == 0 => return (sum, Stopped::Done),
                Share::Leave => {
                    shared.paces[number].rate = Some(0.0);
                    return (sum, Stopped::Done);
                }
                Share::Wait => None,
                Share::Take(wanted) => Some(shared.todo.take(wanted, area)),
            }
        };
        let Some(piece) = piece else {
            std::thread::sleep(INTERVAL / 5);
            continue;
        };
        match member.make(view, piece) {
            Ok(stats) => add(&mut sum, &stats),
            Err(stopped) => {
                // Whoever waits for its speed shall not wait for ever.
                let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
                shared.paces[number].rate = Some(0.0);
                return (sum, stopped);
            }
        }
        finished.fetch_add(member.control.progress().samples_done, Ordering::Relaxed);
        member.control.begin(0);
        shared.lock().unwrap_or_else(PoisonError::into_inner).paces[number].rate = member.rate;
    }
}

impl Backend for Together {
    fn name(&self) -> &'static str {
        "all"
    }

    fn describe(&self) -> String {
        self.devices().join("; ")
    }

    fn load(&mut self, scene: Arc<SceneTables>) -> Result<LoadStats, BackendError> {
        self.restart();
        let start = Instant::now();
        let has_devices = self.members.iter().any(|m| !m.is_processor());
        let loaded = self.all(|member| {
            let waits = has_devices && member.is_processor();
            member.load(scene.clone(), waits)
        });
        self.loading = start.elapsed().as_secs_f64();
        loaded
    }

    fn update(&mut self, scene: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, BackendError> {
        self.restart();
        self.all(|member| member.update(scene.clone(), changes))
    }

    fn render(&mut self, view: &View, samples: u32, control: &Control) -> Result<Stats, BackendError> {
        let Some(end) = view.first_sample.checked_add(samples) else {
            return Err(BackendError::View { reason: format!("sample index beyond {}", u32::MAX) });
        };
        backend::check_switches(view)?;
        self.begin(view);
        if view.integrator.makes_frames() {
            let member = self.strongest()?;
            member.made.samples.push(view.first_sample..end);
            return member.backend.render(view, samples, control);
        }
        self.work(view, Todo::of_samples(view.first_sample..end), control)
    }

    fn render_pixels(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
    ) -> Result<Stats, BackendError> {
        backend::check_pixels(view, pixels)?;
        backend::check_switches(view)?;
        self.begin(view);
        self.work(view, Todo { samples: Vec::new(), pixels: pixels.to_vec() }, control)
    }

    fn render_rounds(
        &mut self,
        view: &View,
        rounds: &AdaptiveRounds,
        control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        // A device does not know what others have made of the picture.
        let [only] = &mut self.members[..] else { return Ok(None) };
        if self.view.is_some() {
            return Ok(None);
        }
        only.backend.render_rounds(view, rounds, control)
    }

    fn render_views(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
    ) -> Result<(ViewPictures, Stats), BackendError> {
        self.restart();
        views::render(self, batch, control)
    }

    fn restart(&mut self) {
        (self.view, self.merged) = (None, None);
        for member in &mut self.members {
            member.made = Todo::default();
            member.backend.restart();
        }
    }

    fn film(&mut self) -> Result<Option<&Film>, BackendError> {
        let Some(view) = self.view.clone() else { return Ok(None) };
        while self.merged.is_none() {
            let mut lost = Vec::new();
            let mut merged: Option<Film> = None;
            for (number, member) in self.members.iter_mut().enumerate().filter(|(_, m)| !m.made.is_empty()) {
                match (member.backend.film(), &mut merged) {
                    (Ok(Some(film)), Some(merged)) => merged.merge(film)?,
                    (Ok(Some(film)), none) => *none = Some(film.clone()),
                    (Ok(None), _) => {}
                    (Err(error @ BackendError::Device { .. }), _) => lost.push((number, error)),
                    (Err(error), _) => return Err(error),
                }
            }
            if lost.is_empty() {
                let Some(merged) = merged else { return Ok(None) };
                self.merged = Some(merged);
            } else {
                let again = self.drop_lost(lost)?;
                self.work(&view, again, &Control::new())?;
            }
        }
        Ok(self.merged.as_ref())
    }

    fn filter_noise(&mut self, picture: &NetworkInput<'_>) -> Option<Image> {
        self.members.iter_mut().find_map(|member| member.backend.filter_noise(picture))
    }

    fn take_notices(&mut self) -> Vec<String> {
        let mut notices = std::mem::take(&mut self.notices);
        notices.extend(self.members.iter_mut().flat_map(|member| member.backend.take_notices()));
        notices
    }

    fn kernel(&self) -> Option<&'static str> {
        self.members.iter().find_map(|member| member.backend.kernel())
    }

    fn take_passes(&mut self) -> Vec<PassTime> {
        self.members.iter_mut().flat_map(|member| member.backend.take_passes()).collect()
    }
}
