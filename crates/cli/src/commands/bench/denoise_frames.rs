//! What denoisers are worth on sequences: the camera goes around what it looks at.

use super::denoise::name;
use super::report::{Cell, Table};
use super::views::{View, ViewArgs};
use crate::commands::render::DenoiserName;
use alhazen::{
    Camera, Control, Denoiser, FrameFilm, FrameMoment, Image, Job, Limits, Renderer, SequenceDenoiser,
    Surface, frame_seed, metrics,
};
use anyhow::Context;
use glam::{Quat, Vec3};
use std::time::Instant;

/// Seed of the sequence's noise.
const SEED: u32 = 1;

/// The frames of a sequence.
#[derive(Clone, Copy, Debug)]
pub struct Orbit {
    /// How many there are.
    pub frames: u32,
    /// By how much the camera turns from one to the next, degrees.
    pub step: f32,
}

/// The table of sequences, without rows.
pub fn table() -> Table {
    let columns = ["scene", "spp", "denoiser", "history", "relMSE", "FLIP", "flicker", "seconds"];
    Table::new("sequence", "Frames of a moving camera", &columns)
}

/// What denoises the frames: a denoiser, and whether frames use what those before have found. The
/// network does both.
fn runs(denoisers: &[DenoiserName]) -> Vec<(Option<DenoiserName>, bool)> {
    let of = |denoiser: &DenoiserName| {
        let with_history = matches!(denoiser, DenoiserName::Network);
        [Some((Some(*denoiser), false)), with_history.then_some((Some(*denoiser), true))]
    };
    [(None, false)].into_iter().chain(denoisers.iter().flat_map(of).flatten()).collect()
}

/// One way of denoising the sequence, and what it has measured.
struct Run {
    denoiser: Option<DenoiserName>,
    history: Option<SequenceDenoiser>,
    last: Option<Image>,
    rel_mse: f64,
    flip: f64,
    flicker: f64,
    seconds: f64,
}

impl Run {
    fn new((denoiser, with_history): (Option<DenoiserName>, bool)) -> Self {
        let history = with_history.then(SequenceDenoiser::default);
        Self { denoiser, history, last: None, rel_mse: 0.0, flip: 0.0, flicker: 0.0, seconds: 0.0 }
    }

    fn picture(&mut self, renderer: &mut Renderer, film: &FrameFilm) -> anyhow::Result<Image> {
        let Some(denoiser) = self.denoiser else { return Ok(film.noisy().colour.clone()) };
        let denoiser = Denoiser::from(denoiser);
        let denoised = match &mut self.history {
            Some(history) => history.denoise(renderer, denoiser, film)?,
            None => renderer.denoise(denoiser, film.noisy())?,
        };
        Ok(denoised.picture)
    }

    fn row(&self, scene: &str, spp: u32, reference_flicker: f64) -> Vec<Cell> {
        let name = self.denoiser.map_or("none".to_owned(), name);
        let history = if self.history.is_some() { "yes" } else { "no" };
        let flicker = self.flicker / reference_flicker;
        let texts = [scene.into(), f64::from(spp).into(), name.into(), history.into()];
        let numbers = [self.rel_mse, self.flip, flicker, self.seconds];
        texts.into_iter().chain(numbers.map(Into::into)).collect()
    }
}

/// Measures the sequence of a scene that the renderer has loaded, and adds the rows. Means are over
/// all frames but the first.
pub fn measure(
    renderer: &mut Renderer,
    view: &View,
    views: &ViewArgs,
    (spp, orbit): (u32, Orbit),
    denoisers: &[DenoiserName],
    table: &mut Table,
) -> anyhow::Result<()> {
    let mut runs: Vec<Run> = runs(denoisers).into_iter().map(Run::new).collect();
    let share = 1.0 / f64::from(orbit.frames - 1);
    let stops = view.job.tone.exposure.log2();
    let mut last: Option<(FrameMoment, Vec<Surface>, Image)> = None;
    let mut reference_flicker = 0.0;
    for frame in 0..orbit.frames {
        let job = job(&view.job, orbit, frame);
        let name = format!("{} orbit {} {frame}", view.name, orbit.step);
        let reference = views.reference(&name, &Job { aovs: Vec::new(), ..job.clone() }, renderer)?;
        renderer.restart();
        renderer.render(&job, &Limits { spp, ..Limits::default() }, &Control::new())?;
        let film = renderer.film()?.context("nothing was rendered")?;
        let film = FrameFilm::new(film, &job.view(0.0), None)?;
        let surfaces = film.surfaces(last.as_ref().map(|(moment, ..)| moment));
        let moved = |before: &Image, now: &Image| match &last {
            Some((_, then, _)) => flicker(before, now, &surfaces, then, stops),
            None => Ok(0.0),
        };
        for run in &mut runs {
            let begin = Instant::now();
            let picture = run.picture(renderer, &film)?;
            if let Some(before) = &run.last {
                run.seconds += share * begin.elapsed().as_secs_f64();
                run.rel_mse += share * metrics::rel_mse(&reference, &picture)?;
                run.flip += share * metrics::flip(&reference, &picture, stops)?.mean;
                run.flicker += share * moved(before, &picture)?;
            }
            run.last = Some(picture);
        }
        if let Some((.., before)) = &last {
            reference_flicker += share * moved(before, &reference)?;
        }
        last = Some((film.moment().clone(), surfaces, reference));
    }
    runs.iter().for_each(|run| table.push(run.row(&view.name, spp, reference_flicker)));
    Ok(())
}

