//! Looking up in the last frame what the pixels of this one see.

use super::{Past, Surface};
use rayon::prelude::*;

/// Largest relative difference between the distance of a surface and of what the history shows in
/// its place, on top of how distances differ from pixel to pixel.
const DISTANCE_TOLERANCE: f32 = 0.02;

/// Smallest cosine between the normals.
const NORMAL_TOLERANCE: f32 = 0.9;

/// Albedos that differ by more than this factor are those of different things: light that does not
/// come from the albedo, such as a reflection, would be multiplied.
const ALBEDO_TOLERANCE: f32 = 4.0;

/// Least share of the four pixels around a place that have to show the same surface.
const LEAST_SHARE: f32 = 0.05;

/// What the history has for a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Before {
    /// Irradiance, as the new frame counts it.
    pub irradiance: [f32; 3],
    /// Its variance. Averaging neighbours makes noise smaller and coarser, but filters remove it no
    /// better than before: it counts as if it had only been moved.
    pub variance: [f32; 3],
}

/// The history of each pixel of `own`, row by row; `None` where what is seen was not seen before.
pub fn reproject(own: &Past, past: &Past) -> Vec<Option<Before>> {
    let width = own.size[0];
    let pixel = |i: usize| {
        let back = own.surfaces[i].back;
        let place = [(i % width) as f32 + back[0], (i / width) as f32 + back[1]];
        if place.iter().any(|p| !p.is_finite()) {
            return None;
        }
        let slope = slope(&own.surfaces, own.size, i);
        let is_same = |at: usize| is_same(own, past, i, at, slope);
        let [left, above] = place.map(f32::floor);
        let [u, v] = [place[0] - left, place[1] - above];
        let four =
            [(0, 0, (1.0 - u) * (1.0 - v)), (1, 0, u * (1.0 - v)), (0, 1, (1.0 - u) * v), (1, 1, u * v)];
        let taps = four.map(|(x, y, weight)| (past.index(left as i64 + x, above as i64 + y), weight));
        average(past, &taps, is_same)
    };
    (0..own.surfaces.len()).into_par_iter().map(pixel).collect()
}

/// The mean of those pixels of the history that show the same surface, by their weights.
fn average(past: &Past, taps: &[(Option<usize>, f32)], is_same: impl Fn(usize) -> bool) -> Option<Before> {
    let mut sum = Before { irradiance: [0.0; 3], variance: [0.0; 3] };
    let mut share = 0.0;
    for &(at, weight) in taps {
        let Some(at) = at.filter(|at| weight > 0.0 && is_same(*at)) else { continue };
        share += weight;
        for c in 0..3 {
            sum.irradiance[c] += weight * past.irradiance[at][c];
            sum.variance[c] += weight * past.variance[at][c];
        }
    }
    let mean = |v: [f32; 3]| v.map(|v| v / share);
    (share > LEAST_SHARE).then(|| Before { irradiance: mean(sum.irradiance), variance: mean(sum.variance) })
}

impl Past {
    /// The index of a pixel that is in the picture.
    fn index(&self, x: i64, y: i64) -> Option<usize> {
        let [width, height] = self.size.map(|n| n as i64);
        ((0..width).contains(&x) && (0..height).contains(&y)).then_some((y * width + x) as usize)
    }
}

/// How far distances differ from one pixel to the next, metres: the smaller difference along each
/// axis, so that it is that of the pixel's own surface.
fn slope(surfaces: &[Surface], [width, height]: [usize; 2], i: usize) -> f32 {
    let at = |j: usize| (surfaces[j].distance - surfaces[i].distance).abs();
    let smaller = |place: usize, count: usize, step: usize| {
        let before = if place > 0 { at(i - step) } else { f32::NAN };
        let after = if place + 1 < count { at(i + step) } else { f32::NAN };
        let least = before.min(after);
        if least.is_finite() { least } else { 0.0 }
    };
    smaller(i % width, width, 1) + smaller(i / width, height, width)
}

/// Whether pixel `at` of the history shows the surface that pixel `i` shows.
fn is_same(own: &Past, past: &Past, i: usize, at: usize, slope: f32) -> bool {
    let (surface, found) = (&own.surfaces[i], &past.surfaces[at]);
    let (expected, distance) = (surface.distance_before, found.distance);
    // What is infinite is the sky, and of what is not known nothing can be said.
    let is_there = expected == distance
        || expected.is_nan()
        || distance.is_nan()
        || (expected - distance).abs() <= DISTANCE_TOLERANCE * expected.min(distance) + 2.0 * slope;
    let [a, b] = [own.normal[i], past.normal[at]];
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    let looks_there = dot(a, b) >= NORMAL_TOLERANCE * lengths;
    let albedos = own.demodulator[i].iter().zip(&past.demodulator[at]).map(|(a, b)| a / b);
    let has_albedo = albedos.into_iter().all(|r| (1.0 / ALBEDO_TOLERANCE..=ALBEDO_TOLERANCE).contains(&r));
    surface.ids == found.ids && is_there && looks_there && has_albedo
}
