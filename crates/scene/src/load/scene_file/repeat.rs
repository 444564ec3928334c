//! Copies of one object: grids, rings, spirals and scatterings, and how their materials vary.

use super::document::Context;
use super::values::{Color, within};
use crate::load::LoadError;
use crate::shapes::noise::uniform;
use elementary::{cos, sin};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use serde::Deserialize;
use std::f32::consts::TAU;

/// How an object is repeated; exactly one layout.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub(super) struct Repeat {
    grid: Option<Grid>,
    ring: Option<Ring>,
    spiral: Option<Spiral>,
    scatter: Option<Scatter>,
    at: Option<Vec<[f64; 3]>>,
    /// The middle of the layout.
    center: [f64; 3],
    /// Degrees about +Y that each copy is turned further than the one before.
    turn: f32,
    /// Random shift up to this much along each axis, metres.
    jitter: [f32; 3],
    /// Random turn about +Y up to this many degrees either way.
    jitter_turn: f32,
    /// Random scale up to this share either way.
    jitter_scale: f32,
    /// Which random numbers.
    seed: u32,
}

/// Rows along the axes, centred.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Grid {
    count: [u32; 3],
    spacing: [f64; 3],
}

/// A circle about the y axis; copies are turned with it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ring {
    count: u32,
    radius: f32,
    /// Degrees of the first copy, from +Z towards +X.
    #[serde(default)]
    start: f32,
    /// Degrees over which the copies are spread; less than a full turn has a copy at both ends.
    #[serde(default = "full_turn")]
    sweep: f32,
}

fn full_turn() -> f32 {
    360.0
}

/// A sunflower's seeds: evenly spread over a disc, whatever the count.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Spiral {
    count: u32,
    /// Distance between neighbours, metres.
    spacing: f32,
}

/// Evenly random in a box.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Scatter {
    count: u32,
    size: [f32; 3],
}

/// One copy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Copy {
    /// Applied after the object's own transform.
    pub motion: DAffine3,
    /// Index along each axis of the layout, and the number of copies along it.
    pub cell: [(u32, u32); 3],
    /// Number of the copy, and how many there are.
    pub index: (u32, u32),
}

impl Default for Copy {
    fn default() -> Self {
        Self { motion: DAffine3::IDENTITY, cell: [(0, 1); 3], index: (0, 1) }
    }
}

impl Repeat {
    /// The copies, at most `limit`.
    pub fn copies(&self, limit: usize, context: &Context) -> Result<Vec<Copy>, LoadError> {
        let layouts = [
            self.grid.is_some(),
            self.ring.is_some(),
            self.spiral.is_some(),
            self.scatter.is_some(),
            self.at.is_some(),
        ];
        if layouts.iter().filter(|given| **given).count() != 1 {
            return Err(context.error("`repeat` needs one of `grid`, `ring`, `spiral`, `scatter` and `at`"));
        }
        let count = self.count();
        if count > limit as u64 {
            return Err(context.error(format!("`repeat` asks for {count} copies; {limit} are allowed")));
        }
        within(self.jitter_scale, [0.0, 0.99], "repeat.jitter-scale", context)?;
        Ok((0..count as u32).map(|i| self.copy(i, count as u32)).collect())
    }

    /// How many copies there are.
    pub fn count(&self) -> u64 {
        if let Some(g) = &self.grid {
            return g.count.iter().map(|n| u64::from(*n)).fold(1, u64::saturating_mul);
        }
        let listed = self.at.as_ref().map(|at| at.len() as u64);
        let counts = [
            self.ring.as_ref().map(|r| u64::from(r.count)),
            self.spiral.as_ref().map(|s| u64::from(s.count)),
            self.scatter.as_ref().map(|s| u64::from(s.count)),
            listed,
        ];
        counts.into_iter().flatten().next().unwrap_or(1)
    }