/// A frame: its camera, its noise, its layers.
fn job(of: &Job, orbit: Orbit, frame: u32) -> Job {
    let turn =
        Quat::from_axis_angle(of.camera.up.normalize_or(Vec3::Y), (orbit.step * frame as f32).to_radians());
    let eye = of.camera.target + turn * (of.camera.eye - of.camera.target);
    let camera = Camera { eye, path: None, ..of.camera.clone() };
    Job { camera, seed: frame_seed(SEED, frame), aovs: SequenceDenoiser::LAYERS.to_vec(), ..of.clone() }
}

/// FLIP between a frame and the one before where that has moved to; 0 where what is seen was not
/// seen before.
fn flicker(
    before: &Image,
    now: &Image,
    surfaces: &[Surface],
    then: &[Surface],
    stops: f32,
) -> anyhow::Result<f64> {
    let carried = Image::from_fn(now.width(), now.height(), |x, y| {
        carried(before, (x, y), surfaces, then).unwrap_or(now.rgb(x, y))
    });
    Ok(metrics::flip(now, &carried, stops)?.mean)
}

/// What the last frame shows where the surface of a pixel was then, linear between its pixels.
fn carried(before: &Image, (x, y): (u32, u32), surfaces: &[Surface], then: &[Surface]) -> Option<[f32; 3]> {
    let (width, height) = (before.width(), before.height());
    let surface = &surfaces[(y * width + x) as usize];
    let place = [x as f32 + surface.back[0], y as f32 + surface.back[1]];
    let ends = [width - 1, height - 1].map(|n| n as f32);
    // Also false for what is no number.
    let is_inside = place.iter().zip(&ends).all(|(p, end)| (0.0..=*end).contains(p));
    let nearest = |p: [f32; 2]| (p[1].round() as u32 * width + p[0].round() as u32) as usize;
    if !is_inside || then[nearest(place)].ids != surface.ids {
        return None;
    }
    let [left, above] = [place[0].floor().min(ends[0] - 1.0), place[1].floor().min(ends[1] - 1.0)];
    let [u, v] = [place[0] - left, place[1] - above];
    let at = |dx: u32, dy: u32| before.rgb(left as u32 + dx, above as u32 + dy);
    let row = |dy: u32| {
        let (a, b) = (at(0, dy), at(1, dy));
        [0, 1, 2].map(|c| a[c] + u * (b[c] - a[c]))
    };
    let (upper, lower) = (row(0), row(1));
    Some([0, 1, 2].map(|c| upper[c] + v * (lower[c] - upper[c])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(back: [f32; 2], id: u32) -> Surface {
        Surface { back, distance_before: 1.0, distance: 1.0, ids: [id, 0] }
    }

    #[test]
    fn what_has_moved_along_does_not_flicker() {
        let before = Image::from_fn(16, 16, |x, y| [x as f32 * 0.05, y as f32 * 0.05, 0.2]);
        let now = Image::from_fn(16, 16, |x, y| [(x as f32 - 1.5) * 0.05, y as f32 * 0.05, 0.2]);
        let then = vec![surface([0.0; 2], 1); 256];
        let moved = vec![surface([-1.5, 0.0], 1); 256];
        let flicker = |surfaces: &[Surface]| flicker(&before, &now, surfaces, &then, 0.0).unwrap();
        assert!(flicker(&moved) < 1e-4, "{}", flicker(&moved));
        assert!(flicker(&then) > 0.05, "it has moved: {}", flicker(&then));
        // Of what was not seen before nobody can say that it flickers.
        assert_eq!(flicker(&vec![surface([0.0; 2], 2); 256]), 0.0);
    }
}
