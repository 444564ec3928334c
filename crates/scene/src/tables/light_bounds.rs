//! Where lights are and where they shine, as far as a tree of lights asks.

use super::LightRecord;
use super::motion_table::MotionTable;
use elementary::{acos, asin, atan, cos, sin, sin_cos};
use glam::Vec3;
use optics::light::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_PROJECTOR, LIGHT_RECTANGLE, LIGHT_SPHERE,
    LIGHT_SPOT, LIGHT_TRIANGLE, Light,
};
use optics::light_tree::{INFINITELY_FAR, LightGroup};
use optics::motion::{affine_product, motion_at};
use optics::moving_light::moved_light;
use optics::{Vec3f, vec3f};
use std::f32::consts::PI;

/// A light to be put into the tree.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    pub light: u32,
    pub bounds: Bounds,
    /// Where it is; infinitely far: unit direction towards it.
    pub center: Vec3,
    /// Of a sphere around the light, from its centre. Infinitely far: half angle under which it is seen, radians.
    radius: f32,
}

impl Leaf {
    /// `None` for lights that do not shine.
    pub fn new(light: u32, record: &LightRecord) -> Option<Self> {
        let bounds = Bounds::of(record)?;
        let usable = bounds.low.is_finite()
            && bounds.high.is_finite()
            && bounds.intensity.is_finite()
            && bounds.intensity > 0.0;
        let center = (bounds.low + bounds.high) * 0.5;
        let radius = match record.light.kind {
            LIGHT_DIRECTIONAL => 2.0 * asin((record.light.size * 0.5).clamp(0.0, 1.0).sqrt()),
            LIGHT_ENVIRONMENT if bounds.infinitely_far => PI,
            LIGHT_ENVIRONMENT => record.portals[3],
            LIGHT_TRIANGLE | LIGHT_RECTANGLE => {
                corners(&record.light).map(|corner| corner.distance(center)).into_iter().fold(0.0, f32::max)
            }
            LIGHT_SPHERE => record.light.size,
            _ => 0.0,
        };
        usable.then_some(Self { light, bounds, center, radius })
    }
}

impl Leaf {
    /// As [`Leaf::new`], of a light that may move: around all that it covers, and shining wherever
    /// it may shine.
    pub fn moving(light: u32, record: &LightRecord, motion: Option<&MotionTable>) -> Option<Self> {
        let still = Self::new(light, record)?;
        let moves = |m: &&MotionTable| !m.lights[light as usize].segments.is_empty();
        let Some(motion) = motion.filter(moves) else { return Some(still) };
        let segments = motion.of(motion.lights[light as usize].segments);
        let rest = motion.lights[light as usize].rest;
        // Everything that the light covers, in the space that it carries along.
        let own = LightRecord { light: moved_light(record.light, rest), ..*record };
        let (low, high) = Self::new(light, &own).map_or((still.bounds.low, still.bounds.high), |leaf| {
            (leaf.bounds.low.min(Vec3::ZERO), leaf.bounds.high.max(Vec3::ZERO))
        });
        let far = low.abs().max(high.abs()).to_array();
        let mut all = still;
        for segment in segments {
            let (pieces, room) = segment.pieces(far);
            for piece in 0..=pieces {
                let m = affine_product(motion_at(*segment, piece as f32 / pieces as f32), rest);
                let at = Self::new(light, &LightRecord { light: moved_light(record.light, m), ..*record })?;
                if still.bounds.infinitely_far {
                    // Between two directions, what is seen of neither is less than a piece turns.
                    let angle = acos(at.center.dot(still.center).clamp(-1.0, 1.0));
                    all.radius = all.radius.max(still.radius + angle + 0.1);
                    continue;
                }
                all.bounds.low = all.bounds.low.min(at.bounds.low - room);
                all.bounds.high = all.bounds.high.max(at.bounds.high + room);
                all.bounds.intensity = all.bounds.intensity.max(at.bounds.intensity);
            }
        }
        if !still.bounds.infinitely_far {
            all.center = (all.bounds.low + all.bounds.high) * 0.5;
            all.radius = (all.bounds.high - all.bounds.low).length() * 0.5;
            // Where it is, is not said; nor which way it shines.
            (all.bounds.spread, all.bounds.emission) = (PI, PI * 0.5);
        }
        Some(all)
    }
}

/// The corners of a rectangle, or of a triangle, whose last one is there twice.
fn corners(light: &Light) -> [Vec3; 4] {
    let [position, edge1, edge2] =
        [light.position, light.edge1, light.edge2].map(|v| Vec3::from(v.to_array()));
    let fourth = if light.kind == LIGHT_RECTANGLE { edge1 + edge2 } else { edge2 };
    [position, position + edge1, position + edge2, position + fourth]
}

/// Where a group of lights is, and where it shines: as [`LightGroup`], with angles in radians and a box.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    /// Corners of a box. Infinitely far: around the unit directions towards the lights.
    pub low: Vec3,
    pub high: Vec3,
    pub intensity: f32,
    axis: Vec3,
    spread: f32,
    emission: f32,
    two_sided: bool,
    pub infinitely_far: bool,
}

