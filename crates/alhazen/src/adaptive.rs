//! Spreading samples over a picture by the error of its pixels ([`film::Allocation`]), round by round.

use crate::renderer::{AfterPass, Limits, Renderer, Summary, check_view};
use backend::{AdaptiveRounds, BackendError, Control, PixelSamples, Stats, View};
use elementary::powi;
use film::{Allocation, Film, PixelStats};
use std::time::Duration;
use web_time::Instant;

/// How samples are spread over a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sampling {
    /// Every pixel gets the same number.
    #[default]
    Uniform,
    /// Pixels get what lowers the picture's error most; [`Limits::spp`] is what they get on average.
    Adaptive(Adaptive),
}

/// Settings of [`Sampling::Adaptive`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// Samples that every pixel gets before errors are looked at, at least 2: what these miss in a pixel and all around it
    /// is found late.
    pub min_spp: u32,
    /// What is added to the squared radiance that errors are relative to. `None` takes the floor of
    /// [`Film::relative_error`], which follows the picture's level; [`film::metrics::REL_MSE_EPSILON`] makes it relMSE that
    /// is least.
    pub floor: Option<f64>,
}

impl Default for Adaptive {
    fn default() -> Self {
        Self { min_spp: 16, floor: None }
    }
}

impl Adaptive {
    /// Samples that every pixel gets first.
    pub fn pilot(&self) -> u32 {
        self.min_spp.max(2)
    }
}

impl Sampling {
    /// Its name on the command line and in metadata.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Adaptive(_) => "adaptive",
        }
    }
}

/// A round makes the samples at most this many times what they were, so that the next one knows more.
const ROUND_GROWTH: f64 = 1.5;

/// What is left of a budget when it is a smaller part than this is not worth a round: pixels get whole quanta of samples, so
/// rounds never end exactly where they should, and ever smaller ones would follow.
const LEAST_ROUND: u64 = 64;

/// How long rounds may take that a back end makes without telling in between.
const LONGEST_UNSEEN: Duration = Duration::from_millis(250);

impl Renderer {
    /// Adds samples to the pixels that need them most: one round of adaptive sampling, of a picture whose pixels have their
    /// first ones ([`Adaptive::pilot`]) by [`Renderer::render_pass`] with the same view. `None` if no pixel needs any.
    ///
    /// - `view`: with the first sample of the picture, not of the round.
    /// - `samples`: per pixel on average.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_round(
        &mut self,
        view: &View,
        adaptive: &Adaptive,
        samples: u32,
        control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        check_view(view)?;
        let Some(film) = self.film()? else { return Ok(None) };
        let total = taken(film) + u64::from(samples) * view.window.area() as u64;
        let rounds = AdaptiveRounds { totals: vec![total], least: adaptive.pilot(), floor: adaptive.floor };
        if let Some(stats) = self.render_by_itself(view, &rounds, control)? {
            return Ok(Some(stats));
        }
        let Some(film) = self.film()? else { return Ok(None) };
        let pixels = next_round(film, view, adaptive, adaptive.pilot(), total);
        if pixels.is_empty() {
            return Ok(None);
        }
        self.render_some(view, &pixels, control).map(Some)
    }

    /// Renders a view until a limit is reached: every pixel first gets `min_spp` samples, then rounds follow in which
    /// pixels get what their neighbours' errors ask for.
    pub(crate) fn render_adaptively(
        &mut self,
        view: &View,
        limits: &Limits,
        adaptive: &Adaptive,
        control: &Control,
        after_pass: &mut AfterPass<'_>,
    ) -> Result<Summary, BackendError> {
        let start = Instant::now();
        let pilot = adaptive.pilot().min(limits.spp);
        let first = Limits { spp: pilot, time: limits.time, noise: None, sampling: Sampling::Uniform };
        let mut summary = self.render_evenly(view, &first, control, after_pass)?;
        let area = view.window.area() as u64;
        let budget = u64::from(limits.spp) * area;
        // What pixels have, all together. Where a back end decides by itself, nobody reads the film to count.
        let mut made = summary.samples;
        // What they should have. Rounds never make quite that. Where several are made at once, nobody knows in between, and the same
        // rounds are to be made whatever the time they take.
        let mut planned = made;
        while !summary.cancelled && !control.is_cancelled() {
            summary.noise = if limits.noise.is_some() { self.relative_error()? } else { None };
            summary.spp = (made / area) as u32;
            let quiet = limits.noise.zip(summary.noise).is_some_and(|(limit, noise)| noise <= limit);
            let late = limits.time.is_some_and(|time| start.elapsed() >= time);
            if quiet || late || (is_spent(planned, budget) && is_spent(made, budget)) {
                break;
            }
            let totals = next_totals(planned, &summary, limits, budget, start.elapsed());
            let (first, mut last) = (totals[0], totals[totals.len() - 1]);
            let rounds = AdaptiveRounds { totals, least: pilot, floor: adaptive.floor };
            let stats = if let Some(stats) = self.render_by_itself(view, &rounds, control)? {
                made += stats.samples;
                stats
            } else {
                let Some(film) = self.film()? else { break };
                let pixels = next_round(film, view, adaptive, pilot, first);
                if pixels.is_empty() {
                    break;
                }
                let stats = self.render_some(view, &pixels, control)?;
                (made, last) = (self.film()?.map_or(0, taken), first);
                stats
            };
            planned = if looks_after_each(limits) { made } else { last };
            summary.add(&stats);
            summary.elapsed = start.elapsed();
            after_pass(self, &summary);
        }
        summary.elapsed = start.elapsed();
        Ok(summary)
    }
}