    fn copy(&self, i: u32, count: u32) -> Copy {
        let mut copy = Copy { index: (i, count), cell: [(i, count); 3], ..Default::default() };
        let (place, angle) = self.place(i, count, &mut copy);
        let random = |k: u32| 2.0 * uniform(self.seed, i.wrapping_mul(8).wrapping_add(k)) - 1.0;
        let shift = Vec3::from_array(self.jitter) * Vec3::new(random(0), random(1), random(2));
        let angle = angle + (self.turn * i as f32 + self.jitter_turn * random(3)).to_radians();
        copy.motion = DAffine3::from_scale_rotation_translation(
            DVec3::splat(f64::from(1.0 + self.jitter_scale * random(4))),
            DQuat::from_rotation_y(angle.into()),
            DVec3::from_array(self.center) + place + shift.as_dvec3(),
        );
        copy
    }

    /// Where copy `i` stands, and its angle about +Y in radians.
    fn place(&self, i: u32, count: u32, copy: &mut Copy) -> (DVec3, f32) {
        if let Some(g) = &self.grid {
            let [nx, ny, _] = g.count.map(|n| n.max(1));
            let cell = [i % nx, i / nx % ny, i / nx / ny];
            copy.cell = std::array::from_fn(|axis| (cell[axis], g.count[axis]));
            let offset = |axis: usize| {
                (f64::from(cell[axis]) - (f64::from(g.count[axis]) - 1.0) * 0.5) * g.spacing[axis]
            };
            return (DVec3::new(offset(0), offset(1), offset(2)), 0.0);
        }
        if let Some(r) = &self.ring {
            let steps = if r.sweep.abs() >= 360.0 { count } else { count.saturating_sub(1) };
            let angle = (r.start + r.sweep * i as f32 / steps.max(1) as f32).to_radians();
            return ((r.radius * Vec3::new(sin(angle), 0.0, cos(angle))).as_dvec3(), angle);
        }
        if let Some(s) = &self.spiral {
            let golden = TAU * 0.381_966;
            // The centre is occupied; each copy has an area of about spacing².
            let radius = s.spacing * (i as f32 / std::f32::consts::PI * 1.15).sqrt();
            let angle = golden * i as f32;
            return ((radius * Vec3::new(sin(angle), 0.0, cos(angle))).as_dvec3(), 0.0);
        }
        if let Some(s) = &self.scatter {
            let random = |k: u32| uniform(self.seed ^ 0x9e37, i.wrapping_mul(3).wrapping_add(k)) - 0.5;
            let place = Vec3::from_array(s.size) * Vec3::new(random(0), random(1), random(2));
            return (place.as_dvec3(), 0.0);
        }
        let listed = self.at.as_ref().and_then(|at| at.get(i as usize));
        (DVec3::from_array(listed.copied().unwrap_or_default()), 0.0)
    }
}

/// Which count of a copy something varies with.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Along {
    /// The number of the copy.
    #[default]
    Copy,
    /// The grid's columns.
    X,
    /// The grid's layers.
    Y,
    /// The grid's rows.
    Z,
}

impl Along {
    fn of(self, copy: &Copy) -> (u32, u32) {
        match self {
            Along::Copy => copy.index,
            Along::X => copy.cell[0],
            Along::Y => copy.cell[1],
            Along::Z => copy.cell[2],
        }
    }
}

/// A number that goes from one value to another over the copies.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ramp {
    #[serde(default)]
    along: Along,
    from: f32,
    to: f32,
}

impl Ramp {
    /// The value for a copy.
    pub fn at(&self, copy: &Copy) -> f32 {
        let (i, n) = self.along.of(copy);
        self.from + (self.to - self.from) * i as f32 / n.saturating_sub(1).max(1) as f32
    }
}

/// Colours that take turns over the copies.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Palette {
    #[serde(default)]
    along: Along,
    colors: Vec<Color>,
}

impl Palette {
    /// The colour for a copy; `None` if there are no colours.
    pub fn at(&self, copy: &Copy) -> Option<Vec3> {
        let (i, _) = self.along.of(copy);
        self.colors.get(i as usize % self.colors.len().max(1)).map(|c| c.0)
    }
}