impl Bounds {
    pub fn of(record: &LightRecord) -> Option<Self> {
        let light = &record.light;
        let position = Vec3::from(light.position.to_array());
        let (edge1, edge2) = (Vec3::from(light.edge1.to_array()), Vec3::from(light.edge2.to_array()));
        let everywhere = Self {
            low: position,
            high: position,
            intensity: record.strength,
            axis: Vec3::Z,
            spread: PI,
            emission: PI * 0.5,
            two_sided: light.two_sided,
            infinitely_far: false,
        };
        match light.kind {
            LIGHT_TRIANGLE | LIGHT_RECTANGLE => {
                let corners = corners(light);
                let normal = edge1.cross(edge2);
                Some(Self {
                    low: corners.into_iter().fold(position, Vec3::min),
                    high: corners.into_iter().fold(position, Vec3::max),
                    axis: normal.try_normalize()?,
                    spread: 0.0,
                    ..everywhere
                })
            }
            LIGHT_SPHERE => {
                let radius = Vec3::splat(light.size);
                Some(Self { low: position - radius, high: position + radius, ..everywhere })
            }
            LIGHT_POINT => Some(everywhere),
            LIGHT_SPOT => {
                // From [`optics::light::spot_falloff_parameters`]: zero where cos · scale + offset is.
                let cos_outer = (-light.edge2.y / light.edge2.x).clamp(-1.0, 1.0);
                let outer = (acos(cos_outer) + 1e-3).min(PI);
                Some(Self { axis: edge1.try_normalize()?, spread: 0.0, emission: outer, ..everywhere })
            }
            LIGHT_PROJECTOR => {
                // From the axis to a corner of the picture.
                let corner = (edge1 + edge2).length() * 0.5;
                let axis = edge1.cross(edge2).try_normalize()?;
                Some(Self { axis, spread: 0.0, emission: atan(corner) + 1e-3, ..everywhere })
            }
            LIGHT_DIRECTIONAL => Some(Self { infinitely_far: true, ..everywhere }),
            LIGHT_ENVIRONMENT => {
                let [x, y, z, radius] = record.portals;
                let (center, reach) = (Vec3::new(x, y, z), Vec3::splat(radius));
                Some(Self {
                    low: center - reach,
                    high: center + reach,
                    infinitely_far: radius <= 0.0,
                    two_sided: true,
                    ..everywhere
                })
            }
            _ => None,
        }
    }

    pub fn union(&self, other: &Self) -> Self {
        let (axis, spread) = union_of_cones((self.axis, self.spread), (other.axis, other.spread));
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            intensity: self.intensity + other.intensity,
            axis,
            spread,
            emission: self.emission.max(other.emission),
            two_sided: self.two_sided || other.two_sided,
            infinitely_far: self.infinitely_far,
        }
    }

    /// What back ends know of the group, whose lights are `leaves`.
    pub fn group(&self, leaves: &[Leaf]) -> LightGroup {
        if self.infinitely_far {
            return self.group_of_directions(leaves);
        }
        let center = (self.low + self.high) * 0.5;
        let radius = leaves.iter().map(|leaf| leaf.center.distance(center) + leaf.radius).fold(0.0, f32::max);
        // Rounding must not make cones narrower, here or where they are used.
        let (sin_spread, cos_spread) = sin_cos((self.spread + 2e-4).min(PI));
        LightGroup {
            center: vec3(center),
            radius: radius * 1.0001,
            intensity: self.intensity,
            axis: vec3(self.axis),
            cos_spread,
            sin_spread,
            cos_emission: cos(self.emission),
            back: if self.two_sided { -1.0 } else { 1.0 },
        }
    }

    /// The same for lights that are infinitely far away.
    fn group_of_directions(&self, leaves: &[Leaf]) -> LightGroup {
        let axis = ((self.low + self.high) * 0.5).try_normalize().unwrap_or(Vec3::Y);
        let angle = |leaf: &Leaf| leaf.radius + acos(leaf.center.dot(axis).clamp(-1.0, 1.0));
        let angle =
            if let [only] = leaves { only.radius } else { leaves.iter().map(angle).fold(0.0, f32::max) };
        LightGroup {
            center: vec3(axis),
            radius: if angle < PI * 0.5 { sin(angle) } else { 1.0 },
            intensity: self.intensity,
            axis: vec3(-axis),
            cos_spread: 1.0,
            sin_spread: 0.0,
            cos_emission: 0.0,
            back: INFINITELY_FAR,
        }
    }

    /// How much a group costs: its intensity, times how large it is, times how many directions it shines into.
    pub fn cost(&self) -> f32 {
        self.intensity * area(self.high - self.low) * self.solid_angle_measure()
    }

    /// The measure M_Ω of directions, by the cosine beyond the cone (Conty Estévez and Kulla, equation 1).
    fn solid_angle_measure(&self) -> f32 {
        let (sin_spread, cos_spread) = sin_cos(self.spread);
        let outer = (self.spread + self.emission).min(PI);
        let beyond = 2.0 * outer * sin_spread - cos(self.spread - 2.0 * outer);
        2.0 * PI * (1.0 - cos_spread) + PI * 0.5 * (beyond - 2.0 * self.spread * sin_spread + cos_spread)
    }
}

/// The narrowest cone around two, each a unit axis and a half angle in radians.
fn union_of_cones(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = acos(wide.0.dot(narrow.0).clamp(-1.0, 1.0));
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let spread = (wide.1 + between + narrow.1) * 0.5;
    let pivot = wide.0.cross(narrow.0);
    if spread >= PI || pivot.length_squared() < 1e-20 {
        return (wide.0, PI);
    }
    let turn = glam::Quat::from_axis_angle(pivot.normalize(), spread - wide.1);
    // What rounding moves the axis by is added to the angle.
    ((turn * wide.0).normalize(), (spread + 1e-5).min(PI))
}

/// Area of a box. One on a line or at a point has none; its length must still count.
pub(super) fn area(size: Vec3) -> f32 {
    2.0 * (size.x * size.y + size.y * size.z + size.z * size.x) + 1e-3 * size.length_squared()
}

pub(super) fn vec3(v: Vec3) -> Vec3f {
    vec3f(v.x, v.y, v.z)
}