/// Whether what is left of a budget is not worth a round.
fn is_spent(made: u64, budget: u64) -> bool {
    budget.saturating_sub(made) <= budget / LEAST_ROUND
}

/// Whether noise or time decide after every round what is next.
fn looks_after_each(limits: &Limits) -> bool {
    limits.noise.is_some() || limits.time.is_some()
}

/// Samples of all pixels that there should be after each of the next rounds, at least one, of `planned` that there should be now. A
/// back end makes them without telling in between, if [`looks_after_each`] allows it and a picture is still to be seen from time to time.
fn next_totals(planned: u64, summary: &Summary, limits: &Limits, budget: u64, elapsed: Duration) -> Vec<u64> {
    let mut last = next_total(planned, summary, limits, elapsed).min(budget);
    let mut totals = vec![last];
    let rate = planned as f64 / elapsed.as_secs_f64().max(1e-6);
    let unseen = planned + (rate * LONGEST_UNSEEN.as_secs_f64()) as u64;
    while !looks_after_each(limits) && !is_spent(last, budget) {
        last = (((last as f64) * ROUND_GROWTH).ceil() as u64).min(budget);
        if last > unseen {
            break;
        }
        totals.push(last);
    }
    totals
}

/// Samples of all pixels that there should be after the next round, of `planned` that there should be now.
fn next_total(planned: u64, summary: &Summary, limits: &Limits, elapsed: Duration) -> u64 {
    let mut growth = ROUND_GROWTH;
    if let Some((limit, noise)) = limits.noise.zip(summary.noise) {
        // The error falls with the root of the samples. A little less than what is thought to be needed: more can follow.
        growth = growth.min(powi(noise / limit, 2)).max(1.05);
    }
    if let Some(time) = limits.time {
        let left = time.saturating_sub(elapsed).as_secs_f64() / elapsed.as_secs_f64().max(1e-6);
        growth = growth.min(1.0 + 0.5 * left).max(1.01);
    }
    (planned as f64 * growth).ceil() as u64
}

/// Samples of all pixels so far.
fn taken(film: &Film) -> u64 {
    film.pixels().iter().map(PixelStats::taken).sum()
}

/// What the pixels get next.
fn next_round(film: &Film, view: &View, adaptive: &Adaptive, pilot: u32, total: u64) -> Vec<PixelSamples> {
    let taken = || film.pixels().iter().map(|p| u32::try_from(p.taken()).unwrap_or(u32::MAX));
    // After a device was lost, pixels may have less than what they began with.
    let missing: Vec<u32> = taken().map(|n| pilot.saturating_sub(n)).collect();
    let extra = match Allocation::new(film, adaptive.floor) {
        Some(allocation) if missing.iter().all(|&n| n == 0) => allocation.extra(total),
        // Samples that were no numbers are no estimate: all pixels get more.
        Some(_) | None if missing.iter().all(|&n| n == 0) => vec![pilot; missing.len()],
        Some(_) | None => missing,
    };
    let samples = (0..).zip(taken()).zip(extra).filter(|(_, count)| *count > 0);
    let samples = samples.map(|((pixel, taken), count)| PixelSamples {
        pixel,
        first: view.first_sample.saturating_add(taken),
        count,
    });
    samples.filter(|s| s.first.checked_add(s.count).is_some()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUDGET: u64 = 128_000;

    /// Totals after rounds of a picture with 16,000 samples, made in some time.
    fn totals(limits: Limits, elapsed: Duration) -> Vec<u64> {
        next_totals(16_000, &Summary::default(), &limits, BUDGET, elapsed)
    }

    #[test]
    fn fast_rounds_are_made_together() {
        let all = totals(Limits::default(), Duration::from_micros(1));
        assert_eq!(all, [24_000, 36_000, 54_000, 81_000, 121_500, 128_000]);
        // As many as there is time for: 16,000 samples in 0.1 s are 40,000 in 0.25 s.
        assert_eq!(totals(Limits::default(), Duration::from_millis(100)), all[..3]);
        assert_eq!(totals(Limits::default(), Duration::from_secs(100)), all[..1]);
        // What is left in the end is no round of its own.
        let left = next_totals(100_000, &Summary::default(), &Limits::default(), 151_000, Duration::ZERO);
        assert_eq!(left, [150_000]);
    }

    #[test]
    fn noise_and_time_are_looked_at_after_every_round() {
        let noise = Limits { noise: Some(0.01), ..Limits::default() };
        let time = Limits { time: Some(Duration::from_secs(100)), ..Limits::default() };
        assert_eq!([noise, time].map(|limits| totals(limits, Duration::from_micros(1)).len()), [1, 1]);
    }
}
