//! [`Learner`]: sums of what paths find, in integers.

use crate::guide::Guide;
use optics::Vec3f;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// The probabilities among which places choose that of following the guide. Not more than a half: where a guide is wrong, what the
/// surface alone samples counts for 1 / (1 − fraction) at each vertex, and a path has many.
pub const FRACTIONS: [f32; 4] = [0.0, 0.125, 0.25, 0.5];

/// The unit of sums of light: the picture's level is so many.
const LEVEL: f64 = (1u64 << 24) as f64;
/// The most that a find adds to a sum of light: few and many finds fit in, up to a million of the largest.
const MOST_LIGHT: f64 = (1u64 << 42) as f64;
/// The unit of sums of squares, which are relative to the square of the picture's level.
const SQUARE: f64 = (1u64 << 20) as f64;
/// The most that a contribution counts in squares, relative to the picture's level: a bright speck decides nothing.
const MOST_CONTRIBUTION: f32 = 16.0;

/// What a path found in a direction that it had sampled at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// The vertex, metres.
    pub position: Vec3f,
    /// The unit direction.
    pub wi: Vec3f,
    /// Density over solid angle with which the direction was sampled: that of BSDF and guide together.
    pub pdf: f32,
    /// That of the BSDF alone.
    pub bsdf_pdf: f32,
    /// That of the guide alone.
    pub guide_pdf: f32,
    /// Luminance of the radiance that arrived, W·sr⁻¹·m⁻².
    pub radiance: f32,
    /// Luminance of what that added to the picture.
    pub contribution: f32,
}

/// What was found in a leaf of the tree over space.
#[derive(Debug, Default)]
pub(crate) struct LeafSums {
    /// Number of finds.
    pub count: AtomicU32,
    /// Second moments of contributions, were the guide followed with each of [`FRACTIONS`].
    pub squares: [AtomicU64; 4],
}

/// Learns from paths that follow a guide.
#[derive(Debug)]
pub struct Learner {
    pub(crate) guide: Arc<Guide>,
    /// Radiance over density of each cell of the trees over directions.
    pub(crate) cells: Vec<AtomicU64>,
    pub(crate) leaves: Vec<LeafSums>,
    /// Level of the picture, W·sr⁻¹·m⁻².
    level: f32,
}

impl Learner {
    /// Nothing learned yet. `level`: mean luminance of the picture, which should be about right and not more.
    pub fn new(guide: Arc<Guide>, level: f32) -> Self {
        let cells = (0..4 * guide.quads.len()).map(|_| AtomicU64::new(0)).collect();
        let leaves = (0..guide.leaves).map(|_| LeafSums::default()).collect();
        let level = if level.is_finite() && level > 1e-30 { level } else { 1.0 };
        Self { guide, cells, leaves, level }
    }

    /// The guide that paths are to follow.
    pub fn guide(&self) -> &Guide {
        &self.guide
    }

    /// Adds what a path found. Any thread may, in any order.
    pub fn add(&self, found: &Found) {
        let leaf = self.guide.leaf(found.position);
        let sums = &self.leaves[leaf.number as usize];
        sums.count.fetch_add(1, Ordering::Relaxed);
        // Not the other way round: NaN is nothing that is learned from.
        if !(found.radiance > 0.0 && found.pdf > 0.0) {
            return;
        }
        let light = f64::from(found.radiance / found.pdf) / f64::from(self.level) * LEVEL;
        let (cell, _) = self.guide.find(leaf, found.wi);
        self.cells[cell].fetch_add(light.min(MOST_LIGHT) as u64, Ordering::Relaxed);
        let contribution = (found.contribution / self.level).clamp(0.0, MOST_CONTRIBUTION);
        for (sum, fraction) in sums.squares.iter().zip(FRACTIONS) {
            // What is sampled less often counts more.
            let pdf = optics::guiding::guided_pdf(found.bsdf_pdf, found.guide_pdf, fraction);
            let less = (found.pdf / pdf.max(1e-20)).min(64.0);
            let square = f64::from(contribution * contribution * less) * SQUARE;
            sum.fetch_add(square as u64, Ordering::Relaxed);
        }
    }

    /// The share of the second moment of what paths find that is left if every place follows the guide as often as is best there,
    /// about: 1 if a guide is of no use. Only known of paths that have followed a guide.
    pub fn moment_left(&self) -> f64 {
        let (mut without, mut best) = (0.0, 0.0);
        for sums in &self.leaves {
            let squares = sums.squares.each_ref().map(|sum| sum.load(Ordering::Relaxed));
            without += squares[0] as f64;
            best += squares.into_iter().min().unwrap_or(0) as f64;
        }
        if without > 0.0 { best / without } else { 1.0 }
    }

    /// Bytes of its sums.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.cells[..]) + size_of_val(&self.leaves[..])
    }
}
